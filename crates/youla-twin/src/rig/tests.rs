//! The rig as a whole.

use super::sensor::noise_stream;
use super::*;
use crate::Error;
use faer::Scale;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::PI;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr, real_time_controller};
use youla::factor::CoprimeFactors;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace, simulate};
use youla::signal::{Excitation, SquareWaves};
use youla::{Mat, MatRef};
use youla_rt::State;

/// Samples in one turn at 2500 rpm and 5 kHz.
const TURN: usize = 120;

fn ideal() -> RigParameters {
    let mut parameters = RigParameters::shipped();
    parameters.sensor.noise.value = 0.0;
    parameters.sensor.adc = None;
    parameters.actuator.hysteresis = None;
    parameters.rotation.eccentricity.value = 0.0;
    parameters.rotation.run_out_amplitude.value = [0.0; 5];
    parameters
}

fn waves(samples: usize, amplitude: f64) -> Mat<f64> {
    let waves = SquareWaves { amplitude, hold_min: 5, hold_max: 40 };
    let time = Discrete::new(2e-4).unwrap();
    Excitation::SquareWaves(waves).generate(samples, 2, time, &mut ChaCha8Rng::seed_from_u64(1)).unwrap()
}

fn run(parameters: &RigParameters, fidelity: Fidelity, seed: u64, alpha: MatRef<'_, f64>) -> ExperimentRecord {
    let mut rig = BearingRig::new(parameters, fidelity, seed).unwrap();
    run_experiment(&mut rig, &mut OpenLoop, alpha, &parameters.safety).unwrap()
}

/// A gentle controller on a nominal model, and its factors.
fn observer(nominal: &StateSpace<Discrete>) -> (ObserverLoop<6>, CoprimeFactors<Discrete>) {
    let (one, calm) = (eye(2), Scale(20.0) * eye(2));
    let f = lqr(nominal, &LqrWeights::on_outputs(nominal, one.as_ref(), calm.as_ref()).unwrap()).unwrap().f;
    let l = kalman(nominal, &NoiseCovariance::at_inputs(nominal, one.as_ref(), calm.as_ref()).unwrap()).unwrap().l;
    let controller = real_time_controller(nominal, f.as_ref(), l.as_ref()).unwrap();
    let factors = CoprimeFactors::observer(nominal, f.as_ref(), l.as_ref()).unwrap();
    (ObserverLoop { controller, state: State::at_rest() }, factors)
}

/// Amplitude and angle of the line at a multiple of the speed, over whole turns at the end of a record.
fn line(y: MatRef<'_, f64>, channel: usize, multiple: f64, turns: usize) -> (f64, f64) {
    let (count, start) = (turns * TURN, y.nrows() - turns * TURN);
    let (mut re, mut im) = (0.0, 0.0);
    for k in start..y.nrows() {
        let angle = 2.0 * PI * multiple * k as f64 / TURN as f64;
        re += 2.0 / count as f64 * y[(k, channel)] * angle.cos();
        im -= 2.0 / count as f64 * y[(k, channel)] * angle.sin();
    }
    (re.hypot(im), im.atan2(re))
}

#[test]
fn the_linear_level_is_the_closed_loop() {
    let (parameters, seed, samples) = (RigParameters::shipped(), 7, 10_000);
    let mut rig = BearingRig::new(&parameters, Fidelity::Linear, seed).unwrap();
    let nominal = degraded(&Bearing::default().plant().unwrap(), 0.97, 1.0).unwrap();
    let (mut controller, factors) = observer(&nominal.zoh(rig.time()).unwrap().balanced().unwrap());
    let closed = closed_loop(&rig.true_plant().unwrap(), &factors.j_k().unwrap()).unwrap();
    let alpha = waves(samples, 0.5);
    let log = run_experiment(&mut rig, &mut controller, alpha.as_ref(), &parameters.safety).unwrap();

    let mut streams = [noise_stream(seed, 0), noise_stream(seed, 1)];
    let mut n = Mat::zeros(samples, 2);
    for k in 0..samples {
        for j in 0..2 {
            n[(k, j)] = parameters.sensor.noise.value * streams[j].sample::<f64, _>(StandardNormal);
        }
    }
    let inputs = block(&[&[alpha.as_ref(), n.as_ref()]]);
    let exact = simulate(&closed, inputs.as_ref(), &vec![0.0; closed.order()]).unwrap();
    for (first, found) in [(0, &log.u_applied), (2, &log.y), (4, &log.beta)] {
        let exact = exact.subcols(first, 2);
        let error = (found - exact).norm_max() / exact.norm_max();
        assert!(error < 1e-12, "outputs from {first}: {error}");
    }
    assert_eq!((log.aborted, log.u_commanded == log.u_applied), (None, true));
}

#[test]
fn without_its_imperfections_a_level_is_its_true_plant() {
    let alpha = waves(3000, 0.9);
    let mut bare = ideal();
    bare.sensor.low_pass = None;
    let rotating = Fidelity::Rotating { rpm: 2500.0 };
    for (parameters, fidelity) in
        [(bare, Fidelity::Instrumented), (ideal(), Fidelity::Instrumented), (ideal(), rotating)]
    {
        let rig = BearingRig::new(&parameters, fidelity, 1).unwrap();
        let plant = rig.true_plant().unwrap();
        let exact = simulate(&plant, alpha.as_ref(), &vec![0.0; plant.order()]).unwrap();
        let error = (run(&parameters, fidelity, 1, alpha.as_ref()).y - &exact).norm_max() / exact.norm_max();
        // The 10 kHz low-pass costs two digits in the exponential of the longer step.
        assert!(error < 1e-11, "{fidelity:?}: {error}");
    }
}

#[test]
fn without_imperfections_and_bandwidth_one_sample_of_delay_is_left() {
    let mut parameters = ideal();
    parameters.sensor.low_pass = None;
    let alpha = waves(3000, 0.9);
    let linear = run(&parameters, Fidelity::Linear, 1, alpha.as_ref()).y;
    let delayed = run(&parameters, Fidelity::Instrumented, 1, alpha.as_ref()).y;
    let error = (linear.subrows(0, 2999) - delayed.subrows(1, 2999)).norm_max() / linear.norm_max();
    assert!(error < 1e-12, "{error}");
}

#[test]
fn substeps_resolve_the_hysteresis() {
    let mut parameters = RigParameters::shipped();
    parameters.sensor.adc = None;
    parameters.sensor.noise.value = 0.0;
    let alpha = waves(2000, 1.0);
    let coarse = run(&parameters, Fidelity::Instrumented, 1, alpha.as_ref()).y;
    parameters.timing.substeps.value = 320;
    let fine = run(&parameters, Fidelity::Instrumented, 1, alpha.as_ref()).y;
    let error = (coarse - &fine).norm_max() / fine.norm_max();
    assert!(error < 1e-4, "{error}");
    parameters.actuator.hysteresis = None;
    let without = run(&parameters, Fidelity::Instrumented, 1, alpha.as_ref()).y;
    assert!((without - &fine).norm_max() / fine.norm_max() > 0.01);
}

#[test]
fn run_out_shows_as_lines_at_multiples_of_the_speed() {
    let mut parameters = RigParameters::shipped();
    parameters.rotation.eccentricity.value = 0.0;
    let still = Mat::zeros(100 * TURN, 2);
    let log = run(&parameters, Fidelity::Rotating { rpm: 2500.0 }, 3, still.as_ref());
    let rotation = &parameters.rotation;
    for h in 0..5 {
        let order = (h + 1) as f64;
        let (amplitude, angle) = line(log.y.as_ref(), 0, order, 100);
        assert!((amplitude - rotation.run_out_amplitude.value[h]).abs() < 0.015, "{order}x: {amplitude}");
        let off = angle - rotation.run_out_angle.value[h];
        assert!((off - 2.0 * PI * (off / (2.0 * PI)).round()).abs() < 0.3, "{order}x: {angle}");
        assert!((line(log.y.as_ref(), 1, order, 100).0 - amplitude).abs() < 0.03);
        assert!(line(log.y.as_ref(), 0, order + 0.5, 100).0 < 0.015);
    }
}

#[test]
fn unbalance_of_g_2_5_moves_the_rotor_by_its_computed_amplitude() {
    let mut parameters = ideal();
    parameters.rotation.eccentricity.value = RigParameters::shipped().rotation.eccentricity.value;
    parameters.rotation.flexible_mode = None;
    let log = run(&parameters, Fidelity::Rotating { rpm: 2500.0 }, 3, Mat::zeros(30 * TURN, 2).as_ref());
    let stiffness = bearing_at_speed(&parameters, 2500.0).unwrap().stiffness;
    let omega2 = (2500.0 * PI / 30.0).powi(2);
    for axis in 0..2 {
        let exact = parameters.rotation.eccentricity.value * omega2 / (-stiffness[axis][axis] - omega2);
        let (found, _) = line(log.y.as_ref(), axis, 1.0, 5);
        assert!((found / exact - 1.0).abs() < 0.02 && (0.34..0.40).contains(&found), "{axis}: {found} and {exact}");
    }
    // Forward whirl: the vertical axis follows the horizontal one by a quarter turn.
    let lag = line(log.y.as_ref(), 0, 1.0, 5).1 - line(log.y.as_ref(), 1, 1.0, 5).1;
    assert!((lag - 0.5 * PI).abs() < 0.05, "{lag}");
}

#[test]
fn saturation_is_counted() {
    let mut parameters = RigParameters::shipped();
    parameters.actuator.command_min.value = 4.6;
    parameters.actuator.command_max.value = 5.7;
    let alpha = waves(1000, 0.5);
    let log = run(&parameters, Fidelity::Instrumented, 1, alpha.as_ref());
    let low = [0, 1].map(|j| alpha.col(j).iter().filter(|a| **a < 0.0).count());
    assert_eq!(log.saturated, low);
    assert!(low[0] > 100 && low[0] < 900);
    assert!(log.u_applied.col(0).iter().all(|u| (-0.4 - 1e-12..=0.5).contains(u)));
    assert_eq!(log.u_commanded, alpha);
}

#[test]
fn the_excitation_is_limited_and_reported() {
    let parameters = ideal();
    let log = run(&parameters, Fidelity::Linear, 1, waves(400, 1.5).as_ref());
    assert_eq!(log.excitation_limited, [400, 400]);
    assert_eq!(log.alpha.norm_max(), 1.0);
}

#[test]
fn beyond_the_displacement_limit_the_excitation_is_ramped_out() {
    let mut parameters = RigParameters::shipped();
    parameters.safety.displacement_limit.value = 2.5;
    let log = run(&parameters, Fidelity::Instrumented, 1, waves(2000, 0.9).as_ref());
    let start = log.aborted.unwrap();
    let largest = |k: usize| log.y[(k, 0)].abs().max(log.y[(k, 1)].abs());
    assert!(largest(start) > 2.5 && (0..start).all(|k| largest(k) <= 2.5));
    for k in 0..2000 {
        let share = if k < start { 1.0 } else { (1.0 - (k - start) as f64 / 250.0).max(0.0) };
        assert!((log.alpha[(k, 0)].abs() - 0.9 * share).abs() < 1e-12, "{k}");
    }
    assert_eq!((log.y.nrows(), log.touched), (2000, None));
}

#[test]
fn a_rotor_that_touches_ends_the_run_with_its_data() {
    let mut parameters = RigParameters::shipped();
    parameters.rotation.cross_coupling.value = 0.25;
    let log = run(&parameters, Fidelity::Rotating { rpm: 0.0 }, 1, waves(5000, 0.2).as_ref());
    let end = log.touched.unwrap();
    assert_eq!((log.y.nrows(), log.beta.nrows()), (end + 1, end + 1));
    assert!(log.aborted.unwrap() < end && log.y.subrows(end, 1).norm_max() > 25.0);
    assert!(log.y.subrows(0, end).norm_max() <= 25.0);
}

#[test]
fn equal_seeds_give_equal_bits() {
    let parameters = RigParameters::shipped();
    let alpha = waves(500, 0.5);
    for fidelity in [Fidelity::Linear, Fidelity::Instrumented, Fidelity::Rotating { rpm: 2500.0 }] {
        let record = |seed| run(&parameters, fidelity, seed, alpha.as_ref());
        assert_eq!(record(11), record(11));
        assert_ne!(record(11).y, record(12).y);
    }
}

#[test]
fn what_cannot_be_run_is_refused() {
    let parameters = RigParameters::shipped();
    let rpm = |rpm| BearingRig::new(&parameters, Fidelity::Rotating { rpm }, 1);
    assert!(matches!(rpm(9000.0), Err(Error::Method(youla::Error::OutOfRange { .. }))));
    let mut wrong = parameters.clone();
    wrong.actuator.bias.value = -1.0;
    assert!(matches!(
        BearingRig::new(&wrong, Fidelity::Linear, 1),
        Err(Error::Method(youla::Error::OutOfRange { .. }))
    ));
    let mut rig = BearingRig::new(&parameters, Fidelity::Linear, 1).unwrap();
    let mut refused = |alpha: Mat<f64>| run_experiment(&mut rig, &mut OpenLoop, alpha.as_ref(), &parameters.safety);
    assert!(matches!(refused(Mat::zeros(10, 3)), Err(Error::Method(youla::Error::Shape { .. }))));
    assert!(matches!(refused(Mat::full(10, 2, f64::NAN)), Err(Error::Method(youla::Error::NotFinite { .. }))));
}
