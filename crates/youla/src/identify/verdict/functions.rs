//! The functions of the inputs, of velocities and of time that may explain what the model leaves, seen through the model.

use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use crate::identify::likelihood::search::model::Model;
use crate::linalg::TINY;
use crate::signal::of_two_real;
use faer::c64;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};

/// A function of an input in units of its size, or of the velocity that it causes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    /// Of an output that is a position, so many samples later: a dead time that the model has among its states is none of the friction. Those
    /// without a lead come first, so that the rest is what friction does not explain.
    Friction(usize),
    /// Of an output that is a velocity.
    FrictionAtSpeed(usize),
    Smooth(&'static str, fn(f64) -> f64),
    /// What a limit takes away, `u - clamp(u)`; with the limit below the input, what a dead zone lets pass.
    Beyond(f64),
    /// Last.
    Backlash,
}

/// Velocity of which friction changes its sign, in standard deviations.
const SMALL_VELOCITY: f64 = 0.1;
/// Time constants of a plant that a record holds at least where its output may be a velocity: an output that integrates the input for longer is
/// a position, whose sign follows slow loads.
const TIME_CONSTANTS: f64 = 10.0;
/// Samples that friction may come before what the model has of it, below the dead time of its input: beyond it the motion rests on what the feedback
/// makes of the noise that the function is to explain.
const LEADS: usize = 3;
/// Noise of the velocity of an output over the velocity that the model makes of the input, up to which the latter counts as known. Axes with encoders have
/// 0.01 to 0.02, unstable loops under load 0.2 to 3.
const NOISE_OF_MOTION: f64 = 0.05;
/// Kinds of friction without a lead, and with one.
pub(super) const FRICTIONS: usize = 2;
pub(super) const EARLIER: usize = 2 * (LEADS - 1);
/// Limits that are tried first, and those of which the most significant is taken where a function of the input explains too much of the output:
/// from a dead zone of a twentieth of the input to a limit that one sample in 700 of normal noise exceeds. What a limit between two of them
/// takes away is nearly a sum of what both take.
pub(super) const LIMITS: [f64; 2] = [1.0, 1.5];
pub(super) const FINE_LIMITS: [f64; 12] = [0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.25, 1.5, 1.8, 2.1, 2.6, 3.2];

impl Shape {
    pub(super) fn all(limits: &[f64]) -> Vec<Self> {
        let smooth = [
            Shape::Smooth("u^3", |u| u.powi(3)),
            Shape::Smooth("u |u|", |u| u * u.abs()),
            Shape::Smooth("u^2", |u| u * u),
        ];
        let beyond = limits.iter().map(|limit| Shape::Beyond(*limit));
        let frictions = |lead| [Shape::Friction(lead), Shape::FrictionAtSpeed(lead)];
        let earlier = (1..LEADS).flat_map(frictions);
        frictions(0).into_iter().chain(smooth).chain(beyond).chain(earlier).chain([Shape::Backlash]).collect()
    }

    pub(super) fn name(self) -> String {
        match self {
            Shape::Friction(_) => "dry friction".into(),
            Shape::FrictionAtSpeed(_) => "dry friction, the output being a speed".into(),
            Shape::Smooth(name, _) => name.into(),
            Shape::Beyond(limit) if limit < 0.5 => format!("a dead zone of {limit} deviations"),
            Shape::Beyond(limit) => format!("saturation at {limit} deviations"),
            Shape::Backlash => "backlash".into(),
        }
    }

    fn of(self, value: f64) -> f64 {
        match self {
            Shape::Friction(_) | Shape::FrictionAtSpeed(_) | Shape::Backlash => (value / SMALL_VELOCITY).tanh(),
            Shape::Smooth(_, f) => f(value),
            Shape::Beyond(limit) => value - value.clamp(-limit, limit),
        }
    }

    /// The motion of an output of which friction or play is a function.
    pub(super) fn motion(self, output: usize) -> Option<Motion> {
        match self {
            Shape::Friction(_) | Shape::Backlash => Some(Motion { output, at_speed: false }),
            Shape::FrictionAtSpeed(_) => Some(Motion { output, at_speed: true }),
            Shape::Smooth(..) | Shape::Beyond(_) => None,
        }
    }

    /// The function of its signal at a sample: of a velocity, friction takes that over the sample in which the input is held, play that before.
    fn at(self, signal: &[f64], t: usize) -> f64 {
        let place = match self {
            Shape::Friction(lead) | Shape::FrictionAtSpeed(lead) => (t + lead).min(signal.len() - 1),
            Shape::Backlash => t.saturating_sub(1),
            Shape::Smooth(..) | Shape::Beyond(_) => t,
        };
        self.of(signal[place])
    }
}

/// The motion of which friction or play is a function.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Motion {
    pub(super) output: usize,
    /// Whether it is the mean of that output over a sample, not its difference.
    at_speed: bool,
}

impl Motion {
    /// Its gain from the output at a frequency, a share of the sample rate.
    pub(super) fn gain(self, share: f64) -> f64 {
        let half = std::f64::consts::PI * share;
        if self.at_speed { half.cos() } else { 2.0 * half.sin() }
    }
}

/// The lines of a motion in a record.
pub(super) fn lines_of_motion(
    (lines, clean): (&Lines, &Vec<c64>),
    (model, p): (&Model, usize),
    of: Motion,
) -> Vec<c64> {
    let (moved, _) = motion_of((lines, clean), (model, p), of.output);
    let mut planner = FftPlanner::new();
    let (scale, y) = in_time(lines, &mut planner, |k| moved[k * p + of.output]);
    let (size, v) = if of.at_speed { (1.0, held(&y)) } else { velocity(&y) };
    let (fft, size) = (planner.plan_fft_forward(lines.samples), scale * size / (lines.samples as f64).sqrt());
    let [found, _] = lines_of_two(&*fft, lines.samples, |t| c64::new(size * v[t], 0.0));
    found
}

/// The lines of the outputs of which the motion of one is taken, and whether they are measured. What the model of an unstable plant makes of u rests on
/// later samples too, which depend on the noise. That is nothing where a pole grows by less than e^3 over the record, as an integrator may, or where the noise is
/// hardly any of the motion.
fn motion_of<'a>(
    (lines, clean): (&'a Lines, &'a [c64]),
    (model, p): (&Model, usize),
    output: usize,
) -> (&'a [c64], bool) {
    let grows = model.poles().iter().any(|pole| pole.norm().ln() * lines.samples as f64 > 3.0);
    let power = |of: &dyn Fn(usize) -> c64| {
        lines.z.iter().enumerate().map(|(k, z)| (z - 1.0).norm_sqr() * of(k * p + output).norm_sqr()).sum::<f64>()
    };
    let noisy = || power(&|k| lines.y[k] - clean[k]) > NOISE_OF_MOTION.powi(2) * power(&|k| clean[k]);
    if grows && noisy() { (&lines.y, true) } else { (clean, false) }
}

/// The functions of one record: what they do to the outputs, and how large they are without their linear parts.
pub(super) struct Shaped {
    /// Lines x p x functions.
    pub(super) columns: Vec<c64>,
    /// Root mean square of each function without its part along the input or the velocity.
    pub(super) sizes: Vec<f64>,
    /// Lines of the functions, those of one after the other.
    pub(super) plain: Vec<Vec<c64>>,
    /// The output that each input moves most.
    pub(super) moved_most: Vec<usize>,
}

/// The functions of one record seen through the model, lines x p x functions.
pub(super) fn columns(
    spectra: &Spectra,
    (model, delays, shapes): (&Model, &[usize], &[Shape]),
    lines: &Lines,
    (clean, time): (&[c64], &dyn Fn(usize) -> f64),
    planner: &mut FftPlanner<f64>,
) -> Shaped {
    let (m, p, half) = (spectra.inputs, spectra.outputs, lines.z.len());
    let (drift, count) = (shapes.len() * m, shapes.len() * m + 1);
    let responses: Vec<Vec<c64>> = lines.z.iter().map(|z| model.response(*z)).collect();
    let mut columns = vec![c64::ZERO; half * p * count];
    let (mut sizes, mut plain, mut moved_most) = (vec![0.0; drift], vec![Vec::new(); drift], vec![0; m]);
    let integrates = model.poles().iter().any(|p| p.norm().ln().abs() * (lines.samples as f64) < TIME_CONSTANTS);
    let root = (lines.samples as f64).sqrt();
    let fft = planner.plan_fft_forward(lines.samples);
    for i in 0..p {
        let (moved, _) = motion_of((lines, clean), (model, p), i);
        let (size, y) = in_time(lines, planner, |k| moved[k * p + i]);
        let [drifted, _] = lines_of_two(&*fft, lines.samples, |t| c64::new(time(t) * size * y[t] / root, 0.0));
        (0..half).for_each(|k| columns[(k * p + i) * count + drift] = drifted[k]);
    }
    for j in 0..m {
        let (_, u) = in_time(lines, planner, |k| lines.u[k * m + j]);
        // velocity of the output that this input moves most
        let power = |i: usize| responses.iter().map(|g| g[i * m + j].norm_sqr()).sum::<f64>();
        let seen = (0..p).max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(0);
        moved_most[j] = seen;
        let (moved, is_measured) = motion_of((lines, clean), (model, p), seen);
        let mut output = |y: &[c64]| in_time(lines, planner, |k| y[k * p + seen]).1;
        let without_noise = velocity(&output(clean)).1;
        let moved = output(moved);
        // The next sample of a measured output has noise that the function is to explain.
        let measured = is_measured.then(|| {
            let mut velocity = velocity(&moved).1;
            velocity.rotate_right(1);
            velocity
        });
        let speed = if is_measured { moved } else { held(&moved) };
        let base = |shape: Shape| match shape {
            Shape::Friction(_) => measured.as_ref().unwrap_or(&without_noise),
            Shape::FrictionAtSpeed(_) => &speed,
            Shape::Backlash => &without_noise,
            _ => &u,
        };
        let pairs = shapes.par_chunks(2).map(|pair| {
            let second = |t: usize| pair.get(1).map_or(0.0, |shape| shape.at(base(*shape), t));
            lines_of_two(&*fft, lines.samples, |t| c64::new(pair[0].at(base(pair[0]), t), second(t)))
        });
        let pairs: Vec<[Vec<c64>; 2]> = pairs.collect();
        for (f, (shape, of_shape)) in shapes.iter().zip(pairs.into_iter().flatten()).enumerate() {
            let f = f * m + j;
            let base = base(*shape);
            sizes[f] = beside(base.iter().map(|value| (shape.of(*value), *value)));
            for k in 0..half {
                let column = |i: usize| (k * p + i) * count + f;
                match shape {
                    Shape::Backlash => columns[column(seen)] = of_shape[k],
                    Shape::FrictionAtSpeed(_) if integrates => {}
                    Shape::Friction(lead) | Shape::FrictionAtSpeed(lead)
                        if *lead > if is_measured { 0 } else { delays[j] } => {}
                    _ => (0..p).for_each(|i| columns[column(i)] = responses[k][i * m + j] * of_shape[k]),
                }
            }
            plain[f] = of_shape;
        }
    }
    Shaped { columns, sizes, plain, moved_most }
}

/// Root mean square of a signal without its mean and its part along another one.
fn beside(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut count, mut means, mut squares, mut along) = (0.0, [0.0; 2], [0.0; 2], 0.0);
    for (value, base) in pairs {
        count += 1.0;
        means = [means[0] + value, means[1] + base];
        squares = [squares[0] + value * value, squares[1] + base * base];
        along += value * base;
    }
    let count = f64::max(count, 1.0);
    let power = |k: usize| squares[k] / count - (means[k] / count).powi(2);
    let along = along / count - means[0] * means[1] / (count * count);
    (power(0) - along * along / power(1).max(TINY)).max(0.0).sqrt()
}

/// Differences of neighbours, their size, and they themselves of unit size, with their mean: that from the last sample to the first is no motion, and in a record of travel larger
/// than all others together. Each is that of the sample that begins.
fn velocity(y: &[f64]) -> (f64, Vec<f64>) {
    let mut v: Vec<f64> = y.windows(2).map(|pair| pair[1] - pair[0]).collect();
    v.push(v.last().copied().unwrap_or(0.0));
    let size = (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt().max(TINY);
    v.iter_mut().for_each(|v| *v /= size);
    (size, v)
}

/// Means of neighbours: a speed over the sample that begins.
fn held(y: &[f64]) -> Vec<f64> {
    (0..y.len()).map(|t| 0.5 * (y[t] + y[(t + 1).min(y.len() - 1)])).collect()
}

/// Lines of two signals, the real and the imaginary parts of `both`, from the first above zero, over the root of their number of samples.
fn lines_of_two(fft: &dyn Fft<f64>, samples: usize, both: impl Fn(usize) -> c64) -> [Vec<c64>; 2] {
    let mut work: Vec<c64> = (0..samples).map(both).collect();
    fft.process(&mut work);
    let half = 0.5 / (samples as f64).sqrt();
    (1..=samples / 2).map(|k| <(c64, c64)>::from(of_two_real(&work, k, half))).unzip().into()
}

/// Size of a signal times the root of its number of samples, and the signal in time from its lines, without its mean and of unit size.
fn in_time(lines: &Lines, planner: &mut FftPlanner<f64>, pick: impl Fn(usize) -> c64) -> (f64, Vec<f64>) {
    let samples = lines.samples;
    let mut work = vec![c64::ZERO; samples];
    for k in 0..lines.z.len() {
        let v = pick(k);
        work[k + 1] = v;
        work[samples - 1 - k] = v.conj();
    }
    planner.plan_fft_inverse(samples).process(&mut work);
    let size = (work.iter().map(|v| v.re * v.re).sum::<f64>() / samples.max(1) as f64).sqrt().max(TINY);
    (size, work.iter().map(|v| v.re / size).collect())
}
