//! Many short records, as lost rows make them of a log.

use super::*;
use crate::Mat;
use crate::lti::{StateSpace, simulate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// 80 stretches of one long record, whose parts of 500 samples each are more than the part on which the order is first chosen: the order is
/// that of the plant, although a mode without damping would have two more parameters in each stretch. Stretches of 6 and 15 samples are left out.
#[test]
fn order_of_many_stretches() {
    let a = Mat::from_fn(2, 2, |i, j| [[0.98, 0.15], [-0.15, 0.98]][i][j]);
    let (b, c) = (Mat::from_fn(2, 1, |i, _| i as f64), Mat::from_fn(1, 2, |_, j| 1.0 - j as f64));
    let time = Discrete::new(1e-3).unwrap();
    let plant = StateSpace::new(a, b, c, Mat::zeros(1, 1), time).unwrap();
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    let mut normal = |size: f64| Mat::from_fn(49_000, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let u = normal(1.0);
    let y = simulate(&plant, u.as_ref(), &[0.0; 2]).unwrap() + normal(0.3);
    let stretch = |first: usize, samples: usize| {
        Experiment::new(u.as_ref().subrows(first, samples), y.as_ref().subrows(first, samples))
    };
    let mut records: Vec<Experiment<'_>> = (0..80).map(|k| stretch(612 * k, 600)).collect();
    let of = |records: &[Experiment<'_>]| recommend(records, &[], None, time, &LikelihoodOptions::default()).unwrap();
    let found = of(&records);
    assert_eq!(found.order, 2, "{:?}", found.modes);
    let (truth, mode) = (plant.modes().unwrap()[0], found.modes[0].mode);
    assert!(
        (mode.hz / truth.hz - 1.0).abs() < 2e-3 && (mode.zeta / truth.zeta - 1.0).abs() < 0.05,
        "{mode:?} {truth:?}"
    );
    records.extend([stretch(48_970, 6), stretch(48_980, 15)]);
    let again = of(&records);
    assert_eq!(again.plant, found.plant);
}
