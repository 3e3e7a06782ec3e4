//! Numbers in the JSON of a report: `null` stands for a value that is not finite, both ways.

use serde::{Deserialize, Deserializer};

/// A fit in percent; below -100 %, where the error is more than twice the signal about its mean, its size says nothing more.
///
/// ```
/// use youla_report::numbers::fit;
/// assert_eq!([fit(89.96, 1), fit(-99.96, 1), fit(-2779.0, 1)], ["90.0", "-100.0", "below -100"]);
/// ```
pub fn fit(percent: f64, digits: usize) -> String {
    if percent < -100.0 { "below -100".to_owned() } else { format!("{percent:.digits$}") }
}

/// Distance from 1 below which a magnitude is written by it: five decimals hold less than two of its digits.
const NEAR_ONE: f64 = 1e-4;

/// The magnitude of a pole in z: five decimals, the distance from 1 where they hide it.
///
/// ```
/// use youla_report::numbers::radius;
/// assert_eq!([radius(0.99945), radius(1.0 - 4.1e-6), radius(1.00002), radius(1.0)], ["0.99945", "1 - 4.1e-6", "1 + 2.0e-5", "1"]);
/// ```
pub fn radius(value: f64) -> String {
    match value - 1.0 {
        0.0 => "1".into(),
        over if over.abs() >= NEAR_ONE || over.is_nan() => format!("{value:.5}"),
        over if over < 0.0 => format!("1 - {:.1e}", -over),
        over => format!("1 + {over:.1e}"),
    }
}

/// Most decimals of a bound.
const MOST_DECIMALS: i32 = 12;

/// A value and its bounds with as many decimals as three significant digits of the value and two of the width need.
///
/// ```
/// use youla_report::numbers::with_bounds;
/// assert_eq!(with_bounds(21.843, [17.499, 26.187]), ["21.8", "17.5", "26.2"].map(String::from));
/// assert_eq!(with_bounds(0.99501, [0.995012, 0.995013]), ["0.9950100", "0.9950120", "0.9950130"].map(String::from));
/// ```
pub fn with_bounds(value: f64, [low, high]: [f64; 2]) -> [String; 3] {
    let places = decimals(value, 3).max(decimals(high - low, 2)).clamp(0, MOST_DECIMALS) as usize;
    [value, low, high].map(|v| format!("{v:.places$}"))
}

/// Factors between which a gain may lie: at least two decimals, and two significant digits of the smaller distance from 1.
pub fn factors(low: f64, high: Option<f64>) -> [String; 2] {
    let nearest = high.map_or(1.0 - low, |high| (1.0 - low).min(high - 1.0));
    let places = decimals(nearest, 2).clamp(2, MOST_DECIMALS) as usize;
    [format!("{low:.places$}"), high.map_or("any higher value".into(), |high| format!("{high:.places$}"))]
}

/// Sample time from which delays of a loop are stated in seconds, not milliseconds.
const SLOW: f64 = 0.1;

/// Unit in which delays of a loop are stated, and its number in a second.
pub fn delay_unit(sample_time: Option<f64>) -> (&'static str, f64) {
    if sample_time.is_some_and(|ts| ts >= SLOW) { ("s", 1.0) } else { ("ms", 1e3) }
}

/// A vector as it is.
pub fn many<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}

/// One number.
pub(super) fn one<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Pairs of numbers.
pub(super) fn pairs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let values = Vec::<[Option<f64>; 2]>::deserialize(deserializer)?;
    Ok(values.into_iter().map(known).collect())
}

/// A pair that may be absent.
pub(super) fn optional_pair<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 2]>, D::Error> {
    Ok(Option::<[Option<f64>; 2]>::deserialize(deserializer)?.map(known))
}

fn known(pair: [Option<f64>; 2]) -> [f64; 2] {
    pair.map(|value| value.unwrap_or(f64::NAN))
}

/// Vectors to seven significant digits, more than any figure shows.
pub(super) mod seven_digits {
    pub(in super::super) use super::many as deserialize;
    use super::rounded;
    use serde::Serializer;

    pub(in super::super) fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(values.iter().map(|&value| rounded(value, decimals(value))))
    }

    fn decimals(value: f64) -> i32 {
        super::decimals(value, 7)
    }
}

/// Decimal places that keep `digits` significant digits of `value`; 0 for zero and for values that are not finite.
pub fn decimals(value: f64, digits: i32) -> i32 {
    if value == 0.0 || !value.is_finite() { 0 } else { digits - 1 - value.abs().log10().floor() as i32 }
}

/// `value` to a number of decimal places, which is negative for tens, hundreds and so on.
///
/// Powers of ten are exact up to 10^22, so that the quotient is the number nearest to the short decimal; values that would
/// need a larger one stay as they are.
pub fn rounded(value: f64, decimals: i32) -> f64 {
    if decimals.abs() > 22 {
        return value;
    }
    let power = 10f64.powi(decimals.abs());
    if decimals >= 0 { (value * power).round() / power } else { (value / power).round() * power }
}

/// Rounded to `digits` significant digits of themselves or of their range, whichever is finer.
pub fn for_drawing(values: impl Iterator<Item = f64> + Clone, digits: i32) -> Vec<f64> {
    let finite = values.clone().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    let of_range = if high > low { decimals(high - low, digits) } else { i32::MIN };
    values.map(|value| rounded(value, decimals(value, digits).max(of_range))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_the_digits_asked_for() {
        for (value, digits, expected) in
            [(123456.789, 4, 123500.0), (-0.00123456, 3, -0.00123), (9.9996, 4, 10.0), (2.5e-300, 5, 2.5e-300)]
        {
            assert_eq!(rounded(value, decimals(value, digits)), expected);
        }
    }
}
