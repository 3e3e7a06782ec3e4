//! The choices for the uncertainty of a subspace estimate.

use crate::{Error, Result};

/// How the uncertainty of an estimate is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum UncertaintyMethod {
    /// Not at all.
    #[default]
    None,
    /// From the change of the estimate with the weight of each block of time: about as much work as the identification
    /// itself, for every weight and for open and closed loops.
    Delta,
    /// Identified again from many simulated records with resampled one-step residuals. Needs inputs that do not depend on
    /// the noise, a Kalman gain and a stable estimate.
    Bootstrap,
}

/// Choices for the uncertainty, the table `[hansen.uncertainty]` of run.toml.
///
/// ```
/// use youla::identify::subspace::{UncertaintyMethod, UncertaintyOptions};
/// let options = UncertaintyOptions { method: UncertaintyMethod::Delta, ..Default::default() };
/// assert_eq!(options.level, 0.95);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct UncertaintyOptions {
    /// The method.
    pub method: UncertaintyMethod,
    /// Probability with which an interval or region should hold the truth.
    pub level: f64,
    /// Blocks of time, for the delta method; absent: the Hankel columns over three times past and horizon, within 20 and 60.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub blocks: Option<usize>,
    /// Simulated records, for the bootstrap.
    pub replicates: usize,
    /// Seed of the resampling, for the bootstrap.
    pub seed: u64,
}

impl Default for UncertaintyOptions {
    fn default() -> Self {
        UncertaintyOptions { method: UncertaintyMethod::None, level: 0.95, blocks: None, replicates: 200, seed: 1 }
    }
}

impl UncertaintyOptions {
    /// Whether nothing was chosen.
    #[cfg(feature = "serde")]
    pub(in super::super) fn is_default(&self) -> bool {
        *self == UncertaintyOptions::default()
    }

    /// Refuses choices without meaning.
    pub(in super::super) fn check(&self) -> Result<()> {
        let refuse =
            |what: &str, value: f64, must: &'static str| Err(Error::OutOfRange { what: what.into(), value, must });
        if !(self.level >= 0.5 && self.level <= 0.999) {
            return refuse("the level of the uncertainty", self.level, "from 0.5 to 0.999");
        }
        match self.blocks {
            Some(blocks) if blocks < LEAST_BLOCKS => {
                refuse("the number of blocks of the uncertainty", blocks as f64, "at least 10")
            }
            _ if self.replicates < 20 => {
                refuse("the number of replicates of the uncertainty", self.replicates as f64, "at least 20")
            }
            _ => Ok(()),
        }
    }
}

/// Fewer blocks say too little of a variance.
pub(super) const LEAST_BLOCKS: usize = 10;
