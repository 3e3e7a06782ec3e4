//! Eigenvalues of a system with left and right eigenvectors, and the share of each mode in its response.

use super::modes::{Mode, mode};
use super::{StateSpace, TimeDomain};
use crate::linalg::{balance, eye};
use crate::{Error, Mat, MatRef, Result, c64};
use faer::prelude::*;

/// Poles nearer to each other than this part of the largest are equal.
const EQUAL: f64 = 1e-8;
/// Smallest `w' v` of unit vectors at which the eigenvectors of a group of equal poles are complete.
const COMPLETE: f64 = 1e-14;

/// Eigenvalues with left and right eigenvectors, scaled to `w' v = 1`, computed in balanced coordinates.
pub(crate) struct Eigen {
    poles: Vec<c64>,
    scale: Vec<f64>,
    right: Mat<c64>,
    left: Mat<c64>,
}

impl Eigen {
    pub(crate) fn new<T: TimeDomain>(model: &StateSpace<T>) -> Result<Self> {
        let scale = balance("the state matrix", model.a())?.scale;
        let n = model.order();
        let a = Mat::from_fn(n, n, |i, j| model.a()[(i, j)] * scale[j] / scale[i]);
        let failed = |_| Error::NoConvergence { what: "the eigenvectors of the state matrix".into(), iterations: 0 };
        let eigen = a.eigen().map_err(failed)?;
        let right = eigen.U().to_owned();
        let poles: Vec<c64> = eigen.S().column_vector().iter().copied().collect();
        let of_transpose = a.transpose().to_owned().eigen().map_err(failed)?;
        let values: Vec<c64> = of_transpose.S().column_vector().iter().copied().collect();
        let left = left_vectors(&poles, right.as_ref(), &values, of_transpose.U());
        Ok(Eigen { poles, scale, right, left })
    }

    /// `w' dA v` for the pole nearest to the given one.
    pub(crate) fn change(&self, pole: c64, da: &Mat<f64>) -> c64 {
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
    pub(crate) fn poles(&self) -> &[c64] {
        &self.poles
    }

    /// The residue of pole number k as `c b`: `c = C v` (p values) and `b = w' B` (m values).
    pub(crate) fn directions<T: TimeDomain>(&self, k: usize, model: &StateSpace<T>) -> (Vec<c64>, Vec<c64>) {
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

/// Left eigenvectors as rows from the eigenvectors of A', with `W V = I` within each group of equal poles: between groups the two are
/// orthogonal. The inverse of V would be lost for all poles where one lacks eigenvectors, such as that of a delay of two samples;
/// its group keeps the vectors as they are.
fn left_vectors(poles: &[c64], right: MatRef<'_, c64>, values: &[c64], vectors: MatRef<'_, c64>) -> Mat<c64> {
    let n = poles.len();
    let mut free: Vec<usize> = (0..n).collect();
    let nearest = |pole: &c64| {
        let distance = |place: usize, free: &[usize]| (values[free[place]] - pole).norm();
        let place = (0..free.len()).min_by(|i, j| distance(*i, &free).total_cmp(&distance(*j, &free))).unwrap_or(0);
        free.swap_remove(place)
    };
    let of_pole: Vec<usize> = poles.iter().map(nearest).collect();
    let size = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let mut left = Mat::zeros(n, n);
    for k in 0..n {
        let group: Vec<usize> = (0..n).filter(|j| (poles[*j] - poles[k]).norm() <= EQUAL * size).collect();
        let v = Mat::from_fn(n, group.len(), |i, j| right[(i, group[j])]);
        let w = Mat::from_fn(group.len(), n, |i, j| vectors[(j, of_pole[group[i]])]);
        let product = &w * &v;
        let smallest = product.singular_values().ok().and_then(|all| all.last().copied()).unwrap_or(0.0);
        let complete = smallest > COMPLETE * v.norm_l2() * w.norm_l2();
        let rows = if complete { product.partial_piv_lu().solve(&w) } else { w };
        let own = group.iter().filter(|j| **j < k).count();
        left.row_mut(k).copy_from(rows.row(own));
    }
    left
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lti::Discrete;

    /// `c b` of the pole in the upper half plane, for a mode before a delay, and for two modes with the same poles beside it.
    #[test]
    fn residues_do_not_depend_on_delays_and_equal_poles() {
        let (time, [a1, a2, b1, b2]) = (Discrete::new(1.0).unwrap(), [-1.9, 0.98, 0.02, 0.015]);
        let p = c64::new(-a1 / 2.0, (a2 - a1 * a1 / 4.0_f64).sqrt());
        let mode = |n: usize, at: usize, i: usize, j: usize| match (i.checked_sub(at), j.checked_sub(at)) {
            (Some(i), Some(j)) if i < 2 && j < 2 => [[-a1, 1.0], [-a2, 0.0]][i][j],
            _ if n > at + 2 && j == at && i == at + 2 => 1.0,
            _ => 0.0,
        };
        for delay in [0, 1, 2, 3, 7] {
            let n = 2 + delay;
            let shift = |i: usize, j: usize| if j >= 2 && i == j + 1 { 1.0 } else { mode(n, 0, i, j) };
            let b = Mat::from_fn(n, 1, |i, _| [b1, b2].get(i).copied().unwrap_or(0.0));
            let last = if delay == 0 { 0 } else { n - 1 };
            let c = Mat::from_fn(1, n, |_, j| if j == last { 1.0 } else { 0.0 });
            let system = StateSpace::new(Mat::from_fn(n, n, shift), b, c, Mat::zeros(1, 1), time).unwrap();
            let eigen = Eigen::new(&system).unwrap();
            let k = (0..n).max_by(|i, j| eigen.poles[*i].im.total_cmp(&eigen.poles[*j].im)).unwrap();
            let (c, b) = eigen.directions(k, &system);
            let expected = (p * b1 + b2) / (p - p.conj()) * p.powi(-(delay as i32));
            assert!((c[0] * b[0] / expected - 1.0).norm() < 1e-12, "{delay}: {} {expected}", c[0] * b[0]);
        }
        let twice = Mat::from_fn(4, 4, |i, j| mode(0, 0, i, j) + mode(0, 2, i, j));
        let b = Mat::from_fn(4, 2, |i, j| if i / 2 == j { [b1, b2][i % 2] } else { 0.0 });
        let c = Mat::from_fn(2, 4, |i, j| if j == 2 * i { 1.0 } else { 0.0 });
        let turn = Mat::from_fn(4, 4, |i, j| f64::from(u8::from(i == j)) - 0.5);
        let system = StateSpace::new(&turn * twice * &turn, &turn * b, c * &turn, Mat::zeros(2, 2), time).unwrap();
        let eigen = Eigen::new(&system).unwrap();
        let mut sum = Mat::<c64>::zeros(2, 2);
        for k in (0..4).filter(|k| eigen.poles[*k].im > 0.0) {
            let (c, b) = eigen.directions(k, &system);
            sum += Mat::from_fn(2, 2, |i, j| c[i] * b[j]);
        }
        let expected = (p * b1 + b2) / (p - p.conj());
        let error = |i: usize, j: usize| (sum[(i, j)] - if i == j { expected } else { c64::new(0.0, 0.0) }).norm();
        assert!((0..4).all(|k| error(k / 2, k % 2) < 1e-12 * expected.norm()), "{sum:?} {expected}");
    }
}
