//! Invariant zeros: the values of lambda at which the system matrix `[A - lambda I, B; C, D]` loses rank. Those of a minimal
//! system are its transmission zeros.
//!
//! Orthogonal compressions remove the zeros at infinity until D is square and invertible: A. Emami-Naeini and P. Van
//! Dooren, Computation of zeros of linear multivariable systems, Automatica 18 (1982), 415. The finite zeros are then the
//! eigenvalues of `A - B D^-1 C`.

use super::discretise::power_of_two;
use super::{StateSpace, TimeDomain};
use crate::linalg::{block, eigenvalues, solve};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};

impl<T: TimeDomain> StateSpace<T> {
    /// The finite invariant zeros, for any number of inputs and outputs.
    ///
    /// Ranks are decided at `10 n eps` of the norm of the scaled system matrix (zeros beyond about 1e13 times the poles
    /// count as infinite). The system matrix is singular at every zero (held by `system_matrix_loses_rank_at_every_zero`).
    ///
    /// # Errors
    /// [`Error::NoConvergence`] of an eigenvalue or singular value iteration.
    ///
    /// ```
    /// use youla::{Mat, lti::{Continuous, StateSpace}};
    /// // (s + 3) / ((s + 1) (s + 2))
    /// let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [-2.0, -3.0]][i][j]);
    /// let b = Mat::from_fn(2, 1, |i, _| [0.0, 1.0][i]);
    /// let c = Mat::from_fn(1, 2, |_, j| [3.0, 1.0][j]);
    /// let zeros = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zeros()?;
    /// assert!(zeros.len() == 1 && (zeros[0].re + 3.0).abs() < 1e-14);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn zeros(&self) -> Result<Vec<c64>> {
        let pencil = Pencil::scaled(self)?;
        let size = self.order() + self.inputs().max(self.outputs());
        let floor = 10.0 * size as f64 * f64::EPSILON * pencil.norm();
        let Pencil { a, b, c, d } = pencil.remove_infinite(floor)?.dual().remove_infinite(floor)?;
        let feedback = solve("the feedthrough that remains for the zeros", d.as_ref(), c.as_ref())?;
        eigenvalues("the matrix of the zeros", (a - b * feedback).as_ref())
    }
}

/// The matrices of a system during the reduction.
struct Pencil {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
}

impl Pencil {
    /// The system with balanced states, and inputs and outputs of about the size of A; its zeros are the same.
    fn scaled<T: TimeDomain>(system: &StateSpace<T>) -> Result<Self> {
        let system = system.balanced()?;
        let [a, mut b, mut c, mut d] = [system.a(), system.b(), system.c(), system.d()].map(|m| m.to_owned());
        let size = a.norm_max();
        for j in 0..d.ncols() {
            let factor = power_of_two(size, b.col(j).norm_max().max(d.col(j).norm_max()));
            b.col_mut(j).iter_mut().chain(d.col_mut(j).iter_mut()).for_each(|v| *v *= factor);
        }
        for i in 0..d.nrows() {
            let factor = power_of_two(size, c.row(i).norm_max().max(d.row(i).norm_max()));
            c.row_mut(i).iter_mut().chain(d.row_mut(i).iter_mut()).for_each(|v| *v *= factor);
        }
        Ok(Pencil { a, b, c, d })
    }

    fn norm(&self) -> f64 {
        [&self.a, &self.b, &self.c, &self.d].into_iter().map(|m| m.norm_l2()).fold(0.0, f64::hypot)
    }

    fn dual(self) -> Self {
        let t = |m: Mat<f64>| m.transpose().to_owned();
        Pencil { a: t(self.a), b: t(self.c), c: t(self.b), d: t(self.d) }
    }

    /// Makes D of full row rank. Outputs without feedthrough, `C2 x = 0`, hold the states that they see at zero; the
    /// equations of those states then become the outputs of the others.
    fn remove_infinite(mut self, floor: f64) -> Result<Self> {
        loop {
            let Pencil { a, b, c, d } = self;
            let (u, rank) = range(d.as_ref(), floor)?;
            let (c, d) = (u.transpose() * c, u.transpose() * d);
            let silent = d.nrows() - rank;
            let (c1, d1) = (c.subrows(0, rank), d.subrows(0, rank));
            let (v, seen) = range(c.subrows(rank, silent).transpose(), floor)?;
            if seen == 0 {
                return Ok(Pencil { a, b, c: c1.to_owned(), d: d1.to_owned() });
            }
            let (a, b, c1) = (v.transpose() * a * &v, v.transpose() * b, c1 * &v);
            let rest = a.nrows() - seen;
            self = Pencil {
                c: block(&[&[c1.subcols(seen, rest)], &[a.submatrix(0, seen, seen, rest)]]),
                d: block(&[&[d1], &[b.subrows(0, seen)]]),
                a: a.submatrix(seen, seen, rest, rest).to_owned(),
                b: b.subrows(seen, rest).to_owned(),
            };
        }
    }
}

/// An orthogonal matrix whose first columns span the range, and their number: the singular values above `floor`.
fn range(a: MatRef<'_, f64>, floor: f64) -> Result<(Mat<f64>, usize)> {
    if a.nrows() == 0 || a.ncols() == 0 {
        return Ok((Mat::identity(a.nrows(), a.nrows()), 0));
    }
    let svd = a.svd().map_err(|_| Error::NoConvergence { what: "the zeros".into(), iterations: 0 })?;
    let rank = svd.S().column_vector().iter().filter(|s| **s > floor).count();
    Ok((svd.U().to_owned(), rank))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::bearing;
    use crate::linalg::eye;
    use crate::lti::{Continuous, Discrete};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Smallest singular value of the system matrix over its largest.
    fn singularity<T: TimeDomain>(system: &StateSpace<T>, zero: c64) -> f64 {
        let n = system.order();
        let matrix = block(&[&[system.a(), system.b()], &[system.c(), system.d()]]);
        let matrix = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
            let shift = if i == j && i < n { zero } else { c64::new(0.0, 0.0) };
            c64::new(matrix[(i, j)], 0.0) - shift
        });
        let singular = matrix.singular_values().unwrap();
        singular[singular.len() - 1] / singular[0]
    }

    #[test]
    fn system_matrix_loses_rank_at_every_zero() {
        let mut rng = ChaCha8Rng::seed_from_u64(51);
        for (n, ports, feedthrough, expected) in [(5, 1, 1.0, 5), (6, 2, 0.0, 4), (9, 3, 0.0, 6), (4, 2, 1.0, 4)] {
            let mut draw = |r: usize, c: usize| Mat::<f64>::from_fn(r, c, |_, _| StandardNormal.sample(&mut rng));
            let (a, b, c) = (draw(n, n), draw(n, ports), draw(ports, n));
            let d = faer::Scale(feedthrough) * draw(ports, ports);
            let system = StateSpace::new(a, b, c, d, Continuous).unwrap();
            let zeros = system.zeros().unwrap();
            assert_eq!(zeros.len(), expected);
            for zero in zeros {
                assert!(singularity(&system, zero) < 1e-12);
            }
            assert!(singularity(&system, c64::new(0.3, 0.4)) > 1e-6);
        }
    }

    #[test]
    fn triple_integrator_has_the_sampling_zeros_of_the_euler_polynomial() {
        let a = Mat::from_fn(3, 3, |i, j| f64::from(u8::from(j == i + 1)));
        let b = Mat::from_fn(3, 1, |i, _| f64::from(u8::from(i == 2)));
        let c = Mat::from_fn(1, 3, |_, j| f64::from(u8::from(j == 0)));
        let chain = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous).unwrap();
        assert!(chain.zeros().unwrap().is_empty());
        for ts in [1e-4, 1.0] {
            let mut zeros: Vec<f64> =
                chain.zoh(Discrete::new(ts).unwrap()).unwrap().zeros().unwrap().iter().map(|z| z.re).collect();
            zeros.sort_by(f64::total_cmp);
            // z^2 + 4 z + 1
            assert!(
                (zeros[0] + 2.0 + 3f64.sqrt()).abs() < 1e-8 && (zeros[1] + 2.0 - 3f64.sqrt()).abs() < 1e-8,
                "{zeros:?}"
            );
        }
    }

    #[test]
    fn bearing_has_zeros_only_when_sampled() {
        let plant = bearing();
        assert!(plant.zeros().unwrap().is_empty());
        let zeros = plant.zoh(Discrete::new(2e-4).unwrap()).unwrap().zeros().unwrap();
        assert_eq!(zeros.len(), 4);
        // Two channels of relative degree 3: near to -2 - sqrt(3) and -2 + sqrt(3).
        assert!(
            zeros.iter().all(|z| z.im == 0.0 && ((z.re + 3.7).abs() < 0.4 || (z.re + 0.27).abs() < 0.05)),
            "{zeros:?}"
        );
    }

    #[test]
    fn unobservable_and_decoupled_modes_are_invariant_zeros_and_tall_systems_have_none() {
        let a = Mat::from_fn(2, 2, |i, j| if i == j { [-1.0, -7.0][i] } else { 0.0 });
        let ones = Mat::from_fn(2, 1, |_, _| 1.0);
        let first = Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]);
        let zeros = StateSpace::new(a.clone(), ones.clone(), first, Mat::zeros(1, 1), Continuous).unwrap().zeros();
        let zeros = zeros.unwrap();
        assert!(zeros.len() == 1 && (zeros[0].re + 7.0).abs() < 1e-13);
        let tall = StateSpace::new(a, ones, eye(2), Mat::zeros(2, 1), Continuous).unwrap();
        assert!(tall.zeros().unwrap().is_empty());
    }
}
