//! The linear-quadratic regulator: the state feedback that minimises the sum or integral of
//!
//! ```text
//! [x; u]' [Q S; S' R] [x; u]       along  x^+ = A x + B u
//! ```
//!
//! (H. Kwakernaak and R. Sivan, Linear Optimal Control Systems, 1972, chapters 3 and 6). In this library feedback is
//! positive: `u = F x`, and `A + B F` is stable. The textbooks' gain K of `u = -K x` is `F = -K`.

use crate::Result;
use crate::linalg::{
    RiccatiProblem, RiccatiSolution, block, care, check_finite, check_semidefinite, check_shape, dare,
};
use crate::lti::{StateSpace, TimeDomain};
use faer::{Mat, MatRef, c64};

/// Weight `[Q S; S' R]` of states and inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct LqrWeights {
    /// Weight Q of the states, n x n, symmetric; `[Q S; S' R]` is positive semidefinite.
    pub q: Mat<f64>,
    /// Weight R of the inputs, m x m, symmetric and positive definite.
    pub r: Mat<f64>,
    /// Cross term S, n x m; none means zero.
    pub s: Option<Mat<f64>>,
}

impl LqrWeights {
    /// The weight `y' Qy y + u' R u` of outputs and inputs, with `y = C x + D u`.
    ///
    /// # Errors
    /// [`crate::Error::Shape`] unless `output` is p x p and `input` m x m, [`crate::Error::NotFinite`] for a bad entry.
    pub fn on_outputs<T: TimeDomain>(
        plant: &StateSpace<T>,
        output: MatRef<'_, f64>,
        input: MatRef<'_, f64>,
    ) -> Result<Self> {
        let (m, p) = (plant.inputs(), plant.outputs());
        for (name, weight, expected) in [("output", output, (p, p)), ("input", input, (m, m))] {
            let name = format!("the {name} weight of the regulator");
            check_shape(&name, weight, expected)?;
            check_finite(&name, weight)?;
        }
        let (c, d) = (plant.c(), plant.d());
        let (q, r) = (c.transpose() * output * c, input + d.transpose() * output * d);
        let q = 0.5 * (&q + q.transpose());
        Ok(LqrWeights { q, r, s: Some(c.transpose() * output * d) })
    }

    /// `[Q S; S' R]`.
    fn joint(&self) -> Mat<f64> {
        let none = Mat::zeros(self.q.nrows(), self.r.ncols());
        let s = self.s.as_ref().unwrap_or(&none);
        block(&[&[self.q.as_ref(), s.as_ref()], &[s.transpose(), self.r.as_ref()]])
    }
}

/// A stabilising state feedback `u = F x`.
#[derive(Debug, Clone)]
pub struct StateFeedback {
    /// Gain F, m x n: `A + B F` is stable (positive feedback).
    pub f: Mat<f64>,
    /// Solution X of the Riccati equation: `x' X x` is the least cost from the state x.
    pub cost: Mat<f64>,
    /// Eigenvalues of `A + B F`.
    pub closed_loop_poles: Vec<c64>,
    /// Relative residual of the Riccati equation, see [`RiccatiSolution::relative_residual`].
    pub relative_residual: f64,
}

/// The gain F of `u = F x` (positive feedback, this library) for the gain K of `u = -K x` (textbooks, other programs), and
/// back: `F = -K`.
pub fn flip_feedback_sign(gain: MatRef<'_, f64>) -> Mat<f64> {
    -gain
}

/// Computes the linear-quadratic regulator of a plant, in the plant's time domain.
///
/// The feedthrough D plays no part (weights on outputs: [`LqrWeights::on_outputs`]). Accuracy: that of
/// [`care`] and [`dare`].
///
/// # Errors
/// [`crate::Error::Shape`], [`crate::Error::NotFinite`], [`crate::Error::NotSymmetric`], [`crate::Error::NotPositive`] name the weight;
/// [`crate::Error::NotStabilisable`], [`crate::Error::NotDetectable`] name the mode in the way; [`crate::Error::NoSolution`].
///
/// ```
/// use youla::{Mat, control::{LqrWeights, lqr}, linalg::eye, lti::{Continuous, StateSpace}};
/// // x' = x + u with unit weights: F = -(1 + sqrt 2), the pole moves from 1 to -sqrt 2.
/// let plant = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// let feedback = lqr(&plant, &LqrWeights { q: eye(1), r: eye(1), s: None })?;
/// assert!((feedback.f[(0, 0)] + 1.0 + 2f64.sqrt()).abs() < 1e-14);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn lqr<T: TimeDomain>(plant: &StateSpace<T>, weights: &LqrWeights) -> Result<StateFeedback> {
    regulator("the regulator", plant, weights)
}

/// [`lqr`] under the name by which errors speak of it.
pub(super) fn regulator<T: TimeDomain>(
    what: &str,
    plant: &StateSpace<T>,
    weights: &LqrWeights,
) -> Result<StateFeedback> {
    let LqrWeights { q, r, s } = weights;
    let s = s.as_ref().map(|s| s.as_ref());
    let problem = RiccatiProblem { a: plant.a(), b: plant.b(), q: q.as_ref(), r: r.as_ref(), s };
    problem.check(what)?;
    check_semidefinite(&format!("the joint weight [Q S; S' R] of {what}"), weights.joint().as_ref())?;
    let solution = match plant.time().sample_time() {
        None => care(what, &problem)?,
        Some(_) => dare(what, &problem)?,
    };
    let RiccatiSolution { x, gain, closed_loop_poles, relative_residual, .. } = solution;
    let f = flip_feedback_sign(gain.as_ref());
    Ok(StateFeedback { f, cost: x, closed_loop_poles, relative_residual })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{discrete_sylvester, eigenvalues, eye};
    use crate::lti::{Continuous, Discrete};

    fn matrix<const N: usize, const M: usize>(values: [[f64; M]; N]) -> Mat<f64> {
        Mat::from_fn(N, M, |i, j| values[i][j])
    }

    fn plant<T: TimeDomain>(time: T) -> StateSpace<T> {
        let a = matrix([[0.9, 0.4, 0.0], [-0.4, 0.9, 0.1], [0.0, 0.3, 1.1]]);
        let c = matrix([[1.0, 0.0, 0.5], [0.0, 2.0, 0.0]]);
        StateSpace::new(a, matrix([[0.0], [1.0], [0.2]]), c, matrix([[0.3], [0.0]]), time).unwrap()
    }

    #[test]
    fn positive_feedback_stabilises_in_both_time_domains() {
        fn check<T: TimeDomain>(time: T) {
            let plant = plant(time);
            let feedback = lqr(&plant, &LqrWeights { q: eye(3), r: eye(1), s: None }).unwrap();
            let unstable =
                |a: Mat<f64>| eigenvalues("A", a.as_ref()).unwrap().into_iter().any(|p| time.instability(p) >= 0.0);
            assert!(!unstable(plant.a() + plant.b() * &feedback.f));
            // The wrong sign must not pass.
            assert!(unstable(plant.a() - plant.b() * &feedback.f));
            assert!(feedback.relative_residual < 1e-13);
        }
        check(Continuous);
        check(Discrete::new(1e-3).unwrap());
    }

    #[test]
    fn indefinite_weights_are_refused() {
        let weights = LqrWeights { q: 0.01 * eye(3), r: eye(1), s: Some(Mat::full(3, 1, 1.0)) };
        let refused = lqr(&plant(Continuous), &weights);
        assert!(matches!(refused, Err(crate::Error::NotPositive { .. })));
    }

    #[test]
    fn the_cost_is_that_of_the_closed_loop_and_least() {
        // The cost matrix of any stabilising F solves Ac'P Ac - P = -[I; F]'[Q S; S' R][I; F].
        let plant = plant(Discrete::new(1.0).unwrap());
        let weights = LqrWeights::on_outputs(&plant, eye(2).as_ref(), (0.1 * eye(1)).as_ref()).unwrap();
        let cost = |f: &Mat<f64>| {
            let closed = plant.a() + plant.b() * f;
            let outputs = plant.c() + plant.d() * f;
            let stage = outputs.transpose() * &outputs + 0.1 * f.transpose() * f;
            discrete_sylvester("P", closed.transpose(), closed.as_ref(), (-stage).as_ref()).unwrap().x
        };
        let best = lqr(&plant, &weights).unwrap();
        assert!((cost(&best.f) - &best.cost).norm_l2() < 1e-12 * best.cost.norm_l2());
        for k in 0..3 {
            let mut other = best.f.clone();
            other[(0, k)] += 1e-3;
            let excess = cost(&other) - &best.cost;
            assert!((0..3).map(|i| excess[(i, i)]).sum::<f64>() > 1e-8);
        }
    }
}
