//! A model with the ends of the records, and its residuals.

use super::model::Model;
use super::noise::Noise;
use super::spectra::{Lines, Spectra};
use faer::c64;

/// A model and the vectors t of the records.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    /// The model.
    pub(crate) model: Model,
    /// t of each record in the states of the model, then the drift of each output over the record.
    pub(crate) ends: Vec<Vec<f64>>,
}

impl Point {
    /// With t = 0.
    pub(crate) fn at_rest(model: Model, records: usize) -> Self {
        let ends = vec![vec![0.0; model.end_count()]; records];
        Point { model, ends }
    }

    /// Residuals `Y - G U - ...`, lines x p for each record.
    pub(crate) fn residuals(&self, spectra: &Spectra) -> Vec<Vec<c64>> {
        spectra.records.iter().zip(&self.ends).map(|(lines, t)| self.residual(lines, t)).collect()
    }

    fn residual(&self, lines: &Lines, t: &[f64]) -> Vec<c64> {
        let (m, p) = (self.model.inputs, self.model.outputs);
        let mut out = lines.y.clone();
        let direct = self.model.d.iter().any(|d| *d != 0.0);
        let largest = self.model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let (mut inverse, mut drive) = (vec![c64::ZERO; largest * largest], vec![c64::ZERO; largest]);
        for (k, z) in lines.z.iter().enumerate() {
            let (u, y) = (&lines.u[k * m..(k + 1) * m], &mut out[k * p..(k + 1) * p]);
            let mut at = 0;
            for block in &self.model.blocks {
                let s = block.states;
                block.resolvent(*z, &mut inverse);
                for i in 0..s {
                    drive[i] = *z * t[at + i];
                    for (b, u) in block.b[i * m..(i + 1) * m].iter().zip(u) {
                        drive[i] += *u * *b;
                    }
                }
                for i in 0..s {
                    let mut x = c64::ZERO;
                    for j in 0..s {
                        x += inverse[i * s + j] * drive[j];
                    }
                    for (o, y) in y.iter_mut().enumerate() {
                        *y -= x * block.c[o * s + i];
                    }
                }
                at += s;
            }
            let drift = *z / (*z - c64::ONE);
            y.iter_mut().zip(&t[at..]).for_each(|(y, t)| *y -= drift * *t);
            if direct {
                for (o, y) in y.iter_mut().enumerate() {
                    for j in 0..m {
                        *y -= u[j] * self.model.d[o * m + j];
                    }
                }
            }
        }
        out
    }
}

/// Sum of squares of the whitened residuals.
pub(crate) fn energy(spectra: &Spectra, residuals: &[Vec<c64>], noise: &Noise) -> f64 {
    let p = spectra.outputs;
    let mut filters = vec![c64::ZERO; p];
    let mut sum = 0.0;
    for (lines, v) in spectra.records.iter().zip(residuals) {
        for (k, z) in lines.z.iter().enumerate() {
            noise.filters(*z, &mut filters);
            let twice = lines.weight[k] * lines.weight[k];
            for i in 0..p {
                let mut e = c64::ZERO;
                for j in 0..=i {
                    e += filters[j] * v[k * p + j] * noise.root[(i, j)];
                }
                sum += twice * e.norm_sqr();
            }
        }
    }
    sum
}
