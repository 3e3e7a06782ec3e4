//! The bearing under feedback so strong that most of its input is fed-back noise.

use super::{bearing, normal, rng, sampled};
use faer::Scale;
use rand::RngExt;
use youla::Mat;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Experiment, Order, Stability, SubspaceMethod, SubspaceOptions, subspace};
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace, frequency_response, simulate};
use youla_twin::rig::degraded;

/// A plant under the observer-based controller of a nominal model with `0.97 A` of the uncoupled bearing and full weight on
/// the displacements (rho = 1): feedback so strong that with noise of 1 um most of the input is fed-back noise.
pub(crate) struct Loop {
    pub(crate) plant: StateSpace<Discrete>,
    pub(crate) factors: CoprimeFactors<Discrete>,
    /// Gains of the controller's state feedback and observer.
    pub(crate) f: Mat<f64>,
    pub(crate) l: Mat<f64>,
}

impl Loop {
    pub(crate) fn new(cross_coupling: f64) -> Self {
        let uncoupled = youla_twin::rig::Bearing::default().plant().unwrap();
        let nominal = sampled(&degraded(&uncoupled, 0.97, 1.0).unwrap());
        let weight = [1.0, 1.0, 10.0 / 1340f64.powi(2), 10.0 / 1340f64.powi(2), 0.0, 0.0];
        let q = Mat::from_fn(6, 6, |i, j| if i == j { weight[i] } else { 0.0 });
        let f = lqr(&nominal, &LqrWeights { q, r: eye(2), s: None }).unwrap().f;
        let noise = NoiseCovariance::at_inputs(&nominal, (eye(2) * Scale(0.25)).as_ref(), eye(2).as_ref()).unwrap();
        let l = kalman(&nominal, &noise).unwrap().l;
        let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
        Loop { plant: sampled(&bearing(cross_coupling)), factors, f, l }
    }

    /// u and y with +-0.5 V on alpha, held for 8 samples, and white output noise.
    pub(crate) fn record(&self, samples: usize, noise: f64, seed: u64) -> (Mat<f64>, Mat<f64>) {
        self.record_with(samples, noise, seed, &Mat::zeros(samples, 2))
    }

    /// The same with a disturbance of the measured displacements.
    pub(crate) fn record_with(
        &self,
        samples: usize,
        noise: f64,
        seed: u64,
        disturbance: &Mat<f64>,
    ) -> (Mat<f64>, Mat<f64>) {
        let rng = &mut rng(seed);
        let levels = Mat::from_fn(samples.div_ceil(8), 2, |_, _| if rng.random::<bool>() { 0.5 } else { -0.5 });
        let alpha = Mat::from_fn(samples, 2, |k, j| levels[(k / 8, j)]);
        let driving = block(&[&[alpha.as_ref(), (normal(rng, samples, 2) * Scale(noise) + disturbance).as_ref()]]);
        let closed = closed_loop(&self.plant, &self.factors.j_k().unwrap()).unwrap();
        let z = simulate(&closed, driving.as_ref(), &vec![0.0; closed.order()]).unwrap();
        (z.subcols(0, 2).to_owned(), z.subcols(2, 2).to_owned())
    }

    /// Six states from u and y.
    pub(crate) fn identify(&self, method: SubspaceMethod, u: &Mat<f64>, y: &Mat<f64>) -> StateSpace<Discrete> {
        let past = if method.is_for_closed_loops() { 100 } else { 30 };
        let options = SubspaceOptions { method, past: Some(past), order: Order::Fixed(6), ..options() };
        let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
        subspace(&experiment, self.plant.time(), &options).unwrap().model
    }

    /// G(S) with S of twelve states from alpha and beta.
    pub(crate) fn hansen(&self, u: &Mat<f64>, y: &Mat<f64>) -> StateSpace<Discrete> {
        let signals = self.factors.signals(u.as_ref(), y.as_ref()).unwrap();
        let options = SubspaceOptions { method: SubspaceMethod::Cva, order: Order::Fixed(12), ..options() };
        hansen(&self.factors, &[signals], &options).unwrap().plant
    }

    /// Root of the summed squared error of the frequency response from 20 to 600 Hz, relative.
    pub(crate) fn error(&self, model: &StateSpace<Discrete>) -> f64 {
        let hz = (0..200).map(|k| 20.0 * 30f64.powf(f64::from(k) / 199.0));
        let omega: Vec<f64> = hz.map(|hz| 2.0 * std::f64::consts::PI * hz).collect();
        let (found, truth) =
            (frequency_response(model, &omega).unwrap(), frequency_response(&self.plant, &omega).unwrap());
        let sum = |value: &dyn Fn(usize) -> f64| (0..omega.len()).map(|k| value(k).powi(2)).sum::<f64>();
        (sum(&|k| (found.at(k) - truth.at(k)).norm_l2()) / sum(&|k| truth.at(k).norm_l2())).sqrt()
    }
}

pub(crate) fn options() -> SubspaceOptions {
    SubspaceOptions { horizon: 30, stability: Stability::Allow, ..SubspaceOptions::default() }
}
