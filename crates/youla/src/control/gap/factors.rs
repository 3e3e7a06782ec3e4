//! Normalised coprime factors (D. Meyer and G. Franklin, IEEE Trans. Autom. Control 32 (1987), 227; Vidyasagar 1988): with the
//! regulator F of the weight `y'y + u'u` and its cost X,
//!
//! ```text
//! [M; N] = [A + B F | B W; [F; C + D F] | [I; D] W],     W W' = R^-1,    R = I + D'D (continuous), I + D'D + B'X B (discrete)
//! ```
//!
//! is inner, `M~M + N~N = I`, and `G = N M^-1`. Poles on the stability boundary are no exception.

use crate::control::{LqrWeights, StateFeedback, lqr};
use crate::linalg::{block, eye, solve_right};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::Side;

/// The normalised right factors `[M; N]` of a plant `G = N M^-1` as one stable system with m inputs and m + p outputs.
///
/// Inner to 1e-10 relative (`tests::factors_are_inner`).
///
/// # Errors
/// [`Error::NotStabilisable`], [`Error::NotDetectable`] with the mode, and those of the Riccati equation.
pub(crate) fn normalised_right_factors<T: TimeDomain>(plant: &StateSpace<T>) -> Result<StateSpace<T>> {
    let plant = plant.balanced()?;
    let (m, p) = (plant.inputs(), plant.outputs());
    let (a, b, c, d) = (plant.a(), plant.b(), plant.c(), plant.d());
    let direct = eye(m) + d.transpose() * d;
    let (f, r) = if plant.order() == 0 {
        (faer::Mat::zeros(m, 0), direct)
    } else {
        let StateFeedback { f, cost, .. } =
            lqr(&plant, &LqrWeights::on_outputs(&plant, eye(p).as_ref(), eye(m).as_ref())?)?;
        match plant.time().sample_time() {
            Some(_) => (f, direct + b.transpose() * cost * b),
            None => (f, direct),
        }
    };
    let what = "the weight of the normalised factors";
    let root = r.llt(Side::Lower).map_err(|_| Error::Singular { what: what.into(), rcond: 0.0 })?.L().to_owned();
    // W = L'^-1 of R = L L'.
    let b_w = solve_right(what, root.transpose(), b)?;
    let d_w = solve_right(what, root.transpose(), block(&[&[eye(m).as_ref()], &[d]]).as_ref())?;
    let c_f = block(&[&[f.as_ref()], &[(c + d * &f).as_ref()]]);
    StateSpace::new(a + b * &f, b_w, c_f, d_w, plant.time())
}

/// The normalised left factors `[Mt, Nt]` of a plant `G = Mt^-1 Nt` as one stable system with p + m inputs and p outputs:
/// the right factors of the dual.
///
/// # Errors
/// As for [`normalised_right_factors`], in the words of the dual.
pub(crate) fn normalised_left_factors<T: TimeDomain>(plant: &StateSpace<T>) -> Result<StateSpace<T>> {
    let swap = |error: Error| match error {
        Error::NotStabilisable { what, pole, distance } => Error::NotDetectable { what, pole, distance },
        Error::NotDetectable { what, pole, distance } => Error::NotStabilisable { what, pole, distance },
        other => other,
    };
    Ok(normalised_right_factors(&plant.dual()).map_err(swap)?.dual())
}
