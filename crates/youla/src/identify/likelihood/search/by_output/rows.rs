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

/// The rows of outputs in one record.
pub(super) struct Rows<'a> {
    pub(super) lines: &'a Lines,
    pub(super) point: &'a Point,
    pub(super) noise: &'a Noise,
    pub(super) columns: &'a Columns,
    pub(super) record: usize,
    /// Further columns, lines x p x count.
    pub(super) more: &'a [faer::c64],
}

/// What all outputs share on [`LANES`] lines.
struct Shared {
    z: Lanes,
    ends: Lanes,
    u: Vec<Lanes>,
    drift: Lanes,
    /// States of all blocks, and `(z I - A)^-1` of each, row by row.
    x: Vec<Lanes>,
    inverses: Vec<Lanes>,
}

/// The lines on which it is computed, with the widest instructions that the processor has.
struct At<'a, 'b> {
    rows: &'a Rows<'b>,
    first: usize,
}

impl NullaryFnOnce for At<'_, '_> {
    type Output = Shared;

    #[inline(always)]
    fn call(self) -> Shared {
        self.rows.shared(self.first)
    }
}

/// The rows of one output there.
struct Group<'a, 'b> {
    rows: &'a Rows<'b>,
    output: usize,
    first: usize,
    shared: &'a Shared,
    out: &'a mut [Lanes],
}

impl NullaryFnOnce for Group<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.rows.group((self.output, self.first), self.shared, self.out);
    }
}

impl Rows<'_> {
    /// Adds the products of the rows of outputs from `output` on to their normal equations with `own` own columns.
    pub(super) fn add_to(&self, output: usize, sums: &mut [Mat<f64>], own: usize) {
        let places = self.places(own);
        let (width, total) = (places.len(), self.lines.z.len());
        let mut out = vec![Lanes::ZERO; width];
        let mut work = Mat::<f64>::zeros(2 * CHUNK, width);
        // With one record they are the normal equations themselves.
        let same = sums.first().is_some_and(|sum| places.iter().copied().eq(0..sum.nrows()));
        let start = |sum: &mut Mat<f64>| match same {
            true => std::mem::replace(sum, Mat::new()),
            false => Mat::zeros(width, width),
        };
        let mut grams: Vec<Mat<f64>> = sums.iter_mut().map(start).collect();
        let (whole, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
        for first in (0..total).step_by(CHUNK) {
            let groups: Vec<usize> = (first..total.min(first + CHUNK)).step_by(LANES).collect();
            let shared: Vec<Shared> =
                groups.iter().map(|first| Arch::new().dispatch(At { rows: self, first: *first })).collect();
            for (output, gram) in (output..).zip(&mut grams) {
                let mut filled = 0;
                for (&first, shared) in groups.iter().zip(&shared) {
                    Arch::new().dispatch(Group { rows: self, output, first, shared, out: &mut out });
                    filled += self.put(first, &out, &mut work, filled);
                }
                let all = work.subrows(0, filled);
                triangular::matmul(gram.as_mut(), lower, Accum::Add, all.transpose(), whole, all, whole, 1.0, Par::Seq);
            }
        }
        for (sum, gram) in sums.iter_mut().zip(grams) {
            if same {
                *sum = gram;
                continue;
            }
            for j in 0..width {
                for i in j..width {
                    let (a, b) = (places[i].max(places[j]), places[i].min(places[j]));
                    sum[(a, b)] += gram[(i, j)];
                }
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

    /// What all outputs share on [`LANES`] lines.
    #[inline(always)]
    fn shared(&self, first: usize) -> Shared {
        let Rows { lines, columns, .. } = *self;
        let (model, t) = (&self.point.model, &self.point.ends[self.record]);
        let line = |l: usize| (first + l).min(lines.z.len() - 1);
        let z = Lanes::gather(|l| lines.z[line(l)]);
        let ends = Lanes::gather(|l| lines.ends[line(l)]).times(&z);
        let m = model.inputs;
        let u: Vec<Lanes> = (0..m).map(|j| Lanes::gather(|l| lines.u[line(l) * m + j])).collect();
        let entries = model.blocks.iter().map(|b| b.a.len()).sum();
        let (mut inverses, mut x) = (vec![Lanes::ZERO; entries], vec![Lanes::ZERO; columns.states]);
        let (mut state, mut entry) = (0, 0);
        for block in &model.blocks {
            let (s, squared) = (block.states, block.a.len());
            let parts = (&mut inverses[entry..entry + squared], &mut x[state..state + s]);
            states(block, (&z, &ends, &u), &t[state..state + s], parts);
            (state, entry) = (state + s, entry + squared);
        }
        let drift = ends.times(&z.shifted(-1.0).inverse());
        Shared { z, ends, u, drift, x, inverses }
    }

    /// The columns of [`LANES`] lines: drift, own ends, C, D, entries of A and B, shared ends, further ones, residual.
    #[inline(always)]
    fn group(&self, (output, first): (usize, usize), shared: &Shared, out: &mut [Lanes]) {
        let Rows { lines, columns, .. } = *self;
        let Shared { z, ends, u, drift, .. } = shared;
        let (model, t) = (&self.point.model, &self.point.ends[self.record]);
        let (m, p, n) = (model.inputs, model.outputs, columns.states);
        let line = |l: usize| (first + l).min(lines.z.len() - 1);
        let mut v = Lanes::gather(|l| lines.y[line(l) * p + output]);
        v.add_scaled(drift, -t[n + output]);
        out[0] = *drift;
        let c_first = 1 + if columns.ends == Ends::Own { n } else { 0 };
        let d_first = c_first + if columns.moving[0] { n } else { 0 };
        let plant_first = d_first + if columns.moving[1] { m } else { 0 };
        let ends_first = if columns.ends == Ends::Own { 1 } else { plant_first + columns.plant.len() };
        let largest = model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let mut left = vec![Lanes::ZERO; largest];
        let (mut state, mut entry, mut first_of_block) = (0, 0, 0);
        for (k, block) in model.blocks.iter().enumerate() {
            let s = block.states;
            let (x, inverse) = (&shared.x[state..state + s], &shared.inverses[first_of_block..]);
            let triangular = block.is_triangular();
            for j in 0..s {
                left[j] = Lanes::ZERO;
                // Below its diagonal blocks of one or two states the inverse of a triangular block is zero.
                let rows = if triangular { (j + 2).min(s) } else { s };
                (0..rows).for_each(|i| left[j].add_scaled(&inverse[i * s + j], block.c[output * s + i]));
                v.add_scaled(&x[j], -block.c[output * s + j]);
                out[ends_first + state + j] = left[j].times(ends);
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
            (state, first_of_block) = (state + s, first_of_block + s * s);
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
