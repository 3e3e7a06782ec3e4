//! The rows of the slopes that one line gives.

use super::chart::Chart;
use super::model::Model;
use super::noise::Noise;
use super::spectra::Lines;
use faer::{Mat, c64};

/// The p rows of one line, whitened.
pub(crate) struct Rows {
    /// Output by column.
    values: Vec<c64>,
    columns: usize,
    outputs: usize,
    inverse: Vec<c64>,
    x: Vec<c64>,
    left: Vec<c64>,
    full: Vec<c64>,
    filters: Vec<c64>,
}

impl Rows {
    pub(crate) fn new(model: &Model, columns: usize) -> Self {
        let (p, m) = (model.outputs, model.inputs);
        let s = model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        Rows {
            values: vec![c64::ZERO; p * columns],
            columns,
            outputs: p,
            inverse: vec![c64::ZERO; s * s],
            x: vec![c64::ZERO; s],
            left: vec![c64::ZERO; p * s],
            full: vec![c64::ZERO; s * (s + m + p)],
            filters: vec![c64::ZERO; p],
        }
    }

    #[allow(clippy::too_many_arguments)]
    pub(crate) fn fill(
        &mut self,
        lines: &Lines,
        k: usize,
        z: c64,
        t: &[f64],
        model: &Model,
        chart: &Chart,
        noise: &Noise,
        more: &[c64],
    ) {
        let (m, p, columns) = (model.inputs, model.outputs, self.columns);
        let u = &lines.u[k * m..(k + 1) * m];
        let y = &lines.y[k * p..(k + 1) * p];
        let last = columns - 1;
        for o in 0..p {
            self.values[o * columns + last] = y[o];
        }
        let (mut state, mut column) = (0, model.order());
        for (block, directions) in model.blocks.iter().zip(&chart.directions) {
            let s = block.states;
            block.resolvent(z, &mut self.inverse);
            for i in 0..s {
                let mut x = c64::ZERO;
                for j in 0..s {
                    let mut drive = z * t[state + j];
                    for l in 0..m {
                        drive += u[l] * block.b[j * m + l];
                    }
                    x += self.inverse[i * s + j] * drive;
                }
                self.x[i] = x;
            }
            for o in 0..p {
                for j in 0..s {
                    let mut sum = c64::ZERO;
                    for i in 0..s {
                        sum += self.inverse[i * s + j] * block.c[o * s + i];
                    }
                    self.left[o * s + j] = sum;
                }
            }
            for o in 0..p {
                let left = &self.left[o * s..(o + 1) * s];
                let mut g = c64::ZERO;
                for i in 0..s {
                    g += self.x[i] * block.c[o * s + i];
                    for j in 0..s {
                        self.full[i * s + j] = left[i] * self.x[j];
                    }
                    for j in 0..m {
                        self.full[s * s + i * m + j] = left[i] * u[j];
                    }
                    self.values[o * columns + state + i] = left[i] * z;
                }
                self.values[o * columns + last] -= g;
                let entries = s * (s + m);
                for q in 0..directions.ncols() {
                    let direction = directions.col(q);
                    let mut sum = c64::ZERO;
                    for e in 0..entries {
                        sum += self.full[e] * direction[e];
                    }
                    for j in 0..s {
                        sum += self.x[j] * direction[entries + o * s + j];
                    }
                    self.values[o * columns + column + q] = sum;
                }
            }
            state += s;
            column += directions.ncols();
        }
        for o in 0..p {
            for j in 0..m {
                self.values[o * columns + last] -= u[j] * model.d[o * m + j];
            }
        }
        if chart.feedthrough {
            for o in 0..p {
                for j in 0..m {
                    for l in 0..p {
                        self.values[l * columns + column + o * m + j] = if l == o { u[j] } else { c64::ZERO };
                    }
                }
            }
        }
        let count = more.len() / p;
        for o in 0..p {
            for e in 0..count {
                self.values[o * columns + last - count + e] = more[o * count + e];
            }
        }
        noise.filters(z, &mut self.filters);
        for c in 0..columns {
            for o in (0..p).rev() {
                let mut sum = c64::ZERO;
                for l in 0..=o {
                    sum += self.filters[l] * self.values[l * columns + c] * noise.root[(o, l)];
                }
                self.values[o * columns + c] = sum;
            }
        }
    }

    pub(crate) fn write(&self, work: &mut Mat<f64>, at: usize, weight: f64) {
        for c in 0..self.columns {
            let column = work.col_mut(c);
            let column = column.try_as_col_major_mut();
            if let Some(column) = column {
                let slots = column.as_slice_mut();
                for o in 0..self.outputs {
                    let v = self.values[o * self.columns + c];
                    slots[at + 2 * o] = v.re * weight;
                    slots[at + 2 * o + 1] = v.im * weight;
                }
            }
        }
    }
}
