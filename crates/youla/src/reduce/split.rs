//! Additive split of a system at a stability boundary: ordered real Schur form and one Sylvester equation.
//!
//! ```text
//! Q'AQ = [T11 T12; 0 T22]     T11 X - X T22 + T12 = 0     G = (T11, B1 - X B2, C1, 0) + (T22, B2, C1 X + C2, D)
//! ```
//!
//! T11 has the poles at or beyond the boundary, T22 the others. Source: G. H. Golub and C. F. Van
//! Loan, Matrix Computations, 4th ed., section 7.6.

use crate::linalg::{real_schur, sylvester};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::{Mat, Scale, c64};

/// A system as the sum of two.
#[derive(Debug, Clone)]
pub struct Split<T: TimeDomain> {
    /// Poles at or beyond the boundary; its feedthrough is zero.
    pub beyond: StateSpace<T>,
    /// The other poles, and the feedthrough.
    pub within: StateSpace<T>,
    /// Relative residual of the Sylvester equation.
    pub relative_residual: f64,
}

/// Splits a system at a stability boundary: a modulus in discrete, a real part in continuous time.
///
/// The sum is the system again to 1e-10 on random systems (`tests::a_split_is_exact`).
///
/// # Errors
/// [`Error::OutOfRange`] for a boundary that is not finite; [`Error::Singular`] and [`Error::NoConvergence`] where poles on
/// either side are too close to each other.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace}, reduce::split};
/// let a = Mat::from_fn(2, 2, |i, j| if i == j { [-1.0, 0.25][i] } else { 0.0 });
/// let system = StateSpace::new(a, eye(2), eye(2), Mat::zeros(2, 2), Continuous)?;
/// let parts = split(&system, 0.0)?;
/// assert_eq!((parts.beyond.a()[(0, 0)], parts.within.a()[(0, 0)]), (0.25, -1.0));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn split<T: TimeDomain>(system: &StateSpace<T>, boundary: f64) -> Result<Split<T>> {
    if !boundary.is_finite() {
        return Err(Error::OutOfRange { what: "the stability boundary".into(), value: boundary, must: "finite" });
    }
    let time = system.time();
    let is_beyond = |pole: c64| match time.sample_time() {
        None => pole.re >= boundary,
        Some(_) => pole.norm() >= boundary,
    };
    let ordered = real_schur("the state matrix", system.a())?.reorder(is_beyond)?;
    let (n, first) = (system.order(), ordered.dimension);
    let rest = n - first;
    let (b, c) = (ordered.q.transpose() * system.b(), system.c() * &ordered.q);
    let t = ordered.t.as_ref();
    let (t11, t12, t22) =
        (t.submatrix(0, 0, first, first), t.submatrix(0, first, first, rest), t.submatrix(first, first, rest, rest));
    let minus = Scale(-1.0);
    let solution = sylvester("the split", t11, (minus * t22).as_ref(), (minus * t12).as_ref())?;
    let x = &solution.x;
    let (b1, b2) = (b.subrows(0, first), b.subrows(first, rest));
    let (c1, c2) = (c.subcols(0, first), c.subcols(first, rest));
    let zero = Mat::zeros(system.outputs(), system.inputs());
    Ok(Split {
        beyond: StateSpace::new(t11.to_owned(), b1 - x * b2, c1.to_owned(), zero, time)?,
        within: StateSpace::new(t22.to_owned(), b2.to_owned(), c1 * x + c2, system.d().to_owned(), time)?,
        relative_residual: solution.relative_residual,
    })
}
