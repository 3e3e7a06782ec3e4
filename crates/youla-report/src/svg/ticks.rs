//! Which values are written at an axis.

use super::scale::{Scale, Steps};
use super::text::{minus, power_of_ten};

/// One value at an axis; without a label it is only marked.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

/// About `most` values at steps of 1, 2 or 5 times a power of ten, or decades on a logarithmic axis.
pub(super) fn ticks(scale: &Scale, most: usize) -> Vec<Tick> {
    let most = most.max(2);
    if !scale.log {
        return linear(scale.low, scale.high, most, scale.steps);
    }
    let decades = scale.low.log10().ceil() as i32..=scale.high.log10().floor() as i32;
    match decades.clone().count() {
        0 | 1 => within_a_decade(scale, most),
        count => in_decades(scale, decades, count.div_ceil(most).max(1)),
    }
}

fn linear(low: f64, high: f64, most: usize, steps: Steps) -> Vec<Tick> {
    const TURNS: [f64; 8] = [5.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0];
    let raw = (high - low) / most as f64;
    let turn = TURNS.into_iter().find(|turn| *turn >= raw * (1.0 - 1e-9)).filter(|_| raw > 2.0);
    let step = match (steps, turn) {
        (Steps::Degrees, Some(turn)) => turn,
        (Steps::Whole, _) => nice_step(raw).max(1.0),
        _ => nice_step(raw),
    };
    let first = (low / step - 1e-9).ceil();
    let values = (0..=most).map(|k| (first + k as f64) * step).take_while(|value| *value <= high + 1e-9 * step);
    labelled(values.collect(), step)
}

/// The step of 1, 2 or 5 times a power of ten that is not smaller.
fn nice_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    let mantissa = raw / power * (1.0 - 1e-9);
    power
        * if mantissa <= 1.0 {
            1.0
        } else if mantissa <= 2.0 {
            2.0
        } else if mantissa <= 5.0 {
            5.0
        } else {
            10.0
        }
}

/// As many decimals as the step needs, and a power of ten where numbers are very small or large.
fn labelled(values: Vec<f64>, step: f64) -> Vec<Tick> {
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let exponent = match largest {
        largest if largest > 0.0 && !(1e-3..1e6).contains(&largest) => (largest * (1.0 + 1e-9)).log10().floor() as i32,
        _ => 0,
    };
    let places = (exponent - (step * (1.0 + 1e-9)).log10().floor() as i32).clamp(0, 15) as usize;
    let label = |value: f64| match value {
        value if value.abs() < 1e-6 * step => format!("{:.1$}", 0.0, if exponent == 0 { places } else { 0 }),
        value if exponent == 0 => minus(&format!("{value:.places$}")),
        // In two steps, since a power of ten alone may underflow.
        value => {
            let mantissa = value / 10f64.powi(exponent / 2) / 10f64.powi(exponent - exponent / 2);
            format!("{}×{}", minus(&format!("{mantissa:.places$}")), power_of_ten(exponent))
        }
    };
    values.into_iter().map(|value| Tick { value, label: label(value) }).collect()
}

fn in_decades(scale: &Scale, decades: std::ops::RangeInclusive<i32>, every: usize) -> Vec<Tick> {
    let label = |decade: i32| match decade {
        -3..=3 => format!("{}", 10f64.powi(decade)),
        _ => power_of_ten(decade),
    };
    let written = decades.clone().step_by(every).map(|k| Tick { value: 10f64.powi(k), label: label(k) });
    let between: Vec<i32> = if every == 1 { (2..10).collect() } else { Vec::new() };
    let marked = (decades.start() - 1..=*decades.end())
        .flat_map(|decade| between.iter().map(move |&digit| f64::from(digit) * 10f64.powi(decade)))
        .filter(|value| (scale.low..=scale.high).contains(value))
        .map(|value| Tick { value, label: String::new() });
    written.chain(marked).collect()
}

/// 1, 2 and 5 in a logarithmic range of less than two decades; where even these are few, equal steps.
fn within_a_decade(scale: &Scale, most: usize) -> Vec<Tick> {
    let first = scale.low.log10().floor() as i32;
    let values: Vec<f64> = (first..=first + 2)
        .flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(decade)))
        .filter(|value| (scale.low..=scale.high).contains(value))
        .collect();
    if values.len() < 3 {
        return linear(scale.low, scale.high, most, Steps::Any);
    }
    values.into_iter().flat_map(|value| labelled(vec![value], 10f64.powf(value.log10().floor()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, log: bool, most: usize) -> Vec<String> {
        let scale = Scale { low, high, log, steps: Steps::Any, start: 0.0, end: 1.0 };
        ticks(&scale, most).into_iter().map(|tick| tick.label).filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn steps_are_round_and_labels_have_the_decimals_they_need() {
        assert_eq!(labels(-20.0, 100.0, false, 6), ["−20", "0", "20", "40", "60", "80", "100"]);
        assert_eq!(labels(0.0, 1.0, false, 5), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-3e-5, 3e-5, false, 4), ["−2×10⁻⁵", "0", "2×10⁻⁵"]);
        assert_eq!(labels(0.0, 4e6, false, 4), ["0", "1×10⁶", "2×10⁶", "3×10⁶", "4×10⁶"]);
    }

    #[test]
    fn angles_and_counts_have_steps_of_their_own() {
        let labels = |low: f64, high: f64, steps| {
            let scale = Scale { low, high, log: false, steps, start: 0.0, end: 1.0 };
            ticks(&scale, 5).into_iter().map(|tick| tick.label).collect::<Vec<_>>()
        };
        assert_eq!(labels(-370.0, 10.0, Steps::Degrees), ["−360", "−270", "−180", "−90", "0"]);
        assert_eq!(labels(-1.0, 1.0, Steps::Degrees), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(1.0, 3.0, Steps::Whole), ["1", "2", "3"]);
    }

    #[test]
    fn a_logarithmic_axis_has_decades_or_parts_of_one() {
        assert_eq!(labels(0.5, 2000.0, true, 6), ["1", "10", "100", "1000"]);
        assert_eq!(labels(1e-9, 1e3, true, 4), ["10⁻⁹", "10⁻⁵", "0.1", "1000"]);
        assert_eq!(labels(3.0, 60.0, true, 6), ["5", "10", "20", "50"]);
        assert_eq!(labels(4.1, 4.4, true, 3), ["4.1", "4.2", "4.3", "4.4"]);
    }

    #[test]
    fn ticks_lie_within_the_range_and_are_few() {
        for (low, high, log) in
            [(1e300, 1.1e300, false), (-1e300, 1e300, false), (1.0, 1.0 + 1e-14, false), (1e-307, 1e300, true)]
        {
            let found = ticks(&Scale { low, high, log, steps: Steps::Whole, start: 0.0, end: 1.0 }, 5);
            assert!(found.len() <= 6 && found.iter().all(|tick| tick.value <= high * (1.0 + 1e-9)), "{found:?}");
        }
    }
}
