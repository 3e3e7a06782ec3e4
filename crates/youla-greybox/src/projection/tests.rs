//! Exact responses, other structures, input that does not fit.

use super::*;
use crate::tests::{bearing, truth};
use crate::{Matrix, Slope, Stop, Structure};
use youla::lti::Continuous;

fn time() -> Discrete {
    Discrete::new(2e-4).unwrap()
}

fn bearing_target(count: usize) -> FrequencyTarget {
    let model = bearing().model(&truth()).unwrap().zoh(time()).unwrap();
    FrequencyTarget::of_model(&model, &logarithmic_grid([30.0, 14_000.0], count).unwrap()).unwrap()
}

fn error(found: &[f64], truth: &[f64]) -> f64 {
    found.iter().zip(truth).map(|(found, truth)| (found / truth - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn exact_response() {
    let truth = truth();
    let found = project(bearing(), &bearing_target(100), &[], &ProjectionOptions::default()).unwrap();
    assert!(error(&found.parameters, &truth) < 1e-8, "{:.1e}", error(&found.parameters, &truth));
    assert!(found.misfit < 1e-11 && found.entries.norm_max() < 1e-10, "{:.1e}", found.misfit);
    assert_eq!((found.origin, found.starts), (Origin::Linear, 25));
    assert!(matches!(found.stop, Stop::Exact | Stop::StepTooSmall), "{:?}", found.stop);
}

/// The weight of the linear least squares is that of the misfit and the aliases are taken out: with the true poles of the
/// actuators it is the solution itself.
#[test]
fn linear_least_squares_is_exact_at_the_true_poles() {
    let truth = truth();
    let target = bearing_target(60);
    let misfit = Misfit::new(bearing(), &target);
    let mut probe = vec![1.0; 14];
    probe[12..].copy_from_slice(&truth[12..]);
    let separation = Separation::of(bearing(), &probe, c64::new(0.0, 1000.0)).unwrap().unwrap();
    let found = separation.fit(&misfit, probe, 60, 1000.0).unwrap();
    assert!(error(&found.theta, &truth) < 1e-3, "{:.1e}", error(&found.theta, &truth));
    assert!(found.cost.sqrt() < 1e-4 * misfit.size, "{:.1e}", found.cost.sqrt() / misfit.size);
}

/// `x' = -rate^2 x + gain^3 u, y = x`: linear in neither.
struct Bent;

impl Structure for Bent {
    fn names(&self) -> Vec<String> {
        ["rate", "gain"].map(String::from).into()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        Ok(StateSpace::new(number(-t[0] * t[0]), number(t[1].powi(3)), number(1.0), Mat::zeros(1, 1), Continuous)?)
    }
    fn slopes(&self, t: &[f64], parameter: usize) -> Vec<Slope> {
        let slope = |matrix, value| Slope { matrix, row: 0, column: 0, value };
        match parameter {
            0 => vec![slope(Matrix::A, -2.0 * t[0])],
            _ => vec![slope(Matrix::B, 3.0 * t[1] * t[1])],
        }
    }
}

#[test]
fn a_structure_that_is_not_linear_starts_around_the_given_vector() {
    let time = Discrete::new(0.1).unwrap();
    let model = Bent.model(&[2.0, 3.0]).unwrap().zoh(time).unwrap();
    let target = FrequencyTarget::of_model(&model, &logarithmic_grid([0.1, 20.0], 30).unwrap()).unwrap();
    let found = project(&Bent, &target, &[vec![12.0, 0.5]], &ProjectionOptions::default()).unwrap();
    assert!(error(&found.parameters, &[2.0, 3.0]) < 1e-9, "{:?}", found.parameters);
}

#[test]
fn slopes_are_those_of_the_misfit() {
    let target = bearing_target(40);
    let misfit = Misfit::new(bearing(), &target);
    let theta: Vec<f64> = truth().iter().map(|v| 1.1 * v).collect();
    let cost = |j: usize, v: f64| {
        let mut moved = theta.clone();
        moved[j] = v;
        misfit.evaluate(&moved).unwrap().cost
    };
    let factor = misfit.linearise(&misfit.evaluate(&theta).unwrap()).unwrap();
    let (jacobian, residual) = factor.as_ref().split_at_col(14);
    assert!((residual.squared_norm_l2() / cost(0, theta[0]) - 1.0).abs() < 1e-10);
    let gradient = jacobian.transpose() * residual;
    for j in 0..14 {
        let h = 1e-4 * theta[j];
        let difference = (cost(j, theta[j] + h) - cost(j, theta[j] - h)) / (2.0 * h);
        let size = jacobian.col(j).norm_l2() * residual.norm_l2();
        assert!((difference + 2.0 * gradient[(j, 0)]).abs() < 1e-6 * size, "parameter {j}");
    }
}

#[test]
fn values_without_weight_do_not_count() {
    let target = bearing_target(60);
    let omega = target.omega().to_vec();
    let mut values: Vec<Mat<c64>> = (0..60).map(|k| target.value(k).to_owned()).collect();
    let mut weights = vec![Mat::from_fn(2, 2, |_, _| 1.0); 60];
    for k in [3, 20, 44] {
        values[k][(0, 1)] = c64::new(1e3, -1e3);
        weights[k][(0, 1)] = 0.0;
    }
    let target = FrequencyTarget::new(&omega, values, time()).unwrap().weighted(weights).unwrap();
    let found = project(bearing(), &target, &[], &ProjectionOptions::default()).unwrap();
    let truth = truth();
    assert!(error(&found.parameters, &truth) < 1e-8);
}

#[test]
fn input_that_does_not_fit_is_refused() {
    let value = |size: usize| Mat::from_fn(size, size, |_, _| c64::new(1.0, 0.0));
    let target = |omega: &[f64], values| FrequencyTarget::new(omega, values, time());
    assert!(matches!(target(&[0.0], vec![value(2)]), Err(Error::Method(youla::Error::OutOfRange { .. }))));
    assert!(matches!(target(&[1e5], vec![value(2)]), Err(Error::Method(youla::Error::OutOfRange { .. }))));
    assert!(matches!(target(&[], vec![]), Err(Error::Method(youla::Error::Ports { .. }))));
    assert!(matches!(target(&[1.0, 2.0], vec![value(2), value(1)]), Err(Error::Method(youla::Error::Shape { .. }))));
    assert!(matches!(
        target(&[1.0], vec![Mat::from_fn(2, 2, |_, _| c64::new(f64::NAN, 0.0))]),
        Err(Error::Method(youla::Error::NotFinite { .. }))
    ));
    let weight = |w: f64| target(&[1.0], vec![value(2)]).unwrap().weighted(vec![Mat::from_fn(2, 2, |_, _| w)]);
    assert!(matches!(weight(-1.0), Err(Error::Method(youla::Error::OutOfRange { .. }))));
    let ready = ProjectionOptions::default();
    let start = |theta: Vec<f64>| project(bearing(), &bearing_target(30), &[theta], &ready).unwrap_err();
    assert!(matches!(start(vec![1.0; 13]), Error::Method(youla::Error::Shape { .. })));
    assert!(matches!(start(vec![f64::NAN; 14]), Error::Method(youla::Error::NotFinite { .. })));
    let none = project(&Bent, &FrequencyTarget::new(&[1.0], vec![value(1)], time()).unwrap(), &[], &ready);
    assert!(matches!(none, Err(Error::NoStart)), "{none:?}");
    assert!(matches!(logarithmic_grid([2.0, 1.0], 5), Err(Error::Method(youla::Error::OutOfRange { .. }))));
}
