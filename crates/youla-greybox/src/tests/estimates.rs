//! What the estimates are worth.

use super::{bearing, off, open_loop, time, truth};
use crate::{GreyBoxModel, GreyBoxOptions, Problem, Stop, greybox};
use rayon::prelude::*;
use youla::identify::subspace::InitialState;

const REST: [f64; 6] = [0.0; 6];

fn from_rest() -> GreyBoxOptions {
    GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() }
}

/// Differences from the truth in standard deviations.
fn scaled_errors(found: &GreyBoxModel) -> Vec<f64> {
    let deviations = found.standard_deviations().unwrap();
    found
        .parameters
        .iter()
        .zip(truth())
        .zip(deviations)
        .map(|((found, truth), sigma)| (found - truth) / sigma)
        .collect()
}

#[test]
fn noise_free_records_give_the_parameters_back() {
    let moving = [2.0, -1.0, 900.0, 300.0, 0.2, -0.3];
    let first = open_loop(1500, [0.0; 2], &moving, 3);
    let second = open_loop(800, [0.0; 2], &REST, 4);
    let experiments = [first.experiment(), second.experiment()];
    let start = off(&truth(), 0.2, 5);
    let found = greybox(&Problem::new(bearing(), &experiments, time()), &start, &GreyBoxOptions::default()).unwrap();
    for (found, truth) in found.parameters.iter().zip(truth()) {
        assert!((found / truth - 1.0).abs() < 1e-6, "{found} for {truth}");
    }
    for (found, truth) in found.initial_states[0].iter().zip(moving) {
        assert!((found - truth).abs() < 1e-6 * (1.0 + truth.abs()), "{found} for {truth}");
    }
    assert!(matches!(found.stop, Stop::Exact | Stop::StepTooSmall), "{:?}", found.stop);
    assert!(found.fit.iter().all(|fit| *fit > 99.9999), "{:?}", found.fit);
    assert_eq!((found.rank, found.stable), (14, true));
}

#[test]
fn noisy_records_give_them_within_their_deviations() {
    let data = open_loop(5000, [0.3; 2], &REST, 6);
    let start = off(&truth(), 0.2, 7);
    let found = greybox(&Problem::new(bearing(), &[data.experiment()], time()), &start, &from_rest()).unwrap();
    let errors = scaled_errors(&found);
    assert!(errors.iter().all(|e| e.abs() < 4.0), "{errors:?}");
    assert_eq!(found.stop, Stop::Converged);
    assert!(found.residual.iter().all(|r| (r / 0.3 - 1.0).abs() < 0.03), "{:?}", found.residual);
    assert_eq!((found.iterations, found.evaluations, found.diverged), (5, 6, 0));
    assert!((found.rcond / 0.2524 - 1.0).abs() < 1e-3, "{}", found.rcond);
}

/// 200 runs leave an uncertainty of 5 % in the scatter of one parameter: the bounds are four times that.
#[test]
fn scatter_is_that_of_the_covariance() {
    const RUNS: u64 = 200;
    let run = |run: u64| {
        let data = open_loop(1500, [0.3; 2], &REST, 100 + run);
        scaled_errors(&greybox(&Problem::new(bearing(), &[data.experiment()], time()), &truth(), &from_rest()).unwrap())
    };
    let errors: Vec<Vec<f64>> = (0..RUNS).into_par_iter().map(run).collect();
    let scatter = |j: usize| (errors.iter().map(|e| e[j] * e[j]).sum::<f64>() / RUNS as f64).sqrt();
    let ratios: Vec<f64> = (0..14).map(scatter).collect();
    let mean = ratios.iter().sum::<f64>() / 14.0;
    assert!(ratios.iter().all(|ratio| (0.8..1.25).contains(ratio)), "{ratios:?}");
    assert!((0.9..1.1).contains(&mean), "{mean}");
}

/// Stated deviations of 0.1 and 1 um give the better output its weight.
#[test]
fn deviations_of_the_outputs_weigh() {
    let data = open_loop(3000, [0.1, 1.0], &REST, 8);
    let fit = |output_deviations: Vec<f64>| {
        let options = GreyBoxOptions { output_deviations, ..from_rest() };
        greybox(&Problem::new(bearing(), &[data.experiment()], time()), &truth(), &options).unwrap()
    };
    let weighted = fit(vec![1.0, 10.0]);
    let errors = scaled_errors(&weighted);
    assert!(errors.iter().all(|e| e.abs() < 4.0), "{errors:?}");
    let variance = 2.0 * weighted.cost / (6000.0 - 14.0);
    assert!((variance.sqrt() / 0.1 - 1.0).abs() < 0.03, "{variance}");
    let same = fit(vec![2.0, 20.0]);
    for (a, b) in weighted.parameters.iter().zip(&same.parameters) {
        assert!((a / b - 1.0).abs() < 1e-6);
    }
}
