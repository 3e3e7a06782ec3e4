//! Modes that the inputs hardly move: what a disturbance or a transient leaves in a model.

use super::problem::{Choice, Problem};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::driven::{is_line, longest};
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::{Point, energy};
use crate::identify::likelihood::search::with_best_ends;
use faer::c64;

/// Lines on each side of a mode at which it is not asked what moves it.
const AWAY: f64 = 5.0;
/// Power of the free motion of a mode over that which the inputs cause, away from its frequency, from which it is a disturbance: both are alike
/// for a mode on the unit circle that the inputs move. Modes of plants have 0.01 to 0.3, what unbalance and hum leave 3 to 8000.
const UNMOVED: f64 = 2.0;
/// Modes of a model that the inputs hardly move, from which they may stand for steps of load. Chosen: loops without load have at most one.
const FREE: usize = 2;
/// A frequency beyond all lines.
const NOWHERE: f64 = -1.0;

/// What moves one mode of a model, in the units of -2 log likelihood: the inputs, and its free motion.
pub(super) struct Motion {
    by_inputs: f64,
    by_ends: f64,
    /// What B must gain by Schwarz's criterion.
    price: f64,
}

impl Motion {
    /// Of a block, whose first state is given, `|C M B U|` and `|C M z t|` away from a frequency, a share of the sample rate.
    pub(super) fn of(
        (block, first): (&Block, usize),
        turns: f64,
        (spectra, noise): (&Spectra, &Noise),
        point: &Point,
    ) -> Self {
        let (m, s, p) = (spectra.inputs, block.states, spectra.outputs);
        let (mut inverse, mut x) = (vec![c64::ZERO; s * s], vec![c64::ZERO; s]);
        let [mut by_inputs, mut by_ends] = [(); 2].map(|()| Vec::with_capacity(spectra.records.len()));
        for (lines, t) in spectra.records.iter().zip(&point.ends) {
            let away = |k: usize| (k as f64 + 1.0 - turns * lines.samples as f64).abs() > AWAY;
            let [mut inputs, mut ends] = [(); 2].map(|()| vec![c64::ZERO; lines.z.len() * p]);
            for k in (0..lines.z.len()).filter(|k| away(*k)) {
                block.resolvent(lines.z[k], &mut inverse);
                let mut through = |out: &mut [c64], drive: &dyn Fn(usize) -> c64| {
                    let state = |i: usize| (0..s).fold(c64::ZERO, |sum, j| sum + inverse[s * i + j] * drive(j));
                    x.iter_mut().enumerate().for_each(|(i, x)| *x = state(i));
                    let rows = out.iter_mut().zip(block.c.chunks_exact(s));
                    rows.for_each(|(out, c)| *out = c.iter().zip(&x).fold(c64::ZERO, |sum, (c, x)| sum + x * *c));
                };
                let input = |i: usize| (0..m).fold(c64::ZERO, |sum, j| sum + lines.u[k * m + j] * block.b[i * m + j]);
                through(&mut inputs[k * p..(k + 1) * p], &input);
                through(&mut ends[k * p..(k + 1) * p], &|i| lines.z[k] * t[first + i]);
            }
            by_inputs.push(inputs);
            by_ends.push(ends);
        }
        let [by_inputs, by_ends] = [by_inputs, by_ends].map(|signal| energy(spectra, &signal, noise));
        Motion { by_inputs, by_ends, price: (spectra.samples() as f64).ln() * (m * s) as f64 }
    }

    /// Whether the free motion is distinctly more than what the inputs cause.
    pub(super) fn is_free(&self) -> bool {
        self.by_ends > UNMOVED * self.by_inputs
    }

    /// Whether the inputs hardly move it. A disturbance with whole periods in a record has no ends, and B stands for its one line.
    pub(super) fn is_unmoved(&self) -> bool {
        self.is_free() || self.by_inputs < self.price
    }
}

/// The blocks of a model of separated modes whose free motion is distinctly more than what the inputs cause, without those narrower than a line:
/// these are disturbances at one frequency.
pub(super) fn free_modes(spectra: &Spectra, point: &Point, noise: &Noise) -> Vec<usize> {
    let longest = longest(spectra);
    let blocks = &point.model.blocks;
    let firsts = blocks.iter().scan(0, |next, block| Some(std::mem::replace(next, *next + block.states)));
    let free = |at| Motion::of(at, NOWHERE, (spectra, noise), point).is_free();
    blocks
        .iter()
        .zip(firsts)
        .enumerate()
        .filter(|(_, at)| !is_line(at.0, longest) && free(*at))
        .map(|(k, _)| k)
        .collect()
}

impl Problem<'_> {
    /// Whether a walk that is watched stops at a model: several of its modes are free.
    pub(super) fn stops_at(&self, choice: &Choice) -> bool {
        if !self.watched || self.order.is_some() {
            return false;
        }
        let Some(model) = choice.found.point.model.separated() else { return false };
        let (spectra, noise) = (self.spectra(&choice.delays), &choice.found.noise);
        let point = with_best_ends(&spectra, model, noise);
        let free = free_modes(&spectra, &point, noise).len();
        free >= FREE && free < point.model.blocks.len()
    }
}
