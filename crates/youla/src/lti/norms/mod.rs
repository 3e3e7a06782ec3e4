//! Sizes of systems. With the Gramians P (reachability) and Q (observability) and `s = j omega` or `exp(j omega ts)`,
//!
//! ```text
//! h2     = sqrt(tr(C P C' + D D'))                   rms response to white noise of unit intensity; D D' in discrete time only
//! hankel = sqrt(max eigenvalue of P Q)               past inputs to future outputs
//! hinf   = max over omega of sigma_max(G(s))         largest gain; linf is the same figure of a system that may be unstable
//! ```
//!
//! and `hankel <= hinf <= 2 (sum of the Hankel singular values) + sigma_max(D)` (continuous time; K. Glover, Int. J. Control 39
//! (1984), 1115).

mod crossing;
mod curve;
mod hamiltonian;
mod level;
mod peak;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;

pub(crate) use crossing::{Part, crossings};
pub(crate) use curve::Curve;
pub(crate) use hamiltonian::continuous_image;
pub(crate) use level::below_level;
pub use peak::{PeakGain, PeakOptions, hinf_norm, linf_norm};

use super::{StateSpace, TimeDomain};
use crate::linalg::{discrete_gramian_factor, gramian_factor};
use crate::{Error, Mat, Result};

/// H2 norm of a stable system: the rms of its outputs together where independent white noise of unit intensity (continuous) or
/// unit variance (discrete) drives each input. A continuous system with feedthrough has the norm infinity.
///
/// Computed from the square-root factor of the Gramian; 1e-11 relative on the bearing (`reference`).
///
/// # Errors
/// [`Error::Unstable`] with the pole.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace, h2_norm}};
/// let lag = StateSpace::new(eye(1) * faer::Scale(-2.0), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// assert!((h2_norm(&lag)? - 0.5).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn h2_norm<T: TimeDomain>(system: &StateSpace<T>) -> Result<f64> {
    let system = stable("the system whose H2 norm is asked for", system)?;
    let direct = match system.time().sample_time() {
        Some(_) => system.d().norm_l2(),
        None if system.d().norm_max() > 0.0 => return Ok(f64::INFINITY),
        None => 0.0,
    };
    Ok((system.c() * reachability_factor(&system)?).norm_l2().hypot(direct))
}

/// Hankel norm of a stable system, its largest Hankel singular value: the most energy that future outputs can have per
/// energy of past inputs, as a ratio of amplitudes. The feedthrough plays no part.
///
/// # Errors
/// [`Error::Unstable`] with the pole.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace, hankel_norm}};
/// let lag = StateSpace::new(eye(1) * faer::Scale(-2.0), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// assert!((hankel_norm(&lag)? - 0.25).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn hankel_norm<T: TimeDomain>(system: &StateSpace<T>) -> Result<f64> {
    let system = stable("the system whose Hankel norm is asked for", system)?;
    let product = reachability_factor(&system.dual())?.transpose() * reachability_factor(&system)?;
    if product.nrows() == 0 {
        return Ok(0.0);
    }
    let values = product.singular_values();
    let values =
        values.map_err(|_| Error::NoConvergence { what: "the Hankel singular values".into(), iterations: 0 })?;
    Ok(values[0])
}

/// The system in balanced states, once it is known to be stable.
fn stable<T: TimeDomain>(what: &str, system: &StateSpace<T>) -> Result<StateSpace<T>> {
    let system = system.balanced()?;
    system.require_stable(what)?;
    Ok(system)
}

/// L of `P = L L'`.
fn reachability_factor<T: TimeDomain>(system: &StateSpace<T>) -> Result<Mat<f64>> {
    let factor = match system.time().sample_time() {
        Some(_) => discrete_gramian_factor,
        None => gramian_factor,
    };
    Ok(factor(system.a(), system.b())?.l)
}
