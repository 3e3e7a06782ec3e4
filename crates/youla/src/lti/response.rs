//! Frequency response `G(s) = C (s I - A)^-1 B + D` on the stability boundary, `s = j omega` or `exp(j omega ts)`.
//!
//! One orthogonal reduction of A to Hessenberg form H serves all frequencies; each then costs one elimination of
//! `s I - H`, O(n^2 (1 + m)) (A. J. Laub, Efficient multivariable frequency response computations, IEEE Trans. Autom.
//! Control 26 (1981), 407).

use super::{StateSpace, TimeDomain};
use crate::linalg::hessenberg;
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};
use rayon::prelude::*;

/// Frequencies that one task computes.
const CHUNK: usize = 32;

/// Work (frequencies times n^2) below which threads cost more than they save.
const SERIAL_WORK: usize = 100_000;

/// The values `G(s(omega))` of a system with m inputs and p outputs.
#[derive(Debug, Clone)]
pub struct FrequencyResponse {
    /// Angular frequencies, rad/s, in the order in which they were given.
    pub omega: Vec<f64>,
    /// One p x m matrix after the other, each column-major.
    values: Vec<c64>,
    outputs: usize,
    inputs: usize,
}

impl FrequencyResponse {
    /// A response from its values: one p x m matrix after the other, each column-major.
    pub(crate) fn new(omega: Vec<f64>, values: Vec<c64>, outputs: usize, inputs: usize) -> Self {
        assert_eq!(values.len(), omega.len() * outputs * inputs, "one matrix for each frequency");
        FrequencyResponse { omega, values, outputs, inputs }
    }

    /// The response at frequency number `k`, p x m.
    ///
    /// # Panics
    /// If there is no frequency `k`.
    pub fn at(&self, k: usize) -> MatRef<'_, c64> {
        let size = self.outputs * self.inputs;
        MatRef::from_column_major_slice(&self.values[k * size..(k + 1) * size], self.outputs, self.inputs)
    }

    /// The response from input `j` to output `i` over all frequencies.
    ///
    /// # Panics
    /// If there is no such input or output.
    pub fn entry(&self, i: usize, j: usize) -> Vec<c64> {
        (0..self.omega.len()).map(|k| self.at(k)[(i, j)]).collect()
    }

    /// The matrices in the order of the frequencies.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = MatRef<'_, c64>> {
        (0..self.omega.len()).map(|k| self.at(k))
    }
}

/// Evaluates the transfer function at the angular frequencies `omega`, rad/s.
///
/// The relative error is near machine precision times the condition number of `s I - A` in balanced coordinates (1e-11 on
/// the bearing, held by `response_is_the_direct_solution`). The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::PoleOnBoundary`] naming the frequency where `s I - A` is singular to working precision;
/// [`Error::OutOfRange`] for a frequency that is not finite.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace, frequency_response}};
/// let lag = StateSpace::new(eye(1) * faer::Scale(-2.0), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// let response = frequency_response(&lag, &[0.0, 2.0])?;
/// assert!((response.at(0)[(0, 0)].re - 0.5).abs() < 1e-15);
/// assert!((response.entry(0, 0)[1].norm() - 0.125f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn frequency_response<T: TimeDomain>(system: &StateSpace<T>, omega: &[f64]) -> Result<FrequencyResponse> {
    if let Some(bad) = omega.iter().find(|w| !w.is_finite()) {
        return Err(Error::OutOfRange { what: "a frequency".into(), value: *bad, must: "finite, in rad/s" });
    }
    let (n, m, p) = (system.order(), system.inputs(), system.outputs());
    let form = HessenbergSystem::new(system)?;
    let mut values = vec![c64::new(0.0, 0.0); omega.len() * p * m];
    let size = (p * m).max(1);
    if omega.len() * n * n < SERIAL_WORK {
        form.fill(omega, &mut values, size)?;
    } else {
        let parts = values.par_chunks_mut(CHUNK * size).zip(omega.par_chunks(CHUNK));
        // Collected in order, so that the error is that of the first bad frequency.
        let outcomes: Vec<Result<()>> = parts.map(|(part, omega)| form.fill(omega, part, size)).collect();
        outcomes.into_iter().collect::<Result<()>>()?;
    }
    Ok(FrequencyResponse { omega: omega.to_vec(), values, outputs: p, inputs: m })
}

/// `(Q' D^-1 A D Q, Q' D^-1 B, C D Q, D)` with the balancing D and the Hessenberg reduction Q.
pub(super) struct HessenbergSystem<T> {
    h: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
    time: T,
}

impl<T: TimeDomain> HessenbergSystem<T> {
    pub(super) fn new(system: &StateSpace<T>) -> Result<Self> {
        let system = system.balanced()?;
        let form = hessenberg("the state matrix", system.a())?;
        let (b, c) = (form.q.transpose() * system.b(), system.c() * &form.q);
        Ok(HessenbergSystem { h: form.h, b, c, d: system.d().to_owned(), time: system.time() })
    }

    /// Writes one matrix per frequency.
    pub(super) fn fill(&self, omega: &[f64], values: &mut [c64], size: usize) -> Result<()> {
        let (n, m) = (self.h.nrows(), self.d.ncols());
        let mut work = vec![c64::new(0.0, 0.0); n * (n + m)];
        for (omega, value) in omega.iter().zip(values.chunks_exact_mut(size)) {
            if !self.evaluate(self.time.boundary(*omega), &mut work, value) {
                return Err(Error::PoleOnBoundary { omega: *omega });
            }
        }
        Ok(())
    }

    /// `C (s I - H)^-1 B + D`, column-major; false where `s I - H` is singular to working precision.
    fn evaluate(&self, s: c64, work: &mut [c64], value: &mut [c64]) -> bool {
        let (n, m, p) = (self.h.nrows(), self.d.ncols(), self.d.nrows());
        let width = n + m;
        self.load(s, work);
        let regular = eliminate(work, n, width);
        for j in 0..m {
            for i in 0..p {
                let mut sum = c64::new(self.d[(i, j)], 0.0);
                for k in 0..n {
                    sum += work[k * width + n + j] * self.c[(i, k)];
                }
                value[i + j * p] = sum;
            }
        }
        regular && value.iter().all(|v| v.re.is_finite() && v.im.is_finite())
    }

    /// `[s I - H, B]`, row after row.
    fn load(&self, s: c64, work: &mut [c64]) {
        let (n, m) = (self.h.nrows(), self.b.ncols());
        for (i, row) in work.chunks_exact_mut((n + m).max(1)).enumerate() {
            for j in 0..n {
                row[j] = c64::new(-self.h[(i, j)], 0.0);
            }
            row[i] += s;
            for j in 0..m {
                row[n + j] = c64::new(self.b[(i, j)], 0.0);
            }
        }
    }
}

/// Solves the Hessenberg equations `[M, B]` (row-major, n rows) in place by elimination with partial pivoting and
/// back-substitution; false where a pivot is zero to working precision.
fn eliminate(work: &mut [c64], n: usize, width: usize) -> bool {
    let norm = (0..n).flat_map(|i| work[i * width..i * width + n].iter()).fold(0.0_f64, |m, v| m.max(size(*v)));
    let floor = f64::EPSILON * norm;
    for k in 0..n {
        let (upper, lower) = work.split_at_mut((k + 1) * width);
        let pivot_row = &mut upper[k * width..];
        if k + 1 < n {
            let next = &mut lower[..width];
            if size(next[k]) > size(pivot_row[k]) {
                pivot_row[k..].swap_with_slice(&mut next[k..]);
            }
        }
        if size(pivot_row[k]) <= floor {
            return false;
        }
        if k + 1 < n && lower[k] != c64::new(0.0, 0.0) {
            let factor = lower[k] / pivot_row[k];
            for (target, source) in lower[k + 1..width].iter_mut().zip(&pivot_row[k + 1..]) {
                *target -= factor * source;
            }
        }
    }
    for k in (0..n).rev() {
        let (above, row) = work.split_at_mut(k * width);
        let pivot = row[k];
        for value in &mut row[n..width] {
            *value /= pivot;
        }
        for i in 0..k {
            let factor = above[i * width + k];
            for (target, source) in above[i * width + n..(i + 1) * width].iter_mut().zip(&row[n..width]) {
                *target -= factor * source;
            }
        }
    }
    true
}

/// `|Re v| + |Im v|`, as good as the modulus for pivoting.
fn size(v: c64) -> f64 {
    v.re.abs() + v.im.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::bearing;
    use crate::linalg::eye;
    use crate::lti::{Continuous, Discrete};
    use faer::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn complex(a: MatRef<'_, f64>) -> Mat<c64> {
        Mat::from_fn(a.nrows(), a.ncols(), |i, j| c64::new(a[(i, j)], 0.0))
    }

    fn direct<T: TimeDomain>(system: &StateSpace<T>, omega: f64) -> Mat<c64> {
        let n = system.order();
        let resolvent = Scale(system.time().boundary(omega)) * Mat::<c64>::identity(n, n) - complex(system.a());
        complex(system.c()) * resolvent.partial_piv_lu().solve(complex(system.b())) + complex(system.d())
    }

    fn check<T: TimeDomain>(system: &StateSpace<T>, omega: &[f64], tolerance: f64) {
        let response = frequency_response(system, omega).unwrap();
        for (k, value) in response.iter().enumerate() {
            let exact = direct(system, omega[k]);
            let error = (value - &exact).norm_l2() / exact.norm_l2();
            assert!(error < tolerance, "omega = {}: {error}", omega[k]);
        }
    }

    #[test]
    fn response_is_the_direct_solution() {
        let omega: Vec<f64> = (0..200).map(|k| 10f64.powf(0.02 * f64::from(k))).collect();
        let plant = bearing();
        check(&plant, &omega, 1e-11);
        check(&plant.zoh(Discrete::new(2e-4).unwrap()).unwrap(), &omega, 1e-11);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (n, m, p) in [(0, 2, 1), (1, 1, 1), (2, 1, 3), (9, 3, 2), (40, 2, 2)] {
            let mut draw = |r, c| {
                Mat::from_fn(r, c, |_, _| {
                    let x: f64 = StandardNormal.sample(&mut rng);
                    x
                })
            };
            let (a, b, c, d) = (draw(n, n), draw(n, m), draw(p, n), draw(p, m));
            check(&StateSpace::new(a, b, c, d, Continuous).unwrap(), &omega, 1e-11);
        }
    }

    #[test]
    fn many_frequencies_give_what_few_give() {
        let plant = bearing();
        let omega: Vec<f64> = (0..5000).map(f64::from).collect();
        let all = frequency_response(&plant, &omega).unwrap();
        for k in [0, 31, 32, 4999] {
            assert_eq!(all.at(k), frequency_response(&plant, &omega[k..=k]).unwrap().at(0));
        }
    }

    #[test]
    fn a_pole_on_the_boundary_is_named() {
        let a = Mat::from_fn(2, 2, |i, j| [[0.0, 3.0], [-3.0, 0.0]][i][j]);
        let oscillator = StateSpace::new(a, eye(2), eye(2), eye(2), Continuous).unwrap();
        assert!(matches!(
            frequency_response(&oscillator, &[1.0, 3.0]),
            Err(Error::PoleOnBoundary { omega }) if omega == 3.0
        ));
        let time = Discrete::new(0.1).unwrap();
        let integrator = StateSpace::new(eye(1), eye(1), eye(1), eye(1), time).unwrap();
        assert!(matches!(frequency_response(&integrator, &[0.0]), Err(Error::PoleOnBoundary { .. })));
        assert!(frequency_response(&integrator, &[1e-6]).is_ok());
        assert!(matches!(frequency_response(&integrator, &[f64::NAN]), Err(Error::OutOfRange { .. })));
    }
}
