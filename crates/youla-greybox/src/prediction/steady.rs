//! Records that begin in the steady state of their first input.
//!
//! ```text
//! x0 = (I - Ad)^-1 Bd u(0),     x0_theta = (I - Ad)^-1 [dAd dBd] [x0; u(0)]
//! ```

use crate::prediction::sampled::SampledSlope;
use crate::{Error, Result};
use youla::linalg::{block, solve};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// A pole closer to 1 than this has no steady state that double precision can resolve.
const INTEGRATING: f64 = 1e-7;

/// The steady state at a constant input.
///
/// # Errors
/// [`Error::NoSteadyState`] with the pole at 1.
pub(crate) fn steady_state(system: &StateSpace<Discrete>, u: &[f64]) -> Result<Vec<f64>> {
    let at_one = |pole: &youla::c64| (pole - 1.0).norm() < INTEGRATING;
    if let Some(pole) = system.poles()?.into_iter().find(at_one) {
        return Err(Error::NoSteadyState { pole });
    }
    let u = MatRef::from_column_major_slice(u, u.len(), 1);
    let x0 = solve("I - A of the steady state", leftover(system).as_ref(), (system.b() * u).as_ref())?;
    Ok(x0.col(0).iter().copied().collect())
}

/// Its derivatives, one column for each slope.
pub(crate) fn steady_slopes(
    system: &StateSpace<Discrete>,
    slopes: &[SampledSlope],
    x0: &[f64],
    u: &[f64],
) -> Result<Mat<f64>> {
    let column = |v| MatRef::from_column_major_slice(v, <[f64]>::len(v), 1);
    let signals = block(&[&[column(x0)], &[column(u)]]);
    let mut pushed = Mat::zeros(system.order(), slopes.len());
    for (j, slope) in slopes.iter().enumerate() {
        pushed.as_mut().col_mut(j).copy_from((&slope.states * &signals).col(0));
    }
    solve("I - A of the steady state", leftover(system).as_ref(), pushed.as_ref()).map_err(Error::from)
}

fn leftover(system: &StateSpace<Discrete>) -> Mat<f64> {
    youla::linalg::eye(system.order()) - system.a()
}
