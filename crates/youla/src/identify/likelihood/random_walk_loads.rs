//! Processes of two inputs and two outputs, each entry a lag of its own, under loads that are random walks: the sizes of noise at the inputs have several
//! minima, and the search for them, made anew at each trial, once refused every step.

use crate::identify::likelihood::{Experiment, LikelihoodOptions, recommend};
use crate::lti::{Discrete, StateSpace, frequency_response};
use crate::{Mat, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SAMPLES: usize = 1600;

/// The plant, u and y in a loop with two PI controllers whose references are random steps: lags of 12 to 90 samples, gains 1 to 3 on the diagonal,
/// loads that move by 0.02 and sensors of 0.01.
fn record(seed: u64) -> (StateSpace<Discrete>, Mat<f64>, Mat<f64>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut within = |low: f64, high: f64| rng.random_range(low..high);
    let lags = [within(63.0, 99.0), within(15.0, 40.0), within(10.0, 30.0), within(50.0, 90.0)];
    let gains = [within(1.0, 3.0), within(-0.8, 0.8), within(-0.8, 0.8), within(1.0, 3.0)];
    let kp = [within(1.0, 4.0) / gains[0], within(1.0, 4.0) / gains[3]];
    let pole = |k: usize| (-1.0 / lags[k]).exp();
    // State 2 i + j is that of entry (i, j).
    let b = Mat::from_fn(4, 2, |k, j| if k % 2 == j { gains[k] * (1.0 - pole(k)) } else { 0.0 });
    let c = Mat::from_fn(2, 4, |i, k| f64::from(k / 2 == i));
    let a = Mat::from_fn(4, 4, |k, l| if k == l { pole(k) } else { 0.0 });
    let (mut x, mut load, mut sum, mut reference) =
        (Mat::<f64>::zeros(4, 1), Mat::<f64>::zeros(2, 1), [0.0; 2], [1.0; 2]);
    let (mut u, mut y) = (Mat::zeros(SAMPLES, 2), Mat::zeros(SAMPLES, 2));
    for t in 0..SAMPLES {
        let seen = &c * &x;
        for i in 0..2 {
            if rng.random::<f64>() < 0.04 {
                reference[i] = if rng.random::<bool>() { 1.0 } else { -1.0 };
            }
            y[(t, i)] = seen[(i, 0)] + 0.01 * rng.sample::<f64, _>(StandardNormal);
            let error = reference[i] - y[(t, i)];
            sum[i] += kp[i] * error / [30.0, 25.0][i];
            u[(t, i)] = kp[i] * error + sum[i];
            load[(i, 0)] += 0.02 * rng.sample::<f64, _>(StandardNormal);
        }
        x = &a * &x + &b * (u.row(t).transpose().as_mat() + &load);
    }
    (StateSpace::new(a, b, c, Mat::zeros(2, 2), Discrete::new(1.0).unwrap()).unwrap(), u, y)
}

/// Errors from one period of the record to a twentieth of the sample rate, in eight records: their root mean square over all is between half and 1.7
/// of the stated deviation, and below 3 in each.
#[test]
fn the_deviation_of_lags_under_random_walks_is_stated() {
    let mut all = Vec::new();
    for seed in 0..8 {
        let (plant, u, y) = record(seed);
        let records = [Experiment::new(u.as_ref(), y.as_ref())];
        let found = recommend(&records, &[], None, plant.time(), &LikelihoodOptions::default()).unwrap();
        let places: Vec<usize> = (0..found.region.hz.len()).filter(|k| found.region.hz[*k] < 0.05).collect();
        let omega: Vec<f64> = places.iter().map(|k| std::f64::consts::TAU * found.region.hz[*k]).collect();
        let [truth, estimate] = [&plant, &found.plant].map(|g| frequency_response(g, &omega).unwrap());
        let square = |(at, k): (usize, &usize), entry: usize| {
            let (i, j) = (entry / 2, entry % 2);
            let error: c64 = truth.at(at)[(i, j)] - estimate.at(at)[(i, j)];
            (error.norm() / found.region.absolute[*k][(i, j)]).powi(2)
        };
        let squares = places.iter().enumerate().flat_map(|place| (0..4).map(move |entry| (place, entry)));
        let squares: Vec<f64> = squares.map(|(place, entry)| square(place, entry)).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        assert!(mean < 9.0, "seed {seed}: {mean}, order {}", found.order);
        all.push(mean);
    }
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    assert!((0.25..3.0).contains(&mean), "{all:?}");
}
