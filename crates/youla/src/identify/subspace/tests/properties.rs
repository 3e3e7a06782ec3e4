//! What must not change a model: the order and the units of the channels, the origin of time, how a record is cut, and an
//! offset that is taken off before. All weights.

use super::*;
use crate::signal::Channel;
use crate::signal::{Detrend, Record};

const WEIGHTS: [SubspaceMethod; 5] = [
    SubspaceMethod::Moesp,
    SubspaceMethod::N4sid,
    SubspaceMethod::Cva,
    SubspaceMethod::PbsidOpt,
    SubspaceMethod::Ssarx,
];
const PAST: usize = 15;
const HORIZON: usize = 8;

fn options(method: SubspaceMethod) -> SubspaceOptions {
    SubspaceOptions { method, horizon: HORIZON, past: Some(PAST), feedthrough: Feedthrough::None, ..fixed(4, HORIZON) }
}

fn model(experiments: &[Experiment<'_>], method: SubspaceMethod) -> SubspaceModel {
    subspace(experiments, clock(), &options(method)).unwrap()
}

/// Two inputs, two outputs, coloured noise.
fn record(samples: usize, noise: f64) -> (Mat<f64>, Mat<f64>) {
    let system = random_system(&[0.95, 0.8], 2, 2, false, 40);
    let rng = &mut ChaCha8Rng::seed_from_u64(41);
    let (u, e) = (uniform(samples, 2, rng), noise * uniform(samples, 2, rng));
    let y = respond(&system, &u, 0.5, Some((&(0.2 * uniform(4, 2, rng)), &e)));
    (u, y)
}

fn rows(record: &Mat<f64>, from: usize, to: usize) -> MatRef<'_, f64> {
    record.as_ref().subrows(from, to - from)
}

#[test]
fn permuted_and_rescaled_channels_give_the_permuted_and_rescaled_model() {
    let (u, y) = record(2000, 0.1);
    let u2 = Mat::from_fn(u.nrows(), 2, |k, j| [1e4, 0.03][j] * u[(k, 1 - j)]);
    let y2 = Mat::from_fn(y.nrows(), 2, |k, j| [1e-6, 70.0][j] * y[(k, 1 - j)]);
    for method in WEIGHTS {
        let (plain, other) = (model(&one(&u, &y), method).model, model(&one(&u2, &y2), method).model);
        let b = Mat::from_fn(4, 2, |i, j| [0.03, 1e4][j] * other.b()[(i, 1 - j)]);
        let c = Mat::from_fn(2, 4, |i, j| other.c()[(1 - i, j)] / [70.0, 1e-6][i]);
        let back = StateSpace::new(other.a().to_owned(), b, c, Mat::zeros(2, 2), clock()).unwrap();
        assert!(distance(&back, &plain) < 1e-9, "{method:?}: {:e}", distance(&back, &plain));
    }
}

/// A record that begins later gives the same model, and the state at its first sample is where the model has come to.
#[test]
fn the_origin_of_time_does_not_matter() {
    let (u, y) = record(1500, 0.0);
    for method in WEIGHTS {
        let late = 40;
        let (all, cut) = ([Experiment::new(u.as_ref(), y.as_ref())], rows(&u, late, 1500));
        let (first, second) = (model(&all, method), model(&[Experiment::new(cut, rows(&y, late, 1500))], method));
        let gap = distance(&second.model, &first.model);
        assert!(gap < 1e-6, "{method:?}: {gap:e}");
        let state = |found: &SubspaceModel| Mat::from_fn(4, 1, |i, _| found.initial_states[0][i]);
        let mut x = state(&first);
        for k in 0..late {
            x = first.model.a() * &x + first.model.b() * u.as_ref().row(k).transpose().as_mat();
        }
        let (here, there) = (first.model.c() * x, second.model.c() * state(&second));
        let miss = (&here - &there).norm_l2() / here.norm_l2();
        assert!(miss < 1e-5, "{method:?}: {miss:e}");
    }
}

/// Two experiments that overlap by the length of a Hankel column hold the same columns as one: A and C are the same to
/// rounding, with noise. Cut without overlap only the columns across the cut are missing.
#[test]
fn one_experiment_split_in_two() {
    let (u, y) = record(3000, 0.1);
    let (middle, overlap) = (1400, PAST + HORIZON - 1);
    for method in WEIGHTS {
        let parts = |first_end: usize| {
            [(0, first_end), (middle, 3000)].map(|(from, to)| Experiment::new(rows(&u, from, to), rows(&y, from, to)))
        };
        let (whole, same, cut) =
            (model(&one(&u, &y), method), model(&parts(middle + overlap), method), model(&parts(middle), method));
        assert_eq!((same.columns, cut.columns), (whole.columns, whole.columns - overlap));
        for (one, other) in same.poles().iter().zip(whole.poles()) {
            let gap = (*one - *other).norm();
            // The scales of the channels differ by the doubled samples, and with them the weights of MOESP and N4SID.
            assert!(gap < 1e-3, "{method:?}: {gap:e}");
        }
        assert!(distance(&cut.model, &whole.model) < 0.02, "{method:?}: {:e}", distance(&cut.model, &whole.model));
        let unscaled = SubspaceOptions { scaling: ChannelScaling::None, ..options(method) };
        let run = |experiments: &[Experiment<'_>]| subspace(experiments, clock(), &unscaled).unwrap().model;
        let (one, two) = (run(&one(&u, &y)), run(&parts(middle + overlap)));
        // B sees the doubled samples twice; A and C do not.
        let error = (one.a() - two.a()).norm_max() + (one.c() - two.c()).norm_max();
        assert!(error < 1e-8, "{method:?}: {error:e}");
    }
}

#[test]
fn noise_free_parts_give_the_model_of_the_whole() {
    let (u, y) = record(1500, 0.0);
    let whole: Vec<_> = WEIGHTS.iter().map(|method| model(&one(&u, &y), *method).model).collect();
    let parts = [(0, 500), (500, 700), (700, 1500)];
    let parts = parts.map(|(from, to)| Experiment::new(rows(&u, from, to), rows(&y, from, to)));
    for (method, whole) in WEIGHTS.into_iter().zip(&whole) {
        let gap = distance(&model(&parts, method).model, whole);
        assert!(gap < 1e-6, "{method:?}: {gap:e}");
    }
}

#[test]
fn an_offset_that_is_taken_off_changes_nothing() {
    let (u, y) = record(2000, 0.1);
    let detrended = |signals: &Mat<f64>, offset: f64| {
        let moved = Mat::from_fn(signals.nrows(), 2, |k, j| signals[(k, j)] + offset * (1.0 + j as f64));
        let channels = vec![Channel::new("a", "V"), Channel::new("b", "V")];
        let record = Record::new("r", channels, moved, clock()).unwrap().detrend(Detrend::Mean).unwrap().record;
        record.data().to_owned()
    };
    let (u0, y0, u1, y1) = (detrended(&u, 0.0), detrended(&y, 0.0), detrended(&u, 30.0), detrended(&y, -200.0));
    for method in WEIGHTS {
        let gap = distance(&model(&one(&u1, &y1), method).model, &model(&one(&u0, &y0), method).model);
        assert!(gap < 1e-9, "{method:?}: {gap:e}");
    }
}
