//! Residuals of a model on the lines of the records, and their triangular factor `[J r]`.
//!
//! With `M = (z I - A)^-1`, `X = M (B U + z t)` and `L = C M`, block by block, the slopes of the output are
//! ```text
//! dY/dA_ij = L_i X_j,   dY/dB_ij = L_i U_j,   dY/dC_ij = e_i X_j,   dY/dD_ij = e_i U_j,   dY/dt_i = L_i z
//! ```
//! and only the directions of (A, B, C) of each block move that are orthogonal to its similarity transformations (McKelvey,
//! Helmersson and Ribarits, Automatica 40 (2004), 1629). The columns of t are eliminated record by record.

use super::chart::Chart;
use super::noise::Noise;
use super::point::Point;
use super::rows::Rows;
use super::spectra::{Lines, Spectra};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, Par, c64};

/// The triangular factor at a point.
pub(crate) struct Linearised {
    /// Factor of the slopes of the parameters with t eliminated and of the residual, (P + 1) x (P + 1).
    pub(crate) factor: Mat<f64>,
    /// Per record: `[R11 R12 r1]`, the rows that determine t given the parameters.
    pub(crate) ends: Vec<Mat<f64>>,
}

/// Rows that are brought to triangular form together.
const CHUNK: usize = 768;

/// Further columns of the slopes: per record lines x p x count, row by row.
pub(crate) struct Extra<'a> {
    /// Number of columns.
    pub(crate) count: usize,
    /// Values per record.
    pub(crate) values: &'a [Vec<c64>],
    /// Whether normal equations suffice; orthogonal triangles otherwise.
    pub(crate) quick: bool,
}

/// The triangular factor of all records at a point.
pub(crate) fn linearise(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise) -> Linearised {
    linearise_with(spectra, point, chart, noise, &Extra { count: 0, values: &[], quick: false })
}

/// The same by normal equations, for a step of a search.
pub(crate) fn linearise_quickly(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise) -> Linearised {
    linearise_with(spectra, point, chart, noise, &Extra { count: 0, values: &[], quick: true })
}

/// The same with further columns behind those of the parameters.
pub(crate) fn linearise_with(
    spectra: &Spectra,
    point: &Point,
    chart: &Chart,
    noise: &Noise,
    extra: &Extra<'_>,
) -> Linearised {
    let (n, parameters) = (point.model.order(), chart.parameters() + extra.count);
    let width = parameters + 1;
    let mut factor = Mat::<f64>::zeros(0, width);
    let mut ends = Vec::with_capacity(spectra.records.len());
    for (k, (lines, t)) in spectra.records.iter().zip(&point.ends).enumerate() {
        let values = extra.values.get(k).map_or(&[][..], Vec::as_slice);
        let r = triangle(lines, t, point, chart, noise, extra, values);
        ends.push(r.submatrix(0, 0, n.min(r.nrows()), n + width).to_owned());
        let below = r.nrows().saturating_sub(n);
        let rest = r.submatrix(n.min(r.nrows()), n, below, width);
        factor = if factor.nrows() == 0 { rest.to_owned() } else { compressed(&stacked(&factor, &rest.to_owned())) };
    }
    Linearised { factor, ends }
}

fn stacked(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows() + b.nrows(), a.ncols(), |i, j| if i < a.nrows() { a[(i, j)] } else { b[(i - a.nrows(), j)] })
}

fn compressed(rows: &Mat<f64>) -> Mat<f64> {
    rows.qr().thin_R().to_owned()
}

/// `[t parameters residual]` of one record in triangular form.
fn triangle(
    lines: &Lines,
    t: &[f64],
    point: &Point,
    chart: &Chart,
    noise: &Noise,
    extra: &Extra<'_>,
    values: &[c64],
) -> Mat<f64> {
    let (model, p) = (&point.model, point.model.outputs);
    let n = model.order();
    let columns = n + chart.parameters() + extra.count + 1;
    let mut row = Rows::new(model, columns);
    let per_line = 2 * p;
    let chunk = (CHUNK.max(3 * columns) / per_line).max(1);
    let mut work = Mat::<f64>::zeros(columns + chunk * per_line, columns);
    let mut filled = 0;
    let mut held = 0;
    let mut gram = Mat::<f64>::zeros(columns, columns);
    for (k, z) in lines.z.iter().enumerate() {
        let more = if extra.count == 0 { &[][..] } else { &values[k * p * extra.count..(k + 1) * p * extra.count] };
        row.fill(lines, k, *z, t, model, chart, noise, more);
        row.write(&mut work, held + filled, lines.weight[k]);
        filled += per_line;
        if filled == chunk * per_line || k + 1 == lines.z.len() {
            let rows = work.subrows(0, held + filled);
            if extra.quick {
                let (all, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
                triangular::matmul(gram.as_mut(), lower, Accum::Add, rows.transpose(), all, rows, all, 1.0, Par::Seq);
            } else {
                let r = rows.qr().thin_R().to_owned();
                held = r.nrows();
                work.subrows_mut(0, held).copy_from(&r);
            }
            filled = 0;
        }
    }
    if extra.quick {
        return root_of(&gram);
    }
    let mut r = Mat::zeros(columns, columns);
    r.subrows_mut(0, held).copy_from(work.subrows(0, held));
    r
}

/// Upper triangular root of the normal equations, columns brought to unit length first; enough for a step of a search.
fn root_of(gram: &Mat<f64>) -> Mat<f64> {
    let n = gram.nrows();
    let lengths: Vec<f64> = (0..n).map(|i| gram[(i, i)].max(1e-300).sqrt()).collect();
    for ridge in [1e-13, 1e-10, 1e-6] {
        let unit = Mat::from_fn(n, n, |i, j| {
            let (i, j) = (i.max(j), i.min(j));
            gram[(i, j)] / (lengths[i] * lengths[j]) + if i == j { ridge } else { 0.0 }
        });
        if let Ok(factor) = unit.llt(faer::Side::Lower) {
            let lower = factor.L();
            return Mat::from_fn(n, n, |i, j| if i <= j { lower[(j, i)] * lengths[j] } else { 0.0 });
        }
    }
    Mat::zeros(n, n)
}
