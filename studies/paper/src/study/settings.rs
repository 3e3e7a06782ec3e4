//! Everything that was chosen for the paper, as one TOML file.

use super::method::StudyMethod;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use youla::identify::subspace::SubspaceOptions;
use youla::reduce::{ReducedOrder, ReductionMethod, ReductionOptions};
use youla::signal::RampedExcitation;
use youla_greybox::GreyBoxOptions;
use youla_twin::rig::Bearing;

const NEEDS_LOOP: &str = "the study reduces models without their loop; choose another method or order";

/// The tables of the settings file; its comments say why each value is what it is.
///
/// ```
/// let settings = youla_paper::study::PaperSettings::shipped();
/// assert_eq!((settings.study.models, settings.experiments.rpm), (500, 2500.0));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperSettings {
    /// Seed of everything random.
    pub seed: u64,
    /// Methods that the study and the map compare.
    pub methods: Vec<StudyMethod>,
    /// Controllers.
    pub controller: StudyController,
    /// Figs 4 and 5.
    pub study: StudySettings,
    /// The crossover map.
    pub crossover: CrossoverSettings,
    /// Table 1 and Figs 6 to 10.
    pub experiments: ExperimentSettings,
    /// Identification of S.
    pub hansen: SubspaceOptions,
    /// Identification from u and y.
    pub direct: SubspaceOptions,
    /// Prediction error.
    pub pem: GreyBoxOptions,
    /// Eq. (29).
    pub reduction: ReductionOptions,
}

/// Controllers on nominal models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyController {
    /// Weight of a displacement, per um^2.
    pub displacement_weight: f64,
    /// Weight of a velocity, per (um/s)^2.
    pub velocity_weight: f64,
    /// Intensity of the noise at the inputs that the observer assumes, V^2.
    pub input_noise: f64,
    /// Intensity of the output noise that the observer assumes, um^2.
    pub output_noise: f64,
    /// Largest peak of the output sensitivity that counts as stabilised.
    pub peak_sensitivity: f64,
    /// Weights of the command, per V^2, in the order in which they are tried.
    pub command_weights: Vec<f64>,
}

/// The simulation study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySettings {
    /// Number of nominal models.
    pub models: usize,
    /// Range of theta, uniform.
    pub theta: [f64; 2],
    /// Samples of the estimation record.
    pub samples: usize,
    /// Samples of the noise-free verification record.
    pub verification_samples: usize,
    /// alpha.
    pub excitation: RampedExcitation,
}

/// The grid of the crossover map; its records are those of the study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrossoverSettings {
    /// Output noise, um rms.
    pub noise: Vec<f64>,
    /// Degradation of the nominal model.
    pub theta: Vec<f64>,
    /// Weights of the command, per V^2: the larger, the weaker the feedback.
    pub command_weights: Vec<f64>,
    /// Loops per cell.
    pub repetitions: usize,
}

/// The three experiments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentSettings {
    /// Weight of the command, per V^2.
    pub command_weight: f64,
    /// Samples of the estimation record, and of the open-loop record for the nominal model.
    pub samples: usize,
    /// Samples of the verification record.
    pub verification_samples: usize,
    /// Samples at the start of a record that are not used where the shaft turns.
    pub settle: usize,
    /// Speed of the experiment with a turning shaft.
    pub rpm: f64,
    /// Harmonics of the speed that are subtracted before identification.
    pub harmonics: usize,
    /// alpha.
    pub excitation: RampedExcitation,
    /// Factors on A of the nominal model at which the prediction-error method is started besides.
    pub start_factors: Vec<f64>,
    /// Where the open-loop fit of the nominal model starts.
    pub start: Bearing,
}

impl PaperSettings {
    /// The file that ships with the program, to be copied and edited.
    pub const TOML: &str = include_str!("../../assets/paper.toml");

    /// The settings that ship with the program.
    pub fn shipped() -> Self {
        Self::parse(Self::TOML, "paper.toml".as_ref()).expect("the shipped file is read by a test")
    }

    /// Reads a settings file.
    ///
    /// # Errors
    /// Those of [`PaperSettings::parse`]; [`youla_io::Error::Io`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = youla_io::read_text(path)?;
        Self::parse(&text, path)
    }

    /// Parses the text of a settings file; `path` is named in errors.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with line, column and key; [`youla::Error::OutOfRange`] for a value without meaning.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let settings: Self = youla_io::toml_file::parse(text, path)?;
        settings.check().map_err(|e| e.within(path.display().to_string()))?;
        Ok(settings)
    }

    /// The models that are compared: the nominal one, then the methods.
    pub fn compared(&self) -> impl Iterator<Item = StudyMethod> {
        [StudyMethod::Nominal].into_iter().chain(self.methods.iter().copied().filter(|m| *m != StudyMethod::Nominal))
    }

    /// The same with a number of models, and with the coarse map that suits a study of fewer than 100.
    pub fn with_models(mut self, models: usize) -> Self {
        self.study.models = models;
        if models < 100 {
            let ends = |values: &[f64]| match values {
                [first, .., last] => vec![*first, values[values.len() / 2], *last],
                few => few.to_vec(),
            };
            self.crossover.noise = ends(&self.crossover.noise);
            self.crossover.theta = ends(&self.crossover.theta);
            self.crossover.repetitions = 1;
        }
        self
    }

    /// Fails for the first value without meaning.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] naming the key; [`youla::Error::Unsupported`] for a reduction that weighs or measures the loop: the study
    /// reduces models alone.
    pub fn check(&self) -> Result<()> {
        let (c, s, x, e) = (&self.controller, &self.study, &self.crossover, &self.experiments);
        positive("controller.displacement_weight", &[c.displacement_weight])?;
        positive("controller.velocity_weight", &[c.velocity_weight])?;
        positive("controller.input_noise", &[c.input_noise])?;
        positive("controller.output_noise", &[c.output_noise])?;
        within("controller.peak_sensitivity", c.peak_sensitivity, 1.0, 1e6, "a number from 1 to 1e6")?;
        filled("controller.command_weights", &c.command_weights)?;
        theta("study.theta", &s.theta)?;
        count("study.models", s.models, 1, 1_000_000)?;
        filled("crossover.command_weights", &x.command_weights)?;
        filled("crossover.theta", &x.theta)?;
        theta("crossover.theta", &x.theta)?;
        filled("crossover.noise", &x.noise)?;
        count("crossover.repetitions", x.repetitions, 1, 1000)?;
        positive("experiments.command_weight", &[e.command_weight])?;
        within("experiments.rpm", e.rpm, f64::MIN_POSITIVE, f64::MAX, "a positive number")?;
        filled("experiments.start_factors", &e.start_factors)?;
        count("methods", self.methods.len(), 1, StudyMethod::ALL.len())?;
        for method in &self.methods {
            let times = self.methods.iter().filter(|other| *other == method).count();
            within(&format!("the number of times that methods names {}", method.key()), times as f64, 1.0, 1.0, "1")?;
        }
        for (what, samples) in [
            ("study.samples", s.samples),
            ("study.verification_samples", s.verification_samples),
            ("experiments.samples", e.samples),
            ("experiments.verification_samples", e.verification_samples),
        ] {
            count(what, samples, 100, 100_000_000)?;
        }
        if self.reduction.method == ReductionMethod::Weighted {
            return Err(Error::Method(youla::Error::Unsupported {
                what: "[reduction] method = \"weighted\"",
                instead: NEEDS_LOOP,
            }));
        }
        if matches!(self.reduction.order, ReducedOrder::ClosedLoop(_)) {
            return Err(Error::Method(youla::Error::Unsupported {
                what: "[reduction] order = { closed-loop = ... }",
                instead: NEEDS_LOOP,
            }));
        }
        count("experiments.settle", e.settle, 0, e.samples.min(e.verification_samples) / 2)?;
        count("experiments.harmonics", e.harmonics, 0, 20)
    }
}

fn within(what: &str, value: f64, low: f64, high: f64, must: &'static str) -> Result<()> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(Error::Method(youla::Error::OutOfRange { what: what.into(), value, must }))
    }
}

fn positive(what: &str, values: &[f64]) -> Result<()> {
    values.iter().try_for_each(|v| within(what, *v, f64::MIN_POSITIVE, f64::MAX, "a positive number"))
}

fn filled(what: &str, values: &[f64]) -> Result<()> {
    within(what, values.len() as f64, 1.0, f64::MAX, "a list of at least one value")?;
    positive(what, values)
}

fn theta(what: &str, values: &[f64]) -> Result<()> {
    values.iter().try_for_each(|v| within(what, *v, 0.0, 1.0, "from 0 to 1"))
}

fn count(what: &str, value: usize, low: usize, high: usize) -> Result<()> {
    if value < low || value > high {
        let must = "within the range in which it has a meaning";
        return Err(Error::Method(youla::Error::OutOfRange {
            what: format!("{what} (from {low} to {high})"),
            value: value as f64,
            must,
        }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_file_reads_back() {
        let settings = PaperSettings::shipped();
        let text = toml::to_string(&settings).unwrap();
        assert_eq!(PaperSettings::parse(&text, "again.toml".as_ref()).unwrap(), settings);
    }

    #[test]
    fn bad_values_are_named() {
        let refused = |from: &str, to: &str| {
            assert!(PaperSettings::TOML.contains(from), "{from}");
            PaperSettings::parse(&PaperSettings::TOML.replacen(from, to, 1), "p.toml".as_ref()).unwrap_err().to_string()
        };
        let unknown = refused("\"direct\", \"hansen\"", "\"direkt\"");
        assert!(unknown.contains("did you mean `direct`") && unknown.starts_with("p.toml:10:"), "{unknown}");
        assert!(refused("models = 500", "models = 0").contains("study.models (from 1 to 1000000) is 0"));
        assert!(refused("theta = [0.0, 1.0]", "theta = [0.0, 1.5]").contains("study.theta is 1.5"));
        assert!(refused("peak_sensitivity = 3.0", "peak_sensitivity = 0.5").contains("peak_sensitivity is 0.5"));
        assert!(refused("rpm = 2500.0", "rpm = -1.0").contains("experiments.rpm is -1"));
    }
}
