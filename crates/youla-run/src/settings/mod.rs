//! run.toml: everything that a run is asked to do, one struct for TOML, library and documentation.

mod cascade;
pub(crate) mod computed;
mod controller;
mod data;
mod disturbance;
mod explain;
mod feedback;
mod grey_box;
mod models;
mod options;
mod pid;
mod places;
mod readings;
mod reference_path;

pub use cascade::{Cascade, CascadeGains};
pub use controller::{ControllerSettings, Hold};
pub use data::{DataFile, DataSettings};
pub(crate) use disturbance::TACHO;
pub use disturbance::{DisturbanceSettings, TachoUnit};
pub use feedback::Feedback;
pub use grey_box::{AlternativeStructure, GreyBoxSettings};
pub use models::{Domain, NominalModel, Polynomials};
pub use options::{FactorSettings, FrequencySettings, PredictionKind, VerificationSettings};
pub use pid::{Discretisation, IdealPid, LoopGain, ParallelPid};
pub use places::tables_with;

use crate::{Error, Result};
use explain::{explain, problem_at};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use youla::identify::likelihood::LikelihoodOptions;
use youla::identify::subspace::SubspaceOptions;
use youla::reduce::ReductionOptions;
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
    /// The nominal model G(0), for factors, the Hansen scheme and comparison; the recommended model does not rest on it. Without one the
    /// factors are those of the recommended model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<NominalModel>,
    /// The controller that ran while the data were logged.
    pub controller: ControllerSettings,
    /// What is known of the recommended model beforehand; the rest is chosen by the evidence of the records.
    #[serde(default)]
    pub recommended: LikelihoodOptions,
    /// How the coprime factors are built.
    #[serde(default)]
    pub factors: FactorSettings,
    /// Identification of S from (alpha, beta) by the modified Hansen scheme, for comparison; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hansen: Option<SubspaceOptions>,
    /// Direct identification from (u, y), for comparison; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direct: Option<SubspaceOptions>,
    /// Reduction of G(S); left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduction: Option<ReductionOptions>,
    /// A physical structure, estimated from the result of the scheme on; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grey_box: Option<GreyBoxSettings>,
    /// A new controller on the identified model; left out when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redesign: Option<RedesignOptions>,
    /// How models are compared with the verification records.
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

impl RunSettings {
    /// What a user knows, everything else by default.
    pub fn new(name: String, data: DataSettings, controller: ControllerSettings) -> Self {
        RunSettings {
            name,
            data,
            nominal: None,
            controller,
            recommended: LikelihoodOptions::default(),
            factors: FactorSettings::default(),
            hansen: None,
            direct: None,
            reduction: None,
            grey_box: None,
            redesign: None,
            verification: VerificationSettings::default(),
            check: CheckOptions::default(),
            frequency_response: FrequencySettings::default(),
            seed: None,
        }
    }

    /// Reads run.toml.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with line and column, and the nearest known key for a misspelt one; [`youla_io::Error::Io`].
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = youla_io::read_bytes(path)?;
        if is_log(path, &bytes) {
            let problem = "this is no run.toml; for a log, say what its columns mean: --input, --output and --sample-time or --time, or \
                           write a run.toml with `youla init`"
                .into();
            return Err(Error::File(youla_io::Error::Settings { path: path.to_owned(), at: None, problem }));
        }
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
        let settings: Self = parse_table(text, path, "")?;
        let settings = settings.with_reference_path().map_err(|problem| refused(problem, path))?;
        refuse(settings.problem(), path)?;
        Ok(settings)
    }

    /// For a run.toml whose `[controller]` lacks `feedback` and nothing else: the settings with either sign.
    pub fn without_feedback(text: &str) -> Option<impl Fn(Feedback) -> Option<Self> + use<>> {
        let table: toml::Table = toml::from_str(text).ok()?;
        let form = table.get("controller")?.as_table()?.iter().find_map(|(form, of)| {
            let lacks = of.as_table().is_some_and(|of| !of.contains_key("feedback"));
            lacks.then(|| form.clone())
        })?;
        Some(move |sign: Feedback| {
            let mut table = table.clone();
            let controller = table.get_mut("controller")?.get_mut(&form)?.as_table_mut()?;
            controller.insert("feedback".into(), toml::Value::try_from(sign).ok()?);
            // Through text, as the file itself: a second reader of tables would be a megabyte of the program.
            toml::from_str::<Self>(&toml::to_string(&table).ok()?).ok()?.checked().ok()
        })
    }

    /// Settings built in code, if they are valid, as [`RunSettings::parse`] makes them of a file: a path of the reference is a known
    /// excitation.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with the key and what it must be, under the name run.toml.
    pub fn checked(self) -> Result<Self> {
        let settings = self.with_reference_path().map_err(|problem| refused(problem, Path::new("run.toml")))?;
        settings.check()?;
        Ok(settings)
    }

    /// Checks values that the types allow and the method does not; every function that takes settings calls it.
    ///
    /// # Errors
    /// As [`RunSettings::checked`].
    pub fn check(&self) -> Result<()> {
        refuse(self.problem(), Path::new("run.toml"))
    }

    /// The same settings as TOML. Options of the methods for which run.toml has no key are left out.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] for values that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string_pretty(self).map_err(|e| {
            Error::File(youla_io::Error::Settings { path: PathBuf::from("run.toml"), at: None, problem: e.to_string() })
        })
    }

    /// The files that a run reads, below the folder of the settings: logs, models and measured responses.
    pub fn files(&self, folder: &Path) -> Vec<PathBuf> {
        let all = serde_json::to_value(self).unwrap_or_default();
        file_names(&all).into_iter().map(|file| folder.join(file)).collect()
    }

    fn problem(&self) -> Option<String> {
        let structure = || self.grey_box.as_ref()?.problem(self.data.inputs.len(), self.data.outputs.len());
        let problem = self
            .data
            .problem()
            .or_else(|| self.response_problem())
            .or_else(|| self.controller.problem())
            .or_else(|| self.reference_problem())
            .or_else(|| self.nominal_problem())
            .or_else(|| self.loop_problem())
            .or_else(|| self.pid_problem())
            .or_else(|| self.redesign_problem())
            .or_else(|| self.number_problem());
        problem.or_else(structure)
    }

    fn reference_problem(&self) -> Option<String> {
        let unread = self.controller.has_reference_path() && !self.data.has_reference_path();
        unread.then(|| "reference_numerator belongs to settings that were `checked`".to_owned())
    }

    fn response_problem(&self) -> Option<String> {
        self.data.response.first()?;
        let asked = [
            ("direct", self.direct.is_some()),
            ("reduction", self.reduction.is_some()),
            ("grey_box", self.grey_box.is_some()),
        ];
        let (table, _) = asked.into_iter().find(|(_, asked)| *asked)?;
        Some(format!("[{table}] needs estimation records, but [data] has a response; leave the table out"))
    }

    /// What needs a nominal model where none is given.
    fn nominal_problem(&self) -> Option<String> {
        let asked = [
            ("[hansen] identifies the deviation from", self.hansen.is_some()),
            ("[data] alpha is a port of the factors of", !self.data.alpha.is_empty()),
            ("[controller.observer] has the states of", matches!(self.controller, ControllerSettings::Observer { .. })),
        ];
        let (what, _) = asked.into_iter().find(|(_, asked)| *asked && self.nominal.is_none())?;
        Some(format!("{what} a nominal model; add [nominal], a model of the plant, which may be rough"))
    }

    /// PIDs for another number of loops than the machine has.
    fn pid_problem(&self) -> Option<String> {
        let loops = self.controller.pid_loops()?;
        let (inputs, outputs) = (self.data.inputs.len(), self.data.outputs.len());
        let remedy = match (loops, inputs == outputs) {
            _ if (inputs, outputs) == (loops, loops) => return None,
            (1, true) => "give each gain a list with one number for each loop, input k following output k",
            _ => {
                "a PID leads an output to its input; state any other controller in [controller.difference_equation] or another form"
            }
        };
        let s = if loops == 1 { "" } else { "s" };
        Some(format!(
            "[controller] holds the PID{s} of {loops} loop{s}, but [data] has {inputs} inputs and {outputs} outputs; {remedy}"
        ))
    }

    fn redesign_problem(&self) -> Option<String> {
        let redesign = self.redesign.as_ref()?;
        let (inputs, outputs) = (self.data.inputs.len(), self.data.outputs.len());
        if redesign.structure.is_some() && inputs != outputs {
            return Some(format!(
                "[redesign] structure = \"pid\" designs a PID for each loop of a machine with as many outputs as inputs, but [data] has \
                 {inputs} inputs and {outputs} outputs; leave `structure` out for method = \"lqg\""
            ));
        }
        if redesign.structure.is_none() && !redesign.pid.is_default() {
            return Some(
                "[redesign.pid] is read with structure = \"pid\" in [redesign] only; add that, or leave the table out"
                    .into(),
            );
        }
        redesign.pid.check().err().map(|e| e.to_string())
    }

    fn loop_problem(&self) -> Option<String> {
        let known = self.data.excitation_is_known();
        if self.verification.prediction == Some(PredictionKind::ClosedLoop) && !known {
            return Some(
                "[verification] prediction = \"closed-loop\" needs a known excitation: input_excitation, reference or alpha"
                    .into(),
            );
        }
        let of_structure = self.grey_box.as_ref().is_some_and(|g| g.prediction == PredictionKind::ClosedLoop);
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
        let (from, window) = (response.from_hz.unwrap_or(1.0), response.window.map_or(f64::INFINITY, |w| w as f64));
        [
            ("[factors] input_weight", factors.input_weight, "positive", positive as fn(f64) -> bool),
            ("[frequency_response] from_hz", from, "a positive frequency", positive),
            ("[frequency_response] window", window, "at least 4 samples", |x| x >= 4.0),
        ]
        .into_iter()
        .find(|(_, value, _, good)| !good(*value))
        .map(|(key, value, must, _)| format!("{key} is {value}, but must be {must}"))
    }
}

/// Reads a text whose top level is the table `at` of run.toml, the whole of it where `at` is empty.
///
/// # Errors
/// [`youla_io::Error::Settings`] with line and column, misspelt keys with the nearest known one.
pub fn parse_table<T: serde::de::DeserializeOwned>(text: &str, path: &Path, at: &str) -> Result<T> {
    toml::from_str(text).map_err(|e| explain(&e, text, path, at))
}

/// Whether a file that should be a run.toml is data: not named so, and no TOML.
fn is_log(path: &Path, bytes: &[u8]) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let toml = || std::str::from_utf8(bytes).is_ok_and(|text| toml::from_str::<toml::Table>(text).is_ok());
    !named && !bytes.is_empty() && !toml()
}

/// The first problem of settings as an error.
fn refuse(problem: Option<String>, path: &Path) -> Result<()> {
    match problem {
        None => Ok(()),
        Some(problem) => Err(refused(problem, path)),
    }
}

fn refused(problem: String, path: &Path) -> Error {
    Error::File(youla_io::Error::Settings { path: path.to_owned(), at: None, problem })
}
/// The texts of all keys `file`.
fn file_names(value: &serde_json::Value) -> Vec<&str> {
    match value {
        serde_json::Value::Object(table) => {
            let own = table.get("file").and_then(serde_json::Value::as_str);
            own.into_iter().chain(table.values().flat_map(file_names)).collect()
        }
        serde_json::Value::Array(all) => all.iter().flat_map(file_names).collect(),
        _ => Vec::new(),
    }
}
