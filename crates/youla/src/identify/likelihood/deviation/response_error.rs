//! The error of the response at one frequency, in independent directions.

use crate::{Mat, MatRef};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Par, c64};
use std::ops::AddAssign;

/// The error of the response at a frequency, physical units.
///
/// Its parts are independent: errors that each output has for itself, errors of all entries together, and errors of known size and unknown phase
/// of each entry alone. Time and memory are linear in the outputs for the first and the last.
#[derive(Debug, Clone)]
pub struct ResponseError {
    /// Of each output alone, m x errors of unit variance; none where outputs are not told apart.
    pub(super) own: Vec<Mat<c64>>,
    /// Of all entries of G, row by row; columns are errors of unit variance.
    pub(super) shared: Mat<c64>,
    /// Mean squares of what each entry has for itself, row by row.
    pub(super) alone: Vec<f64>,
    pub(super) inputs: usize,
}

impl ResponseError {
    /// Of the mean squares of the entries alone, row by row.
    pub(crate) fn of_entries(squares: &[f64], inputs: usize) -> Self {
        let alone = squares.iter().map(|square| square.max(0.0)).collect();
        ResponseError { own: Vec::new(), shared: Mat::zeros(squares.len(), 0), alone, inputs }
    }

    /// Numbers of outputs and inputs.
    fn shape(&self) -> (usize, usize) {
        (self.alone.len() / self.inputs.max(1), self.inputs)
    }

    /// With entry (i, j) times `factor(i, j)`.
    pub(super) fn scaled(mut self, factor: impl Fn(usize, usize) -> c64) -> Self {
        let m = self.inputs;
        let factors: Vec<c64> = (0..self.alone.len()).map(|row| factor(row / m, row % m)).collect();
        self.alone.iter_mut().zip(&factors).for_each(|(square, factor)| *square *= factor.norm_sqr());
        let by = |errors: &mut Mat<c64>, factors: &[c64]| {
            for (e, factor) in errors.col_iter_mut().flat_map(|column| column.iter_mut().zip(factors)) {
                *e *= factor;
            }
        };
        by(&mut self.shared, &factors);
        self.own.iter_mut().zip(factors.chunks(m)).for_each(|(own, factors)| by(own, factors));
        self
    }

    /// Sums of a figure of the errors over the columns, for each entry, without what an entry has for itself.
    fn sums<const N: usize>(&self, of: impl Fn(&c64) -> [f64; N]) -> Vec<[f64; N]> {
        let mut sums = vec![[0.0; N]; self.alone.len()];
        let add = |errors: &Mat<c64>, sums: &mut [[f64; N]]| {
            for column in errors.col_iter() {
                for (e, sums) in column.iter().zip(sums.iter_mut()) {
                    sums.iter_mut().zip(of(e)).for_each(|(sum, value)| *sum += value);
                }
            }
        };
        add(&self.shared, &mut sums);
        self.own.iter().zip(sums.chunks_mut(self.inputs.max(1))).for_each(|(own, sums)| add(own, sums));
        sums
    }

    /// Mean squares of the entries without what each has for itself.
    pub(super) fn squares(&self) -> Vec<f64> {
        self.sums(|e| [e.norm_sqr()]).into_iter().flatten().collect()
    }

    /// The errors of the entries, without how they hang together: less memory by the number of independent errors.
    pub fn entries(&self) -> EntryErrors {
        let mut covariances = self.sums(|e| [e.re * e.re, e.re * e.im, e.im * e.im]);
        // What has no phase is as large in its real as in its imaginary part.
        for ([rr, _, ii], alone) in covariances.iter_mut().zip(&self.alone) {
            (*rr, *ii) = (*rr + 0.5 * alone, *ii + 0.5 * alone);
        }
        EntryErrors { covariances, inputs: self.inputs }
    }

    /// The error of `left G right` (matrices of this frequency, q x p and m x r) in place of G: for example of S, with the loop on
    /// both sides.
    #[must_use]
    pub fn between(&self, left: MatRef<'_, c64>, right: MatRef<'_, c64>) -> ResponseError {
        let (q, r) = (left.nrows(), right.ncols());
        let moved: Vec<Mat<c64>> = self.changes().map(|change| left * change * right).collect();
        let shared = Mat::from_fn(q * r, moved.len(), |i, k| moved[k][(i / r, i % r)]);
        ResponseError { own: Vec::new(), shared, alone: vec![0.0; q * r], inputs: r }
    }

    /// The independent errors of unit variance, each a p x m change of G.
    fn changes(&self) -> impl Iterator<Item = Mat<c64>> + '_ {
        let (p, m) = self.shape();
        let of_output = move |(o, own): (usize, &'_ Mat<c64>)| {
            let change = |k: usize| Mat::from_fn(p, m, |i, j| if i == o { own[(j, k)] } else { c64::ZERO });
            (0..own.ncols()).map(change).collect::<Vec<_>>()
        };
        let together = move |k: usize| Mat::from_fn(p, m, |i, j| self.shared[(i * m + j, k)]);
        let phases = [c64::new(0.5_f64.sqrt(), 0.0), c64::new(0.0, 0.5_f64.sqrt())];
        let alone = move |row: usize| {
            let size = self.alone[row].sqrt();
            phases.map(|e| Mat::from_fn(p, m, |i, j| if i * m + j == row { e * size } else { c64::ZERO }))
        };
        let own = self.own.iter().enumerate().flat_map(of_output);
        own.chain((0..self.shared.ncols()).map(together)).chain((0..p * m).flat_map(alone))
    }

    /// Standard deviation of `Re sum_ij w_ij dG_ij`, `w` p x m: what a figure with these slopes inherits, errors of the entries that
    /// hang together included. A peak of the sensitivity is such a figure.
    pub fn along(&self, slopes: MatRef<'_, c64>) -> f64 {
        let (p, m) = self.shape();
        let weight = |row: usize| slopes[(row / m, row % m)];
        let of = |errors: MatRef<'_, c64>, first: usize| {
            let square = |column: faer::ColRef<'_, c64>| {
                let terms = column.iter().enumerate().map(|(i, e)| (e * weight(first + i)).re);
                terms.sum::<f64>().powi(2)
            };
            errors.col_iter().map(square).sum::<f64>()
        };
        let own: f64 = self.own.iter().enumerate().map(|(o, own)| of(own.as_ref(), o * m)).sum();
        let alone: f64 = (0..p * m).map(|row| 0.5 * self.alone[row] * weight(row).norm_sqr()).sum();
        (own + of(self.shared.as_ref(), 0) + alone).sqrt()
    }

    /// What [`Covariance::sides`] needs.
    pub(crate) fn all(&self) -> Covariance {
        let (p, m) = self.shape();
        let of_output = |o: usize| {
            let alone = |i: usize, j: usize| if i == j { c64::new(self.alone[o * m + i], 0.0) } else { c64::ZERO };
            let mut sum = Mat::from_fn(m, m, alone);
            if let Some(own) = self.own.get(o) {
                sum.add_assign(own * own.adjoint());
            }
            sum
        };
        let shared = (self.shared.ncols() > 0).then(|| {
            let mut lower = Mat::<c64>::zeros(p * m, p * m);
            let (e, whole) = (self.shared.as_ref(), BlockStructure::Rectangular);
            let (of, one) = (BlockStructure::TriangularLower, c64::ONE);
            matmul(lower.as_mut(), of, Accum::Replace, e, whole, e.adjoint(), whole, one, Par::Seq);
            lower
        });
        Covariance { own: (0..p).map(of_output).collect(), shared, inputs: m }
    }
}

/// The covariances of the entries of an error E.
pub(crate) struct Covariance {
    /// `mean E_oj conj(E_ol)` of what each output has for itself.
    own: Vec<Mat<c64>>,
    /// The same of what all entries have together, p m x p m; its blocks of outputs below the diagonal, and the lower halves of those on it.
    shared: Option<Mat<c64>>,
    inputs: usize,
}

impl Covariance {
    /// `mean E M E*` and `mean E* N E`, with M m x m and N p x p Hermitian: their lower halves.
    pub(crate) fn sides(&self, inner: MatRef<'_, c64>, outer: MatRef<'_, c64>) -> [Mat<c64>; 2] {
        let (p, m) = (self.own.len(), self.inputs);
        let (mut rows, mut columns) = (Mat::<c64>::zeros(p, p), Mat::<c64>::zeros(m, m));
        let mut add = |(i, k): (usize, usize), covariance: &dyn Fn(usize, usize) -> c64| {
            let (mut sum, weight) = (c64::ZERO, outer[(i, k)]);
            for l in 0..m {
                for j in 0..m {
                    let e = covariance(j, l);
                    sum += inner[(j, l)] * e;
                    // Outputs k and i count as well.
                    let both = if i == k {
                        weight * e.conj()
                    } else {
                        weight * e.conj() + (weight * covariance(l, j).conj()).conj()
                    };
                    columns[(j, l)] += both;
                }
            }
            rows[(i, k)] += sum;
        };
        for (o, own) in self.own.iter().enumerate() {
            add((o, o), &|j, l| own[(j, l)]);
        }
        if let Some(shared) = &self.shared {
            let at = |row: usize, column: usize| match row >= column {
                true => shared[(row, column)],
                false => shared[(column, row)].conj(),
            };
            for (i, k) in (0..p).flat_map(|k| (k..p).map(move |i| (i, k))) {
                add((i, k), &|j, l| at(i * m + j, k * m + l));
            }
        }
        [rows, columns]
    }
}

/// The errors of the entries of G at a frequency, each by itself, physical units.
#[derive(Debug, Clone)]
pub struct EntryErrors {
    /// `[re re, re im, im im]`, row by row.
    covariances: Vec<[f64; 3]>,
    inputs: usize,
}

impl EntryErrors {
    /// Covariance `[re re, re im, im im]` of the error of an entry (output, input).
    pub fn covariance(&self, (output, input): (usize, usize)) -> [f64; 3] {
        self.covariances[output * self.inputs + input]
    }

    /// Standard deviation of the magnitude of an entry with the response `g`, to first order.
    pub fn of_magnitude(&self, g: c64, port: (usize, usize)) -> f64 {
        let (re, im) = if g.norm() > 0.0 { (g.re / g.norm(), g.im / g.norm()) } else { (1.0, 0.0) };
        let [rr, ri, ii] = self.covariance(port);
        root_of(re * re * rr + 2.0 * re * im * ri + im * im * ii)
    }
}

/// Root of a mean square, zero for rounding below zero. What is not known is unbounded, not zero.
pub(super) fn root_of(square: f64) -> f64 {
    if square.is_nan() { f64::INFINITY } else { square.max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::ResponseError;
    use crate::identify::likelihood::{Experiment, LikelihoodOptions, recommend};
    use crate::lti::{Discrete, frequency_response};
    use crate::{Mat, c64};
    use rand::{RngExt, SeedableRng};

    /// A first-order plant behind a dead time: its error at some frequencies, with its response there.
    fn errors(dead_time: usize) -> Vec<(ResponseError, c64)> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut random = || rng.random::<f64>() - 0.5;
        let u = Mat::from_fn(2000, 1, |_, _| random());
        let (mut x, mut y) = (0.0, Mat::zeros(2000, 1));
        for t in dead_time..2000 {
            y[(t, 0)] = x + 0.1 * random();
            x = 0.9 * x + u[(t - dead_time, 0)];
        }
        let options = LikelihoodOptions { order: Some(1), dead_time: Some(vec![dead_time]), ..Default::default() };
        let (records, time) = ([Experiment::new(u.as_ref(), y.as_ref())], Discrete::new(1e-3).unwrap());
        let found = recommend(&records, &[], None, time, &options).unwrap();
        [1.0, 5.0, 20.0, 90.0, 300.0]
            .map(|hz| {
                let g = frequency_response(&found.plant, &[std::f64::consts::TAU * hz]).unwrap().at(0)[(0, 0)];
                (found.region.at(hz), g)
            })
            .into()
    }

    /// The error turns with the response, at 90 Hz by 194 degrees. Other noise changes the deviations by a few per cent.
    #[test]
    fn the_deviation_of_the_magnitude_does_not_depend_on_a_dead_time() {
        for ((plain, g), (delayed, of_delayed)) in errors(0).iter().zip(errors(6)) {
            let ratio = delayed.entries().of_magnitude(of_delayed, (0, 0)) / plain.entries().of_magnitude(*g, (0, 0));
            assert!((0.85..1.15).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn a_figure_that_is_the_real_part_of_an_entry_has_its_deviation() {
        for (error, g) in errors(2) {
            let one = Mat::from_fn(1, 1, |_, _| c64::ONE);
            assert!((error.along(one.as_ref()).powi(2) / error.entries().covariance((0, 0))[0] - 1.0).abs() < 1e-12);
            let turned = Mat::from_fn(1, 1, |_, _| g.conj() / g.norm());
            assert!((error.along(turned.as_ref()) / error.entries().of_magnitude(g, (0, 0)) - 1.0).abs() < 1e-9);
        }
    }
}
