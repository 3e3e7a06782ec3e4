//! A recommended model of a simulated loop against the truth, without a tuning key.

use crate::common::{normal, rng};
use youla::control::{closed_loop, with_input_port};
use youla::identify::likelihood::{
    Experiment, LikelihoodOptions, LoopKnowledge, LoopSignals, Recommendation, recommend,
};
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace, frequency_response, simulate};
use youla::{Mat, c64};

fn matrix<const R: usize, const C: usize>(rows: [[f64; C]; R]) -> Mat<f64> {
    Mat::from_fn(R, C, |i, j| rows[i][j])
}

fn time() -> Discrete {
    Discrete::new(1e-3).unwrap()
}

/// A light mode at 48 Hz (damping 0.02) with a feedthrough d.
fn mode(d: f64) -> StateSpace<Discrete> {
    let pole = c64::cis(0.3) * 0.994;
    let a = matrix([[pole.re, pole.im], [-pole.im, pole.re]]);
    StateSpace::new(a, matrix([[0.1], [0.3]]), matrix([[1.0, 0.0]]), matrix([[d]]), time()).unwrap()
}

/// `u = K y + d`, K a gain with an integrator, which answers in the same sample.
fn controller() -> StateSpace<Discrete> {
    StateSpace::new(matrix([[1.0]]), matrix([[1.0]]), matrix([[-0.004]]), matrix([[-0.05]]), time()).unwrap()
}

fn identified(plant: &StateSpace<Discrete>, noise: f64, seed: u64) -> Recommendation {
    let (k, samples, kept) = (controller(), 9000, 6000);
    let rig = closed_loop(plant, &with_input_port(&k).unwrap()).unwrap();
    assert!(rig.is_stable().unwrap());
    let rng = &mut rng(seed);
    let (d, n) = (normal(rng, samples, 1), normal(rng, samples, 1) * faer::Scale(noise));
    let log = simulate(&rig, block(&[&[d.as_ref(), n.as_ref()]]).as_ref(), &vec![0.0; rig.order()]).unwrap();
    let (u, y) = (log.subcols(0, 1).to_owned(), log.subcols(1, 1).to_owned());
    let own = &u - &d;
    let signals = |from: usize, count: usize| LoopSignals {
        seen: y.subrows(from, count),
        explained: own.subrows(from, count),
        applied: u.subrows(from, count),
        excitation: Some(d.subrows(from, count)),
    };
    let record = |from: usize, count: usize| Experiment::new(u.subrows(from, count), y.subrows(from, count));
    let [estimation, fresh] = [vec![signals(0, kept)], vec![signals(kept, samples - kept)]];
    let known = LoopKnowledge::new(Some(&k), Some(&k), estimation, fresh).unwrap();
    let (first, second) = ([record(0, kept)], [record(kept, samples - kept)]);
    recommend(&first, &second, Some(&known), time(), &LikelihoodOptions::default()).unwrap()
}

/// Errors at 40 frequencies over the response, and over the stated deviations, root mean squares.
fn errors(found: &Recommendation, plant: &StateSpace<Discrete>) -> [f64; 2] {
    let deviation = &found.region;
    let (mut relative, mut stated, mut count) = (0.0, 0.0, 0.0);
    for k in (20..140).step_by(3) {
        let omega = [std::f64::consts::TAU * deviation.hz[k]];
        let of = |system: &StateSpace<Discrete>| frequency_response(system, &omega).unwrap().at(0)[(0, 0)];
        let miss = (of(&found.plant) - of(plant)).norm_sqr();
        relative += miss / of(plant).norm_sqr();
        stated += miss / deviation.absolute[k][(0, 0)].powi(2);
        count += 1.0;
    }
    [(relative / count).sqrt(), (stated / count).sqrt()]
}

/// Noise of a tenth of the output. With 4 parameters and 6000 samples the bound of the relative error is a few per mille; the
/// errors over their deviations have mean square 1 with 4 degrees of freedom: beyond 2.2 in one of 1000 loops.
#[test]
fn a_mode_under_an_integrator_is_found_to_the_accuracy_that_is_stated() {
    for seed in [1, 2, 3] {
        let found = identified(&mode(0.0), 0.3, seed);
        assert_eq!((found.order, found.dead_time.as_slice()), (2, &[0][..]), "seed {seed}");
        assert!(found.trusted(), "seed {seed}: {:?}", found.reasons());
        let [relative, stated] = errors(&found, &mode(0.0));
        assert!(relative < 0.05 && stated < 2.2, "seed {seed}: {relative} of the response, {stated} deviations");
        assert!(found.plant.d()[(0, 0)] == 0.0);
        let (mode, estimate) = (found.modes[0].mode, found.modes[0]);
        assert!((mode.hz - 47.755).abs() < 4.0 * estimate.hz_deviation, "{estimate:?}");
    }
}

/// The controller answers in the same sample, so that its inputs hold the noise of theirs: least squares would find D wrong by
/// 0.05 x (noise / input)^2, the likelihood does not.
#[test]
fn a_feedthrough_is_told_from_the_answer_of_the_controller() {
    for seed in [4, 5] {
        let found = identified(&mode(0.4), 1.0, seed);
        assert!(found.trusted(), "seed {seed}: {:?}", found.reasons());
        assert!((found.plant.d()[(0, 0)] - 0.4).abs() < 0.04, "seed {seed}: D = {:?}", found.plant.d());
        let [_, stated] = errors(&found, &mode(0.4));
        assert!(stated < 2.2, "seed {seed}: {stated} deviations");
    }
}
