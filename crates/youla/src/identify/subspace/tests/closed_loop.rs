//! The methods for closed loops: exact without noise, consistent under feedback, independent of units, order and threads.

use super::*;

const METHODS: [SubspaceMethod; 2] = [SubspaceMethod::PbsidOpt, SubspaceMethod::Ssarx];

/// Inputs and outputs of a loop `u = r + g v, v(k) = 0.6 v(k-1) + y(k - delay)` around a system without direct path, with
/// innovations e.
fn feedback(
    system: &StateSpace<Discrete>,
    gain: &Mat<f64>,
    r: &Mat<f64>,
    e: &Mat<f64>,
    g: f64,
    delay: usize,
) -> (Mat<f64>, Mat<f64>) {
    let (mut x, mut v) = (Mat::<f64>::zeros(system.order(), 1), 0.0);
    let (mut u, mut y) = (r.clone(), Mat::zeros(e.nrows(), system.outputs()));
    for k in 0..r.nrows() {
        let ek = e.as_ref().row(k).transpose();
        y.row_mut(k).copy_from((system.c() * x.col(0) + ek).transpose());
        v = 0.6 * v + if k < delay { 0.0 } else { y[(k - delay, 0)] };
        u[(k, 0)] += g * v;
        x = (system.a() * x.col(0) + system.b() * u.as_ref().row(k).transpose() + gain * ek).as_mat().to_owned();
    }
    (u, y)
}

/// A second-order plant, the gain of its innovations and a loop that feeds strong noise back.
fn noisy_loop(samples: usize, delay: usize) -> (StateSpace<Discrete>, Mat<f64>, Mat<f64>, Mat<f64>) {
    let matrix = |rows, columns, entries: &[f64]| Mat::from_fn(rows, columns, |i, j| entries[i * columns + j]);
    let a = matrix(2, 2, &[1.5, -0.7, 1.0, 0.0]);
    let b = matrix(2, 1, &[1.0, 0.0]);
    let plant = StateSpace::new(a, b, matrix(1, 2, &[1.0, 0.5]), Mat::zeros(1, 1), clock()).unwrap();
    let gain = matrix(2, 1, &[0.7, 0.3]);
    let rng = &mut ChaCha8Rng::seed_from_u64(40);
    let (r, e) = (0.4 * uniform(samples, 1, rng), 2.0 * uniform(samples, 1, rng));
    let (u, y) = feedback(&plant, &gain, &r, &e, -0.05, delay);
    (plant, gain, u, y)
}

#[test]
fn noise_free_systems_are_recovered() {
    for (case, method) in METHODS.into_iter().enumerate() {
        for (m, p, magnitudes) in [(1, 1, &[0.9, 0.7][..]), (2, 3, &[0.98, 0.8, 0.95]), (3, 2, &[0.995, 0.6])] {
            let system = random_system(magnitudes, m, p, true, 10 + case as u64);
            let u = uniform(1500, m, &mut ChaCha8Rng::seed_from_u64(20 + case as u64));
            let y = respond(&system, &u, 0.7, None);
            let options = SubspaceOptions { method, horizon: 6, past: Some(9), ..fixed(2 * magnitudes.len(), 6) };
            let found = subspace(&one(&u, &y), clock(), &options).unwrap();
            let error = distance(&found.model, &system);
            assert!(error < 1e-8, "{method:?}, {m} x {p}: {error:e}");
            assert!(matches!(found.innovation, Innovation::None { reason: NoInnovation::NoiseFree }));
            assert_eq!((found.past, found.horizon, found.columns), (9, 6, 1500 - 14));
        }
    }
}

#[test]
fn unstable_system_and_several_experiments_without_noise() {
    let system = random_system(&[1.02, 0.9], 1, 2, true, 11);
    let records: Vec<_> = [300, 170, 90]
        .into_iter()
        .map(|length| {
            let u = uniform(length, 1, &mut ChaCha8Rng::seed_from_u64(length as u64));
            let y = respond(&system, &u, 0.1, None);
            (u, y)
        })
        .collect();
    let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
    for method in METHODS {
        let options = SubspaceOptions { method, stability: Stability::Allow, ..fixed(4, 6) };
        let found = subspace(&experiments, clock(), &options).unwrap();
        assert!((found.stability.worst.norm() - 1.02).abs() < 1e-7, "{method:?}: {}", found.stability.worst.norm());
        assert!(distance(&found.model, &system) < 1e-6, "{method:?}: {:e}", distance(&found.model, &system));
        let refused = subspace(&experiments, clock(), &SubspaceOptions { stability: Stability::Require, ..options });
        assert!(matches!(refused, Err(crate::Error::Unstable { .. })));
    }
}

/// 40000 samples of a loop in which four fifths of the input power are fed-back noise: the model within 3 %, the Kalman gain
/// within 0.03 (as `C K`), while the methods for open loops stay beyond 60 %.
#[test]
fn feedback_does_not_bias() {
    let (plant, gain, u, y) = noisy_loop(40_000, 1);
    let options =
        |method| SubspaceOptions { method, horizon: 10, past: Some(20), order: Order::Fixed(2), ..Default::default() };
    for method in METHODS {
        let found = subspace(&one(&u, &y), clock(), &options(method)).unwrap();
        let error = distance(&found.model, &plant);
        assert!(error < 0.03, "{method:?}: {error}");
        assert_eq!(found.fit.by, InputFit::Prediction);
        let markov = (found.model.c() * found.innovation.gain().unwrap())[(0, 0)] - (plant.c() * &gain)[(0, 0)];
        assert!(markov.abs() < 0.03, "{method:?}: {markov}");
        let variance = found.innovation.covariance().unwrap()[(0, 0)];
        assert!((variance / (4.0 / 3.0) - 1.0).abs() < 0.03, "{method:?}: {variance}");
    }
    for method in [SubspaceMethod::Moesp, SubspaceMethod::N4sid, SubspaceMethod::Cva] {
        let found = subspace(&one(&u, &y), clock(), &options(method)).unwrap();
        assert!(distance(&found.model, &plant) > 0.6, "{method:?}: {}", distance(&found.model, &plant));
    }
}

/// A controller that answers in the same sample biases neither method.
#[test]
fn a_controller_without_delay_does_no_harm() {
    let (plant, _, u, y) = noisy_loop(40_000, 0);
    for method in METHODS {
        let options =
            SubspaceOptions { method, horizon: 10, past: Some(20), order: Order::Fixed(2), ..Default::default() };
        let error = distance(&subspace(&one(&u, &y), clock(), &options).unwrap().model, &plant);
        assert!(error < 0.03, "{method:?}: {error}");
    }
}

#[test]
fn automatic_order_is_the_true_one_in_closed_loop() {
    let (plant, _, u, y) = noisy_loop(5000, 1);
    for method in METHODS {
        let options =
            SubspaceOptions { method, horizon: 10, past: Some(20), order: Order::Auto(8), ..Default::default() };
        let found = subspace(&one(&u, &y), clock(), &options).unwrap();
        assert_eq!(found.order.order, 2, "{:?}", found.order);
        let error = distance(&found.model, &plant);
        assert!(error < 0.1, "{method:?}: {error}");
        assert_eq!(found.singular_values.len(), 10);
    }
}

/// Two inputs, three outputs with noise.
fn noisy_record(samples: usize) -> (Mat<f64>, Mat<f64>) {
    let system = random_system(&[0.95, 0.8], 2, 3, false, 30);
    let rng = &mut ChaCha8Rng::seed_from_u64(31);
    let (u, e) = (uniform(samples, 2, rng), 0.1 * uniform(samples, 3, rng));
    let y = respond(&system, &u, 0.0, Some((&(0.2 * uniform(4, 3, rng)), &e)));
    (u, y)
}

/// Permuted and rescaled channels give the permuted and rescaled model, to rounding.
#[test]
fn order_and_units_of_the_channels_do_not_matter() {
    let (u, y) = noisy_record(2000);
    let (swap, turn, units) = ([1, 0], [2, 0, 1], [1e-6, 40.0, 3e4]);
    let u2 = Mat::from_fn(u.nrows(), 2, |k, j| 1e3 * u[(k, swap[j])]);
    let y2 = Mat::from_fn(y.nrows(), 3, |k, j| units[j] * y[(k, turn[j])]);
    for method in METHODS {
        let options = SubspaceOptions { method, horizon: 8, past: Some(15), ..fixed(4, 8) };
        let run = |u, y| subspace(&one(u, y), clock(), &options).unwrap().model;
        let (plain, other) = (run(&u, &y), run(&u2, &y2));
        let b = Mat::from_fn(4, 2, |i, j| 1e3 * other.b()[(i, swap[j])]);
        let row = |i: usize| turn.iter().position(|t| *t == i).unwrap();
        let c = Mat::from_fn(3, 4, |i, j| other.c()[(row(i), j)] / units[row(i)]);
        let d = Mat::from_fn(3, 2, |i, j| 1e3 * other.d()[(row(i), swap[j])] / units[row(i)]);
        let back = StateSpace::new(other.a().to_owned(), b, c, d, clock()).unwrap();
        assert!(distance(&back, &plain) < 1e-9, "{method:?}: {:e}", distance(&back, &plain));
    }
}

#[test]
fn factorisations_agree_and_threads_do_not_matter() {
    let (u, y) = noisy_record(17_000);
    for method in METHODS {
        let run = |factorisation, threads| {
            let options = SubspaceOptions { method, horizon: 8, past: Some(15), factorisation, ..fixed(4, 8) };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found = pool.install(|| subspace(&one(&u, &y), clock(), &options)).unwrap();
            (found.model, found.innovation.gain().unwrap().to_owned(), found.factor.by)
        };
        let (gram, qr) = (run(Factorisation::Auto, 1), run(Factorisation::Qr, 1));
        assert_eq!((gram.2, qr.2), (Factorisation::Gram, Factorisation::Qr));
        assert!(distance(&gram.0, &qr.0) < 1e-9, "{method:?}: {:e}", distance(&gram.0, &qr.0));
        assert!(gram == run(Factorisation::Auto, 2) && qr == run(Factorisation::Qr, 2), "{method:?}");
    }
}

/// A constrained estimate keeps its predictor: poles reflected by name, A - K C stable, B and D for the changed A.
#[test]
fn unstable_poles_are_reflected_where_asked_for() {
    let system = random_system(&[1.01, 0.9], 1, 1, false, 23);
    let rng = &mut ChaCha8Rng::seed_from_u64(24);
    let (u, e) = (uniform(600, 1, rng), 0.1 * uniform(600, 1, rng));
    let y = respond(&system, &u, 0.0, Some((&(0.1 * uniform(4, 1, rng)), &e)));
    for method in METHODS {
        let options = SubspaceOptions { method, stability: Stability::Constrain, ..fixed(4, 8) };
        let found = subspace(&one(&u, &y), clock(), &options).unwrap();
        assert!(found.stability.stable && found.stability.moved.len() == 2, "{:?}", found.stability);
        let predictor = found.model.a() - found.innovation.gain().unwrap() * found.model.c();
        assert!(predictor.eigenvalues().unwrap().iter().all(|z| z.norm() < 1.0));
    }
}

/// `past` beside `horizon` serves the methods for open loops as well.
#[test]
fn past_and_future_of_different_length_for_open_loops() {
    let system = random_system(&[0.95, 0.8], 2, 2, true, 33);
    let u = uniform(800, 2, &mut ChaCha8Rng::seed_from_u64(34));
    let y = respond(&system, &u, 0.5, None);
    for method in [SubspaceMethod::Moesp, SubspaceMethod::N4sid, SubspaceMethod::Cva] {
        for past in [3, 12] {
            let options = SubspaceOptions { method, horizon: 6, past: Some(past), ..fixed(4, 6) };
            let found = subspace(&one(&u, &y), clock(), &options).unwrap();
            assert!(
                distance(&found.model, &system) < 1e-8,
                "{method:?}, {past}: {:e}",
                distance(&found.model, &system)
            );
            assert_eq!(found.columns, 801 - past - 6);
        }
    }
    let none = SubspaceOptions { horizon: 6, past: Some(0), ..fixed(4, 6) };
    assert!(matches!(subspace(&one(&u, &y), clock(), &none), Err(crate::Error::OutOfRange { .. })));
}
