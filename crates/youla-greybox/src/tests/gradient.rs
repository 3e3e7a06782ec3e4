//! Derivatives against differences.

use super::{bearing, off, open_loop, time, truth};
use crate::Result;
use crate::prediction::sampled::{Coordinates, sample, sampled_slopes};
use crate::search::criterion::{Comparison, Criterion};
use crate::{Matrix, NoiseModel, Slope, Structure};
use faer::Mat;
use youla::identify::subspace::InitialState;
use youla::linalg::eye;
use youla::lti::{Continuous, StateSpace};

/// Central difference of fourth order with the relative step h.
fn difference(value: impl Fn(f64) -> f64, at: f64, h: f64) -> f64 {
    let h = h * at.abs().max(1e-3);
    let pair = |k: f64| value(at + k * h) - value(at - k * h);
    (8.0 * pair(1.0) - pair(2.0)) / (12.0 * h)
}

/// What is compared in the open loop.
pub(in super::super) fn comparison<'a>(
    noise: &'a NoiseModel,
    initial_state: InitialState,
    deviations: &'a [f64],
) -> Comparison<'a> {
    Comparison { closure: None, noise, initial_state, deviations }
}

/// Largest error of the gradient over all parameters, those of the noise too, relative to `|J_j| |r|`.
pub(in super::super) fn gradient_error(theta: &[f64], criterion: &Criterion<'_>, h: f64) -> f64 {
    let here = criterion.linearise(&criterion.evaluate(theta).unwrap()).unwrap();
    let gradient = here.jacobian().transpose() * here.residual();
    let error = |j: usize| {
        let value = |v: f64| {
            let mut moved = theta.to_vec();
            moved[j] = v;
            criterion.evaluate(&moved).unwrap().cost
        };
        let size = here.jacobian().col(j).norm_l2() * here.residual().norm_l2();
        (difference(value, theta[j], h) + gradient[(j, 0)]).abs() / size
    };
    (0..theta.len()).map(error).fold(0.0, f64::max)
}

#[test]
fn gradient_is_that_of_the_criterion() {
    let data = open_loop(700, [0.3, 0.3], &[2.0, -1.0, 900.0, 300.0, 0.2, -0.3], 1);
    let theta = off(&truth(), 0.1, 2);
    for initial in [InitialState::Zero, InitialState::Estimated] {
        let experiments = [data.experiment(), data.experiment()];
        let compared = comparison(&NoiseModel::OutputError, initial, &[0.5, 2.0]);
        let criterion = Criterion::new(bearing(), &theta, &experiments, time(), compared).unwrap();
        let point = criterion.evaluate(&theta).unwrap();
        let here = criterion.linearise(&point).unwrap();
        assert!((0.5 * here.residual().squared_norm_l2() / point.cost - 1.0).abs() < 1e-11);
        let error = gradient_error(&theta, &criterion, 1e-3);
        assert!(error < 1e-7, "{initial:?}: {error:.1e}");
    }
}

/// A structure in which every matrix moves, with three lanes of different kinds.
pub(super) struct Everything;

impl Structure for Everything {
    fn names(&self) -> Vec<String> {
        ["a", "b", "c", "d", "shared"].map(String::from).into()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        let a = Mat::from_fn(2, 2, |i, j| [[-1.0, t[0]], [-t[0] * t[0], -0.3 * t[4]]][i][j]);
        let b = Mat::from_fn(2, 1, |i, _| [t[1], 0.2][i]);
        let c = Mat::from_fn(1, 2, |_, j| [t[2], t[4]][j]);
        Ok(StateSpace::new(a, b, c, Mat::from_fn(1, 1, |_, _| t[3]), Continuous)?)
    }
    fn slopes(&self, t: &[f64], parameter: usize) -> Vec<Slope> {
        let slope = |matrix, row, column, value| Slope { matrix, row, column, value };
        match parameter {
            0 => vec![slope(Matrix::A, 0, 1, 1.0), slope(Matrix::A, 1, 0, -2.0 * t[0])],
            1 => vec![slope(Matrix::B, 0, 0, 1.0)],
            2 => vec![slope(Matrix::C, 0, 0, 1.0)],
            3 => vec![slope(Matrix::D, 0, 0, 1.0)],
            _ => vec![slope(Matrix::A, 1, 1, -0.3), slope(Matrix::C, 0, 1, 1.0)],
        }
    }
}

#[test]
fn every_matrix_may_move() {
    let u = Mat::from_fn(60, 1, |k, _| ((k * k) as f64 * 0.37).sin());
    let y = Mat::from_fn(60, 1, |k, _| (k as f64 * 0.21).cos());
    let theta = [1.3, 0.7, -0.4, 0.2, 0.9];
    let experiment = youla::identify::subspace::Experiment::new(u.as_ref(), y.as_ref());
    let time = youla::lti::Discrete::new(0.2).unwrap();
    let compared = comparison(&NoiseModel::OutputError, InitialState::Estimated, &[]);
    let criterion = Criterion::new(&Everything, &theta, &[experiment], time, compared).unwrap();
    let error = gradient_error(&theta, &criterion, 1e-3);
    assert!(error < 1e-9, "{error:.1e}");
}

#[test]
fn sampling_has_the_derivative_of_a_lag() {
    struct Lag;
    impl Structure for Lag {
        fn names(&self) -> Vec<String> {
            vec!["rate".into()]
        }
        fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
            Ok(StateSpace::new(-eye(1) * faer::Scale(t[0]), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?)
        }
        fn slopes(&self, _: &[f64], _: usize) -> Vec<Slope> {
            vec![Slope { matrix: Matrix::A, row: 0, column: 0, value: -1.0 }]
        }
    }
    // Ad = e^(-rt), Bd = (1 - e^(-rt)) / r.
    let (r, t) = (3.0, time().ts());
    let coordinates = Coordinates { states: vec![1.0], inputs: 1, outputs: 1 };
    let here = sample(&Lag, &[r], &coordinates, time()).unwrap();
    let slopes = sampled_slopes(&Lag, &[r], &here, &coordinates, time()).unwrap();
    let decay = f64::exp(-r * t);
    assert!((slopes[0].states[(0, 0)] / (-t * decay) - 1.0).abs() < 1e-14);
    assert!((slopes[0].states[(0, 1)] / ((t * decay + (-r * t).exp_m1() / r) / r) - 1.0).abs() < 1e-8);
}
