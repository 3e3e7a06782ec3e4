//! How the outputs depend on x0, B and D: the regressors of the output-error problem, one sample after another.
//!
//! The predictor is `xhat+ = A xhat + B u + K y, yhat = C xhat + D u`; a plain simulation is the case K = 0. Since
//! `yhat = C A^k x0 + sum_q (sum_j C A^(k-1-j) u_q(j)) b_q + D u + known`, the sensitivities to all of B are rows of
//! length n that obey `M_q+ = M_q A + C u_q`: p n numbers per input, instead of the n n of `(z I - A)^-1 u_q`.

use crate::linalg::block;
use faer::{ColMut, Mat, MatMut, MatRef};

/// Sensitivities below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;

/// What is fixed while B, D and x0 are sought.
pub(super) struct Predictor {
    /// `A - K C`, n x n.
    pub(super) a: Mat<f64>,
    /// Output matrix, p x n.
    pub(super) c: Mat<f64>,
    /// Gain K, n x p; none for a simulation.
    pub(super) k: Option<Mat<f64>>,
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
pub(super) struct Sensitivity {
    unknowns: Unknowns,
    /// Rows of A and of C, contiguous.
    a: Vec<f64>,
    c: Vec<f64>,
    /// p rows for x0, then p rows for each input.
    rows: Vec<f64>,
    /// Scratch of one row.
    next: Vec<f64>,
    /// The share of the outputs that is known beforehand: driven by y through K.
    known: Option<Observer>,
}

impl Sensitivity {
    pub(super) fn new(predictor: &Predictor, unknowns: Unknowns) -> Self {
        let (n, p) = (unknowns.states, unknowns.outputs);
        let c = by_rows(predictor.c.as_ref());
        let mut rows = vec![0.0; (1 + unknowns.inputs) * p * n];
        if unknowns.initial > 0 {
            rows[..p * n].copy_from_slice(&c);
        }
        let known = predictor.k.as_ref().map(|_| Observer::new(predictor, None, &vec![0.0; n]));
        Sensitivity { unknowns, a: by_rows(predictor.a.as_ref()), c, rows, next: vec![0.0; n], known }
    }

    /// Writes the rows of the samples `u, y` (p rows each) and moves on behind them.
    pub(super) fn fill(&mut self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, mut block: MatMut<'_, f64>) {
        let (n, m, p) = (self.unknowns.states, self.unknowns.inputs, self.unknowns.outputs);
        for k in 0..u.nrows() {
            self.write(u, k, block.as_mut().subrows_mut(k * p, p));
            (0..m + 1).for_each(|group| self.advance(group, if group == 0 { 0.0 } else { u[(k, group - 1)] }));
        }
        debug_assert_eq!(self.rows.len(), (1 + m) * p * n);
        self.write_targets(u, y, block.col_mut(self.unknowns.width() - 1));
    }

    /// The regressors of one sample.
    fn write(&self, u: MatRef<'_, f64>, k: usize, mut block: MatMut<'_, f64>) {
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
        }
    }

    /// `M+ = M A + C u` for one input, or for x0 with u = 0.
    fn advance(&mut self, group: usize, u: f64) {
        let size = self.c.len();
        let n = self.next.len();
        for (row, c) in self.rows[group * size..][..size].chunks_exact_mut(n).zip(self.c.chunks_exact(n)) {
            self.next.iter_mut().zip(c).for_each(|(next, c)| *next = u * c);
            for (value, a) in row.iter().zip(self.a.chunks_exact(n)) {
                self.next.iter_mut().zip(a).for_each(|(next, a)| *next += value * a);
            }
            row.iter_mut().zip(&self.next).for_each(|(v, new)| *v = if new.abs() < VANISHED { 0.0 } else { *new });
        }
    }

    /// The outputs without their known share.
    fn write_targets(&mut self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, mut target: ColMut<'_, f64>) {
        let p = self.unknowns.outputs;
        let known = self.known.as_mut().map(|known| known.run(u, y));
        for (k, i) in (0..y.nrows()).flat_map(|k| (0..p).map(move |i| (k, i))) {
            target[k * p + i] = y[(k, i)] - known.as_ref().map_or(0.0, |known| known[(k, i)]);
        }
    }
}

/// One-step predictions (without K: the simulated output) from an initial state, piece by piece.
pub(super) struct Observer {
    /// Rows of `[A B K]` and of `[C D 0]`, contiguous.
    state_rows: Vec<f64>,
    output_rows: Vec<f64>,
    /// `[x; u; y]` of the present sample.
    joint: Vec<f64>,
    next: Vec<f64>,
    /// Whether u and y stand in the joint vector.
    inputs: bool,
    observes: bool,
}

impl Observer {
    /// With `B - K D` and D, or without inputs.
    pub(super) fn new(predictor: &Predictor, inputs: Option<(MatRef<'_, f64>, MatRef<'_, f64>)>, x0: &[f64]) -> Self {
        let (n, p) = (x0.len(), predictor.c.nrows());
        let (none_b, none_d) = (Mat::zeros(n, 0), Mat::zeros(p, 0));
        let (b, d) = inputs.unwrap_or((none_b.as_ref(), none_d.as_ref()));
        let none_k = Mat::zeros(n, 0);
        let k = predictor.k.as_ref().unwrap_or(&none_k).as_ref();
        let no_y = Mat::zeros(p, k.ncols());
        let state_rows = by_rows(block(&[&[predictor.a.as_ref(), b, k]]).as_ref());
        let output_rows = by_rows(block(&[&[predictor.c.as_ref(), d, no_y.as_ref()]]).as_ref());
        let mut joint = vec![0.0; n + b.ncols() + k.ncols()];
        joint[..n].copy_from_slice(x0);
        let (inputs, observes) = (b.ncols() > 0, k.ncols() > 0);
        Observer { state_rows, output_rows, joint, next: vec![0.0; n], inputs, observes }
    }

    /// The predictions of the next samples; the state moves on behind them.
    pub(super) fn run(&mut self, u: MatRef<'_, f64>, y: MatRef<'_, f64>) -> Mat<f64> {
        let (n, width) = (self.next.len(), self.joint.len());
        let mut predicted = Mat::zeros(y.nrows(), y.ncols());
        for k in 0..y.nrows() {
            let signals = self.inputs.then_some(u).into_iter().chain(self.observes.then_some(y));
            let values = signals.flat_map(|s| (0..s.ncols()).map(move |q| s[(k, q)]));
            self.joint[n..].iter_mut().zip(values).for_each(|(v, new)| *v = new);
            for (i, row) in self.output_rows.chunks_exact(width).enumerate() {
                predicted[(k, i)] = dot(row, &self.joint);
            }
            for (next, row) in self.next.iter_mut().zip(self.state_rows.chunks_exact(width)) {
                *next = dot(row, &self.joint);
            }
            self.joint[..n].copy_from_slice(&self.next);
        }
        predicted
    }
}

/// The entries of a matrix, row after row.
fn by_rows(a: MatRef<'_, f64>) -> Vec<f64> {
    a.row_iter().flat_map(|row| row.iter().copied()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
