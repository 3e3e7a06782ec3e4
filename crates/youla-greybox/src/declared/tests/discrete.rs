//! Structures of discrete time: `x(k+1) = A x(k) + B u(k)` with declared entries.

use super::super::{Declaration, DeclaredStructure};
use crate::Error;
use crate::search::criterion::Criterion;
use crate::tests::{comparison, gradient_error};
use crate::{
    FrequencyTarget, GreyBoxOptions, InnovationStart, NoiseModel, Problem, ProjectionOptions, Structure, greybox,
    logarithmic_grid, project,
};
use youla::Mat;
use youla::identify::subspace::{Experiment, InitialState};
use youla::lti::{Discrete, simulate};

const TEXT: &str = r#"
    sample_time = 1e-3
    a = [["2 * radius * cos(angle)", "-radius^2"], [1, 0]]
    b = [[1], [0]]
    c = [["b1", "b2"]]
    [parameters]
    radius = { initial = 0.9, min = 0.0, max = 1.0 }
    angle = { initial = 0.3 }
    b1 = { initial = 0.5 }
    b2 = { initial = 0.1 }
"#;
const TRUTH: [f64; 4] = [0.93, 0.33, 0.4, 0.16];

fn structure() -> DeclaredStructure {
    DeclaredStructure::new(&Declaration::parse(TEXT).unwrap()).unwrap()
}

fn time() -> Discrete {
    Discrete::new(1e-3).unwrap()
}

fn record() -> [Mat<f64>; 2] {
    let u = Mat::from_fn(400, 1, |k, _| ((k * k) as f64 * 0.37).sin());
    let y = simulate(&structure().sampled(&TRUTH, time()).unwrap(), u.as_ref(), &[0.0; 2]).unwrap();
    [u, y]
}

#[test]
fn exact_records_give_the_parameters_back() {
    let ([u, y], structure) = (record(), structure());
    let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
    let found = greybox(&Problem::new(&structure, &experiment, time()), &structure.start(), &GreyBoxOptions::default())
        .unwrap();
    assert!(found.parameters.iter().zip(TRUTH).all(|(p, t)| (p / t - 1.0).abs() < 1e-8), "{:?}", found.parameters);
    assert!(found.continuous.is_none() && found.model.time() == time());
}

#[test]
fn gradients_are_those_of_the_criterion() {
    let ([u, _], structure) = (record(), structure());
    let y = Mat::from_fn(400, 1, |k, _| (k as f64 * 0.21).cos());
    let innovation = NoiseModel::Innovation(InnovationStart { gain: vec![vec![0.2], vec![-0.1]] });
    for noise in [NoiseModel::OutputError, innovation] {
        for initial in [InitialState::Estimated, InitialState::SteadyState] {
            let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
            let compared = comparison(&noise, initial, &[]);
            let criterion = Criterion::new(&structure, &TRUTH, &experiment, time(), compared).unwrap();
            let error = gradient_error(&criterion.start(&TRUTH), &criterion, 2e-4);
            assert!(error < 1e-7, "{noise:?}, {initial:?}: {error:.1e}");
        }
    }
}

#[test]
fn responses_are_projected_from_a_start() {
    let structure = structure();
    let model = structure.sampled(&TRUTH, time()).unwrap();
    let target = FrequencyTarget::of_model(&model, &logarithmic_grid([10.0, 3000.0], 60).unwrap()).unwrap();
    let options = ProjectionOptions::default();
    let found = project(&structure, &target, &[structure.start()], &options).unwrap();
    assert!(found.parameters.iter().zip(TRUTH).all(|(p, t)| (p / t - 1.0).abs() < 1e-8), "{:?}", found.parameters);
    assert!(matches!(project(&structure, &target, &[], &options), Err(Error::NoStart)));
}

#[test]
fn another_sample_time_is_refused_with_both() {
    let ([u, y], structure) = (record(), structure());
    let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
    let other = Discrete::new(2e-3).unwrap();
    let refused =
        greybox(&Problem::new(&structure, &experiment, other), &structure.start(), &GreyBoxOptions::default())
            .unwrap_err();
    assert!(
        matches!(refused, Error::Method(youla::Error::SampleTimeMismatch { left: 1e-3, right: 2e-3, .. })),
        "{refused}"
    );
    let refused = structure.model(&TRUTH).unwrap_err();
    assert!(matches!(refused, Error::DiscreteStructure { ts: 1e-3 }), "{refused}");
    let declared = |text: &str| DeclaredStructure::new(&Declaration::parse(text).unwrap());
    let template = declared("template = 'mass-spring-damper'\nsample_time = 1e-3").unwrap_err();
    assert!(matches!(template, Error::Method(youla::Error::OutOfRange { .. })), "{template}");
    let negative = declared(&TEXT.replace("1e-3", "-1.0")).unwrap_err();
    assert!(matches!(negative, Error::Method(youla::Error::OutOfRange { value: -1.0, .. })), "{negative}");
}
