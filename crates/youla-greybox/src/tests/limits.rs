//! Starts that are bad, structures that are not identifiable, input that does not fit.

use super::{bearing, open_loop, time, truth};
use crate::{Error, Result};
use crate::{GreyBoxOptions, Matrix, Problem, Slope, Stop, Structure, greybox};
use faer::Mat;
use youla::identify::subspace::{Experiment, InitialState};
use youla::linalg::eye;
use youla::lti::{Continuous, StateSpace};

fn from_rest() -> GreyBoxOptions {
    GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() }
}

#[test]
fn an_unstable_start_names_its_pole() {
    let data = open_loop(4000, [0.0; 2], &[0.0; 6], 1);
    let mut start = truth();
    start[0] = 4000.0;
    match greybox(&Problem::new(bearing(), &[data.experiment()], time()), &start, &from_rest()) {
        Err(Error::Method(youla::Error::Diverged { pole: Some(pole), .. })) => assert!(pole.norm() > 1.0),
        other => panic!("{other:?}"),
    }
}

/// `x' = -x + u, y = first * second * x`: only the product shows.
struct Product;

impl Structure for Product {
    fn names(&self) -> Vec<String> {
        ["first", "second"].map(String::from).into()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        Ok(StateSpace::new(-eye(1), eye(1), eye(1) * faer::Scale(t[0] * t[1]), Mat::zeros(1, 1), Continuous)?)
    }
    fn slopes(&self, t: &[f64], parameter: usize) -> Vec<Slope> {
        vec![Slope { matrix: Matrix::C, row: 0, column: 0, value: t[1 - parameter] }]
    }
}

#[test]
fn parameters_that_cannot_be_told_apart_have_no_covariance() {
    let u = Mat::from_fn(200, 1, |k, _| ((k * k) as f64 * 0.37).sin());
    let time = youla::lti::Discrete::new(0.2).unwrap();
    let y = youla::lti::simulate(&Product.model(&[2.0, 3.0]).unwrap().zoh(time).unwrap(), u.as_ref(), &[0.0]).unwrap();
    let experiment = Experiment::new(u.as_ref(), y.as_ref());
    let found = greybox(&Problem::new(&Product, &[experiment], time), &[1.0, 1.0], &GreyBoxOptions::default()).unwrap();
    assert!((found.parameters[0] * found.parameters[1] - 6.0).abs() < 1e-9, "{:?}", found.parameters);
    assert_eq!((found.rank, found.covariance.is_none(), found.stop), (1, true, Stop::Exact));
    let parts: Vec<&str> = found.undetermined.combinations[0].parts.iter().map(|p| p.parameter.as_str()).collect();
    assert_eq!(parts, ["first", "second"]);
}

/// The product with bounds that may be bad.
struct Bounded(Vec<(f64, f64)>);

impl Structure for Bounded {
    fn names(&self) -> Vec<String> {
        Product.names()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        Product.model(t)
    }
    fn slopes(&self, t: &[f64], parameter: usize) -> Vec<Slope> {
        Product.slopes(t, parameter)
    }
    fn bounds(&self) -> Vec<(f64, f64)> {
        self.0.clone()
    }
}

#[test]
fn bounds_that_do_not_fit_are_refused() {
    let u = Mat::from_fn(200, 1, |k, _| ((k * k) as f64 * 0.37).sin());
    let experiment = Experiment::new(u.as_ref(), u.as_ref());
    let time = youla::lti::Discrete::new(0.2).unwrap();
    let refused = |bounds: &[(f64, f64)]| {
        let structure = Bounded(bounds.to_vec());
        greybox(&Problem::new(&structure, &[experiment], time), &[1.0, 1.0], &GreyBoxOptions::default()).unwrap_err()
    };
    assert!(matches!(refused(&[(0.0, 2.0)]), Error::Method(youla::Error::Ports { expected: 2, found: 1, .. })));
    assert!(matches!(refused(&[(0.0, 2.0), (3.0, 2.0)]), Error::EmptyBounds { .. }));
    assert!(matches!(refused(&[(0.0, 2.0), (f64::NAN, 2.0)]), Error::EmptyBounds { .. }));
    assert!(matches!(refused(&[(0.0, 2.0), (2.0, 3.0)]), Error::OutsideBounds { value: 1.0, .. }));
}

#[test]
fn the_limit_of_iterations_is_an_outcome() {
    let data = open_loop(500, [0.3; 2], &[0.0; 6], 2);
    let start: Vec<f64> = truth().iter().map(|v| 0.8 * v).collect();
    let options = GreyBoxOptions { max_iterations: 2, ..from_rest() };
    let found = greybox(&Problem::new(bearing(), &[data.experiment()], time()), &start, &options).unwrap();
    assert_eq!((found.stop, found.iterations), (Stop::Iterations, 2));
}

#[test]
fn input_that_does_not_fit_is_refused() {
    let data = open_loop(300, [0.3; 2], &[0.0; 6], 2);
    let experiments = [data.experiment()];
    let refused = |start: &[f64], experiments: &[Experiment<'_>], options: &GreyBoxOptions| {
        greybox(&Problem::new(bearing(), experiments, time()), start, options).unwrap_err()
    };
    let ready = GreyBoxOptions::default;
    assert!(matches!(
        refused(&truth()[1..], &experiments, &ready()),
        Error::Method(youla::Error::Shape { found: (13, 1), .. })
    ));
    let mut start = truth();
    start[4] = f64::NAN;
    assert!(matches!(refused(&start, &experiments, &ready()), Error::Method(youla::Error::NotFinite { row: 5, .. })));
    assert!(matches!(
        refused(&truth(), &[], &ready()),
        Error::Method(youla::Error::TooFewSamples { found: 0, needed: 15, .. })
    ));
    let short = Experiment::new(data.u.as_ref().subrows(0, 10), data.y.as_ref().subrows(0, 10));
    assert!(matches!(
        refused(&truth(), &[short], &ready()),
        Error::Method(youla::Error::TooFewSamples { found: 20, needed: 21, .. })
    ));
    let narrow = Experiment::new(data.u.as_ref().subcols(0, 1), data.y.as_ref());
    assert!(matches!(
        refused(&truth(), &[narrow], &ready()),
        Error::Method(youla::Error::Shape { expected: (300, 2), .. })
    ));
    let deviations = |output_deviations: Vec<f64>| GreyBoxOptions { output_deviations, ..ready() };
    assert!(matches!(
        refused(&truth(), &experiments, &deviations(vec![1.0])),
        Error::Method(youla::Error::Ports { expected: 2, .. })
    ));
    assert!(matches!(
        refused(&truth(), &experiments, &deviations(vec![1.0, 0.0])),
        Error::Method(youla::Error::OutOfRange { .. })
    ));
    let undamped = GreyBoxOptions { damping: 0.0, ..ready() };
    assert!(matches!(refused(&truth(), &experiments, &undamped), Error::Method(youla::Error::OutOfRange { .. })));
}
