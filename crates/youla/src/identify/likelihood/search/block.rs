//! One block of a model in block-diagonal form.

use crate::linalg::real_schur;
use faer::{Mat, c64};

/// One block of s states.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Block {
    /// Number of states s.
    pub(crate) states: usize,
    /// A, s x s, row by row.
    pub(crate) a: Vec<f64>,
    /// B, s x m, row by row.
    pub(crate) b: Vec<f64>,
    /// C, p x s, row by row.
    pub(crate) c: Vec<f64>,
}

impl Block {
    /// Poles of the block.
    pub(crate) fn poles(&self) -> Vec<c64> {
        match self.states {
            1 => vec![c64::new(self.a[0], 0.0)],
            2 => {
                let (half, det) = (0.5 * (self.a[0] + self.a[3]), self.a[0] * self.a[3] - self.a[1] * self.a[2]);
                let root = 0.5 * (self.a[0] - self.a[3]);
                let disc = root * root + self.a[1] * self.a[2];
                if disc >= 0.0 {
                    let far = half + half.signum() * disc.sqrt();
                    let near = if far == 0.0 { 0.0 } else { det / far };
                    vec![c64::new(far, 0.0), c64::new(near, 0.0)]
                } else {
                    vec![c64::new(half, (-disc).sqrt()), c64::new(half, -(-disc).sqrt())]
                }
            }
            s => {
                let a = Mat::from_fn(s, s, |i, j| self.a[i * s + j]);
                real_schur("A", a.as_ref()).map(|f| f.eigenvalues()).unwrap_or_default()
            }
        }
    }

    /// Whether A has blocks of at most two states along its diagonal and zeros below them.
    pub(crate) fn is_triangular(&self) -> bool {
        let s = self.states;
        let below = |i: usize, j: usize| self.a[i * s + j] != 0.0;
        (2..s).all(|i| (0..i - 1).all(|j| !below(i, j)) && !(below(i, i - 1) && below(i - 1, i - 2)))
    }

    /// The block and t (which may be empty) in the states of the real Schur form of A; as they are where A is triangular already.
    pub(crate) fn triangular(&self, t: &[f64]) -> Option<(Block, Vec<f64>)> {
        if self.is_triangular() {
            return Some((self.clone(), t.to_vec()));
        }
        let s = self.states;
        let (m, p) = (self.b.len() / s, self.c.len() / s);
        let form = real_schur("A", Mat::from_fn(s, s, |i, j| self.a[i * s + j]).as_ref()).ok()?;
        let sum = |of: &dyn Fn(usize) -> f64| (0..s).map(of).sum::<f64>();
        let block = Block {
            states: s,
            a: (0..s * s).map(|x| form.t[(x / s, x % s)]).collect(),
            b: (0..s * m).map(|x| sum(&|i| form.q[(i, x / m)] * self.b[i * m + x % m])).collect(),
            c: (0..p * s).map(|x| sum(&|i| self.c[x / s * s + i] * form.q[(i, x % s)])).collect(),
        };
        let ends = if t.is_empty() { 0 } else { s };
        Some((block, (0..ends).map(|k| sum(&|i| form.q[(i, k)] * t[i])).collect()))
    }

    /// The block with responses that cost less: triangular, where A has a Schur form.
    pub(crate) fn quickened(&self) -> Block {
        self.triangular(&[]).map_or_else(|| self.clone(), |(block, _)| block)
    }

    /// (z I - A)^-1, row by row.
    pub(crate) fn resolvent(&self, z: c64, out: &mut [c64]) {
        match self.states {
            1 => out[0] = (z - self.a[0]).inv(),
            2 => {
                let (p, q) = (z - self.a[0], z - self.a[3]);
                let scale = (p * q - self.a[1] * self.a[2]).inv();
                (out[0], out[1], out[2], out[3]) = (q * scale, scale * self.a[1], scale * self.a[2], p * scale);
            }
            s => {
                let entry =
                    |i: usize, j: usize| if i == j { z - self.a[i * s + j] } else { c64::new(-self.a[i * s + j], 0.0) };
                invert(s, entry, out);
            }
        }
    }

    /// `(z I - A)^-1 B` and `C (z I - A)^-1`.
    pub(crate) fn sides(&self, z: c64) -> (Mat<c64>, Mat<c64>) {
        let s = self.states;
        let (m, p) = (self.b.len() / s, self.c.len() / s);
        let mut inverse = vec![c64::ZERO; s * s];
        self.resolvent(z, &mut inverse);
        let x = |i: usize, j: usize| (0..s).fold(c64::ZERO, |sum, l| sum + inverse[i * s + l] * self.b[l * m + j]);
        let left = |o: usize, j: usize| (0..s).fold(c64::ZERO, |sum, i| sum + inverse[i * s + j] * self.c[o * s + i]);
        (Mat::from_fn(s, m, x), Mat::from_fn(p, s, left))
    }

    /// States scaled so that each has a like share of B and C, in units of one.
    pub(crate) fn levelled(mut self) -> Self {
        let s = self.states;
        let (m, p) = (self.b.len() / s, self.c.len() / s);
        let size = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        let b = size(&mut self.b.iter().copied());
        let c = size(&mut self.c.iter().copied());
        if b > 0.0 && c > 0.0 && (b * c).is_finite() {
            let scale = (c / b).sqrt();
            self.b.iter_mut().for_each(|v| *v *= scale);
            self.c.iter_mut().for_each(|v| *v /= scale);
        }
        debug_assert!(m * s == self.b.len() && p * s == self.c.len());
        self
    }
}

/// The inverse of an s x s matrix by Gauss-Jordan with partial pivoting, and the magnitude of its determinant.
pub(crate) fn invert(s: usize, entry: impl Fn(usize, usize) -> c64, out: &mut [c64]) -> f64 {
    let w = 2 * s;
    let mut determinant = 1.0;
    let mut work = vec![c64::ZERO; s * w];
    for i in 0..s {
        for j in 0..s {
            work[i * w + j] = entry(i, j);
        }
        work[i * w + s + i] = c64::ONE;
    }
    for col in 0..s {
        let mut pivot = col;
        for row in col + 1..s {
            if work[row * w + col].norm_sqr() > work[pivot * w + col].norm_sqr() {
                pivot = row;
            }
        }
        if pivot != col {
            for j in 0..w {
                work.swap(pivot * w + j, col * w + j);
            }
        }
        determinant *= work[col * w + col].norm_sqr();
        let inverse = work[col * w + col].inv();
        for j in 0..w {
            work[col * w + j] *= inverse;
        }
        for row in 0..s {
            let factor = work[row * w + col];
            if row != col && factor != c64::ZERO {
                for j in 0..w {
                    let above = work[col * w + j];
                    work[row * w + j] -= factor * above;
                }
            }
        }
    }
    for i in 0..s {
        for j in 0..s {
            out[i * s + j] = work[i * w + s + j];
        }
    }
    determinant.sqrt()
}
