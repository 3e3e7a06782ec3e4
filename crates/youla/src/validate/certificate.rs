//! The loop certificate: what the actual controller does to an identified model.

use crate::control::{closed_loop, with_input_port};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Result, c64};

/// Poles of a model under the actual controller.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopCertificate {
    /// All closed-loop poles.
    pub poles: Vec<c64>,
    /// The pole farthest beyond the stability boundary; `None` when nothing has states.
    pub worst_pole: Option<c64>,
    /// Whether the controller stabilises the model.
    pub stable: bool,
}

/// Closes `u = K y` (positive feedback) around a model and reports the poles of the loop.
///
/// # Errors
/// Ports, sample times, [`crate::Error::AlgebraicLoop`], [`crate::Error::NoConvergence`].
pub fn certify<T: TimeDomain>(model: &StateSpace<T>, controller: &StateSpace<T>) -> Result<LoopCertificate> {
    let closed = closed_loop(model, &with_input_port(controller)?)?;
    Ok(LoopCertificate { poles: closed.poles()?, worst_pole: closed.worst_pole()?, stable: closed.is_stable()? })
}
