//! Many outputs, each with its row of the model for itself.

use super::{Discrete, Experiment, LikelihoodOptions, recommend};
use crate::Mat;
use crate::lti::{StateSpace, frequency_response, simulate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Five lightly damped modes at eight outputs, 40 dB: the order is found, and the error of the response is what the information of the record
/// allows, which the region states.
#[test]
fn a_structure_of_many_outputs_is_found_within_its_region() {
    let (m, p, modes, samples) = (2, 8, 5, 2000);
    let rng = &mut ChaCha8Rng::seed_from_u64(28);
    let mut normal =
        |rows: usize, columns: usize| Mat::from_fn(rows, columns, |_, _| rng.sample::<f64, _>(StandardNormal));
    let (inputs, outputs) = (normal(2 * modes, m), normal(p, 2 * modes));
    let entry = |i: usize, j: usize| {
        let (k, size) = (i / 2, 0.998 - 0.002 * (i / 2) as f64);
        let angle = 0.2 + 0.45 * k as f64;
        match (i / 2 == j / 2, i == j) {
            (false, _) => 0.0,
            (true, true) => size * angle.cos(),
            (true, false) => size * angle.sin() * if i < j { 1.0 } else { -1.0 },
        }
    };
    let time = Discrete::new(1e-3).unwrap();
    let plant = StateSpace::new(Mat::from_fn(10, 10, entry), inputs, outputs, Mat::zeros(p, m), time).unwrap();
    let u = normal(samples, m);
    let clean = simulate(&plant, u.as_ref(), &[0.0; 10]).unwrap();
    let size = clean.norm_l2() / ((samples * p) as f64).sqrt();
    let y = clean + normal(samples, p) * faer::Scale(0.01 * size);
    let found = recommend(&[Experiment::new(u.as_ref(), y.as_ref())], &[], None, time, &LikelihoodOptions::default());
    let found = found.unwrap();
    assert_eq!(found.order, 10, "{:?}", found.candidates);
    let omega: Vec<f64> = found.region.hz.iter().map(|hz| std::f64::consts::TAU * hz).collect();
    let (own, truth) = (frequency_response(&found.plant, &omega).unwrap(), frequency_response(&plant, &omega).unwrap());
    let (mut squares, mut count, mut relative) = (0.0, 0.0, 0.0_f64);
    for (k, stated) in found.region.absolute.iter().enumerate() {
        let difference = own.at(k) - truth.at(k);
        relative = relative.max(difference.norm_l2() / truth.at(k).norm_l2());
        for (i, j) in (0..p).flat_map(|i| (0..m).map(move |j| (i, j))) {
            squares += (difference[(i, j)].norm() / stated[(i, j)]).powi(2);
            count += 1.0;
        }
    }
    let ratio = f64::sqrt(squares / count);
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
    assert!(relative < 0.02, "{relative}");
}
