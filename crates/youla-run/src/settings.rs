//! run.toml: everything that a run is asked to do, one struct for TOML, library and documentation.

use super::certificate::CertificateSettings;
use super::disturbance::DisturbanceSettings;
use super::explain::{explain, problem_at};
use super::grey_box::GreyBoxSettings;
use super::models::{ControllerSettings, NominalModel};
use super::segments;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::io::Read;
use std::path::{Path, PathBuf};
use youla::identify::innovation_form::{DeviationOptions, Structure};
use youla::identify::subspace::SubspaceOptions;
use youla::identify::subspace::stabilisation::StabilisationOptions;
use youla::reduce::ReductionOptions;
use youla::signal::Detrend;
use youla_greybox::refine::RefineOptions;
use youla_io::{ChannelRef, ChannelSpec, CsvOptions, Gaps, open};
use youla_loop::check::CheckOptions;
use youla_loop::redesign::RedesignOptions;

/// The whole of run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunSettings {
    /// Name of the machine or of the experiment; titles and file names use it.
    pub name: String,
    /// Where the records are and what their channels mean.
    pub data: DataSettings,
    /// The nominal model G(0).
    pub nominal: NominalModel,
    /// The controller that ran while the data were logged.
    pub controller: ControllerSettings,
    /// How the coprime factors are built.
    #[serde(default)]
    pub factors: FactorSettings,
    /// Identification of S from (alpha, beta).
    #[serde(default)]
    pub hansen: SubspaceOptions,
    /// What is known of S beforehand.
    #[serde(default)]
    pub deviation: DeviationSettings,
    /// Direct identification from (u, y), for comparison; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direct: Option<SubspaceOptions>,
    /// Reduction of G(S); left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduction: Option<ReductionOptions>,
    /// A physical structure, estimated from the result of the scheme on; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grey_box: Option<GreyBoxSettings>,
    /// What is stated about the loop; its cheap parts also without this table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certificate: Option<CertificateSettings>,
    /// A new controller on the identified model; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redesign: Option<RedesignOptions>,
    /// The stabilisation diagrams of S and of the direct model.
    #[serde(default)]
    pub stabilisation: StabilisationSettings,
    /// How models are held against the verification records.
    #[serde(default)]
    pub verification: VerificationSettings,
    /// Thresholds of the check of the data.
    #[serde(default)]
    pub check: CheckOptions,
    /// Frequency responses in the report.
    #[serde(default)]
    pub frequency_response: FrequencySettings,
    /// Seed of a simulated record; absent for measured data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
}

/// Records and the meaning of their channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSettings {
    /// Sample time in seconds; this or `time_column` must be given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_time: Option<f64>,
    /// Column with the time in seconds; with `sample_time` both must agree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_column: Option<ChannelRef>,
    /// Greatest deviation of a time step, as a part of the sample time.
    #[serde(default = "default_tolerance")]
    pub time_tolerance: f64,
    /// What to do with a file whose time column has gaps.
    #[serde(default)]
    pub gaps: Gaps,
    /// Plant inputs u as applied, after saturation.
    pub inputs: Vec<ChannelSpec>,
    /// Measured plant outputs y.
    pub outputs: Vec<ChannelSpec>,
    /// Known excitation added at the plant input, one channel per input.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub input_excitation: Vec<ChannelSpec>,
    /// Known reference r, one channel per output.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reference: Vec<ChannelSpec>,
    /// Known excitation alpha of Fig. 3, one channel per input; not together with `input_excitation`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alpha: Vec<ChannelSpec>,
    /// How text files are read.
    #[serde(default)]
    pub csv: CsvOptions,
    /// What is removed from every channel before identification and verification.
    #[serde(default)]
    pub detrend: Detrend,
    /// Lines of known frequency in the outputs, as of unbalance; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disturbance: Option<DisturbanceSettings>,
    /// Records to identify from; several files are several experiments.
    pub estimation: Vec<DataFile>,
    /// Records to verify on; never used for identification.
    #[serde(default)]
    pub verification: Vec<DataFile>,
}

fn default_tolerance() -> f64 {
    1e-3
}

/// One file, or a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataFile {
    /// Path, relative to run.toml.
    pub file: PathBuf,
    /// Samples skipped at the start.
    #[serde(default)]
    pub skip: usize,
    /// Samples used after that; all when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub take: Option<usize>,
    /// First and last row (counted from 1) of each stretch to use, as records of their own; instead of `skip` and `take`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<[usize; 2]>,
    /// Name in reports; the file's name when absent. Several records of one file are numbered: `name-1`, `name-2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

impl DataFile {
    /// Name in reports and in summary.json.
    pub fn label(&self) -> String {
        let stem = || {
            let name = self.file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            name.split('.').next().unwrap_or_default().to_owned()
        };
        self.name.clone().unwrap_or_else(stem)
    }
}

/// How the factors of an arbitrary controller are built (`CoprimeFactors::stacked` or `shifted_to`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Construction {
    /// Right factors of plant and controller stacked, then inverted.
    #[default]
    Stacked,
    /// Observer-based factors of the plant, shifted by Q.
    Shifted,
}

/// Options of the coprime factors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FactorSettings {
    /// For controllers that are not given as observer gains.
    pub construction: Construction,
    /// SubspaceMethod of the inputs against the outputs in the LQR that chooses F; both are measured in their rms on the
    /// estimation records.
    pub input_weight: f64,
    /// Covariance of the output noise against that of the inputs in the Kalman predictor that chooses L (shifted
    /// construction only), both in rms of the estimation records.
    pub output_noise: f64,
    /// Samples of alpha and beta dropped at the start of each record, where the signal filter starts from an unknown
    /// state; when absent, until its slowest transient has decayed to 1e-3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle: Option<usize>,
}

impl Default for FactorSettings {
    fn default() -> Self {
        FactorSettings { construction: Construction::default(), input_weight: 1.0, output_noise: 1.0, settle: None }
    }
}

/// Options of the stabilisation diagrams.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StabilisationSettings {
    /// Largest order; when absent, twice the order of the model and at least 20, as far as the horizon allows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_order: Option<usize>,
    /// When poles of different orders count as the same.
    pub criteria: StabilisationOptions,
}

/// How a model predicts a verification record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Prediction {
    /// The model under the actual controller, driven by the known excitations alone. The only fair test for unstable or
    /// integrating plants.
    ClosedLoop,
    /// The model driven by the measured u, initial state estimated.
    #[default]
    OpenLoop,
}

/// Options of the verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VerificationSettings {
    /// What drives the models.
    pub prediction: Prediction,
    /// Samples at the start of each record that do not count in the fit (transient of unknown initial states).
    pub skip: usize,
}

/// Options of the frequency responses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FrequencySettings {
    /// Samples per window of the non-parametric estimate (Welch, Hann).
    pub window: usize,
    /// Overlap of windows, as a part of a window.
    pub overlap: f64,
    /// Lowest frequency of the models' curves, Hz; a 300th of the Nyquist frequency when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_hz: Option<f64>,
    /// Number of frequencies of the models' curves, spaced logarithmically up to Nyquist.
    pub points: usize,
}

impl Default for FrequencySettings {
    fn default() -> Self {
        FrequencySettings { window: 4096, overlap: 0.5, from_hz: None, points: 400 }
    }
}

impl RunSettings {
    /// Reads run.toml.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with line and column, and the nearest known key for a misspelt one; [`youla_io::Error::Io`].
    pub fn read(path: &Path) -> Result<Self> {
        let mut bytes = Vec::new();
        open(path)?
            .read_to_end(&mut bytes)
            .map_err(|source| Error::File(youla_io::Error::Io { path: path.to_owned(), source }))?;
        let text = std::str::from_utf8(&bytes).map_err(|e| {
            let good = String::from_utf8_lossy(&bytes[..e.valid_up_to()]);
            problem_at(path, &good, good.len(), "this is not text in UTF-8".into())
        })?;
        Self::parse(text, path)
    }

    /// Parses the text of run.toml; `path` is named in errors.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let settings: Self = toml::from_str(text).map_err(|e| explain(&e, text, path))?;
        settings.check(path)?;
        Ok(settings)
    }

    /// The same settings as TOML.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] for values that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string_pretty(self).map_err(|e| {
            Error::File(youla_io::Error::Settings { path: PathBuf::from("run.toml"), at: None, problem: e.to_string() })
        })
    }

    fn check(&self, path: &Path) -> Result<()> {
        let structure = || self.grey_box.as_ref()?.problem(self.data.inputs.len(), self.data.outputs.len());
        let problem = self.record_problem().or_else(|| self.channel_problem()).or_else(|| self.number_problem());
        let problem = problem.or_else(structure).or_else(|| self.certificate.as_ref()?.problem());
        problem.map_or(Ok(()), |problem| {
            Err(Error::File(youla_io::Error::Settings { path: path.to_owned(), at: None, problem }))
        })
    }

    fn record_problem(&self) -> Option<String> {
        let d = &self.data;
        if d.sample_time.is_none() && d.time_column.is_none() {
            return Some("[data] has neither sample_time nor time_column; the sample time is never guessed".into());
        }
        if d.estimation.is_empty() {
            return Some("[data] names no estimation record; add [[data.estimation]] with a file".into());
        }
        if d.gaps == Gaps::Split && d.time_column.is_none() {
            return Some("[data] gaps = \"split\" needs a time_column, which shows the gaps".into());
        }
        if let Some(problem) = d.estimation.iter().chain(&d.verification).find_map(segments::problem) {
            return Some(problem);
        }
        let mut labels = HashSet::new();
        for label in d.estimation.iter().chain(&d.verification).map(DataFile::label) {
            if label.is_empty() || label.contains(['/', '\\']) || label.contains(char::is_control) {
                return Some(format!("the record name {label:?} cannot be a file name; give another `name`"));
            }
            if !labels.insert(label.clone()) {
                return Some(format!("two records are named {label:?}; give one of them another `name`"));
            }
        }
        None
    }

    fn channel_problem(&self) -> Option<String> {
        let d = &self.data;
        let mut names = HashSet::new();
        let groups = [&d.inputs, &d.outputs, &d.input_excitation, &d.reference, &d.alpha];
        if let Some(twice) = groups.into_iter().flatten().find(|c| !names.insert(&c.name)) {
            return Some(format!("[data] has more than one channel named {:?}", twice.name));
        }
        for (key, channels) in [("inputs", &d.inputs), ("outputs", &d.outputs)] {
            if channels.is_empty() {
                return Some(format!("[data] {key} is empty, but must list at least one channel"));
            }
        }
        if !d.alpha.is_empty() && !d.input_excitation.is_empty() {
            return Some("[data] has both alpha and input_excitation; give the one that was injected".into());
        }
        for (key, channels, of, wanted) in [
            ("input_excitation", &d.input_excitation, "inputs", d.inputs.len()),
            ("alpha", &d.alpha, "inputs", d.inputs.len()),
            ("reference", &d.reference, "outputs", d.outputs.len()),
        ] {
            if !channels.is_empty() && channels.len() != wanted {
                let found = channels.len();
                return Some(format!("[data] {key} must list as many channels as {of} ({wanted}), but lists {found}"));
            }
        }
        if let Some(problem) = d.disturbance.as_ref().and_then(DisturbanceSettings::problem) {
            return Some(problem.into());
        }
        let known = !(d.alpha.is_empty() && d.input_excitation.is_empty() && d.reference.is_empty());
        if self.verification.prediction == Prediction::ClosedLoop && !known {
            return Some(
                "[verification] prediction = \"closed-loop\" needs a known excitation: input_excitation, reference or alpha"
                    .into(),
            );
        }
        let of_structure = self.grey_box.as_ref().is_some_and(|g| g.prediction == Prediction::ClosedLoop);
        if of_structure && !known {
            return Some(
                "[grey_box] prediction = \"closed-loop\" needs a known excitation: input_excitation, reference or alpha".into(),
            );
        }
        None
    }

    /// The first number outside of its range.
    fn number_problem(&self) -> Option<String> {
        let (factors, response) = (&self.factors, &self.frequency_response);
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let part = |x: f64| (0.0..1.0).contains(&x);
        let given = |x: Option<f64>| x.unwrap_or(1.0);
        let (points, window) = (response.points, response.window);
        [
            (
                "[data] sample_time",
                given(self.data.sample_time),
                "a positive number of seconds",
                positive as fn(f64) -> bool,
            ),
            ("[data] time_tolerance", self.data.time_tolerance, "at least 0 and below 1", part),
            ("[factors] input_weight", factors.input_weight, "positive", positive),
            ("[factors] output_noise", factors.output_noise, "positive", positive),
            ("[stabilisation] max_order", given(self.stabilisation.max_order.map(|n| n as f64)), "at least 1", |x| {
                x >= 1.0
            }),
            ("[frequency_response] overlap", response.overlap, "at least 0 and below 1", part),
            ("[frequency_response] from_hz", given(response.from_hz), "a positive frequency", positive),
            ("[frequency_response] window", window as f64, "at least 4 samples", |x| x >= 4.0),
            ("[frequency_response] points", points as f64, "from 2 to 100000", |x| (2.0..=1e5).contains(&x)),
        ]
        .into_iter()
        .find(|(_, value, _, good)| !good(*value))
        .map(|(key, value, must, _)| format!("{key} is {value}, but must be {must}"))
    }
}

/// What is known of S before it is identified.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DeviationSettings {
    /// How the noise of beta is modelled.
    pub structure: Structure,
    /// Largest number of refits in the innovation form, at least 1.
    pub iterations: usize,
    /// Relative change of K_s below which it has settled.
    pub tolerance: f64,
    /// How S is refined by the prediction-error method afterwards; not at all when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refine: Option<RefineOptions>,
}

impl Default for DeviationSettings {
    fn default() -> Self {
        let DeviationOptions { structure, iterations, tolerance } = DeviationOptions::default();
        DeviationSettings { structure, iterations, tolerance, refine: None }
    }
}

impl DeviationSettings {
    /// The options of the identification of S.
    pub fn options(&self) -> DeviationOptions {
        DeviationOptions { structure: self.structure, iterations: self.iterations, tolerance: self.tolerance }
    }
}
