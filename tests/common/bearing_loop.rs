//! The bearing in closed loop, and the count of how often regions hold the truth.

use crate::common::{bearing, normal, rng, sampled};
use faer::Scale;
use rand::RngExt;
use youla::Mat;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr};
use youla::factor::{CoprimeFactors, YoulaSignals};
use youla::identify::hansen::{HansenModel, hansen};
use youla::identify::subspace::{Order, ResponseBand, Stability, SubspaceMethod, SubspaceOptions};
use youla::linalg::{block, eye};
use youla::lti::{Discrete, Mode, StateSpace, frequency_response, simulate};
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
    pub(crate) deviation: StateSpace<Discrete>,
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
        let deviation = factors.deviation_of(&plant).unwrap();
        Loop { plant, factors, deviation, closed }
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

pub(crate) fn options() -> SubspaceOptions {
    SubspaceOptions {
        method: SubspaceMethod::Cva,
        horizon: 20.into(),
        order: Order::Fixed(8),
        stability: Stability::Allow,
        ..SubspaceOptions::default()
    }
}

/// Counts over runs; shares of 1.
#[derive(Debug, Default)]
pub(crate) struct Coverage {
    pub(crate) runs: usize,
    pub(crate) unstable: usize,
    /// Regions of the complex values of S and of G(S), and intervals of the magnitude.
    pub(crate) deviation: f64,
    pub(crate) plant: f64,
    pub(crate) magnitude: f64,
    /// Intervals of frequency and damping of the modes of the plant.
    pub(crate) hz: f64,
    pub(crate) zeta: f64,
    /// Runs in which the data contradicted the nominal model.
    pub(crate) against_nominal: f64,
    pub(crate) statistics: Vec<f64>,
    /// Per frequency of S: coverage.
    pub(crate) by_frequency: Vec<f64>,
    /// Mean of the errors of S over their root mean square, over frequencies: the share of bias; and the root mean square over
    /// the claimed deviation.
    pub(crate) bias: f64,
    pub(crate) spread: f64,
    sums: Vec<[f64; 4]>,
    /// Per frequency: share of bias in the error, and root mean square error over the claimed deviation.
    pub(crate) details: Vec<[f64; 2]>,
}

/// Frequencies inside of the excited band, Hz.
pub(crate) const HZ: [f64; 8] = [30.0, 70.0, 120.0, 160.0, 200.0, 230.0, 300.0, 450.0];

impl Coverage {
    pub(crate) fn add(&mut self, of: &Loop, signals: &YoulaSignals, options: &SubspaceOptions) {
        let omega: Vec<f64> = HZ.iter().map(|hz| std::f64::consts::TAU * hz).collect();
        let found = hansen(&of.factors, std::slice::from_ref(signals), &options.clone().into()).unwrap();
        let HansenModel { deviation, uncertainty, evidence, .. } = &found;
        self.unstable += usize::from(!deviation.stability.stable);
        let uncertainty = uncertainty.as_ref().unwrap();
        if let Some(reason) = uncertainty.refusal() {
            panic!("{reason}");
        }
        let share = 1.0 / (self.runs + 1) as f64;
        let mean = |old: &mut f64, new: f64| *old += share * (new - *old);
        let s = deviation.uncertainty.as_ref().unwrap().response(&omega).unwrap().unwrap();
        let g = uncertainty.response(&omega).unwrap().unwrap();
        let (held, _) = count(&s, &of.deviation, &omega);
        self.by_frequency.resize(HZ.len(), 0.0);
        self.by_frequency.iter_mut().zip(&held).for_each(|(old, new)| mean(old, *new));
        mean(&mut self.deviation, held.iter().sum::<f64>() / held.len() as f64);
        let (held, magnitude) = count(&g, &of.plant, &omega);
        mean(&mut self.plant, held.iter().sum::<f64>() / held.len() as f64);
        mean(&mut self.magnitude, magnitude);
        let bands = uncertainty.modes().unwrap();
        let modes: Vec<Mode> = of.plant.modes().unwrap().into_iter().filter(|m| m.pole.im > 0.0).collect();
        let (mut hz, mut zeta) = (0.0, 0.0);
        for mode in &modes {
            let near = |m: &&youla::identify::subspace::ModeBand| (m.mode.pole - mode.pole).norm();
            let band = bands.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            hz += f64::from(u8::from(band.hz[0] <= mode.hz && mode.hz <= band.hz[1]));
            zeta += f64::from(u8::from(band.zeta[0] <= mode.zeta && mode.zeta <= band.zeta[1]));
        }
        mean(&mut self.hz, hz / modes.len() as f64);
        mean(&mut self.zeta, zeta / modes.len() as f64);
        if let Some(Ok(evidence)) = evidence {
            mean(&mut self.against_nominal, f64::from(u8::from(evidence.against_nominal())));
            self.statistics.push(evidence.statistic);
        }
        self.biases(&s, &of.deviation, &omega);
        self.runs += 1;
    }

    fn biases(&mut self, band: &ResponseBand, truth: &StateSpace<Discrete>, omega: &[f64]) {
        let truth = frequency_response(truth, omega).unwrap();
        self.sums.resize(omega.len() * 4, [0.0; 4]);
        for (k, i, j) in (0..omega.len()).flat_map(|k| (0..4).map(move |e| (k, e % 2, e / 2))) {
            let e = band.response.at(k)[(i, j)] - truth.at(k)[(i, j)];
            let [rr, _, ii] = band.covariance[band.place(k, i, j)];
            let sum = &mut self.sums[band.place(k, i, j)];
            *sum = [sum[0] + e.re, sum[1] + e.im, sum[2] + e.norm_sqr(), sum[3] + rr + ii];
        }
        let runs = (self.runs + 1) as f64;
        let places = self.sums.len() as f64;
        self.bias = self.sums.iter().map(|s| ((s[0] * s[0] + s[1] * s[1]) / runs / s[2]).sqrt()).sum::<f64>() / places;
        self.details = (0..omega.len())
            .map(|k| {
                let of = &self.sums[4 * k..4 * k + 4];
                let bias = of.iter().map(|s| ((s[0] * s[0] + s[1] * s[1]) / runs / s[2]).sqrt()).sum::<f64>() / 4.0;
                [bias, of.iter().map(|s| (s[2] / s[3]).sqrt()).sum::<f64>() / 4.0]
            })
            .collect();
        self.spread = self.sums.iter().map(|s| (s[2] / s[3]).sqrt()).sum::<f64>() / places;
    }
}

/// Share of the entries whose region holds the truth, per frequency, and of the intervals of the magnitude.
fn count(band: &ResponseBand, truth: &StateSpace<Discrete>, omega: &[f64]) -> (Vec<f64>, f64) {
    let truth = frequency_response(truth, omega).unwrap();
    let mut magnitude = 0.0;
    let held = (0..omega.len())
        .map(|k| {
            let mut held = 0.0;
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let value = truth.at(k)[(i, j)];
                let [low, high] = band.magnitude[band.place(k, i, j)];
                held += 0.25 * f64::from(u8::from(band.holds(k, i, j, value)));
                magnitude +=
                    0.25 / omega.len() as f64 * f64::from(u8::from(low <= value.norm() && value.norm() <= high));
            }
            held
        })
        .collect();
    (held, magnitude)
}
