//! The rows of one output in the lines of one record, and the products of them.

use super::{Columns, Ends};
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::Lines;
use crate::identify::likelihood::search::chart::Entry;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::Point;
use crate::identify::likelihood::search::state_lanes::states;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, Par};
use pulp::{Arch, NullaryFnOnce};

/// Lines whose rows are multiplied together.
const CHUNK: usize = 16 * LANES;

/// The rows of one output in one record.
pub(super) struct Rows<'a> {
    pub(super) lines: &'a Lines,
    pub(super) point: &'a Point,
    pub(super) noise: &'a Noise,
    pub(super) columns: &'a Columns,
    pub(super) output: usize,
    pub(super) record: usize,
    /// Further columns, lines x p x count.
    pub(super) more: &'a [faer::c64],
}

/// One group of lines, computed with the widest instructions that the processor has.
struct Group<'a, 'b> {
    rows: &'a Rows<'b>,
    first: usize,
    out: &'a mut [Lanes],
}

impl NullaryFnOnce for Group<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.rows.group(self.first, self.out);
    }
}

impl Rows<'_> {
    /// Adds the products of the rows to normal equations with `own` own columns.
    pub(super) fn add_to(&self, sum: &mut Mat<f64>, own: usize) {
        let places = self.places(own);
        let (width, total) = (places.len(), self.lines.z.len());
        let mut out = vec![Lanes::ZERO; width];
        let mut work = Mat::<f64>::zeros(2 * CHUNK, width);
        let mut gram = Mat::<f64>::zeros(width, width);
        let (whole, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
        for first in (0..total).step_by(CHUNK) {
            let mut filled = 0;
            for first in (first..total.min(first + CHUNK)).step_by(LANES) {
                Arch::new().dispatch(Group { rows: self, first, out: &mut out });
                filled += self.put(first, &out, &mut work, filled);
            }
            let all = work.subrows(0, filled);
            triangular::matmul(gram.as_mut(), lower, Accum::Add, all.transpose(), whole, all, whole, 1.0, Par::Seq);
        }
        for j in 0..width {
            for i in j..width {
                let (a, b) = (places[i].max(places[j]), places[i].min(places[j]));
                sum[(a, b)] += gram[(i, j)];
            }
        }
    }

    /// Places of the columns of this record in the normal equations.
    fn places(&self, own: usize) -> Vec<usize> {
        let Columns { states, records, plant, extra, ends, .. } = self.columns;
        let of_ends = |first: usize| (0..*states).map(move |i| first + self.record * states + i);
        let mut out = vec![self.record];
        if *ends == Ends::Own {
            out.extend(of_ends(*records));
        }
        out.extend(self.columns.nuisance()..own);
        out.extend(own..own + plant.len());
        if *ends == Ends::Shared {
            out.extend(of_ends(own + plant.len()));
        }
        let all = self.columns.shared();
        out.extend(own + all - extra..=own + all);
        out
    }

    /// The columns of [`LANES`] lines: drift, own ends, C, D, entries of A and B, shared ends, further ones, residual.
    #[inline(always)]
    fn group(&self, first: usize, out: &mut [Lanes]) {
        let Rows { lines, columns, output, .. } = *self;
        let (model, t) = (&self.point.model, &self.point.ends[self.record]);
        let (m, p, n) = (model.inputs, model.outputs, columns.states);
        let last = lines.z.len() - 1;
        let line = |l: usize| (first + l).min(last);
        let z = Lanes::gather(|l| lines.z[line(l)]);
        let ends = Lanes::gather(|l| lines.ends[line(l)]).times(&z);
        let u: Vec<Lanes> = (0..m).map(|j| Lanes::gather(|l| lines.u[line(l) * m + j])).collect();
        let drift = ends.times(&z.shifted(-1.0).inverse());
        let mut v = Lanes::gather(|l| lines.y[line(l) * p + output]);
        v.add_scaled(&drift, -t[n + output]);
        out[0] = drift;
        let c_first = 1 + if columns.ends == Ends::Own { n } else { 0 };
        let d_first = c_first + if columns.moving[0] { n } else { 0 };
        let plant_first = d_first + if columns.moving[1] { m } else { 0 };
        let ends_first = if columns.ends == Ends::Own { 1 } else { plant_first + columns.plant.len() };
        let largest = model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let (mut inverse, mut x) = (vec![Lanes::ZERO; largest * largest], vec![Lanes::ZERO; largest]);
        let mut left = vec![Lanes::ZERO; largest];
        let (mut state, mut entry) = (0, 0);
        for (k, block) in model.blocks.iter().enumerate() {
            let s = block.states;
            states(block, (&z, &ends, &u), &t[state..state + s], (&mut inverse, &mut x));
            for j in 0..s {
                left[j] = Lanes::ZERO;
                (0..s).for_each(|i| left[j].add_scaled(&inverse[i * s + j], block.c[output * s + i]));
                v.add_scaled(&x[j], -block.c[output * s + j]);
                out[ends_first + state + j] = left[j].times(&ends);
                if columns.moving[0] {
                    out[c_first + state + j] = x[j];
                }
            }
            while let Some(Entry { entry: e, .. }) = columns.plant.get(entry).filter(|e| e.block == k) {
                out[plant_first + entry] = match e.checked_sub(s * s) {
                    None => left[e / s].times(&x[e % s]),
                    Some(e) => left[e / m].times(&u[e % m]),
                };
                entry += 1;
            }
            state += s;
        }
        for (j, u) in u.iter().enumerate() {
            v.add_scaled(u, -model.d[output * m + j]);
            if columns.moving[1] {
                out[d_first + j] = *u;
            }
        }
        let (extra, end) = (columns.extra, out.len() - 1);
        for e in 0..extra {
            out[end - extra + e] = Lanes::gather(|l| self.more[(line(l) * p + output) * extra + e]);
        }
        out[end] = v;
        let filter = self.noise.regression[output].filter(&z.conj()).scaled(self.noise.root[(output, output)]);
        out.iter_mut().for_each(|column| column.multiply(&filter));
    }

    /// Writes the rows of the lines from `first` on, real parts above imaginary parts.
    fn put(&self, first: usize, out: &[Lanes], work: &mut Mat<f64>, at: usize) -> usize {
        let count = LANES.min(self.lines.z.len() - first);
        let weight = &self.lines.weight[first..first + count];
        for (c, v) in out.iter().enumerate() {
            let Some(column) = work.col_mut(c).try_as_col_major_mut() else { continue };
            let (re, im) = column.as_slice_mut()[at..at + 2 * count].split_at_mut(count);
            re.iter_mut().zip(&v.re).zip(weight).for_each(|((r, v), w)| *r = v * w);
            im.iter_mut().zip(&v.im).zip(weight).for_each(|((r, v), w)| *r = v * w);
        }
        2 * count
    }
}
