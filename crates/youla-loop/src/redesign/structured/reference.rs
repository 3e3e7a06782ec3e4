//! How the reference enters a PID (K. J. Åström, T. Hägglund, Advanced PID Control, ISA, 2006, section 3.4):
//!
//! ```text
//! u = kp (b r - y) + ki/s (r - y) + kd s/(1 + filter s) (c r - y)
//! ```
//! b and c are those of the running controller; the new gains are promised with the same. Where the derivative acts on y alone, c = 0.

use super::channels::{couples, each};
use super::pid::{PidController, PidGains};
use super::recognise::recognise;
use super::scenarios::Grid;
use crate::error::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use youla::Mat;
use youla::lti::{Discrete, StateSpace, simulate};

/// Integral gains from r and from y that are nearer than this, relative to their size, are the same. Rounding of coefficients with six digits passes.
const SAME: f64 = 1e-3;

/// Weights of the reference in a PID.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReferenceWeights {
    /// b: that in the proportional part.
    pub proportional: f64,
    /// c: that in the derivative part.
    pub derivative: f64,
}

impl ReferenceWeights {
    /// Those of a controller of the error r - y.
    pub const ERROR: Self = ReferenceWeights { proportional: 1.0, derivative: 1.0 };

    /// What a unit step of the reference adds at the input to that of the error: `kp (b - 1) + kd s/(1 + filter s) (c - 1)`.
    pub(super) fn added(&self, of: &PidController, samples: usize, time: Discrete) -> Result<Vec<f64>> {
        if *self == Self::ERROR {
            return Ok(vec![0.0; samples]);
        }
        let (kp, kd) = (of.gains.kp * (self.proportional - 1.0), of.gains.kd * (self.derivative - 1.0));
        let path = PidController { gains: PidGains { kp, ki: 0.0, kd, ..of.gains }, ..of.clone() }.system(time)?;
        let u = simulate(&path, Mat::from_fn(samples, 1, |_, _| -1.0).as_ref(), &vec![0.0; path.order()])?;
        Ok((0..samples).map(|t| u[(t, 0)]).collect())
    }
}

/// The weights of each loop, given its gains and the path from the references to u where it is not that of the error; `None` where a path is no PID
/// with the integral gain of its loop, or leads to another loop.
pub(super) fn weights(
    grid: &Grid,
    path: Option<&StateSpace<Discrete>>,
    gains: &[Option<PidController>],
) -> Result<Option<Vec<ReferenceWeights>>> {
    let Some(path) = path else { return Ok(Some(vec![ReferenceWeights::ERROR; gains.len()])) };
    if path.outputs() != gains.len() || path.inputs() != gains.len() || couples(path)? {
        return Ok(None);
    }
    let of_loop = |(path, gains): (StateSpace<Discrete>, &Option<PidController>)| {
        let Some(own) = gains else { return Ok(None) };
        let of_reference = recognise(grid, &path.negated(), &[own.gains.discretisation], own.delay)?;
        Ok(of_reference.and_then(|of| between(&of.gains, &own.gains)))
    };
    each(path)?.into_iter().zip(gains).map(of_loop).collect()
}

fn between(of_reference: &PidGains, own: &PidGains) -> Option<ReferenceWeights> {
    let weight = |of: f64, own: f64| match (of, own) {
        (0.0, 0.0) => Some(1.0),
        (_, 0.0) => None,
        // to the digits of the fit
        _ => Some((1e6 * of / own).round() / 1e6),
    };
    let same = (of_reference.ki - own.ki).abs() <= SAME * own.ki.abs();
    let weights = || {
        Some(ReferenceWeights {
            proportional: weight(of_reference.kp, own.kp)?,
            derivative: weight(of_reference.kd, own.kd)?,
        })
    };
    same.then(weights).flatten()
}
