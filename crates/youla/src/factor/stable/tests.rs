use super::*;
use crate::lti::{Continuous, Discrete, frequency_response};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A random plant with two inputs, three outputs and feedthrough, about half of its poles unstable.
pub(in crate::factor) fn random_plant<T: TimeDomain>(n: usize, time: T, rng: &mut ChaCha8Rng) -> StateSpace<T> {
    let mut random =
        |rows: usize, columns: usize| -> Mat<f64> { Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(rng)) };
    let scale = match time.sample_time() {
        Some(_) => 1.4 / (n as f64).sqrt(),
        None => 1.0,
    };
    let a = faer::Scale(scale) * random(n, n);
    StateSpace::new(a, random(n, 2), random(3, n), faer::Scale(0.5) * random(3, 2), time).unwrap()
}

fn grid<T: TimeDomain>(time: T) -> Vec<f64> {
    match time.sample_time() {
        None => (0..40).map(|k| 10f64.powf(0.1 * f64::from(k) - 2.0)).collect(),
        Some(ts) => (1..40).map(|k| std::f64::consts::PI / ts * f64::from(k) / 40.0).collect(),
    }
}

fn is_beyond<T: TimeDomain>(time: T, pole: c64, limit: f64) -> bool {
    time.instability(pole) >= limit
}

fn check<T: TimeDomain>(plant: &StateSpace<T>, denominator: Denominator) {
    let time = plant.time();
    let limit = limit(time, denominator).unwrap();
    let omega = grid(time);
    let beyond = plant.poles().unwrap().into_iter().filter(|p| is_beyond(time, *p, limit)).count();
    let g = frequency_response(plant, &omega).unwrap();
    for left in [false, true] {
        let factors = if left { left_coprime(plant, denominator) } else { right_coprime(plant, denominator) }.unwrap();
        let (n, m) = (&factors.numerator, &factors.denominator);
        assert_eq!(factors.moved.len(), beyond);
        assert!(factors.moved.iter().all(|p| is_beyond(time, *p, limit)));
        let worst = time.instability(n.worst_pole().unwrap().unwrap());
        assert!(worst < limit.max(0.0) + 1e-7 && (beyond == 0 || worst < 0.0), "{worst}");
        let [n, m, short] =
            [n, m, &factors.minimal_denominator().unwrap()].map(|s| frequency_response(s, &omega).unwrap());
        for k in 0..omega.len() {
            let (g, n, m, short) = (g.at(k), n.at(k), m.at(k), short.at(k));
            let miss = if left { m * g - n } else { g * m - n };
            assert!(miss.norm_l2() < 1e-10 * (1.0 + g.norm_l2() * m.norm_l2()), "{}", miss.norm_l2());
            assert!((m - short).norm_l2() < 1e-10 * m.norm_l2());
            if denominator == Denominator::Inner {
                let square = if left { m * m.adjoint() } else { m.adjoint() * m };
                let miss = (square - Mat::<c64>::identity(m.nrows(), m.nrows())).norm_l2();
                assert!(miss < 1e-10, "{miss}");
            }
        }
    }
}

#[test]
fn factors_give_the_plant_back() {
    let rng = &mut ChaCha8Rng::seed_from_u64(61);
    for n in [0, 1, 2, 3, 5, 8, 13] {
        for _ in 0..3 {
            let continuous = random_plant(n, Continuous, rng);
            let discrete = random_plant(n, Discrete::new(0.1).unwrap(), rng);
            if n == 0 {
                assert!(right_coprime(&continuous, Denominator::Inner).unwrap().moved.is_empty());
                continue;
            }
            check(&continuous, Denominator::Inner);
            check(&continuous, Denominator::Degree(-0.7));
            check(&discrete, Denominator::Inner);
            check(&discrete, Denominator::Degree(0.6));
        }
    }
}

/// A pair with `B = diag(b1, b2)`: the wanted poles, and no other pair of entries beside the diagonal with their product is
/// reached by less feedback, among 400 on either branch.
#[test]
fn the_feedback_of_a_pair_is_small() {
    let rng = &mut ChaCha8Rng::seed_from_u64(62);
    for _ in 0..20 {
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let (real, imaginary, b) = (normal(), normal(), [normal().abs() + 0.5, 0.3]);
        let a = Mat::from_fn(2, 2, |i, j| [[real, imaginary], [-imaginary * 2.0, real]][i][j]);
        let pole = c64::new(real, imaginary.abs() * 2f64.sqrt());
        let input = Mat::from_fn(2, 2, |i, j| if i == j { b[i] } else { 0.0 });
        let f = assign::feedback(Continuous, &a, &input, pole, -2.0).unwrap().f;
        let x = &a + &input * &f;
        let determinant = x[(0, 0)] * x[(1, 1)] - x[(0, 1)] * x[(1, 0)];
        assert!((x[(0, 0)] + x[(1, 1)] + 4.0).abs() < 1e-12);
        assert!((determinant - 4.0 - pole.im * pole.im).abs() < 1e-9, "{determinant} {pole}");
        let product = x[(0, 1)] * x[(1, 0)];
        let cost = |x12: f64| ((x12 - a[(0, 1)]) / b[0]).hypot((product / x12 - a[(1, 0)]) / b[1]);
        let least = cost(x[(0, 1)]);
        let others = (0..400).map(|k| 10f64.powf(f64::from(k) / 100.0 - 2.0)).flat_map(|t| [t, -t]);
        assert!(others.into_iter().all(|x12| cost(x12) >= least * (1.0 - 1e-9)));
    }
}

#[test]
fn poles_that_cannot_be_moved_are_refused() {
    let diagonal = |x: f64, y: f64| Mat::from_fn(2, 2, |i, j| if i == j { [x, y][i] } else { 0.0 });
    let b = Mat::from_fn(2, 1, |i, _| [1.0, 0.0][i]);
    let one = |a: Mat<f64>, b: &Mat<f64>| {
        let c = Mat::full(1, 2, 1.0);
        StateSpace::new(a, b.clone(), c, Mat::zeros(1, 1), Continuous).unwrap()
    };
    let hidden = one(diagonal(-1.0, 2.0), &b);
    let refusal = right_coprime(&hidden, Denominator::Inner).unwrap_err();
    assert!(matches!(refusal, Error::NotStabilisable { pole, .. } if pole.re == 2.0), "{refusal}");
    assert!(matches!(left_coprime(&hidden.dual(), Denominator::Inner), Err(Error::NotDetectable { .. })));
    let integrator = one(diagonal(-1.0, 0.0), &Mat::full(2, 1, 1.0));
    assert!(matches!(right_coprime(&integrator, Denominator::Inner), Err(Error::NoSolution { .. })));
    assert!(right_coprime(&integrator, Denominator::Degree(-0.5)).is_ok());
    for degree in [0.0, 1.0, f64::NAN] {
        assert!(matches!(right_coprime(&integrator, Denominator::Degree(degree)), Err(Error::OutOfRange { .. })));
    }
}
