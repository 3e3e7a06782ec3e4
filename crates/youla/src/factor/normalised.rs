//! Normalised right coprime factors, `M~ M + N~ N = I`, of any stabilisable and detectable plant.
//!
//! ```text
//! continuous   W = I + D'D              [M; N] = [A+BF | B H; F | H; C+DF | D H]
//! discrete     W = I + D'D + B'XB       H' W H = I, H upper triangular
//! ```
//!
//! X and F are those of the regulator that minimises `y'y + u'u`: M. Vidyasagar, Normalised coprime factorizations for
//! nonstrictly proper systems, IEEE Trans. Autom. Control 33 (1988), 300; D. G. Meyer, Fractional balanced reduction, 35
//! (1990), 1341.

use crate::linalg::{RiccatiProblem, block, care, dare, eye, solve};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::{Scale, Side};

/// Normalised right coprime factors of a plant of n states, m inputs and p outputs.
#[derive(Debug, Clone)]
pub struct NormalisedFactors<T: TimeDomain> {
    /// `[M; N]`, (m + p) x m, n states, stable, with `G = N M^-1`.
    pub factors: StateSpace<T>,
    /// Relative residual of the Riccati equation.
    pub relative_residual: f64,
}

/// Normalised right coprime factors `[M; N]`.
///
/// `M~ M + N~ N = I` holds to 1e-10 on random plants, unstable and integrating ones too (`tests::factors_are_normalised`).
///
/// # Errors
/// [`Error::NotStabilisable`] and [`Error::NotDetectable`] with the mode, [`Error::NoSolution`] of the Riccati equation.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace, frequency_response}};
/// use youla::factor::normalised_right_coprime;
/// let integrator = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// let factors = normalised_right_coprime(&integrator)?.factors;
/// // M = s / (s + 1), N = 1 / (s + 1).
/// let at_one = frequency_response(&factors, &[1.0])?;
/// assert!((at_one.at(0).norm_l2() - 1.0).abs() < 1e-14);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn normalised_right_coprime<T: TimeDomain>(plant: &StateSpace<T>) -> Result<NormalisedFactors<T>> {
    const WHAT: &str = "the normalised coprime factorisation";
    let (a, b, c, d) = (plant.a(), plant.b(), plant.c(), plant.d());
    let (q, r, s) = (c.transpose() * c, eye(plant.inputs()) + d.transpose() * d, c.transpose() * d);
    let problem = RiccatiProblem { a, b, q: q.as_ref(), r: r.as_ref(), s: Some(s.as_ref()) };
    let discrete = plant.time().sample_time().is_some();
    let solution = if discrete { dare(WHAT, &problem)? } else { care(WHAT, &problem)? };
    let f = Scale(-1.0) * &solution.gain;
    let w = if discrete { &r + b.transpose() * &solution.x * b } else { r };
    let singular = |_| Error::Singular { what: format!("the input weight of {WHAT}"), rcond: 0.0 };
    let lower = w.llt(Side::Lower).map_err(singular)?;
    let h = solve("the input weight of a coprime factorisation", lower.L().transpose(), eye(w.nrows()).as_ref())?;
    let (a_f, c_f, d_h) = (a + b * &f, c + d * &f, d * &h);
    let c = block(&[&[f.as_ref()], &[c_f.as_ref()]]);
    let d = block(&[&[h.as_ref()], &[d_h.as_ref()]]);
    let factors = StateSpace::new(a_f, b * &h, c, d, plant.time())?;
    Ok(NormalisedFactors { factors, relative_residual: solution.relative_residual })
}

#[cfg(test)]
mod tests {
    use super::super::stable::tests::random_plant;
    use super::*;
    use crate::lti::{Continuous, Discrete, frequency_response};
    use faer::{Mat, c64};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn check<T: TimeDomain>(plant: &StateSpace<T>, omega: &[f64]) {
        let factors = normalised_right_coprime(plant).unwrap().factors;
        assert!(factors.is_stable().unwrap());
        let m = plant.inputs();
        let response = frequency_response(&factors, omega).unwrap();
        for value in response.iter() {
            let miss = (value.adjoint() * value - Mat::<c64>::identity(m, m)).norm_l2();
            assert!(miss < 1e-10, "{miss}");
        }
        let again = factors.divide_by_first_outputs(m).unwrap();
        let (g, r) = (frequency_response(plant, omega).unwrap(), frequency_response(&again, omega).unwrap());
        for (g, r) in g.iter().zip(r.iter()) {
            assert!((g - r).norm_l2() < 1e-9 * g.norm_l2(), "{} {}", (g - r).norm_l2(), g.norm_l2());
        }
    }

    #[test]
    fn factors_are_normalised() {
        let rng = &mut ChaCha8Rng::seed_from_u64(71);
        let omega: Vec<f64> = (0..40).map(|k| 10f64.powf(0.1 * f64::from(k) - 2.0)).collect();
        let linear: Vec<f64> = (1..40).map(|k| std::f64::consts::PI * f64::from(k) / 40.0).collect();
        for n in [1, 2, 5, 8] {
            check(&random_plant(n, Continuous, rng), &omega);
            check(&random_plant(n, Discrete::new(1.0).unwrap(), rng), &linear);
        }
        let gain: StateSpace<Continuous> = StateSpace::gain(Mat::full(2, 1, 3.0), Continuous).unwrap();
        check(&gain, &omega);
        let integrator = |time| StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), time).unwrap();
        check(&integrator(Discrete::new(1.0).unwrap()), &linear);
    }
}
