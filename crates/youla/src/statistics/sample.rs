//! Quantiles of a sample, and its deviation where a few values are far too large.

/// Median of the magnitude of a standard normal variable, `Phi^-1(3/4)`.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// Of sorted values at a share from 0 to 1, linear between neighbours (definition 7 of Hyndman and Fan 1996); NaN for no
/// values. Infinite values are allowed.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let (below, part) = (place.floor() as usize, place.fract());
    let low = sorted[below];
    // Infinity times zero is not a number.
    if part == 0.0 || low.is_infinite() { low } else { low + part * (sorted[below + 1] - low) }
}

/// The value in the middle, of an even number of values the mean of both; NaN for no values.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    let (count, middle) = (values.len(), values.len() / 2);
    if count < 3 {
        values.sort_unstable_by(f64::total_cmp);
        return quantile(&values, 0.5);
    }
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).filter(|_| count % 2 == 0);
    quantile(&[lower.unwrap_or(*upper), *upper], 0.5)
}

/// Standard deviation of normal values about zero from the median of their magnitudes, which a few wrong values do not move.
pub fn robust_deviation(values: impl IntoIterator<Item = f64>) -> f64 {
    median(values.into_iter().map(f64::abs)) / NORMAL_MEDIAN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_linear_between_values() {
        assert_eq!([0.25, 0.5, 0.75].map(|p| quantile(&[1.0, 2.0, 4.0, 8.0], p)), [1.75, 3.0, 5.0]);
        assert_eq!(quantile(&[3.0], 0.75), 3.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn a_wrong_value_does_not_move_the_deviation() {
        assert_eq!(median([9.0, 1.0, 2.0, 4.0]), 3.0);
        let deviation = robust_deviation([-1.0, 1e9, 0.5, -NORMAL_MEDIAN, 0.1]);
        assert!((deviation - 1.0).abs() < 1e-15, "{deviation}");
    }
}
