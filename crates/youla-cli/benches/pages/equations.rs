//! Random matrix equations with the residuals of their solutions.

use faer::{Mat, Scale};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::Result;
use youla::linalg::{RiccatiProblem, care, dare, discrete_lyapunov, eye, lyapunov, sylvester};

/// The kinds of equation.
pub(crate) const KINDS: [&str; 5] =
    ["Riccati, continuous", "Riccati, discrete", "Lyapunov", "Stein (discrete Lyapunov)", "Sylvester"];

/// One equation: A, B, Q of a Riccati equation; A, Q of a Lyapunov equation; A, B, C of `A X + X B = C`.
pub(crate) struct Equation {
    kind: usize,
    matrices: Vec<Mat<f64>>,
}

impl Equation {
    /// Eigenvalues of A over a disc of radius 1 (1.1 in discrete time); A stable for Lyapunov equations.
    pub(crate) fn random(kind: usize, n: usize, seed: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut normal = |rows, columns| Mat::from_fn(rows, columns, |_, _| rng.sample::<f64, _>(StandardNormal));
        let m = (n / 10).max(2);
        let a = normal(n, n) * Scale(1.0 / (n as f64).sqrt());
        let outputs = normal(m, n);
        let q = outputs.transpose() * &outputs;
        let matrices = match kind {
            0 => vec![a, normal(n, m), q],
            1 => vec![a * Scale(1.1), normal(n, m), q],
            2 => vec![a - eye(n) * Scale(1.2), q],
            3 => vec![a * Scale(0.9), q],
            _ => vec![a, normal(m, m) * Scale(1.0 / (m as f64).sqrt()) + eye(m) * Scale(3.0), normal(n, m)],
        };
        Equation { kind, matrices }
    }

    /// The relative residual of the solution.
    pub(crate) fn residual(&self) -> Result<f64> {
        let m: Vec<_> = self.matrices.iter().map(|m| m.as_ref()).collect();
        let riccati = || {
            let r = eye(m[1].ncols());
            let problem = RiccatiProblem { a: m[0], b: m[1], q: m[2], r: r.as_ref(), s: None };
            let solve = if self.kind == 0 { care } else { dare };
            solve("X", &problem).map(|found| found.relative_residual)
        };
        match self.kind {
            0 | 1 => riccati(),
            2 => lyapunov(m[0], m[1]).map(|found| found.residual),
            3 => discrete_lyapunov(m[0], m[1]).map(|found| found.residual),
            _ => sylvester("X", m[0], m[1], m[2]).map(|found| found.relative_residual),
        }
    }
}
