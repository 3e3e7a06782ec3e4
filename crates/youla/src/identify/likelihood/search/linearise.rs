//! Residuals of a model on the lines of the records, and their triangular factor `[J r]`.
//!
//! With `M = (z I - A)^-1`, `X = M (B U + z t)` and `L = C M`, block by block, the slopes of the output are
//! ```text
//! dY/dA_ij = L_i X_j,   dY/dB_ij = L_i U_j,   dY/dC_ij = e_i X_j,   dY/dD_ij = e_i U_j,   dY/dt_i = L_i z
//! ```
//! and only the directions of (A, B, C) of each block move that are orthogonal to its similarity transformations (McKelvey,
//! Helmersson and Ribarits, Automatica 40 (2004), 1629). The columns of t are eliminated record by record.

use super::chart::Chart;
use super::driven::entering::Entering;
use super::noise::Noise;
use super::point::Point;
use super::residual::residual;
use super::rows::{Place, Rows};
use crate::identify::likelihood::data::lanes::LANES;
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use crate::linalg::{Orthonormal, TINY};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, Par, c64};
use rayon::prelude::*;
use std::ops::Range;

/// The triangular factor at a point.
pub(crate) struct Linearised {
    /// Factor of the slopes of the parameters with t eliminated and of the residual, (P + 1) x (P + 1).
    pub(crate) factor: Mat<f64>,
    /// Per record: `[R11 R12 r1]`, the rows that determine t given the parameters.
    pub(crate) ends: Vec<Mat<f64>>,
}

/// Rows that are brought to triangular form together.
const CHUNK: usize = 1024;

/// Further columns of the slopes: per record lines x p x count, row by row.
pub(crate) struct Extra<'a> {
    /// Number of columns.
    pub(crate) count: usize,
    /// Values per record.
    pub(crate) values: &'a [Vec<c64>],
    /// Whether normal equations suffice; orthogonal triangles otherwise.
    pub(crate) quick: bool,
    /// What the filter of the noise does.
    pub(crate) filter: Filter,
}

/// What the filter of the noise does while the parameters move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Filter {
    /// It stays: it is not that of the model, or a search takes fewer steps so.
    Held,
    /// Noise at the inputs moves it with the plant.
    Moves,
    /// The same, and the coefficients of the noise are free.
    Free,
}

/// The triangular factor of all records at a point.
pub(crate) fn linearise(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise) -> Linearised {
    let extra = Extra { count: 0, values: &[], quick: false, filter: Filter::Moves };
    linearise_with(spectra, point, chart, noise, &extra)
}

/// The same by normal equations, for a step of a search; where the coefficients of the noise are free, their columns are behind those of the parameters.
pub(crate) fn linearise_quickly(
    spectra: &Spectra,
    point: &Point,
    (chart, noise): (&Chart, &Noise),
    filter: Filter,
) -> Linearised {
    linearise_all(spectra, point, (chart, noise), &Extra { count: 0, values: &[], quick: true, filter }).0
}

/// The same with further columns behind those of the parameters.
pub(crate) fn linearise_with(
    spectra: &Spectra,
    point: &Point,
    chart: &Chart,
    noise: &Noise,
    extra: &Extra<'_>,
) -> Linearised {
    let (Linearised { factor, ends }, of_noise) = linearise_all(spectra, point, (chart, noise), extra);
    Linearised { factor: without(factor, 0, of_noise), ends }
}

/// The same, and which columns are those of the coefficients of the noise.
fn linearise_all(
    spectra: &Spectra,
    point: &Point,
    (chart, noise): (&Chart, &Noise),
    extra: &Extra<'_>,
) -> (Linearised, Range<usize>) {
    let coefficients = extra.filter == Filter::Free && noise.parameters() <= MOST_COEFFICIENTS;
    let of_noise = if coefficients { noise.parameters() } else { 0 };
    let n = point.model.end_count();
    let width = chart.parameters() + of_noise + extra.count + 1;
    let entering = match extra.filter {
        Filter::Held => None,
        Filter::Moves | Filter::Free => Entering::new(spectra, &point.model, chart, noise),
    };
    let of_record = |(k, (lines, t)): (usize, (&Lines, &Vec<f64>))| {
        let values = extra.values.get(k).map_or(&[][..], Vec::as_slice);
        // Slopes are those beside what the ends of colours drive.
        let joint = noise.joint.as_ref().filter(|joint| entering.is_some() && joint.ends() > 0);
        let ends_of_colours =
            joint.map_or(Vec::new(), |joint| joint.rest_and_ends(lines, &residual(&point.model, lines, t)).1);
        let place = Place {
            lines,
            t,
            model: &point.model,
            chart,
            noise,
            entering: entering.as_ref(),
            ends: &ends_of_colours,
            coefficients,
            more: (values, extra.count),
        };
        let r = triangle(place, extra.quick);
        let below = r.nrows().saturating_sub(n);
        let ends = r.submatrix(0, 0, n.min(r.nrows()), n + width).to_owned();
        (ends, r.submatrix(n.min(r.nrows()), n, below, width).to_owned())
    };
    let (ends, triangles): (Vec<Mat<f64>>, Vec<Mat<f64>>) =
        spectra.records.par_iter().zip(&point.ends).enumerate().map(of_record).unzip();
    let joined = |a: Mat<f64>, b: Mat<f64>| if a.nrows() == 0 { b } else { compressed(&stacked(&a, &b)) };
    let factor = triangles.into_iter().fold(Mat::zeros(0, width), joined);
    (Linearised { factor, ends }, chart.parameters()..chart.parameters() + of_noise)
}

/// Coefficients of the noise of all outputs that have columns at most: the work grows with the square of their number.
pub(crate) const MOST_COEFFICIENTS: usize = 100;

/// The factor `[J N M r]` without its columns N, their coefficients free: that of `[N J M r]` below and behind N. Those of N that are sums of others and of
/// the first `known` columns, which are free anyway, are left out: a direction for a column that has none of its own would be that of a parameter.
pub(crate) fn without(factor: Mat<f64>, known: usize, columns: Range<usize>) -> Mat<f64> {
    if columns.is_empty() {
        return factor;
    }
    let kept = independent(&factor, known, columns.clone());
    let rest = (0..factor.ncols()).filter(|j| !columns.contains(j));
    let order: Vec<usize> = kept.iter().copied().chain(rest).collect();
    let factor = compressed(&Mat::from_fn(factor.nrows(), order.len(), |i, j| factor[(i, order[j])]));
    let count = kept.len();
    let rows = factor.nrows().saturating_sub(count);
    factor.submatrix(count, count, rows, factor.ncols() - count).to_owned()
}

/// Part of a column beyond those before it, over its length, from which it is one of its own.
const INDEPENDENT: f64 = 1e-6;

/// The columns of a range that are no sums of the first ones and of those before them: two inputs whose noise one output sees have an end in common,
/// and where they drive one state, a variance.
fn independent(factor: &Mat<f64>, first: usize, columns: Range<usize>) -> Vec<usize> {
    let mut basis = Orthonormal::default();
    let mut is_new = |j: usize| {
        let column = factor.col(j).to_owned();
        let least = INDEPENDENT * column.norm_l2();
        basis.add(column, least)
    };
    (0..first).chain(columns.clone()).filter(|j| is_new(*j) && columns.contains(j)).collect()
}

pub(crate) fn stacked(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows() + b.nrows(), a.ncols(), |i, j| if i < a.nrows() { a[(i, j)] } else { b[(i - a.nrows(), j)] })
}

pub(crate) fn compressed(rows: &Mat<f64>) -> Mat<f64> {
    rows.qr().thin_R().to_owned()
}

/// `[t parameters residual]` of one record in triangular form.
fn triangle(place: Place<'_>, quick: bool) -> Mat<f64> {
    let (count, last) = (place.lines.z.len(), columns(&place) - 1);
    let own = last - place.ends_of_colours()..last;
    let factor = match quick {
        false => orthogonal(place, count),
        true => {
            let grams: Vec<Mat<f64>> = parts(count).map(|range| gram(place, range)).collect();
            root_of(&grams.iter().fold(Mat::zeros(last + 1, last + 1), |sum, gram| sum + gram))
        }
    };
    without(factor, place.model.end_count(), own)
}

fn columns(place: &Place<'_>) -> usize {
    let of_noise = if place.coefficients { place.noise.parameters() } else { 0 };
    place.model.end_count() + place.chart.parameters() + of_noise + place.more.1 + place.ends_of_colours() + 1
}

/// Lines whose rows are brought to triangular form together.
fn chunk(place: &Place<'_>) -> usize {
    let group = 2 * place.model.outputs * LANES;
    (CHUNK.max(3 * columns(place)) / group).max(1) * LANES
}

/// The normal equations of a part of the lines, lower triangle.
fn gram(place: Place<'_>, range: Range<usize>) -> Mat<f64> {
    let (columns, chunk) = (columns(&place), chunk(&place));
    let mut rows = Rows::new(&place, columns);
    let mut work = Mat::<f64>::zeros(2 * place.model.outputs * chunk, columns);
    let mut gram = Mat::<f64>::zeros(columns, columns);
    let (whole, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
    for first in range.clone().step_by(chunk) {
        let filled = rows.write(place, first..range.end.min(first + chunk), (&mut work, 0));
        let all = work.subrows(0, filled);
        triangular::matmul(gram.as_mut(), lower, Accum::Add, all.transpose(), whole, all, whole, 1.0, Par::Seq);
    }
    gram
}

/// By orthogonal triangles, one chunk of lines after the other.
fn orthogonal(place: Place<'_>, count: usize) -> Mat<f64> {
    let (columns, chunk) = (columns(&place), chunk(&place));
    let mut rows = Rows::new(&place, columns);
    let mut work = Mat::<f64>::zeros(columns + 2 * place.model.outputs * chunk, columns);
    let mut held = 0;
    for first in (0..count).step_by(chunk) {
        let filled = rows.write(place, first..count.min(first + chunk), (&mut work, held));
        let r = work.subrows(0, held + filled).qr().thin_R().to_owned();
        held = r.nrows();
        work.subrows_mut(0, held).copy_from(&r);
    }
    let mut r = Mat::zeros(columns, columns);
    r.subrows_mut(0, held).copy_from(work.subrows(0, held));
    r
}

/// Upper triangular root of the normal equations, columns brought to unit length first; enough for a step of a search.
fn root_of(gram: &Mat<f64>) -> Mat<f64> {
    let n = gram.nrows();
    let lengths: Vec<f64> = (0..n).map(|i| gram[(i, i)].max(TINY).sqrt()).collect();
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
