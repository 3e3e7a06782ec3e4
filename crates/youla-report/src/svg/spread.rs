//! What a box shows of a sample.

use youla::statistics::quantile;

/// Median, quartiles, whiskers and what lies beyond them.
///
/// A whisker reaches to the last value within 1.5 quartile ranges of its quartile. NaN is counted and takes no part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spread {
    pub(super) median: f64,
    pub(super) quartiles: [f64; 2],
    pub(super) whiskers: [f64; 2],
    pub(super) beyond: Vec<f64>,
}

impl Spread {
    /// Of the values that are not NaN; nothing where there are none.
    pub(super) fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
        sorted.sort_by(f64::total_cmp);
        if sorted.is_empty() {
            return None;
        }
        let [low, median, high] = [0.25, 0.5, 0.75].map(|share| quantile(&sorted, share));
        let reach = 1.5 * (high - low);
        let within = |value: &f64| *value >= low - reach && *value <= high + reach;
        let (inside, beyond): (Vec<f64>, Vec<f64>) = sorted.iter().copied().partition(within);
        let first = inside.first().map_or(low, |value| value.min(low));
        let last = inside.last().map_or(high, |value| value.max(high));
        Some(Spread { median, quartiles: [low, high], whiskers: [first, last], beyond })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_sample_by_hand() {
        // Sorted: 1 2 3 4 5 6 13 16; places 1.75, 3.5 and 5.25 counted from 0.
        let spread = Spread::of(&[13.0, 1.0, f64::NAN, 16.0, 3.0, 4.0, 2.0, 6.0, 5.0]).unwrap();
        assert_eq!(spread.median, 4.5);
        assert_eq!(spread.quartiles, [2.75, 7.75]);
        // Fences at 2.75 - 7.5 and 7.75 + 7.5.
        assert_eq!(spread.whiskers, [1.0, 13.0]);
        assert_eq!(spread.beyond, [16.0]);
    }

    #[test]
    fn small_and_infinite_samples() {
        assert_eq!(Spread::of(&[f64::NAN]), None);
        let one = Spread::of(&[2.0]).unwrap();
        assert_eq!((one.median, one.quartiles, one.whiskers), (2.0, [2.0; 2], [2.0; 2]));
        let low = Spread::of(&[f64::NEG_INFINITY, 1.0, 2.0, 3.0, 4.0]).unwrap();
        assert_eq!((low.quartiles, low.whiskers, low.beyond.len()), ([1.0, 3.0], [1.0, 4.0], 1));
        let diverged = Spread::of(&[f64::NEG_INFINITY; 3]).unwrap();
        assert_eq!(diverged.median, f64::NEG_INFINITY);
        assert!(!diverged.whiskers[0].is_nan());
    }
}
