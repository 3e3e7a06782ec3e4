//! The exact test of a loop by the deviation system, with its identity as a check of the computation.
//!
//! The loop of a plant G(S) and a controller K(Q) has the poles of the loop of S and Q, and besides only the poles of the
//! factors, which are stable:
//! ```text
//! det(z I - A_loop) = det(z I - A_(S,Q)) det(z I - A_right) det(z I - A_left)
//! ```
//! so that K(Q) stabilises G(S) exactly when `(I - Q S)^-1` is stable, and K = K(0) exactly when S is. Source: theory of
//! the Youla-Jabr-Bongiorno-Kucera parametrisation; T.-T. Tay, I. Mareels, J. B. Moore, High Performance Control, 1998,
//! section 3.4. Both sides are computed here; determinants are compared because multiple poles, which the loop has by
//! construction, are worth only half of the digits.

use crate::control::{closed_loop, with_input_port};
use crate::factor::CoprimeFactors;
use crate::linalg::eye;
use crate::lti::{StateSpace, TimeDomain};
use crate::{Mat, MatRef, Result, c64};

/// Points on a circle around all poles at which the identity is checked.
const POINTS: usize = 16;

/// What the deviation system says of a loop.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactCertificate {
    /// Poles of the loop of S and Q; those of S for Q = 0.
    pub deviation_poles: Vec<c64>,
    /// The one of them farthest beyond the stability boundary; `None` without states.
    pub worst_pole: Option<c64>,
    /// Whether the loop of S and Q is stable, and with it that of G(S) and K(Q).
    pub stable: bool,
    /// Largest relative difference of the two sides of the identity, over points on a circle around all poles.
    pub identity_residual: f64,
}

/// Tests the loop of G(S) with K(Q), `q` from beta to alpha, or with K itself for none.
///
/// Accuracy: the identity holds to 1e-9 for the loops of this project (test `the_identity_holds`).
///
/// # Errors
/// Ports, sample times, [`crate::Error::AlgebraicLoop`], [`crate::Error::NoConvergence`].
///
/// ```
/// use youla::{Mat, factor::CoprimeFactors, linalg::eye, lti::{Discrete, StateSpace}, validate::certify_deviation};
/// let time = Discrete::new(1e-3)?;
/// let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
/// let nominal = StateSpace::new(number(1.1), eye(1), eye(1), number(0.0), time)?;
/// let factors = CoprimeFactors::observer(&nominal, number(-0.6).as_ref(), number(-0.7).as_ref())?;
/// // A machine with a pole at 1.2 instead of 1.1: the loop still has its poles inside.
/// let machine = StateSpace::new(number(1.2), eye(1), eye(1), number(0.0), time)?;
/// let tested = certify_deviation(&factors, &factors.deviation_of(&machine)?, None)?;
/// assert!(tested.stable && tested.identity_residual < 1e-12);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn certify_deviation<T: TimeDomain>(
    factors: &CoprimeFactors<T>,
    s: &StateSpace<T>,
    q: Option<&StateSpace<T>>,
) -> Result<ExactCertificate> {
    let (inner, controller) = match q {
        Some(q) => (closed_loop(s, &with_input_port(q)?)?, factors.controller_of(q)?),
        None => (s.clone(), factors.controller()?),
    };
    let whole = closed_loop(&factors.plant_of(s)?, &with_input_port(&controller)?)?;
    let (right, left) = (factors.right().system(), factors.left().system());
    Ok(ExactCertificate {
        deviation_poles: inner.poles()?,
        worst_pole: inner.worst_pole()?,
        stable: inner.is_stable()?,
        identity_residual: identity_residual(whole.a(), &[inner.a(), right.a(), left.a()])?,
    })
}

/// Largest `|product of det(z I - A_i) / det(z I - A) - 1|` on a circle half again as large as the largest pole.
fn identity_residual(whole: MatRef<'_, f64>, parts: &[MatRef<'_, f64>]) -> Result<f64> {
    let whole = Pencil::new(whole)?;
    let parts = parts.iter().map(|a| Pencil::new(*a)).collect::<Result<Vec<_>>>()?;
    let radius = parts.iter().map(|p| p.radius).fold(whole.radius, f64::max).max(f64::MIN_POSITIVE);
    let residual = (0..POINTS).map(|k| {
        let z = c64::from_polar(1.5 * radius, std::f64::consts::TAU * (k as f64 + 0.25) / POINTS as f64);
        let ratio = parts.iter().fold(c64::new(1.0, 0.0) / whole.determinant(z), |ratio, p| ratio * p.determinant(z));
        (ratio - 1.0).norm()
    });
    Ok(residual.fold(0.0, |worst: f64, r| if r.is_nan() { f64::INFINITY } else { worst.max(r) }))
}

/// A balanced matrix with its spectral radius.
struct Pencil {
    a: Mat<f64>,
    radius: f64,
}

impl Pencil {
    fn new(a: MatRef<'_, f64>) -> Result<Self> {
        let a = crate::linalg::balance("the state matrix", a)?.a;
        let radius = crate::linalg::eigenvalues("the state matrix", a.as_ref())?.into_iter().map(|p| p.norm());
        let radius = radius.fold(0.0, f64::max);
        Ok(Pencil { a, radius })
    }

    /// `det(I - A / z)`, which stays within range for any order.
    fn determinant(&self, z: c64) -> c64 {
        let n = self.a.nrows();
        let one = eye(n);
        Mat::from_fn(n, n, |i, j| c64::new(one[(i, j)], 0.0) - self.a[(i, j)] / z).determinant()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lti::{Continuous, Discrete};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn random<T: TimeDomain>(n: usize, m: usize, p: usize, time: T, rng: &mut ChaCha8Rng) -> StateSpace<T> {
        let mut normal = |r, c, s: f64| Mat::from_fn(r, c, |_, _| s * rng.sample::<f64, _>(StandardNormal));
        let a = normal(n, n, 0.9 / (n as f64).sqrt());
        let a = if time.sample_time().is_some() { a } else { a - 1.5 * eye(n) };
        StateSpace::new(a, normal(n, m, 1.0), normal(p, n, 1.0), Mat::zeros(p, m), time).unwrap()
    }

    fn factors<T: TimeDomain>(nominal: &StateSpace<T>) -> CoprimeFactors<T> {
        let (m, p) = (nominal.inputs(), nominal.outputs());
        let weights = crate::control::LqrWeights::on_outputs(nominal, eye(p).as_ref(), eye(m).as_ref()).unwrap();
        let f = crate::control::lqr(nominal, &weights).unwrap().f;
        let noise = crate::control::NoiseCovariance::at_inputs(nominal, eye(m).as_ref(), eye(p).as_ref()).unwrap();
        let l = crate::control::kalman(nominal, &noise).unwrap().l;
        CoprimeFactors::observer(nominal, f.as_ref(), l.as_ref()).unwrap()
    }

    fn check<T: TimeDomain>(time: T, seed: u64) {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        for (n, m, p, ns, nq) in [(1, 1, 1, 1, 1), (4, 2, 2, 6, 3), (6, 1, 3, 10, 0), (3, 2, 1, 0, 4)] {
            let factors = factors(&random(n, m, p, time, rng));
            let (s, q) = (random(ns, m, p, time, rng), random(nq, p, m, time, rng));
            for q in [None, Some(&q)] {
                let found = certify_deviation(&factors, &s, q).unwrap();
                assert!(found.identity_residual < 1e-9, "{n} {m} {p}: {:.1e}", found.identity_residual);
                let k = q.map_or_else(|| factors.controller(), |q| factors.controller_of(q)).unwrap();
                let direct = super::super::certify(&factors.plant_of(&s).unwrap(), &k).unwrap();
                assert_eq!(found.stable, direct.stable, "{n} {m} {p}");
            }
        }
    }

    #[test]
    fn the_identity_holds() {
        for seed in 0..5 {
            check(Discrete::new(1e-3).unwrap(), seed);
            check(Continuous, 100 + seed);
        }
    }

    /// Factors of another controller must not satisfy it.
    #[test]
    fn a_wrong_sign_shows_in_the_identity() {
        let rng = &mut ChaCha8Rng::seed_from_u64(7);
        let time = Discrete::new(1e-3).unwrap();
        let nominal = random(3, 1, 1, time, rng);
        let factors = factors(&nominal);
        let s = random(2, 1, 1, time, rng);
        let (right, left) = (factors.right().system(), factors.left().system());
        let k = factors.controller().unwrap().negated();
        let whole = closed_loop(&factors.plant_of(&s).unwrap(), &with_input_port(&k).unwrap()).unwrap();
        assert!(identity_residual(whole.a(), &[s.a(), right.a(), left.a()]).unwrap() > 1e-3);
    }
}
