//! The regressors of B, D and x0 for all outputs at once, in the coordinates in which A is diagonal.
//!
//! With `A = V diag(lambda) V^-1` the response to a column b of B, and to x0, is
//! ```text
//! yhat_i(k) = Re sum_j gamma_ij beta_j z_j(k),   gamma = C V,   beta = V^-1 b,   z_j(k+1) = lambda_j z_j(k) + u(k)
//! ```
//! (for x0: `z_j(k) = lambda_j^k`). The outputs share the z; each is the product of them with a small matrix. So one pass with
//! two multiplications per number serves all outputs, where the recursion for one output alone takes n of them. It needs
//! eigenvectors that are far from dependent; [`Modes::of`] says where they are not.

use super::disturbance::KnownColumns;
use super::sensitivity::{Predictor, Unknowns};
use crate::linalg::{Eigenvectors, SequentialQr};
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
/// Lanes that may run at the same time; fixed, so that the result does not depend on the threads.
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
        let eigen = Eigenvectors::of("the state matrix of the predictor", predictor.a.as_ref()).ok()?;
        let n = predictor.a.nrows();
        if !eigen.complete() {
            return None;
        }
        let mut v = eigen.right;
        for j in 0..n {
            let length = v.col(j).norm_l2();
            v.col_mut(j).iter_mut().for_each(|x| *x /= length);
        }
        let sigma = v.singular_values().ok()?;
        if sigma.last()? / sigma.first()? < INDEPENDENT {
            return None;
        }
        let inverse = v.partial_piv_lu().solve(Mat::<c64>::identity(n, n));
        let lambda = eigen.values;
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

    /// One per real pole and one per pair.
    pub(super) fn lambda(&self) -> &[c64] {
        &self.lambda
    }

    /// Real numbers in the z of one input.
    fn width(&self) -> usize {
        self.lambda.iter().map(|l| if l.im == 0.0 { 1 } else { 2 }).sum()
    }

    /// Per output, the triangular factor over `[x0 | disturbances | B | its row of D | y]`, from that over `[z of x0 | z of
    /// every input | u for D, regressors of disturbances, outputs]`. The channels of the shared factor are divided by `scale`,
    /// first those of the inputs.
    pub(super) fn by_outputs(
        &self,
        mut shared: Mat<f64>,
        known: &KnownColumns,
        unknowns: &Unknowns,
        scale: &[f64],
    ) -> Vec<Mat<f64>> {
        let (n, free) = (unknowns.states, usize::from(unknowns.initial > 0));
        let driven = (free + unknowns.inputs) * n;
        let (inputs, outputs) = scale.split_at(unknowns.inputs);
        let width = shared.ncols();
        let of_channel = |column: usize| match column {
            c if c < free * n => 1.0,
            c if c < driven => inputs[c / n - free],
            c if c < driven + unknowns.through() => inputs[c - driven],
            c if c >= width - outputs.len() => outputs[c + outputs.len() - width],
            _ => 1.0,
        };
        for c in 0..width {
            let inverse = 1.0 / of_channel(c);
            shared.col_mut(c).iter_mut().for_each(|value| *value *= inverse);
        }
        (0..unknowns.outputs).map(|i| self.of_output(shared.as_ref(), i, known, unknowns)).collect()
    }

    fn of_output(&self, shared: MatRef<'_, f64>, i: usize, known: &KnownColumns, unknowns: &Unknowns) -> Mat<f64> {
        let (n, free) = (unknowns.states, usize::from(unknowns.initial > 0));
        let (groups, width) = (unknowns.inputs + free, unknowns.width_of_output(i));
        let mut rows = Mat::zeros(shared.nrows(), width);
        for g in 0..groups {
            let place = g * n + if g < free { 0 } else { unknowns.disturbances };
            rows.as_mut().subcols_mut(place, n).copy_from(shared.subcols(g * n, n) * &self.to_states[i]);
        }
        let of_targets = shared.ncols() - unknowns.outputs;
        let of_known = of_targets - known.columns();
        for j in 0..unknowns.disturbances {
            if let Some(column) = known.column(i, j) {
                rows.col_mut(unknowns.initial + j).copy_from(shared.col(of_known + column));
            }
        }
        let of_d = unknowns.own() + unknowns.of_b();
        for (j, q) in unknowns.direct[i].iter().enumerate() {
            rows.col_mut(of_d + j).copy_from(shared.col(groups * n + q));
        }
        rows.col_mut(width - 1).copy_from(shared.col(of_targets + i));
        let mut triangle = SequentialQr::new(width, shared.nrows());
        triangle.fold_rows(rows.as_ref());
        triangle.r().to_owned()
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

/// The triangular factor over `[z of x0 | z of every input | beside]` by QR of its rows, which lanes of samples take in.
pub(super) struct Rows {
    state: State,
    triangle: SequentialQr,
}

impl Rows {
    /// Of no samples, for a number of columns beside.
    pub(super) fn new(modes: &Modes, unknowns: &Unknowns, beside: usize) -> Self {
        let groups = unknowns.inputs + usize::from(unknowns.initial > 0);
        let width = groups * modes.width() + beside;
        Rows { state: State::new(&modes.lambda, unknowns), triangle: SequentialQr::new(width, width) }
    }

    /// Takes in the next samples.
    pub(super) fn add(&mut self, u: MatRef<'_, f64>, beside: MatRef<'_, f64>) {
        let samples = u.nrows();
        let lanes = samples.div_ceil(PIECE).min(LANES);
        let starts: Vec<usize> = (0..=lanes).map(|l| l * samples / lanes).collect();
        let state = &mut self.state;
        let begun: Vec<State> = starts[..lanes]
            .iter()
            .zip(&starts[1..])
            .map(|(start, end)| {
                let begun = state.clone();
                for piece in (*start..*end).step_by(PIECE) {
                    (piece..(piece + PIECE).min(*end)).for_each(|k| state.advance(u, k));
                    state.flush();
                }
                begun
            })
            .collect();
        let width = self.triangle.width();
        let parts: Vec<Mat<f64>> = begun
            .into_par_iter()
            .enumerate()
            .map(|(lane, mut state)| {
                let mut triangle = SequentialQr::new(width, PIECE);
                for start in (starts[lane]..starts[lane + 1]).step_by(PIECE) {
                    let count = PIECE.min(starts[lane + 1] - start);
                    triangle.fold(count, |piece| state.fill(u, beside, start, piece));
                }
                triangle.r().to_owned()
            })
            .collect();
        parts.iter().for_each(|part| self.triangle.fold_rows(part.as_ref()));
    }

    pub(super) fn factor(&self) -> Mat<f64> {
        self.triangle.r().to_owned()
    }
}

/// All z of one sample: groups (x0, then the inputs) of modes.
#[derive(Clone)]
struct State {
    re: Vec<f64>,
    im: Vec<f64>,
    lambda_re: Vec<f64>,
    lambda_im: Vec<f64>,
    drive: Vec<f64>,
    modes: usize,
    /// Groups that are not driven: 1 with unknown initial states.
    free: usize,
}

impl State {
    fn new(lambda: &[c64], unknowns: &Unknowns) -> Self {
        let free = usize::from(unknowns.initial > 0);
        let (modes, groups) = (lambda.len(), unknowns.inputs + free);
        let repeated = |part: &dyn Fn(&c64) -> f64| (0..groups).flat_map(|_| lambda.iter().map(part)).collect();
        let re = (0..groups * modes).map(|k| if k < free * modes { 1.0 } else { 0.0 }).collect();
        State {
            re,
            im: vec![0.0; groups * modes],
            lambda_re: repeated(&|l| l.re),
            lambda_im: repeated(&|l| l.im),
            drive: vec![0.0; groups * modes],
            modes,
            free,
        }
    }

    fn advance(&mut self, u: MatRef<'_, f64>, k: usize) {
        let driven = self.drive[self.free * self.modes..].chunks_exact_mut(self.modes);
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
    fn fill(&mut self, u: MatRef<'_, f64>, beside: MatRef<'_, f64>, start: usize, mut piece: MatMut<'_, f64>) {
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
            for i in 0..beside.ncols() {
                row[column + i] = beside[(start + k, i)];
            }
            self.advance(u, start + k);
        }
        self.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::super::disturbance::Regressors;
    use super::super::modal_sums::Sums;
    use super::super::sensitivity::Sensitivity;
    use super::*;
    use crate::linalg::block;

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

    fn unknowns(initial: usize, disturbances: usize, direct: Vec<Vec<usize>>) -> Unknowns {
        Unknowns { states: 7, inputs: 3, outputs: 2, initial, disturbances, direct }
    }

    #[test]
    fn modal_and_direct_regressors_have_the_same_factor() {
        let predictor = predictor();
        let modes = Modes::of(&predictor).unwrap();
        let (u, y) = (signal(2500, 3, 1), signal(2500, 2, 9));
        for (initial, direct, h) in
            [(7, vec![vec![0, 1, 2]; 2], 0), (0, vec![vec![]; 2], 2), (7, vec![vec![2], vec![0, 1]], 2)]
        {
            let unknowns = unknowns(initial, 2 * h, direct);
            let known = Regressors {
                signals: signal(2500, h, 5),
                columns: KnownColumns { known: h, outputs: 2, crossed: false },
            };
            let through = u.subcols(0, unknowns.through());
            let beside = block(&[&[through, known.signals.as_ref(), y.as_ref()]]);
            let mut rows = Rows::new(&modes, &unknowns, beside.ncols());
            // In two parts, the state goes from one to the other.
            rows.add(u.subrows(0, 900), beside.subrows(0, 900));
            rows.add(u.subrows(900, 1600), beside.subrows(900, 1600));
            let by_modes = modes.by_outputs(rows.factor(), &known.columns, &unknowns, &[1.0; 5]);
            for (i, modal) in by_modes.iter().enumerate() {
                let target: Vec<f64> = y.col(i).iter().copied().collect();
                let mut triangle = SequentialQr::new(unknowns.width_of_output(i), 2500);
                let mut direct = Sensitivity::new(&predictor, i, &unknowns);
                let known = known.columns.of_output(known.signals.as_ref(), i);
                triangle.fold(2500, |piece| direct.fill(u.as_ref(), known.as_ref(), &target, piece));
                let (one, other) = (modal.transpose() * modal, triangle.r().transpose() * triangle.r());
                let error = (&one - &other).norm_max() / other.norm_max();
                assert!(error < 1e-12, "output {i}, {initial} initial states: {error:.1e}");
            }
        }
    }

    #[test]
    fn sums_and_rows_give_the_same_factor() {
        let modes = Modes::of(&predictor()).unwrap();
        let (u, beside) = (signal(5000, 3, 1), signal(5000, 5, 9));
        for initial in [7, 0] {
            let unknowns = unknowns(initial, 0, vec![vec![]; 2]);
            let mut rows = Rows::new(&modes, &unknowns, 5);
            rows.add(u.as_ref(), beside.as_ref());
            let rows = rows.factor();
            for cut in [0, 1, 3333] {
                let mut sums = Sums::new(modes.lambda(), 3, 5);
                sums.add(u.subrows(0, cut), beside.subrows(0, cut));
                sums.add(u.subrows(cut, 5000 - cut), beside.subrows(cut, 5000 - cut));
                let sums = sums.factor(initial > 0).unwrap();
                let (one, other) = (sums.transpose() * &sums, rows.transpose() * &rows);
                let error = (&one - &other).norm_max() / other.norm_max();
                assert!(error < 1e-13, "{initial} initial states, cut at {cut}: {error:.1e}");
            }
        }
    }

    #[test]
    fn outputs_without_noise_are_left_to_the_rows() {
        let modes = Modes::of(&predictor()).unwrap();
        let u = signal(3000, 1, 1);
        let beside = block(&[&[u.as_ref(), u.as_ref()]]);
        let mut sums = Sums::new(modes.lambda(), 1, 2);
        sums.add(u.as_ref(), beside.as_ref());
        assert!(sums.factor(false).is_none());
    }

    #[test]
    fn nearly_dependent_eigenvectors_are_left_to_the_direct_way() {
        let jordan = Mat::from_fn(2, 2, |i, j| if i == j { 0.9 } else { f64::from(u8::from(j > i)) });
        assert!(Modes::of(&Predictor { a: jordan, c: signal(1, 2, 1), k: None }).is_none());
    }
}
