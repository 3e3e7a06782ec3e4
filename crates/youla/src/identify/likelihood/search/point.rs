//! A model with the ends of the records, and its residuals.

use super::model::Model;
use super::noise::Noise;
use super::residual::residual;
use crate::identify::likelihood::data::spectra::Spectra;
use faer::{Mat, c64};
use rayon::prelude::*;

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
        spectra.records.par_iter().zip(&self.ends).map(|(lines, t)| residual(&self.model, lines, t)).collect()
    }
}

/// Blocks formed anew, the ends of the records carried along as if they were inputs.
pub(crate) fn reblocked(point: &Point) -> Option<Point> {
    let (n, m, records) = (point.model.order(), point.model.inputs, point.ends.len());
    let (a, b, c) = point.model.matrices();
    let finite = |x: &Mat<f64>| x.col_iter().all(|col| col.iter().all(|v| v.is_finite()));
    if !(finite(&a) && finite(&b) && finite(&c)) {
        return None;
    }
    let wide = Mat::from_fn(n, m + records, |i, j| if j < m { b[(i, j)] } else { point.ends[j - m][i] });
    let whole = Model::of(a.as_ref(), wide.as_ref(), c.as_ref(), Vec::new())?;
    let mut ends = vec![Vec::with_capacity(point.model.end_count()); records];
    let mut model = whole.clone();
    model.inputs = m;
    model.d = point.model.d.clone();
    for (block, wide) in model.blocks.iter_mut().zip(&whole.blocks) {
        let s = wide.states;
        block.b = (0..s * m).map(|x| wide.b[(x / m) * (m + records) + x % m]).collect();
        for (r, end) in ends.iter_mut().enumerate() {
            end.extend((0..s).map(|i| wide.b[i * (m + records) + m + r]));
        }
    }
    ends.iter_mut().zip(&point.ends).for_each(|(end, before)| end.extend_from_slice(&before[n..]));
    Some(Point { model, ends })
}

/// Sum of squares of the whitened residuals.
pub(crate) fn energy(spectra: &Spectra, residuals: &[Vec<c64>], noise: &Noise) -> f64 {
    let p = spectra.outputs;
    let rest = noise.joint.as_ref().map(|joint| joint.rest(spectra, residuals));
    let mut filters = vec![c64::ZERO; p];
    let mut sum = 0.0;
    for (lines, v) in spectra.records.iter().zip(rest.as_deref().unwrap_or(residuals)) {
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
