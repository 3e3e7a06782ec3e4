//! Derivatives against difference quotients, and the sandwich against its definition in dense matrices.

use super::super::{IntervalOptions, ResidualAssumption, greybox_intervals};
use super::*;
use crate::Result;
use crate::tests::{bearing, truth};
use crate::{GreyBoxOptions, Problem, Slope, Structure, greybox};
use std::f64::consts::TAU;
use youla::identify::subspace::InitialState;
use youla::lti::{Continuous, frequency_response};
use youla::signal::{Excitation, SquareWaves};

fn drive() -> DeclaredStructure {
    DeclaredStructure::new(&Template::TwoInertiaDrive.declaration().unwrap()).unwrap()
}

/// `f' cov f'^T` with the slopes of `f` by central differences.
fn covariance_of(theta: &[f64], covariance: &Mat<f64>, f: impl Fn(&[f64]) -> Vec<f64>) -> Mat<f64> {
    let column = |j: usize| -> Vec<f64> {
        let at = |k: f64| {
            let mut moved = theta.to_vec();
            moved[j] *= 1.0 + 1e-4 * k;
            f(&moved)
        };
        let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(at);
        let h = 12e-4 * theta[j];
        (0..a.len()).map(|i| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / h).collect()
    };
    let columns: Vec<Vec<f64>> = (0..theta.len()).map(column).collect();
    let slopes = Mat::from_fn(columns[0].len(), theta.len(), |i, j| columns[j][i]);
    &slopes * covariance * slopes.transpose()
}

/// Modes, zeros and response of a drive behind a delay of two samples.
#[test]
fn slopes_are_exact() {
    let (structure, time) = (drive(), Discrete::new(2e-3).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let w = excitation(600, &mut rng);
    let u = Mat::from_fn(600, 1, |k, _| w[k]);
    let late = Mat::from_fn(600, 1, |k, _| if k < 2 { 0.0 } else { w[k - 2] });
    let sampled = |theta: &[f64]| structure.model(theta).unwrap().zoh(time).unwrap();
    let clean = simulate(&sampled(&structure.start()), late.as_ref(), &[0.0; 3]).unwrap();
    let n = noise(600, 0.3, 0.0, &mut rng);
    let y = Mat::from_fn(600, 1, |k, _| clean[(k, 0)] + n[k]);
    let records = [Experiment::new(u.as_ref(), y.as_ref())];
    let options = GreyBoxOptions { delays: vec![2], ..Default::default() };
    let found = greybox(&Problem::new(&structure, &records, time), &structure.start(), &options).unwrap();
    let asked = IntervalOptions { residuals: ResidualAssumption::White, ..Default::default() };
    let known = greybox_intervals(&Problem::new(&structure, &records, time), &found, &options, &asked).unwrap();
    let theta = &found.parameters;
    let same = |deviation: f64, variance: f64| (deviation / variance.sqrt() - 1.0).abs() < 1e-6;

    let of_modes = |modes: Vec<youla::lti::Mode>| modes.iter().flat_map(|m| [m.hz, m.zeta]).collect::<Vec<_>>();
    let expected = covariance_of(theta, &known.covariance, |theta| of_modes(sampled(theta).modes().unwrap()));
    let bands = known.modes().unwrap();
    assert_eq!((bands.len(), bands.iter().filter(|b| b.mode.hz.is_finite()).count()), (4, 2));
    for (k, band) in bands.iter().take(2).enumerate() {
        assert!(same(band.hz_deviation, expected[(2 * k, 2 * k)]), "{band:?}");
        let real = band.mode.pole.im == 0.0;
        assert!(real || same(band.zeta_deviation, expected[(2 * k + 1, 2 * k + 1)]), "{band:?}");
    }

    let zero = |theta: &[f64]| {
        let all = sampled(theta).zeros().unwrap();
        let z = all.into_iter().find(|z| z.im > 0.0).unwrap();
        let mode = youla::lti::modes::mode(time, z);
        vec![mode.hz, mode.zeta]
    };
    let expected = covariance_of(theta, &known.covariance, zero);
    let zeros = known.zeros().unwrap();
    let band = zeros.iter().find(|b| b.mode.pole.im > 0.0).unwrap();
    assert!((band.mode.hz / zero(theta)[0] - 1.0).abs() < 1e-9);
    assert!(same(band.hz_deviation, expected[(0, 0)]) && same(band.zeta_deviation, expected[(1, 1)]), "{band:?}");

    let omega = [5.0, 16.0, 27.0].map(|hz| TAU * hz);
    let parts = |theta: &[f64]| {
        let response = frequency_response(&sampled(theta), &omega).unwrap();
        let turned = |k: usize| response.at(k)[(0, 0)] * youla::c64::new(0.0, -2.0 * omega[k] * time.ts()).exp();
        (0..3).flat_map(|k| [turned(k).re, turned(k).im]).collect::<Vec<f64>>()
    };
    let expected = covariance_of(theta, &known.covariance, parts);
    let band = known.response(&omega).unwrap();
    for (k, v) in band.covariance.iter().enumerate() {
        let size = v[0] + v[2];
        for (value, place) in v.iter().zip([(0, 0), (0, 1), (1, 1)]) {
            assert!((value - expected[(2 * k + place.0, 2 * k + place.1)]).abs() < 1e-7 * size, "{k} {place:?}");
        }
    }
}

/// Two experiments of two outputs with estimated initial states.
#[test]
fn sandwich_is_its_definition() {
    let (time, truth) = (Discrete::new(2e-4).unwrap(), truth());
    let log = |samples: usize, seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 };
        let u = Excitation::SquareWaves(waves).generate(samples, 2, time, &mut rng).unwrap();
        let clean = simulate(&bearing().model(&truth).unwrap().zoh(time).unwrap(), u.as_ref(), &[0.0; 6]).unwrap();
        let n = [noise(samples, 0.1, 0.8, &mut rng), noise(samples, 0.2, 0.5, &mut rng)];
        let y = Mat::from_fn(samples, 2, |k, i| clean[(k, i)] + n[i][k] + 0.5 * n[0][k.saturating_sub(1)]);
        Log { u, y }
    };
    let logs = [log(300, 1), log(200, 2)];
    let records = [logs[0].experiment(), logs[1].experiment()];
    let options = GreyBoxOptions { output_deviations: vec![0.5, 2.0], ..Default::default() };
    let found = greybox(&Problem::new(bearing(), &records, time), &truth, &options).unwrap();
    let lags = 40;
    let asked = IntervalOptions { lags: Some(lags), residuals: ResidualAssumption::Coloured, ..Default::default() };
    let known = greybox_intervals(&Problem::new(bearing(), &records, time), &found, &options, &asked).unwrap();

    // Outputs sample after sample, over their deviations.
    let weighted = |y: Mat<f64>| Mat::from_fn(2 * y.nrows(), 1, |r, _| y[(r / 2, r % 2)] / [0.5, 2.0][r % 2]);
    let simulated = |theta: &[f64], k: usize, x0: &[f64]| {
        let model = bearing().model(theta).unwrap().zoh(time).unwrap();
        weighted(simulate(&model, logs[k].u.as_ref(), x0).unwrap())
    };
    let theta = &found.parameters;
    let (mut gram, mut inner) = (Mat::<f64>::zeros(14, 14), Mat::<f64>::zeros(14, 14));
    let mut errors = Vec::new();
    let mut rows = Vec::new();
    for k in 0..2 {
        let x0 = &found.initial_states[k];
        errors.push(weighted(logs[k].y.clone()) - simulated(theta, k, x0));
        let moved = |j: usize, by: f64| {
            let mut theta = theta.clone();
            theta[j] *= 1.0 + by;
            simulated(&theta, k, x0)
        };
        let column = |j: usize| {
            let first = (moved(j, 1e-4) - moved(j, -1e-4)) * faer::Scale(8.0);
            (first - (moved(j, 2e-4) - moved(j, -2e-4))) * faer::Scale(1.0 / (12e-4 * theta[j]))
        };
        let columns: Vec<Mat<f64>> = (0..14).map(column).collect();
        let unit = |i: usize| simulated(theta, k, &Vec::from_iter((0..6).map(|j| x0[j] + f64::from(u8::from(i == j)))));
        let of_start: Vec<Mat<f64>> = (0..6).map(|i| unit(i) - simulated(theta, k, x0)).collect();
        let j = Mat::from_fn(errors[k].nrows(), 14, |i, j| columns[j][(i, 0)]);
        let j0 = Mat::from_fn(errors[k].nrows(), 6, |i, j| of_start[j][(i, 0)] / of_start[j].norm_l2());
        use faer::prelude::*;
        let removed = j0.qr().solve_lstsq(&j);
        rows.push(&j - &j0 * removed);
        gram += rows[k].transpose() * &rows[k];
    }
    let correlation = |i: usize, l: usize, lag: usize| {
        let of =
            |e: &Mat<f64>| (lag..e.nrows() / 2).map(|t| e[(2 * t + i, 0)] * e[(2 * (t - lag) + l, 0)]).sum::<f64>();
        errors.iter().map(of).sum::<f64>() / 500.0
    };
    let window = |lag: usize| match lag as f64 / (lags + 1) as f64 {
        x if x <= 0.5 => 1.0 - 6.0 * x * x + 6.0 * x.powi(3),
        x => 2.0 * (1.0 - x).powi(3),
    };
    let table: Vec<[[f64; 2]; 2]> =
        (0..=lags).map(|lag| [0, 1].map(|i| [0, 1].map(|l| window(lag) * correlation(i, l, lag)))).collect();
    for j in &rows {
        let r = Mat::from_fn(j.nrows(), j.nrows(), |a, b| match (a / 2, b / 2) {
            (t, s) if t >= s && t - s <= lags => table[t - s][a % 2][b % 2],
            (t, s) if t < s && s - t <= lags => table[s - t][b % 2][a % 2],
            _ => 0.0,
        });
        inner += j.transpose() * (r * j);
    }
    let half = youla::linalg::solve("the information", gram.as_ref(), inner.as_ref()).unwrap();
    let whole = youla::linalg::solve("the information", gram.as_ref(), half.transpose()).unwrap();
    let factor = 1000.0 / (1000.0 - 14.0 - 12.0);
    for (i, j) in (0..14).flat_map(|i| (0..14).map(move |j| (i, j))) {
        let size = (known.covariance[(i, i)] * known.covariance[(j, j)]).sqrt();
        let difference = (known.covariance[(i, j)] - factor * whole[(i, j)]).abs() / size;
        assert!(difference < 1e-4, "{i} {j}: {difference:.1e}");
    }
    assert!(known.coloured && known.colour.iter().any(|c| (c - 1.0).abs() > 0.2), "{:?}", known.colour);
}

/// A parameter at its bound counts as known; the data that determine nothing are refused.
#[test]
fn bounds_and_what_is_not_determined() {
    struct Product;
    impl Structure for Product {
        fn names(&self) -> Vec<String> {
            ["k", "l"].map(String::from).into()
        }
        fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
            let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
            Ok(StateSpace::new(number(-3.0), number(t[0] * t[1]), number(1.0), number(0.0), Continuous)?)
        }
        fn slopes(&self, t: &[f64], j: usize) -> Vec<Slope> {
            vec![Slope { matrix: crate::Matrix::B, row: 0, column: 0, value: t[1 - j] }]
        }
    }
    let log = open_loop(300, NOISE, 0.0, 1);
    let (records, options) = ([log.experiment()], GreyBoxOptions::default());
    let found = greybox(&Problem::new(&Product, &records, time()), &[1.0, 1.0], &options).unwrap();
    let refused =
        greybox_intervals(&Problem::new(&Product, &records, time()), &found, &options, &IntervalOptions::default());
    let sentence = refused.unwrap_err().to_string();
    assert!(sentence.contains("k and l cannot be distinguished"), "{sentence}");

    let mut declared = Template::MassSpringDamper.declaration().unwrap();
    declared.parameters.get_mut("damping").unwrap().max = Some(12.0);
    declared.parameters.get_mut("damping").unwrap().initial = Some(10.0);
    let held = DeclaredStructure::new(&declared).unwrap();
    let options = GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() };
    let found = greybox(&Problem::new(&held, &records, time()), &held.start(), &options).unwrap();
    assert_eq!(found.at_bounds.len(), 1);
    let asked = IntervalOptions { residuals: ResidualAssumption::Coloured, ..Default::default() };
    let known = greybox_intervals(&Problem::new(&held, &records, time()), &found, &options, &asked).unwrap();
    assert_eq!((known.parameters[1].deviation, known.colour[1], known.correlations[(0, 1)]), (0.0, 1.0, 0.0));
    assert!(known.parameters[0].deviation > 0.0 && known.correlations[(0, 0)] == 1.0);
    assert!(!known.residuals.white() && known.verdict().contains("the intervals count that"), "{}", known.verdict());

    for (asked, word) in [
        (IntervalOptions { level: 1.0, ..Default::default() }, "level"),
        (IntervalOptions { lags: Some(0), ..Default::default() }, "lags"),
        (IntervalOptions { lags: Some(151), ..Default::default() }, "half"),
    ] {
        let refused = greybox_intervals(&Problem::new(&held, &records, time()), &found, &options, &asked)
            .unwrap_err()
            .to_string();
        assert!(refused.contains(word), "{refused}");
    }
}

const NOISE: f64 = 2e-5;
