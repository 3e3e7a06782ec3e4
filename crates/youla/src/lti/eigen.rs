//! Eigenvalues of a system with left and right eigenvectors, and the share of each mode in its response.

use super::modes::{Mode, mode};
use super::{StateSpace, TimeDomain};
use crate::linalg::{Eigenvectors, Group, balance, eye};
use crate::{Mat, Result, c64};

/// Eigenvalues with left and right eigenvectors, scaled to `w' v = 1`, computed in balanced coordinates. Equal poles share the bases of
/// their eigenvectors; where they lack some (delays), those of their invariant subspaces.
pub struct Eigen {
    scale: Vec<f64>,
    vectors: Eigenvectors,
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
        Ok(Eigen { vectors: Eigenvectors::of("the state matrix", a.as_ref())?, scale })
    }

    /// `w' dA v` for the pole nearest to the given one; of equal poles the change of their mean, since only this is differentiable.
    pub fn change(&self, pole: c64, da: &Mat<f64>) -> c64 {
        let near = |k: usize| (self.poles()[k] - pole).norm();
        let distance = |g: &&Group| g.members.iter().map(|k| near(*k)).fold(f64::INFINITY, f64::min);
        let nearest = self.vectors.groups.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(group) = nearest else { return c64::ZERO };
        let (n, Eigenvectors { right, left, .. }) = (self.scale.len(), &self.vectors);
        let mut sum = c64::ZERO;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let projector = group.members.iter().fold(c64::ZERO, |sum, k| sum + left[(*k, i)] * right[(j, *k)]);
            sum += projector * (da[(i, j)] * self.scale[j] / self.scale[i]);
        }
        sum / group.members.len() as f64
    }

    /// The eigenvalues, in no order.
    pub fn poles(&self) -> &[c64] {
        &self.vectors.values
    }

    /// The places of equal poles that have an eigenvector each; simple poles are groups of one.
    pub fn complete_groups(&self) -> impl Iterator<Item = &[usize]> {
        self.vectors.groups.iter().filter(|g| g.complete).map(|g| g.members.as_slice())
    }

    /// The residue of pole number k as `c b`: `c = C v` (p values) and `b = w' B` (m values). Of equal poles only the sum of these
    /// products does not depend on the choice of the vectors.
    pub fn directions<T: TimeDomain>(&self, k: usize, model: &StateSpace<T>) -> (Vec<c64>, Vec<c64>) {
        let n = self.scale.len();
        let along = |entry: &dyn Fn(usize) -> c64| (0..n).fold(c64::new(0.0, 0.0), |sum, i| sum + entry(i));
        let outputs =
            (0..model.outputs()).map(|r| along(&|i| self.vectors.right[(i, k)] * self.scale[i] * model.c()[(r, i)]));
        let inputs =
            (0..model.inputs()).map(|r| along(&|i| self.vectors.left[(k, i)] / self.scale[i] * model.b()[(i, r)]));
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
    /// [`crate::Error::Unstable`] with the pole; [`crate::Error::NoConvergence`] of the eigenvectors.
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
        let poles = eigen.poles();
        let upper = (0..poles.len()).filter(|k| poles[*k].im >= 0.0);
        let peak = |k: usize| eigen.residue(k, self) / -self.time().instability(poles[k]);
        let mut modes: Vec<SharedMode> =
            upper.map(|k| SharedMode { mode: mode(self.time(), poles[k]), share: peak(k) }).collect();
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
    use crate::linalg::block_diagonal;
    use crate::lti::Discrete;

    /// Two states with the poles of `z^2 - 1.9 z + 0.98`.
    fn oscillator() -> Mat<f64> {
        Mat::from_fn(2, 2, |i, j| [[1.9, 1.0], [-0.98, 0.0]][i][j])
    }

    fn pole() -> c64 {
        c64::new(0.95, (0.98 - 0.95_f64 * 0.95).sqrt())
    }

    fn system(a: &Mat<f64>, b: Mat<f64>, c: Mat<f64>) -> StateSpace<Discrete> {
        let d = Mat::zeros(c.nrows(), b.ncols());
        StateSpace::new(a.clone(), b, c, d, Discrete::new(1.0).unwrap()).unwrap()
    }

    fn sum_of_residues(system: &StateSpace<Discrete>) -> Mat<c64> {
        let eigen = Eigen::new(system).unwrap();
        let mut sum = Mat::<c64>::zeros(system.outputs(), system.inputs());
        for k in (0..system.order()).filter(|k| (eigen.poles()[*k] - pole()).norm() < 1e-3) {
            let (c, b) = eigen.directions(k, system);
            sum += Mat::from_fn(c.len(), b.len(), |i, j| c[i] * b[j]);
        }
        sum
    }

    /// The residue of a mode before a delay is its own, times a power of the pole.
    #[test]
    fn residues_do_not_depend_on_delays() {
        let (p, [b1, b2]) = (pole(), [0.02, 0.015]);
        for delay in [0, 1, 2, 3, 7] {
            let n = 2 + delay;
            let chain = Mat::from_fn(delay, delay, |i, j| f64::from(u8::from(i == j + 1)));
            let mut a = block_diagonal(oscillator().as_ref(), chain.as_ref());
            if delay > 0 {
                a[(2, 0)] = 1.0;
            }
            let b = Mat::from_fn(n, 1, |i, _| [b1, b2].get(i).copied().unwrap_or(0.0));
            let last = if delay == 0 { 0 } else { n - 1 };
            let c = Mat::from_fn(1, n, |_, j| f64::from(u8::from(j == last)));
            let expected = (p * b1 + b2) / (p - p.conj()) * p.powi(-(delay as i32));
            let found = sum_of_residues(&system(&a, b, c))[(0, 0)];
            assert!((found / expected - 1.0).norm() < 1e-11, "{delay}: {found} {expected}");
        }
    }

    /// Two equal pairs in mixed states: the residue of both together is diagonal.
    #[test]
    fn residues_of_equal_pairs_are_complete() {
        let (p, [b1, b2]) = (pole(), [0.02, 0.015]);
        let b = Mat::from_fn(4, 2, |i, j| if i / 2 == j { [b1, b2][i % 2] } else { 0.0 });
        let c = Mat::from_fn(2, 4, |i, j| f64::from(u8::from(j == 2 * i)));
        let turn = Mat::from_fn(4, 4, |i, j| f64::from(u8::from(i == j)) - 0.5);
        let twice = &turn * block_diagonal(oscillator().as_ref(), oscillator().as_ref()) * &turn;
        let sum = sum_of_residues(&system(&twice, &turn * b, c * &turn));
        let expected = (p * b1 + b2) / (p - p.conj());
        let error = |i: usize, j: usize| (sum[(i, j)] - if i == j { expected } else { c64::ZERO }).norm();
        assert!((0..4).all(|k| error(k / 2, k % 2) < 1e-12 * expected.norm()), "{sum:?} {expected}");
    }

    /// The change of a pole, or of the mean of equal ones, against central differences: 1e-6.
    #[test]
    fn changes_agree_with_finite_differences() {
        let delays = Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == j + 1)));
        let twice = block_diagonal(oscillator().as_ref(), oscillator().as_ref());
        let cases = [oscillator(), twice.clone(), block_diagonal(twice.as_ref(), delays.as_ref())];
        for (case, plain) in cases.iter().enumerate() {
            let n = plain.nrows();
            let turn = Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - 2.0 / n as f64);
            let a = &turn * plain * &turn;
            let change = Mat::from_fn(n, n, |i, j| ((3 * i + 7 * j + 1) as f64).sin());
            let of = |h: f64| system(&(&a + faer::Scale(h) * &change), Mat::zeros(n, 1), Mat::zeros(1, n));
            let mean = |h: f64| {
                let near: Vec<c64> = of(h).poles().unwrap().into_iter().filter(|z| (z - pole()).norm() < 0.1).collect();
                near.iter().fold(c64::ZERO, |sum, z| sum + z) / near.len() as f64
            };
            let slope = |h: f64| (mean(h) - mean(-h)) / (2.0 * h);
            let expected = (slope(1e-5) * 4.0 - slope(2e-5)) / 3.0;
            let found = Eigen::new(&of(0.0)).unwrap().change(pole(), &change);
            assert!((found / expected - 1.0).norm() < 1e-6, "case {case}: {found} {expected}");
        }
    }
}
