//! Tables and lines of known plants.

use super::{MeasuredResponse, ResponseTable, ResponseVariance, recommend_from_response};
use crate::control::{LqrWeights, NoiseCovariance, kalman, lqr, observer_controller};
use crate::fixtures::bearing;
use crate::identify::likelihood::{Experiment, LikelihoodOptions, ModeEstimate, Recommendation, recommend};
use crate::lti::{Discrete, StateSpace, frequency_response};
use crate::signal::{PeriodicExperiment, line_response};
use crate::{Mat, c64};
use faer::linalg::solvers::DenseSolveCore;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

const TS: f64 = 1e-3;

fn time() -> Discrete {
    Discrete::new(TS).unwrap()
}

/// Two modes, 20 and 55 Hz with dampings 0.05 and 0.02, two inputs and outputs of which `channels` are used.
fn plant(channels: usize) -> StateSpace<Discrete> {
    let modes = [(20.0, 0.05), (55.0, 0.02)];
    let mut a = Mat::zeros(4, 4);
    for (k, (hz, zeta)) in modes.into_iter().enumerate() {
        let w = TAU * hz * TS;
        let pole = c64::cis(w * f64::sqrt(1.0 - zeta * zeta)) * (-zeta * w).exp();
        let at = 2 * k;
        (a[(at, at)], a[(at, at + 1)], a[(at + 1, at)], a[(at + 1, at + 1)]) = (pole.re, -pole.im, pole.im, pole.re);
    }
    let b = Mat::from_fn(4, channels, |i, j| [[1.0, 0.2], [0.0, 0.4], [0.5, -0.6], [0.1, 0.3]][i][j]);
    let c = Mat::from_fn(channels, 4, |i, j| [[0.1, 0.05, 0.2, 0.0], [0.02, 0.1, -0.1, 0.15]][i][j]);
    StateSpace::new(a, b, c, Mat::zeros(channels, channels), time()).unwrap()
}

fn normal(rng: &mut ChaCha8Rng) -> c64 {
    let mut one = || rng.sample::<f64, _>(StandardNormal) / 2.0_f64.sqrt();
    c64::new(one(), one())
}

/// 120 frequencies from 2 to 300 Hz, logarithmic, with an error of `relative` of each entry.
fn table(channels: usize, relative: f64, seed: u64) -> ResponseTable {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let omega: Vec<f64> = (0..120).map(|k| TAU * 2.0 * 150.0_f64.powf(f64::from(k) / 119.0)).collect();
    let exact = frequency_response(&plant(channels), &omega).unwrap();
    let variance: Vec<_> =
        exact.iter().map(|g| Mat::from_fn(channels, channels, |i, j| (relative * g[(i, j)].norm()).powi(2))).collect();
    let values = exact
        .iter()
        .zip(&variance)
        .map(|(g, v)| Mat::from_fn(channels, channels, |i, j| g[(i, j)] + normal(&mut rng) * v[(i, j)].sqrt()))
        .collect();
    ResponseTable { omega, values, variance: ResponseVariance::Known(variance) }
}

fn found(table: &ResponseTable) -> Recommendation {
    let response = MeasuredResponse::of_plant(table, time()).unwrap();
    recommend_from_response(&response, None, &LikelihoodOptions::default()).unwrap()
}

/// Squared errors of frequency and damping of both modes over their stated variances.
fn errors(found: &Recommendation) -> Vec<f64> {
    let of = |(hz, zeta): (f64, f64)| {
        let near = |m: &&ModeEstimate| (m.mode.hz / hz).ln().abs();
        let mode = found.modes.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
        [((mode.mode.hz - hz) / mode.hz_deviation).powi(2), ((mode.mode.zeta - zeta) / mode.zeta_deviation).powi(2)]
    };
    [(20.0, 0.05), (55.0, 0.02)].into_iter().flat_map(of).collect()
}

/// 6 tables, 24 figures with the variance that is stated: chi-square with 24 degrees of freedom has the deviation 7.
#[test]
fn modes_of_a_table_have_their_stated_deviations() {
    for (channels, stated) in [(1, true), (2, true), (1, false)] {
        let (mut sum, mut orders) = (0.0, Vec::new());
        for seed in 0..6 {
            let mut table = table(channels, 0.02, seed);
            if !stated {
                table.variance = ResponseVariance::Unknown;
            }
            let found = found(&table);
            assert!(found.trusted(), "{channels} {seed} {:?}", found.reasons());
            orders.push(found.order);
            sum += errors(&found).iter().sum::<f64>();
        }
        let right = orders.iter().filter(|o| **o == 4).count();
        println!("{channels} channels, variance {stated}: {:.2}, order 4 in {right} of 6", sum / 24.0);
        assert!(right >= 5, "{orders:?}");
        assert!((6.0..55.0).contains(&sum), "{sum}");
    }
}

/// `x+ = 1.05 x + u`, `y = x + coloured noise`, `u = -0.6 y + d`: d a multisine, 20 periods of 250 samples.
fn unstable_loop(seed: u64) -> [Mat<f64>; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let phases: Vec<f64> = (0..60).map(|_| TAU * rng.random::<f64>()).collect();
    let sine = |t: usize, l: usize| (TAU * (l + 1) as f64 * t as f64 / 250.0 + phases[l]).cos();
    let d = Mat::from_fn(5000, 1, |t, _| 0.3 * (0..60).map(|l| sine(t % 250, l)).sum::<f64>());
    let (mut x, mut v) = (0.0, 0.0);
    let (mut u, mut y) = (Mat::zeros(5000, 1), Mat::zeros(5000, 1));
    for t in 0..5500 {
        v = 0.8 * v + 0.3 * rng.sample::<f64, _>(StandardNormal);
        let now = -0.6 * (x + v) + d[(t % 250, 0)];
        if t >= 500 {
            (u[(t - 500, 0)], y[(t - 500, 0)]) = (now, x + v);
        }
        x = 1.05 * x + now;
    }
    [d, u, y]
}

/// In closed loop, with an unstable plant: stated deviations hold, and the search over all samples finds the same.
#[test]
fn lines_of_a_loop_give_what_all_samples_give() {
    let (mut of_truth, mut between) = (0.0, 0.0f64);
    for seed in 0..6 {
        let [d, u, y] = unstable_loop(seed);
        let z = Mat::from_fn(5000, 2, |t, k| if k == 0 { u[(t, 0)] } else { y[(t, 0)] });
        let closed = line_response(&[PeriodicExperiment { d: d.as_ref(), z: z.as_ref() }], time()).unwrap();
        let response = MeasuredResponse::of_loop_lines(&closed, time()).unwrap();
        let found = recommend_from_response(&response, None, &LikelihoodOptions::default()).unwrap();
        assert!(found.trusted() && found.order == 1, "{seed} {} {:?}", found.order, found.reasons());
        let options = LikelihoodOptions { order: Some(1), dead_time: Some(vec![0]), ..Default::default() };
        let samples = recommend(&[Experiment::new(u.as_ref(), y.as_ref())], &[], None, time(), &options).unwrap();
        let (one, all) = (&found.modes[0], &samples.modes[0]);
        of_truth += ((one.mode.pole.re - 1.05) / one.magnitude_deviation).powi(2);
        between = between.max(((one.mode.pole.re - all.mode.pole.re) / one.magnitude_deviation).abs());
    }
    // The samples tell a little more: the noise that the controller feeds back moves the plant as well.
    assert!((0.5..18.0).contains(&of_truth) && between < 1.2, "{of_truth} {between}");
}

#[test]
fn a_table_that_cannot_be_used_is_refused_with_its_place() {
    let says = |change: &dyn Fn(&mut ResponseTable), part: &str| {
        let mut table = table(1, 0.02, 1);
        change(&mut table);
        let response = MeasuredResponse::of_plant(&table, time());
        let message = response.and_then(|r| recommend_from_response(&r, None, &LikelihoodOptions::default()));
        let message = message.unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    says(
        &|t| t.omega[119] = TAU * 501.0,
        "frequency 120 of the response, in Hz is 501, but must be at most half the sample rate",
    );
    says(&|t| t.omega[3] = t.omega[2], "must be above the frequency before it");
    says(&|t| t.values[7][(0, 0)].re = f64::NAN, "the response at 2.68");
    let negative = vec![Mat::from_fn(1, 1, |_, _| -1e-3); 120];
    says(&|t| t.variance = ResponseVariance::Known(negative.clone()), "the response at 2 Hz: its variance is -0.001");
    says(&|t| t.values.truncate(3), "the number of values of the response is 3, but must be 120");
    says(
        &|t| {
            t.omega.truncate(4);
            t.values.truncate(4);
            t.variance = ResponseVariance::Unknown;
        },
        "the frequencies of the response: 4 samples are too few, at least 5",
    );
}

/// From d to y of the same loop: the pole is 1.05 - 0.6.
#[test]
fn lines_from_an_excitation_give_the_system_behind_it() {
    let mut sum = 0.0;
    for seed in 0..6 {
        let [d, _, y] = unstable_loop(seed);
        let closed = line_response(&[PeriodicExperiment { d: d.as_ref(), z: y.as_ref() }], time()).unwrap();
        let response = MeasuredResponse::of_system_lines(&closed, time());
        let found = recommend_from_response(&response, None, &LikelihoodOptions::default()).unwrap();
        assert!(found.trusted() && found.order == 1, "{seed} {} {:?}", found.order, found.reasons());
        sum += ((found.modes[0].mode.pole.re - 0.45) / found.modes[0].magnitude_deviation).powi(2);
    }
    assert!((0.5..18.0).contains(&sum), "{sum}");
}

/// The table of a loop, errors of 1 % of each entry and none stated: errors of u count as those of y do.
#[test]
fn a_table_of_a_loop_without_variances_gives_its_plant() {
    let gain = StateSpace::new(
        Mat::zeros(0, 0),
        Mat::zeros(0, 2),
        Mat::zeros(2, 0),
        Mat::from_fn(2, 2, |i, j| [[-0.3, 0.1], [0.05, -0.4]][i][j]),
        time(),
    )
    .unwrap();
    let mut sum = 0.0;
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let exact = table(2, 0.0, 0);
        let of_loop = |g: &Mat<c64>| {
            let k = Mat::from_fn(2, 2, |i, j| c64::new(gain.d()[(i, j)], 0.0));
            let inverse = (Mat::<c64>::identity(2, 2) - &k * g).partial_piv_lu().inverse();
            Mat::from_fn(4, 2, |i, j| if i < 2 { inverse[(i, j)] } else { (g * &inverse)[(i - 2, j)] })
        };
        let mut noisy = |t: Mat<c64>| Mat::from_fn(4, 2, |i, j| t[(i, j)] * (1.0 + 0.01 * normal(&mut rng)));
        let values = exact.values.iter().map(|g| noisy(of_loop(g))).collect();
        let table = ResponseTable { values, variance: ResponseVariance::Unknown, ..exact };
        let response = MeasuredResponse::of_loop(&table, time()).unwrap();
        let found = recommend_from_response(&response, Some(&gain), &LikelihoodOptions::default()).unwrap();
        assert!(found.trusted() && found.order == 4, "{seed} {} {:?}", found.order, found.reasons());
        sum += errors(&found).iter().sum::<f64>();
        let wrong = gain.in_units(&[1.0, 1.0], &[-0.05, -0.05]);
        let found = recommend_from_response(&response, Some(&wrong), &LikelihoodOptions::default()).unwrap();
        assert!(found.reasons().iter().any(|r| r.contains("stated controller")), "{:?}", found.reasons());
    }
    assert!((3.0..42.0).contains(&sum), "{sum}");
}

/// 200 closed-loop points alone, errors of 2 % of each entry stated, over 300 runs:
/// `cargo test --workspace --lib the_bearing -- --ignored --nocapture`.
#[test]
#[ignore = "300 runs"]
fn modes_of_the_bearing_are_within_their_deviations() {
    let time = Discrete::new(2e-4).unwrap();
    let plant = bearing().zoh(time).unwrap();
    let square = |size: usize, value: f64| Mat::from_fn(size, size, |i, j| if i == j { value } else { 0.0 });
    let weights = LqrWeights { q: plant.c().transpose() * plant.c(), r: square(2, 20.0), s: None };
    let noise =
        NoiseCovariance { process: plant.b() * plant.b().transpose(), measurement: square(2, 1.0), cross: None };
    let (f, l) = (lqr(&plant, &weights).unwrap().f, kalman(&plant, &noise).unwrap().l);
    let controller = observer_controller(&plant, f.as_ref(), l.as_ref()).unwrap();
    let omega: Vec<f64> = (0..200).map(|k| TAU * 20.0 * 60.0_f64.powf(f64::from(k) / 199.0)).collect();
    let (g, k) = (frequency_response(&plant, &omega).unwrap(), frequency_response(&controller, &omega).unwrap());
    let exact: Vec<Mat<c64>> = (0..omega.len())
        .map(|at| {
            let inverse = (Mat::<c64>::identity(2, 2) - k.at(at) * g.at(at)).partial_piv_lu().inverse();
            Mat::from_fn(4, 2, |i, j| if i < 2 { inverse[(i, j)] } else { (g.at(at) * &inverse)[(i - 2, j)] })
        })
        .collect();
    let modes: Vec<_> = plant.modes().unwrap().into_iter().filter(|m| m.pole.im != 0.0).collect();
    let (mut within, mut orders, mut trusted) = ([[0usize; 2]; 2], std::collections::BTreeMap::new(), 0);
    for seed in 0..300 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let size = |t: &Mat<c64>| Mat::from_fn(4, 2, |i, j| 0.02 * t[(i, j)].norm());
        let squared = |t: &Mat<c64>| Mat::from_fn(4, 2, |i, j| size(t)[(i, j)].powi(2));
        let variance = exact.iter().map(squared).collect();
        let values = exact.iter().map(|t| Mat::from_fn(4, 2, |i, j| t[(i, j)] + normal(&mut rng) * size(t)[(i, j)]));
        let values = values.collect();
        let table = ResponseTable { omega: omega.clone(), values, variance: ResponseVariance::Known(variance) };
        let response = MeasuredResponse::of_loop(&table, time).unwrap();
        let found = recommend_from_response(&response, Some(&controller), &LikelihoodOptions::default()).unwrap();
        *orders.entry(found.order).or_insert(0) += 1;
        trusted += usize::from(found.trusted());
        for (mode, within) in modes.iter().zip(&mut within) {
            let near = |m: &&ModeEstimate| (m.mode.pole - mode.pole).norm();
            let nearest = found.modes.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            within[0] += usize::from((nearest.mode.hz - mode.hz).abs() <= 2.0 * nearest.hz_deviation);
            within[1] += usize::from((nearest.mode.zeta - mode.zeta).abs() <= 2.0 * nearest.zeta_deviation);
        }
    }
    let names: Vec<_> = modes.iter().map(|m| (m.hz, m.zeta)).collect();
    println!("modes {names:?}: within two deviations {within:?} of 300, orders {orders:?}, trusted {trusted}");
    assert!(within.iter().flatten().all(|count| (270..=294).contains(count)), "{within:?}");
}
