//! Sizes of systems. With the Gramian P (reachability) and `s = j omega` or `exp(j omega ts)`,
//!
//! ```text
//! h2     = sqrt(tr(C P C' + D D'))                   rms response to white noise of unit intensity; D D' in discrete time only
//! hinf   = max over omega of sigma_max(G(s))         largest gain; linf is the same figure of a system that may be unstable
//! ```

mod crossing;
mod curve;
mod hamiltonian;
mod level;
mod peak;
#[cfg(test)]
mod reference_tests;
#[cfg(test)]
mod tests;

pub(crate) use crossing::{Part, crossings};
pub(crate) use curve::Curve;
pub(crate) use hamiltonian::continuous_image;
pub(crate) use level::below_level;
pub use peak::{PeakGain, PeakOptions, hinf_norm, linf_norm};

use super::{StateSpace, TimeDomain};
use crate::linalg::{discrete_gramian_factor, gramian_factor};
use crate::{Mat, Result};

/// H2 norm of a stable system: the rms of its outputs together where independent white noise of unit intensity (continuous) or
/// unit variance (discrete) drives each input. A continuous system with feedthrough has the norm infinity.
///
/// Computed from the square-root factor of the Gramian; 1e-11 relative on the bearing (`reference_tests`).
///
/// # Errors
/// [`crate::Error::Unstable`] with the pole.
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
    factor(system.a(), system.b())
}
