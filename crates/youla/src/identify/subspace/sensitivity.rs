//! How the outputs depend on x0, B and D: the regressors of the output-error problem, one sample after another.
//!
//! The predictor is `xhat+ = A xhat + B u + K y, yhat = C xhat + D u`; a plain simulation is the case K = 0. Since
//! `yhat = C A^k x0 + sum_q (sum_j C A^(k-1-j) u_q(j)) b_q + D u + known`, the sensitivities to all of B are rows of
//! length n that obey `M_q+ = M_q A + C u_q`: p n numbers per input, instead of the n n of `(z I - A)^-1 u_q`.

use faer::{Mat, MatMut, MatRef};

/// Sensitivities below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;

/// What is fixed while B, D and x0 are sought.
pub(super) struct Predictor {
    /// `A - K C`, n x n.
    pub(super) a: Mat<f64>,
    /// Output matrix, p x n.
    pub(super) c: Mat<f64>,
    /// Gain K, n x p, zero for a simulation.
    pub(super) k: Mat<f64>,
}

/// Where the unknowns stand among the columns: `[x0 | b_1 .. b_m | d_1 .. d_m | y]`.
#[derive(Clone, Copy)]
pub(super) struct Unknowns {
    pub(super) states: usize,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// n, or 0 where the initial state is zero.
    pub(super) initial: usize,
    /// Whether D is sought.
    pub(super) feedthrough: bool,
}

impl Unknowns {
    /// Columns that are common to all experiments: B and D.
    pub(super) fn common(&self) -> usize {
        self.states * self.inputs + if self.feedthrough { self.outputs * self.inputs } else { 0 }
    }

    /// All columns, with the one of the outputs.
    pub(super) fn width(&self) -> usize {
        self.initial + self.common() + 1
    }
}

/// The recursion over one experiment.
pub(super) struct Sensitivity<'a> {
    unknowns: Unknowns,
    predictor: &'a Predictor,
    /// Rows of A, contiguous.
    a_rows: Vec<f64>,
    /// p rows for x0, then p rows for each input.
    rows: Vec<f64>,
    /// The state that the known outputs drive through K.
    known: Vec<f64>,
}

impl<'a> Sensitivity<'a> {
    pub(super) fn new(predictor: &'a Predictor, unknowns: Unknowns) -> Self {
        let (n, p) = (unknowns.states, unknowns.outputs);
        let a_rows = (0..n * n).map(|k| predictor.a[(k / n, k % n)]).collect();
        let mut rows = vec![0.0; (1 + unknowns.inputs) * p * n];
        (0..p * n).for_each(|k| rows[k] = predictor.c[(k / n, k % n)]);
        Sensitivity { unknowns, predictor, a_rows, rows, known: vec![0.0; n] }
    }

    /// Writes the rows of the samples `u, y` (p rows each) and moves on behind them.
    pub(super) fn fill(&mut self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, mut block: MatMut<'_, f64>) {
        for k in 0..u.nrows() {
            self.write(u, y, k, block.as_mut().subrows_mut(k * self.unknowns.outputs, self.unknowns.outputs));
            self.advance(u, y, k);
        }
    }

    fn write(&self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, k: usize, mut block: MatMut<'_, f64>) {
        let Unknowns { states: n, inputs, outputs: p, initial, feedthrough } = self.unknowns;
        for i in 0..p {
            for l in 0..initial {
                block[(i, l)] = self.rows[i * n + l];
            }
            for q in 0..inputs {
                let row = &self.rows[((1 + q) * p + i) * n..][..n];
                for (l, value) in row.iter().enumerate() {
                    block[(i, initial + q * n + l)] = *value;
                }
                if feedthrough {
                    block[(i, initial + inputs * n + q * p + i)] = u[(k, q)];
                }
            }
            let known: f64 = (0..n).map(|l| self.predictor.c[(i, l)] * self.known[l]).sum();
            block[(i, self.unknowns.width() - 1)] = y[(k, i)] - known;
        }
    }

    fn advance(&mut self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, k: usize) {
        let Unknowns { states: n, inputs, outputs: p, .. } = self.unknowns;
        let mut next = vec![0.0; n];
        for (r, row) in self.rows.chunks_exact_mut(n).enumerate() {
            let (group, i) = (r / p, r % p);
            let drive = if group == 0 { 0.0 } else { u[(k, group - 1)] };
            next.iter_mut().enumerate().for_each(|(l, v)| *v = drive * self.predictor.c[(i, l)]);
            for (value, a_row) in row.iter().zip(self.a_rows.chunks_exact(n)) {
                if *value != 0.0 {
                    next.iter_mut().zip(a_row).for_each(|(sum, a)| *sum += value * a);
                }
            }
            row.iter_mut().zip(&next).for_each(|(v, new)| *v = if new.abs() < VANISHED { 0.0 } else { *new });
        }
        debug_assert_eq!(self.rows.len(), (1 + inputs) * p * n);
        advance_state(&self.a_rows, &mut self.known, &mut next);
        for (l, state) in self.known.iter_mut().enumerate() {
            *state += (0..p).map(|i| self.predictor.k[(l, i)] * y[(k, i)]).sum::<f64>();
        }
    }
}

/// `x = A x`, with A by rows.
fn advance_state(a_rows: &[f64], x: &mut [f64], scratch: &mut [f64]) {
    for (new, row) in scratch.iter_mut().zip(a_rows.chunks_exact(x.len())) {
        *new = row.iter().zip(x.iter()).map(|(a, v)| a * v).sum();
    }
    x.copy_from_slice(scratch);
}

/// One-step predictions (for K = 0: the simulated output) from an initial state.
pub(super) fn predict(
    predictor: &Predictor,
    b: MatRef<'_, f64>,
    d: MatRef<'_, f64>,
    x0: &[f64],
    u: MatRef<'_, f64>,
    y: MatRef<'_, f64>,
) -> Mat<f64> {
    let (n, m, p) = (x0.len(), u.ncols(), y.ncols());
    let a_rows: Vec<f64> = (0..n * n).map(|k| predictor.a[(k / n, k % n)]).collect();
    let (mut x, mut scratch) = (x0.to_vec(), vec![0.0; n]);
    let mut predicted = Mat::zeros(u.nrows(), p);
    for k in 0..u.nrows() {
        for i in 0..p {
            let states: f64 = (0..n).map(|l| predictor.c[(i, l)] * x[l]).sum();
            predicted[(k, i)] = states + (0..m).map(|q| d[(i, q)] * u[(k, q)]).sum::<f64>();
        }
        advance_state(&a_rows, &mut x, &mut scratch);
        for (l, state) in x.iter_mut().enumerate() {
            *state += (0..m).map(|q| b[(l, q)] * u[(k, q)]).sum::<f64>();
            *state += (0..p).map(|i| predictor.k[(l, i)] * y[(k, i)]).sum::<f64>();
        }
    }
    predicted
}
