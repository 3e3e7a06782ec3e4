//! What the examples identify: machines in their loops, simulated.
#![allow(dead_code)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::{LqrWeights, NoiseCovariance, RunningController, closed_loop, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::identify::Identified;
use youla::linalg::{block, eye};
use youla::lti::{Continuous, Discrete, StateSpace, simulate};
use youla::signal::{Excitation, LoopRecord, SquareWaves};
use youla::{Mat, Result};
use youla_twin::rig::{Bearing, degraded};

/// A machine, what is believed of it, and the controller that stabilises both.
pub(crate) struct Machine {
    /// The truth.
    pub(crate) plant: StateSpace<Discrete>,
    /// The nominal model.
    pub(crate) nominal: StateSpace<Discrete>,
    /// State feedback and observer gain of the controller, u = F x^.
    pub(crate) gains: (Mat<f64>, Mat<f64>),
    /// Nominal model and controller in coprime factors, (13)-(15).
    pub(crate) factors: CoprimeFactors<Discrete>,
}

/// What a rig would log.
pub(crate) struct Log {
    /// The excitation, added to the command.
    pub(crate) alpha: Mat<f64>,
    /// The plant input.
    pub(crate) u: Mat<f64>,
    /// The measured output.
    pub(crate) y: Mat<f64>,
}

/// The gas bearing of the paper at 5 kHz; every entry of A of the nominal model is half of the truth.
pub(crate) fn bearing() -> Result<Machine> {
    let (time, truth) = (Discrete::new(2e-4)?, Bearing::default().plant()?);
    let nominal = degraded(&truth, 0.5, 1.0)?.zoh(time)?.balanced()?;
    machine(truth.zoh(time)?, nominal, 100.0)
}

/// Maglev, `x'' = 900 x + 500 u` at 1 kHz: unstable, with a pole at +30 rad/s that the nominal model puts at +26.
pub(crate) fn maglev() -> Result<Machine> {
    let time = Discrete::new(1e-3)?;
    let levitation = |pole: f64| {
        let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [pole * pole, 0.0]][i][j]);
        let (b, c) = (Mat::from_fn(2, 1, |i, _| [0.0, 500.0][i]), Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]));
        StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(time)
    };
    machine(levitation(30.0)?, levitation(26.0)?, 0.1)
}

fn machine(plant: StateSpace<Discrete>, nominal: StateSpace<Discrete>, input_weight: f64) -> Result<Machine> {
    let (p, m) = (nominal.outputs(), nominal.inputs());
    let (input, output) = (eye(m) * faer::Scale(input_weight), eye(p) * faer::Scale(input_weight));
    let f = lqr(&nominal, &LqrWeights::on_outputs(&nominal, eye(p).as_ref(), input.as_ref())?)?.f;
    let l = kalman(&nominal, &NoiseCovariance::at_inputs(&nominal, eye(m).as_ref(), output.as_ref())?)?.l;
    let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
    Ok(Machine { plant, nominal, gains: (f, l), factors })
}

impl Machine {
    /// The model that a log supports.
    pub(crate) fn identified(&self, log: &Log) -> Result<Identified> {
        let record = LoopRecord::new(self.plant.time(), log.u.clone(), log.y.clone())?.with_alpha(log.alpha.clone())?;
        let (f, l) = self.gains.clone();
        let controller = RunningController::observer(&self.nominal, f, l)?;
        youla::identify(&[record], &[], &controller, Some(&self.nominal), &Default::default())
    }

    /// The loop under square waves on alpha, with white output noise.
    pub(crate) fn log(&self, samples: usize, noise: f64, seed: u64) -> Result<Log> {
        let (p, m) = (self.plant.outputs(), self.plant.inputs());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let waves = Excitation::SquareWaves(SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 });
        let alpha = waves.generate(samples, m, self.plant.time(), &mut rng)?;
        let n = Mat::from_fn(samples, p, |_, _| noise * rng.sample::<f64, _>(StandardNormal));
        let rig = closed_loop(&self.plant, &self.factors.j_k()?)?;
        let log = simulate(&rig, block(&[&[alpha.as_ref(), n.as_ref()]]).as_ref(), &vec![0.0; rig.order()])?;
        Ok(Log { alpha, u: log.subcols(0, m).to_owned(), y: log.subcols(m, p).to_owned() })
    }
}
