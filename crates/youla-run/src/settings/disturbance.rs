//! `[data.disturbance]`: lines of known frequency in the outputs, from stated frequencies or a tacho channel.

use serde::{Deserialize, Serialize};
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
pub(crate) const TACHO: &str = "(tacho of [data.disturbance])";

impl DisturbanceSettings {
    /// What is wrong with the settings, in words.
    pub(in crate::settings) fn problem(&self) -> Option<&'static str> {
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
    pub(crate) fn channel(&self) -> Option<ChannelSpec> {
        self.tacho.clone().map(|place| ChannelSpec::from(TACHO, place, ""))
    }

    /// Each line in words, as the columns of the known signals are.
    pub(crate) fn labels(&self) -> Vec<String> {
        match &self.tacho {
            None => self.frequencies_hz.iter().map(|hz| format!("{hz} Hz")).collect(),
            Some(_) => self.harmonics.iter().map(|n| format!("{n}x")).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contradictions_are_named() {
        for (text, words) in [
            ("", "needs frequencies_hz or tacho"),
            ("frequencies_hz = [40.0]\ntacho = \"n\"", "both"),
            ("tacho = \"n\"", "never guessed"),
            ("frequencies_hz = [40.0]\nharmonics = [1, 2]", "for a tacho"),
            ("tacho = \"n\"\ntacho_unit = \"rpm\"\nharmonics = [0]", "multiples"),
        ] {
            assert!(toml::from_str::<DisturbanceSettings>(text).unwrap().problem().unwrap().contains(words), "{text}");
        }
        assert_eq!(
            toml::from_str::<DisturbanceSettings>("tacho = \"n\"\ntacho_unit = \"hz\"\nharmonics = [1, 2]")
                .unwrap()
                .problem(),
            None
        );
    }
}
