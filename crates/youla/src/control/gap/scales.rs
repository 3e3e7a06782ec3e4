//! Units for the channels in which equal numbers matter equally: norms over several channels, the nu-gap and the normalised
//! coprime margin compare channels with each other and inputs with outputs.

use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Mat, Result};

/// The size of each channel, in its unit; all positive.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChannelScales {
    inputs: Vec<f64>,
    outputs: Vec<f64>,
}

impl ChannelScales {
    /// Sizes of the plant inputs (m) and outputs (p), for example their largest admissible or their root-mean-square values.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a size that is not positive and finite.
    pub fn new(inputs: Vec<f64>, outputs: Vec<f64>) -> Result<Self> {
        match inputs.iter().chain(&outputs).find(|size| !(**size > 0.0 && size.is_finite())) {
            Some(&value) => {
                Err(Error::OutOfRange { what: "the size of a channel".into(), value, must: "a positive number" })
            }
            None => Ok(ChannelScales { inputs, outputs }),
        }
    }

    /// Sizes of the plant inputs.
    pub fn inputs(&self) -> &[f64] {
        &self.inputs
    }

    /// Sizes of the plant outputs.
    pub fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    /// The plant (u to y) in units of the sizes.
    ///
    /// # Errors
    /// [`Error::Ports`] unless there is one size per channel.
    pub fn plant<T: TimeDomain>(&self, plant: &StateSpace<T>) -> Result<StateSpace<T>> {
        scaled(plant, &self.inputs, &self.outputs)
    }

    /// The controller (y to u) in units of the sizes.
    ///
    /// # Errors
    /// [`Error::Ports`] unless there is one size per channel.
    pub fn controller<T: TimeDomain>(&self, controller: &StateSpace<T>) -> Result<StateSpace<T>> {
        scaled(controller, &self.outputs, &self.inputs)
    }
}

/// `diag(to)^-1 system diag(from)`.
fn scaled<T: TimeDomain>(system: &StateSpace<T>, from: &[f64], to: &[f64]) -> Result<StateSpace<T>> {
    for (what, found, expected) in [("inputs", from.len(), system.inputs()), ("outputs", to.len(), system.outputs())] {
        if found != expected {
            return Err(Error::Ports { what: format!("the number of sizes of the {what}"), expected, found });
        }
    }
    let diagonal = |x: Vec<f64>| Mat::from_fn(x.len(), x.len(), |i, j| if i == j { x[i] } else { 0.0 });
    let inverse = diagonal(to.iter().map(|size| 1.0 / size).collect());
    Ok(system.map_input(&diagonal(from.to_vec())).map_output(&inverse))
}
