//! Published figures on measured data: the example of SLICOT's IB01AD, IB01BD and IB01CD (a hair dryer), and the errors
//! `||y - yhat||_1 / ||y||_1` of table 7 in SLICOT working note 2000-4.

use crate::common::data;
use std::f64::consts::TAU;
use youla::Mat;
use youla::identify::subspace::{
    ChannelScaling, Experiment, Factorisation, Feedthrough, Order, SubspaceModel, SubspaceOptions, subspace,
};
use youla::lti::Discrete;
use youla::signal::{ExcitedRecord, Welch, indirect_response};
use youla_io::{ChannelRef, ChannelSpec, TimeSource, read_mat};

fn clock() -> Discrete {
    Discrete::new(1.0).unwrap()
}

fn one<'a>(u: &'a Mat<f64>, y: &'a Mat<f64>) -> [Experiment<'a>; 1] {
    [Experiment::new(u.as_ref(), y.as_ref())]
}

/// Input and output columns of a file of the measured data.
fn load(file: &str, inputs: usize) -> (Mat<f64>, Mat<f64>) {
    let text = std::fs::read_to_string(data(file)).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().map(|line| line.split_whitespace().map(|v| v.parse().unwrap()).collect()).collect();
    let columns = rows[0].len();
    let u = Mat::from_fn(rows.len(), inputs, |k, j| rows[k][j]);
    let y = Mat::from_fn(rows.len(), columns - inputs, |k, j| rows[k][inputs + j]);
    (u, y)
}

/// Takes off the least-squares straight line of each column.
fn detrend(record: &Mat<f64>) -> Mat<f64> {
    let line = Mat::from_fn(record.nrows(), 2, |k, j| (k as f64 / record.nrows() as f64).powi(j as i32));
    let fit = youla::linalg::least_squares("a line", line.as_ref(), record.as_ref()).unwrap().x;
    record - line * fit
}

/// Induced 1-norm: the largest sum of magnitudes over the columns.
fn norm_1(record: &Mat<f64>) -> f64 {
    record.col_iter().map(|c| c.norm_l1()).fold(0.0, f64::max)
}

fn relative_error(found: &SubspaceModel, u: &Mat<f64>, y: &Mat<f64>) -> f64 {
    let model = &found.model;
    let mut x = Mat::from_fn(model.order(), 1, |i, _| found.initial_states[0][i]);
    let mut error = y.clone();
    for k in 0..u.nrows() {
        let uk = u.as_ref().subrows(k, 1).transpose();
        let row = (model.c() * &x + model.d() * uk).transpose().to_owned();
        error.as_mut().subrows_mut(k, 1).copy_from(y.as_ref().subrows(k, 1) - row);
        x = model.a() * x + model.b() * uk;
    }
    norm_1(&error) / norm_1(y)
}

fn published(order: usize, horizon: usize) -> SubspaceOptions {
    SubspaceOptions {
        scaling: ChannelScaling::None,
        order: Order::Fixed(order),
        horizon,
        feedthrough: Feedthrough::Estimated,
        ..Default::default()
    }
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn slicot_figures() {
    let cases = [
        ("hair_dryer/dryer.dat", 1, 15, 4, false, 1.4960e-2),
        ("robot_arm/robot_arm.dat", 1, 20, 4, false, 3.6009e-2),
        ("robot_arm/robot_arm.dat", 1, 20, 6, false, 3.4666e-2),
        ("evaporator/evaporator.dat", 3, 10, 4, false, 4.8933e-1),
        ("cd_player_arm/CD_player_arm.dat", 2, 15, 8, true, 1.7597e-1),
    ];
    for (file, inputs, horizon, order, trend, expected) in cases {
        let (mut u, mut y) = load(file, inputs);
        if trend {
            (u, y) = (detrend(&u), detrend(&y));
        }
        let found = subspace(&one(&u, &y), clock(), &published(order, horizon)).unwrap();
        let error = relative_error(&found, &u, &y);
        assert!((error / expected - 1.0).abs() < 5e-4, "{file}: {error:e}, expected {expected:e}");
    }
}

/// Section 7 D of the theory: share of the variance that the simulation explains, percent.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn published_variance_accounted_for() {
    let cases: [(_, _, _, _, _, &[f64]); 3] = [
        ("robot_arm/robot_arm.dat", 1, 20, 6, false, &[99.88]),
        ("evaporator/evaporator.dat", 3, 10, 4, false, &[75.33, 78.08, 79.47]),
        ("cd_player_arm/CD_player_arm.dat", 2, 15, 8, true, &[94.23, 96.73]),
    ];
    for (file, inputs, horizon, order, trend, expected) in cases {
        let (mut u, mut y) = load(file, inputs);
        if trend {
            (u, y) = (detrend(&u), detrend(&y));
        }
        let found = subspace(&one(&u, &y), clock(), &published(order, horizon)).unwrap();
        for (fit, expected) in found.fit.percent.iter().zip(expected) {
            let accounted = 100.0 * (1.0 - (1.0 - fit / 100.0).powi(2));
            assert!((accounted - expected).abs() < 0.02, "{file}: {accounted}, published {expected}");
        }
    }
}

/// The inputs of the CD player fall by 100 dB towards Nyquist: their Gram matrix would lose most digits, and is not taken.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn the_cd_player_goes_to_qr_by_itself() {
    let (u, y) = load("cd_player_arm/CD_player_arm.dat", 2);
    let (u, y) = (detrend(&u), detrend(&y));
    let found = subspace(&one(&u, &y), clock(), &published(8, 15)).unwrap();
    assert_eq!(found.factor.by, Factorisation::Qr);
    assert!(found.factor.condition.is_none_or(|condition| condition > 1e4));
    let by_qr = SubspaceOptions { factorisation: Factorisation::Qr, ..published(8, 15) };
    assert_eq!(subspace(&one(&u, &y), clock(), &by_qr).unwrap().model, found.model);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn slicot_singular_values() {
    let cases: [(_, _, _, _, &[f64]); 4] = [
        ("robot_arm/robot_arm.dat", 1, 20, false, &[24.4555, 23.8859, 4.0593, 3.7981, 0.0425]),
        ("hair_dryer/dryer.dat", 1, 15, false, &[69.8841, 14.9963, 3.6675, 1.9677, 0.3000, 0.2078, 0.1651]),
        ("evaporator/evaporator.dat", 3, 10, false, &[253.5802, 184.8253, 125.4157, 65.4174]),
        ("cd_player_arm/CD_player_arm.dat", 2, 15, true, &[12.3147, 6.9998, 4.9162, 3.2572]),
    ];
    for (file, inputs, horizon, trend, expected) in cases {
        let (mut u, mut y) = load(file, inputs);
        if trend {
            (u, y) = (detrend(&u), detrend(&y));
        }
        let found = subspace(&one(&u, &y), clock(), &published(4, horizon)).unwrap();
        for (value, printed) in found.singular_values.iter().zip(expected) {
            assert!((value - printed).abs() < 5.1e-5, "{file}: {value}, printed {printed}");
        }
    }
}

/// A, C by PO-MOESP, K of IB01BD, and B, D, x0 of IB01CD, to their four printed digits; states up to sign.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn slicot_dryer_example() {
    let (u, y) = load("hair_dryer/dryer.dat", 1);
    let found = subspace(&one(&u, &y), clock(), &published(4, 15)).unwrap();
    let c = [-0.4442, 0.6663, 0.3961, 0.4102];
    let sign: Vec<f64> = (0..4).map(|j| (found.model.c()[(0, j)] * c[j]).signum()).collect();
    let gain = found.innovation.gain().unwrap();
    let model = &found.model;
    let compare = |name: &str, printed: [f64; 4], value: &dyn Fn(usize) -> f64| {
        for (j, printed) in printed.into_iter().enumerate() {
            let value = sign[j] * value(j);
            assert!((value - printed).abs() < 1.1e-4, "{name}: entry {} is {value}, printed {printed}", j + 1);
        }
    };
    compare("C", c, &|j| model.c()[(0, j)]);
    compare("A", [0.8924, 0.3887, 0.1285, 0.1716], &|j| sign[0] * model.a()[(0, j)]);
    compare("B", [-0.2150, -0.1962, 0.0511, 0.0373], &|j| model.b()[(j, 0)]);
    compare("x0", [-11.4329, -0.6767, 0.0472, 0.3600], &|j| found.initial_states[0][j]);
    compare("K", [-1.9513, -0.1867, 0.6348, -0.3486], &|j| gain[(j, 0)]);
    assert!((model.d()[(0, 0)] + 0.0018).abs() < 1.1e-4);
    assert!(found.model.is_stable().unwrap() && found.fit.percent[0] > 84.0);
}

/// Figures of the data set: anti-resonance 39 to 42 Hz, resonance 53.0 to 55.4 Hz.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn the_flexible_drive_resonates_where_it_should() {
    let channels = ["d", "u", "y"].map(|n| ChannelSpec::from(n, ChannelRef::Name(format!("Data.signals.{n}")), ""));
    let file = read_mat(data("flexible_drive/fs2000/cycle1.mat")).unwrap();
    let record = file.record(&channels, &TimeSource::ts(5e-4)).unwrap();
    let [d, u, y] = ["d", "u", "y"].map(|n| record.matrix(&[n]).unwrap());
    let welch = Welch { window: 4000, ..Welch::default() };
    let found =
        indirect_response(&[ExcitedRecord { d: d.as_ref(), u: u.as_ref(), y: y.as_ref() }], record.time(), &welch)
            .unwrap();
    let curve: Vec<(f64, f64)> =
        found.response.omega.iter().map(|w| w / TAU).zip(found.response.entry(0, 0).iter().map(|g| g.norm())).collect();
    let between = |lo: f64, hi: f64| curve.iter().copied().filter(move |(f, _)| (lo..=hi).contains(f));
    let (low, _) = between(30.0, 50.0).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    let (high, _) = between(45.0, 70.0).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert!((39.0..=42.0).contains(&low), "anti-resonance at {low} Hz");
    assert!((53.0..=55.4).contains(&high), "resonance at {high} Hz");
}
