//! Loops u = K y + d from a family and a seed: machine, controller, excitation, noise, and what is not as assumed.

#[path = "../loops/mod.rs"]
mod loops;

use loops::{delayed, modal};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use youla::control::{LqrWeights, NoiseCovariance, RunningController, closed_loop, kalman, lqr, with_input_port};
use youla::linalg::eye;
use youla::lti::{Continuous, Discrete, StateSpace};
use youla::signal::{Chirp, Excitation, LoopRecord, Multisine, SquareWaves};
use youla::{Mat, Result};

/// Sample time, s.
const TS: f64 = 1e-3;
/// Largest magnitude of a pole of a loop: a record holds many of its time constants.
const SLOWEST: f64 = 0.9995;

/// What kind of machine.
#[derive(Clone, Copy)]
enum Kind {
    Modes,
    Drive,
    Levitation,
    Lags,
    Rotor,
    CloseModes,
    Slow,
}

/// What is not as assumed.
#[derive(Clone, Copy, PartialEq)]
enum Imperfection {
    Nothing,
    /// Output rounded to a step of a tenth of its size.
    Quantised,
    /// A line of the mains with the size of the outputs, and its third harmonic.
    Hum,
    /// Steps at the input, as large as a third of the excitation.
    LoadSteps,
    /// One output in 500 is off by ten times its size.
    Outliers,
    /// The gain rises by 5 % from the first to the last sample.
    GainDrift,
    /// Outputs and commands have offsets of fifty times their size.
    Offset,
    /// White noise at the input of the plant, a fifth of the excitation.
    InputNoise,
    /// The same size with a pole of 0.99.
    SlowTorque,
    /// No excitation.
    Quiet,
    /// The stated controller has twice the gain.
    WrongController,
    /// The input stops at half of the excitation, and the log shows what was asked for.
    HiddenLimit,
}

/// A family of loops.
pub(crate) struct Family {
    pub(crate) name: &'static str,
    kind: Kind,
    imperfection: Imperfection,
    samples: usize,
    /// Whether a model can be right.
    pub(crate) honest: bool,
}

const fn family(name: &'static str, kind: Kind, imperfection: Imperfection, samples: usize) -> Family {
    let honest =
        !matches!(imperfection, Imperfection::Quiet | Imperfection::WrongController | Imperfection::HiddenLimit);
    Family { name, kind, imperfection, samples, honest }
}

pub(crate) const FAMILIES: [Family; 20] = [
    family("modes", Kind::Modes, Imperfection::Nothing, 9000),
    family("drive", Kind::Drive, Imperfection::Nothing, 9000),
    family("levitation", Kind::Levitation, Imperfection::Nothing, 9000),
    family("lags with dead time", Kind::Lags, Imperfection::Nothing, 9000),
    family("rotor, 2 x 2", Kind::Rotor, Imperfection::Nothing, 9000),
    family("two modes 1 % apart", Kind::CloseModes, Imperfection::Nothing, 9000),
    family("900 samples", Kind::Modes, Imperfection::Nothing, 900),
    family("200 000 samples", Kind::Modes, Imperfection::Nothing, 200_000),
    family("quantised output", Kind::Drive, Imperfection::Quantised, 9000),
    family("hum of the mains", Kind::Modes, Imperfection::Hum, 9000),
    family("steps of load", Kind::Modes, Imperfection::LoadSteps, 9000),
    family("outliers", Kind::Modes, Imperfection::Outliers, 9000),
    family("gain that drifts by 5 %", Kind::Modes, Imperfection::GainDrift, 9000),
    family("offsets", Kind::Modes, Imperfection::Offset, 9000),
    family("noise at the input", Kind::Modes, Imperfection::InputNoise, 9000),
    family("slow torque of a drive", Kind::Drive, Imperfection::SlowTorque, 9000),
    family("five modes at a fiftieth of the rate", Kind::Slow, Imperfection::Nothing, 60_000),
    family("no excitation", Kind::Modes, Imperfection::Quiet, 9000),
    family("wrong controller", Kind::Modes, Imperfection::WrongController, 9000),
    family("limit that the log hides", Kind::Modes, Imperfection::HiddenLimit, 9000),
];

/// A loop.
pub(crate) struct Loop {
    pub(crate) plant: StateSpace<Discrete>,
    /// The controller that runs, and the one that is stated.
    pub(crate) controller: RunningController,
    pub(crate) stated: RunningController,
    imperfection: Imperfection,
    samples: usize,
}

/// What a machine logs.
pub(crate) struct Log {
    d: Mat<f64>,
    u: Mat<f64>,
    y: Mat<f64>,
}

impl Log {
    /// Two thirds to estimate, the rest fresh.
    pub(crate) fn records(&self, time: Discrete) -> Result<[Vec<LoopRecord>; 2]> {
        let kept = 2 * self.u.nrows() / 3;
        let record = |from: usize, rows: usize| -> Result<Vec<LoopRecord>> {
            let [d, u, y] = [&self.d, &self.u, &self.y].map(|signal| signal.subrows(from, rows).to_owned());
            Ok(vec![LoopRecord::new(time, u, y)?.with_input_excitation(d)?])
        };
        Ok([record(0, kept)?, record(kept, self.u.nrows() - kept)?])
    }
}

/// A number between two, with uniform logarithm.
fn between(rng: &mut impl Rng, [low, high]: [f64; 2]) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

impl Kind {
    /// The machine with some of its frequencies scaled: the truth with 1, a nominal model with another number.
    fn plant(self, scale: f64, rng: &mut impl Rng) -> Result<StateSpace<Discrete>> {
        let time = Discrete::new(TS)?;
        let mut mode = |hz: [f64; 2], gain: [f64; 2]| {
            (scale * between(rng, hz), between(rng, [0.005, 0.05]), [1.0, between(rng, gain)])
        };
        match self {
            Kind::Modes => {
                let modes =
                    [mode([8.0, 25.0], [0.5, 2.0]), mode([40.0, 80.0], [0.2, 1.0]), mode([120.0, 250.0], [0.05, 0.3])];
                modal(&modes, (1, 1), TS)
            }
            Kind::Slow => {
                let hz = [[1.0, 1.5], [2.0, 3.0], [4.0, 6.0], [8.0, 12.0], [15.0, 20.0]];
                let modes = hz.map(|hz| mode(hz, [0.2, 1.0]));
                modal(&modes, (1, 1), TS)
            }
            Kind::CloseModes => {
                let (hz, zeta, gains) = mode([20.0, 80.0], [0.5, 1.0]);
                let zeta = zeta.min(0.01);
                modal(&[(hz, zeta, gains), (1.01 * hz, 0.6 * zeta, [1.0, 0.7])], (1, 1), TS)
            }
            // Integrator, lag, resonance: modes at frequency near zero would need their own form.
            Kind::Drive => {
                let (gain, friction) = (between(rng, [100.0, 1000.0]), scale * between(rng, [2.0, 30.0]));
                let (w, zeta) = (TAU * scale * between(rng, [30.0, 90.0]), between(rng, [0.01, 0.05]));
                let mut a = Mat::zeros(4, 4);
                (a[(0, 1)], a[(1, 1)]) = (1.0, -friction);
                (a[(2, 3)], a[(3, 2)], a[(3, 3)]) = (w, -w, -2.0 * zeta * w);
                let b = Mat::from_fn(4, 1, |i, _| [0.0, gain, 0.0, gain / w][i]);
                let c = Mat::from_fn(1, 4, |_, j| [1.0, 0.0, 1.0, 0.0][j]);
                StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(time)
            }
            Kind::Levitation => {
                let (pole, gain) = (scale * between(rng, [15.0, 60.0]), between(rng, [200.0, 1000.0]));
                let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [pole * pole, 0.0]][i][j]);
                let b = Mat::from_fn(2, 1, |i, _| [0.0, gain][i]);
                let c = Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]);
                StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(time)
            }
            Kind::Lags => {
                let poles = [-scale * between(rng, [5.0, 15.0]), -scale * between(rng, [30.0, 90.0])];
                let a = Mat::from_fn(2, 2, |i, j| [[poles[0], 1.0], [0.0, poles[1]]][i][j]);
                let b = Mat::from_fn(2, 1, |i, _| [0.0, poles[0] * poles[1]][i]);
                let c = Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]);
                let lags = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(time)?;
                delayed(&lags, rng.random_range(2..9))
            }
            Kind::Rotor => {
                let modes = [[60.0, 90.0], [110.0, 160.0]].map(|hz| {
                    let (hz, zeta) = (scale * between(rng, hz), between(rng, [0.01, 0.04]));
                    let angle = TAU * rng.random::<f64>();
                    let output = angle + 0.2;
                    (hz, zeta, [angle.cos(), angle.sin(), output.cos(), output.sin()])
                });
                modal(&modes, (2, 2), TS)
            }
        }
    }
}

impl Family {
    /// The first loop from a seed that is fast enough.
    pub(crate) fn system(&self, seed: u64) -> Result<Loop> {
        let mut turn = 1000 * seed;
        loop {
            let draw = || ChaCha8Rng::seed_from_u64(turn);
            let plant = self.kind.plant(1.0, &mut draw())?;
            let nominal = self.kind.plant(between(&mut draw(), [0.93, 1.07]), &mut draw())?;
            let (m, p) = (plant.inputs(), plant.outputs());
            let weights = LqrWeights::on_outputs(&nominal, eye(p).as_ref(), (eye(m) * faer::Scale(3.0)).as_ref())?;
            let noise = NoiseCovariance::at_inputs(&nominal, eye(m).as_ref(), eye(p).as_ref())?;
            let (f, l) = (lqr(&nominal, &weights)?.f, kalman(&nominal, &noise)?.l);
            let controller = RunningController::observer(&nominal, f, l)?;
            let loop_ = closed_loop(&plant, &with_input_port(controller.system())?)?;
            if loop_.poles()?.iter().any(|pole| pole.norm() > SLOWEST) {
                turn += 1;
                continue;
            }
            let stated = match self.imperfection {
                Imperfection::WrongController => {
                    RunningController::new(controller.system().map_output(&(eye(m) * faer::Scale(2.0))))
                }
                _ => controller.clone(),
            };
            return Ok(Loop { plant, controller, stated, imperfection: self.imperfection, samples: self.samples });
        }
    }
}

impl Loop {
    pub(crate) fn log(&self, seed: u64) -> Result<Log> {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
        let (m, p) = (self.plant.inputs(), self.plant.outputs());
        let nyquist = TAU * 0.5 / TS;
        let excitation = match seed % 3 {
            0 => Excitation::SquareWaves(SquareWaves { amplitude: 1.0, hold_min: 1, hold_max: 25 }),
            1 => Excitation::Multisine(Multisine { period: 3000, amplitude: 2.0, ..Multisine::default() }),
            _ => Excitation::Chirp(Chirp { omega_start: TAU, omega_end: 0.9 * nyquist, amplitude: 1.5 }),
        };
        // The chirp of the fresh third is that of all frequencies too.
        let parts = [2 * self.samples / 3, self.samples - 2 * self.samples / 3];
        let [first, last] = parts.map(|rows| excitation.generate(rows, m, self.plant.time(), rng));
        let (first, last) = (first?, last?);
        let rows = first.nrows();
        let size = if self.imperfection == Imperfection::Quiet { 0.0 } else { 1.0 };
        let d = Mat::from_fn(self.samples, m, |t, j| size * if t < rows { first[(t, j)] } else { last[(t - rows, j)] });
        let (_, clean) = self.run(&d, &Mat::zeros(self.samples, p), (1.0, Imperfection::Nothing), rng);
        let power: f64 = clean.squared_norm_l2() / (self.samples * p) as f64;
        let typical = if power > 0.0 { power.sqrt() } else { 1.0 };
        let (level, colour) = (typical * between(rng, [0.01, 0.08]), if rng.random::<bool>() { 0.9 } else { 0.0 });
        let mut noise = Mat::from_fn(self.samples, p, |_, _| level * rng.sample::<f64, _>(StandardNormal));
        let shrink = (1.0f64 - colour * colour).sqrt();
        for t in 1..self.samples {
            (0..p).for_each(|i| noise[(t, i)] = colour * noise[(t - 1, i)] + shrink * noise[(t, i)]);
        }
        let (u, y) = self.run(&d, &noise, (typical, self.imperfection), rng);
        Ok(Log { d, u, y })
    }

    /// Input and output, sample by sample.
    fn run(
        &self,
        d: &Mat<f64>,
        noise: &Mat<f64>,
        (typical, imperfection): (f64, Imperfection),
        rng: &mut impl Rng,
    ) -> (Mat<f64>, Mat<f64>) {
        let (plant, k) = (&self.plant, self.controller.system());
        let (m, p) = (plant.inputs(), plant.outputs());
        let (mut u, mut y) = (Mat::zeros(self.samples, m), Mat::zeros(self.samples, p));
        let (mut x, mut xk) = (Mat::<f64>::zeros(plant.order(), 1), Mat::<f64>::zeros(k.order(), 1));
        let mut load = 0.0;
        for t in 0..self.samples {
            let time = t as f64 * TS;
            let mut seen = plant.c() * &x;
            for i in 0..p {
                seen[(i, 0)] += noise[(t, i)];
                match imperfection {
                    Imperfection::Quantised => seen[(i, 0)] = (10.0 * seen[(i, 0)] / typical).round() * typical / 10.0,
                    Imperfection::Hum => {
                        seen[(i, 0)] += typical * ((TAU * 50.0 * time).sin() + 0.3 * (TAU * 150.0 * time + 1.0).sin());
                    }
                    Imperfection::Offset => seen[(i, 0)] += 50.0 * typical,
                    Imperfection::Outliers if rng.random_range(0..500) == 0 => seen[(i, 0)] += 10.0 * typical,
                    _ => {}
                }
                y[(t, i)] = seen[(i, 0)];
            }
            let command = k.c() * &xk + k.d() * &seen;
            xk = k.a() * &xk + k.b() * &seen;
            if imperfection == Imperfection::LoadSteps && rng.random_range(0..800) == 0 {
                load = 0.6 * (rng.random::<f64>() - 0.5);
            }
            if imperfection == Imperfection::SlowTorque {
                load = 0.99 * load + 0.2 * (1.0f64 - 0.99 * 0.99).sqrt() * rng.sample::<f64, _>(StandardNormal);
            }
            let drift = 0.05 * (t as f64 / self.samples as f64 - 0.5);
            let mut acting = Mat::<f64>::zeros(m, 1);
            for j in 0..m {
                u[(t, j)] = command[(j, 0)] + d[(t, j)];
                acting[(j, 0)] = match imperfection {
                    Imperfection::InputNoise => u[(t, j)] + 0.2 * rng.sample::<f64, _>(StandardNormal),
                    Imperfection::GainDrift => u[(t, j)] * (1.0 + drift),
                    Imperfection::HiddenLimit => u[(t, j)].clamp(-0.5, 0.5),
                    _ => u[(t, j)] + load,
                };
            }
            x = plant.a() * &x + plant.b() * &acting;
        }
        (u, y)
    }
}
