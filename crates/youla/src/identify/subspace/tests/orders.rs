//! Rules that choose the order: all find the order of a system that the noise does not hide, and say what they weighed.

use super::*;
use crate::Error;

const RULES: [OrderRule; 5] =
    [OrderRule::Svc, OrderRule::Nic, OrderRule::Gap, OrderRule::Aic, OrderRule::CrossValidation];

fn by(rule: OrderRule, max: usize) -> Order {
    Order::Auto(AutoOrder { rule, ..AutoOrder::up_to(max) })
}

/// Two experiments with noise of the innovation form on a system of order 4.
fn records(seed: u64, noise: f64) -> Vec<(Mat<f64>, Mat<f64>)> {
    let system = random_system(&[0.97, 0.9], 1, 2, false, seed);
    let rng = &mut ChaCha8Rng::seed_from_u64(100 + seed);
    let gain = 0.2 * uniform(4, 2, rng);
    let mut record = |samples| {
        let u = uniform(samples, 1, rng);
        let e = noise * uniform(samples, 2, rng);
        let y = respond(&system, &u, 0.0, Some((&gain, &e)));
        (u, y)
    };
    vec![record(3000), record(1500)]
}

fn run(records: &[(Mat<f64>, Mat<f64>)], options: &SubspaceOptions) -> crate::Result<SubspaceModel> {
    let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
    subspace(&experiments, clock(), options)
}

/// Ten systems, noise of 5 % of the input's amplitude, orders up to 8: 10, 10, 7 and 10 of them get order 4 by SVC, gap, AIC
/// and cross-validation. AIC is not consistent; it never takes less. NIC adds up the correlations of all directions that
/// hold only noise and takes the largest order, as far as it has been seen.
#[test]
fn every_rule_on_ten_systems() {
    let mut hits = [0; 5];
    for seed in 0..10 {
        let records = records(seed, 0.05);
        let chosen = RULES.map(|rule| {
            let options = SubspaceOptions {
                method: SubspaceMethod::Cva,
                order: by(rule, 8),
                horizon: 10.into(),
                stability: Stability::Allow,
                ..Default::default()
            };
            let report = run(&records, &options).unwrap().order;
            assert_eq!((report.rule, report.values.len()), (Some(rule), 8));
            assert!(report.candidates.iter().any(|c| c.rule == rule && c.order == report.order));
            let cheap = [OrderRule::Svc, OrderRule::Nic, OrderRule::Gap];
            assert!(cheap.iter().all(|rule| report.candidates.iter().any(|c| c.rule == *rule)));
            report.order
        });
        assert!(chosen[3] >= 4 && chosen[1] >= 4, "seed {seed}: {chosen:?}");
        hits.iter_mut().zip(chosen).for_each(|(hits, order)| *hits += usize::from(order == 4));
    }
    let [svc, _, gap, aic, cross_validation] = hits;
    assert!(svc == 10 && gap == 10 && aic >= 6 && cross_validation == 10, "{hits:?}");
}

/// The values of cross-validation are the fits of models of the leading part on the rest; the lowest order within the
/// tolerance is taken.
#[test]
fn cross_validation_takes_the_lowest_order_within_its_tolerance() {
    let records = records(3, 0.05);
    let choose = |leading, tolerance| {
        let auto = AutoOrder { max: 8, rule: OrderRule::CrossValidation, leading, tolerance };
        let options = SubspaceOptions {
            order: Order::Auto(auto),
            horizon: 10.into(),
            stability: Stability::Allow,
            ..Default::default()
        };
        run(&records, &options).map(|found| found.order)
    };
    let strict = choose(0.6, 0.0).unwrap();
    let fits: Vec<f64> = strict.values.iter().map(|v| v.value.unwrap_or(f64::NAN)).collect();
    let best = fits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert_eq!(fits[strict.order - 1], best, "{fits:?}");
    assert!(best > 80.0 && fits[3] > best - 0.2 && fits[0] < best - 5.0, "{fits:?}");
    assert_eq!(choose(0.6, 0.2).unwrap().order, 4, "{fits:?}");
    assert_eq!(choose(0.6, 1000.0).unwrap().order, 1);
    for leading in [0.0, 1.0, f64::NAN] {
        assert!(matches!(choose(leading, 0.2), Err(Error::OutOfRange { .. })));
    }
    assert!(
        matches!(choose(0.005, 0.2), Err(Error::Within { source, .. }) if matches!(*source, Error::TooFewSamples { .. }))
    );
}

/// Without noise the order from which on nothing is left is the least of AIC; an unstable system has no simulated fit.
#[test]
fn rules_on_models_without_noise_and_without_stability() {
    let system = random_system(&[0.95, 0.8], 1, 1, false, 41);
    let u = uniform(600, 1, &mut ChaCha8Rng::seed_from_u64(42));
    let quiet = [(u.clone(), respond(&system, &u, 0.0, None))];
    let options = |rule| SubspaceOptions {
        order: by(rule, 7),
        horizon: 9.into(),
        stability: Stability::Allow,
        ..Default::default()
    };
    let found = run(&quiet, &options(OrderRule::Aic)).unwrap();
    assert_eq!(found.order.order, 4, "{:?}", found.order);
    assert!(distance(&found.model, &system) < 1e-8);
    let grows = [(u.clone(), Mat::from_fn(600, 1, |k, _| 1.02f64.powi(k as i32) + 1e-3 * u[(k, 0)]))];
    let refused = run(&grows, &SubspaceOptions { order: by(OrderRule::CrossValidation, 1), ..options(OrderRule::Svc) });
    assert!(matches!(refused, Err(Error::NoSolution { .. })), "{refused:?}");
}

#[test]
fn rules_read_from_a_table() {
    let read = |text: &str| toml::from_str::<SubspaceOptions>(text).map(|o| o.order);
    let expected = AutoOrder { max: 9, rule: OrderRule::CrossValidation, leading: 0.7, tolerance: 0.2 };
    let text = "order = { auto = { max = 9, rule = 'cross-validation', leading = 0.7 } }";
    assert_eq!(read(text).unwrap(), Order::Auto(expected));
    assert_eq!(read("order = { auto = { rule = 'nic' } }").unwrap(), by(OrderRule::Nic, 12));
    assert!(
        read("order = { auto = { rule = 'bic' } }").is_err() && read("order = { auto = { maximum = 3 } }").is_err()
    );
}
