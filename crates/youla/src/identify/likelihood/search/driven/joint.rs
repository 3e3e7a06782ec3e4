//! Noise at the inputs of a plant that several outputs see together.
//!
//! ```text
//! v = H epsilon,     H = 1 + C M K + C M B K_w / (z - c),     M = (z I - A)^-1
//! ```
//! with the gains K of the states and K_w of the colours of one Kalman filter, whose innovations epsilon are those of all outputs, also of
//! an unstable plant. With a filter for each output the cross spectrum of the residuals is not described, and in a loop the plant is wrong by
//! up to its own size where two coupled axes have slow torque.
//!
//! The noise w of an input differs between the two ends of a record, `t_w = w(N) - w(0)`: what `z t_w / (z - c)` drives is taken from the
//! residual of each record by least squares. A mode in excess of the plant would describe it otherwise.

use super::gains::hidden;
use super::sizes::Bins;
use super::{Entry, Kalman, longest};
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use crate::identify::likelihood::search::autoregression::Regression;
use crate::identify::likelihood::search::block::{Block, invert};
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::state_lanes::resolvent;
use faer::prelude::*;
use faer::{Mat, Side, c64};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::ops::Range;

/// The filter `1 / H` of all outputs.
#[derive(Debug, Clone)]
pub(crate) struct Joint {
    /// Its Kalman filter.
    pub(crate) kalman: Kalman,
    /// The blocks that outputs see, triangular, and K of their states, s x p row by row.
    blocks: Vec<(Block, Vec<f64>)>,
}

impl Joint {
    /// The most likely variances of such noise in the residuals, with the autoregressions behind it; `None` where there is none.
    pub(crate) fn new(
        model: &Model,
        (spectra, bins): (&Spectra, &Bins),
        behind: &[Regression],
        coloured: bool,
    ) -> Option<Self> {
        let entry = bins.entry(behind, spectra.samples() as f64, coloured)?;
        Joint::of_entry(model, &hidden(model, longest(spectra), 0..model.outputs), entry)
    }

    /// Noise of known variances and colour, without the blocks that are hidden from all outputs.
    pub(crate) fn of_entry(model: &Model, hidden: &[usize], entry: Entry) -> Option<Self> {
        Joint::of_filter(model, hidden, Kalman::new(model, hidden, (0..model.outputs, entry))?.0)
    }

    /// The same with gains that are free, the pole of the colours, and about the covariance of the innovations.
    pub(crate) fn of_gain(
        model: &Model,
        hidden: &[usize],
        gain: (Mat<f64>, Option<f64>),
        size: &Mat<f64>,
    ) -> Option<Self> {
        Joint::of_filter(model, hidden, Kalman::of_gain(model, hidden, gain, size)?)
    }

    fn of_filter(model: &Model, hidden: &[usize], kalman: Kalman) -> Option<Self> {
        let mut blocks = Vec::with_capacity(model.blocks.len());
        let mut states = 0..0;
        for (place, block) in model.blocks.iter().enumerate() {
            states = states.end..states.end + block.states;
            if hidden.contains(&place) {
                continue;
            }
            // The same states for every column.
            let column = |o: usize| states.clone().map(|i| kalman.gain[(i, o)]).collect::<Vec<f64>>();
            let columns: Vec<(Block, Vec<f64>)> =
                (0..model.outputs).map(|o| block.triangular(&column(o))).collect::<Option<_>>()?;
            let gain = (0..block.states).flat_map(|i| columns.iter().map(move |(_, k)| k[i])).collect();
            blocks.push((columns.into_iter().next()?.0, gain));
        }
        Some(Joint { kalman, blocks })
    }

    /// H and its inverse on lines.
    #[inline(always)]
    pub(crate) fn filter(&self, z: &Lanes, to: &mut Filters) {
        let p = self.kalman.gain.ncols();
        let m = self.kalman.of_colour.nrows();
        let Filters { h, whitener, response, colour, work, .. } = to;
        (0..p * p).for_each(|x| h[x] = if x % (p + 1) == 0 { Lanes::ZERO.shifted(1.0) } else { Lanes::ZERO });
        response[..p * m].fill(Lanes::ZERO);
        for (block, gain) in &self.blocks {
            let s = block.states;
            resolvent(block, z, work);
            for o in 0..p {
                for j in 0..s {
                    let mut left = Lanes::ZERO;
                    (0..s).for_each(|i| left.add_scaled(&work[i * s + j], block.c[o * s + i]));
                    (0..p).for_each(|l| h[o * p + l].add_scaled(&left, gain[j * p + l]));
                    (0..m).for_each(|q| response[o * m + q].add_scaled(&left, block.b[j * m + q]));
                }
            }
        }
        if let Some(pole) = self.kalman.entry.colour {
            *colour = z.shifted(-pole).inverse();
            for (o, response) in response[..p * m].chunks(m).enumerate() {
                for l in 0..p {
                    let mut sum = Lanes::ZERO;
                    response.iter().enumerate().for_each(|(q, g)| sum.add_scaled(g, self.kalman.of_colour[(q, l)]));
                    h[o * p + l].add_product(&sum, colour);
                }
            }
        }
        if p == 1 {
            whitener[0] = h[0].inverse();
            return;
        }
        if p == 2 {
            // The adjugate over the determinant.
            let mut scale = h[0].times(&h[3]);
            scale.add_scaled(&h[1].times(&h[2]), -1.0);
            scale = scale.inverse();
            (whitener[0], whitener[3]) = (h[3].times(&scale), h[0].times(&scale));
            (whitener[1], whitener[2]) = (h[1].times(&scale).scaled(-1.0), h[2].times(&scale).scaled(-1.0));
            return;
        }
        let mut one = vec![c64::ZERO; p * p];
        for lane in 0..LANES {
            invert(p, |i, j| c64::new(h[i * p + j].re[lane], h[i * p + j].im[lane]), &mut one);
            whitener.iter_mut().zip(&one).for_each(|(w, v)| (w.re[lane], w.im[lane]) = (v.re, v.im));
        }
    }

    /// The residuals, lines x p, behind `1 / H`, without what the ends of the colours drive.
    pub(crate) fn rest(&self, spectra: &Spectra, residuals: &[Vec<c64>]) -> Vec<Vec<c64>> {
        spectra.records.par_iter().zip(residuals).map(|(lines, v)| self.rest_and_ends(lines, v).0).collect()
    }

    /// The same of one record, and t_w.
    pub(crate) fn rest_and_ends(&self, lines: &Lines, v: &[c64]) -> (Vec<c64>, Vec<f64>) {
        let of = |range| Arch::new().dispatch(Rest { joint: self, lines, v, range });
        let [mut rest, driven] = parts(lines.z.len()).map(of).reduce(Default::default, |[mut a, mut b], [c, d]| {
            a.extend(c);
            b.extend(d);
            [a, b]
        });
        let ends = self.best_ends(lines, &rest, &driven);
        if !ends.is_empty() {
            for (rest, columns) in rest.iter_mut().zip(driven.chunks(ends.len())) {
                *rest -= columns.iter().zip(&ends).fold(c64::ZERO, |sum, (v, end)| sum + *v * *end);
            }
        }
        (rest, ends)
    }

    /// Number of the ends of the colours.
    pub(crate) fn ends(&self) -> usize {
        self.kalman.of_colour.nrows()
    }

    /// Least squares of the rest, lines x p, by columns, lines x p x m, weighted by the covariance of the innovations.
    fn best_ends(&self, lines: &Lines, rest: &[c64], columns: &[c64]) -> Vec<f64> {
        let (m, p) = (self.ends(), self.kalman.gain.ncols());
        if m == 0 {
            return Vec::new();
        }
        let precision = self.kalman.precision();
        let (mut gram, mut cross) = (Mat::<f64>::zeros(m, m), Mat::<f64>::zeros(m, 1));
        for ((weight, rest), columns) in lines.weight.iter().zip(rest.chunks(p)).zip(columns.chunks(p * m)) {
            for x in 0..p * p {
                let (i, l) = (x / p, x % p);
                let scale = precision[(i, l)] * weight * weight;
                for a in 0..m {
                    let left = columns[i * m + a].conj() * scale;
                    cross[(a, 0)] += (left * rest[l]).re;
                    (0..m).for_each(|b| gram[(a, b)] += (left * columns[l * m + b]).re);
                }
            }
        }
        // Of several ends that drive the same, the smallest.
        (0..m).for_each(|a| gram[(a, a)] *= 1.0 + 1e-10);
        let Ok(factor) = gram.llt(Side::Lower) else { return vec![0.0; m] };
        factor.solve(&cross).col(0).iter().copied().collect()
    }

    /// Its variables on lines.
    pub(crate) fn filters(&self) -> Filters {
        let (p, inputs) = (self.kalman.gain.ncols(), self.ends());
        let largest = self.blocks.iter().map(|(block, _)| block.states).max().unwrap_or(0);
        let zeros = |count: usize| vec![Lanes::ZERO; count];
        Filters {
            h: zeros(p * p),
            whitener: zeros(p * p),
            inputs,
            response: zeros(p * inputs),
            colour: Lanes::ZERO,
            work: zeros(largest * largest),
        }
    }
}

/// H and its inverse on lines, p x p row by row, and what they are computed from.
pub(crate) struct Filters {
    pub(crate) h: Vec<Lanes>,
    pub(crate) whitener: Vec<Lanes>,
    /// Inputs whose noise has a colour: all or none.
    inputs: usize,
    /// C M B of these, p x inputs, and 1 / (z - c).
    response: Vec<Lanes>,
    colour: Lanes,
    work: Vec<Lanes>,
}

impl Filters {
    /// What the end of the colour of an input drives at an output, given `z` times the share of the ends.
    #[inline(always)]
    pub(crate) fn driven(&self, (output, input): (usize, usize), ends: &Lanes) -> Lanes {
        self.response[output * self.inputs + input].times(&self.colour).times(ends)
    }

    /// `1 / H` times values of all outputs, which are `stride` apart.
    #[inline(always)]
    pub(crate) fn apply(&self, values: &mut [Lanes], stride: usize, v: &mut [Lanes]) {
        let p = v.len();
        (0..p).for_each(|o| v[o] = values[o * stride]);
        for o in 0..p {
            let to = &mut values[o * stride];
            to.set_product(&self.whitener[o * p], &v[0]);
            (1..p).for_each(|l| to.add_product(&self.whitener[o * p + l], &v[l]));
        }
    }
}

/// Residuals behind `1 / H` on a part of the lines, with the widest instructions that the processor has.
struct Rest<'a> {
    joint: &'a Joint,
    lines: &'a Lines,
    v: &'a [c64],
    range: Range<usize>,
}

impl NullaryFnOnce for Rest<'_> {
    /// The residuals, lines x p, and what the ends of the colours drive, lines x p x m, both behind `1 / H`.
    type Output = [Vec<c64>; 2];

    #[inline(always)]
    fn call(self) -> [Vec<c64>; 2] {
        let Rest { joint, lines, v, range } = self;
        let (m, p) = (joint.ends(), joint.kalman.gain.ncols());
        let mut filters = joint.filters();
        let (mut values, mut own) = (vec![Lanes::ZERO; p * (1 + m)], vec![Lanes::ZERO; p]);
        let mut out = [Vec::with_capacity(range.len() * p), Vec::with_capacity(range.len() * p * m)];
        for first in range.clone().step_by(LANES) {
            let line = |l: usize| (first + l).min(range.end - 1);
            let z = Lanes::gather(|l| lines.z[line(l)]);
            let ends = Lanes::gather(|l| lines.ends[line(l)]).times(&z);
            joint.filter(&z, &mut filters);
            for o in 0..p {
                values[o * (1 + m)] = Lanes::gather(|l| v[line(l) * p + o]);
                (0..m).for_each(|a| values[o * (1 + m) + 1 + a] = filters.driven((o, a), &ends));
            }
            (0..=m).for_each(|column| filters.apply(&mut values[column..], 1 + m, &mut own));
            for l in 0..LANES.min(range.end - first) {
                for values in values.chunks(1 + m) {
                    let of = |v: &Lanes| c64::new(v.re[l], v.im[l]);
                    out[0].push(of(&values[0]));
                    out[1].extend(values[1..].iter().map(of));
                }
            }
        }
        out
    }
}
