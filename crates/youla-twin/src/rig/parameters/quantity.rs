//! A number with its unit in the type and a label that says where it comes from.

use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};
use std::fmt::Debug;
use std::marker::PhantomData;

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// Printed in the paper.
    Paper,
    /// From a standard, a data sheet or other publications.
    Literature,
    /// Chosen; a measurement on the rig would replace it.
    Assumption,
}

/// A unit of measurement, as a type.
pub trait Unit: Debug + Copy + PartialEq {
    /// How files spell it.
    const LABEL: &'static str;
}

macro_rules! units {
    ($($(#[$doc:meta])* $name:ident = $label:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name;
        impl Unit for $name {
            const LABEL: &'static str = $label;
        }
    )*};
}

units! {
    /// Ratios and shares.
    One = "1";
    /// Counted things.
    Count = "count";
    /// Sample times.
    Samples = "samples";
    /// Binary digits.
    Bits = "bit";
    /// Seconds.
    Seconds = "s";
    /// Cycles per second.
    Hertz = "Hz";
    /// Revolutions per minute.
    Rpm = "rpm";
    /// Angles.
    Radians = "rad";
    /// Displacement.
    Micrometres = "um";
    /// Voltage.
    Volts = "V";
    /// Sensitivity of a displacement sensor.
    VoltsPerMicrometre = "V/um";
    /// Damping per unit mass, and rates.
    PerSecond = "1/s";
    /// Stiffness per unit mass.
    PerSecondSquared = "1/s^2";
    /// Acceleration per volt.
    AccelerationPerVolt = "um/(s^2 V)";
}

/// A value in the unit `U`; in files `{ value = 0.3, unit = "um", basis = "assumption" }`, all three mandatory.
///
/// Reading refuses any other unit: nothing is converted silently.
///
/// ```
/// use youla_twin::rig::{Micrometres, Quantity};
/// let noise: Quantity<Micrometres> = toml::from_str("value = 0.3\nunit = 'um'\nbasis = 'assumption'").unwrap();
/// assert_eq!(noise.value, 0.3);
/// let wrong = toml::from_str::<Quantity<Micrometres>>("value = 0.3\nunit = 'mm'\nbasis = 'assumption'");
/// assert_eq!(wrong.unwrap_err().message(), "the unit is \"mm\", but must be \"um\"");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity<U, T = f64> {
    /// The number or numbers.
    pub value: T,
    /// Where they come from.
    pub basis: Basis,
    unit: PhantomData<U>,
}

impl<U: Unit, T> Quantity<U, T> {
    /// A quantity.
    pub fn new(value: T, basis: Basis) -> Self {
        Quantity { value, basis, unit: PhantomData }
    }
}

/// What is in a file.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Written<T, S> {
    value: T,
    unit: S,
    basis: Basis,
}

impl<U: Unit, T: Serialize> Serialize for Quantity<U, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Written { value: &self.value, unit: U::LABEL, basis: self.basis }.serialize(serializer)
    }
}

impl<'de, U: Unit, T: Deserialize<'de>> Deserialize<'de> for Quantity<U, T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Written::<T, String> { value, unit, basis } = Written::deserialize(deserializer)?;
        if unit == U::LABEL {
            Ok(Quantity::new(value, basis))
        } else {
            Err(D::Error::custom(format!("the unit is {unit:?}, but must be {:?}", U::LABEL)))
        }
    }
}
