//! The bearing in closed loop.

use crate::common::{bearing, normal, rng, sampled};
use faer::Scale;
use rand::RngExt;
use youla::Mat;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr};
use youla::factor::{CoprimeFactors, YoulaSignals};
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace, simulate};
use youla_twin::rig::degraded;

/// The nominal model and the weights of the controller that is designed on it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Design {
    /// Factors on A and B of the nominal model.
    pub(crate) a_factor: f64,
    pub(crate) b_factor: f64,
    /// Weight of the commands per V^2, against 1 per um^2.
    pub(crate) input_weight: f64,
    /// Variance of the input noise, V^2, against 1 um^2 of output noise, for the observer.
    pub(crate) process_noise: f64,
}

/// The bearing under the observer-based controller of a nominal model with a factor on A.
pub(crate) struct Loop {
    pub(crate) plant: StateSpace<Discrete>,
    pub(crate) factors: CoprimeFactors<Discrete>,
    closed: StateSpace<Discrete>,
}

impl Loop {
    pub(crate) fn new(design: &Design) -> Self {
        let Design { a_factor, b_factor, input_weight, process_noise } = *design;
        let nominal =
            sampled(&degraded(&youla_twin::rig::Bearing::default().plant().unwrap(), a_factor, b_factor).unwrap());
        let weight = [1.0, 1.0, 10.0 / 1340f64.powi(2), 10.0 / 1340f64.powi(2), 0.0, 0.0];
        let q = Mat::from_fn(6, 6, |i, j| if i == j { weight[i] } else { 0.0 });
        let f = lqr(&nominal, &LqrWeights { q, r: eye(2) * Scale(input_weight), s: None }).unwrap().f;
        let noise =
            NoiseCovariance::at_inputs(&nominal, (eye(2) * Scale(process_noise)).as_ref(), eye(2).as_ref()).unwrap();
        let l = kalman(&nominal, &noise).unwrap().l;
        let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
        let plant = sampled(&bearing(0.0));
        let closed = closed_loop(&plant, &factors.j_k().unwrap()).unwrap();
        Loop { plant, factors, closed }
    }

    /// alpha and beta with +-0.5 V on alpha, held for 4 samples, and white output noise, um.
    pub(crate) fn record(&self, samples: usize, noise: f64, seed: u64) -> YoulaSignals {
        let rng = &mut rng(seed);
        let levels = Mat::from_fn(samples.div_ceil(4), 2, |_, _| if rng.random::<bool>() { 0.5 } else { -0.5 });
        let alpha = Mat::from_fn(samples, 2, |k, j| levels[(k / 4, j)]);
        let driving = block(&[&[alpha.as_ref(), (normal(rng, samples, 2) * Scale(noise)).as_ref()]]);
        let z = simulate(&self.closed, driving.as_ref(), &vec![0.0; self.closed.order()]).unwrap();
        self.factors.signals(z.subcols(0, 2), z.subcols(2, 2)).unwrap()
    }
}
