//! Eigenvalues of a system with left and right eigenvectors, and the share of each mode in its response.

use super::modes::{Mode, mode};
use super::{StateSpace, TimeDomain};
use crate::linalg::{balance, eye};
use crate::{Error, Mat, Result, c64};
use faer::prelude::*;

/// Eigenvalues with left and right eigenvectors, scaled to `w' v = 1`, computed in balanced coordinates.
pub struct Eigen {
    poles: Vec<c64>,
    scale: Vec<f64>,
    right: Mat<c64>,
    left: Mat<c64>,
}

impl Eigen {
    /// Right and left eigenvectors of A, which is balanced first.
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvalues.
    pub fn new<T: TimeDomain>(model: &StateSpace<T>) -> Result<Self> {
        let scale = balance("the state matrix", model.a())?.scale;
        let n = model.order();
        let a = Mat::from_fn(n, n, |i, j| model.a()[(i, j)] * scale[j] / scale[i]);
        let failed = |_| Error::NoConvergence { what: "the eigenvectors of the state matrix".into(), iterations: 0 };
        let eigen = a.eigen().map_err(failed)?;
        let right = eigen.U().to_owned();
        let left = right.partial_piv_lu().solve(Mat::<c64>::identity(n, n));
        let poles = eigen.S().column_vector().iter().copied().collect();
        Ok(Eigen { poles, scale, right, left })
    }

    /// `w' dA v` for the pole nearest to the given one.
    pub fn change(&self, pole: c64, da: &Mat<f64>) -> c64 {
        let near = |k: &usize| (self.poles[*k] - pole).norm();
        let Some(k) = (0..self.poles.len()).min_by(|a, b| near(a).total_cmp(&near(b))) else {
            return c64::new(0.0, 0.0);
        };
        let n = self.scale.len();
        let mut sum = c64::new(0.0, 0.0);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            sum += self.left[(k, i)] * self.right[(j, k)] * (da[(i, j)] * self.scale[j] / self.scale[i]);
        }
        sum
    }

    /// The eigenvalues, in no order.
    pub fn poles(&self) -> &[c64] {
        &self.poles
    }

    /// The residue of pole number k as `c b`: `c = C v` (p values) and `b = w' B` (m values).
    pub fn directions<T: TimeDomain>(&self, k: usize, model: &StateSpace<T>) -> (Vec<c64>, Vec<c64>) {
        let n = self.scale.len();
        let along = |entry: &dyn Fn(usize) -> c64| (0..n).fold(c64::new(0.0, 0.0), |sum, i| sum + entry(i));
        let outputs = (0..model.outputs()).map(|r| along(&|i| self.right[(i, k)] * self.scale[i] * model.c()[(r, i)]));
        let inputs = (0..model.inputs()).map(|r| along(&|i| self.left[(k, i)] / self.scale[i] * model.b()[(i, r)]));
        (outputs.collect(), inputs.collect())
    }

    /// Frobenius norm of the residue `C v w' B` of pole number k.
    fn residue<T: TimeDomain>(&self, k: usize, model: &StateSpace<T>) -> f64 {
        let (c, b) = self.directions(k, model);
        let square = |sum: f64, v: &c64| sum + v.norm_sqr();
        (c.iter().fold(0.0, square) * b.iter().fold(0.0, square)).sqrt()
    }
}

/// A mode with its share in the response of a system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedMode {
    /// The mode.
    pub mode: Mode,
    /// Height of its resonance peak, `|C v w' B|` over the distance of its pole from the stability boundary, as a part of that of
    /// all modes together. The outputs count in their units.
    pub share: f64,
}

impl<T: TimeDomain> StateSpace<T> {
    /// The modes of a stable system with their shares in its response, largest first.
    ///
    /// # Errors
    /// [`Error::Unstable`] with the pole; [`Error::NoConvergence`] of the eigenvectors.
    ///
    /// ```
    /// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}};
    /// let a = Mat::from_fn(2, 2, |i, j| if i == j { [0.9, 0.5][i] } else { 0.0 });
    /// let system = StateSpace::new(a, eye(2), eye(2), Mat::zeros(2, 2), Discrete::new(1.0)?)?;
    /// let modes = system.shared_modes()?;
    /// // Peaks 1 / (1 - 0.9) and 1 / (1 - 0.5).
    /// assert!((modes[0].mode.pole.re - 0.9).abs() < 1e-12 && (modes[0].share - 10.0 / 12.0).abs() < 1e-12);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn shared_modes(&self) -> Result<Vec<SharedMode>> {
        self.require_stable("the system whose modes are compared")?;
        let eigen = Eigen::new(self)?;
        let upper = (0..eigen.poles.len()).filter(|k| eigen.poles[*k].im >= 0.0);
        let peak = |k: usize| eigen.residue(k, self) / -self.time().instability(eigen.poles[k]);
        let mut modes: Vec<SharedMode> =
            upper.map(|k| SharedMode { mode: mode(self.time(), eigen.poles[k]), share: peak(k) }).collect();
        let all: f64 = modes.iter().map(|m| m.share).sum();
        modes.iter_mut().for_each(|m| m.share /= if all > 0.0 { all } else { 1.0 });
        modes.sort_by(|a, b| b.share.total_cmp(&a.share));
        Ok(modes)
    }

    /// The same system with its inputs measured in `input` and its outputs in `output`, for example their rms: `G(i, j)` times
    /// `input[j] / output[i]`.
    ///
    /// # Panics
    /// Unless there is one number for each input and output.
    pub fn in_units(&self, input: &[f64], output: &[f64]) -> Self {
        let diagonal = |values: &[f64], of: &dyn Fn(f64) -> f64| {
            let one = eye(values.len());
            Mat::from_fn(values.len(), values.len(), |i, j| one[(i, j)] * of(values[i]))
        };
        self.map_input(&diagonal(input, &|v| v)).map_output(&diagonal(output, &|v| 1.0 / v))
    }
}
