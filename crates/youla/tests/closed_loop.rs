//! Identification of the bearing from its closed loop: what feedback does to the methods for open loops, and what not to
//! those that start from the predictor nor to the modified Hansen scheme.
#![allow(missing_docs)]

mod common;

use common::{bearing, normal, rng, sampled};
use faer::Scale;
use rand::RngExt;
use youla::Mat;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{AutomaticHorizon, Experiment, Order, Stability, SubspaceOptions, Weight, subspace};
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace, frequency_response, simulate};
use youla::rig::degraded;

/// A plant under the observer-based controller of a nominal model with `0.97 A` of the uncoupled bearing and full weight on
/// the displacements (rho = 1): feedback so strong that with noise of 1 um most of the input is fed-back noise.
struct Loop {
    plant: StateSpace<Discrete>,
    factors: CoprimeFactors<Discrete>,
}

impl Loop {
    fn new(cross_coupling: f64) -> Self {
        let uncoupled = youla::rig::Bearing::default().plant().unwrap();
        let nominal = sampled(&degraded(&uncoupled, 0.97, 1.0).unwrap());
        let weight = [1.0, 1.0, 10.0 / 1340f64.powi(2), 10.0 / 1340f64.powi(2), 0.0, 0.0];
        let q = Mat::from_fn(6, 6, |i, j| if i == j { weight[i] } else { 0.0 });
        let f = lqr(&nominal, &LqrWeights { q, r: eye(2), s: None }).unwrap().f;
        let noise = NoiseCovariance::at_inputs(&nominal, (eye(2) * Scale(0.25)).as_ref(), eye(2).as_ref()).unwrap();
        let l = kalman(&nominal, &noise).unwrap().l;
        let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
        Loop { plant: sampled(&bearing(cross_coupling)), factors }
    }

    /// u and y with +-0.5 V on alpha, held for 8 samples, and white output noise.
    fn record(&self, samples: usize, noise: f64, seed: u64) -> (Mat<f64>, Mat<f64>) {
        let rng = &mut rng(seed);
        let levels = Mat::from_fn(samples.div_ceil(8), 2, |_, _| if rng.random::<bool>() { 0.5 } else { -0.5 });
        let alpha = Mat::from_fn(samples, 2, |k, j| levels[(k / 8, j)]);
        let driving = block(&[&[alpha.as_ref(), (normal(rng, samples, 2) * Scale(noise)).as_ref()]]);
        let closed = closed_loop(&self.plant, &self.factors.j_k().unwrap()).unwrap();
        let z = simulate(&closed, driving.as_ref(), &vec![0.0; closed.order()]).unwrap();
        (z.subcols(0, 2).to_owned(), z.subcols(2, 2).to_owned())
    }

    /// Six states from u and y.
    fn identify(&self, weight: Weight, u: &Mat<f64>, y: &Mat<f64>) -> StateSpace<Discrete> {
        let past = weight.is_for_closed_loops().then_some(100);
        let options = SubspaceOptions { weight, past, order: Order::Fixed(6), ..options() };
        let experiment = [Experiment { u: u.as_ref(), y: y.as_ref() }];
        subspace(&experiment, self.plant.time(), &options).unwrap().model
    }

    /// G(S) with S of twelve states from alpha and beta.
    fn hansen(&self, u: &Mat<f64>, y: &Mat<f64>) -> StateSpace<Discrete> {
        let signals = self.factors.signals(u.as_ref(), y.as_ref()).unwrap();
        let options = SubspaceOptions { weight: Weight::Cva, order: Order::Fixed(12), ..options() };
        hansen(&self.factors, &[signals], &options).unwrap().plant
    }

    /// Root of the summed squared error of the frequency response from 20 to 600 Hz, relative.
    fn error(&self, model: &StateSpace<Discrete>) -> f64 {
        let hz = (0..200).map(|k| 20.0 * 30f64.powf(f64::from(k) / 199.0));
        let omega: Vec<f64> = hz.map(|hz| 2.0 * std::f64::consts::PI * hz).collect();
        let (found, truth) =
            (frequency_response(model, &omega).unwrap(), frequency_response(&self.plant, &omega).unwrap());
        let sum = |value: &dyn Fn(usize) -> f64| (0..omega.len()).map(|k| value(k).powi(2)).sum::<f64>();
        (sum(&|k| (found.at(k) - truth.at(k)).norm_l2()) / sum(&|k| truth.at(k).norm_l2())).sqrt()
    }
}

fn options() -> SubspaceOptions {
    SubspaceOptions { horizon: 30, stability: Stability::Allow, ..SubspaceOptions::default() }
}

fn median(mut values: [f64; 3]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[1]
}

/// Noise of 1 um at the outputs, medians of three seeds. Direct N4SID and CVA stay at 0.8 and 0.9 however long the record;
/// PBSIDopt, SSARX, PARSIM-S and the Hansen scheme fall to about 0.07 and 0.10 with 64000 samples.
#[test]
fn only_the_methods_for_open_loops_have_an_error_floor() {
    let bearing = Loop::new(0.0);
    let errors = |samples: usize| {
        let records = [1, 2, 3].map(|seed| bearing.record(samples, 1.0, seed));
        let by =
            |weight| median([0, 1, 2].map(|k| bearing.error(&bearing.identify(weight, &records[k].0, &records[k].1))));
        let scheme = median([0, 1, 2].map(|k| bearing.error(&bearing.hansen(&records[k].0, &records[k].1))));
        let direct = [Weight::N4sid, Weight::Cva].map(by);
        let predictor = [Weight::PbsidOpt, Weight::Ssarx, Weight::ParsimS].map(by);
        (direct, predictor, scheme)
    };
    let [short, medium, long] = [4_000, 16_000, 64_000].map(errors);
    let all = format!("{short:?}\n{medium:?}\n{long:?}");
    for k in 0..2 {
        assert!(long.0[k] > 0.6 && long.0[k] > 0.85 * short.0[k], "a floor is expected\n{all}");
    }
    for k in 0..3 {
        let fallen = [short.1[k] / medium.1[k], medium.1[k] / long.1[k]];
        assert!(fallen.iter().all(|f| *f > 1.5) && long.1[k] < 0.12, "{fallen:?}\n{all}");
    }
    assert!(short.2 / long.2 > 2.0 && long.2 < 0.16, "{all}");
}

/// Cross-coupling of a quarter of the stiffness: the bearing alone is unstable, |z| = 1.0084. With noise of 0.1 um and 8000
/// samples PBSIDopt puts one pair outside of the unit circle, within 6e-4 in radius and 1.5e-3 in angle, on each of 3 seeds.
#[test]
fn an_unstable_bearing_is_found_unstable() {
    let bearing = Loop::new(0.25);
    let outside = |system: &StateSpace<Discrete>| {
        system.poles().unwrap().into_iter().filter(|z| z.norm() > 1.0 && z.im > 0.0).collect::<Vec<_>>()
    };
    let truth = outside(&bearing.plant)[0];
    assert!((truth.norm() - 1.0084).abs() < 2e-4);
    for seed in 1..=3 {
        let (u, y) = bearing.record(8_000, 0.1, seed);
        for weight in [Weight::PbsidOpt, Weight::Ssarx, Weight::ParsimS] {
            let found = outside(&bearing.identify(weight, &u, &y));
            assert_eq!(found.len(), 1, "{weight:?}, seed {seed}: {found:?}");
            let (radius, angle) = ((found[0].norm() - truth.norm()).abs(), (found[0].arg() - truth.arg()).abs());
            assert!(radius < 6e-4 && angle < 1.5e-3, "{weight:?}, seed {seed}: {radius:e}, {angle:e}");
        }
        assert_eq!(outside(&bearing.hansen(&u, &y)).len(), 1);
    }
}

/// The horizons from the data: with noise of 1 um fed back and 16000 samples the predictor gets more than 30 lags, and the
/// models are within 1.3 times the error of those with 100 lags, chosen by someone who knows the plant.
#[test]
fn automatic_horizons_do_as_well_as_known_ones() {
    let bearing = Loop::new(0.0);
    let (u, y) = bearing.record(16_000, 1.0, 1);
    let experiment = [Experiment { u: u.as_ref(), y: y.as_ref() }];
    for weight in [Weight::PbsidOpt, Weight::Ssarx] {
        let automatic_horizon = Some(AutomaticHorizon { max: 150 });
        let options = SubspaceOptions { weight, automatic_horizon, order: Order::Fixed(6), ..options() };
        let found = subspace(&experiment, bearing.plant.time(), &options).unwrap();
        let (automatic, known) = (bearing.error(&found.model), bearing.error(&bearing.identify(weight, &u, &y)));
        println!("{weight:?}: p = {}, s = {}, {automatic:.3} against {known:.3}", found.past, found.horizon);
        assert!(found.past > 30, "{weight:?}: {}", found.past);
        assert!(automatic < 1.3 * known, "{weight:?}: {automatic} against {known}");
    }
}
