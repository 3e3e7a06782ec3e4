//! Logs of a machine: excitation of every shape, noise, converters of 12 bits, a limit of the actuator.

use super::machines::{Machine, machine};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use youla::lti::{Discrete, Simulator, StateSpace};
use youla::signal::{Channel, Chirp, Excitation, Multisine, Prbs, SquareWaves};
use youla::{Mat, Result};
use youla_loop::check::{ChannelNames, CheckOptions, Finding, LoggedRecord, check_record, timing};

pub(crate) const SHAPES: [&str; 8] =
    ["white", "prbs", "square", "multisine", "chirp", "steps", "held noise", "multisine with a gap"];

/// What a log is made of.
#[derive(Clone, Copy)]
pub(crate) struct Recipe {
    pub(crate) kind: usize,
    pub(crate) shape: usize,
    pub(crate) at_reference: bool,
    /// Noise of the outputs over their deviation.
    pub(crate) noise: f64,
    pub(crate) coloured: bool,
    pub(crate) bits: Option<i32>,
    /// Limit of the input over the largest value that it had without one.
    pub(crate) limit: Option<f64>,
    pub(crate) excited: bool,
    pub(crate) declared: bool,
    /// Whether the excitation is logged.
    pub(crate) known: bool,
    /// Samples for which controller and excitation hold the input.
    pub(crate) hold: usize,
    /// Share of the record in which the excitation grows at its start and falls at its end.
    pub(crate) ramp: f64,
    pub(crate) samples: usize,
    pub(crate) seed: u64,
}

/// A log of a loop that is excited at its input, with everything declared.
pub(crate) const PLAIN: Recipe = Recipe {
    kind: 0,
    shape: 0,
    at_reference: false,
    noise: 0.03,
    coloured: false,
    bits: None,
    limit: None,
    excited: true,
    declared: true,
    known: true,
    hold: 1,
    ramp: 0.0,
    samples: 4000,
    seed: 0,
};

#[derive(Clone)]
pub(crate) struct Log {
    pub(crate) u: Mat<f64>,
    pub(crate) y: Mat<f64>,
    pub(crate) d: Option<Mat<f64>>,
    pub(crate) r: Option<Mat<f64>>,
    pub(crate) times: Vec<f64>,
    pub(crate) time: Discrete,
    pub(crate) controller: Option<StateSpace<Discrete>>,
    pub(crate) dead_time: usize,
}

fn excitation(recipe: &Recipe, channels: usize, time: Discrete, rng: &mut ChaCha8Rng) -> Result<Mat<f64>> {
    let n = recipe.samples;
    let rate = TAU / time.ts();
    let (low, high) = (0.002 * rate, [0.05, 0.1, 0.2, 0.4][rng.random_range(0..4)] * rate);
    let held = |rng: &mut ChaCha8Rng, [least, most]: [usize; 2], two_levels: bool| {
        let mut out = Mat::zeros(n, channels);
        for j in 0..channels {
            let (mut level, mut left) = (0.0, 0);
            for k in 0..n {
                if left == 0 {
                    let drawn: f64 = rng.sample(StandardNormal);
                    (level, left) = (if two_levels { drawn.signum() } else { drawn }, rng.random_range(least..=most));
                }
                left -= 1;
                out[(k, j)] = level;
            }
        }
        out
    };
    let generator = match SHAPES[recipe.shape % SHAPES.len()] {
        "prbs" => Excitation::Prbs(Prbs { order: 11, hold: rng.random_range(1..5), amplitude: 1.0 }),
        "square" => Excitation::SquareWaves(SquareWaves { hold_min: 3, hold_max: 60, amplitude: 1.0 }),
        "multisine" => {
            let period = n / [1, 1, 2, 4][rng.random_range(0..4)];
            Excitation::Multisine(Multisine { period, omega_min: low, omega_max: Some(high), ..Multisine::default() })
        }
        "multisine with a gap" => {
            let omitted = vec![[low + 0.3 * (high - low), low + 0.5 * (high - low)]];
            Excitation::Multisine(Multisine {
                period: n / 2,
                omega_min: low,
                omega_max: Some(high),
                omitted,
                ..Multisine::default()
            })
        }
        "chirp" => Excitation::Chirp(Chirp { omega_start: low, omega_end: high, amplitude: 1.0 }),
        "steps" => return Ok(held(rng, [60, 300], false)),
        "held noise" => {
            let hold = rng.random_range(2..9);
            return Ok(held(rng, [hold, hold], false));
        }
        _ => return Ok(held(rng, [1, 1], false)),
    };
    if !matches!(generator, Excitation::Chirp(_)) {
        return generator.generate(n, channels, time, rng);
    }
    // Chirps follow each other.
    let part = n / channels;
    let one = generator.generate(part, 1, time, rng)?;
    Ok(Mat::from_fn(n, channels, |k, j| if k / part == j { one[(k % part, 0)] } else { 0.0 }))
}

/// u and y of the loop, sample by sample.
fn run(machine: &Machine, [d, r, noise]: [&Mat<f64>; 3], limit: f64, step: f64, hold: usize) -> Result<[Mat<f64>; 2]> {
    let (plant, controller) = (Simulator::new(&machine.plant), Simulator::new(&machine.controller));
    let mut x = plant.start(&vec![0.0; machine.plant.order()])?;
    let mut c = controller.start(&vec![0.0; machine.controller.order()])?;
    let (n, m, p) = (d.nrows(), d.ncols(), noise.ncols());
    let (mut u, mut y) = (Mat::zeros(n, m), Mat::zeros(n, p));
    let (zero, mut applied) = (vec![0.0; m], vec![0.0; m]);
    for k in 0..n {
        let clean = plant.output(&mut x, &zero).to_vec();
        let round = |v: f64| if step > 0.0 { (v / step).round() * step } else { v };
        let measured: Vec<f64> = (0..p).map(|i| round(clean[i] + noise[(k, i)])).collect();
        if k % hold == 0 {
            let error: Vec<f64> = (0..p).map(|i| measured[i] - r[(k, i)]).collect();
            let command = controller.step(&mut c, &error).to_vec();
            applied = (0..m).map(|j| (command[j] + d[(k, j)]).clamp(-limit, limit)).collect();
        }
        plant.step(&mut x, &applied);
        (0..m).for_each(|j| u[(k, j)] = applied[j]);
        (0..p).for_each(|i| y[(k, i)] = measured[i]);
    }
    Ok([u, y])
}

pub(crate) fn size(x: &Mat<f64>) -> f64 {
    let one = |j: usize| {
        let mean = x.col(j).iter().sum::<f64>() / x.nrows() as f64;
        (x.col(j).iter().map(|v| (v - mean).powi(2)).sum::<f64>() / x.nrows() as f64).sqrt()
    };
    (0..x.ncols()).map(one).fold(0.0, f64::max)
}

pub(crate) fn log(recipe: &Recipe) -> Result<Log> {
    let mut rng = ChaCha8Rng::seed_from_u64(recipe.seed);
    let machine = machine(recipe.kind, recipe.hold, &mut rng)?;
    let (m, p, n) = (machine.plant.inputs(), machine.plant.outputs(), recipe.samples);
    let time = machine.plant.time();
    let zeros = |channels| Mat::<f64>::zeros(n, channels);
    let signal = excitation(recipe, if recipe.at_reference { p } else { m }, time, &mut rng)?;
    let signal = if recipe.excited { signal } else { 0.0 * signal };
    let size_at = |k: usize| match recipe.ramp * n as f64 {
        0.0 => 1.0,
        ramp => (k.min(n - 1 - k) as f64 / ramp).min(1.0),
    };
    let signal = Mat::from_fn(n, signal.ncols(), |k, j| size_at(k) * signal[(k / recipe.hold * recipe.hold, j)]);
    let (d, r) = if recipe.at_reference { (zeros(m), signal) } else { (signal, zeros(p)) };
    let [u, y] = run(&machine, [&d, &r, &zeros(p)], f64::INFINITY, 0.0, recipe.hold)?;
    let (largest, spread) = (u.norm_max(), if recipe.excited { size(&y) } else { 1.0 });
    let mut noise = Mat::from_fn(n, p, |_, _| recipe.noise * spread * rng.sample::<f64, _>(StandardNormal));
    if recipe.coloured {
        (1..n).for_each(|k| (0..p).for_each(|i| noise[(k, i)] = 0.8 * noise[(k - 1, i)] + 0.6 * noise[(k, i)]));
    }
    let bits = |largest: f64| recipe.bits.map_or(0.0, |bits| 2.4 * largest / f64::from(bits).exp2());
    let limit = recipe.limit.map_or(f64::INFINITY, |limit| limit * largest);
    let [mut u, y] = run(&machine, [&d, &r, &noise], limit, bits(y.norm_max()), recipe.hold)?;
    if recipe.bits.is_some() {
        let step = bits(u.norm_max());
        u = Mat::from_fn(n, m, |k, j| (u[(k, j)] / step).round() * step);
    }
    let times = (0..n).map(|k| k as f64 * time.ts()).collect();
    let (d, r) = (
        Some(d).filter(|_| recipe.known && !recipe.at_reference),
        Some(r).filter(|_| recipe.known && recipe.at_reference),
    );
    let controller = recipe.declared.then_some(machine.controller);
    Ok(Log { u, y, d, r, times, time, controller, dead_time: machine.dead_time })
}

fn channels(name: &str, data: Option<&Mat<f64>>) -> Vec<Channel> {
    (1..=data.map_or(0, Mat::ncols)).map(|j| Channel::new(format!("{name}{j}"), "")).collect()
}

impl Log {
    /// All findings, those of the clock too.
    pub(crate) fn check(&self) -> youla_loop::Result<Vec<Finding>> {
        let clock = timing(&self.times, Some(self.time.ts()), 1e-3);
        let mut all = clock.map(|found| found.findings("log", 1)).unwrap_or_default();
        let (d, r) = (&self.d, &self.r);
        let record = LoggedRecord {
            name: "log",
            time: self.time,
            first_row: 1,
            u: self.u.as_ref(),
            y: self.y.as_ref(),
            input_excitation: d.as_ref().map(|x| x.as_ref()),
            reference: r.as_ref().map(|x| x.as_ref()),
            alpha: None,
        };
        let names = ChannelNames {
            inputs: channels("u", Some(&self.u)),
            outputs: channels("y", Some(&self.y)),
            input_excitation: channels("d", d.as_ref()),
            reference: channels("r", r.as_ref()),
            alpha: Vec::new(),
        };
        all.extend(check_record(&record, &names, self.controller.as_ref().map(Into::into), &CheckOptions::default())?);
        Ok(all)
    }
}
