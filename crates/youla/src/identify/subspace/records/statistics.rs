//! What one pass over the records tells of each channel: that it is finite and moves, its mean, spread and scale.

use crate::identify::subspace::ChannelScaling;
use crate::identify::subspace::records::view::View;
use crate::linalg::{self, TINY};
use crate::{Error, Result};
use faer::ColRef;
use rayon::prelude::*;

/// Samples of a piece.
const PIECE: usize = 1 << 14;

/// Moments of some samples of one channel; norms instead of their squares, which large numbers would overflow.
#[derive(Clone, Copy)]
struct Moments {
    first: f64,
    constant: bool,
    samples: f64,
    mean: f64,
    /// `sqrt(sum (v - mean)^2)`.
    spread: f64,
}

impl Moments {
    /// Not finite where a value is not.
    fn of(values: ColRef<'_, f64>) -> Moments {
        let (first, samples) = (values[0], values.nrows() as f64);
        let (peak, constant) =
            values.iter().fold((0.0_f64, true), |(peak, same), v| (peak.max(v.abs()), same && *v == first));
        let peak = peak.max(TINY);
        let (inverse, shift) = (1.0 / peak, first / peak);
        let (sum, squares) = values.iter().fold((0.0, 0.0), |(sum, squares), v| {
            let distance = v * inverse - shift;
            (sum + distance, squares + distance * distance)
        });
        let mean = sum / samples;
        let spread = (squares - sum * mean).max(if squares.is_finite() { 0.0 } else { f64::NAN }).sqrt();
        Moments { first, constant, samples, mean: first + peak * mean, spread: peak * spread }
    }

    fn and(self, later: Moments) -> Moments {
        let samples = self.samples + later.samples;
        let apart = later.mean - self.mean;
        let between = apart.abs() * (self.samples / samples).sqrt() * later.samples.sqrt();
        Moments {
            first: self.first,
            constant: self.constant && later.constant,
            samples,
            mean: self.mean + apart * (later.samples / samples),
            spread: self.spread.hypot(later.spread).hypot(between),
        }
    }

    fn rms(&self) -> f64 {
        (self.spread / self.samples.sqrt()).hypot(self.mean)
    }
}

/// Moments of all channels of `[u; y]` over what has been read.
pub(crate) struct Statistics {
    inputs: usize,
    channels: Vec<Moments>,
}

impl Statistics {
    pub(crate) fn new(inputs: usize) -> Self {
        Statistics { inputs, channels: Vec::new() }
    }

    /// Takes in an experiment; refuses a value that is not finite.
    pub(crate) fn add(&mut self, view: View<'_>, experiment: usize) -> Result<()> {
        let pieces = view.samples().div_ceil(PIECE);
        let cut = |k: usize| k * view.samples() / pieces;
        let found: Vec<Vec<Moments>> = (0..pieces)
            .into_par_iter()
            .map(|k| {
                let part = view.part(cut(k), cut(k + 1) - cut(k));
                part.u.col_iter().chain(part.y.col_iter()).map(Moments::of).collect()
            })
            .collect();
        if found.iter().flatten().any(|m| !(m.mean.is_finite() && m.spread.is_finite())) {
            check_finite(view, experiment)?;
        }
        let firsts: Vec<f64> = found.iter().take(1).flatten().map(|m| m.first).collect();
        found.into_iter().for_each(|piece| self.join(&firsts, piece));
        Ok(())
    }

    /// `firsts`: the first values of the experiment, within which a constant channel keeps its value.
    fn join(&mut self, firsts: &[f64], piece: Vec<Moments>) {
        if self.channels.is_empty() {
            self.channels = piece;
            return;
        }
        for ((all, mut later), first) in self.channels.iter_mut().zip(piece).zip(firsts) {
            later.constant &= later.first == *first;
            *all = all.and(later);
        }
    }

    /// By what each channel is to be divided; refuses channels that are constant throughout.
    pub(crate) fn scales(&self, scaling: ChannelScaling) -> Result<Vec<f64>> {
        let scale = |(j, moments): (usize, &Moments)| {
            if moments.constant {
                let (kind, j) = if j < self.inputs { ("input", j) } else { ("output", j - self.inputs) };
                let what = format!("{kind} channel {}", j + 1);
                return Err(Error::ConstantChannel { what, value: moments.first });
            }
            Ok(match scaling {
                ChannelScaling::None => 1.0,
                ChannelScaling::Rms => moments.rms(),
            })
        };
        self.channels.iter().enumerate().map(scale).collect()
    }

    /// `sqrt(sum (v - mean)^2)` of channel j.
    pub(crate) fn spread(&self, j: usize) -> f64 {
        self.channels[j].spread
    }
}

fn check_finite(view: View<'_>, experiment: usize) -> Result<()> {
    for (kind, values) in [("input", view.u), ("output", view.y)] {
        linalg::check_finite(&format!("the {kind} record of experiment {}", experiment + 1), values)?;
    }
    Ok(())
}
