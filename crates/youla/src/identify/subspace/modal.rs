//! The regressors of B, D and x0 for all outputs at once, in the coordinates in which A is diagonal.
//!
//! With `A = V diag(lambda) V^-1` the response to a column b of B, and to x0, is
//! ```text
//! yhat_i(k) = Re sum_j gamma_ij beta_j z_j(k),   gamma = C V,   beta = V^-1 b,   z_j(k+1) = lambda_j z_j(k) + u(k)
//! ```
//! (for x0: `z_j(k) = lambda_j^k`). The outputs share the z; each is the product of them with a small matrix. So one pass with
//! two multiplications per number serves all outputs, where the recursion for one output alone takes n of them. It needs
//! eigenvectors that are far from dependent; [`Modes::of`] says where they are not.
//!
//! The recursion of a long record is cut into lanes, each of which begins at `z = 0` with the free response `f_j(k) = lambda_j^k`
//! beside it. What a lane would have begun with, s_j, is known when the lanes before it are done, and `z_j = z0_j + s_j f_j` is
//! a combination of columns: it is made in the triangular factor of the lane, a few rows, and not in the record.

use super::sensitivity::{Predictor, Unknowns};
use crate::linalg::Triangle;
use crate::{Mat, MatRef, c64};
use faer::prelude::*;
use faer::{MatMut, RowRef};
use rayon::prelude::*;

/// Smallest over largest singular value of the eigenvectors, of unit length, below which they count as dependent; the
/// regressors lose as many digits.
const INDEPENDENT: f64 = 1e-5;
/// Numbers below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;
/// Samples folded in at a time.
const PIECE: usize = 1000;
/// Least samples of a lane, and lanes that may run at the same time; fixed, so that the result does not depend on the threads.
const LANE: usize = 4000;
const LANES: usize = 8;

/// The modes of a predictor, one per real pole and one per pair.
pub(super) struct Modes {
    lambda: Vec<c64>,
    /// `V^-1` as real rows: one per real pole, real and imaginary part per pair; per output with gamma multiplied in.
    to_states: Vec<Mat<f64>>,
}

impl Modes {
    /// `None` where the eigenvectors of A are nearly dependent.
    pub(super) fn of(predictor: &Predictor) -> Option<Modes> {
        let eigen = predictor.a.eigen().ok()?;
        let n = predictor.a.nrows();
        let mut v = eigen.U().to_owned();
        for j in 0..n {
            let length = v.col(j).norm_l2();
            v.col_mut(j).iter_mut().for_each(|x| *x /= length);
        }
        let sigma = v.singular_values().ok()?;
        if sigma.last()? / sigma.first()? < INDEPENDENT {
            return None;
        }
        let inverse = v.partial_piv_lu().solve(Mat::<c64>::identity(n, n));
        let lambda: Vec<c64> = eigen.S().column_vector().iter().copied().collect();
        let chosen: Vec<usize> = (0..n).filter(|j| lambda[*j].im >= 0.0).collect();
        let pairs = chosen.iter().filter(|j| lambda[**j].im > 0.0).count();
        if chosen.len() + pairs != n {
            return None;
        }
        let c = Mat::from_fn(predictor.c.nrows(), n, |i, j| c64::new(predictor.c[(i, j)], 0.0));
        let gamma = c * &v;
        let to_states = (0..gamma.nrows()).map(|i| rows_of(gamma.row(i), inverse.as_ref(), &lambda, &chosen)).collect();
        Some(Modes { lambda: chosen.iter().map(|j| lambda[*j]).collect(), to_states })
    }

    /// Real numbers in the z of one input.
    fn width(&self) -> usize {
        self.lambda.iter().map(|l| if l.im == 0.0 { 1 } else { 2 }).sum()
    }

    /// Per output, the triangular factor over `[x0 | B | its row of D | y]`, from the shared factor of an experiment.
    pub(super) fn by_outputs(&self, shared: MatRef<'_, f64>, unknowns: Unknowns) -> Vec<Mat<f64>> {
        (0..unknowns.outputs).map(|i| self.of_output(shared, i, unknowns)).collect()
    }

    fn of_output(&self, shared: MatRef<'_, f64>, i: usize, unknowns: Unknowns) -> Mat<f64> {
        let n = unknowns.states;
        let groups = unknowns.inputs + usize::from(unknowns.initial > 0);
        let of_d = unknowns.of_d_row();
        let mut rows = Mat::zeros(shared.nrows(), unknowns.width_of_output());
        for g in 0..groups {
            rows.as_mut().subcols_mut(g * n, n).copy_from(shared.subcols(g * n, n) * &self.to_states[i]);
        }
        rows.as_mut().subcols_mut(groups * n, of_d).copy_from(shared.subcols(groups * n, of_d));
        rows.col_mut(groups * n + of_d).copy_from(shared.col(groups * n + of_d + i));
        let mut triangle = Triangle::new(unknowns.width_of_output(), shared.nrows());
        triangle.fold_rows(rows.as_ref());
        triangle.r().to_owned()
    }
}

/// The regressors of an experiment, samples by samples.
pub(super) struct ModalSums<'a> {
    modes: &'a Modes,
    unknowns: Unknowns,
    /// All z, first of x0, behind the samples taken in.
    z: Vec<c64>,
    /// Triangular factor over `[z of x0 | z of every input | u for D | all outputs]`.
    factor: Triangle,
}

impl<'a> ModalSums<'a> {
    pub(super) fn new(modes: &'a Modes, unknowns: Unknowns) -> Self {
        let count = modes.lambda.len();
        let z = (0..(1 + unknowns.inputs) * count).map(|k| c64::new(f64::from(u8::from(k < count)), 0.0)).collect();
        let free = usize::from(unknowns.initial > 0);
        let width = (free + unknowns.inputs) * modes.width() + unknowns.of_d_row() + unknowns.outputs;
        ModalSums { modes, unknowns, z, factor: Triangle::new(width, 2 * width + modes.width()) }
    }

    pub(super) fn factor(&self) -> MatRef<'_, f64> {
        self.factor.r()
    }

    /// Takes in the next samples.
    pub(super) fn add(&mut self, u: MatRef<'_, f64>, targets: MatRef<'_, f64>) {
        let samples = u.nrows();
        let lanes = samples.div_ceil(LANE).min(LANES);
        let parts: Vec<_> = (0..lanes)
            .into_par_iter()
            .map(|lane| {
                let (start, end) = (lane * samples / lanes, (lane + 1) * samples / lanes);
                let part = |m: MatRef<'_, f64>| m.subrows(start, end - start).to_owned();
                self.lane(part(u).as_ref(), part(targets).as_ref())
            })
            .collect();
        parts.into_iter().for_each(|(r, state)| self.join(r, &state));
    }

    /// Triangular factor over `[f | z0 of every input | u for D | all outputs]` and the z behind the lane.
    fn lane(&self, u: MatRef<'_, f64>, targets: MatRef<'_, f64>) -> (Mat<f64>, State) {
        let mut state = State::new(&self.modes.lambda, self.unknowns.inputs);
        let width = state.width() + self.unknowns.of_d_row() + self.unknowns.outputs;
        let mut triangle = Triangle::new(width, PIECE.min(u.nrows()));
        for start in (0..u.nrows()).step_by(PIECE) {
            let count = PIECE.min(u.nrows() - start);
            triangle.fold(count, |piece| state.fill(u, targets, start, self.unknowns, piece));
        }
        (triangle.r().to_owned(), state)
    }

    /// Puts a lane behind the samples before it.
    fn join(&mut self, mut r: Mat<f64>, end: &State) {
        let count = self.modes.lambda.len();
        let width = self.modes.width();
        let mut column = 0;
        for (j, lambda) in self.modes.lambda.iter().enumerate() {
            let pair = lambda.im != 0.0;
            for row in 0..r.nrows() {
                let f = c64::new(r[(row, column)], if pair { r[(row, column + 1)] } else { 0.0 });
                for group in (0..=self.unknowns.inputs).rev() {
                    let (at, shift) = (group * width + column, self.z[group * count + j] * f);
                    let kept = if group == 0 { 0.0 } else { 1.0 };
                    r[(row, at)] = kept * r[(row, at)] + shift.re;
                    if pair {
                        r[(row, at + 1)] = kept * r[(row, at + 1)] + shift.im;
                    }
                }
            }
            column += if pair { 2 } else { 1 };
        }
        for (k, z) in self.z.iter_mut().enumerate() {
            let (free, own) = (c64::new(end.re[k % count], end.im[k % count]), c64::new(end.re[k], end.im[k]));
            *z = if k < count { *z * free } else { own + *z * free };
            z.re = if z.re.abs() < VANISHED { 0.0 } else { z.re };
            z.im = if z.im.abs() < VANISHED { 0.0 } else { z.im };
        }
        let skipped = if self.unknowns.initial > 0 { 0 } else { width };
        self.factor.fold_rows(r.as_ref().subcols(skipped, r.ncols() - skipped));
    }
}

/// The real matrix that takes `[.. z_j ..]`, or `[.. Re z_j, Im z_j ..]`, to the sensitivities of one output to a column of B.
fn rows_of(gamma: RowRef<'_, c64>, inverse: MatRef<'_, c64>, lambda: &[c64], chosen: &[usize]) -> Mat<f64> {
    let n = lambda.len();
    let mut rows = Mat::zeros(n, n);
    let mut next = 0;
    for &j in chosen {
        let product: Vec<c64> = (0..n).map(|l| gamma[j] * inverse[(j, l)]).collect();
        if lambda[j].im == 0.0 {
            (0..n).for_each(|l| rows[(next, l)] = product[l].re);
            next += 1;
        } else {
            (0..n).for_each(|l| (rows[(next, l)], rows[(next + 1, l)]) = (2.0 * product[l].re, -2.0 * product[l].im));
            next += 2;
        }
    }
    rows
}

/// All z of one sample: groups (free, then the inputs) of modes.
struct State {
    re: Vec<f64>,
    im: Vec<f64>,
    lambda_re: Vec<f64>,
    lambda_im: Vec<f64>,
    drive: Vec<f64>,
    modes: usize,
}

impl State {
    /// At rest, the free responses at 1.
    fn new(lambda: &[c64], inputs: usize) -> Self {
        let (modes, groups) = (lambda.len(), 1 + inputs);
        let repeated = |part: &dyn Fn(&c64) -> f64| (0..groups).flat_map(|_| lambda.iter().map(part)).collect();
        State {
            re: (0..groups * modes).map(|k| if k < modes { 1.0 } else { 0.0 }).collect(),
            im: vec![0.0; groups * modes],
            lambda_re: repeated(&|l| l.re),
            lambda_im: repeated(&|l| l.im),
            drive: vec![0.0; groups * modes],
            modes,
        }
    }

    /// Real numbers in a sample.
    fn width(&self) -> usize {
        self.lambda_im.iter().map(|im| if *im == 0.0 { 1 } else { 2 }).sum()
    }

    fn advance(&mut self, u: MatRef<'_, f64>, k: usize) {
        let driven = self.drive[self.modes..].chunks_exact_mut(self.modes);
        driven.enumerate().for_each(|(q, drive)| drive.fill(u[(k, q)]));
        let numbers = self.re.iter_mut().zip(&mut self.im).zip(self.lambda_re.iter().zip(&self.lambda_im));
        for (((re, im), (a, b)), drive) in numbers.zip(&self.drive) {
            let (x, y) = (*re, *im);
            *re = a * x - b * y + drive;
            *im = b * x + a * y;
        }
    }

    /// Sets what has decayed to zero.
    fn flush(&mut self) {
        let numbers = self.re.iter_mut().chain(&mut self.im);
        numbers.filter(|v| v.abs() < VANISHED).for_each(|v| *v = 0.0);
    }

    /// Writes the rows of the samples from `start` on and moves on behind them.
    fn fill(
        &mut self,
        u: MatRef<'_, f64>,
        targets: MatRef<'_, f64>,
        start: usize,
        unknowns: Unknowns,
        mut piece: MatMut<'_, f64>,
    ) {
        for k in 0..piece.nrows() {
            let mut row = piece.as_mut().row_mut(k);
            let mut column = 0;
            for ((re, im), lambda_im) in self.re.iter().zip(&self.im).zip(&self.lambda_im) {
                row[column] = *re;
                column += 1;
                if *lambda_im != 0.0 {
                    row[column] = *im;
                    column += 1;
                }
            }
            for q in 0..unknowns.of_d_row() {
                row[column + q] = u[(start + k, q)];
            }
            column += unknowns.of_d_row();
            for i in 0..unknowns.outputs {
                row[column + i] = targets[(start + k, i)];
            }
            self.advance(u, start + k);
        }
        self.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::super::sensitivity::Sensitivity;
    use super::*;

    fn signal(samples: usize, channels: usize, seed: usize) -> Mat<f64> {
        Mat::from_fn(samples, channels, |k, j| ((k * k * (j + seed) + 5 * k) as f64 * 0.31).sin())
    }

    /// Three pairs and a real pole, mixed by a full matrix.
    fn predictor() -> Predictor {
        let mut a = Mat::<f64>::zeros(7, 7);
        for (block, (radius, angle)) in [(0.97, 0.3), (0.95, 0.32), (0.6, 2.0)].into_iter().enumerate() {
            let (i, c, s) = (2 * block, radius * f64::cos(angle), radius * f64::sin(angle));
            (a[(i, i)], a[(i, i + 1)], a[(i + 1, i)], a[(i + 1, i + 1)]) = (c, s, -s, c);
        }
        a[(6, 6)] = -0.8;
        let t = Mat::from_fn(7, 7, |i, j| if i == j { 2.0 } else { ((3 * i + 5 * j) as f64).sin() });
        let a = t.partial_piv_lu().solve(a * &t);
        Predictor { a, c: signal(2, 7, 3), k: None }
    }

    /// Several lanes, in parts.
    const SAMPLES: usize = 2 * LANE + 2500;

    #[test]
    fn modal_and_direct_regressors_have_the_same_factor() {
        let predictor = predictor();
        let (u, y) = (signal(SAMPLES, 3, 1), signal(SAMPLES, 2, 9));
        for (initial, feedthrough) in [(7, true), (0, false)] {
            let unknowns = Unknowns { states: 7, inputs: 3, outputs: 2, initial, feedthrough };
            let modes = Modes::of(&predictor).unwrap();
            let mut sums = ModalSums::new(&modes, unknowns);
            for (start, count) in [(0, SAMPLES - 700), (SAMPLES - 700, 0), (SAMPLES - 700, 700)] {
                sums.add(u.as_ref().subrows(start, count), y.as_ref().subrows(start, count));
            }
            for (i, modal) in modes.by_outputs(sums.factor(), unknowns).iter().enumerate() {
                let mut triangle = Triangle::new(unknowns.width_of_output(), SAMPLES);
                let mut direct = Sensitivity::new(&predictor, i, unknowns);
                triangle.fold(SAMPLES, |piece| direct.fill(u.as_ref(), y.col(i), piece));
                let (one, other) = (modal.transpose() * modal, triangle.r().transpose() * triangle.r());
                let error = (&one - &other).norm_max() / other.norm_max();
                assert!(error < 1e-12, "output {i}, {initial} initial states: {error:.1e}");
            }
        }
    }

    #[test]
    fn nearly_dependent_eigenvectors_are_left_to_the_direct_way() {
        let jordan = Mat::from_fn(2, 2, |i, j| if i == j { 0.9 } else { f64::from(u8::from(j > i)) });
        assert!(Modes::of(&Predictor { a: jordan, c: signal(1, 2, 1), k: None }).is_none());
    }
}
