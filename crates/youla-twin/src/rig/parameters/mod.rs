//! Parameters of the digital twin: one TOML file, every value with its unit and its basis.

mod check;
mod quantity;

pub use quantity::{
    AccelerationPerVolt, Basis, Bits, Count, Hertz, Micrometres, One, PerSecond, PerSecondSquared, Quantity, Radians,
    Rpm, Samples, Seconds, Unit, Volts, VoltsPerMicrometre,
};

use super::Bearing;
use crate::Result;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Everything that the digital twin is made of; the tables of its TOML file.
///
/// ```
/// use youla_twin::rig::{Basis, RigParameters};
/// let parameters = RigParameters::shipped();
/// assert_eq!(parameters.bearing.stiffness.basis, Basis::Paper);
/// let copy = RigParameters::TOML.replacen("\"um\"", "\"mm\"", 1);
/// let refused = RigParameters::parse(&copy, "copy.toml".as_ref()).unwrap_err();
/// assert!(refused.to_string().ends_with("sensor.noise: the unit is \"mm\", but must be \"um\""));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigParameters {
    /// Equations (9)-(12).
    pub bearing: BearingParameters,
    /// Clock and delay.
    pub timing: Timing,
    /// Displacement sensors.
    pub sensor: Sensor,
    /// Piezo valves and their amplifiers.
    pub actuator: Actuator,
    /// What a turning shaft adds.
    pub rotation: Rotation,
    /// Limits of an experiment.
    pub safety: Safety,
}

/// The model (1)-(12) at 0 rpm; see [`Bearing`] for the equations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BearingParameters {
    /// D of (9).
    pub damping: Quantity<PerSecond, [[f64; 2]; 2]>,
    /// K of (10).
    pub stiffness: Quantity<PerSecondSquared, [[f64; 2]; 2]>,
    /// B of (11).
    pub actuator_gain: Quantity<AccelerationPerVolt, [[f64; 2]; 2]>,
    /// Diagonal of P of (12).
    pub actuator_pole: Quantity<PerSecond, [f64; 2]>,
}

/// Clock and delay of the controller's computer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Sample time.
    pub sample_time: Quantity<Seconds>,
    /// Steps of the plant between two samples, at the levels above the linear one.
    pub substeps: Quantity<Count, usize>,
    /// Whole samples from a measurement to the command computed from it.
    pub delay: Quantity<Samples, usize>,
}

/// Displacement sensors, both axes alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// White noise, rms.
    pub noise: Quantity<Micrometres>,
    /// Converter; ideal when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adc: Option<Adc>,
    /// Bandwidth; unlimited when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low_pass: Option<LowPass>,
}

/// Analogue-to-digital converter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adc {
    /// Resolution.
    pub bits: Quantity<Bits, u32>,
    /// Plus and minus this voltage.
    pub range: Quantity<Volts>,
    /// Sensitivity of the sensor before it.
    pub gain: Quantity<VoltsPerMicrometre>,
}

/// `w^2 / (s^2 + 2 damping w s + w^2)`, `w = 2 pi frequency`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LowPass {
    /// Natural frequency.
    pub frequency: Quantity<Hertz>,
    /// Damping ratio.
    pub damping: Quantity<One>,
}

/// Piezo valves, both axes alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Actuator {
    /// Least voltage of the amplifier.
    pub command_min: Quantity<Volts>,
    /// Greatest voltage of the amplifier.
    pub command_max: Quantity<Volts>,
    /// Voltage at u = 0.
    pub bias: Quantity<Volts>,
    /// Hysteresis; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Hysteresis>,
}

/// Prandtl-Ishlinskii hysteresis; see [`super::Piezo`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hysteresis {
    /// Number of play operators.
    pub operators: Quantity<Count, usize>,
    /// Width of the loop over the full stroke, as a share of the travel.
    pub width: Quantity<One>,
    /// Cycles of this amplitude have gain 1.
    pub unit_gain_amplitude: Quantity<Volts>,
}

/// What a turning shaft adds; see [`super::bearing_at_speed`] for the equations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// Greatest speed.
    pub max_speed: Quantity<Rpm>,
    /// Mean speed of the gas over that of the shaft.
    pub whirl_ratio: Quantity<One>,
    /// Constant skew stiffness in the direction of rotation, share of the mean stiffness.
    pub cross_coupling: Quantity<One>,
    /// Gyroscopic term over speed.
    pub gyroscopic: Quantity<One>,
    /// Growth of the stiffness up to the greatest speed, as a share.
    pub stiffness_growth: Quantity<One>,
    /// Speed at which the damping is halved.
    pub damping_half_speed: Quantity<Rpm>,
    /// Distance of the centre of mass from the axis.
    pub eccentricity: Quantity<Micrometres>,
    /// Amplitudes of the run-out, 1x to 5x.
    pub run_out_amplitude: Quantity<Micrometres, [f64; 5]>,
    /// Angles of the run-out, 1x to 5x.
    pub run_out_angle: Quantity<Radians, [f64; 5]>,
    /// A bending mode of the shaft; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flexible_mode: Option<FlexibleMode>,
}

/// A lightly damped mode beside the rigid one, alike in both axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlexibleMode {
    /// Natural frequency.
    pub frequency: Quantity<Hertz>,
    /// Damping ratio.
    pub damping: Quantity<One>,
    /// Residue as a share of that of the rigid mode.
    pub residue: Quantity<One>,
}

/// Limits of an experiment; see [`super::run_experiment`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Safety {
    /// Measured displacement that aborts a run.
    pub displacement_limit: Quantity<Micrometres>,
    /// Time in which the excitation then goes to zero.
    pub ramp_time: Quantity<Seconds>,
    /// Measured displacement at which the rotor touches and the run ends.
    pub clearance: Quantity<Micrometres>,
    /// Greatest excitation, plus and minus.
    pub excitation_limit: Quantity<Volts>,
}

impl RigParameters {
    /// The file that ships with the program, to be copied and edited.
    pub const TOML: &str = include_str!("../../../assets/bearing.toml");

    /// The parameters that ship with the program.
    pub fn shipped() -> Self {
        Self::parse(Self::TOML, "bearing.toml".as_ref()).expect("the shipped file is read by a test")
    }

    /// Reads a parameter file.
    ///
    /// # Errors
    /// Those of [`RigParameters::parse`]; [`youla_io::Error::Io`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = youla_io::read_text(path)?;
        Self::parse(&text, path)
    }

    /// Parses the text of a parameter file; `path` is named in errors.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with line, column and key for an unknown or missing key and for a wrong unit;
    /// [`youla::Error::OutOfRange`] for a value without meaning.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let parameters: Self = youla_io::toml_file::parse(text, path)?;
        parameters.check()?;
        Ok(parameters)
    }
}

impl BearingParameters {
    /// The same numbers as the model.
    pub fn model(&self) -> Bearing {
        Bearing {
            stiffness: self.stiffness.value,
            damping: self.damping.value,
            actuator_gain: self.actuator_gain.value,
            actuator_pole: self.actuator_pole.value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(from: &str, to: &str) -> String {
        let text = RigParameters::TOML.replacen(from, to, 1);
        assert_ne!(text, RigParameters::TOML, "{from:?} does not occur");
        RigParameters::parse(&text, "copy.toml".as_ref()).unwrap_err().to_string()
    }

    #[test]
    fn the_shipped_file_holds_the_numbers_of_the_paper() {
        let parameters = RigParameters::shipped();
        assert_eq!(parameters.bearing.model(), Bearing::default());
        assert_eq!(parameters.bearing.damping.basis, Basis::Paper);
    }

    #[test]
    fn parameters_survive_the_round_trip() {
        let parameters = RigParameters::shipped();
        let text = toml::to_string(&parameters).unwrap();
        assert_eq!(RigParameters::parse(&text, "copy.toml".as_ref()).unwrap(), parameters);
    }

    #[test]
    fn a_wrong_unit_is_named_with_its_key_and_place() {
        let found = refusal("value = 1e4, unit = \"Hz\"", "value = 1e4, unit = \"rad/s\"");
        assert!(found.starts_with("copy.toml:"), "{found}");
        assert!(found.ends_with(r#"sensor.low_pass.frequency: the unit is "rad/s", but must be "Hz""#), "{found}");
    }

    #[test]
    fn wrong_keys_and_values_are_named() {
        let found = refusal("whirl_ratio", "whirl_ration");
        assert!(found.contains("did you mean `whirl_ratio`?"), "{found}");
        let found = refusal("basis = \"paper\"", "basis = \"papers\"");
        assert!(found.contains("did you mean `paper`?"), "{found}");
        let found = refusal(", basis = \"paper\"", "");
        assert!(found.contains("bearing.damping: missing field `basis`"), "{found}");
        let found = refusal("989.0", "-989.0");
        assert_eq!(found, "bearing.actuator_pole is -989, but must be a positive number");
        let found = refusal("-224.9", "nan");
        assert_eq!(found, "bearing.damping is NaN, but must be a finite number");
        let found = refusal("value = 5.0", "value = 12.0");
        assert_eq!(found, "actuator.bias is 12, but must be a voltage between command_min and command_max");
        let found = refusal("value = 10, unit = \"count\"", "value = 0, unit = \"count\"");
        assert_eq!(found, "timing.substeps is 0, but must be a number from 1 to 1000");
    }

    #[test]
    fn optional_effects_may_be_left_out() {
        let start = RigParameters::TOML.find("\n[sensor.adc]").unwrap();
        let end = RigParameters::TOML.find("\n[sensor.low_pass]").unwrap();
        let text = format!("{}{}", &RigParameters::TOML[..start], &RigParameters::TOML[end..]);
        assert_eq!(RigParameters::parse(&text, "copy.toml".as_ref()).unwrap().sensor.adc, None);
    }
}
