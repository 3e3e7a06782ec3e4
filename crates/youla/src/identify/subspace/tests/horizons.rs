//! Horizons from the data: the criterion is that of the regressions, long where the predictor forgets slowly.

use super::*;
use crate::Error;
use crate::linalg::least_squares;

fn automatic(max: usize, order: usize) -> SubspaceOptions {
    SubspaceOptions {
        horizon: Horizon::Auto { max_past: max },
        order: Order::Fixed(order),
        stability: Stability::Allow,
        ..Default::default()
    }
}

/// The criterion of each past, from one factor, is that of a regression of its own over the same samples.
#[test]
fn the_criterion_is_that_of_the_regressions() {
    let system = random_system(&[0.9, 0.8], 2, 2, true, 50);
    let rng = &mut ChaCha8Rng::seed_from_u64(51);
    let (u, e) = (uniform(400, 2, rng), 0.3 * uniform(400, 2, rng));
    let y = respond(&system, &u, 0.0, Some((&(0.3 * uniform(4, 2, rng)), &e)));
    let max = 6;
    for feedthrough in [Feedthrough::None, Feedthrough::Estimated] {
        for factorisation in [Factorisation::Gram, Factorisation::Qr] {
            let options = SubspaceOptions {
                feedthrough: feedthrough.clone(),
                factorisation,
                scaling: ChannelScaling::None,
                ..automatic(max, 4)
            };
            let found = subspace(&one(&u, &y), clock(), &options).unwrap().automatic_horizon.unwrap();
            let direct = usize::from(feedthrough == Feedthrough::Estimated) * 2;
            for p in 1..=max {
                let samples = 400 - max;
                let regressors = Mat::from_fn(samples, direct + 4 * p, |k, j| {
                    let (now, lagged) = (k + max, j.saturating_sub(direct));
                    match (j < direct, lagged / 4 + 1, lagged % 4) {
                        (true, _, _) => u[(now, j)],
                        (_, lag, c) if c < 2 => u[(now - lag, c)],
                        (_, lag, c) => y[(now - lag, c - 2)],
                    }
                });
                let target = y.as_ref().subrows(max, samples);
                let x = least_squares("the lags", regressors.as_ref(), target).unwrap().x;
                let e = target - &regressors * x;
                let covariance = e.transpose() * &e;
                let det = covariance[(0, 0)] * covariance[(1, 1)] - covariance[(0, 1)].powi(2);
                let n = samples as f64;
                let aic = (det / (n * n)).ln() + 2.0 * (p * 4 * 2) as f64 / n;
                assert!((found.criterion[p - 1] - aic).abs() < 1e-8, "p = {p}: {} and {aic}", found.criterion[p - 1]);
            }
        }
    }
}

/// An autoregression of three lags is found to have three, or with Akaike's probability of too many a few more.
#[test]
fn an_autoregression_has_its_own_number_of_lags() {
    let mut lags = Vec::new();
    for seed in 0..10 {
        let rng = &mut ChaCha8Rng::seed_from_u64(60 + seed);
        let (u, e) = (uniform(3000, 1, rng), 0.5 * uniform(3000, 1, rng));
        let mut y = Mat::zeros(3000, 1);
        for k in 3..3000 {
            y[(k, 0)] = 0.8 * y[(k - 1, 0)] - 0.5 * y[(k - 2, 0)] + 0.2 * y[(k - 3, 0)] + u[(k - 1, 0)] + e[(k, 0)];
        }
        let found = subspace(&one(&u, &y), clock(), &automatic(20, 3)).unwrap();
        let report = found.automatic_horizon.clone().unwrap();
        assert_eq!((found.past, found.horizon), (report.past, report.horizon));
        assert_eq!(report.horizon, report.past.max(4));
        lags.push(report.past);
    }
    assert!(lags.iter().all(|p| *p >= 3) && lags.iter().filter(|p| **p == 3).count() >= 6, "{lags:?}");
}

/// The predictor of the bearing under white output noise forgets as slowly as the plant, with a time constant of some 50
/// samples: 57 and 60 lags with 0.1 and 1 um of noise, where the same number of samples of a quickly forgetting system takes a
/// few. The modes are those of the plant within 0.5 Hz and 0.002.
#[test]
fn a_weakly_damped_plant_under_output_noise_needs_a_long_past() {
    for (noise, least) in [(0.1, 40), (1.0, 40)] {
        let (u, y, time) = bearing_record(20_000, noise, 5);
        let options = SubspaceOptions { method: SubspaceMethod::Cva, ..automatic(120, 6) };
        let found = subspace(&one(&u, &y), time, &options).unwrap();
        assert!((least..=100).contains(&found.past) && found.horizon == found.past, "{} um: {}", noise, found.past);
        let modes: Vec<_> = found.model.modes().unwrap().into_iter().filter(|m| m.zeta < 0.5).collect();
        assert_eq!(modes.len(), 2);
        for (mode, (hz, zeta)) in modes.iter().zip([(209.7, 0.1019), (217.6, 0.0820)]) {
            assert!((mode.hz - hz).abs() < 0.5 && (mode.zeta - zeta).abs() < 0.002, "{noise} um: {mode:?}");
        }
    }
}

#[test]
fn what_cannot_be_chosen_is_refused() {
    let (u, y, time) = bearing_record(300, 0.1, 1);
    let run = |options: &SubspaceOptions| subspace(&one(&u, &y), time, options).err();
    assert!(matches!(run(&automatic(0, 2)), Some(Error::OutOfRange { .. })));
    assert!(matches!(run(&automatic(299, 2)), Some(Error::TooFewSamples { .. })));
    assert!(matches!(run(&automatic(400, 2)), Some(Error::TooFewSamples { .. })));
    assert!(matches!(run(&automatic(20, 200)), Some(Error::TooFewSamples { .. })));
    let data = SubspaceData::new(&one(&u, &y), time, &automatic(10, 4)).unwrap();
    assert!(matches!(data.identify(&automatic(11, 4)), Err(Error::Unsupported { .. })));
    let read = |text: &str| toml::from_str::<SubspaceOptions>(text).map(|options| options.horizon);
    for (text, horizon) in [
        ("horizon = 30", Horizon::from(30)),
        ("horizon = { future = 30, past = 60 }", Horizon::Fixed { future: 30, past: 60 }),
        ("horizon = \"auto\"", Horizon::AUTO),
        ("horizon = { max_past = 30 }", Horizon::Auto { max_past: 30 }),
    ] {
        assert_eq!(read(text), Ok(horizon));
        let options = SubspaceOptions { horizon, ..Default::default() };
        assert_eq!(toml::from_str::<SubspaceOptions>(&toml::to_string(&options).unwrap()), Ok(options));
    }
    for text in ["horizon = \"automatic\"", "horizon = { max_past = 30, past = 2 }", "horizon = -1"] {
        let refused = read(text).unwrap_err().to_string();
        assert!(refused.contains("a number of block rows, `{ future = 30, past = 60 }`"), "{refused}");
    }
}

/// A scan gives the models that an identification of its own gives, from one factor.
#[test]
fn a_scan_gives_the_models_of_each_horizon() {
    let (u, y, time) = bearing_record(6000, 0.1, 3);
    let options = SubspaceOptions {
        method: SubspaceMethod::Cva,
        horizon: 30.into(),
        stability: Stability::Allow,
        ..Default::default()
    };
    let data = SubspaceData::new(&one(&u, &y), time, &options).unwrap();
    let found = data.scan(&[3, 15, 30].map(Horizon::from), &[6, 8], &options).unwrap();
    assert_eq!(found.len(), 6);
    for scanned in &found {
        let wanted =
            SubspaceOptions { horizon: scanned.horizon, order: Order::Fixed(scanned.order), ..options.clone() };
        match (&scanned.model, data.identify(&wanted)) {
            (Ok(model), Ok(own)) => assert_eq!(model.model, own.model),
            (Err(Error::Order { .. }), Err(_)) => assert!(scanned.horizon == 3.into()),
            other => panic!("{other:?}"),
        }
    }
    let modes = |k: usize| found[k].model.as_ref().unwrap().model.modes().unwrap();
    let error = |k: usize| modes(k).iter().map(|m| (m.hz - 217.6).abs()).fold(f64::INFINITY, f64::min);
    assert!(error(4) < 0.05, "{} Hz with 30 block rows, {} Hz with 15", error(4), error(2));
    assert!(data.scan(&[31.into()], &[6], &options).is_err());
}
