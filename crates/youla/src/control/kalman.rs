//! The stationary Kalman filter of
//!
//! ```text
//! x^+ = A x + B u + w,   y = C x + D u + v,   cov [w; v] = [Q S; S' R]
//! ```
//!
//! as the dual of the regulator (R. E. Kalman and R. S. Bucy, J. Basic Eng. 83 (1961), 95): the filter of (A, C) is the
//! regulator of (A', C') with the covariances for weights. In this library the observer is `x^+ = A x + B u - L beta` with
//! the innovation `beta = y - C x - D u`, and `A + L C` is stable: L is minus the gain of the one-step predictor
//! (`-A Lc` for the gain Lc of the current estimator in discrete time).

use super::lqr::{LqrWeights, StateFeedback, regulator};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};

/// How errors name the filter and its covariances.
const WHAT: &str = "the Kalman filter (dual regulator: Q is the process noise, R the measurement noise)";

/// Covariance `[Q S; S' R]` of process and measurement noise: per sample in discrete time, intensity in continuous time.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseCovariance {
    /// Process noise Q, n x n, symmetric; `[Q S; S' R]` is positive semidefinite.
    pub process: Mat<f64>,
    /// Measurement noise R, p x p, symmetric and positive definite.
    pub measurement: Mat<f64>,
    /// Cross-covariance S, n x p; none means zero.
    pub cross: Option<Mat<f64>>,
}

impl NoiseCovariance {
    /// White noise of covariance `input` (m x m) at the inputs of the plant and `measurement` (p x p) at its outputs: the
    /// dual of [`LqrWeights::on_outputs`].
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`], in the words of the dual.
    pub fn at_inputs<T: TimeDomain>(
        plant: &StateSpace<T>,
        input: MatRef<'_, f64>,
        measurement: MatRef<'_, f64>,
    ) -> Result<Self> {
        let LqrWeights { q, r, s } = LqrWeights::on_outputs(&plant.dual(), input, measurement)?;
        Ok(NoiseCovariance { process: q, measurement: r, cross: s })
    }
}

/// A stabilising observer gain.
#[derive(Debug, Clone)]
pub struct ObserverGain {
    /// Gain L, n x p: `A + L C` is stable, L is minus the predictor gain.
    pub l: Mat<f64>,
    /// Covariance of the error of the predicted state, n x n.
    pub error_covariance: Mat<f64>,
    /// Eigenvalues of `A + L C`.
    pub observer_poles: Vec<c64>,
    /// Relative residual of the Riccati equation, see [`crate::linalg::RiccatiSolution::relative_residual`].
    pub relative_residual: f64,
}

/// Computes the stationary Kalman filter of a plant, in the plant's time domain.
///
/// The inputs B and D play no part. Process noise may be absent: the unstable poles are then reflected and the stable
/// ones left alone. Accuracy: that of [`crate::linalg::care`] and [`crate::linalg::dare`].
///
/// # Errors
/// [`Error::Shape`], [`Error::NotFinite`], [`Error::NotSymmetric`], [`Error::NotPositive`] name the covariance;
/// [`Error::NotDetectable`] the mode that no output shows, [`Error::NotStabilisable`] the mode on the stability boundary
/// that no noise moves; [`Error::NoSolution`].
///
/// ```
/// use youla::{Mat, control::{NoiseCovariance, kalman}, linalg::eye, lti::{Discrete, StateSpace}};
/// // Random walk seen in noise of the same size: L is minus the reciprocal of the golden ratio.
/// let walk = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1.0)?)?;
/// let gain = kalman(&walk, &NoiseCovariance { process: eye(1), measurement: eye(1), cross: None })?;
/// assert!((gain.l[(0, 0)] + 0.5 * (5f64.sqrt() - 1.0)).abs() < 1e-14);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn kalman<T: TimeDomain>(plant: &StateSpace<T>, noise: &NoiseCovariance) -> Result<ObserverGain> {
    let NoiseCovariance { process, measurement, cross } = noise.clone();
    let weights = LqrWeights { q: process, r: measurement, s: cross };
    let dual = regulator(WHAT, &plant.dual(), &weights).map_err(in_words_of_the_filter)?;
    let StateFeedback { f, cost, closed_loop_poles, relative_residual } = dual;
    let l = f.transpose().to_owned();
    Ok(ObserverGain { l, error_covariance: cost, observer_poles: closed_loop_poles, relative_residual })
}

/// What no input of the dual moves, no output of the plant shows; what no weight of the dual sees, no noise moves.
fn in_words_of_the_filter(error: Error) -> Error {
    match error {
        Error::NotStabilisable { what, pole, distance } => Error::NotDetectable { what, pole, distance },
        Error::NotDetectable { what, pole, distance } => Error::NotStabilisable { what, pole, distance },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::lqr;
    use crate::linalg::{block, eigenvalues, eye};
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
    fn the_observer_is_stable_in_both_time_domains() {
        fn check<T: TimeDomain>(time: T) {
            let plant = plant(time);
            let noise = NoiseCovariance::at_inputs(&plant, eye(1).as_ref(), (0.01 * eye(2)).as_ref()).unwrap();
            let gain = kalman(&plant, &noise).unwrap();
            let poles = eigenvalues("A + L C", (plant.a() + &gain.l * plant.c()).as_ref()).unwrap();
            assert!(poles.into_iter().all(|p| time.instability(p) < 0.0));
            assert!(gain.relative_residual < 1e-13);
        }
        check(Continuous);
        check(Discrete::new(1e-3).unwrap());
    }

    #[test]
    fn the_filter_of_the_dual_is_the_regulator_transposed() {
        let plant = plant(Discrete::new(1e-3).unwrap());
        let (q, r) = (eye(3), 0.1 * eye(1));
        let feedback = lqr(&plant, &LqrWeights { q: q.clone(), r: r.clone(), s: None }).unwrap();
        let gain = kalman(&plant.dual(), &NoiseCovariance { process: q, measurement: r, cross: None }).unwrap();
        assert_eq!(gain.l, feedback.f.transpose().to_owned());
    }

    #[test]
    fn an_innovation_model_is_its_own_filter() {
        // x^+ = A x + K e, y = C x + e with A - K C stable: the filter finds K again and predicts without error.
        let a = matrix([[0.95, 0.2, 0.0], [-0.2, 0.95, 0.3], [0.0, 0.0, 0.5]]);
        let c = matrix([[1.0, 0.0, 1.0]]);
        let k = matrix([[0.4], [0.1], [-0.2]]);
        let variance = 0.04;
        let model = StateSpace::new(a, Mat::zeros(3, 0), c, Mat::zeros(1, 0), Discrete::new(1.0).unwrap()).unwrap();
        let root = block(&[&[k.as_ref()], &[eye(1).as_ref()]]);
        let covariance = variance * &root * root.transpose();
        let noise = NoiseCovariance {
            process: covariance.submatrix(0, 0, 3, 3).to_owned(),
            measurement: covariance.submatrix(3, 3, 1, 1).to_owned(),
            cross: Some(covariance.submatrix(0, 3, 3, 1).to_owned()),
        };
        let gain = kalman(&model, &noise).unwrap();
        assert!((&gain.l + &k).norm_max() < 1e-13);
        assert!(gain.error_covariance.norm_max() < 1e-14);
    }

    #[test]
    fn refusals_speak_of_the_filter() {
        let a = matrix([[1.0, 0.0], [0.0, 0.5]]);
        let with_output = |c: [[f64; 2]; 1], process: [[f64; 2]; 2], variance: f64| {
            let d = Mat::zeros(1, 1);
            let plant =
                StateSpace::new(a.clone(), Mat::zeros(2, 1), matrix(c), d, Discrete::new(1.0).unwrap()).unwrap();
            kalman(&plant, &NoiseCovariance { process: matrix(process), measurement: variance * eye(1), cross: None })
        };
        let driven = [[1.0, 0.0], [0.0, 1.0]];
        assert!(with_output([[1.0, 1.0]], driven, 1.0).is_ok());
        assert!(matches!(with_output([[0.0, 1.0]], driven, 1.0), Err(Error::NotDetectable { .. })));
        assert!(matches!(with_output([[1.0, 1.0]], [[0.0, 0.0], [0.0, 1.0]], 1.0), Err(Error::NotStabilisable { .. })));
        assert!(matches!(with_output([[1.0, 1.0]], driven, 0.0), Err(Error::NotPositive { .. })));
    }
}
