//! A levitated mass: unstable, held by a PD controller that feeds strong sensor noise back.
//!
//! Truth: `y'' = w^2 y + b i`, `i' = p (u - i)`, with w = 40 rad/s, b = 1600 mm/(A s^2), p = 2 pi 150 rad/s; position y in mm,
//! current command u in A. Loop: `u = -K (y + n) + d`, n white.
//!
//! The case is chosen for its message: more than half of u is fed-back noise, so that subspace identification on (u, y) is
//! biased. On the low-noise bearing (`--machine bearing`) direct identification is as good as the scheme.

use super::Demo;
use crate::Result;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use std::path::Path;
use youla::Mat;
use youla::lti::{Continuous, Discrete, StateSpace};
use youla::signal::{Channel, Excitation, LoopRecord, SquareWaves};
use youla_io::ChannelSpec;
use youla_run::{RunRecords, RunSettings, SourceFile};

/// What `youla identify` would be given; the paths are those of the run folder.
const SETTINGS: &str = include_str!("levitation.toml");
/// Stiffness rate w in rad/s, gain b in mm/(A s^2), pole of the amplifier in rad/s.
const RATE: f64 = 40.0;
const GAIN: f64 = 1600.0;
const AMPLIFIER: f64 = 150.0 * TAU;
/// Controller: the difference equation of SETTINGS.
const NUMERATOR: [f64; 2] = [27.0, -26.0];
const DENOMINATOR: f64 = -0.5;
/// White sensor noise, mm rms.
const NOISE: f64 = 0.05;
/// A record to simulate.
struct Recording {
    name: &'static str,
    samples: usize,
    /// Amplitude of the excitation at the plant input, A.
    amplitude: f64,
}

/// 40 s with a weak excitation to identify from; 20 s with four times the amplitude, so that the motion exceeds the noise, to verify.
const EXPERIMENTS: [Recording; 2] = [
    Recording { name: "estimation", samples: 40_000, amplitude: 0.25 },
    Recording { name: "verification", samples: 20_000, amplitude: 1.0 },
];

/// Settings and records; the same seed gives the same records.
pub(super) fn levitation(seed: u64) -> Result<Demo> {
    let settings = RunSettings { seed: Some(seed), ..RunSettings::parse(SETTINGS, Path::new("demo"))? };
    let time = Discrete::new(settings.data.sample_time.unwrap_or(1e-3))?;
    let plant = plant()?.zoh(time)?;
    let mut records = Vec::new();
    for (k, experiment) in EXPERIMENTS.iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(k as u64);
        records.push(record(&plant, experiment, &mut rng)?);
    }
    let [estimation, verification] = [records.remove(0), records.remove(0)].map(|record| vec![record]);
    let source = SourceFile { path: "levitated mass".into(), purpose: "simulated".into(), sha256: String::new() };
    let channels = |specs: &[ChannelSpec]| specs.iter().map(|s| Channel::new(&s.name, &s.unit)).collect();
    let records = RunRecords {
        time,
        inputs: channels(&settings.data.inputs),
        outputs: channels(&settings.data.outputs),
        estimation,
        verification,
        sources: vec![source],
        segments: Vec::new(),
        measured: None,
        true_plant: Some(plant),
    };
    Ok(Demo { settings, records })
}

/// States: position, velocity, current.
fn plant() -> youla::Result<StateSpace<Continuous>> {
    let a = [[0.0, 1.0, 0.0], [RATE * RATE, 0.0, GAIN], [0.0, 0.0, -AMPLIFIER]];
    let a = Mat::from_fn(3, 3, |i, j| a[i][j]);
    let b = Mat::from_fn(3, 1, |i, _| if i == 2 { AMPLIFIER } else { 0.0 });
    let c = Mat::from_fn(1, 3, |_, j| if j == 0 { 1.0 } else { 0.0 });
    StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)
}

/// One experiment from rest, sample by sample.
fn record(plant: &StateSpace<Discrete>, experiment: &Recording, rng: &mut impl Rng) -> Result<LoopRecord> {
    let &Recording { name, samples, amplitude } = experiment;
    let waves = SquareWaves { amplitude, hold_min: 2, hold_max: 20 };
    let d = Excitation::SquareWaves(waves).generate(samples, 1, plant.time(), rng)?;
    let mut x = Mat::<f64>::zeros(plant.order(), 1);
    let (mut error, mut command) = (0.0, 0.0);
    let (mut u, mut y) = (Mat::zeros(samples, 1), Mat::zeros(samples, 1));
    for k in 0..samples {
        y[(k, 0)] = x[(0, 0)] + NOISE * rng.sample::<f64, _>(StandardNormal);
        let before = std::mem::replace(&mut error, -y[(k, 0)]);
        command = NUMERATOR[0] * error + NUMERATOR[1] * before - DENOMINATOR * command;
        u[(k, 0)] = command + d[(k, 0)];
        x = plant.a() * &x + plant.b() * u.row(k).as_mat();
    }
    Ok(LoopRecord::new(plant.time(), u, y)?.with_input_excitation(d)?.named(name))
}
