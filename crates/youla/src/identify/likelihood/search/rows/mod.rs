//! The rows of the slopes and of the residual that a group of lines gives, whitened.

mod noise;

use super::block::Block;
use super::chart::Chart;
use super::driven::entering::Entering;
use super::driven::joint::Filters;
use super::model::Model;
use super::noise::Noise;
use super::state_lanes::states;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::Lines;
use faer::{Mat, c64};
use pulp::{Arch, NullaryFnOnce};
use std::ops::Range;

/// The point at which the rows are taken: a record, its t, and where it is linearised.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub(crate) lines: &'a Lines,
    pub(crate) t: &'a [f64],
    pub(crate) model: &'a Model,
    pub(crate) chart: &'a Chart,
    pub(crate) noise: &'a Noise,
    /// Noise at the inputs, whose filter moves with the parameters; `None` where the filter is held.
    pub(crate) entering: Option<&'a Entering>,
    /// t_w, the ends of its colours, where the filter moves.
    pub(crate) ends: &'a [f64],
    /// Whether the coefficients of the noise have columns, behind those of the parameters.
    pub(crate) coefficients: bool,
    /// Further columns, lines x p x count, and their count.
    pub(crate) more: (&'a [c64], usize),
}

impl Place<'_> {
    /// Number of columns of the ends of the colours of noise at the inputs, before that of the residual.
    pub(crate) fn ends_of_colours(&self) -> usize {
        self.noise.joint.as_ref().map_or(0, |joint| joint.ends())
    }
}

/// The rows of [`LANES`] lines.
pub(crate) struct Rows {
    /// Output by column.
    values: Vec<Lanes>,
    columns: usize,
    inverse: Vec<Lanes>,
    x: Vec<Lanes>,
    left: Vec<Lanes>,
    /// U + w of each input.
    drive: Vec<Lanes>,
    /// What a direction changes of A X + B U, of one block.
    change: Vec<Lanes>,
    filters: Vec<Lanes>,
    /// `1 / H` of outputs that see noise at the inputs together.
    joint: Option<Filters>,
    /// Of each output `epsilon`, and w of each input.
    innovations: Vec<Lanes>,
    entered: Vec<Lanes>,
    /// X with them of one block.
    filtered: Vec<Lanes>,
    /// Of each output what is to be filtered.
    unfiltered: Vec<Lanes>,
    /// L of all states of the plant and of the colours, `L B / (z - c)`, of each output.
    all_left: Vec<Lanes>,
}

/// One group of lines, computed with the widest instructions that the processor has.
struct Group<'a, 'b> {
    rows: &'a mut Rows,
    place: Place<'b>,
    first: usize,
}

impl NullaryFnOnce for Group<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.rows.group(&self.place, self.first);
    }
}

impl Rows {
    pub(crate) fn new(place: &Place<'_>, columns: usize) -> Self {
        let model = place.model;
        let (p, m) = (model.outputs, model.inputs);
        let s = model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let zeros = |count: usize| vec![Lanes::ZERO; count];
        Rows {
            values: zeros(p * columns),
            columns,
            inverse: zeros(s * s),
            x: zeros(s),
            left: zeros(p * s),
            drive: zeros(m),
            change: zeros(s),
            filters: zeros(p),
            joint: place.noise.joint.as_ref().map(|joint| joint.filters()),
            innovations: zeros(p),
            entered: zeros(m),
            filtered: zeros(s),
            unfiltered: zeros(p),
            all_left: zeros(p * (model.order() + m)),
        }
    }

    /// Writes the rows of some lines from row `at` on, those of [`LANES`] lines together, real parts above imaginary parts, and says
    /// how many they are. The lines end with the record or at a multiple of [`LANES`].
    pub(crate) fn write(&mut self, place: Place<'_>, lines: Range<usize>, (work, at): (&mut Mat<f64>, usize)) -> usize {
        let mut filled = 0;
        for first in lines.step_by(LANES) {
            Arch::new().dispatch(Group { rows: self, place, first });
            filled += self.put(place.lines, first, work, at + filled);
        }
        filled
    }

    #[inline(always)]
    fn group(&mut self, place: &Place<'_>, first: usize) {
        let Place { lines, model, chart, .. } = *place;
        let (m, p, columns) = (model.inputs, model.outputs, self.columns);
        let last = lines.z.len() - 1;
        let line = |l: usize| (first + l).min(last);
        let z = Lanes::gather(|l| lines.z[line(l)]);
        let ends = Lanes::gather(|l| lines.ends[line(l)]).times(&z);
        let u: Vec<Lanes> = (0..m).map(|j| Lanes::gather(|l| lines.u[line(l) * m + j])).collect();
        for o in 0..p {
            self.values[o * columns + columns - 1] = Lanes::gather(|l| lines.y[line(l) * p + o]);
        }
        if let (Some(joint), Some(filters)) = (&place.noise.joint, &mut self.joint) {
            joint.filter(&z, filters);
        }
        if let Some(entering) = place.entering {
            self.innovations(place, entering, (&z, &ends, &u));
        }
        let (mut state, mut column) = (0, model.end_count());
        for (block, directions) in model.blocks.iter().zip(&chart.directions) {
            self.states(block, (&z, &ends, &u), &place.t[state..state + block.states]);
            self.slopes(block, directions, (&ends, &u), [state, column], place.entering);
            state += block.states;
            column += directions.ncols();
        }
        self.drift((&z, &ends), &place.t[state..], state);
        self.direct(place, &u, column);
        self.without_ends(place, &ends);
        if let Some(entering) = place.entering {
            self.gains(place, entering, (&z, model.end_count()));
        }
        if place.coefficients {
            self.coefficients(place, &z.conj(), model.end_count() + chart.parameters());
        }
        let ((more, count), of_colours) = (place.more, place.ends_of_colours());
        let end = columns - 1 - of_colours;
        for o in 0..p {
            for e in 0..count {
                self.values[o * columns + end - count + e] = Lanes::gather(|l| more[(line(l) * p + o) * count + e]);
            }
            if let Some(joint) = &self.joint {
                (0..of_colours).for_each(|j| self.values[o * columns + end + j] = joint.driven((o, j), &ends));
            }
        }
        self.whiten(place.noise, &z);
    }

    /// `X = M (B U + z t)` and `L = C M` of one block.
    #[inline(always)]
    fn states(&mut self, block: &Block, at: (&Lanes, &Lanes, &[Lanes]), t: &[f64]) {
        let s = block.states;
        states(block, at, t, (&mut self.inverse, &mut self.x));
        for o in 0..block.c.len() / s {
            for j in 0..s {
                let left = &mut self.left[o * s + j];
                *left = Lanes::ZERO;
                (0..s).for_each(|i| left.add_scaled(&self.inverse[i * s + j], block.c[o * s + i]));
            }
        }
    }

    /// The columns of t and of the directions of one block, and its share of the residual.
    #[inline(always)]
    fn slopes(
        &mut self,
        block: &Block,
        directions: &Mat<f64>,
        (ends, u): (&Lanes, &[Lanes]),
        at: [usize; 2],
        entering: Option<&Entering>,
    ) {
        let (s, m, columns) = (block.states, u.len(), self.columns);
        let of_b = |i: usize, j: usize| s * s + i * m + j;
        let of_c = |o: usize, j: usize| s * (s + m) + o * s + j;
        let entering = entering.filter(|entering| entering.sees(at[0]));
        if let Some(entering) = entering {
            self.filtered(block, at[0], entering);
        }
        let x = if entering.is_some() { &self.filtered } else { &self.x };
        self.drive.copy_from_slice(u);
        if entering.is_some() {
            self.drive.iter_mut().zip(&self.entered).for_each(|(drive, w)| drive.add_scaled(w, 1.0));
        }
        let outputs = block.c.len() / s;
        for o in 0..outputs {
            for i in 0..s {
                self.values[o * columns + columns - 1].add_scaled(&self.x[i], -block.c[o * s + i]);
                self.values[o * columns + at[0] + i].set_product(&self.left[o * s + i], ends);
            }
        }
        // dA X + dB U is the same for all outputs.
        for q in 0..directions.ncols() {
            let direction = directions.col(q);
            for (i, change) in self.change[..s].iter_mut().enumerate() {
                *change = Lanes::ZERO;
                (0..s).for_each(|j| change.add_scaled(&x[j], direction[i * s + j]));
                (0..m).for_each(|j| change.add_scaled(&self.drive[j], direction[of_b(i, j)]));
            }
            for o in 0..outputs {
                let sum = &mut self.values[o * columns + at[1] + q];
                *sum = Lanes::ZERO;
                (0..s).for_each(|i| sum.add_product(&self.left[o * s + i], &self.change[i]));
                (0..s).for_each(|j| sum.add_scaled(&x[j], direction[of_c(o, j)]));
            }
        }
    }

    /// The columns of the drift of each output from one end of the record to the other, and its share of the residual.
    #[inline(always)]
    fn drift(&mut self, (z, ends): (&Lanes, &Lanes), t: &[f64], column: usize) {
        let (p, columns) = (self.filters.len(), self.columns);
        let drift = ends.times(&z.shifted(-1.0).inverse());
        for o in 0..p {
            self.values[o * columns + columns - 1].add_scaled(&drift, -t[o]);
            (0..p).for_each(|l| self.values[l * columns + column + o] = if l == o { drift } else { Lanes::ZERO });
        }
    }

    /// The share of D in the residual, and its columns.
    #[inline(always)]
    fn direct(&mut self, place: &Place<'_>, u: &[Lanes], column: usize) {
        let (m, p, columns) = (u.len(), place.model.outputs, self.columns);
        for o in 0..p {
            for j in 0..m {
                self.values[o * columns + columns - 1].add_scaled(&u[j], -place.model.d[o * m + j]);
                if place.chart.feedthrough {
                    for l in 0..p {
                        self.values[l * columns + column + o * m + j] = if l == o { u[j] } else { Lanes::ZERO };
                    }
                }
            }
        }
    }

    /// What several outputs see of noise at the inputs, autoregression of each output, then the inverse root of the covariance.
    #[inline(always)]
    fn whiten(&mut self, noise: &Noise, z: &Lanes) {
        let (p, columns) = (self.filters.len(), self.columns);
        if let Some(joint) = &self.joint {
            (0..columns).for_each(|c| joint.apply(&mut self.values[c..], columns, &mut self.unfiltered));
        }
        let back = z.conj();
        let root = |o: usize, l: usize| noise.root[(o, l)];
        for (o, (filter, r)) in self.filters.iter_mut().zip(&noise.regression).enumerate() {
            *filter = r.filter(&back).scaled(root(o, o));
            self.values[o * columns..(o + 1) * columns].iter_mut().for_each(|v| v.multiply(filter));
        }
        for o in (1..p).rev() {
            let (above, own) = self.values.split_at_mut(o * columns);
            for l in 0..o {
                let share = root(o, l) / root(l, l);
                own.iter_mut().zip(&above[l * columns..][..columns]).for_each(|(v, a)| v.add_scaled(a, share));
            }
        }
    }

    /// Writes the rows of the lines from `first` on.
    fn put(&self, lines: &Lines, first: usize, work: &mut Mat<f64>, at: usize) -> usize {
        let count = LANES.min(lines.z.len() - first);
        let weight = &lines.weight[first..first + count];
        let outputs = self.filters.len();
        for c in 0..self.columns {
            let Some(column) = work.col_mut(c).try_as_col_major_mut() else { continue };
            let slots = &mut column.as_slice_mut()[at..at + 2 * count * outputs];
            for (o, rows) in slots.chunks_exact_mut(2 * count).enumerate() {
                let v = &self.values[o * self.columns + c];
                let (re, im) = rows.split_at_mut(count);
                re.iter_mut().zip(&v.re).zip(weight).for_each(|((r, v), w)| *r = v * w);
                im.iter_mut().zip(&v.im).zip(weight).for_each(|((r, v), w)| *r = v * w);
            }
        }
        2 * count * outputs
    }
}
