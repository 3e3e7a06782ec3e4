//! The order by the singular value criterion.

use super::*;

/// Ten systems of order 4 with noise of the innovation form of 5 % of the input's amplitude, two experiments each, orders up to 8.
#[test]
fn the_criterion_finds_the_order_of_ten_systems() {
    for seed in 0..10 {
        let system = random_system(&[0.97, 0.9], 1, 2, false, seed);
        let rng = &mut ChaCha8Rng::seed_from_u64(100 + seed);
        let gain = 0.2 * uniform(4, 2, rng);
        let records = [3000, 1500].map(|samples| {
            let u = uniform(samples, 1, rng);
            let e = 0.05 * uniform(samples, 2, rng);
            let y = respond(&system, &u, 0.0, Some((&gain, &e)));
            (u, y)
        });
        let experiments = records.each_ref().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref()));
        let options = SubspaceOptions {
            method: SubspaceMethod::Cva,
            order: Order::Auto(8),
            horizon: 10,
            stability: Stability::Allow,
            ..Default::default()
        };
        let report = subspace(&experiments, clock(), &options).unwrap().order;
        assert_eq!((report.order, report.criterion.len()), (4, 8), "seed {seed}: {report:?}");
    }
}

#[test]
fn an_order_reads_from_a_number_or_a_word() {
    let read = |text: &str| toml::from_str::<SubspaceOptions>(text).map(|o| o.order);
    assert_eq!(read("order = 'auto'").unwrap(), Order::default());
    assert_eq!(read("order = 9").unwrap(), Order::Fixed(9));
    assert!(read("order = 'automatic'").is_err());
}
