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
    /// Of an output that is a position. The two kinds of friction come first, so that the rest is what friction does not explain.
    Friction,
    /// Of an output that is a velocity.
    FrictionAtSpeed,
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
/// Kinds of friction.
pub(super) const FRICTIONS: usize = 2;
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
        let frictions: [Self; FRICTIONS] = [Shape::Friction, Shape::FrictionAtSpeed];
        frictions.into_iter().chain(smooth).chain(beyond).chain([Shape::Backlash]).collect()
    }

    pub(super) fn name(self) -> String {
        match self {
            Shape::Friction => "dry friction".into(),
            Shape::FrictionAtSpeed => "dry friction, the output being a speed".into(),
            Shape::Smooth(name, _) => name.into(),
            Shape::Beyond(limit) if limit < 0.5 => format!("a dead zone of {limit} deviations"),
            Shape::Beyond(limit) => format!("saturation at {limit} deviations"),
            Shape::Backlash => "backlash".into(),
        }
    }

    fn of(self, value: f64) -> f64 {
        match self {
            Shape::Friction | Shape::FrictionAtSpeed | Shape::Backlash => (value / SMALL_VELOCITY).tanh(),
            Shape::Smooth(_, f) => f(value),
            Shape::Beyond(limit) => value - value.clamp(-limit, limit),
        }
    }
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
    (model, shapes): (&Model, &[Shape]),
    lines: &Lines,
    (clean, time): (&[c64], &dyn Fn(usize) -> f64),
    planner: &mut FftPlanner<f64>,
) -> Shaped {
    let (m, p, half) = (spectra.inputs, spectra.outputs, lines.z.len());
    let (drift, count) = (shapes.len() * m, shapes.len() * m + 1);
    let responses: Vec<Vec<c64>> = lines.z.iter().map(|z| model.response(*z)).collect();
    let mut columns = vec![c64::ZERO; half * p * count];
    let (mut sizes, mut plain, mut moved_most) = (vec![0.0; drift], vec![Vec::new(); drift], vec![0; m]);
    // What the model of an unstable plant makes of u rests on later samples too, which depend on the noise.
    let grows = model.poles().iter().any(|p| p.norm() > 1.0);
    let moved = if grows { &lines.y } else { clean };
    let integrates = model.poles().iter().any(|p| p.norm().ln().abs() * (lines.samples as f64) < TIME_CONSTANTS);
    let root = (lines.samples as f64).sqrt();
    let fft = planner.plan_fft_forward(lines.samples);
    for i in 0..p {
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
        let mut output =
            |y: &[c64], of: fn(c64) -> c64| in_time(lines, planner, |k| y[k * p + seen] * of(lines.z[k])).1;
        let velocity: fn(c64) -> c64 = |z| c64::ONE - z.conj();
        let without_noise = output(clean, velocity);
        let measured = grows.then(|| output(moved, velocity));
        let speed = output(moved, |_| c64::ONE);
        let base = |shape: Shape| match shape {
            Shape::Friction => measured.as_ref().unwrap_or(&without_noise),
            Shape::FrictionAtSpeed => &speed,
            Shape::Backlash => &without_noise,
            _ => &u,
        };
        let pairs = shapes.par_chunks(2).map(|pair| {
            let second = |t: usize| pair.get(1).map_or(0.0, |shape| shape.of(base(*shape)[t]));
            lines_of_two(&*fft, lines.samples, |t| c64::new(pair[0].of(base(pair[0])[t]), second(t)))
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
                    Shape::FrictionAtSpeed if integrates => {}
                    _ => (0..p).for_each(|i| columns[column(i)] = responses[k][i * m + j] * of_shape[k]),
                }
            }
            plain[f] = of_shape;
        }
    }
    Shaped { columns, sizes, plain, moved_most }
}

/// Root mean square of a signal without its mean and its part along another one of mean zero and unit size.
fn beside(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut count, mut mean, mut square, mut along) = (0.0, 0.0, 0.0, 0.0);
    for (value, base) in pairs {
        (count, mean, square, along) = (count + 1.0, mean + value, square + value * value, along + value * base);
    }
    let count = f64::max(count, 1.0);
    (square / count - (mean / count).powi(2) - (along / count).powi(2)).max(0.0).sqrt()
}

/// Lines of two signals, the real and the imaginary parts of `both`, from the first above zero, over the root of their number of samples.
fn lines_of_two(fft: &dyn Fft<f64>, samples: usize, both: impl Fn(usize) -> c64) -> [Vec<c64>; 2] {
    let mut work: Vec<c64> = (0..samples).map(both).collect();
    fft.process(&mut work);
    let half = 0.5 / (samples as f64).sqrt();
    (1..=samples / 2).map(|k| <(c64, c64)>::from(of_two_real(&work, k, half))).unzip().into()
}

/// Size of a signal and the signal in time from its lines, without its mean and of unit size.
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
