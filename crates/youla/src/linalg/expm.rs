//! Matrix exponential by Padé approximation with scaling and squaring: N. J. Higham, The scaling and squaring method for
//! the matrix exponential revisited, SIAM J. Matrix Anal. Appl. 26 (2005), 1179; without overscaling after A. H. Al-Mohy
//! and N. J. Higham, A new scaling and squaring algorithm, SIAM J. Matrix Anal. Appl. 31 (2009), 970, algorithm 6.1.
//!
//! `exp(A) = r_m(A / 2^s)^(2^s)` with `r_m = q_m^-1 p_m`. Degree m and s follow from `||A^k||^(1/k)`, which for matrices
//! far from normal is much smaller than `||A||`.

use crate::linalg::{check_finite, check_shape, eye};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, MatRef};

/// Degrees of the approximant and the largest `||A^k||^(1/k)` for which each has a backward error below the rounding unit
/// (Higham 2005, table 2.3).
const DEGREES: [(usize, f64); 5] = [
    (3, 1.495585217958292e-2),
    (5, 2.53939833006323e-1),
    (7, 9.504178996162932e-1),
    (9, 2.097847961257068),
    (13, 4.25), // 5.37 in 2005; reduced in 2009 for the sake of rounding in q_13
];

/// 1-norm up to which the eighth power cannot overflow.
const LARGEST_NORM: f64 = 1e30;

/// The exponential of a square matrix.
///
/// Backward stable up to the squarings: relative error near machine precision times the condition number of the
/// exponential (held by `inverse_is_the_exponential_of_the_negative` and `rotation_and_decay_have_closed_forms`). Balance
/// badly scaled matrices first ([`crate::linalg::balance`]).
///
/// # Errors
/// [`Error::Shape`] unless square; [`Error::NotFinite`] for a bad entry, also where the exponential overflows;
/// [`Error::OutOfRange`] where the 1-norm exceeds 1e30, so that powers could overflow. All name `what`.
///
/// ```
/// use youla::{Mat, linalg::expm};
/// let rotation = Mat::from_fn(2, 2, |i, j| [[0.0, -1.0], [1.0, 0.0]][i][j]);
/// assert!((expm("A", rotation.as_ref())?[(0, 0)] - 1f64.cos()).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn expm(what: &str, a: MatRef<'_, f64>) -> Result<Mat<f64>> {
    check_shape(what, a, (a.nrows(), a.nrows()))?;
    check_finite(what, a)?;
    let norm = one_norm(a);
    if norm > LARGEST_NORM {
        return Err(Error::OutOfRange { what: format!("the norm of {what}"), value: norm, must: "at most 1e30" });
    }
    let powers = EvenPowers::new(a);
    let (degree, squarings) = choose(a, &powers);
    let shrink = (-f64::from(squarings)).exp2();
    let mut e = pade(degree, Scale(shrink) * a, powers.scaled(shrink));
    for _ in 0..squarings {
        e = &e * &e;
    }
    check_finite(&format!("the exponential of {what}"), e.as_ref())?;
    Ok(e)
}

/// `A^2, A^4, A^6, A^8`.
struct EvenPowers([Mat<f64>; 4]);

impl EvenPowers {
    fn new(a: MatRef<'_, f64>) -> Self {
        let a2 = a * a;
        let a4 = &a2 * &a2;
        let (a6, a8) = (&a2 * &a4, &a4 * &a4);
        EvenPowers([a2, a4, a6, a8])
    }

    /// The powers of `shrink A`.
    fn scaled(self, shrink: f64) -> Self {
        let mut exponent = 0;
        EvenPowers(self.0.map(|power| {
            exponent += 2;
            Scale(shrink.powi(exponent)) * power
        }))
    }

    /// `||A^(2 k)||^(1 / (2 k))` in the 1-norm, k = 2, 3, 4; for k = 5 bounded by the product of `A^4` and `A^6`.
    fn root(&self, k: usize) -> f64 {
        let norm = |j: usize| one_norm(self.0[j - 1].as_ref());
        let norm = if k == 5 { norm(2) * norm(3) } else { norm(k) };
        norm.powf(0.5 / k as f64)
    }
}

/// Degree m and number of squarings s.
fn choose(a: MatRef<'_, f64>, powers: &EvenPowers) -> (usize, u16) {
    let [d4, d6, d8, d10] = [2, 3, 4, 5].map(|k| powers.root(k));
    let sizes = [d4.max(d6), d4.max(d6), d6.max(d8), d6.max(d8)];
    for ((degree, theta), size) in DEGREES.into_iter().zip(sizes) {
        if size <= theta && extra_squarings(a, 1.0, degree) == 0 {
            return (degree, 0);
        }
    }
    let (degree, theta) = DEGREES[4];
    let size = d6.max(d8).min(d8.max(d10));
    let squarings = if size > theta { (size / theta).log2().ceil() as u16 } else { 0 };
    (degree, squarings + extra_squarings(a, (-f64::from(squarings)).exp2(), degree))
}

/// Squarings that the rounding of `shrink A` asks for: from `|| |A|^(2m+1) || / ||A||` and the first coefficient of the
/// backward error series (Al-Mohy and Higham 2009, eq. (5.1)).
fn extra_squarings(a: MatRef<'_, f64>, shrink: f64, degree: usize) -> u16 {
    let norm = shrink * one_norm(a);
    if norm == 0.0 {
        return 0;
    }
    let n = a.nrows();
    let mut row = vec![1.0 / norm; n];
    for _ in 0..2 * degree + 1 {
        row = (0..n).map(|j| (0..n).map(|i| row[i] * shrink * a[(i, j)].abs()).sum()).collect();
    }
    let power = row.into_iter().fold(0.0, f64::max);
    // 1 / c = (2m)! (2m+1)! / (m!)^2
    let reciprocal: f64 =
        (1..=degree).map(|k| (k + degree) as f64 / k as f64).product::<f64>() * factorial(2 * degree + 1);
    let excess = (power / reciprocal / (0.5 * f64::EPSILON)).log2() / (2 * degree) as f64;
    excess.ceil().clamp(0.0, 1000.0) as u16
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

/// The approximant `q_m^-1 p_m`, `p_m = V + U`, `q_m = V - U`, U odd and V even in A.
fn pade(degree: usize, a: Mat<f64>, EvenPowers([a2, a4, a6, a8]): EvenPowers) -> Mat<f64> {
    let n = a.nrows();
    let b = coefficients(degree);
    // The four even powers with the coefficients k, k + 2, k + 4, ...
    let even = |k: usize| {
        let mut sum = Scale(b[k]) * eye(n);
        for (power, coefficient) in [&a2, &a4, &a6, &a8].into_iter().zip(b[k..].iter().step_by(2).skip(1)) {
            sum += Scale(*coefficient) * power;
        }
        sum
    };
    let (odd, v) = if degree == 13 {
        let high = |k: usize| &a6 * (Scale(b[k + 2]) * &a2 + Scale(b[k + 4]) * &a4 + Scale(b[k + 6]) * &a6);
        let low =
            |k: usize| Scale(b[k - 6]) * eye(n) + Scale(b[k - 4]) * &a2 + Scale(b[k - 2]) * &a4 + Scale(b[k]) * &a6;
        (high(7) + low(7), high(6) + low(6))
    } else {
        (even(1), even(0))
    };
    let u = a * odd;
    (&v - &u).partial_piv_lu().solve(&v + &u)
}

/// Coefficients of `p_m`, from `b_0 = 1` on: `b_j = (2m - j)! m! / ((2m)! (m - j)! j!)`.
fn coefficients(degree: usize) -> Vec<f64> {
    let mut b = vec![1.0; degree + 1];
    for j in 0..degree {
        b[j + 1] = b[j] * (degree - j) as f64 / ((2 * degree - j) * (j + 1)) as f64;
    }
    b
}

/// Largest column sum of absolute values.
fn one_norm(a: MatRef<'_, f64>) -> f64 {
    a.col_iter().map(|c| c.norm_l1()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn random(n: usize, size: f64, seed: u64) -> Mat<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Mat::from_fn(n, n, |_, _| size * Distribution::<f64>::sample(&StandardNormal, &mut rng))
    }

    #[test]
    fn inverse_is_the_exponential_of_the_negative() {
        for (k, size) in [1e-9, 1e-3, 0.02, 0.1, 0.3, 0.7, 2.0].into_iter().enumerate() {
            for n in [1, 2, 5, 9] {
                let a = random(n, size, (10 * n + k) as u64);
                let (plus, minus) = (expm("A", a.as_ref()).unwrap(), expm("-A", (-&a).as_ref()).unwrap());
                let error = (&plus * &minus - eye(n)).norm_l2() / (plus.norm_l2() * minus.norm_l2());
                assert!(error < 1e-13, "n = {n}, size = {size}: {error}");
            }
        }
    }

    #[test]
    fn rotation_and_decay_have_closed_forms() {
        for (sigma, omega) in [(0.0, 1e-4), (-0.3, 0.7), (-2.0, 40.0), (-700.0, 1.0), (3.0, 300.0)] {
            let a = Mat::from_fn(2, 2, |i, j| [[sigma, -omega], [omega, sigma]][i][j]);
            let e = expm("A", a.as_ref()).unwrap();
            let growth = f64::exp(sigma);
            let error = (e[(0, 0)] - growth * omega.cos()).hypot(e[(1, 0)] - growth * omega.sin()) / growth;
            assert!(error < 1e-15 * (10.0 + 2.0 * sigma.hypot(omega)), "{sigma} {omega}: {error}");
        }
    }

    #[test]
    fn matrix_far_from_normal_is_not_overscaled() {
        let a = Mat::from_fn(2, 2, |i, j| [[1.0, 1e6], [0.0, -1.0]][i][j]);
        let e = expm("A", a.as_ref()).unwrap();
        assert!((e[(0, 1)] / (1e6 * 1f64.sinh()) - 1.0).abs() < 1e-14, "{}", e[(0, 1)]);
        assert!((e[(0, 0)] / 1f64.exp() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn overflow_is_an_error() {
        let a = Mat::from_fn(1, 1, |_, _| 1e4);
        assert!(matches!(expm("A", a.as_ref()), Err(Error::NotFinite { .. })));
        let a = Mat::from_fn(1, 1, |_, _| -1e200);
        assert!(matches!(expm("A", a.as_ref()), Err(Error::OutOfRange { .. })));
        assert_eq!(expm("A", Mat::zeros(0, 0).as_ref()).unwrap().nrows(), 0);
    }
}
