//! The loop around the model: derivatives against differences, and a plant that is unstable by itself.

use super::gradient::{comparison, gradient_error};
use crate::closure::Closure;
use crate::search::criterion::{Comparison, Criterion};
use crate::{Error, Result};
use crate::{GreyBoxOptions, LoopOutput, Matrix, NoiseModel, Problem, Slope, Stop, Structure, greybox};
use faer::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::closed_loop;
use youla::identify::subspace::{Experiment, InitialState};
use youla::lti::{Continuous, Discrete, Partitioned, StateSpace, simulate};

/// An inverted pendulum with its actuator's lag: `x'' = rise^2 x - drag x' + gain v`, `v' = lag (u - v)`.
struct Pendulum;

const TRUTH: [f64; 4] = [4.0, 0.5, 12.0, 30.0];

impl Structure for Pendulum {
    fn names(&self) -> Vec<String> {
        ["rise", "drag", "gain", "lag"].map(String::from).into()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        let a = [[0.0, 1.0, 0.0], [t[0] * t[0], -t[1], t[2]], [0.0, 0.0, -t[3]]];
        let a = Mat::from_fn(3, 3, |i, j| a[i][j]);
        let b = Mat::from_fn(3, 1, |i, _| if i == 2 { t[3] } else { 0.0 });
        Ok(StateSpace::new(a, b, Mat::from_fn(1, 3, |_, j| [1.0, 0.0, 0.0][j]), Mat::zeros(1, 1), Continuous)?)
    }
    fn slopes(&self, t: &[f64], parameter: usize) -> Vec<Slope> {
        let a = |row, column, value| Slope { matrix: Matrix::A, row, column, value };
        match parameter {
            0 => vec![a(1, 0, 2.0 * t[0])],
            1 => vec![a(1, 1, -1.0)],
            2 => vec![a(1, 2, 1.0)],
            _ => vec![a(2, 2, -1.0), Slope { matrix: Matrix::B, row: 2, column: 0, value: 1.0 }],
        }
    }
}

fn time() -> Discrete {
    Discrete::new(0.01).unwrap()
}

/// A filtered lead with an excitation w at its output and its state as what else is seen: `(y, w) -> (u, beta)`.
fn controller() -> Partitioned<Discrete> {
    let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
    let d = Mat::from_fn(2, 2, |i, j| [[-22.0, 1.0], [1.0, -0.2]][i][j]);
    let (b, c) = (Mat::from_fn(1, 2, |_, j| [1.0, 0.1][j]), Mat::from_fn(2, 1, |i, _| [8.0, -0.5][i]));
    Partitioned::new(StateSpace::new(number(0.5), b, c, d, time()).unwrap(), 1, 1).unwrap()
}

/// w, u, y and beta of the loop with the true plant.
fn record(samples: usize, noise: f64, seed: u64) -> [Mat<f64>; 4] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let plant = Pendulum.model(&TRUTH).unwrap().zoh(time()).unwrap();
    assert!(!plant.is_stable().unwrap());
    let closed = closed_loop(&plant, &controller()).unwrap();
    assert!(closed.is_stable().unwrap());
    let levels: Vec<f64> = (0..samples.div_ceil(9)).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect();
    let driving = Mat::from_fn(samples, 2, |k, j| match j {
        0 => levels[k / 9],
        _ => noise * rng.sample::<f64, _>(StandardNormal),
    });
    let z = simulate(&closed, driving.as_ref(), &[0.0; 4]).unwrap();
    let column = |m: &Mat<f64>, j: usize| m.as_ref().subcols(j, 1).to_owned();
    [column(&driving, 0), column(&z, 0), column(&z, 1), column(&z, 2)]
}

#[test]
fn gradient_of_the_loop_is_that_of_the_criterion() {
    let [w, _, y, beta] = record(300, 0.02, 1);
    let (controller, theta) = (controller(), [3.9, 0.6, 12.5, 29.0]);
    for (output, seen) in [(LoopOutput::Plant, &y), (LoopOutput::Deviation, &beta)] {
        for initial in [InitialState::Zero, InitialState::Estimated, InitialState::SteadyState] {
            let experiment = [Experiment::new(w.as_ref(), seen.as_ref())];
            let closure = Some(Closure::new(&controller, output));
            let compared = Comparison { closure, ..comparison(&NoiseModel::OutputError, initial, &[0.7]) };
            let criterion = Criterion::new(&Pendulum, &theta, &experiment, time(), compared).unwrap();
            let error = gradient_error(&theta, &criterion, 1e-3);
            assert!(error < 1e-7, "{output:?}, {initial:?}: {error:.1e}");
        }
    }
}

/// Without noise both forms give the parameters back; with noise the means of 20 estimates lie within four standard errors of
/// the truth, where the simulation of the plant alone cannot even begin.
#[test]
fn an_unstable_plant_is_found_in_its_loop() {
    let (controller, start) = (controller(), [3.0, 1.0, 8.0, 20.0]);
    let options = GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() };
    let find = |[w, _, y, beta]: &[Mat<f64>; 4], output| {
        let seen = if output == LoopOutput::Plant { y } else { beta };
        let experiment = [Experiment::new(w.as_ref(), seen.as_ref())];
        greybox(&Problem::new(&Pendulum, &experiment, time()).in_loop(&controller, output), &start, &options).unwrap()
    };
    for output in [LoopOutput::Plant, LoopOutput::Deviation] {
        let exact = find(&record(2000, 0.0, 2), output);
        let worst = exact.parameters.iter().zip(TRUTH).map(|(p, t)| (p / t - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6 && !exact.stable, "{output:?}: {worst:e}");
        let found: Vec<Vec<f64>> = (0..20)
            .map(|seed| {
                let found = find(&record(2000, 0.02, 10 + seed), output);
                assert!(matches!(found.stop, Stop::Converged | Stop::StepTooSmall));
                found.parameters
            })
            .collect();
        for (j, truth) in TRUTH.into_iter().enumerate() {
            let mean = found.iter().map(|p| p[j]).sum::<f64>() / 20.0;
            let variance = found.iter().map(|p| (p[j] - mean).powi(2)).sum::<f64>() / 19.0;
            let error = (mean - truth).abs() / (variance / 20.0).sqrt();
            assert!(error < 4.0, "{output:?}, parameter {j}: {mean} against {truth}, {error:.1} standard errors");
        }
    }
    let [_, u, y, _] = record(6000, 0.02, 3);
    let alone = greybox(&Problem::new(&Pendulum, &[Experiment::new(u.as_ref(), y.as_ref())], time()), &start, &options);
    assert!(
        matches!(alone, Err(Error::Method(youla::Error::Diverged { .. })))
            || alone.is_ok_and(|found| found.fit[0] < 0.0)
    );
}

#[test]
fn loops_that_do_not_fit_are_refused() {
    let [w, _, y, _] = record(300, 0.0, 4);
    let experiment = [Experiment::new(w.as_ref(), y.as_ref())];
    let wide = Partitioned::new(controller().system().clone(), 2, 1).unwrap();
    let refused = greybox(
        &Problem::new(&Pendulum, &experiment, time()).in_loop(&wide, LoopOutput::Plant),
        &TRUTH,
        &GreyBoxOptions::default(),
    );
    let sentence = refused.unwrap_err().to_string();
    assert!(sentence.contains("the number of outputs of the controller"), "{sentence}");
}
