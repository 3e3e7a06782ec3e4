//! Model reduction, eq. (29): balanced truncation, singular perturbation approximation, normalised coprime factors and
//! truncation weighted by the loop, each with the check that the controller still stabilises what is left.
//!
//! With the Gramians P and Q of a stable system, the Hankel singular values `sigma_1 >= sigma_2 >= ...` are the square
//! roots of the eigenvalues of P Q. Truncation and singular perturbation keep the r strongest states and satisfy
//! ```text
//! max over omega of || G(omega) - G_r(omega) ||  <=  2 (sigma_(r+1) + ... + sigma_n)
//! ```
//! (D. F. Enns, 1984; K. Glover, 1984; Y. Liu and B. D. O. Anderson, Int. J. Control 50 (1989), 1379). Truncation is exact
//! at infinite frequency (continuous time), singular perturbation at frequency zero.
//!
//! Unstable, integrating and lightly damped models. [`split()`] sets poles at or beyond a boundary apart; they stay as they are
//! and the rest is reduced, with the same bound. Normalised coprime factors `G = N M^-1` are stable whatever G is; their
//! truncation gives `G_r = N_r M_r^-1` within `2 (sigma_(r+1) + ...)` of G in the gap metric (D. G. Meyer, IEEE Trans. Autom.
//! Control 35 (1990), 1341), where all `sigma < 1`.
//!
//! In the loop. To first order the deviation system changes by `dS = (Mt + S Ut) dG (M + U S)`, so that a reduction for the loop
//! weighs its error by the two outer systems. [`reduce_in_loop`] measures what every order costs in open and closed loop.
//!
//! Scaling. Hankel singular values compare outputs with each other and inputs with each other in their units; for normalised
//! factors the unit of the outputs against that of the inputs matters too. Express channels in units in which equal numbers
//! matter equally (for instance the largest admissible displacement and voltage), or give `output_scale` and `input_scale`. The
//! coordinates of the state do not matter.

mod balanced;
mod in_loop;
#[cfg(test)]
mod loop_tests;
mod options;
#[cfg(feature = "serde")]
mod order_form;
mod reducer;
#[cfg(test)]
mod reference_tests;
mod split;
mod sweep;
#[cfg(test)]
mod tests;
mod weighted;

pub use in_loop::{LoopReduction, ReductionLoop, reduce_in_loop};
pub use options::{ReducedOrder, ReductionMethod, ReductionOptions};
pub use split::{Split, split};
pub use sweep::{ReductionSweep, SweepRow, sweep};
pub use weighted::FrequencyWeights;

use crate::lti::{PeakGain, PeakOptions, StateSpace, TimeDomain, linf_norm};
use crate::{Result, c64};
use balanced::HankelDecomposition;
use reducer::Reducer;

/// A reduced model and what its reduction cost.
#[derive(Debug, Clone)]
pub struct Reduction<T: TimeDomain> {
    /// The reduced model, of order r.
    pub model: StateSpace<T>,
    /// Hankel singular values in descending order: of the part that is reduced, of its normalised coprime factors, or of the
    /// part with the weights.
    pub hankel: Vec<f64>,
    /// Twice the sum of the Hankel singular values that are left out: bound of the largest singular value of the error over all
    /// frequencies, in the scaled units; of the gap between the scaled models for normalised coprime factors. Weighted
    /// truncation has none.
    pub error_bound: Option<f64>,
    /// States that are kept apart and Hankel singular values above the fraction `minimality` of the largest.
    pub minimal_order: usize,
    /// Poles that were kept as they are.
    pub kept: Vec<c64>,
    /// The worst pole of the part that was reduced where weights made it unstable; the other methods cannot.
    pub unstable_pole: Option<c64>,
    /// The method that was used.
    pub method: ReductionMethod,
    /// `G - G_r` without what was kept, scaled.
    error: StateSpace<T>,
    /// `[M; N] - [M_r; N_r]`.
    factor_error: Option<StateSpace<T>>,
}

impl<T: TimeDomain> Reduction<T> {
    /// Largest singular value of `G - G_r` over all frequencies, in the scaled units: what the bound of balanced truncation and
    /// singular perturbation is about.
    ///
    /// # Errors
    /// As [`linf_norm`]: [`crate::Error::PoleOnBoundary`] where normalised coprime factors moved a pole of the stability
    /// boundary.
    pub fn measured_error(&self) -> Result<PeakGain> {
        linf_norm(&self.error, &PeakOptions::default())
    }

    /// Largest singular value of `[M; N] - [M_r; N_r]` over all frequencies: what the bound of normalised coprime factors is
    /// about. It is an upper bound of the gap. `None` for the other methods.
    ///
    /// # Errors
    /// As [`linf_norm`].
    pub fn measured_factor_error(&self) -> Result<Option<PeakGain>> {
        self.factor_error.as_ref().map(|error| linf_norm(error, &PeakOptions::default())).transpose()
    }
}

/// Reduces a system (n states) to order r.
///
/// The Gramian factors come from Hammarling's method and are never squared; the projections are balancing-free (A. Varga,
/// Efficient minimal realization procedure based on balancing, 1991), so that exact cancellations do no harm. The bounds
/// hold (test `error_stays_below_its_bound`); the published examples are met to their printed digits (`reference_tests`).
///
/// # Errors
/// [`crate::Error::Unstable`] with the pole where a method needs a stable system: nothing is split off or reflected silently.
/// [`crate::Error::Order`] for an order that is not possible,
/// [`crate::Error::Unsupported`] for choices that need the loop, [`crate::Error::OutOfRange`] for a number.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace}};
/// use youla::reduce::{ReducedOrder, ReductionOptions, reduce};
/// let a = Mat::from_fn(2, 2, |i, j| if i == j { [-1.0, -100.0][i] } else { 0.0 });
/// let system = StateSpace::new(a, eye(2), eye(2), Mat::zeros(2, 2), Continuous)?;
/// let reduced = reduce(&system, &ReductionOptions { order: ReducedOrder::Fixed(1), ..Default::default() })?;
/// assert_eq!(reduced.model.order(), 1);
/// assert!((reduced.error_bound.unwrap() - 0.01).abs() < 1e-12);
/// assert!((reduced.measured_error()?.value - 0.01).abs() < 1e-9);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn reduce<T: TimeDomain>(system: &StateSpace<T>, options: &ReductionOptions) -> Result<Reduction<T>> {
    let reducer = Reducer::new(system, None, options)?;
    reducer.reduction(reducer.choose(options.order)?)
}

/// Hankel singular values of a stable system, n values in descending order.
///
/// # Errors
/// [`crate::Error::Unstable`] with the pole; [`crate::Error::NoConvergence`].
pub fn hankel_singular_values<T: TimeDomain>(system: &StateSpace<T>) -> Result<Vec<f64>> {
    system.require_stable("the system")?;
    Ok(HankelDecomposition::new(system.balanced()?)?.hankel)
}
