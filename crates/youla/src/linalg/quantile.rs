//! Quantiles of a sample.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_linear_between_values() {
        assert_eq!([0.25, 0.5, 0.75].map(|p| quantile(&[1.0, 2.0, 4.0, 8.0], p)), [1.75, 3.0, 5.0]);
        assert_eq!(quantile(&[3.0], 0.75), 3.0);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
