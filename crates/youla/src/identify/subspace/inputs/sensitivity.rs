//! How one output depends on x0, B and D: the regressors of the output-error problem, one sample after another.
//!
//! The predictor is `xhat+ = A xhat + B u + K y, yhat = C xhat + D u`; a plain simulation is the case K = 0. For one output
//! with the row c of C,
//! ```text
//! yhat(k) = c A^k x0 + sum_q (sum_{j<k} c A^(k-1-j) u_q(j)) b_q + d u(k) + (driven by y through K, known beforehand)
//! ```
//! so the sensitivities to the column b_q of B are a row of length n that obeys `g_q+ = g_q A + c u_q`: n numbers per input
//! and output, instead of the n n of `(z I - A)^-1 u_q`.

use crate::linalg::block;
use faer::{Mat, MatMut, MatRef};

/// Sensitivities below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;

/// What is fixed while B, D and x0 are sought.
pub(crate) struct Predictor {
    /// `A - K C`, n x n.
    pub(crate) a: Mat<f64>,
    /// Output matrix, p x n.
    pub(crate) c: Mat<f64>,
    /// Gain K, n x p; none for a simulation.
    pub(crate) k: Option<Mat<f64>>,
}

/// What is sought, and where it is among the columns.
pub(crate) struct Unknowns {
    pub(crate) states: usize,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// n, or 0 where the initial state is zero.
    pub(crate) initial: usize,
    /// Coefficients of known disturbances, known signals x outputs.
    pub(crate) disturbances: usize,
    /// Per output, the inputs whose entries of D are sought.
    pub(crate) direct: Vec<Vec<usize>>,
}

impl Unknowns {
    /// Unknowns of B.
    pub(crate) fn of_b(&self) -> usize {
        self.states * self.inputs
    }

    /// Unknowns of the rows of D above the one of output i.
    pub(crate) fn of_d_above(&self, i: usize) -> usize {
        self.direct[..i].iter().map(Vec::len).sum()
    }

    /// Unknowns of each experiment by itself: x0, then the coefficients of disturbances, known signal by known signal within
    /// each output.
    pub(crate) fn own(&self) -> usize {
        self.initial + self.disturbances
    }

    /// Unknowns that all experiments share: B by columns, then D by rows.
    pub(crate) fn common(&self) -> usize {
        self.of_b() + self.of_d_above(self.outputs)
    }

    /// Columns of output i: `[x0 | disturbances | B | its row of D | y]`.
    pub(crate) fn width_of_output(&self, i: usize) -> usize {
        self.own() + self.of_b() + self.direct[i].len() + 1
    }

    /// B (or `B - K D`) and D from the vector of common unknowns.
    pub(crate) fn unpack(&self, solution: MatRef<'_, f64>) -> (Mat<f64>, Mat<f64>) {
        let (n, m) = (self.states, self.inputs);
        let driven = Mat::from_fn(n, m, |l, q| solution[(q * n + l, 0)]);
        let mut d = Mat::zeros(self.outputs, m);
        let entries = self.direct.iter().enumerate().flat_map(|(i, inputs)| inputs.iter().map(move |q| (i, *q)));
        entries.enumerate().for_each(|(place, (i, q))| d[(i, q)] = solution[(m * n + place, 0)]);
        (driven, d)
    }

    /// Columns of one experiment: `[x0 | disturbances | B | D | y]`.
    pub(crate) fn width(&self) -> usize {
        self.own() + self.common() + 1
    }
}

/// The recursion for one output of one experiment.
pub(crate) struct Sensitivity<'a> {
    unknowns: &'a Unknowns,
    output: usize,
    /// Rows of A, contiguous.
    a: Vec<f64>,
    /// Row of C.
    c: Vec<f64>,
    /// Sensitivities to x0 and to the columns of B, n each.
    rows: Vec<f64>,
    next: Vec<f64>,
}

impl<'a> Sensitivity<'a> {
    pub(crate) fn new(predictor: &Predictor, output: usize, unknowns: &'a Unknowns) -> Self {
        let n = unknowns.states;
        let c: Vec<f64> = predictor.c.row(output).iter().copied().collect();
        let mut rows = vec![0.0; (1 + unknowns.inputs) * n];
        rows[..n].copy_from_slice(&c);
        Sensitivity { unknowns, output, a: by_rows(predictor.a.as_ref()), c, rows, next: vec![0.0; n] }
    }

    /// Writes the rows of the next samples and moves on behind them. `known` are the regressors of the disturbances'
    /// coefficients; the last column is `target`.
    pub(crate) fn fill(
        &mut self,
        u: MatRef<'_, f64>,
        known: MatRef<'_, f64>,
        target: &[f64],
        mut piece: MatMut<'_, f64>,
    ) {
        let n = self.unknowns.states;
        let skipped = n - self.unknowns.initial;
        for k in 0..u.nrows() {
            let (of_x0, of_b) = (&self.rows[skipped..n], &self.rows[n..]);
            let of_d = self.unknowns.direct[self.output].iter().map(|q| u[(k, *q)]);
            let of_known = known.row(k).iter().copied();
            let states = of_x0.iter().copied().chain(of_known).chain(of_b.iter().copied());
            let values = states.chain(of_d).chain([target[k]]);
            piece.as_mut().row_mut(k).iter_mut().zip(values).for_each(|(entry, value)| *entry = value);
            self.advance(|input| u[(k, input)]);
        }
    }

    /// `g+ = g A + c u`, with u = 0 for x0.
    fn advance(&mut self, u: impl Fn(usize) -> f64) {
        let n = self.c.len();
        for (group, row) in self.rows.chunks_exact_mut(n).enumerate() {
            let drive = if group == 0 { 0.0 } else { u(group - 1) };
            self.next.iter_mut().zip(&self.c).for_each(|(next, c)| *next = drive * c);
            for (value, a) in row.iter().zip(self.a.chunks_exact(n)) {
                self.next.iter_mut().zip(a).for_each(|(next, a)| *next += value * a);
            }
            row.iter_mut().zip(&self.next).for_each(|(v, new)| *v = if new.abs() < VANISHED { 0.0 } else { *new });
        }
    }
}

/// The outputs without what they drive themselves through K, in pieces of a record: the state goes from one to the next.
#[derive(Clone)]
pub(crate) struct KnownShare {
    /// Rows of `[A K]` and of C.
    ak: Vec<f64>,
    c: Vec<f64>,
    /// `[x; y]`.
    joint: Vec<f64>,
    next: Vec<f64>,
}

impl KnownShare {
    /// `None` for a simulation.
    pub(crate) fn new(predictor: &Predictor) -> Option<Self> {
        let k = predictor.k.as_ref()?;
        let (n, p) = (k.nrows(), k.ncols());
        let ak = by_rows(block(&[&[predictor.a.as_ref(), k.as_ref()]]).as_ref());
        Some(KnownShare { ak, c: by_rows(predictor.c.as_ref()), joint: vec![0.0; n + p], next: vec![0.0; n] })
    }

    /// `y - C x` for the next samples.
    pub(crate) fn without(&mut self, y: MatRef<'_, f64>) -> Mat<f64> {
        let (n, width) = (self.next.len(), self.joint.len());
        let mut targets = Mat::zeros(y.nrows(), y.ncols());
        for k in 0..y.nrows() {
            self.joint[..n].copy_from_slice(&self.next);
            (n..width).for_each(|i| self.joint[i] = y[(k, i - n)]);
            for (i, row) in self.c.chunks_exact(n).enumerate() {
                targets[(k, i)] = y[(k, i)] - dot(row, &self.joint[..n]);
            }
            let rows = self.ak.chunks_exact(width);
            self.next.iter_mut().zip(rows).for_each(|(x, row)| *x = dot(row, &self.joint));
        }
        targets
    }
}

/// The entries of a matrix, row after row.
fn by_rows(a: MatRef<'_, f64>) -> Vec<f64> {
    a.row_iter().flat_map(|row| row.iter().copied()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
