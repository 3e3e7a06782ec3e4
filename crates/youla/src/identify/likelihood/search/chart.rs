//! Local coordinates: the directions of (A, B, C) of each block that are orthogonal to its similarity transformations (McKelvey,
//! Helmersson and Ribarits, Automatica 40 (2004), 1629).

use super::block::Block;
use super::model::Model;
use faer::{Mat, c64};

/// The local coordinates of a model.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    /// Per block: entries of A, B and C by directions, column by column.
    pub(crate) directions: Vec<Mat<f64>>,
    /// Whether D moves.
    pub(crate) feedthrough: bool,
    inputs: usize,
    outputs: usize,
}

impl Chart {
    /// The coordinates of which the directions are known.
    #[cfg(feature = "serde")]
    pub(crate) fn of(model: &Model, directions: Vec<Mat<f64>>, feedthrough: bool) -> Self {
        Chart { directions, feedthrough, inputs: model.inputs, outputs: model.outputs }
    }

    /// The coordinates at a model.
    pub(crate) fn new(model: &Model, feedthrough: bool) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        let directions = model.blocks.iter().map(|b| complement(b, m, p)).collect();
        Chart { directions, feedthrough, inputs: m, outputs: p }
    }

    /// Coordinates in which B (and D) move alone: the residual is linear in them.
    pub(crate) fn inputs_only(model: &Model, feedthrough: bool) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        let of_block = |block: &Block| {
            let s = block.states;
            Mat::from_fn(s * (s + m + p), s * m, |i, j| if i == s * s + j { 1.0 } else { 0.0 })
        };
        Chart { directions: model.blocks.iter().map(of_block).collect(), feedthrough, inputs: m, outputs: p }
    }

    /// Coordinates in which nothing moves.
    pub(crate) fn fixed(model: &Model) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        let of_block = |block: &Block| Mat::zeros(block.states * (block.states + m + p), 0);
        Chart { directions: model.blocks.iter().map(of_block).collect(), feedthrough: false, inputs: m, outputs: p }
    }

    /// Slopes of G(z) in the parameters, `[row][column]` of G row by row, then parameters.
    pub(crate) fn response_slopes(&self, model: &Model, z: c64) -> Mat<c64> {
        let (m, p) = (self.inputs, self.outputs);
        let mut out = Mat::<c64>::zeros(p * m, self.parameters());
        let mut at = 0;
        for (block, directions) in model.blocks.iter().zip(&self.directions) {
            let s = block.states;
            let mut inverse = vec![c64::ZERO; s * s];
            block.resolvent(z, &mut inverse);
            let x = Mat::<c64>::from_fn(s, m, |i, j| {
                (0..s).fold(c64::ZERO, |sum, l| sum + inverse[i * s + l] * block.b[l * m + j])
            });
            let left = Mat::<c64>::from_fn(p, s, |o, j| {
                (0..s).fold(c64::ZERO, |sum, i| sum + inverse[i * s + j] * block.c[o * s + i])
            });
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

    /// Number of parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.directions.iter().map(|d| d.ncols()).sum::<usize>()
            + if self.feedthrough { self.inputs * self.outputs } else { 0 }
    }

    /// The model moved by a step.
    pub(crate) fn moved(&self, model: &Model, step: &[f64]) -> Model {
        let mut out = model.clone();
        let mut at = 0;
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

/// Orthonormal basis of the directions of (A, B, C) that are orthogonal to those of similarity transformations.
fn complement(block: &Block, m: usize, p: usize) -> Mat<f64> {
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
    let keep = s * (m + p);
    match tangents.svd() {
        Ok(svd) => svd.U().subcols(rows - keep, keep).to_owned(),
        Err(_) => Mat::identity(rows, keep),
    }
}
