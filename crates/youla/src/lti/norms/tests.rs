use super::{PeakGain, PeakOptions, h2_norm, hinf_norm, linf_norm};
use crate::Error;
use crate::linalg::eye;
use crate::lti::largest_singular_value;
use crate::lti::{Continuous, Discrete, StateSpace, TimeDomain, frequency_response};
use faer::{Mat, Scale};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn matrix<const N: usize, const M: usize>(values: [[f64; M]; N]) -> Mat<f64> {
    Mat::from_fn(N, M, |i, j| values[i][j])
}

fn draw(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
}

fn peak<T: TimeDomain>(system: &StateSpace<T>) -> PeakGain {
    linf_norm(system, &PeakOptions::default()).unwrap()
}

fn gains<T: TimeDomain>(system: &StateSpace<T>, omega: &[f64]) -> Vec<f64> {
    frequency_response(system, omega).unwrap().iter().map(|g| largest_singular_value(g).unwrap()).collect()
}

/// `gain / (s - pole)` or `gain / (z - pole)`, plus `direct`.
fn section<T: TimeDomain>(pole: f64, gain: f64, direct: f64, time: T) -> StateSpace<T> {
    StateSpace::new(Scale(pole) * eye(1), eye(1), Scale(gain) * eye(1), Scale(direct) * eye(1), time).unwrap()
}

/// The largest gain over a grid, by golden section about its highest points.
fn by_search<T: TimeDomain>(system: &StateSpace<T>, grid: &[f64]) -> f64 {
    let values = gains(system, grid);
    let mut tops: Vec<usize> =
        (1..grid.len() - 1).filter(|k| values[*k] >= values[k - 1] && values[*k] >= values[k + 1]).collect();
    tops.sort_by(|i, j| values[*j].total_cmp(&values[*i]));
    let polished = tops.iter().take(4).map(|k| {
        let (mut low, mut high) = (grid[k - 1], grid[k + 1]);
        for _ in 0..60 {
            let (x, y) = (low + 0.382 * (high - low), high - 0.382 * (high - low));
            let value = gains(system, &[x, y]);
            if value[0] > value[1] { high = y } else { low = x }
        }
        gains(system, &[0.5 * (low + high)])[0]
    });
    polished.chain(values.iter().copied()).fold(0.0, f64::max)
}

#[test]
fn resonances_have_their_closed_form() {
    for natural in [1e-2, 1.0, 1351.0, 1e5] {
        for zeta in [0.5, 0.1, 1e-2, 1e-4, 1e-6] {
            let a = matrix([[0.0, 1.0], [-natural * natural, -2.0 * zeta * natural]]);
            let b = matrix([[0.0], [natural * natural]]);
            let system = StateSpace::new(a, b, matrix([[1.0, 0.0]]), Mat::zeros(1, 1), Continuous).unwrap();
            let PeakGain { value, upper, frequency, .. } = peak(&system);
            let exact = 0.5 / (zeta * (1.0 - zeta * zeta).sqrt());
            assert!((value / exact - 1.0).abs() < 1e-9, "{natural} {zeta}: {value} {exact}");
            assert!((upper / value - 1.0 - 1e-9).abs() < 1e-12);
            assert!((frequency / (natural * (1.0 - 2.0 * zeta * zeta).sqrt()) - 1.0).abs() < 1e-4);
        }
    }
}

/// Modes of |z| = 0.98 to 0.9999 in units that differ by six decades, against a grid about every mode.
#[test]
fn lightly_damped_discrete_modes_need_no_grid() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let time = Discrete::new(2e-4).unwrap();
    for modulus in [0.98, 0.99, 0.999, 0.9999] {
        for _ in 0..5 {
            let modes = 4;
            let angles: Vec<f64> = (0..modes).map(|_| rng.random_range(0.02..3.0)).collect();
            let a = Mat::from_fn(2 * modes, 2 * modes, |i, j| match (i / 2 == j / 2, i % 2, j % 2) {
                (false, ..) => 0.0,
                (true, 0, 0) | (true, 1, 1) => modulus * angles[i / 2].cos(),
                (true, 0, _) => modulus * angles[i / 2].sin(),
                (true, ..) => -modulus * angles[i / 2].sin(),
            });
            let system = StateSpace::new(a, draw(8, 2, &mut rng), draw(2, 8, &mut rng), draw(2, 2, &mut rng), time);
            let scale: Vec<f64> = (0..8).map(|k| 10f64.powi([0, 6, -3, 3, 1, -6, 0, 2][k])).collect();
            let system = system.unwrap().with_scaled_states(&scale);
            let width = 1.0 - modulus;
            let near = |angle: f64| (-200..=200).map(move |k| (angle + 0.1 * f64::from(k) * width).abs() / time.ts());
            let mut grid: Vec<f64> = angles.iter().copied().flat_map(near).collect();
            grid.sort_by(f64::total_cmp);
            let (found, searched) = (peak(&system), by_search(&system, &grid));
            assert!((found.value / searched - 1.0).abs() < 1e-8, "{modulus}: {found:?}, {searched}");
        }
    }
}

#[test]
fn random_systems_have_the_largest_gain_of_a_search() {
    fn check<T: TimeDomain>(system: &StateSpace<T>, grid: &[f64]) {
        let (found, searched) = (peak(system), by_search(system, grid));
        assert!(searched <= found.upper * (1.0 + 1e-11), "{found:?}, {searched}");
        assert!(found.value <= searched * (1.0 + 1e-6), "{found:?}, {searched}");
        assert!(found.upper <= found.value * (1.0 + 1.1e-9), "{found:?}");
        if found.frequency.is_finite() {
            assert!((gains(system, &[found.frequency])[0] / found.value - 1.0).abs() < 1e-12);
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let time = Discrete::new(0.5).unwrap();
    let decades = (0..=1200).map(|k| 10f64.powf(-4.0 + f64::from(k) / 150.0));
    let continuous: Vec<f64> = [0.0].into_iter().chain(decades).chain([1e9]).collect();
    let discrete: Vec<f64> = (0..=1200).map(|k| f64::from(k) / 1200.0 * std::f64::consts::TAU).collect();
    for round in 0..60 {
        let (n, m, p) = (1 + round % 12, 1 + round % 3, 1 + (round / 3) % 3);
        let (a, b, c) = (draw(n, n, &mut rng), draw(n, m, &mut rng), draw(p, n, &mut rng));
        let d = Scale([0.0, 1.0, 3.0][round % 3]) * draw(p, m, &mut rng);
        check(&StateSpace::new(a.clone(), b.clone(), c.clone(), d.clone(), Continuous).unwrap(), &continuous);
        check(&StateSpace::new(Scale(0.4) * a, b, c, d, time).unwrap(), &discrete);
    }
}

#[test]
fn a_flat_gain_is_its_own_bound() {
    // All-pass: every frequency has the gain 1.
    for time in [0.0, 1.0] {
        let pole = |p: f64| {
            let square = p * p;
            if time == 0.0 {
                peak(
                    &section(-p, -2.0 * p, 1.0, Continuous)
                        .then(&section(-2.0 * p, -4.0 * p, 1.0, Continuous))
                        .unwrap(),
                )
            } else {
                // (1 - p z) / (z - p)
                peak(&section(p, 1.0 - square, -p, Discrete::new(time).unwrap()))
            }
        };
        for p in [0.1, 0.5, 0.99] {
            let PeakGain { value, upper, .. } = pole(p);
            assert!((value - 1.0).abs() < 1e-13 && upper < 1.0 + 1e-8, "{time} {p}: {value} {upper}");
        }
    }
    let high_pass = peak(&section(-1.0, -1.0, 1.0, Continuous));
    assert_eq!((high_pass.value, high_pass.frequency), (1.0, f64::INFINITY));
    let bump = section(-1.0, -1.0, 1.0, Continuous).plus(&section(-10.0, 3.0, 0.0, Continuous)).unwrap();
    let grid: Vec<f64> = (0..=600).map(|k| 10f64.powf(-2.0 + f64::from(k) / 100.0)).collect();
    assert!((peak(&bump).value / by_search(&bump, &grid) - 1.0).abs() < 1e-9);
}

#[test]
fn the_largest_gain_does_not_know_on_which_side_the_poles_are() {
    let oscillator = |zeta: f64| {
        let a = matrix([[0.0, 1.0], [-1.0, -2.0 * zeta]]);
        StateSpace::new(a, matrix([[0.0], [1.0]]), matrix([[1.0, 0.3]]), Mat::zeros(1, 1), Continuous).unwrap()
    };
    let (stable, unstable) = (peak(&oscillator(0.02)), peak(&oscillator(-0.02)));
    assert!((stable.value / unstable.value - 1.0).abs() < 1e-9);
    assert!(matches!(
        hinf_norm(&oscillator(-0.02), &PeakOptions::default()),
        Err(Error::Unstable { pole, .. }) if (pole.re - 0.02).abs() < 1e-12
    ));
    assert!(matches!(
        linf_norm(&oscillator(0.0), &PeakOptions::default()),
        Err(Error::PoleOnBoundary { omega }) if (omega - 1.0).abs() < 1e-12
    ));
    let tolerance = PeakOptions { tolerance: 0.0 };
    assert!(matches!(linf_norm(&oscillator(0.1), &tolerance), Err(Error::OutOfRange { .. })));
}

#[test]
fn first_order_systems_have_their_closed_forms() {
    for pole in [0.3, 2.0, 1e4] {
        let lag = section(-pole, 3.0, 0.0, Continuous);
        assert!((h2_norm(&lag).unwrap() / (3.0 / (2.0 * pole).sqrt()) - 1.0).abs() < 1e-14);
        assert!((peak(&lag).value / (3.0 / pole) - 1.0).abs() < 1e-14);
        assert_eq!(h2_norm(&section(-pole, 3.0, 0.1, Continuous)).unwrap(), f64::INFINITY);
    }
    for pole in [-0.9999f64, -0.5, 0.0, 0.7, 0.9999] {
        let lag = section(pole, 3.0, 2.0, Discrete::new(1e-3).unwrap());
        let spread = 1.0 - pole * pole;
        assert!((h2_norm(&lag).unwrap() / (9.0 / spread + 4.0).sqrt() - 1.0).abs() < 1e-12);
        let exact = (3.0 / (1.0 - pole) + 2.0).max((2.0 - 3.0 / (1.0 + pole)).abs());
        assert!((peak(&lag).value / exact - 1.0).abs() < 1e-11, "{pole}");
    }
}

#[test]
fn empty_and_zero_systems_have_norms() {
    fn check<T: TimeDomain>(time: T) {
        let gain = StateSpace::gain(matrix([[3.0, 0.0], [0.0, -4.0]]), time).unwrap();
        assert!((peak(&gain).value - 4.0).abs() < 1e-14);
        let a = Scale(-0.5) * eye(2);
        for (m, p) in [(0, 2), (2, 0), (0, 0), (1, 1)] {
            let zero = StateSpace::new(a.clone(), Mat::zeros(2, m), Mat::zeros(p, 2), Mat::zeros(p, m), time).unwrap();
            assert_eq!((peak(&zero).value, peak(&zero).upper), (0.0, 0.0));
            assert_eq!(h2_norm(&zero).unwrap(), 0.0);
        }
        let none = StateSpace::gain(Mat::zeros(0, 0), time).unwrap();
        assert_eq!((peak(&none).value, h2_norm(&none).unwrap()), (0.0, 0.0));
        // What cancels but for rounding is as small as rounding.
        let one = StateSpace::new(Scale(0.5) * a, draw(2, 2, &mut ChaCha8Rng::seed_from_u64(1)), eye(2), eye(2), time);
        let one = one.unwrap();
        assert!(peak(&one.plus(&one.negated()).unwrap()).value < 1e-13);
        assert!(
            (peak(&one.map_output(&(Scale(1e-200) * eye(2)))).value / peak(&one).value / 1e-200 - 1.0).abs() < 1e-8
        );
        assert!((peak(&one.map_output(&(Scale(1e200) * eye(2)))).value / peak(&one).value / 1e200 - 1.0).abs() < 1e-8);
    }
    check(Continuous);
    check(Discrete::new(1e-3).unwrap());
}
