//! The bearing in open loop.

use super::*;
use crate::Error;
use crate::Problem;
use crate::tests::{bearing, truth};
use crate::{DeclaredStructure, Structure, Template};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::Mat;
use youla::identify::subspace::{Experiment, InitialState, Order};
use youla::lti::{Discrete, simulate};
use youla::signal::{Excitation, SquareWaves};

fn options() -> SubspacePemOptions {
    let mut options = SubspacePemOptions::default();
    options.subspace.order = Order::Fixed(6);
    (options.subspace.initial_state, options.pem.initial_state) = (InitialState::Zero, InitialState::Zero);
    options
}

/// Square waves and what the bearing makes of them, with white noise of `noise` um.
fn log(noise: f64, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let (rng, time) = (&mut ChaCha8Rng::seed_from_u64(seed), Discrete::new(2e-4).unwrap());
    let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 20 };
    let u = Excitation::SquareWaves(waves).generate(3000, 2, time, rng).unwrap();
    let plant = bearing().model(&truth()).unwrap().zoh(time).unwrap();
    let y = simulate(&plant, u.as_ref(), &[0.0; 6]).unwrap();
    let n = Mat::from_fn(3000, 2, |_, _| noise * rng.sample::<f64, _>(StandardNormal));
    (u, y + n)
}

#[test]
fn a_record_without_noise_gives_the_parameters_without_a_start() {
    let (u, y) = log(0.0, 1);
    let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
    let found =
        subspace_pem(&Problem::new(bearing(), &experiments, Discrete::new(2e-4).unwrap()), None, &options()).unwrap();
    let truth = truth();
    for (found, truth) in found.model.parameters.iter().zip(&truth) {
        assert!((found / truth - 1.0).abs() < 1e-6, "{found} for {truth}");
    }
    // The projection alone is exact too, and the nominal start was not there.
    assert!(found.projections[0].misfit < 1e-6, "{}", found.projections[0].misfit);
    assert_eq!((found.won, found.runs.len(), found.local_minimum_suspected()), (PemStart::Projection, 1, false));
}

#[test]
fn noise_leaves_the_maximum_likelihood_estimate() {
    let (u, y) = log(0.5, 2);
    let (time, experiments) = (Discrete::new(2e-4).unwrap(), [Experiment::new(u.as_ref(), y.as_ref())]);
    let truth = truth();
    let nominal: Vec<f64> = truth.iter().map(|v| 0.1 * v).collect();
    let found = subspace_pem(&Problem::new(bearing(), &experiments, time), Some(&nominal), &options()).unwrap();
    let oracle = crate::greybox(&Problem::new(bearing(), &experiments, time), &truth, &options().pem).unwrap();
    assert!((found.model.cost / oracle.cost - 1.0).abs() < 1e-6, "{} {}", found.model.cost, oracle.cost);
    assert_eq!((found.won, found.runs.len()), (PemStart::Projection, 2));
    assert!(found.runs[0].cost_at_start < 0.1 * found.runs[1].cost_at_start, "{:?}", found.runs);
}

#[test]
fn a_record_that_is_too_short_is_refused() {
    let (u, y) = log(0.0, 1);
    let experiments = [Experiment::new(u.as_ref().subrows(0, 60), y.as_ref().subrows(0, 60))];
    let mut few = options();
    few.subspace.horizon = 5.into();
    let refused = subspace_pem(&Problem::new(bearing(), &experiments, Discrete::new(2e-4).unwrap()), None, &few);
    assert!(
        matches!(refused, Err(Error::Method(youla::Error::TooFewSamples { found: 60, needed: 64, .. }))),
        "{refused:?}"
    );
}

/// The projection knows no bounds: where it lies beyond one, the search starts at the bound and ends there.
#[test]
fn a_projection_beyond_a_bound_starts_at_the_bound() {
    let (u, y) = log(0.0, 3);
    let mut declared = Template::Bearing.declaration().unwrap();
    // The true value is -224.9.
    declared.parameters.get_mut("damping_hh").unwrap().min = Some(-200.0);
    declared.parameters.get_mut("damping_hh").unwrap().initial = Some(-100.0);
    let structure = DeclaredStructure::new(&declared).unwrap();
    let (time, experiments) = (Discrete::new(2e-4).unwrap(), [Experiment::new(u.as_ref(), y.as_ref())]);
    let found = subspace_pem(&Problem::new(&structure, &experiments, time), None, &options()).unwrap();
    assert!((found.projections[0].parameters[0] / -224.9 - 1.0).abs() < 1e-6, "{:?}", found.projections[0].parameters);
    assert_eq!((found.model.parameters[0], found.model.at_bounds.len()), (-200.0, 1));
}

/// The bearing with its first input three samples late: the projection takes the known delay off.
#[test]
fn a_known_delay_is_not_projected_on_the_structure() {
    let (u, y) = log(0.0, 4);
    let late = 3;
    let rows = u.nrows() - late;
    let early = Mat::from_fn(rows, 2, |k, j| u[(if j == 0 { k + late } else { k }, j)]);
    let mut options = options();
    (options.subspace.delays, options.pem.delays) = (vec![late, 0], vec![late, 0]);
    (options.subspace.initial_state, options.pem.initial_state) = (InitialState::Estimated, InitialState::Estimated);
    let experiments = [Experiment::new(early.as_ref(), y.subrows(0, rows))];
    let found =
        subspace_pem(&Problem::new(bearing(), &experiments, Discrete::new(2e-4).unwrap()), None, &options).unwrap();
    let truth = truth();
    for (projected, truth) in found.projections[0].parameters.iter().zip(&truth) {
        assert!((projected / truth - 1.0).abs() < 1e-5, "{projected} for {truth}");
    }
}
