//! Identities on random and on hard problems, reference values, refusals.

use super::*;
use crate::linalg::{block_diagonal, eye, solve as linear_solve};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A problem that owns its data.
struct Owned {
    a: Mat<f64>,
    b: Mat<f64>,
    q: Mat<f64>,
    r: Mat<f64>,
    s: Mat<f64>,
}

impl Owned {
    fn random(n: usize, m: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut random = |rows, columns| Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(&mut rng));
        let (a, b) = (random(n, n), random(n, m));
        let root: Mat<f64> = random(n + m, n + m);
        let weight = &root * root.transpose() + 0.1 * eye(n + m);
        Owned {
            a,
            b,
            q: weight.submatrix(0, 0, n, n).to_owned(),
            r: weight.submatrix(n, n, m, m).to_owned(),
            s: weight.submatrix(0, n, n, m).to_owned(),
        }
    }

    fn without_cross_term(a: Mat<f64>, b: Mat<f64>, q: Mat<f64>, r: Mat<f64>) -> Self {
        let s = Mat::zeros(a.nrows(), b.ncols());
        Owned { a, b, q, r, s }
    }

    /// The same problem for the states `z` with `x = diag(scale) z`.
    fn rescaled(&self, scale: &[f64]) -> Self {
        let n = scale.len();
        Owned {
            a: Mat::from_fn(n, n, |i, j| self.a[(i, j)] * scale[j] / scale[i]),
            b: Mat::from_fn(n, self.b.ncols(), |i, j| self.b[(i, j)] / scale[i]),
            q: Mat::from_fn(n, n, |i, j| self.q[(i, j)] * scale[j] * scale[i]),
            r: self.r.clone(),
            s: Mat::from_fn(n, self.b.ncols(), |i, j| self.s[(i, j)] * scale[i]),
        }
    }

    fn solve(&self, equation: Equation) -> Result<RiccatiSolution> {
        let Owned { a, b, q, r, s } = self;
        let (a, b, q, r) = (a.as_ref(), b.as_ref(), q.as_ref(), r.as_ref());
        solve("the test problem", equation, &RiccatiProblem { a, b, q, r, s: Some(s.as_ref()) })
    }

    /// Relative residual in the coordinates of the problem, and the gain against its definition.
    fn verify(&self, equation: Equation, tolerance: f64) -> RiccatiSolution {
        let solution = self.solve(equation).unwrap();
        let Owned { a, b, q, r, s } = self;
        let (x, k) = (&solution.x, &solution.gain);
        let (weight, cross, first, second) = match equation {
            Equation::Continuous => (r.clone(), x * b + s, a.transpose() * x, x * a),
            Equation::Discrete => {
                (r + b.transpose() * x * b, a.transpose() * x * b + s, a.transpose() * x * a, -x.clone())
            }
        };
        let expected_gain = linear_solve("R", weight.as_ref(), cross.transpose()).unwrap();
        assert!((&expected_gain - k).norm_l2() <= 1e-9 * k.norm_l2());
        let quadratic = &cross * expected_gain;
        let size = first.norm_l2() + second.norm_l2() + quadratic.norm_l2() + q.norm_l2();
        let residual = (&first + &second - &quadratic + q).norm_l2() / size;
        assert!(residual <= tolerance, "residual {residual} at n = {}", a.nrows());
        assert!(solution.relative_residual <= tolerance, "{}", solution.relative_residual);
        assert!(solution.closed_loop_poles.iter().all(|p| equation.instability(*p) < 0.0));
        let poles = crate::linalg::eigenvalues("A - B K", (a - b * k).as_ref()).unwrap();
        assert!(poles.iter().all(|p| equation.instability(*p) < 0.0));
        solution
    }
}

const BOTH: [Equation; 2] = [Equation::Continuous, Equation::Discrete];

/// Eigenvalues fill the unit disc, in continuous time shifted to the left until a few are unstable.
fn few_unstable_modes(equation: Equation, n: usize, m: usize, seed: usize) -> Owned {
    let mut problem = Owned::random(n, m, seed as u64);
    let shift = if equation == Equation::Continuous { 0.8 } else { 0.0 };
    problem.a = problem.a / faer::Scale((n as f64).sqrt()) - shift * eye(n);
    problem
}

fn random_orthogonal(n: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let m: Mat<f64> = Mat::from_fn(n, n, |_, _| StandardNormal.sample(&mut rng));
    m.qr().compute_thin_Q()
}

#[test]
fn random_problems() {
    for equation in BOTH {
        for n in 2..=40 {
            for m in [1, 2, 4] {
                few_unstable_modes(equation, n, m, 10 * n + m).verify(equation, 1e-12);
            }
        }
    }
}

#[test]
fn many_unstable_modes() {
    for equation in BOTH {
        for n in 2..=16 {
            Owned::random(n, 4, n as u64).verify(equation, 1e-11);
        }
    }
}

#[test]
fn scaling_over_six_decades() {
    for equation in BOTH {
        for n in [4, 9, 20] {
            let plain = few_unstable_modes(equation, n, 2, n);
            let scale: Vec<f64> = (0..n).map(|k| 10f64.powf(6.0 * ((7 * k) % n) as f64 / n as f64 - 3.0)).collect();
            let expected = plain.verify(equation, 1e-12);
            let found = plain.rescaled(&scale).verify(equation, 1e-10);
            for i in 0..2 {
                for j in 0..n {
                    let error = found.gain[(i, j)] / scale[j] - expected.gain[(i, j)];
                    assert!(error.abs() < 1e-8 * expected.gain.norm_max(), "{equation:?} n = {n}: {error}");
                }
            }
        }
    }
}

/// An unstable mode with a reach r in coordinates in which no axis shows it: the gain agrees with that of the same problem in
/// coordinates in which nothing is small, to the r-th part of what the data determine.
#[test]
fn modes_almost_out_of_reach() {
    let n = 6;
    for (equation, mode) in BOTH.into_iter().zip([0.5, 1.5]) {
        for reach in [1e-3, 1e-4, 1e-5, 1e-6] {
            let mut plain = few_unstable_modes(equation, n, 2, 7);
            (0..n).for_each(|j| plain.a[(0, j)] = if j == 0 { mode } else { 0.0 });
            (0..2).for_each(|j| plain.b[(0, j)] *= reach);
            let mut scale = vec![1.0; n];
            scale[0] = reach;
            let expected = plain.rescaled(&scale).verify(equation, 1e-10).gain;
            let u = random_orthogonal(n);
            let Owned { a, b, q, r, s } = &plain;
            let hidden =
                Owned { a: &u * a * u.transpose(), b: &u * b, q: &u * q * u.transpose(), r: r.clone(), s: &u * s };
            let found = hidden.solve(equation).unwrap();
            let gain = Mat::from_fn(2, n, |i, j| (&found.gain * &u)[(i, j)] * scale[j]);
            let error = (&gain - &expected).norm_l2() / expected.norm_l2();
            assert!(error < 1e-14 / reach, "{equation:?} reach {reach}: {error}");
            assert!(found.relative_residual < 1e-12, "{equation:?} reach {reach}: {}", found.relative_residual);
        }
    }
}

#[test]
fn light_damping_keeps_its_digits() {
    let pair = |radius: f64, angle: f64| {
        let (re, im) = (radius * angle.cos(), radius * angle.sin());
        Mat::from_fn(2, 2, |i, j| [[re, im], [-im, re]][i][j])
    };
    let a = block_diagonal(pair(0.999, 0.26).as_ref(), pair(0.9995, 3.1).as_ref());
    let b = Mat::from_fn(4, 1, |i, _| 1e-3 * (i + 1) as f64);
    Owned::without_cross_term(a, b, 1e-3 * eye(4), eye(1)).verify(Equation::Discrete, 1e-13);
    let a = block_diagonal(
        Mat::from_fn(2, 2, |i, j| [[-1.3, 1.3e3], [-1.3e3, -1.3]][i][j]).as_ref(),
        Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [-1.7e6, -2.0]][i][j]).as_ref(),
    );
    let b = Mat::from_fn(4, 1, |i, _| [0.0, 1.0, 0.0, -6e6][i]);
    Owned::without_cross_term(a, b, eye(4), eye(1)).verify(Equation::Continuous, 1e-12);
}

#[test]
fn without_state_weight_unstable_poles_are_reflected() {
    let a = Mat::from_fn(3, 3, |i, j| [[1.25, 0.3, 0.1], [0.0, 0.5, 1.0], [0.0, 0.0, -2.0]][i][j]);
    let problem = Owned::without_cross_term(a, Mat::full(3, 1, 1.0), Mat::zeros(3, 3), eye(1));
    for (equation, expected) in [(Equation::Continuous, [-2.0, -1.25, -0.5]), (Equation::Discrete, [-0.5, 0.5, 0.8])] {
        let mut poles: Vec<f64> = problem.verify(equation, 1e-13).closed_loop_poles.iter().map(|p| p.re).collect();
        poles.sort_by(f64::total_cmp);
        for (pole, expected) in poles.iter().zip(expected) {
            assert!((pole - expected).abs() < 1e-12, "{pole}");
        }
    }
}

#[test]
fn nilpotent_plants_are_solved() {
    // Two delays: A is singular, X is known: x1 is weighted now, x2 by what x1 becomes.
    let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [0.0, 0.0]][i][j]);
    let b = Mat::from_fn(2, 1, |i, _| i as f64);
    let solution = Owned::without_cross_term(a, b, eye(2), eye(1)).verify(Equation::Discrete, 1e-15);
    let expected = Mat::from_fn(2, 2, |i, j| [[1.0, 0.0], [0.0, 2.0]][i][j]);
    assert!((solution.x - expected).norm_max() < 1e-15);
}

/// SciPy 1.17.1, `solve_continuous_are(A, B, Q, R, s=S)` and `solve_discrete_are(...)`, printed to 17 digits.
#[test]
fn reference_values() {
    let rows = |values: [[f64; 3]; 3]| Mat::from_fn(3, 3, |i, j| values[i][j]);
    let b = Mat::from_fn(3, 2, |i, j| [[0.0, 1.0], [1.0, 0.0], [0.5, -0.5]][i][j]);
    let q = rows([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]);
    let r = Mat::from_fn(2, 2, |i, j| [[1.0, 0.2], [0.2, 0.5]][i][j]);
    let s = Mat::from_fn(3, 2, |i, j| [[0.1, 0.0], [0.0, 0.2], [-0.1, 0.1]][i][j]);
    let cases = [
        (
            Equation::Continuous,
            rows([[0.0, 1.0, 0.0], [2.0, -1.0, 0.5], [0.3, 0.0, -0.2]]),
            rows([
                [2.189931922536296, 0.7415252753053273, 1.2297258846770087],
                [0.7415252753053273, 0.5781607281337916, 0.4350763936070644],
                [1.2297258846770087, 0.4350763936070644, 2.4207882133500025],
            ]),
        ),
        (
            Equation::Discrete,
            rows([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.2, 0.4]]),
            rows([
                [1.9989840381387802, -0.02099696872339418, -0.08721104934795873],
                [-0.02099696872339418, 8.199267153312467, -0.20651177398241205],
                [-0.08721104934795873, -0.20651177398241205, 4.076262395502511],
            ]),
        ),
    ];
    for (equation, a, expected) in cases {
        let problem = Owned { a, b: b.clone(), q: q.clone(), r: r.clone(), s: s.clone() };
        let solution = problem.verify(equation, 1e-14);
        assert!((solution.x - expected).norm_max() < 1e-12);
    }
}

#[test]
fn modes_in_the_way_are_named() {
    for (equation, boundary, unstable) in [(Equation::Continuous, 0.0, 2.0), (Equation::Discrete, 1.0, 1.5)] {
        let problem = |pole, reach, weight| {
            let a = Mat::from_fn(2, 2, |i, j| [[pole, 0.0], [0.0, -0.3]][i][j]);
            let b = Mat::from_fn(2, 1, |i, _| [reach, 1.0][i]);
            let q = Mat::from_fn(2, 2, |i, j| [[weight, 0.0], [0.0, 1.0]][i][j]);
            Owned::without_cross_term(a, b, q, eye(1)).solve(equation)
        };
        for pole in [boundary, unstable] {
            assert!(
                matches!(problem(pole, 0.0, 1.0), Err(Error::NotStabilisable { pole: p, .. }) if (p.re - pole).abs() < 1e-12)
            );
        }
        assert!(matches!(problem(boundary, 1.0, 0.0), Err(Error::NotDetectable { pole: p, .. }) if p.re == boundary));
        assert!(problem(unstable, 1.0, 0.0).is_ok());
    }
}

#[test]
fn hidden_modes_are_found_in_any_coordinates() {
    for equation in BOTH {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let t: Mat<f64> = Mat::from_fn(5, 5, |_, _| StandardNormal.sample(&mut rng));
        let boundary = if equation == Equation::Continuous { 0.0 } else { 1.0 };
        let a = Mat::from_fn(5, 5, |i, j| if i == j { [boundary, -0.2, -0.4, -0.6, -0.8][i] } else { 0.0 });
        let seen = Mat::from_fn(5, 1, |i, _| f64::from(u8::from(i > 0)));
        let a = linear_solve("T", t.as_ref(), (a * &t).as_ref()).unwrap();
        let b = linear_solve("T", t.as_ref(), seen.as_ref()).unwrap();
        let weight = t.transpose() * &seen;
        let out_of_reach = Owned::without_cross_term(a.clone(), b, eye(5), eye(1)).solve(equation);
        assert!(matches!(out_of_reach, Err(Error::NotStabilisable { .. })), "{out_of_reach:?}");
        let b = linear_solve("T", t.as_ref(), Mat::full(5, 1, 1.0).as_ref()).unwrap();
        let out_of_sight = Owned::without_cross_term(a, b, &weight * weight.transpose(), eye(1)).solve(equation);
        assert!(matches!(out_of_sight, Err(Error::NotDetectable { .. })), "{out_of_sight:?}");
    }
}

#[test]
fn weights_that_are_no_weights_are_refused() {
    let problem = |q: [[f64; 2]; 2], r: [[f64; 2]; 2]| {
        let (q, r) = (Mat::from_fn(2, 2, |i, j| q[i][j]), Mat::from_fn(2, 2, |i, j| r[i][j]));
        Owned::without_cross_term(0.5 * eye(2), eye(2), q, r).solve(Equation::Discrete)
    };
    let one = [[1.0, 0.0], [0.0, 1.0]];
    assert!(problem(one, one).is_ok());
    assert!(problem(one, [[1e-12, 0.0], [0.0, 1e6]]).is_ok());
    assert!(matches!(problem([[1.0, 0.5], [0.4, 1.0]], one), Err(Error::NotSymmetric { row: 1, column: 2, .. })));
    for r in [
        [[1.0, 0.0], [0.0, 0.0]],
        [[1.0, 1.0], [1.0, 1.0 + 1e-15]],
        [[1.0, 2.0], [2.0, 1.0]],
        [[-1.0, 0.0], [0.0, 1.0]],
    ] {
        assert!(matches!(problem(one, r), Err(Error::NotPositive { .. })));
    }
    assert!(matches!(problem([[f64::NAN, 0.0], [0.0, 1.0]], one), Err(Error::NotFinite { .. })));
    let wrong = Owned::without_cross_term(eye(2), eye(3), eye(2), eye(3)).solve(Equation::Discrete);
    assert!(matches!(wrong, Err(Error::Shape { expected: (2, 3), found: (3, 3), .. })));
}

#[test]
fn empty_problems_have_empty_solutions() {
    for equation in BOTH {
        let none = Owned::without_cross_term(Mat::zeros(0, 0), Mat::zeros(0, 2), Mat::zeros(0, 0), eye(2));
        assert_eq!(none.solve(equation).unwrap().gain.nrows(), 2);
        let free = Owned::without_cross_term(-0.5 * eye(1), Mat::zeros(1, 0), eye(1), Mat::zeros(0, 0));
        assert!(free.solve(equation).unwrap().x[(0, 0)] > 0.0);
    }
}
