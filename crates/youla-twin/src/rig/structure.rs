//! The gas bearing (3)-(6) as a structure with 14 parameters.

use crate::rig::Bearing;
use youla::Result;
use youla::lti::{Continuous, StateSpace};
use youla_greybox::{Matrix, Slope, Structure};

/// Damping, stiffness, actuator gain (2 x 2 each, by rows) and actuator poles of (3)-(6).
///
/// ```
/// use youla_greybox::Structure;
/// use youla_twin::BearingStructure;
/// use youla_twin::rig::Bearing;
/// let theta = BearingStructure::parameters(&Bearing::default());
/// assert_eq!(BearingStructure.names()[13], "actuator_pole_v");
/// assert_eq!(BearingStructure::bearing(&theta)?, Bearing::default());
/// # Ok::<(), youla_twin::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BearingStructure;

/// Number of parameters.
const PARAMETERS: usize = 14;

impl BearingStructure {
    /// The parameter vector of a bearing.
    pub fn parameters(bearing: &Bearing) -> Vec<f64> {
        let square = [bearing.damping, bearing.stiffness, bearing.actuator_gain];
        square.iter().flatten().flatten().copied().chain(bearing.actuator_pole).collect()
    }

    /// The bearing of a parameter vector.
    ///
    /// # Errors
    /// [`youla::Error::Shape`] unless there are 14 parameters.
    pub fn bearing(theta: &[f64]) -> Result<Bearing> {
        let theta: &[f64; PARAMETERS] = theta.try_into().map_err(|_| youla::Error::Shape {
            what: "the parameter vector of the bearing".into(),
            expected: (PARAMETERS, 1),
            found: (theta.len(), 1),
        })?;
        let square = |k: usize| [[theta[k], theta[k + 1]], [theta[k + 2], theta[k + 3]]];
        Ok(Bearing {
            damping: square(0),
            stiffness: square(4),
            actuator_gain: square(8),
            actuator_pole: [theta[12], theta[13]],
        })
    }
}

impl Structure for BearingStructure {
    fn names(&self) -> Vec<String> {
        let square = |what: &'static str| ["hh", "hv", "vh", "vv"].map(move |ij| format!("{what}_{ij}"));
        let poles = ["h", "v"].map(|i| format!("actuator_pole_{i}"));
        ["damping", "stiffness", "actuator_gain"].into_iter().flat_map(square).chain(poles).collect()
    }

    fn model(&self, theta: &[f64]) -> youla_greybox::Result<StateSpace<Continuous>> {
        Ok(Self::bearing(theta)?.plant()?)
    }

    /// States `[l; l'; m]`: rows 2 and 3 of A are `[K D B]`, the actuators are `m' = -P m + P u`.
    fn slopes(&self, _theta: &[f64], parameter: usize) -> Vec<Slope> {
        let slope = |matrix, row, column, value| Slope { matrix, row, column, value };
        if let Some(actuator) = parameter.checked_sub(12) {
            let state = 4 + actuator;
            return vec![slope(Matrix::A, state, state, -1.0), slope(Matrix::B, state, actuator, 1.0)];
        }
        let first = [2, 0, 4][parameter / 4];
        vec![slope(Matrix::A, 2 + parameter % 4 / 2, first + parameter % 2, 1.0)]
    }
}
