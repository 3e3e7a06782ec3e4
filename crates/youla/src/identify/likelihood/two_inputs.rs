//! One output that sees coloured noise of several inputs: the ends of their colours drive the same.

use crate::identify::likelihood::{Experiment, LikelihoodOptions, recommend};
use crate::lti::{Discrete, StateSpace, frequency_response, simulate};
use crate::{Mat, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// u and y of 4000 samples: white inputs of unit size beside noise of pole 0.95 and standard deviation 0.32, white noise at the outputs.
fn record(plant: &StateSpace<Discrete>, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut normal =
        |channels: usize, size: f64| Mat::from_fn(4000, channels, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (m, p) = (plant.inputs(), plant.outputs());
    let (u, mut w, e) = (normal(m, 1.0), normal(m, 0.1), normal(p, 0.04));
    for t in 1..w.nrows() {
        (0..m).for_each(|j| w[(t, j)] += 0.95 * w[(t - 1, j)]);
    }
    let y = simulate(plant, (&u + w).as_ref(), &vec![0.0; plant.order()]).unwrap() + e;
    (u, y)
}

/// Of three inputs that drive one state neither the ends of the colours nor the variances can be distinguished.
#[test]
fn the_deviation_of_one_state_with_three_inputs_is_stated() {
    let time = Discrete::new(1.0).unwrap();
    let (b, c) = (Mat::from_fn(1, 3, |_, j| [0.1, 0.2, -0.1][j]), Mat::from_fn(2, 1, |i, _| [1.0, -0.5][i]));
    let plant = StateSpace::new(Mat::from_fn(1, 1, |_, _| 0.9), b, c, Mat::zeros(2, 3), time).unwrap();
    let (u, y) = record(&plant, 5);
    let records = [Experiment::new(u.as_ref(), y.as_ref())];
    let found = recommend(&records, &[], None, time, &LikelihoodOptions::default()).unwrap();
    for absolute in &found.region.absolute {
        assert!(absolute.col_iter().flat_map(|c| c.iter()).all(|v| *v > 1e-6 && *v < 1.0), "{absolute:?}");
    }
}

/// The deviation of a plant of two lags is that of its records, not zero: errors at six frequencies of both inputs in four records have a mean
/// square between a quarter and four of the stated ones (48 errors, about 24 of them independent of each other).
#[test]
fn the_deviation_of_two_inputs_with_coloured_noise_is_stated() {
    let time = Discrete::new(1.0).unwrap();
    let a = Mat::from_fn(2, 2, |i, j| if i == j { [0.97, 0.78][i] } else { 0.0 });
    let b = Mat::from_fn(2, 2, |i, j| [[0.07, 0.01], [0.01, 0.18]][i][j]);
    let plant = StateSpace::new(a, b, Mat::from_fn(1, 2, |_, _| 1.0), Mat::zeros(1, 2), time).unwrap();
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..4 {
        let (u, y) = record(&plant, seed);
        let records = [Experiment::new(u.as_ref(), y.as_ref())];
        let found = recommend(&records, &[], None, time, &LikelihoodOptions::default()).unwrap();
        assert!(found.predictor.a.nrows() > found.plant.order(), "the noise has a colour");
        let hz = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3];
        for hz in hz {
            let at = found.region.hz.iter().position(|f| *f >= hz).unwrap();
            let omega = [std::f64::consts::TAU * found.region.hz[at]];
            let [truth, estimate] =
                [&plant, &found.plant].map(|g| frequency_response(g, &omega).unwrap().at(0).to_owned());
            for input in 0..2 {
                let (error, stated): (c64, f64) =
                    (truth[(0, input)] - estimate[(0, input)], found.region.absolute[at][(0, input)]);
                assert!(stated > 1e-4 && stated < 1.0, "{stated} at {hz} Hz");
                sum += (error.norm() / stated).powi(2);
                count += 1.0;
            }
        }
    }
    assert!((0.25..4.0).contains(&(sum / count)), "{}", sum / count);
}
