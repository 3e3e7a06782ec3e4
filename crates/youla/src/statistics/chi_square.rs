//! Chi-square and F: the exact tail of chi-square, and normal approximations of both.
//!
//! ```text
//! P(X > x) = Q(k / 2, x / 2)                            incomplete gamma function (Abramowitz, Stegun, 6.5.29 and 6.5.31)
//! (X / k)^(1/3)  ~ N(1 - v, v),   v = 2 / (9 k)          E. B. Wilson, M. M. Hilferty, Proc. Nat. Acad. Sci. 17 (1931), 684
//! F^(1/3) (1 - v_2) - (1 - v_1)  ~ N(0, v_2 F^(2/3) + v_1)          E. Paulson, Ann. Math. Stat. 13 (1942), 233
//! ```

use std::f64::consts::PI;

/// Probability that a chi-square variable of `k` degrees of freedom exceeds `x`; 1 for `k = 0` and for x below zero.
pub fn chi_square_tail(x: f64, k: usize) -> f64 {
    if k == 0 || x.is_nan() || x <= 0.0 {
        return 1.0;
    }
    let (a, x) = (0.5 * k as f64, 0.5 * x);
    let front = (a * x.ln() - x - ln_gamma_of_half(k)).exp();
    if x < a + 1.0 { (1.0 - front * series(a, x)).max(0.0) } else { front * fraction(a, x) }
}

/// Distance of a chi-square variable from its mean in standard deviations of a normal variable (Wilson and Hilferty).
pub(crate) fn chi_square_deviations(statistic: f64, degrees: f64) -> f64 {
    let variance = 2.0 / (9.0 * degrees.max(1.0));
    ((statistic / degrees.max(1.0)).max(0.0).cbrt() - (1.0 - variance)) / variance.sqrt()
}

/// The chi-square variable at a distance of so many standard deviations of a normal variable (Wilson and Hilferty).
pub(crate) fn chi_square_limit(degrees: f64, deviations: f64) -> f64 {
    let variance = 2.0 / (9.0 * degrees);
    degrees * (1.0 - variance + deviations * variance.sqrt()).powi(3)
}

/// Distance of a ratio of mean squares from one in standard deviations of a normal variable (Paulson).
pub(crate) fn f_deviations(ratio: f64, degrees: f64, degrees_below: f64) -> f64 {
    let root = ratio.cbrt();
    let (above, below) = (2.0 / (9.0 * degrees), 2.0 / (9.0 * degrees_below));
    ((1.0 - below) * root - (1.0 - above)) / (below * root * root + above).sqrt()
}

/// `sum_n x^n / (a (a + 1) ... (a + n))`.
fn series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
    while term > f64::EPSILON * sum {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    sum
}

/// `1 / (x + 1 - a - 1 (1 - a) / (x + 3 - a - ...))`, from the front (W. J. Lentz, Applied Optics 15 (1976), 668).
fn fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (f64::INFINITY, 1.0 / b);
    let mut value = d;
    for i in 1..10_000 {
        let numerator = -f64::from(i) * (f64::from(i) - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        value *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

/// `ln Gamma(k / 2)` by the recursion from `Gamma(1/2) = sqrt(pi)` and `Gamma(1) = 1`.
fn ln_gamma_of_half(k: usize) -> f64 {
    let first = if k.is_multiple_of(2) { 0.0 } else { 0.5 * PI.ln() };
    (2 - k % 2..k).step_by(2).fold(first, |sum, j| sum + (0.5 * j as f64).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Percentage points of Abramowitz and Stegun, table 26.8, and closed forms: `exp(-x / 2)` for two degrees of freedom,
    /// `exp(-x / 2) (1 + x / 2)` for four.
    #[test]
    fn tables_and_closed_forms() {
        for (x, k, tail) in [
            (3.84146, 1, 0.05),
            (6.63490, 1, 0.01),
            (0.0039321, 1, 0.95),
            (7.81473, 3, 0.05),
            (18.3070, 10, 0.05),
            (29.5883, 10, 0.001),
            (2.15585, 10, 0.995),
            (43.7729, 30, 0.05),
            (124.342, 100, 0.05),
        ] {
            let found = chi_square_tail(x, k);
            assert!((found / tail - 1.0).abs() < 2e-5, "{x} {k}: {found}");
        }
        for x in [0.01, 1.0, 2.9, 3.1, 20.0, 400.0] {
            let half: f64 = 0.5 * x;
            assert!((chi_square_tail(x, 2) / (-half).exp() - 1.0).abs() < 1e-13);
            assert!((chi_square_tail(x, 4) / ((-half).exp() * (1.0 + half)) - 1.0).abs() < 1e-12);
        }
        assert_eq!([chi_square_tail(-1.0, 3), chi_square_tail(0.0, 3), chi_square_tail(5.0, 0)], [1.0; 3]);
        assert_eq!(chi_square_tail(1e5, 3), 0.0);
    }

    /// 95 % points: chi-square with 10 degrees of freedom 18.3070, F(5, 20) 2.71; both are 1.645 deviations of a normal variable.
    #[test]
    fn normal_approximations_meet_the_tables() {
        assert!((chi_square_deviations(18.3070, 10.0) - 1.645).abs() < 5e-3);
        assert!((chi_square_limit(10.0, 1.645) / 18.3070 - 1.0).abs() < 1e-3);
        assert!((f_deviations(2.71, 5.0, 20.0) - 1.645).abs() < 1e-2);
    }
}
