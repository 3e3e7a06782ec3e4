//! Fits of predictions some steps ahead, beside that of the simulation.
//!
//! A prediction adds to the simulation what is foreseen of its residual v = y - G u. A model that says what its noise is,
//! `y = G u + H e` with white innovations e, foresees it by itself:
//!
//! ```text
//! H = (A, K, C, F):    x+ = A x + K e,   e = F^-1 (v - C x),      v(t + k - 1) from the past of t:  C A^(k-1) x(t)
//! ```
//!
//! For a model with a Kalman gain K, `H = I + C (z I - A)^-1 K`, this is its predictor. For others an autoregression of the residual, found from the
//! first half of the record, foresees it. The fit (26) counts over the second half.
//!
//! Source: L. Ljung, System Identification, 2nd ed. (1999), sections 3.2 and 16.6.

use crate::linalg::{block, check_shape};
use crate::lti::{Discrete, StateSpace, simulate};
use crate::{Mat, MatRef, Result};

/// Steps ahead for which fits are given.
pub const PREDICTION_STEPS: [usize; 3] = [1, 5, 20];
/// Order of the autoregression of the residual.
const ORDER: usize = 20;

/// Fits (26) in percent of predictions [`PREDICTION_STEPS`] ahead and of the simulation alone, over the second half: per number
/// of steps and output, the simulation last; NaN for records of fewer than 160 samples.
///
/// # Errors
/// [`crate::Error::Shape`] where the two differ in shape.
///
/// ```
/// use youla::{Mat, validate::k_step_fits};
/// let y = Mat::from_fn(2000, 1, |k, _| (0.01 * k as f64).sin());
/// let fits = k_step_fits(y.as_ref(), Mat::zeros(2000, 1).as_ref())?;
/// assert!(fits[0][0] > 90.0 && fits[3][0] < 1.0); // a sine is foreseen, its simulation by zero is not
/// # Ok::<(), youla::Error>(())
/// ```
pub fn k_step_fits(measured: MatRef<'_, f64>, simulated: MatRef<'_, f64>) -> Result<Vec<Vec<f64>>> {
    check_shape("the simulated record", simulated, (measured.nrows(), measured.ncols()))?;
    let v = (measured - simulated).to_owned();
    if too_short(v.nrows()) {
        return Ok(no_fits(v.ncols()));
    }
    let weights: Vec<Vec<Vec<f64>>> = (0..v.ncols())
        .map(|j| {
            let first: Vec<f64> = v.col(j).iter().take(v.nrows() / 2).copied().collect();
            let a = autoregression(&first);
            PREDICTION_STEPS.map(|steps| ahead(&a, steps)).to_vec()
        })
        .collect();
    Ok(fits(measured, v.as_ref(), |place, k, j| {
        let past = weights[j][place].iter().enumerate();
        past.map(|(i, w)| w * v[(k - PREDICTION_STEPS[place] - i, j)]).sum()
    }))
}

/// The same with what the model itself says of its noise, `y = simulated + H e` with H from white innovations e (p x p).
///
/// # Errors
/// [`crate::Error::Shape`] where the shapes differ, [`crate::Error::Singular`] for a feedthrough of H that cannot be inverted,
/// [`crate::Error::Unstable`] where the inverse of H is not stable.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}, validate::k_step_fits_by_noise};
/// // v(k) = 0.9 v(k-1) + e(k), that is K = C A = 0.9.
/// let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
/// let h = StateSpace::new(number(0.9), number(0.9), eye(1), eye(1), Discrete::new(1.0)?)?;
/// let mut v = 1.0;
/// let y = Mat::from_fn(2000, 1, |k, _| {
///     v = 0.9 * v + (0.3 * (k * k) as f64).sin();
///     v
/// });
/// let fits = k_step_fits_by_noise(y.as_ref(), Mat::zeros(2000, 1).as_ref(), &h)?;
/// assert!(fits[0][0] > fits[1][0] && fits[1][0] > fits[3][0]);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn k_step_fits_by_noise(
    measured: MatRef<'_, f64>,
    simulated: MatRef<'_, f64>,
    noise: &StateSpace<Discrete>,
) -> Result<Vec<Vec<f64>>> {
    check_shape("the simulated record", simulated, (measured.nrows(), measured.ncols()))?;
    let v = (measured - simulated).to_owned();
    let p = noise.outputs();
    let foreseen = simulate(&predictor(noise)?, v.as_ref(), &vec![0.0; noise.order()])?;
    Ok(fits(measured, v.as_ref(), |place, k, j| foreseen[(k + 1 - PREDICTION_STEPS[place], place * p + j)]))
}

/// From v to what is foreseen of it: with `H = (A, K, C, F)`, `x+ = (A - K F^-1 C) x + K F^-1 v`, the outputs at time k are
/// `C A^(steps-1) x(k)`, predictions of `v(k + steps - 1)` from the past of k, for all [`PREDICTION_STEPS`].
fn predictor(noise: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let whitening = noise.inverse()?;
    whitening.require_stable("the predictor of a model with its own noise")?;
    let mut rows: Vec<Mat<f64>> = Vec::new();
    let (mut row, mut ahead) = (noise.c().to_owned(), 1);
    for steps in PREDICTION_STEPS {
        (ahead..steps).for_each(|_| row = &row * noise.a());
        ahead = steps;
        rows.push(row.clone());
    }
    let rows: Vec<[MatRef<'_, f64>; 1]> = rows.iter().map(|row| [row.as_ref()]).collect();
    let c = block(&rows.iter().map(|row| row.as_slice()).collect::<Vec<_>>());
    let d = Mat::zeros(c.nrows(), noise.inputs());
    StateSpace::new(whitening.a().to_owned(), whitening.b().to_owned(), c, d, noise.time())
}

/// Whether half of a record is too short for the autoregression: less than four samples per coefficient.
fn too_short(samples: usize) -> bool {
    samples / 2 < 4 * ORDER
}

fn no_fits(outputs: usize) -> Vec<Vec<f64>> {
    vec![vec![f64::NAN; outputs]; PREDICTION_STEPS.len() + 1]
}

/// The fits from the residual v of the simulation and what is foreseen of it, by place in [`PREDICTION_STEPS`], sample and
/// output.
fn fits(measured: MatRef<'_, f64>, v: MatRef<'_, f64>, foreseen: impl Fn(usize, usize, usize) -> f64) -> Vec<Vec<f64>> {
    let n = v.nrows();
    let half = n / 2;
    let mut all = no_fits(v.ncols());
    if too_short(n) {
        return all;
    }
    for j in 0..v.ncols() {
        let mean = (half..n).map(|k| measured[(k, j)]).sum::<f64>() / (n - half) as f64;
        let spread: f64 = (half..n).map(|k| (measured[(k, j)] - mean).powi(2)).sum();
        let fit = |foreseen: &dyn Fn(usize) -> f64| {
            let left: f64 = (half..n).map(|k| (v[(k, j)] - foreseen(k)).powi(2)).sum();
            100.0 * (1.0 - (left / spread).sqrt())
        };
        for (place, all) in all.iter_mut().enumerate() {
            all[j] = if place < PREDICTION_STEPS.len() { fit(&|k| foreseen(place, k, j)) } else { fit(&|_| 0.0) };
        }
    }
    all
}

/// Coefficients of `v(k) = sum a(i) v(k-1-i)` by the recursion of Levinson and Durbin.
fn autoregression(v: &[f64]) -> Vec<f64> {
    let r: Vec<f64> = (0..=ORDER).map(|lag| v[lag..].iter().zip(v).map(|(x, y)| x * y).sum()).collect();
    let (mut a, mut error) = (Vec::new(), r[0]);
    for order in 0..ORDER {
        if error <= 1e-12 * r[0] {
            break;
        }
        let known: f64 = a.iter().enumerate().map(|(i, a): (usize, &f64)| a * r[order - i]).sum();
        let reflection = (r[order + 1] - known) / error;
        let before = a.clone();
        a.iter_mut().enumerate().for_each(|(i, a)| *a -= reflection * before[order - 1 - i]);
        a.push(reflection);
        error *= 1.0 - reflection * reflection;
    }
    a
}

/// Weights of `v(k-steps), v(k-steps-1), ...` in the prediction of v(k).
fn ahead(a: &[f64], steps: usize) -> Vec<f64> {
    let mut weights = a.to_vec();
    for _ in 1..steps {
        let first = weights.first().copied().unwrap_or(0.0);
        let next = |i: usize| weights.get(i + 1).copied().unwrap_or(0.0);
        weights = a.iter().enumerate().map(|(i, a)| first * a + next(i)).collect();
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eye;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// `v(k) = 0.9 v(k-1) + n(k)`: k steps ahead `1 - sqrt(1 - 0.81^k)` of it is foreseen.
    #[test]
    fn an_autoregression_is_foreseen() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut v = 0.0;
        let y = Mat::from_fn(100_000, 1, |_, _| {
            v = 0.9 * v + rng.sample::<f64, _>(StandardNormal);
            v
        });
        let fits = k_step_fits(y.as_ref(), Mat::zeros(100_000, 1).as_ref()).unwrap();
        for (fit, steps) in fits.iter().zip(PREDICTION_STEPS) {
            let expected = 100.0 * (1.0 - (1.0 - 0.81f64.powi(steps as i32)).sqrt());
            assert!((fit[0] - expected).abs() < 1.0, "{steps}: {} and {expected}", fit[0]);
        }
    }

    /// `v(k) - 0.9 v(k-1) = e(k) - 0.6 e(k-1)`: of the variance of v, k steps ahead `sum_{i<k} h(i)^2` remains, h(0) = 1 and
    /// `h(i) = 0.3 0.9^(i-1)`. The same noise in non-minimal states and behind a feedthrough F = 2 foresees the same.
    #[test]
    fn a_model_foresees_its_own_noise() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let (mut x, time) = (0.0, Discrete::new(1.0).unwrap());
        let y = Mat::from_fn(100_000, 1, |_, _| {
            let e: f64 = rng.sample(StandardNormal);
            let v = x + e;
            x = 0.9 * x + 0.3 * e;
            v
        });
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        let h = StateSpace::new(number(0.9), number(0.3), eye(1), eye(1), time).unwrap();
        let larger = h.then(&h).unwrap().then(&h.inverse().unwrap()).unwrap().map_output(&number(2.0));
        let none = Mat::zeros(100_000, 1);
        let fits = k_step_fits_by_noise(y.as_ref(), none.as_ref(), &h).unwrap();
        let same = k_step_fits_by_noise(y.as_ref(), none.as_ref(), &larger).unwrap();
        let remains = |steps: usize| 1.0 + (1..steps).map(|i| (0.3 * 0.9f64.powi(i as i32 - 1)).powi(2)).sum::<f64>();
        let all = 1.0 + 0.09 / 0.19;
        for ((fit, same), steps) in fits.iter().zip(&same).zip(PREDICTION_STEPS) {
            let expected = 100.0 * (1.0 - (remains(steps) / all).sqrt());
            assert!((fit[0] - expected).abs() < 0.6, "{steps}: {} and {expected}", fit[0]);
            assert!((fit[0] - same[0]).abs() < 1e-9, "{steps}: {} and {}", fit[0], same[0]);
        }
    }

    /// Half of the record does not reach the lags of the autoregression below 42 samples.
    #[test]
    fn short_records_have_no_fits() {
        for samples in [0, 1, 2, 29, 30, 41, 42, 159] {
            let y = Mat::from_fn(samples, 2, |k, j| (k as f64 + j as f64).sin());
            let fits = k_step_fits(y.as_ref(), Mat::zeros(samples, 2).as_ref()).unwrap();
            assert!(fits.len() == 4 && fits.iter().flatten().all(|f| f.is_nan()), "{samples}");
        }
        let y = Mat::from_fn(160, 1, |k, _| (0.3 * k as f64).sin());
        assert!(k_step_fits(y.as_ref(), Mat::zeros(160, 1).as_ref()).unwrap()[0][0].is_finite());
    }

    #[test]
    fn noise_without_a_stable_inverse_is_refused() {
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        let h = StateSpace::new(number(0.5), number(2.0), eye(1), eye(1), Discrete::new(1.0).unwrap()).unwrap();
        let y = Mat::from_fn(400, 1, |k, _| (k as f64).sin());
        let refused = k_step_fits_by_noise(y.as_ref(), y.as_ref(), &h);
        assert!(matches!(refused, Err(crate::Error::Unstable { .. })), "{refused:?}");
    }
}
