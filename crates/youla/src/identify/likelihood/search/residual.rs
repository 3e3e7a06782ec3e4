//! What a model leaves of the outputs on the lines of a record.

use super::model::Model;
use super::state_lanes::states;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::{Lines, parts};
use faer::c64;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::ops::Range;

/// `Y - G U - C (z I - A)^-1 z t - z / (z - 1) t_d`, lines x p, where t_d is the drift of the outputs behind t.
pub(crate) fn residual(model: &Model, lines: &Lines, t: &[f64]) -> Vec<c64> {
    let triangular = triangular(model, t);
    let (model, t) = triangular.as_ref().map_or((model, t), |(model, t)| (model, t.as_slice()));
    let of = |range| Arch::new().dispatch(Part { model, lines, t, range });
    let parts: Vec<Vec<c64>> = parts(lines.z.len()).map(of).collect();
    parts.concat()
}

/// The model and t with every block in Schur form, where there are such forms.
fn triangular(model: &Model, t: &[f64]) -> Option<(Model, Vec<f64>)> {
    let (mut blocks, mut ends, mut at) = (Vec::with_capacity(model.blocks.len()), Vec::with_capacity(t.len()), 0);
    for block in &model.blocks {
        let (block, end) = block.triangular(&t[at..at + block.states])?;
        at += block.states;
        blocks.push(block);
        ends.extend(end);
    }
    ends.extend_from_slice(&t[at..]);
    Some((Model { blocks, ..model.clone() }, ends))
}

/// The residual on a part of the lines, with the widest instructions that the processor has.
struct Part<'a> {
    model: &'a Model,
    lines: &'a Lines,
    t: &'a [f64],
    range: Range<usize>,
}

impl NullaryFnOnce for Part<'_> {
    type Output = Vec<c64>;

    #[inline(always)]
    fn call(self) -> Vec<c64> {
        let Part { model, lines, t, range } = self;
        let (m, p) = (model.inputs, model.outputs);
        let largest = model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let (mut inverse, mut x) = (vec![Lanes::ZERO; largest * largest], vec![Lanes::ZERO; largest]);
        let (mut u, mut y) = (vec![Lanes::ZERO; m], vec![Lanes::ZERO; p]);
        let direct = model.d.iter().any(|d| *d != 0.0);
        let mut out = Vec::with_capacity(range.len() * p);
        for first in range.clone().step_by(LANES) {
            let count = LANES.min(range.end - first);
            let line = |l: usize| first + l.min(count - 1);
            let z = Lanes::gather(|l| lines.z[line(l)]);
            let ends = Lanes::gather(|l| lines.ends[line(l)]).times(&z);
            u.iter_mut().enumerate().for_each(|(j, u)| *u = Lanes::gather(|l| lines.u[line(l) * m + j]));
            y.iter_mut().enumerate().for_each(|(o, y)| *y = Lanes::gather(|l| lines.y[line(l) * p + o]));
            let mut at = 0;
            for block in &model.blocks {
                let s = block.states;
                states(block, (&z, &ends, &u), &t[at..at + s], (&mut inverse, &mut x));
                for (o, y) in y.iter_mut().enumerate() {
                    (0..s).for_each(|i| y.add_scaled(&x[i], -block.c[o * s + i]));
                }
                at += s;
            }
            let drift = ends.times(&z.shifted(-1.0).inverse());
            for (o, y) in y.iter_mut().enumerate() {
                y.add_scaled(&drift, -t[at + o]);
                if direct {
                    u.iter().enumerate().for_each(|(j, u)| y.add_scaled(u, -model.d[o * m + j]));
                }
            }
            out.extend((0..count * p).map(|x| c64::new(y[x % p].re[x / p], y[x % p].im[x / p])));
        }
        out
    }
}
