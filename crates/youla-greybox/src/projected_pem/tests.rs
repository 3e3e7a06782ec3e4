//! The bearing in open loop, from the response of its own sampled model.

use super::*;
use crate::tests::{bearing, truth};
use crate::{DeclaredStructure, Structure, Template};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use youla::identify::subspace::Delays;
use youla::signal::{Excitation, SquareWaves};

fn time() -> Discrete {
    Discrete::new(2e-4).unwrap()
}

fn plant() -> StateSpace<Discrete> {
    bearing().model(&truth()).unwrap().zoh(time()).unwrap()
}

/// Square waves and what the bearing makes of them.
fn log(seed: u64) -> (Mat<f64>, Mat<f64>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 20 };
    let u = Excitation::SquareWaves(waves).generate(3000, 2, time(), rng).unwrap();
    let y = simulate(&plant(), u.as_ref(), &[0.0; 6]).unwrap();
    (u, y)
}

fn searches(problem: &Problem<'_>, pem: &GreyBoxOptions, model: &StateSpace<Discrete>) -> Searches {
    let target = plant_target(model, problem.experiments, [1024, 120], 10.0, pem).unwrap();
    let projection = ProjectionOptions::default();
    pem_from_targets(&target, None, &Task { problem, nominal: None, projection: &projection, pem }).unwrap()
}

/// The projection knows no bounds: where it lies beyond one, the search starts at the bound and ends there.
#[test]
fn a_projection_beyond_a_bound_starts_at_the_bound() {
    let (u, y) = log(3);
    let mut declared = Template::Bearing.declaration().unwrap();
    // The true value is -224.9.
    declared.parameters.get_mut("damping_hh").unwrap().min = Some(-200.0);
    declared.parameters.get_mut("damping_hh").unwrap().initial = Some(-100.0);
    let structure = DeclaredStructure::new(&declared).unwrap();
    let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
    let pem = GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() };
    let found = searches(&Problem::new(&structure, &experiments, time()), &pem, &plant());
    assert!((found.projections[0].parameters[0] / -224.9 - 1.0).abs() < 1e-6, "{:?}", found.projections[0].parameters);
    assert_eq!((found.model.parameters[0], found.model.at_bounds.len()), (-200.0, 1));
}

/// The bearing with its first input three samples late, whose model has three states more: the projection takes the known delay off.
#[test]
fn a_known_delay_is_not_projected_on_the_structure() {
    let (u, y) = log(4);
    let late = 3;
    let rows = u.nrows() - late;
    let early = Mat::from_fn(rows, 2, |k, j| u[(if j == 0 { k + late } else { k }, j)]);
    let pem = GreyBoxOptions { delays: vec![late, 0], initial_state: InitialState::Estimated, ..Default::default() };
    let experiments = [Experiment::new(early.as_ref(), y.subrows(0, rows))];
    let problem = Problem::new(bearing(), &experiments, time());
    let delayed = Delays::new(&pem.delays, 2).unwrap().put_before(plant()).unwrap();
    for (projected, truth) in searches(&problem, &pem, &delayed).projections[0].parameters.iter().zip(truth()) {
        assert!((projected / truth - 1.0).abs() < 1e-5, "{projected} for {truth}");
    }
}
