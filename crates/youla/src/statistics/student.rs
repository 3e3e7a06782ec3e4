//! Quantiles of the normal distribution, and of those of Student and Hotelling for variances that are themselves estimates.

/// Quantile of Student's distribution with `nu` degrees of freedom for a two-sided interval of the given level: the series
/// of Cornish and Fisher (Abramowitz, Stegun, 26.7.5), to four digits from 6 degrees of freedom on.
pub fn two_sided_student(level: f64, nu: f64) -> f64 {
    student(0.5 * (1.0 + level), nu)
}

/// One-sided quantile.
pub fn student(probability: f64, nu: f64) -> f64 {
    let x = normal_quantile(probability);
    let polynomial = |c: &[f64]| c.iter().fold(0.0, |sum, c| sum * x * x + c) * x;
    let terms = [
        polynomial(&[1.0, 1.0]) / 4.0,
        polynomial(&[5.0, 16.0, 3.0]) / 96.0,
        polynomial(&[3.0, 19.0, 17.0, -15.0]) / 384.0,
        polynomial(&[79.0, 776.0, 1482.0, -1920.0, -945.0]) / 92160.0,
    ];
    terms.iter().rev().fold(0.0, |sum, term| (sum + term) / nu) + x
}

/// `d' V^-1 d` below this holds with the given probability for a normal d of two components whose covariance V is estimated
/// with `nu` degrees of freedom (Hotelling): `2 nu / (nu - 1) F(2, nu - 1)`, which has a closed form.
pub fn ellipse(level: f64, nu: f64) -> f64 {
    nu * ((1.0 - level).powf(-2.0 / (nu - 1.0)) - 1.0)
}

/// Quantile of the normal distribution, by bisection of its distribution function.
pub fn normal_quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if distribution(middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// `Phi(x)` by the series `1/2 + phi(x) (x + x^3/3 + x^5/15 + ...)`.
fn distribution(x: f64) -> f64 {
    let (mut term, mut sum, mut k) = (x, x, 1.0);
    while f64::abs(term) > 1e-18 && k < 400.0 {
        k += 2.0;
        term *= x * x / k;
        sum += term;
    }
    0.5 + sum * (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz, Stegun, table 26.10; F(2, 20) at 95 % is 3.493 (table 26.9).
    #[test]
    fn tables() {
        let found =
            [normal_quantile(0.975), two_sided_student(0.95, 10.0), two_sided_student(0.95, 40.0), student(0.95, 20.0)];
        for (found, table) in found.into_iter().zip([1.959964, 2.228, 2.021, 1.725]) {
            assert!((found - table).abs() < 6e-4, "{found} {table}");
        }
        assert!((ellipse(0.95, 21.0) / (2.0 * 21.0 / 20.0 * 3.493) - 1.0).abs() < 2e-4);
    }
}
