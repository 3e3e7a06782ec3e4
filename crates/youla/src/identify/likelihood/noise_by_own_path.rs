//! Noise that reaches the output of a plant by a path of its own: the slopes of its filter, and its spectrum.

use super::noise_at_inputs::{unscaled, whitener};
use super::search::chart::Chart;
use super::search::feedthrough::Answer;
use super::search::free_gain::with_free_gain;
use super::search::linearise::{Filter, linearise_quickly};
use super::search::model::Model;
use super::search::noise::Noise;
use super::search::{Found, SearchOptions, search, with_best_ends};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::driven::Joint;
use crate::lti::{Discrete, StateSpace, frequency_response, simulate};
use crate::{Mat, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::sync::Arc;

const SAMPLES: usize = 20_000;
/// Deviation of the noise of the sensor.
const SENSOR: f64 = 0.05;

/// A mode of damping ratio 0.02 and a lag; u drives the one, the noise, the second input, mostly the other.
fn machine() -> StateSpace<Discrete> {
    let (re, im) = (0.997 * 0.15_f64.cos(), 0.997 * 0.15_f64.sin());
    let a = [[re, im, 0.0], [-im, re, 0.0], [0.0, 0.0, 0.9]];
    let b = [[0.05, 0.02], [0.1, -0.08], [0.05, 0.1]];
    let c = Mat::from_fn(1, 3, |_, j| if j == 1 { 0.0 } else { 1.0 });
    let time = Discrete::new(1e-3).unwrap();
    StateSpace::new(Mat::from_fn(3, 3, |i, j| a[i][j]), Mat::from_fn(3, 2, |i, j| b[i][j]), c, Mat::zeros(1, 2), time)
        .unwrap()
}

fn record(seed: u64) -> Spectra {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |count: usize| Mat::from_fn(SAMPLES, count, |_, _| rng.sample::<f64, _>(StandardNormal));
    let (both, e) = (normal(2), normal(1) * faer::Scale(SENSOR));
    let y = simulate(&machine(), both.as_ref(), &[0.0; 3]).unwrap() + e;
    unscaled(&both.subcols(0, 1).to_owned(), &y)
}

fn options(noise_order: usize) -> SearchOptions {
    let direct = Answer::unknown();
    let (aim, radius, steps) = (f64::INFINITY, f64::INFINITY, 20);
    SearchOptions { feedthrough: false, noise_order, steps, tolerance: 0.01, aim, direct, radius, filter_moves: true }
}

/// The plant as it is.
fn model() -> Model {
    let plant = machine();
    Model::of(plant.a(), plant.b().subcols(0, 1), plant.c(), vec![0.0]).unwrap()
}

fn found(spectra: &Spectra) -> Found {
    search(spectra, with_best_ends(spectra, model(), &Noise::white(1)), None, &options(40)).unwrap()
}

/// Along a parameter of the plant and an entry of K, `J' r` is minus the slope of half the deviance by central differences, within 3 %: these
/// estimate the autoregression anew.
#[test]
fn slopes_are_those_of_the_deviance() {
    let (spectra, gain) = (record(1), Mat::from_fn(3, 1, |i, _| [0.2, -0.1, 0.15][i]));
    let at = |model: &Model, gain: &Mat<f64>| {
        let joint = Arc::new(Joint::of_gain(model, &[], (gain.clone(), None), &Mat::identity(1, 1)).unwrap());
        let point = with_best_ends(&spectra, model.clone(), &Noise { joint: Some(joint.clone()), ..Noise::white(1) });
        let rest = joint.rest(&spectra, &point.residuals(&spectra));
        let noise = Noise::behind(&spectra, &rest, 0, Some(joint));
        (0.5 * SAMPLES as f64 * noise.log_det, point, noise)
    };
    let (_, point, noise) = at(&model(), &gain);
    let chart = Chart::new(&point.model, false);
    let factor = linearise_quickly(&spectra, &point, (&chart, &noise), Filter::Free).factor;
    // Between them are columns of the autoregression.
    let (count, columns) = (chart.parameters(), factor.ncols());
    let first = columns - 1 - gain.nrows();
    for column in (0..count).chain(first..columns - 1) {
        let slope: f64 = (0..factor.nrows()).map(|i| factor[(i, column)] * factor[(i, columns - 1)]).sum();
        let moved = |by: f64| {
            let step: Vec<f64> = (0..count).map(|j| if j == column { by } else { 0.0 }).collect();
            let own = Mat::from_fn(3, 1, |i, _| gain[(i, 0)] + if first + i == column { by } else { 0.0 });
            at(&chart.moved(&point.model, &step), &own).0
        };
        let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
        assert!((difference + slope).abs() < 0.03 * slope.abs().max(1000.0), "{column}: {difference} and {slope}");
    }
}

/// The spectrum of the noise is that of the machine within 15 %, also beside its mode, where that of noise at the input is not; three deviations
/// of a peak of some 60 lines are 40 % otherwise.
#[test]
fn noise_by_a_path_of_its_own_has_its_spectrum() {
    for seed in [2, 3] {
        let spectra = record(seed);
        let found = found(&spectra);
        let freed = with_free_gain(&spectra, &found, &options(40)).unwrap();
        assert!(freed.criterion(SAMPLES) < found.criterion(SAMPLES) - 10.0);
        let omega: Vec<f64> = [0.02, 0.1, 0.13, 0.148, 0.152, 0.2, 0.5, 2.0].iter().map(|w| w / 1e-3).collect();
        let truth = frequency_response(&machine(), &omega).unwrap();
        for (k, omega) in omega.iter().enumerate() {
            let filter = whitener(&freed.noise, c64::cis(omega * 1e-3))[(0, 0)].norm_sqr();
            let power = freed.noise.covariance[(0, 0)] / filter;
            let expected = SENSOR * SENSOR + truth.at(k)[(0, 1)].norm_sqr();
            assert!((power / expected).ln().abs() < 0.15, "{seed} {omega}: {power} and {expected}");
        }
    }
}

/// Noise at the input alone needs no gain of its own.
#[test]
fn noise_at_the_input_keeps_its_filter() {
    let rng = &mut ChaCha8Rng::seed_from_u64(4);
    let mut normal = |size: f64| Mat::from_fn(SAMPLES, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (u, w, e) = (normal(1.0), normal(0.5), normal(SENSOR));
    let zero = Mat::zeros(SAMPLES, 1);
    let both = crate::linalg::block(&[&[(&u + w).as_ref(), zero.as_ref()]]);
    let y = simulate(&machine(), both.as_ref(), &[0.0; 3]).unwrap() + e;
    let spectra = unscaled(&u, &y);
    assert!(with_free_gain(&spectra, &found(&spectra), &options(40)).is_none());
}
