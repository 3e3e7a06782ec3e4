//! `[data.disturbance]` of run.toml: lines of known frequency in the outputs, from stated frequencies or a tacho channel.
//!
//! Identification projects them out of its data and finds their amplitudes. Verification is fair to every model in the same
//! way: measured and predicted outputs are compared after the best lines of each have been taken out,
//! ```text
//! fit(P y, P yp),    P: onto the complement of the lines over the samples that count
//! ```
//! so that no model is blamed for what it cannot predict and none is credited with it. What the model does at exactly these
//! frequencies does not count.

use crate::Result;
use serde::{Deserialize, Serialize};
use youla::identify::subspace::{harmonics, lines};
use youla::linalg::least_squares;
use youla::signal::Record;
use youla::{Mat, MatRef};
use youla_io::{ChannelRef, ChannelSpec};

/// Lines of known frequency in the outputs; either frequencies or a tacho channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DisturbanceSettings {
    /// Constant frequencies, Hz.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frequencies_hz: Vec<f64>,
    /// Place of a channel with the speed in each file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tacho: Option<ChannelRef>,
    /// Unit of the tacho channel; required with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tacho_unit: Option<TachoUnit>,
    /// Multiples of the speed that the outputs hold.
    pub harmonics: Vec<usize>,
}

impl Default for DisturbanceSettings {
    fn default() -> Self {
        DisturbanceSettings { frequencies_hz: Vec::new(), tacho: None, tacho_unit: None, harmonics: vec![1] }
    }
}

/// Unit of a speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TachoUnit {
    /// Revolutions per minute.
    Rpm,
    /// Revolutions per second.
    Hz,
}

/// Name of the tacho channel while a file is read; no channel of a user is likely to have it.
const TACHO: &str = "(tacho of [data.disturbance])";

impl DisturbanceSettings {
    /// What is wrong with the settings, in words.
    pub(super) fn problem(&self) -> Option<&'static str> {
        match (self.frequencies_hz.is_empty(), &self.tacho, self.tacho_unit) {
            (true, None, _) => Some("[data.disturbance] needs frequencies_hz or tacho"),
            (false, Some(_), _) => Some("[data.disturbance] has both frequencies_hz and tacho; give one of them"),
            (_, Some(_), None) => {
                Some("[data.disturbance] tacho needs tacho_unit = \"rpm\" or \"hz\"; the unit is never guessed")
            }
            (_, None, Some(_)) => Some("[data.disturbance] tacho_unit is for a tacho, but there is none"),
            _ if self.harmonics.is_empty() || self.harmonics.contains(&0) => {
                Some("[data.disturbance] harmonics must list multiples of 1 and more")
            }
            (false, ..) if self.harmonics != [1] => {
                Some("[data.disturbance] harmonics is for a tacho; list all frequencies in frequencies_hz")
            }
            _ => None,
        }
    }

    /// The channel to read besides those of the machine.
    pub(super) fn channel(&self) -> Option<ChannelSpec> {
        self.tacho.clone().map(|place| ChannelSpec::from(TACHO, place, ""))
    }

    /// Cosine and sine of each line, samples x 2 per line; `record` as it was read, before anything is taken out of it.
    ///
    /// # Errors
    /// A frequency that is not between 0 and that of Nyquist.
    pub(super) fn signals(&self, record: &Record) -> Result<Mat<f64>> {
        let found = match &self.tacho {
            None => lines(&self.frequencies_hz, record.samples(), record.time()),
            Some(_) => {
                let factor = if self.tacho_unit == Some(TachoUnit::Rpm) { 1.0 / 60.0 } else { 1.0 };
                let speed: Vec<f64> = record.column(TACHO)?.iter().map(|value| factor * value).collect();
                harmonics(&speed, &self.harmonics, record.time())
            }
        };
        Ok(found.map_err(|e| e.within("[data.disturbance]"))?)
    }

    /// Each line in words, as the columns of the known signals stand.
    pub fn labels(&self) -> Vec<String> {
        match &self.tacho {
            None => self.frequencies_hz.iter().map(|hz| format!("{hz} Hz")).collect(),
            Some(_) => self.harmonics.iter().map(|n| format!("{n}x")).collect(),
        }
    }
}

/// Outputs without the lines that explain them best, least squares.
pub(super) fn without_lines(y: MatRef<'_, f64>, w: Option<MatRef<'_, f64>>) -> Result<Mat<f64>> {
    let Some(w) = w else { return Ok(y.to_owned()) };
    let found = least_squares("the lines of [data.disturbance]", w, y)?;
    Ok(y - w * found.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::lti::Discrete;

    fn settings(text: &str) -> DisturbanceSettings {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn contradictions_are_named() {
        for (text, words) in [
            ("", "needs frequencies_hz or tacho"),
            ("frequencies_hz = [40.0]\ntacho = \"n\"", "both"),
            ("tacho = \"n\"", "never guessed"),
            ("frequencies_hz = [40.0]\nharmonics = [1, 2]", "for a tacho"),
            ("tacho = \"n\"\ntacho_unit = \"rpm\"\nharmonics = [0]", "multiples"),
        ] {
            assert!(settings(text).problem().unwrap().contains(words), "{text}");
        }
        assert_eq!(settings("tacho = \"n\"\ntacho_unit = \"hz\"\nharmonics = [1, 2]").problem(), None);
    }

    /// A constant speed gives the lines of its frequency.
    #[test]
    fn tacho_and_frequencies_agree() {
        let time = Discrete::new(1e-3).unwrap();
        let channels = vec![youla::signal::Channel::new(TACHO, "")];
        let record = Record::new("r", channels, Mat::from_fn(400, 1, |_, _| 2500.0), time).unwrap();
        let by_speed = settings("tacho = 1\ntacho_unit = \"rpm\"\nharmonics = [1, 2]").signals(&record).unwrap();
        let by_frequency =
            settings("frequencies_hz = [41.666666666666664, 83.33333333333333]").signals(&record).unwrap();
        assert!((&by_speed - &by_frequency).norm_max() < 1e-10);
        let rest = without_lines(by_frequency.as_ref(), Some(by_speed.as_ref())).unwrap();
        assert!(rest.norm_max() < 1e-10);
        assert!(settings("frequencies_hz = [600.0]").signals(&record).is_err());
    }
}
