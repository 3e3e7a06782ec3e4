//! Local coordinates: the directions of (A, B, C) of each block that are orthogonal to its similarity transformations (McKelvey,
//! Helmersson and Ribarits, Automatica 40 (2004), 1629).

use super::block::Block;
use super::model::Model;
use super::separable::separable;
use faer::{Mat, MatRef, c64};

/// The local coordinates of a model.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    /// Per block: entries of A, B and C by directions, column by column.
    pub(crate) directions: Vec<Mat<f64>>,
    /// Where entries move alone: per block the entry of (A, B, C) that each parameter moves.
    pub(crate) units: Vec<Vec<usize>>,
    /// Whether D moves.
    pub(crate) feedthrough: bool,
    inputs: usize,
    outputs: usize,
}

/// An entry of (A, B) that moves.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) block: usize,
    /// Its place in A, then B, row by row.
    pub(crate) entry: usize,
    /// Its place among the parameters.
    pub(crate) place: usize,
}

/// The parameters of coordinates by outputs.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    /// Entries of A and B, which all outputs share.
    pub(crate) plant: Vec<Entry>,
    /// Places of the row of C and that of D of each output.
    pub(crate) own: Vec<Vec<usize>>,
}

/// Slopes of G(z) in the parameters, rows by entries of G, row by row.
pub(crate) struct Slopes {
    /// In the rows of C and D of each output, m x parameters.
    pub(crate) own: Vec<Mat<c64>>,
    /// In all other parameters, p m x parameters.
    pub(crate) shared: Mat<c64>,
}

impl Chart {
    /// The coordinates of which the directions are known.
    #[cfg(feature = "serde")]
    pub(crate) fn of(model: &Model, (directions, units): (Vec<Mat<f64>>, Vec<Vec<usize>>), feedthrough: bool) -> Self {
        Chart { directions, units, feedthrough, inputs: model.inputs, outputs: model.outputs }
    }

    /// The coordinates at a model; of many outputs those of [`Self::by_outputs`].
    pub(crate) fn new(model: &Model, feedthrough: bool) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        if separable(p) {
            return Chart::by_outputs(model, feedthrough);
        }
        let directions = model.blocks.iter().map(|b| complement(b, m, p)).collect();
        Chart { directions, units: Vec::new(), feedthrough, inputs: m, outputs: p }
    }

    /// Coordinates in which each output has its row of C (and D) for itself: every entry of C, and of A and B those that do not belong to a
    /// similarity transformation.
    pub(crate) fn by_outputs(model: &Model, feedthrough: bool) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        let of_block = |block: &Block| {
            let first = block.states * (block.states + m);
            free(block, m).into_iter().chain(first..first + p * block.states).collect()
        };
        Chart::of_units(model, model.blocks.iter().map(of_block).collect(), feedthrough)
    }

    fn of_units(model: &Model, units: Vec<Vec<usize>>, feedthrough: bool) -> Self {
        Chart { directions: Vec::new(), units, feedthrough, inputs: model.inputs, outputs: model.outputs }
    }

    /// The parameters by what they move.
    pub(crate) fn places(&self, model: &Model) -> Places {
        let (mut plant, mut own, mut at) = (Vec::new(), vec![Vec::new(); self.outputs], 0);
        for (block, (of, units)) in model.blocks.iter().zip(&self.units).enumerate() {
            let first = of.states * (of.states + self.inputs);
            for (q, entry) in units.iter().enumerate() {
                match entry.checked_sub(first) {
                    None => plant.push(Entry { block, entry: *entry, place: at + q }),
                    Some(c) => own[c / of.states].push(at + q),
                }
            }
            at += units.len();
        }
        if self.feedthrough {
            let of = |o: usize| at + o * self.inputs..at + (o + 1) * self.inputs;
            own.iter_mut().enumerate().for_each(|(o, own)| own.extend(of(o)));
        }
        Places { plant, own }
    }

    /// What parameter q of a block changes at an entry of its (A, B, C).
    pub(crate) fn direction(&self, block: usize, entry: usize, q: usize) -> f64 {
        match self.units.get(block) {
            Some(units) => f64::from(units[q] == entry),
            None => self.directions[block][(entry, q)],
        }
    }

    /// Parameters of a block.
    pub(crate) fn parameters_of(&self, block: usize) -> usize {
        self.units.get(block).map_or_else(|| self.directions[block].ncols(), Vec::len)
    }

    /// Coordinates in which B (and D) move alone: the residual is linear in them.
    pub(crate) fn inputs_only(model: &Model, feedthrough: bool) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        if separable(p) {
            let of_block = |block: &Block| (block.a.len()..block.a.len() + block.b.len()).collect();
            return Chart::of_units(model, model.blocks.iter().map(of_block).collect(), feedthrough);
        }
        let of_block = |block: &Block| {
            let s = block.states;
            Mat::from_fn(s * (s + m + p), s * m, |i, j| if i == s * s + j { 1.0 } else { 0.0 })
        };
        let directions = model.blocks.iter().map(of_block).collect();
        Chart { directions, units: Vec::new(), feedthrough, inputs: m, outputs: p }
    }

    /// Coordinates in which nothing moves.
    pub(crate) fn fixed(model: &Model) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        if separable(p) {
            return Chart::of_units(model, vec![Vec::new(); model.blocks.len()], false);
        }
        let of_block = |block: &Block| Mat::zeros(block.states * (block.states + m + p), 0);
        let directions = model.blocks.iter().map(of_block).collect();
        Chart { directions, units: Vec::new(), feedthrough: false, inputs: m, outputs: p }
    }

    /// Slopes of G(z) where entries move alone.
    pub(crate) fn slopes(&self, model: &Model, z: c64) -> Slopes {
        let (m, p) = (self.inputs, self.outputs);
        let mut own = vec![Vec::new(); p];
        let mut shared = Vec::new();
        for (block, units) in model.blocks.iter().zip(&self.units) {
            let (x, left) = block.sides(z);
            let (s, b, c) = (block.states, block.a.len(), block.a.len() + block.b.len());
            for e in units {
                match *e {
                    e if e >= c => own[(e - c) / s].extend((0..m).map(|j| x[((e - c) % s, j)])),
                    e if e >= b => {
                        let (i, input) = ((e - b) / m, (e - b) % m);
                        let of = |row: usize| if row % m == input { left[(row / m, i)] } else { c64::ZERO };
                        shared.extend((0..p * m).map(of));
                    }
                    e => shared.extend((0..p * m).map(|row| left[(row / m, e / s)] * x[(e % s, row % m)])),
                }
            }
        }
        if self.feedthrough {
            let identity = (0..m * m).map(|k| if k / m == k % m { c64::ONE } else { c64::ZERO });
            own.iter_mut().for_each(|own| own.extend(identity.clone()));
        }
        let matrix = |values: &Vec<c64>, rows: usize| {
            MatRef::from_column_major_slice(values, rows, values.len() / rows.max(1)).to_owned()
        };
        Slopes { own: own.iter().map(|own| matrix(own, m)).collect(), shared: matrix(&shared, p * m) }
    }

    /// The same in one matrix, `[row][column]` of G row by row, then parameters.
    pub(crate) fn response_slopes(&self, model: &Model, z: c64) -> Mat<c64> {
        let (m, p) = (self.inputs, self.outputs);
        let mut out = Mat::<c64>::zeros(p * m, self.parameters());
        if !self.units.is_empty() {
            let (Slopes { own, shared }, places) = (self.slopes(model, z), self.places(model));
            let columns = places.plant.iter().zip(shared.col_iter());
            columns.for_each(|(entry, column)| out.col_mut(entry.place).copy_from(column));
            for (o, (own, of)) in own.iter().zip(&places.own).enumerate() {
                let columns = of.iter().zip(own.col_iter());
                columns.for_each(|(place, column)| out.subrows_mut(o * m, m).col_mut(*place).copy_from(column));
            }
            return out;
        }
        let mut at = 0;
        for (block, directions) in model.blocks.iter().zip(&self.directions) {
            let s = block.states;
            let (x, left) = block.sides(z);
            for q in 0..directions.ncols() {
                for o in 0..p {
                    for j in 0..m {
                        let mut sum = c64::ZERO;
                        for i in 0..s {
                            for l in 0..s {
                                sum += left[(o, i)] * x[(l, j)] * directions[(i * s + l, q)];
                            }
                            sum += left[(o, i)] * directions[(s * s + i * m + j, q)];
                            sum += x[(i, j)] * directions[(s * s + s * m + o * s + i, q)];
                        }
                        out[(o * m + j, at + q)] = sum;
                    }
                }
            }
            at += directions.ncols();
        }
        if self.feedthrough {
            (0..p * m).for_each(|k| out[(k, at + k)] = c64::ONE);
        }
        out
    }

    /// The change of the entries of a model by a step.
    pub(crate) fn change(&self, model: &Model, step: &[f64]) -> Model {
        let mut nothing = model.clone();
        let entries = nothing.blocks.iter_mut().flat_map(|b| [&mut b.a, &mut b.b, &mut b.c]);
        entries.chain([&mut nothing.d]).for_each(|entries| entries.fill(0.0));
        self.moved(&nothing, step)
    }

    /// Number of parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.directions.iter().map(|d| d.ncols()).chain(self.units.iter().map(Vec::len)).sum::<usize>()
            + if self.feedthrough { self.inputs * self.outputs } else { 0 }
    }

    /// The model moved by a step.
    pub(crate) fn moved(&self, model: &Model, step: &[f64]) -> Model {
        let mut out = model.clone();
        let mut at = 0;
        for (block, units) in out.blocks.iter_mut().zip(&self.units) {
            let (a, b) = (block.a.len(), block.b.len());
            for (entry, step) in units.iter().zip(&step[at..]) {
                match *entry {
                    e if e < a => block.a[e] += step,
                    e if e < a + b => block.b[e - a] += step,
                    e => block.c[e - a - b] += step,
                }
            }
            at += units.len();
        }
        for (block, directions) in out.blocks.iter_mut().zip(&self.directions) {
            let (s, m) = (block.states, self.inputs);
            for row in 0..directions.nrows() {
                let mut change = 0.0;
                for j in 0..directions.ncols() {
                    change += directions[(row, j)] * step[at + j];
                }
                if row < s * s {
                    block.a[row] += change;
                } else if row < s * s + s * m {
                    block.b[row - s * s] += change;
                } else {
                    block.c[row - s * s - s * m] += change;
                }
            }
            at += directions.ncols();
        }
        if self.feedthrough {
            out.d.iter_mut().zip(&step[at..]).for_each(|(d, s)| *d += s);
        }
        out
    }
}

/// The entries of (A, B) of a block that move: a similarity transformation takes any values of the others, which its slopes determine best.
fn free(block: &Block, m: usize) -> Vec<usize> {
    let s = block.states;
    let tangents = tangents(block, m, 0);
    let pivots = tangents.transpose().col_piv_qr();
    let mut kept = pivots.P().arrays().0[s * s..].to_vec();
    kept.sort_unstable();
    kept
}

/// Orthonormal basis of the directions of (A, B, C) that are orthogonal to those of similarity transformations: the last columns of Q, by
/// pivoting also where the block is not minimal. An SVD took 15 of the 19 s of a run with blocks of many states.
fn complement(block: &Block, m: usize, p: usize) -> Mat<f64> {
    let s = block.states;
    let (rows, keep) = (s * (s + m + p), s * (m + p));
    tangents(block, m, p).col_piv_qr().compute_Q().subcols(rows - keep, keep).to_owned()
}

/// Slopes of (A, B) and of the first p rows of C along similarity transformations.
fn tangents(block: &Block, m: usize, p: usize) -> Mat<f64> {
    let s = block.states;
    let rows = s * (s + m + p);
    let mut tangents = Mat::<f64>::zeros(rows, s * s);
    for i in 0..s {
        for j in 0..s {
            // T = e_i e_j': dA = A T - T A, dB = -T B, dC = C T
            let column = i * s + j;
            for k in 0..s {
                tangents[(k * s + j, column)] += block.a[k * s + i];
                tangents[(i * s + k, column)] -= block.a[j * s + k];
            }
            for k in 0..m {
                tangents[(s * s + i * m + k, column)] -= block.b[j * m + k];
            }
            for k in 0..p {
                tangents[(s * s + s * m + k * s + j, column)] += block.c[k * s + i];
            }
        }
    }
    tangents
}
