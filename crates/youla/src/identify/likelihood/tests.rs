//! Identities of the search, and seeded statistics of what it states.

use super::*;
use crate::control::{closed_loop, with_input_port};
use crate::identify::likelihood::choose::problem::Choice;
use crate::identify::likelihood::data::spectra::{Sizes, Spectra};
use crate::identify::likelihood::deviation::{inverse_root, physical};
use crate::identify::likelihood::search::autoregression::Regression;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::linearise::linearise;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::{Point, energy, reblocked};
use crate::identify::likelihood::search::{Found, deviance, with_best_ends, with_best_inputs};
use crate::linalg::eye;
use crate::lti::{StateSpace, frequency_response, simulate};
use crate::{Mat, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

mod draws;

fn time() -> Discrete {
    Discrete::new(1e-3).unwrap()
}

fn matrix<const R: usize, const C: usize>(rows: [[f64; C]; R]) -> Mat<f64> {
    Mat::from_fn(R, C, |i, j| rows[i][j])
}

fn normal(rng: &mut ChaCha8Rng, samples: usize, channels: usize, size: f64) -> Mat<f64> {
    Mat::from_fn(samples, channels, |_, _| size * rng.sample::<f64, _>(StandardNormal))
}

/// A light mode and a real pole, two inputs, one output.
fn machine() -> StateSpace<Discrete> {
    let a = matrix([[0.95, 0.2, 0.0], [-0.2, 0.95, 0.0], [0.0, 0.0, 0.7]]);
    let b = matrix([[0.0, 0.3], [1.0, -0.2], [0.4, 1.0]]);
    StateSpace::new(a, b, matrix([[1.0, 0.1, 0.5]]), Mat::zeros(1, 2), time()).unwrap()
}

/// u and y of a system in open loop under white noise.
fn record(system: &StateSpace<Discrete>, samples: usize, noise: f64, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let u = normal(rng, samples, system.inputs(), 1.0);
    let y = simulate(system, u.as_ref(), &vec![0.0; system.order()]).unwrap();
    (u, y + normal(rng, samples, system.outputs(), noise))
}

fn blocks_of(system: &StateSpace<Discrete>) -> Model {
    let (p, m) = (system.outputs(), system.inputs());
    let d = (0..p * m).map(|x| system.d()[(x / m, x % m)]).collect();
    Model::of(system.a(), system.b(), system.c(), d).unwrap()
}

fn unscaled(u: &Mat<f64>, y: &Mat<f64>, delays: &[usize], skip: usize) -> Spectra {
    let sizes = Sizes { u: vec![1.0; u.ncols()], y: vec![1.0; y.ncols()] };
    Spectra::new(&[Experiment::new(u.as_ref(), y.as_ref())], &sizes, delays, skip)
}

#[test]
fn the_ends_of_a_record_stand_for_all_that_a_window_would_have_to() {
    let (u, y) = record(&machine(), 501, 0.0, 1);
    let spectra = unscaled(&u, &y, &[0, 0], 0);
    let point = with_best_ends(&spectra, blocks_of(&machine()), &Noise::white(1));
    let left = point.residuals(&spectra)[0].iter().map(|v| v.norm()).fold(0.0, f64::max);
    assert!(left < 1e-11, "{left:.1e}");
}

#[test]
fn the_gradient_is_that_of_differences() {
    let (u, y) = record(&machine(), 400, 0.3, 2);
    let spectra = unscaled(&u, &y, &[0, 0], 0);
    let mut noise = Noise::white(1);
    noise.regression = vec![Regression { coefficients: vec![-0.6, 0.2], ..Regression::default() }];
    let mut model = blocks_of(&machine());
    model.blocks.iter_mut().for_each(|b| b.a.iter_mut().for_each(|a| *a *= 0.99));
    let chart = Chart::new(&model, true);
    let value = |model: &Model| {
        let point = with_best_ends(&spectra, model.clone(), &noise);
        energy(&spectra, &point.residuals(&spectra), &noise)
    };
    let factor = linearise(&spectra, &with_best_ends(&spectra, model.clone(), &noise), &chart, &noise).factor;
    let count = chart.parameters();
    assert_eq!(count, 3 * (2 + 1) + 2, "n (m + p) + m p");
    for j in 0..count {
        let step = |h: f64| (0..count).map(|k| if k == j { h } else { 0.0 }).collect::<Vec<f64>>();
        let h = 1e-5;
        let slope = (value(&chart.moved(&model, &step(h))) - value(&chart.moved(&model, &step(-h)))) / (2.0 * h);
        // the columns are slopes of the output, the residual falls with them
        let own: f64 = -2.0 * (0..factor.nrows()).map(|i| factor[(i, j)] * factor[(i, count)]).sum::<f64>();
        assert!((slope - own).abs() < 1e-5 * own.abs().max(1.0), "parameter {j}: {slope} and {own}");
    }
}

#[test]
fn the_likelihood_of_an_autoregression_is_that_of_its_innovations() {
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    let samples = 20000;
    let e = normal(rng, samples, 1, 0.5);
    let mut y = Mat::<f64>::zeros(samples, 1);
    for t in 0..samples {
        let before = |k: usize| if t >= k { y[(t - k, 0)] } else { 0.0 };
        y[(t, 0)] = 1.5 * before(1) - 0.8 * before(2) + e[(t, 0)];
    }
    let spectra = unscaled(&normal(rng, samples, 1, 1.0), &y, &[0], 0);
    let empty =
        Point { model: Model { inputs: 1, outputs: 1, blocks: Vec::new(), d: vec![0.0] }, ends: vec![vec![0.0]] };
    let (value, noise) = deviance(&spectra, &empty, 12);
    // Schwarz's criterion finds the order, the coefficients have deviations sqrt((1 - 0.8^2) / N) = 0.0042
    assert_eq!(noise.regression[0].coefficients.len(), 2);
    assert!(
        (noise.regression[0].coefficients[0] + 1.5).abs() < 0.015
            && (noise.regression[0].coefficients[1] - 0.8).abs() < 0.015
    );
    let expected = samples as f64 * 0.25_f64.ln();
    assert!((value - expected).abs() < 4.0 * (2.0 * samples as f64).sqrt(), "{value} and {expected}");
}

#[test]
fn a_random_walk_below_white_noise_takes_a_slow_pole_and_a_zero() {
    let rng = &mut ChaCha8Rng::seed_from_u64(5);
    let samples = 20000;
    let (white, steps) = (normal(rng, samples, 1, 1.0), normal(rng, samples, 1, 0.02));
    let mut walk = 0.0;
    let y = Mat::from_fn(samples, 1, |t, _| {
        walk += steps[(t, 0)];
        walk + white[(t, 0)]
    });
    let spectra = unscaled(&normal(rng, samples, 1, 1.0), &y, &[0], 0);
    let empty =
        Point { model: Model { inputs: 1, outputs: 1, blocks: Vec::new(), d: vec![0.0] }, ends: vec![vec![0.0]] };
    let ended = with_best_ends(&spectra, empty.model, &Noise::white(1));
    let (value, noise) = deviance(&spectra, &ended, 12);
    // the sum is (1 - b/z) e / (1 - 1/z) with (1 - b)^2 / b = 0.02^2, so b = 0.98 and the variance of e is 1 / b
    let Regression { coefficients, zero, .. } = &noise.regression[0];
    assert!(
        (zero - 0.98).abs() < 0.011 && (1.0 + coefficients.iter().sum::<f64>()).abs() < 0.01,
        "{coefficients:?}, {zero}"
    );
    let expected = samples as f64 * (1.0 / 0.98_f64).ln();
    assert!((value - expected).abs() < 4.0 * (2.0 * samples as f64).sqrt(), "{value} and {expected}");
}

#[test]
fn dead_time_becomes_states_at_zero() {
    let plant = StateSpace::new(
        machine().a().to_owned(),
        machine().b().to_owned(),
        machine().c().to_owned(),
        matrix([[0.0, 0.7]]),
        time(),
    )
    .unwrap();
    let model = blocks_of(&plant);
    let point = Point { model, ends: Vec::new() };
    let found = Found {
        point,
        noise: Noise::white(1),
        deviance: 0.0,
        parameters: 0,
        steps: 0,
        given_up: false,
        feedthrough: true,
    };
    let choice = Choice { found, delays: vec![0, 3], criterion: 0.0, origin: String::new() };
    let sizes = Sizes { u: vec![2.0, 0.5], y: vec![3.0] };
    let delayed = physical::plant(&choice, &sizes, time()).unwrap();
    assert_eq!(delayed.order(), 6);
    for omega in [3.0, 200.0, 1500.0] {
        let z = c64::cis(omega * 1e-3);
        let (g, d) = (frequency_response(&plant, &[omega]).unwrap(), frequency_response(&delayed, &[omega]).unwrap());
        for j in 0..2 {
            let expected = g.at(0)[(0, j)] * 3.0 / sizes.u[j] * z.conj().powu([0, 3][j]);
            assert!((d.at(0)[(0, j)] - expected).norm() < 1e-11 * expected.norm());
        }
    }
}

#[test]
fn states_are_a_matter_of_choice() {
    let (u, y) = record(&machine(), 600, 0.2, 4);
    let spectra = unscaled(&u, &y, &[0, 0], 0);
    let t = matrix([[1.0, 2.0, -0.5], [0.1, -1.0, 3.0], [0.7, 0.2, 5.0]]);
    let back = crate::linalg::solve("T", t.as_ref(), eye(3).as_ref()).unwrap();
    let (a, b, c) = (machine().a().to_owned(), machine().b().to_owned(), machine().c().to_owned());
    let other = StateSpace::new(&back * a * &t, &back * b, c * &t, Mat::zeros(1, 2), time()).unwrap();
    let figures = |system: &StateSpace<Discrete>| {
        let point = reblocked(&with_best_ends(&spectra, blocks_of(system), &Noise::white(1))).unwrap();
        let (value, noise) = deviance(&spectra, &point, 12);
        let chart = Chart::new(&point.model, false);
        let root = inverse_root(&linearise(&spectra, &point, &chart, &noise).factor, chart.parameters());
        let spread = chart.response_slopes(&point.model, c64::cis(0.2))
            * Mat::from_fn(root.nrows(), root.ncols(), |i, j| c64::new(root[(i, j)], 0.0));
        [value, spread.row(0).norm_l2(), spread.row(1).norm_l2()]
    };
    for (one, two) in figures(&machine()).into_iter().zip(figures(&other)) {
        assert!((one - two).abs() < 1e-7 * one.abs(), "{one} and {two}");
    }
}

#[test]
fn inputs_by_least_squares_are_exact_without_noise() {
    let (u, y) = record(&machine(), 300, 0.0, 5);
    let spectra = unscaled(&u, &y, &[0, 0], 0);
    let mut start = blocks_of(&machine());
    start.blocks.iter_mut().for_each(|b| b.b.iter_mut().for_each(|v| *v = 0.1));
    let point = with_best_inputs(&spectra, start, &Noise::white(1), false);
    let z = c64::cis(0.3);
    for (found, expected) in point.model.response(z).iter().zip(blocks_of(&machine()).response(z)) {
        assert!((found - expected).norm() < 1e-9);
    }
}

/// 30 records of 800 samples: the scatter of the estimates is what each of them states. With 30 x 5 figures, of which 5 hang
/// together, the ratio has a standard deviation of about 0.13.
#[test]
fn stated_deviations_are_those_of_the_scatter_over_seeds() {
    let plant = StateSpace::new(matrix([[0.9]]), matrix([[1.0]]), matrix([[1.0]]), Mat::zeros(1, 1), time()).unwrap();
    let (mut errors, mut stated) = (0.0, 0.0);
    for seed in 0..30 {
        let (u, y) = record(&plant, 800, 1.0, 100 + seed);
        let options = LikelihoodOptions { order: Some(1), dead_time: Some(vec![0]), ..Default::default() };
        let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
        let found = recommend(&experiments, &[], None, time(), &options).unwrap();
        let deviation = &found.region;
        for k in (10..140).step_by(30) {
            let omega = [std::f64::consts::TAU * deviation.hz[k]];
            let of = |system: &StateSpace<Discrete>| frequency_response(system, &omega).unwrap().at(0)[(0, 0)];
            let scale = of(&plant).norm_sqr();
            errors += (of(&found.plant) - of(&plant)).norm_sqr() / scale;
            stated += deviation.absolute[k][(0, 0)].powi(2) / scale;
        }
    }
    let ratio = (errors / stated).sqrt();
    assert!((0.65..1.45).contains(&ratio), "{ratio}");
}

/// An unstable plant under a proportional controller: `u = K y + d`.
fn unstable_loop(seed: u64) -> (StateSpace<Discrete>, [Mat<f64>; 3]) {
    let plant = StateSpace::new(matrix([[1.05]]), matrix([[1.0]]), matrix([[1.0]]), Mat::zeros(1, 1), time()).unwrap();
    let k = StateSpace::gain(matrix([[-0.4]]), time()).unwrap();
    let rig = closed_loop(&plant, &with_input_port(&k).unwrap()).unwrap();
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let (d, n) = (normal(rng, 4000, 1, 1.0), normal(rng, 4000, 1, 0.3));
    let log = simulate(&rig, crate::linalg::block(&[&[d.as_ref(), n.as_ref()]]).as_ref(), &[0.0]).unwrap();
    (k, [log.subcols(0, 1).to_owned(), log.subcols(1, 1).to_owned(), d])
}

#[test]
fn poles_outside_the_unit_circle_are_found_outside() {
    let (k, [u, y, d]) = unstable_loop(7);
    let own = &u - &d;
    let (applied, excitation) = (u.as_ref(), Some(d.as_ref()));
    let signals = LoopSignals { seen: y.as_ref(), explained: own.as_ref(), applied, excitation };
    let known = LoopKnowledge::new(Some(&k), Some(&k), vec![signals], Vec::new()).unwrap();
    let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
    let found = recommend(&experiments, &[], Some(&known), time(), &LikelihoodOptions::default()).unwrap();
    assert_eq!((found.order, found.dead_time.as_slice()), (1, &[0][..]));
    assert!(found.trusted(), "{:?}", found.reasons());
    let mode = found.modes[0];
    assert!((mode.mode.pole.re - 1.05).abs() < 3.0 * mode.magnitude_deviation, "{mode:?}");
    let w = &found.predictor;
    let gain = w.k.as_ref().unwrap();
    let error = StateSpace::new(&w.a - gain * &w.c, w.b.clone(), w.c.clone(), w.d.clone(), time()).unwrap();
    assert!(error.is_stable().unwrap());
    // the innovations of white output noise grow by the unstable pole: Lambda = 1.05^2 sigma^2 for a predictor, sigma^2 for the lines
    assert!((w.covariance[(0, 0)].sqrt() - 0.3).abs() < 0.03);
}

#[test]
fn a_controller_that_did_not_run_costs_the_trust() {
    let (_, [u, y, d]) = unstable_loop(8);
    let wrong = StateSpace::gain(matrix([[-0.5]]), time()).unwrap();
    let own = &u - &d;
    let (applied, excitation) = (u.as_ref(), Some(d.as_ref()));
    let signals = LoopSignals { seen: y.as_ref(), explained: own.as_ref(), applied, excitation };
    let known = LoopKnowledge::new(Some(&wrong), Some(&wrong), vec![signals], Vec::new()).unwrap();
    let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
    let found = recommend(&experiments, &[], Some(&known), time(), &LikelihoodOptions::default()).unwrap();
    assert!(!found.trusted());
    assert!(found.reasons()[0].contains("stated controller"), "{:?}", found.reasons());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (u, y) = record(&machine(), 1500, 0.2, 9);
    let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| recommend(&experiments, &[], None, time(), &LikelihoodOptions::default()).unwrap())
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.plant, three.plant);
    assert_eq!(one.candidates, three.candidates);
    assert_eq!(one.region.absolute, three.region.absolute);
}

#[test]
fn what_cannot_be_identified_is_refused_with_evidence() {
    let (u, y) = record(&machine(), 600, 0.2, 10);
    let options = LikelihoodOptions::default();
    let of = |u: &Mat<f64>, y: &Mat<f64>, options: &LikelihoodOptions| {
        recommend(&[Experiment::new(u.as_ref(), y.as_ref())], &[], None, time(), options).unwrap_err()
    };
    let still = Mat::from_fn(600, 2, |i, j| if j == 0 { u[(i, 0)] } else { 0.25 });
    assert!(matches!(of(&still, &y, &options), Error::ConstantChannel { what, value: 0.25 } if what == "input 2"));
    let mut broken = y.clone();
    broken[(4, 0)] = f64::NAN;
    assert!(matches!(of(&u, &broken, &options), Error::NotFinite { row: 5, column: 1, .. }));
    let short = |m: &Mat<f64>| m.subrows(0, 60).to_owned();
    assert!(matches!(of(&short(&u), &short(&y), &options), Error::TooFewSamples { found: 60, .. }));
    let two = LikelihoodOptions { dead_time: Some(vec![1]), ..Default::default() };
    assert!(matches!(of(&u, &y, &two), Error::Ports { expected: 2, found: 1, .. }));
    let none = LikelihoodOptions { order: Some(0), ..Default::default() };
    assert!(matches!(of(&u, &y, &none), Error::OutOfRange { .. }));
}

#[test]
fn what_is_given_is_kept() {
    let (u, y) = record(&machine(), 1500, 0.2, 11);
    let options = LikelihoodOptions { order: Some(4), dead_time: Some(vec![0, 0]), ..Default::default() };
    let found = recommend(&[Experiment::new(u.as_ref(), y.as_ref())], &[], None, time(), &options).unwrap();
    assert_eq!((found.order, found.plant.order()), (4, 4));
    assert!(found.candidates.iter().all(|c| c.order == 4 && c.dead_time == [0, 0]));
}

/// Two light modes behind three samples of dead time under a multisine of a tenth of the band, 10 dB. With order and
/// dead time given, the regressions alone end in a local minimum 20 % off.
#[test]
fn light_modes_behind_a_dead_time_are_found_with_and_without_their_order() {
    let mode = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
    let ([c1, s1], [c2, s2]) = (mode(0.9935, 0.0678), mode(0.9955, 0.0976));
    let a = matrix([[c1, s1, 0.0, 0.0], [-s1, c1, 0.0, 0.0], [0.0, 0.0, c2, s2], [0.0, 0.0, -s2, c2]]);
    let b = matrix([[0.0004], [0.0124], [0.0009], [0.0179]]);
    let truth = StateSpace::new(a, b, matrix([[1.0, 0.0, 0.5, 0.0]]), Mat::zeros(1, 1), time()).unwrap();
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    let phases: Vec<f64> = (0..200).map(|_| rng.random::<f64>() * std::f64::consts::TAU).collect();
    let line = |t: usize, k: usize| (std::f64::consts::TAU * ((k + 1) * t) as f64 / 4000.0 + phases[k]).cos();
    let d = Mat::from_fn(8000, 1, |t, _| (0..200).map(|k| line(t, k)).sum::<f64>());
    // The loop of the plant with its dead time: u = d - K y, K = 1.91 - 3.63/z + 1.73/z^2 over 1 - 1.766/z + 0.766/z^2.
    let (n, den) = ([1.9118, -3.6269, 1.7340], [1.7662, -0.7662]);
    let k = StateSpace::new(
        matrix([[den[0], den[1]], [1.0, 0.0]]),
        matrix([[1.0], [0.0]]),
        matrix([[-n[1] - n[0] * den[0], -n[2] - n[0] * den[1]]]),
        matrix([[-n[0]]]),
        time(),
    )
    .unwrap();
    let late = physical::delayed(&truth, &[3]).unwrap();
    let rig = closed_loop(&late, &with_input_port(&k).unwrap()).unwrap();
    let zero = Mat::zeros(8000, 1);
    let run = |noise: &Mat<f64>| {
        let log = crate::linalg::block(&[&[d.as_ref(), noise.as_ref()]]);
        simulate(&rig, log.as_ref(), &vec![0.0; rig.order()]).unwrap()
    };
    let clean = run(&zero);
    let size = clean.subcols(1, 1).norm_l2() / 8000.0_f64.sqrt();
    let log = run(&normal(rng, 8000, 1, 0.316 * size));
    let (u, y) = (log.subcols(0, 1).to_owned(), log.subcols(1, 1).to_owned());
    let given = LikelihoodOptions { order: Some(4), dead_time: Some(vec![3]), ..Default::default() };
    for options in [LikelihoodOptions::default(), given] {
        let found = recommend(&[Experiment::new(u.as_ref(), y.as_ref())], &[], None, time(), &options).unwrap();
        assert_eq!((found.order, found.dead_time.as_slice()), (4, &[3][..]), "{options:?}");
        let hz = [10.8, 15.5];
        let (one, two) = (frequency_response(&found.plant, &hz).unwrap(), frequency_response(&truth, &hz).unwrap());
        for k in 0..2 {
            let (found, wanted) = (one.at(k)[(0, 0)].norm(), two.at(k)[(0, 0)].norm());
            assert!((found / wanted - 1.0).abs() < 0.05, "{options:?}: {found} {wanted}");
        }
    }
}

#[test]
fn the_problem_is_scaled_by_what_the_channels_are() {
    let (u, y) = record(&machine(), 800, 0.1, 12);
    let scaled = Mat::from_fn(800, 1, |i, _| 1e6 * y[(i, 0)]);
    let options = LikelihoodOptions::default();
    let of = |y: &Mat<f64>| recommend(&[Experiment::new(u.as_ref(), y.as_ref())], &[], None, time(), &options);
    let (one, two) = (of(&y).unwrap(), of(&scaled).unwrap());
    assert_eq!(one.order, two.order);
    let response = |system: &StateSpace<Discrete>| frequency_response(system, &[150.0]).unwrap().at(0)[(0, 1)];
    let (one, two) = (response(&one.plant), response(&two.plant));
    assert!((two / 1e6 - one).norm() < 1e-3 * one.norm());
}

/// What the search would ignore is refused, in either group of records.
#[test]
fn known_disturbances_are_refused() {
    let (u, y) = record(&machine(), 1000, 0.1, 1);
    let hum = normal(&mut ChaCha8Rng::seed_from_u64(2), 1000, 1, 1.0);
    let plain = [Experiment::new(u.as_ref(), y.as_ref())];
    let disturbed = [plain[0].with_disturbance(hum.as_ref())];
    for (estimation, verification) in [(&disturbed, &plain), (&plain, &disturbed)] {
        let refused = recommend(estimation, verification, None, time(), &LikelihoodOptions::default()).err();
        assert!(matches!(refused, Some(Error::Unsupported { .. })), "{refused:?}");
    }
}
