//! The example of the SLICOT routines AB09AD (balanced truncation) and AB09BD (singular perturbation approximation), 7
//! states, 2 inputs, 3 outputs, order 5, balancing-free: doc/AB09AD.html and examples/results/AB09AD.res, AB09BD.res of
//! SLICOT-Reference (BSD-3). Printed with four decimals; the basis is unique up to the signs of the states.

use super::*;
use crate::lti::Continuous;
use faer::MatRef;

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

#[test]
fn slicot_examples_are_met_to_their_printed_digits() {
    for (method, printed) in
        [(ReductionMethod::BalancedTruncation, TRUNCATED), (ReductionMethod::SingularPerturbation, PERTURBED)]
    {
        let options = ReductionOptions { method, order: ReducedOrder::Fixed(5), ..Default::default() };
        let reduced = reduce_in_coordinates(&example(), &options).unwrap();
        for (found, exact) in reduced.hankel.iter().zip([2.5139, 2.0846, 1.9178, 0.7666, 0.5473, 0.0253, 0.0246]) {
            assert!((found - exact).abs() < 5.1e-5, "{found} {exact}");
        }
        assert!((reduced.error_bound - 2.0 * (0.0253 + 0.0246)).abs() < 2e-4);
        let error = distance(&reduced.model, &printed);
        assert!(error < 6e-5, "{method:?}: {error}");
    }
}
