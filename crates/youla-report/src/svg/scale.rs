//! From values to places along an axis.

use crate::figure::Axis;
use crate::{Error, Result};

/// Beyond this no difference of two numbers overflows.
const LARGEST: f64 = 1e300;

/// Steps between the numbers at an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) enum Steps {
    /// 1, 2 or 5 times a power of ten.
    #[default]
    Any,
    /// The same, whole.
    Whole,
    /// Parts and multiples of a turn.
    Degrees,
}

/// One axis: values `low` to `high` from `start` to `end` on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) log: bool,
    pub(super) steps: Steps,
    pub(super) start: f64,
    pub(super) end: f64,
}

/// Where a value lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// Within the range, at this place of the page.
    Inside(f64),
    /// Below its lower end.
    Below,
    /// Above its upper end.
    Above,
    /// There is no value.
    Missing,
}

impl Scale {
    /// The range of the axis or, where it has none, that of the data and `margin` of it at each end.
    pub(super) fn new(axis: &Axis, data: impl Iterator<Item = f64>, margin: f64) -> Self {
        let data: Vec<f64> = data.filter(|value| value.is_finite() && (!axis.log || *value > 0.0)).collect();
        let usable = data.iter().copied();
        let whole = !data.is_empty() && usable.clone().all(|value| value.fract() == 0.0);
        let steps = match axis.unit.as_str() {
            "deg" => Steps::Degrees,
            _ if whole => Steps::Whole,
            _ => Steps::Any,
        };
        let [low, high] = axis.range.unwrap_or_else(|| {
            if axis.log {
                let [low, high] = padded(usable.map(f64::log10), LARGEST.log10(), margin);
                [low.clamp(-300.0, 299.0), high.clamp(-299.0, 300.0)].map(|exponent| 10f64.powf(exponent))
            } else {
                padded(usable, LARGEST, margin)
            }
        });
        Scale { low, high, log: axis.log, steps, start: 0.0, end: 1.0 }
    }

    /// The same middle with a range that is `times` as long; not for a logarithmic axis.
    pub(super) fn widened(self, times: f64) -> Self {
        let (middle, half) = (0.5 * self.low + 0.5 * self.high, 0.5 * (self.high - self.low) * times);
        Scale { low: middle - half, high: middle + half, ..self }
    }

    /// The same values between other places.
    pub(super) fn over(self, start: f64, end: f64) -> Self {
        Scale { start, end, ..self }
    }

    /// The place of a value, on the page or beyond; NaN for what a logarithmic axis does not have.
    pub(super) fn at(&self, value: f64) -> f64 {
        let [low, high, value] = [self.low, self.high, value].map(|v| if self.log { v.log10() } else { v });
        self.start + ((value - low) / (high - low)).clamp(-1e6, 1e6) * (self.end - self.start)
    }

    /// Whether a value lies within the range, and where.
    pub(super) fn place(&self, value: f64) -> Place {
        match value {
            value if value.is_nan() => Place::Missing,
            value if value < self.low => Place::Below,
            value if value > self.high => Place::Above,
            value => Place::Inside(self.at(value)),
        }
    }

    /// Length on the page.
    pub(super) fn length(&self) -> f64 {
        (self.end - self.start).abs()
    }
}

/// The range of the data, wide enough to be drawn, and a share of it at each end.
fn padded(data: impl Iterator<Item = f64>, largest: f64, margin: f64) -> [f64; 2] {
    let (low, high) = data.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return [0.0, 1.0];
    }
    let (low, high) = (low.clamp(-largest, largest), high.clamp(-largest, largest));
    let size = low.abs().max(high.abs());
    let pad = match high - low {
        width if width > 1e-12 * size => margin * width,
        _ if size == 0.0 => 1.0,
        _ => 0.1 * size,
    };
    [low - pad, high + pad]
}

/// Refuses a range that has no length or, on a logarithmic axis, no logarithm.
pub(super) fn check(axis: &Axis, what: &str) -> Result<()> {
    let Some([low, high]) = axis.range else { return Ok(()) };
    let refuse = |end: &str, value, must| {
        Err(Error::Method(youla::Error::OutOfRange {
            what: format!("the {end} end of the range of the {what}"),
            value,
            must,
        }))
    };
    if !high.is_finite() || high.abs() > LARGEST {
        refuse("upper", high, "a finite number of at most 1e300")
    } else if !(low < high && low >= -LARGEST) {
        refuse("lower", low, "below the upper end")
    } else if axis.log && low <= 0.0 {
        refuse("lower", low, "positive on a logarithmic axis")
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(range: Option<[f64; 2]>, log: bool) -> Axis {
        Axis { range, log, ..Axis::default() }
    }

    #[test]
    fn values_are_placed_within_the_range_and_told_apart_beyond() {
        let scale = Scale::new(&axis(Some([-20.0, 100.0]), false), std::iter::empty(), 0.0).over(120.0, 0.0);
        assert_eq!(scale.place(40.0), Place::Inside(60.0));
        assert_eq!(scale.place(-20.1), Place::Below);
        assert_eq!(scale.place(f64::NEG_INFINITY), Place::Below);
        assert_eq!(scale.place(100.1), Place::Above);
        assert_eq!(scale.place(f64::NAN), Place::Missing);
        let scale = Scale::new(&axis(Some([1.0, 1000.0]), true), std::iter::empty(), 0.0).over(0.0, 3.0);
        assert!((scale.at(10.0) - 1.0).abs() < 1e-12);
        assert_eq!(scale.place(-1.0), Place::Below);
    }

    #[test]
    fn every_data_gives_a_range_with_a_length() {
        for data in [&[][..], &[f64::NAN], &[0.0], &[5.0], &[1e-9, 1e-9], &[-1e308, 1e308], &[1.0, f64::INFINITY]] {
            for log in [false, true] {
                let scale = Scale::new(&axis(None, log), data.iter().copied(), 0.05);
                assert!(scale.low < scale.high && (scale.high - scale.low).is_finite(), "{data:?} {scale:?}");
                assert!(data.iter().all(|value| !matches!(scale.place(*value), Place::Inside(at) if at.is_nan())));
            }
        }
    }

    #[test]
    fn a_range_without_length_or_logarithm_is_refused() {
        for (range, log) in [
            ([1.0, 1.0], false),
            ([2.0, 1.0], false),
            ([f64::NAN, 1.0], false),
            ([0.0, f64::INFINITY], false),
            ([0.0, 1.0], true),
        ] {
            assert!(
                matches!(check(&axis(Some(range), log), "axis"), Err(Error::Method(youla::Error::OutOfRange { .. }))),
                "{range:?}"
            );
        }
        assert!(check(&axis(Some([0.1, 1.0]), true), "axis").is_ok());
    }
}
