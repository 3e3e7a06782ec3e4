//! The examples of SLICOT-Reference (BSD-3), printed with four decimals.
//!
//! AB09AD (balanced truncation) and AB09BD (singular perturbation approximation): 7 states, 2 inputs, 3 outputs, order 5,
//! balancing-free; doc/AB09AD.html and examples/results/AB09AD.res, AB09BD.res. AB09MD and AB09ND: the same with the poles at or
//! beyond the real part -0.6 kept; examples/results/AB09MD.res, doc/AB09ND.html. AB09ID: an unstable system of 3 states with a
//! weight at its output; doc/AB09ID.html. The bases are unique up to the signs of the states.

use super::options::Scales;
use super::tests::reduce_weighted;
use super::*;
use crate::linalg::{RiccatiProblem, care, eye};
use crate::lti::Continuous;
use crate::{Mat, MatRef};

fn example() -> StateSpace<Continuous> {
    let a = [
        [-0.04165, 0.0, 4.92, -4.92, 0.0, 0.0, 0.0],
        [-5.21, -12.5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 3.33, -3.33, 0.0, 0.0, 0.0, 0.0],
        [0.545, 0.0, 0.0, 0.0, -0.545, 0.0, 0.0],
        [0.0, 0.0, 0.0, 4.92, -0.04165, 0.0, 4.92],
        [0.0, 0.0, 0.0, 0.0, -5.21, -12.5, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 3.33, -3.33],
    ];
    let b = Mat::from_fn(7, 2, |i, j| if i == [1, 5][j] { 12.5 } else { 0.0 });
    let c = Mat::from_fn(3, 7, |i, j| if j == [0, 3, 4][i] { 1.0 } else { 0.0 });
    StateSpace::new(Mat::from_fn(7, 7, |i, j| a[i][j]), b, c, Mat::zeros(3, 2), Continuous).unwrap()
}

/// Rows of `[A B; C D]`.
type Printed = [[f64; 7]; 8];

const TRUNCATED: Printed = [
    [1.3451, 5.0399, 0.0, 0.0, 4.5315, -0.3857, 0.3857],
    [-4.0214, -3.6604, 0.0, 0.0, -0.9056, -3.1753, 3.1753],
    [0.0, 0.0, 0.5124, 1.7910, 0.0, -0.7447, -0.7447],
    [0.0, 0.0, -4.2167, -2.9900, 0.0, -3.6872, -3.6872],
    [1.2402, 1.6416, 0.0, 0.0, -0.0586, 1.8197, -1.8197],
    [-0.6704, 0.1828, -0.6582, 0.2222, -0.0104, 0.0, 0.0],
    [0.1089, 0.4867, 0.0, 0.0, 0.8651, 0.0, 0.0],
    [0.6704, -0.1828, -0.6582, 0.2222, 0.0104, 0.0, 0.0],
];

const PERTURBED: Printed = [
    [1.3960, 5.1248, 0.0, 0.0, 4.4331, -0.2901, 0.2901],
    [-4.1411, -3.8605, 0.0, 0.0, -0.6738, -3.4004, 3.4004],
    [0.0, 0.0, 0.5847, 1.9230, 0.0, -0.6379, -0.6379],
    [0.0, 0.0, -4.3823, -3.2922, 0.0, -3.9315, -3.9315],
    [1.3261, 1.7851, 0.0, 0.0, -0.2249, 1.9813, -1.9813],
    [-0.6570, 0.2053, -0.6416, 0.2526, -0.0364, 0.0498, -0.0007],
    [0.1094, 0.4875, 0.0, 0.0, 0.8641, 0.0010, -0.0010],
    [0.6570, -0.2053, -0.6416, 0.2526, 0.0364, -0.0007, 0.0498],
];

/// Largest difference to the printed entries for the best of the 32 choices of state signs.
fn distance(model: &StateSpace<Continuous>, printed: &Printed) -> f64 {
    let entry = |m: MatRef<'_, f64>, i: usize, j: usize| m[(i, j)];
    let sign = |choice: u32, k: usize| if k < 5 && choice >> k & 1 == 1 { -1.0 } else { 1.0 };
    let found = |i: usize, j: usize| match (i < 5, j < 5) {
        (true, true) => entry(model.a(), i, j),
        (true, false) => entry(model.b(), i, j - 5),
        (false, true) => entry(model.c(), i - 5, j),
        (false, false) => entry(model.d(), i - 5, j - 5),
    };
    let error = |choice| {
        let indices = (0..8).flat_map(|i| (0..7).map(move |j| (i, j)));
        indices
            .map(|(i, j)| (sign(choice, i) * sign(choice, j) * found(i, j) - printed[i][j]).abs())
            .fold(0.0, f64::max)
    };
    (0..32).map(error).fold(f64::INFINITY, f64::min)
}

/// The reduction in the given coordinates of the state, on which the printed bases depend.
fn in_coordinates(system: &StateSpace<Continuous>, options: &ReductionOptions) -> Result<Reduction<Continuous>> {
    let reducer = Reducer::in_coordinates(system.clone(), None, options, Scales::new(options, system)?)?;
    reducer.reduction(reducer.choose(options.order)?)
}

const SPLIT_TRUNCATED: Printed = [
    [-0.5181, -1.1084, 0.0, 0.0, 0.0, -1.2837, 1.2837],
    [8.8157, -0.5181, 0.0, 0.0, 0.0, -0.7522, 0.7522],
    [0.0, 0.0, 0.5124, 0.0, 1.7910, -0.7447, -0.7447],
    [0.0, 0.0, 0.0, -1.4460, 0.0, 1.9275, -1.9275],
    [0.0, 0.0, -4.2167, 0.0, -2.9900, -3.6872, -3.6872],
    [-0.1380, -0.6445, -0.6582, -0.5771, 0.2222, 0.0, 0.0],
    [0.6246, 0.0196, 0.0, 0.4131, 0.0, 0.0, 0.0],
    [0.1380, 0.6445, -0.6582, 0.5771, 0.2222, 0.0, 0.0],
];

const SPLIT_PERTURBED: Printed = [
    [-0.5181, -1.1084, 0.0, 0.0, 0.0, -1.2837, 1.2837],
    [8.8157, -0.5181, 0.0, 0.0, 0.0, -0.7522, 0.7522],
    [0.0, 0.0, 0.5847, 0.0, 1.9230, -0.6379, -0.6379],
    [0.0, 0.0, 0.0, -1.6606, 0.0, 2.0656, -2.0656],
    [0.0, 0.0, -4.3823, 0.0, -3.2922, -3.9315, -3.9315],
    [-0.1380, -0.6445, -0.6416, -0.6293, 0.2526, 0.0582, -0.0090],
    [0.6246, 0.0196, 0.0, 0.4107, 0.0, 0.0015, -0.0015],
    [0.1380, 0.6445, -0.6416, 0.6293, 0.2526, -0.0090, 0.0582],
];

/// The same with the first two states, the pair that is kept, exchanged: a standardised block has two forms.
fn exchanged(model: &StateSpace<Continuous>) -> StateSpace<Continuous> {
    let place = |k: usize| if k < 2 { 1 - k } else { k };
    let (a, b, c) = (model.a(), model.b(), model.c());
    StateSpace::new(
        Mat::from_fn(5, 5, |i, j| a[(place(i), place(j))]),
        Mat::from_fn(5, 2, |i, j| b[(place(i), j)]),
        Mat::from_fn(3, 5, |i, j| c[(i, place(j))]),
        model.d().to_owned(),
        model.time(),
    )
    .unwrap()
}

#[test]
fn slicot_examples_with_poles_kept_apart_are_met_to_their_printed_digits() {
    for (method, printed) in [
        (ReductionMethod::BalancedTruncation, SPLIT_TRUNCATED),
        (ReductionMethod::SingularPerturbation, SPLIT_PERTURBED),
    ] {
        let options = ReductionOptions {
            method,
            order: ReducedOrder::Fixed(5),
            stability_boundary: Some(-0.6),
            ..Default::default()
        };
        let reduced = in_coordinates(&example(), &options).unwrap();
        assert_eq!((reduced.kept.len(), reduced.hankel.len()), (2, 5));
        for (found, exact) in reduced.hankel.iter().zip([1.9178, 0.8621, 0.7666, 0.0336, 0.0246]) {
            assert!((found - exact).abs() < 5.1e-5, "{found} {exact}");
        }
        let error = distance(&reduced.model, &printed).min(distance(&exchanged(&reduced.model), &printed));
        assert!(error < 6e-5, "{method:?}: {error}");
    }
}

/// The weight of AB09ID has unstable poles; its co-inner denominator drops out of the norm, so that the numerator weighs alike.
#[test]
fn the_weighted_slicot_example_is_met_to_its_printed_digits() {
    let rows = |rows: &[&[f64]]| Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]);
    let a = rows(&[&[-26.4, 6.4023, 4.3868], &[32.0, 0.0, 0.0], &[0.0, 8.0, 0.0]]);
    let (b, c) = (rows(&[&[16.0], &[0.0], &[0.0]]), rows(&[&[9.2994, 1.1624, 0.1090]]));
    let system = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous).unwrap();
    let weight = StateSpace::new(
        rows(&[
            &[-1.0, 0.0, 4.0, -9.2994, -1.1624, -0.1090],
            &[0.0, 2.0, 0.0, -9.2994, -1.1624, -0.1090],
            &[0.0, 0.0, -3.0, -9.2994, -1.1624, -0.1090],
            &[16.0, 16.0, 16.0, -26.4, 6.4023, 4.3868],
            &[0.0, 0.0, 0.0, 32.0, 0.0, 0.0],
            &[0.0, 0.0, 0.0, 0.0, 8.0, 0.0],
        ]),
        rows(&[&[1.0], &[1.0], &[1.0], &[0.0], &[0.0], &[0.0]]),
        rows(&[&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]]),
        Mat::zeros(1, 1),
        Continuous,
    )
    .unwrap();
    let (none, one) = (Mat::zeros(6, 6), eye(1));
    let (a, b) = (weight.a().transpose(), weight.c().transpose());
    let problem = RiccatiProblem { a, b, q: none.as_ref(), r: one.as_ref(), s: None };
    let gain = care("the co-inner denominator", &problem).unwrap().gain;
    let reflected = weight.a() - gain.transpose() * weight.c();
    let (b, c) = (weight.b().to_owned(), weight.c().to_owned());
    let output = StateSpace::new(reflected, b, c, Mat::zeros(1, 1), Continuous).unwrap();
    let weights = FrequencyWeights { output, input: StateSpace::gain(Mat::full(1, 1, 1.0), Continuous).unwrap() };
    let options =
        ReductionOptions { order: ReducedOrder::Fixed(2), stability_boundary: Some(0.0), ..Default::default() };
    let reduced = reduce_weighted(&system, &weights, &options).unwrap();
    for (found, exact) in reduced.hankel.iter().zip([3.8253, 0.2005]) {
        assert!((found - exact).abs() < 5.1e-5, "{found} {exact}");
    }
    let a = reduced.model.a();
    assert!((a[(0, 0)] - 9.19).abs() < 5.1e-5 && (a[(1, 1)] + 34.5297).abs() < 5.1e-5, "{a:?}");
    assert!(a[(0, 1)] == 0.0 && a[(1, 0)] == 0.0 && reduced.unstable_pole.is_none());
    let model = &reduced.model;
    let products = [0, 1].map(|k| model.c()[(0, k)] * model.b()[(k, 0)]);
    // Printed: 2.8955 x 11.9593 and 6.9152 x 16.9329, each factor to four decimals.
    for (found, (c, b)) in products.into_iter().zip([(2.8955, 11.9593), (6.9152, 16.9329)]) {
        assert!((found - c * b).abs() < 5.1e-5 * (c + b), "{found} {}", c * b);
    }
}

#[test]
fn slicot_examples_are_met_to_their_printed_digits() {
    for (method, printed) in
        [(ReductionMethod::BalancedTruncation, TRUNCATED), (ReductionMethod::SingularPerturbation, PERTURBED)]
    {
        let options = ReductionOptions { method, order: ReducedOrder::Fixed(5), ..Default::default() };
        let reduced = in_coordinates(&example(), &options).unwrap();
        for (found, exact) in reduced.hankel.iter().zip([2.5139, 2.0846, 1.9178, 0.7666, 0.5473, 0.0253, 0.0246]) {
            assert!((found - exact).abs() < 5.1e-5, "{found} {exact}");
        }
        assert!((reduced.error_bound.unwrap() - 2.0 * (0.0253 + 0.0246)).abs() < 2e-4);
        let error = distance(&reduced.model, &printed);
        assert!(error < 6e-5, "{method:?}: {error}");
    }
}

/// By python-control 0.10.2, `control.hankel_singular_values`.
#[test]
fn the_bearing_has_the_hankel_singular_value_of_python_control() {
    let plant = crate::fixtures::bearing();
    let sampled = plant.zoh(crate::lti::Discrete::new(2e-4).unwrap()).unwrap();
    let found = [hankel_singular_values(&plant).unwrap()[0], hankel_singular_values(&sampled).unwrap()[0]];
    for (found, cited) in found.into_iter().zip([6.6476030708026, 6.656568613252402]) {
        assert!((found / cited - 1.0).abs() < 1e-9, "{found}, cited {cited}");
    }
}
