//! The influence of a block against the estimate with that block twice, the two factorisations, and seeded statistics.

use super::super::*;
use super::*;
use crate::Mat;
use crate::lti::frequency_response;
use crate::{MatRef, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WEIGHTS: [SubspaceMethod; 6] = [
    SubspaceMethod::Moesp,
    SubspaceMethod::N4sid,
    SubspaceMethod::Cva,
    SubspaceMethod::PbsidOpt,
    SubspaceMethod::Ssarx,
    SubspaceMethod::ParsimS,
];
const OMEGA: [f64; 3] = [0.2, 0.45, 1.2];

/// Two outputs, one input, two states with innovations that also drive the states.
fn record(samples: usize, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let uniform = |rng: &mut ChaCha8Rng| 2.0 * rng.random::<f64>() - 1.0;
    let (mut u, mut y) = (Mat::zeros(samples, 1), Mat::zeros(samples, 2));
    let mut x = [0.0, 0.0];
    for k in 0..samples {
        let e = [0.3 * uniform(rng), 0.3 * uniform(rng)];
        u[(k, 0)] = uniform(rng);
        (y[(k, 0)], y[(k, 1)]) = (x[0] + e[0], 0.5 * x[1] + e[1]);
        x = [1.5 * x[0] - 0.7 * x[1] + u[(k, 0)] + 0.4 * e[0], x[0] + 0.2 * e[1]];
    }
    (u, y)
}

fn truth() -> StateSpace<Discrete> {
    let matrix = |rows, columns, entries: &[f64]| Mat::from_fn(rows, columns, |i, j| entries[i * columns + j]);
    let (a, b) = (matrix(2, 2, &[1.5, -0.7, 1.0, 0.0]), matrix(2, 1, &[1.0, 0.0]));
    StateSpace::new(a, b, matrix(2, 2, &[1.0, 0.0, 0.0, 0.5]), Mat::zeros(2, 1), Discrete::new(1.0).unwrap()).unwrap()
}

fn options(method: SubspaceMethod) -> SubspaceOptions {
    SubspaceOptions {
        method,
        horizon: Horizon::Fixed { future: 6, past: 8 },
        order: Order::Fixed(2),
        scaling: ChannelScaling::None,
        uncertainty: UncertaintyOptions { method: UncertaintyMethod::Delta, ..Default::default() },
        ..Default::default()
    }
}

fn identify(records: &[(MatRef<'_, f64>, MatRef<'_, f64>)], options: &SubspaceOptions) -> SubspaceModel {
    let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment::new(*u, *y)).collect();
    subspace(&experiments, Discrete::new(1.0).unwrap(), options).unwrap()
}

fn delta(found: &SubspaceModel) -> &Delta {
    match found.uncertainty.as_ref().unwrap() {
        Uncertainty::Delta(delta) => delta,
        other => panic!("{other:?}"),
    }
}

fn values(model: &StateSpace<Discrete>) -> Vec<c64> {
    let response = frequency_response(model, &OMEGA).unwrap();
    (0..3).flat_map(|k| [response.at(k)[(0, 0)], response.at(k)[(1, 0)]]).collect()
}

fn changes(delta: &Delta, j: usize) -> Vec<c64> {
    OMEGA.iter().flat_map(|w| delta.response_changes(*w)[j].clone()).collect()
}

fn norm(values: impl Iterator<Item = c64>) -> f64 {
    values.map(|v| v.norm_sqr()).sum::<f64>().sqrt()
}

/// The change of the frequency response with the block once more in the record, as an experiment of its own, is the
/// influence of the block, but for the second order and for the initial state of the added part. Also: the influences add up
/// to nothing, because the weight of all data together does not matter.
#[test]
fn influence_is_the_change_with_the_block_twice() {
    let (u, y) = record(12_000, 1);
    for method in WEIGHTS {
        let found = identify(&[(u.as_ref(), y.as_ref())], &options(method));
        let delta = delta(&found);
        let count = delta.blocks.len();
        assert_eq!(count, 60);
        let base = values(&found.model);
        let plain = SubspaceOptions { uncertainty: UncertaintyOptions::default(), ..options(method) };
        for j in [7, 31, 58] {
            let columns = 12_000 + 1 - 14;
            let (start, end) = (j * columns / count, (j + 1) * columns / count + 13);
            let again = (u.subrows(start, end - start), y.subrows(start, end - start));
            let twice = values(&identify(&[(u.as_ref(), y.as_ref()), again], &plain).model);
            let (change, influence) = (twice.iter().zip(&base).map(|(t, b)| *t - *b), changes(delta, j));
            let miss = norm(change.clone().zip(&influence).map(|(a, b)| a - *b)) / norm(change);
            assert!(miss < 0.2, "{method:?}, block {j}: {miss}");
        }
        let all: Vec<Vec<c64>> = (0..count).map(|j| changes(delta, j)).collect();
        let sum = norm((0..6).map(|k| all.iter().fold(c64::new(0.0, 0.0), |sum, d| sum + d[k])));
        let size = all.iter().map(|d| norm(d.iter().copied())).sum::<f64>();
        assert!(sum < 2e-3 * size, "{method:?}: {:e}", sum / size);
    }
}

/// The influences of both factorisations agree, and those of a record cut in two are those of two experiments.
#[test]
fn both_factorisations_and_several_experiments() {
    let (u, y) = record(4000, 2);
    for method in WEIGHTS {
        let cut = [(u.subrows(0, 2500), y.subrows(0, 2500)), (u.subrows(2500, 1500), y.subrows(2500, 1500))];
        let [gram, qr] = [Factorisation::Gram, Factorisation::Qr]
            .map(|factorisation| identify(&cut, &SubspaceOptions { factorisation, ..options(method) }));
        let (gram, qr) = (delta(&gram), delta(&qr));
        let experiments: Vec<usize> = gram.blocks.iter().map(|b| b.experiment).collect();
        assert_eq!((experiments.iter().filter(|e| **e == 0).count(), experiments.len()), (38, 60));
        for j in [0, 20, 59] {
            let (one, other) = (changes(gram, j), changes(qr, j));
            let miss = norm(one.iter().zip(&other).map(|(a, b)| *a - *b)) / norm(one.iter().copied());
            assert!(miss < 1e-6, "{method:?}, block {j}: {miss:e}");
        }
    }
}

/// 60 seeded records of 1500 samples: the mean of the variances that are claimed for the response is that of the estimates
/// within 30 % (the deviation of an empirical variance of 60 complex numbers is about 15 %), and so for the mode.
#[test]
fn variances_are_those_of_many_records() {
    let truth = truth();
    for method in WEIGHTS {
        let (mut claimed, mut seen) = ([0.0; 2], [0.0; 2]);
        for seed in 0..60 {
            let (u, y) = record(1500, 100 + seed);
            let found = identify(&[(u.as_ref(), y.as_ref())], &options(method));
            let band = delta(&found).response(&OMEGA).unwrap();
            let right = frequency_response(&truth, &OMEGA).unwrap();
            for (k, i) in (0..3).flat_map(|k| [(k, 0), (k, 1)]) {
                let [rr, _, ii] = band.covariance[band.place(k, i, 0)];
                let size = right.at(k)[(i, 0)].norm_sqr();
                claimed[0] += (rr + ii) / size;
                seen[0] += (band.response.at(k)[(i, 0)] - right.at(k)[(i, 0)]).norm_sqr() / size;
            }
            let mode = delta(&found).modes().unwrap()[0];
            claimed[1] += mode.zeta_deviation.powi(2);
            seen[1] += (mode.mode.zeta - truth.modes().unwrap()[0].zeta).powi(2);
        }
        for (what, limit) in [(0, 0.3), (1, 0.5)] {
            let ratio = claimed[what] / seen[what];
            assert!((ratio - 1.0).abs() < limit, "{method:?}, {what}: {ratio}");
        }
    }
}

/// The bootstrap claims what the delta method claims, depends on its seed alone, and refuses what it cannot do.
#[test]
fn bootstrap_agrees_and_refuses() {
    let (u, y) = record(2000, 5);
    let bootstrap = |method| SubspaceOptions {
        uncertainty: UncertaintyOptions { method: UncertaintyMethod::Bootstrap, replicates: 100, ..Default::default() },
        ..options(method)
    };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| identify(&[(u.as_ref(), y.as_ref())], &bootstrap(SubspaceMethod::Cva)))
    };
    let (found, again) = (run(1), run(3));
    let [band, second] = [&found, &again].map(|f| f.uncertainty.as_ref().unwrap().response(&OMEGA).unwrap().unwrap());
    assert_eq!(band.magnitude, second.magnitude);
    let by_delta = identify(&[(u.as_ref(), y.as_ref())], &options(SubspaceMethod::Cva));
    let delta = delta(&by_delta).response(&OMEGA).unwrap();
    let trace = |band: &ResponseBand| band.covariance.iter().map(|v| v[0] + v[2]).sum::<f64>();
    let ratio = trace(&delta) / trace(&band);
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
    let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
    let refused = subspace(&experiment, Discrete::new(1.0).unwrap(), &bootstrap(SubspaceMethod::PbsidOpt));
    assert!(matches!(refused, Err(crate::Error::Unsupported { .. })));
}

/// Without noise there is nothing to judge by, with either method; choices without meaning are refused.
#[test]
fn refusals() {
    let u = Mat::from_fn(400, 1, |k, _| ((k * k) as f64).sin());
    let mut y = Mat::zeros(400, 1);
    (0..399).for_each(|k| y[(k + 1, 0)] = 0.5 * y[(k, 0)] + u[(k, 0)]);
    for method in [UncertaintyMethod::Delta, UncertaintyMethod::Bootstrap] {
        let uncertainty = UncertaintyOptions { method, ..Default::default() };
        let options = SubspaceOptions { horizon: 5.into(), order: Order::Fixed(1), uncertainty, ..Default::default() };
        let found = identify(&[(u.as_ref(), y.as_ref())], &options);
        assert_eq!(found.uncertainty.unwrap().refusal(), Some(&NoUncertainty::NoiseFree));
    }
    for text in ["level = 1.5", "blocks = 3", "replicates = 1"] {
        let options: SubspaceOptions = toml::from_str(&format!("[uncertainty]\nmethod = 'delta'\n{text}")).unwrap();
        assert!(matches!(check(&options), Err(crate::Error::OutOfRange { .. })), "{text}");
    }
}

/// A delay shifts the influences with the response: they are those of the record that was shifted by hand.
#[test]
fn delays_turn_the_influences() {
    let (u, y) = record(3000, 8);
    let late = 3;
    let y = Mat::from_fn(3000, 2, |k, i| if k < late { 0.0 } else { y[(k - late, i)] });
    for method in [SubspaceMethod::Cva, SubspaceMethod::PbsidOpt] {
        let delayed = SubspaceOptions { delays: vec![late], ..options(method) };
        let delayed = identify(&[(u.as_ref(), y.as_ref())], &delayed);
        let by_hand = (u.subrows(0, 3000 - late), y.subrows(late, 3000 - late));
        let plain = identify(&[by_hand], &options(method));
        assert_eq!((delayed.model.order(), plain.model.order()), (5, 2));
        for j in [0, 30, 59] {
            let turned = changes(delta(&plain), j).into_iter().enumerate();
            let turned = turned.map(|(k, d)| d * c64::from_polar(1.0, -OMEGA[k / 2] * late as f64));
            let found = changes(delta(&delayed), j);
            let miss = norm(turned.zip(&found).map(|(a, b)| a - *b)) / norm(found.iter().copied());
            assert!(miss < 1e-9, "{method:?}, block {j}: {miss:e}");
        }
    }
}

/// Lines of twenty times the noise that are known change the deviations by no more than their few degrees of freedom do.
#[test]
fn known_lines_leave_the_deviations_as_they_are() {
    let (u, y) = record(4000, 9);
    let time = Discrete::new(1.0).unwrap();
    let w = lines(&[0.11, 0.22], 4000, time).unwrap();
    let disturbed = &y + &w * Mat::from_fn(4, 2, |j, i| 6.0 - (j + 3 * i) as f64);
    for method in [SubspaceMethod::Cva, SubspaceMethod::PbsidOpt] {
        let trace = |found: &SubspaceModel| -> f64 {
            delta(found).response(&OMEGA).unwrap().covariance.iter().map(|v| v[0] + v[2]).sum()
        };
        let clean = identify(&[(u.as_ref(), y.as_ref())], &options(method));
        let experiment = [Experiment::new(u.as_ref(), disturbed.as_ref()).with_disturbance(w.as_ref())];
        let known = subspace(&experiment, time, &options(method)).unwrap();
        let ratio = trace(&known) / trace(&clean);
        assert!((ratio - 1.0).abs() < 0.05, "{method:?}: {ratio}");
    }
}

/// The deviations in the stabilisation diagram at the order of the model are those of its modes, but for the step.
#[test]
fn the_diagram_knows_the_deviations_of_the_modes() {
    let (u, y) = record(4000, 10);
    for method in [SubspaceMethod::Moesp, SubspaceMethod::Ssarx] {
        let options = options(method);
        let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
        let data = SubspaceData::new(&experiment, Discrete::new(1.0).unwrap(), &options).unwrap();
        let mode = delta(&data.identify(&options).unwrap()).modes().unwrap()[0];
        let diagram = stabilisation::stabilisation(
            &data,
            &[1, 2, 3, 4],
            &options,
            &stabilisation::StabilisationOptions::default(),
        )
        .unwrap();
        let pole = diagram.poles.iter().find(|p| p.order == 2).unwrap();
        assert!((pole.hz / mode.mode.hz - 1.0).abs() < 1e-9);
        for (one, other) in [(pole.hz_deviation, mode.hz_deviation), (pole.zeta_deviation, mode.zeta_deviation)] {
            assert!((one.unwrap() / other - 1.0).abs() < 1e-3, "{method:?}: {one:?} {other}");
        }
        assert!(diagram.clusters.iter().all(|cluster| cluster.hz_deviation.is_some()));
    }
}
