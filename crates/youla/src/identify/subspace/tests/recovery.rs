//! Systems that must come back: without noise exactly, with noise within the statistical error.

use super::*;

#[test]
fn recovers_random_systems() {
    for (case, method) in [SubspaceMethod::Moesp, SubspaceMethod::N4sid, SubspaceMethod::Cva].into_iter().enumerate() {
        for (m, p, magnitudes) in [(1, 1, &[0.9, 0.7][..]), (2, 3, &[0.98, 0.8, 0.95]), (3, 2, &[0.995, 0.6])] {
            let system = random_system(magnitudes, m, p, true, 10 + case as u64);
            let u = uniform(1500, m, &mut ChaCha8Rng::seed_from_u64(20 + case as u64));
            let y = respond(&system, &u, 0.7, None);
            let options = SubspaceOptions { method, ..fixed(2 * magnitudes.len(), 8) };
            let found = subspace(&one(&u, &y), clock(), &options).unwrap();
            let error = distance(&found.model, &system);
            assert!(error < 1e-8, "{method:?}, {m} x {p}: {error:e}");
            assert!(found.fit.percent.iter().all(|f| *f > 99.9999), "{:?}", found.fit);
            assert!(matches!(found.innovation, Innovation::None { reason: NoInnovation::NoiseFree }));
            assert_eq!(found.initial_states[0].len(), 2 * magnitudes.len());
        }
    }
}

#[test]
fn automatic_order_is_the_true_one() {
    let system = random_system(&[0.95, 0.8], 2, 2, false, 3);
    let rng = &mut ChaCha8Rng::seed_from_u64(4);
    let u = uniform(3000, 2, rng);
    let e = 0.05 * uniform(3000, 2, rng);
    let gain = Mat::zeros(4, 2);
    let y = respond(&system, &u, 0.0, Some((&gain, &e)));
    for method in [SubspaceMethod::Moesp, SubspaceMethod::Cva] {
        let options = SubspaceOptions { method, order: Order::Auto(10), horizon: 10, ..Default::default() };
        let found = subspace(&one(&u, &y), clock(), &options).unwrap();
        assert_eq!(found.order.order, 4);
        assert!(distance(&found.model, &system) < 0.02);
        assert_eq!(found.model.d().norm_max(), 0.0);
        // White noise at the outputs: the Kalman filter does not correct the states.
        let correction = found.model.c() * found.innovation.gain().unwrap();
        assert!(correction.norm_max() < 0.05, "{correction:?}");
    }
}

#[test]
fn kalman_gain_of_an_innovation_model() {
    let system = random_system(&[0.9], 1, 2, false, 5);
    let rng = &mut ChaCha8Rng::seed_from_u64(6);
    let u = uniform(40_000, 1, rng);
    let e = 0.3 * uniform(40_000, 2, rng);
    // A - K C = 0.6 A, so that K is the gain of the innovation form.
    let gain = 0.4 * system.c().transpose().partial_piv_lu().solve(system.a().transpose()).transpose();
    let y = respond(&system, &u, 0.0, Some((&gain, &e)));
    let found = subspace(&one(&u, &y), clock(), &fixed(2, 12)).unwrap();
    let (k, covariance) = (found.innovation.gain().unwrap(), found.innovation.covariance().unwrap());
    // Markov parameter C K does not depend on the coordinates; uniform noise of +-0.3 has variance 0.03.
    let error = (found.model.c() * k - system.c() * &gain).norm_max();
    assert!(error < 0.02, "{error}");
    assert!((covariance - 0.03 * Mat::<f64>::identity(2, 2)).norm_max() < 0.001);
}

#[test]
fn several_experiments_recover_one_system() {
    let system = random_system(&[0.97, 0.85], 2, 2, true, 7);
    let rng = &mut ChaCha8Rng::seed_from_u64(8);
    let records: Vec<_> = [300, 170, 90]
        .into_iter()
        .enumerate()
        .map(|(k, length)| {
            let u = uniform(length, 2, rng);
            let y = respond(&system, &u, k as f64 - 1.0, None);
            (u, y)
        })
        .collect();
    let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
    let found = subspace(&experiments, clock(), &fixed(4, 8)).unwrap();
    assert!(distance(&found.model, &system) < 1e-8);
    assert_eq!(found.columns, 300 + 170 + 90 - 3 * 15);
    // The first output sample of each experiment is C x0 + D u: the initial states are those of their own experiment.
    for (x0, (u, y)) in found.initial_states.iter().zip(&records) {
        let x0 = Mat::from_fn(4, 1, |i, _| x0[i]);
        let first = found.model.c() * x0 + found.model.d() * u.as_ref().subrows(0, 1).transpose();
        assert!((first - y.as_ref().subrows(0, 1).transpose()).norm_max() < 1e-8);
    }
}

#[test]
fn repeated_experiment_changes_nothing_but_the_number_of_columns() {
    let system = random_system(&[0.9, 0.7], 1, 1, false, 9);
    let rng = &mut ChaCha8Rng::seed_from_u64(10);
    let u = uniform(500, 1, rng);
    let e = 0.1 * uniform(500, 1, rng);
    let y = respond(&system, &u, 0.0, Some((&Mat::zeros(4, 1), &e)));
    let once = subspace(&one(&u, &y), clock(), &fixed(4, 10)).unwrap();
    let twice = subspace(&[one(&u, &y), one(&u, &y)].concat(), clock(), &fixed(4, 10)).unwrap();
    assert!(distance(&once.model, &twice.model) < 1e-10);
    assert_eq!(twice.columns, 2 * once.columns);
    for (x, x2) in once.initial_states[0].iter().zip(&twice.initial_states[1]) {
        assert!((x.abs() - x2.abs()).abs() < 1e-9);
    }
}

#[test]
fn unstable_system_is_recovered_where_allowed() {
    let system = random_system(&[1.02, 0.9], 1, 2, true, 11);
    let u = uniform(400, 1, &mut ChaCha8Rng::seed_from_u64(12));
    let y = respond(&system, &u, 0.1, None);
    let options = SubspaceOptions { stability: Stability::Allow, ..fixed(4, 8) };
    let found = subspace(&one(&u, &y), clock(), &options).unwrap();
    assert!((found.stability.worst.norm() - 1.02).abs() < 1e-8 && !found.stability.stable);
    assert!(found.stability.moved.is_empty());
    assert!(distance(&found.model, &system) < 1e-6, "{:e}", distance(&found.model, &system));
    assert_eq!(found.fit.by, InputFit::Observer);
}

#[test]
fn unstable_system_in_noise_is_fitted_by_its_predictor() {
    let system = random_system(&[1.01, 0.9], 1, 1, false, 23);
    let rng = &mut ChaCha8Rng::seed_from_u64(24);
    let u = uniform(600, 1, rng);
    let e = 0.1 * uniform(600, 1, rng);
    let y = respond(&system, &u, 0.0, Some((&(0.1 * uniform(4, 1, rng)), &e)));
    let options = SubspaceOptions { stability: Stability::Allow, ..fixed(4, 12) };
    let found = subspace(&one(&u, &y), clock(), &options).unwrap();
    assert_eq!(found.fit.by, InputFit::Prediction);
    assert!((found.stability.worst.norm() - 1.01).abs() < 1e-3);
    assert!(distance(&found.model, &system) < 0.05, "{}", distance(&found.model, &system));
}

#[test]
fn units_of_the_channels_do_not_matter() {
    let system = random_system(&[0.96, 0.8], 2, 2, true, 13);
    let rng = &mut ChaCha8Rng::seed_from_u64(14);
    let u = uniform(800, 2, rng);
    let e = 0.1 * uniform(800, 2, rng);
    let y = respond(&system, &u, 0.0, Some((&(0.2 * uniform(4, 2, rng)), &e)));
    let (v, w) = ([1e6, 1e-3], [1e-6, 1e2]);
    let u2 = Mat::from_fn(800, 2, |k, q| v[q] * u[(k, q)]);
    let y2 = Mat::from_fn(800, 2, |k, i| w[i] * y[(k, i)]);
    for method in [SubspaceMethod::Moesp, SubspaceMethod::N4sid, SubspaceMethod::Cva] {
        let options = SubspaceOptions { method, ..fixed(4, 10) };
        let plain = subspace(&one(&u, &y), clock(), &options).unwrap();
        let scaled = subspace(&one(&u2, &y2), clock(), &options).unwrap();
        let b = Mat::from_fn(4, 2, |i, q| scaled.model.b()[(i, q)] * v[q]);
        let c = Mat::from_fn(2, 4, |i, j| scaled.model.c()[(i, j)] / w[i]);
        let d = Mat::from_fn(2, 2, |i, q| scaled.model.d()[(i, q)] * v[q] / w[i]);
        let back = StateSpace::new(scaled.model.a().to_owned(), b, c, d, clock()).unwrap();
        assert!(distance(&back, &plain.model) < 1e-9, "{method:?}");
        let ratio = scaled.innovation.covariance().unwrap()[(0, 1)] / plain.innovation.covariance().unwrap()[(0, 1)];
        assert!((ratio / (w[0] * w[1]) - 1.0).abs() < 1e-8);
    }
}

#[test]
fn canonical_correlations_do_not_depend_on_an_output_transformation() {
    let system = random_system(&[0.96, 0.8], 1, 2, false, 15);
    let rng = &mut ChaCha8Rng::seed_from_u64(16);
    let u = uniform(900, 1, rng);
    let e = 0.2 * uniform(900, 2, rng);
    let y = respond(&system, &u, 0.0, Some((&Mat::zeros(4, 2), &e)));
    let mixed = &y * Mat::from_fn(2, 2, |i, j| [[3.0, 1.0], [-2.0, 0.5]][i][j]);
    let options = SubspaceOptions { method: SubspaceMethod::Cva, scaling: ChannelScaling::None, ..fixed(4, 8) };
    let left = subspace(&one(&u, &y), clock(), &options).unwrap();
    let right = subspace(&one(&u, &mixed), clock(), &options).unwrap();
    for (a, b) in left.singular_values.iter().zip(&right.singular_values) {
        assert!((a - b).abs() < 1e-10 && *a < 1.0 + 1e-12);
    }
}

#[test]
fn noise_free_output_beside_a_noisy_one() {
    let system = random_system(&[0.9, 0.8], 1, 2, true, 21);
    let rng = &mut ChaCha8Rng::seed_from_u64(22);
    let u = uniform(4000, 1, rng);
    let e = Mat::from_fn(4000, 2, |_, i| if i == 0 { 0.0 } else { rng.random::<f64>() - 0.5 });
    let y = respond(&system, &u, 0.0, Some((&Mat::zeros(4, 2), &e)));
    let found = subspace(&one(&u, &y), clock(), &fixed(4, 8)).unwrap();
    assert!(distance(&found.model, &system) < 0.02, "{}", distance(&found.model, &system));
    assert!(found.fit.percent[0] > 99.0);
}

#[test]
fn same_bits_on_one_and_two_threads() {
    let system = random_system(&[0.96, 0.8], 2, 2, true, 17);
    let rng = &mut ChaCha8Rng::seed_from_u64(18);
    let u = uniform(20_000, 2, rng);
    let e = 0.1 * uniform(20_000, 2, rng);
    let y = respond(&system, &u, 0.0, Some((&Mat::zeros(4, 2), &e)));
    let (u1, y1) = (u.as_ref().split_at_row(13_000), y.as_ref().split_at_row(13_000));
    let experiments = [Experiment::new(u1.0, y1.0), Experiment::new(u1.1, y1.1)];
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| subspace(&experiments, clock(), &fixed(4, 10)).unwrap())
    };
    let (single, double) = (run(1), run(2));
    assert_eq!(single.model, double.model);
    assert_eq!(single.singular_values, double.singular_values);
    assert_eq!(single.innovation.gain(), double.innovation.gain());
    assert_eq!((single.fit, single.initial_states), (double.fit, double.initial_states));
}
