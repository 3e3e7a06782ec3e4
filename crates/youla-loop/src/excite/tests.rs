//! Sequences, the guard, and the bound against what estimates reach.

use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::with_input_port;
use youla::lti::{modes::mode, simulate};
use youla::{MatRef, c64, linalg::eye};

const TS: f64 = 1e-3;

/// A lightly damped mode at 40 Hz, `y = (b1 z + b2) / (z^2 + a1 z + a2) u`, under a gain.
struct Plant {
    nominal: StateSpace<Discrete>,
    controller: Partitioned<Discrete>,
    coefficients: [f64; 4],
    channels: [Vec<Channel>; 2],
}

fn plant(gain: f64) -> Plant {
    let time = Discrete::new(TS).unwrap();
    let pole = c64::new(-0.03 * 251.0, 251.0 * (1.0 - 0.03_f64 * 0.03).sqrt()) * TS;
    let z = pole.exp();
    let coefficients = [-2.0 * z.re, z.norm_sqr(), 0.02, 0.015];
    let [a1, a2, b1, b2] = coefficients;
    let a = Mat::from_fn(2, 2, |i, j| [[-a1, 1.0], [-a2, 0.0]][i][j]);
    let b = Mat::from_fn(2, 1, |i, _| [b1, b2][i]);
    let c = Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]);
    let nominal = StateSpace::new(a, b, c, Mat::zeros(1, 1), time).unwrap();
    let k = StateSpace::gain(Mat::from_fn(1, 1, |_, _| gain), time).unwrap();
    let channels = [vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]];
    Plant { nominal, controller: with_input_port(&k).unwrap(), coefficients, channels }
}

impl Plant {
    fn on(&self) -> LoopToExcite<'_> {
        let [inputs, outputs] = &self.channels;
        LoopToExcite { nominal: &self.nominal, controller: &self.controller, inputs, outputs }
    }
}

fn usual(shape: Shape) -> ExciteOptions {
    ExciteOptions {
        shape,
        amplitude: vec![0.5],
        band: [10.0, 100.0],
        length: Length::Samples(4000),
        ramp: 0.1,
        ..ExciteOptions::default()
    }
}

#[test]
fn every_shape_keeps_amplitude_band_and_ends() {
    let plant = plant(-0.3);
    for shape in Shape::ALL {
        let found = excite(&plant.on(), &usual(shape)).unwrap();
        let (alpha, input) = (&found.alpha, &found.summary.inputs[0]);
        assert!((0.45..=0.5).contains(&input.peak), "{shape:?}: {}", input.peak);
        assert!(alpha[(0, 0)] == 0.0 && alpha[(3999, 0)] == 0.0, "{shape:?}");
        let least = if matches!(shape, Shape::Multisine | Shape::Chirp) { 0.97 } else { 0.55 };
        assert!(input.in_band > least, "{shape:?}: {}", input.in_band);
        assert_eq!(found, excite(&plant.on(), &usual(shape)).unwrap());
        let other = excite(&plant.on(), &ExciteOptions { seed: 2, ..usual(shape) }).unwrap();
        assert_eq!(shape == Shape::Chirp, alpha == &other.alpha, "{shape:?}");
    }
}

/// 45 dB below the band at least, from not more than 8 dB without the notch; 25 dB for lines that end at the very edge, because the
/// ramps widen each line.
#[test]
fn the_bands_around_the_speed_are_free() {
    let plant = plant(-0.3);
    for shape in Shape::ALL {
        let length = Length::Samples(20000);
        let with = ExciteOptions { notch: Some(ExcitationNotch::at(1500.0 / 60.0)), length, ramp: 1.0, ..usual(shape) };
        let found = excite(&plant.on(), &with).unwrap();
        assert_eq!(found.summary.notches.len(), 2);
        let least = if shape == Shape::Multisine { -25.0 } else { -45.0 };
        let free = excite(&plant.on(), &ExciteOptions { notch: None, ..with.clone() }).unwrap();
        for notch in &found.summary.notches {
            let before = Energy::of(free.alpha.as_ref(), 0, free.time).decibels(notch.band, with.band);
            let after = notch.decibels[0].unwrap();
            assert!(before > -8.0 && after < least, "{shape:?} at {:?}: {before:.1} to {after:.1} dB", notch.band);
        }
    }
    // Whole periods without a ramp have no line there at all.
    let lines = ExciteOptions {
        notch: Some(ExcitationNotch::at(25.0)),
        ramp: 0.0,
        length: Length::Samples(4000),
        ..usual(Shape::Multisine)
    };
    let alpha = excite(&plant.on(), &lines).unwrap().alpha;
    let line = |hz: f64| {
        let term = |k: usize| c64::new(0.0, -std::f64::consts::TAU * hz * TS * k as f64).exp() * alpha[(k, 0)];
        (0..4000).map(term).fold(c64::new(0.0, 0.0), |sum, x| sum + x).norm()
    };
    assert!(line(25.0) < 1e-9 && line(50.0) < 1e-9 && line(30.0) > 1.0);
}

/// Orthogonal over a period, silent in turn, and one input alone.
#[test]
fn inputs_are_kept_apart() {
    let time = Discrete::new(TS).unwrap();
    let nominal = StateSpace::gain(eye(2), time).unwrap();
    let controller = with_input_port(&StateSpace::gain(Mat::zeros(2, 2), time).unwrap()).unwrap();
    let channels = [Channel::new("a", "V"), Channel::new("b", "V")];
    let on = LoopToExcite { nominal: &nominal, controller: &controller, inputs: &channels, outputs: &channels };
    let of = |options: ExciteOptions| excite(&on, &options).unwrap();
    let together = of(ExciteOptions { ramp: 0.0, ..usual(Shape::Multisine) });
    let (a, b) = (together.alpha.col(0), together.alpha.col(1));
    assert!((a.transpose() * b).abs() < 1e-9 * a.norm_l2() * b.norm_l2());
    for shape in Shape::ALL {
        let turns = of(ExciteOptions { inputs: InputOrder::OneAtATime, amplitude: vec![0.5, 0.2], ..usual(shape) });
        let silent = |j: usize, from: usize| turns.alpha.col(j).subrows(from, 2000).norm_max() == 0.0;
        assert!(silent(0, 2000) && silent(1, 0) && turns.summary.inputs[1].peak <= 0.2, "{shape:?}");
    }
    let alone = of(ExciteOptions { amplitude: vec![0.0, 0.5], ..usual(Shape::Prbs) });
    assert!(alone.summary.inputs[0].peak == 0.0 && alone.summary.inputs[0].crest.is_none());
}

/// The prediction is the simulated loop; a limit is refused with the amplitude that keeps it, or kept by scaling.
#[test]
fn a_limit_is_kept() {
    let plant = plant(-0.3);
    let free = excite(&plant.on(), &usual(Shape::Prbs)).unwrap();
    let closed = youla::control::closed_loop(&plant.nominal, &plant.controller).unwrap();
    let driving = youla::linalg::block(&[&[free.alpha.as_ref(), Mat::zeros(4000, 1).as_ref()]]);
    let z = simulate(&closed, driving.as_ref(), &[0.0; 2]).unwrap();
    assert!((free.y.subrows(0, 4000) - z.subcols(1, 1)).norm_max() < 1e-12);
    let peak = free.summary.predicted[1].peak;
    let limited = ExciteOptions { limit_output: vec![0.5 * peak], limit_input: vec![10.0], ..usual(Shape::Prbs) };
    let error = excite(&plant.on(), &limited).unwrap_err();
    assert_eq!(error.kind(), youla::ErrorKind::BadInput);
    let Error::BeyondLimit { channel, permitted, .. } = &error else { panic!("{error}") };
    assert!(channel == "y" && (permitted[0] - 0.25).abs() < 1e-12, "{error}");
    let typed: f64 =
        error.to_string().split("amplitude is ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    excite(&plant.on(), &ExciteOptions { amplitude: vec![typed], ..limited.clone() }).unwrap();
    let scaled = excite(&plant.on(), &ExciteOptions { scale_to_limit: true, ..limited }).unwrap();
    assert!((scaled.summary.scaled_by.unwrap() - 0.5).abs() < 1e-12);
    assert!((scaled.summary.predicted[1].peak / peak - 0.5).abs() < 1e-12);
    // A gain that is off by theta moves the prediction by about as much, weighed by the sensitivity.
    let wrong = scaled.summary.predicted[1].with_model_error / scaled.summary.predicted[1].peak;
    assert!(scaled.summary.model_error.a_varied && (1.02..2.0).contains(&wrong), "{wrong}");
    let unstable = plant_unstable();
    let error = excite(&unstable.on(), &usual(Shape::Prbs)).unwrap_err();
    assert!(matches!(error, Error::Method(youla::Error::NotStabilising { pole, .. }) if pole.norm() > 1.0), "{error}");
}

fn plant_unstable() -> Plant {
    plant(40.0)
}

#[test]
fn options_without_a_meaning_are_refused() {
    let plant = plant(-0.3);
    let ok = || usual(Shape::Multisine);
    let cases = [
        ExciteOptions { amplitude: vec![], ..ok() },
        ExciteOptions { amplitude: vec![0.1, 0.1], ..ok() },
        ExciteOptions { amplitude: vec![-0.1], ..ok() },
        ExciteOptions { amplitude: vec![f64::NAN], ..ok() },
        ExciteOptions { band: [0.0, 10.0], ..ok() },
        ExciteOptions { band: [10.0, 500.0], ..ok() },
        ExciteOptions { band: [10.0, 10.0], ..ok() },
        ExciteOptions { length: Length::Samples(0), ..ok() },
        ExciteOptions { length: Length::Seconds(f64::INFINITY), ..ok() },
        ExciteOptions { ramp: 3.0, ..ok() },
        ExciteOptions { ramp: f64::NAN, ..ok() },
        ExciteOptions { periods: 0, ..ok() },
        ExciteOptions { periods: 4000, ..ok() },
        ExciteOptions { model_error: 1.0, ..ok() },
        ExciteOptions { noise: vec![0.0], ..ok() },
        ExciteOptions { damping_deviation: Some(1e-3), ..ok() },
        ExciteOptions { limit_output: vec![1.0, 2.0], ..ok() },
        ExciteOptions { notch: Some(ExcitationNotch::at(0.0)), ..ok() },
        ExciteOptions { shape: Shape::Prbs, band: [1e-9, 100.0], ..ok() },
    ];
    for options in cases {
        let error = excite(&plant.on(), &options).unwrap_err();
        assert_eq!(error.kind(), youla::ErrorKind::BadInput, "{options:?}: {error}");
    }
}

/// Prediction error of output-error models on y = G u + n in closed loop, by Gauss-Newton on the difference equation from the truth on:
/// another parametrisation and another domain than the bound's. 300 estimates determine a standard deviation to 4 %.
#[test]
fn the_bound_is_what_prediction_error_reaches() {
    const RUNS: usize = 300;
    const NOISE: f64 = 0.01;
    let plant = plant(-0.3);
    let options = ExciteOptions {
        length: Length::Samples(1500),
        noise: vec![NOISE],
        damping_deviation: Some(1e-4),
        ..usual(Shape::Multisine)
    };
    let found = excite(&plant.on(), &options).unwrap();
    let [bound] = found.summary.modes[..] else { panic!("one mode") };
    let closed = youla::control::closed_loop(&plant.nominal, &plant.controller).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let estimates: Vec<[f64; 2]> = (0..RUNS)
        .map(|_| {
            let alpha = Mat::from_fn(found.u.nrows(), 1, |k, _| if k < 1500 { found.alpha[(k, 0)] } else { 0.0 });
            let noise = Mat::from_fn(alpha.nrows(), 1, |_, _| NOISE * rng.sample::<f64, _>(StandardNormal));
            let driving = youla::linalg::block(&[&[alpha.as_ref(), noise.as_ref()]]);
            let z = simulate(&closed, driving.as_ref(), &[0.0; 2]).unwrap();
            estimate(plant.coefficients, z.subcols(0, 1), z.subcols(1, 1))
        })
        .collect();
    let ratio = |k: usize, bound: f64| {
        let mean = estimates.iter().map(|e| e[k]).sum::<f64>() / RUNS as f64;
        (estimates.iter().map(|e| (e[k] - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64).sqrt() / bound
    };
    let (hz, zeta) = (ratio(0, bound.hz_deviation.unwrap()), ratio(1, bound.zeta_deviation.unwrap()));
    assert!((0.85..1.15).contains(&hz) && (0.85..1.15).contains(&zeta), "{hz:.3} {zeta:.3}");
    // Four times as long at half the deviation, by the stated law and by computing it again.
    let needed = bound.needed.unwrap();
    let expected = 1.5 * (bound.zeta_deviation.unwrap() / 1e-4).powi(2);
    assert!((needed / expected - 1.0).abs() < 1e-12 && found.summary.needed == Some(needed));
    let longer = excite(&plant.on(), &ExciteOptions { length: Length::Samples(6000), ..options }).unwrap();
    let gain = bound.zeta_deviation.unwrap() / longer.summary.modes[0].zeta_deviation.unwrap();
    assert!((1.8..2.2).contains(&gain), "{gain}");
}

/// Natural frequency and damping ratio of the output-error estimate.
fn estimate(start: [f64; 4], u: MatRef<'_, f64>, y: MatRef<'_, f64>) -> [f64; 2] {
    let n = u.nrows();
    let mut theta = start;
    for _ in 0..4 {
        let [a1, a2, b1, b2] = theta;
        let filtered = |drive: &dyn Fn(usize) -> f64| {
            let mut x = vec![0.0; n];
            for k in 0..n {
                let back = |d: usize| if k >= d { x[k - d] } else { 0.0 };
                x[k] = drive(k) - a1 * back(1) - a2 * back(2);
            }
            x
        };
        let at = |x: &dyn Fn(usize) -> f64, k: usize, d: usize| if k >= d { x(k - d) } else { 0.0 };
        let input = |k: usize| u[(k, 0)];
        let model = filtered(&|k| b1 * at(&input, k, 1) + b2 * at(&input, k, 2));
        let (by_u, by_model) = (filtered(&input), filtered(&|k| model[k]));
        let psi = Mat::from_fn(n, 4, |k, j| {
            let source = if j < 2 { &by_model } else { &by_u };
            let sign = if j < 2 { -1.0 } else { 1.0 };
            sign * at(&|k| source[k], k, j % 2 + 1)
        });
        let e = Mat::from_fn(n, 1, |k, _| y[(k, 0)] - model[k]);
        use faer::linalg::solvers::SolveLstsq;
        let step = psi.qr().solve_lstsq(&e);
        (0..4).for_each(|j| theta[j] += step[(j, 0)]);
    }
    let [a1, a2, ..] = theta;
    let pole = c64::new(-a1 / 2.0, (a2 - a1 * a1 / 4.0).sqrt());
    let found = mode(Discrete::new(TS).unwrap(), pole);
    [found.hz, found.zeta]
}

/// The same system in two forms, an unstable plant, delays and an integrator.
#[test]
fn the_bound_holds_for_plants_of_all_kinds() {
    let deviation = |plant: &Plant, shape: Shape| {
        let options = ExciteOptions { noise: vec![0.1], ..usual(shape) };
        excite(&plant.on(), &options).unwrap().summary.modes
    };
    let simple = plant(-0.3);
    let expected = deviation(&simple, Shape::Multisine)[0].zeta_deviation.unwrap();
    // Three samples of delay: a shift, which leaves the information what it is.
    let time = simple.nominal.time();
    let delay = StateSpace::new(
        Mat::from_fn(3, 3, |i, j| if j + 1 == i { 1.0 } else { 0.0 }),
        Mat::from_fn(3, 1, |i, _| if i == 0 { 1.0 } else { 0.0 }),
        Mat::from_fn(1, 3, |_, j| if j == 2 { 1.0 } else { 0.0 }),
        Mat::zeros(1, 1),
        time,
    )
    .unwrap();
    let quiet = StateSpace::gain(Mat::zeros(1, 1), time).unwrap();
    let open = Plant { controller: with_input_port(&quiet).unwrap(), ..plant(0.0) };
    let alone = deviation(&open, Shape::Multisine)[0].zeta_deviation.unwrap();
    let delayed = Plant { nominal: open.nominal.then(&delay).unwrap(), ..plant(0.0) };
    let late = deviation(&delayed, Shape::Multisine);
    assert!((late[0].zeta_deviation.unwrap() / alone - 1.0).abs() < 1e-6, "{late:?} {alone}");
    assert!((alone / expected - 1.0).abs() < 0.5);
    // Twice the noise, twice the deviation; an excitation of a fifth, five times.
    let options = ExciteOptions { noise: vec![0.2], amplitude: vec![0.1], ..usual(Shape::Multisine) };
    let worse = excite(&simple.on(), &options).unwrap().summary.modes[0].zeta_deviation.unwrap();
    assert!((worse / expected - 10.0).abs() < 1e-6);
    let mut unstable = plant(-0.3);
    let growing =
        unstable.nominal.a().to_owned() * Scale(1.003 / unstable.nominal.worst_pole().unwrap().unwrap().norm());
    let (b, c) = (unstable.nominal.b().to_owned(), unstable.nominal.c().to_owned());
    unstable.nominal = StateSpace::new(growing, b, c, Mat::zeros(1, 1), time).unwrap();
    let damper = StateSpace::new(
        Mat::zeros(1, 1),
        eye(1),
        Mat::from_fn(1, 1, |_, _| 3.0),
        Mat::from_fn(1, 1, |_, _| -3.0),
        time,
    )
    .unwrap();
    unstable.controller = with_input_port(&damper).unwrap();
    let found = deviation(&unstable, Shape::Multisine);
    assert!(found[0].zeta < 0.0 && found[0].zeta_deviation.is_some_and(|d| d > 0.0 && d < 1.0), "{found:?}");
}

/// White noise of known size through the loop.
#[test]
fn the_noise_of_a_quiet_record_is_found() {
    let plant = plant(-0.3);
    let closed = youla::control::closed_loop(&plant.nominal, &plant.controller).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let driving = Mat::from_fn(20000, 2, |_, j| if j == 1 { 0.2 * rng.sample::<f64, _>(StandardNormal) } else { 0.0 });
    let z = simulate(&closed, driving.as_ref(), &[0.0; 2]).unwrap();
    let found = output_noise(&plant.on(), z.subcols(1, 1)).unwrap()[0];
    assert!((found / 0.2 - 1.0).abs() < 0.02, "{found}");
}
