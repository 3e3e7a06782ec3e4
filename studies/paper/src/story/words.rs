//! Numbers and lists as text.

use std::f64::consts::TAU;
use std::fmt::Display;
use youla::signal::{Excitation, RampedExcitation};

/// What is where a method gave no model.
pub(super) const NONE: &str = "none";

/// Names of the axes in the order of the channels.
pub(super) const AXES: [&str; 2] = ["horizontal", "vertical"];

/// With this many decimals, zero without a sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        _ => text,
    }
}

/// A fit in percent; far below zero it says only that it is.
pub(super) fn percent(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        NONE.into()
    } else if value == f64::NEG_INFINITY {
        "failed".into()
    } else if value < -999.0 {
        "< -999".into()
    } else {
        fixed(value, decimals)
    }
}

/// The fits of both axes in a sentence.
pub(super) fn both(fit: [f64; 2]) -> String {
    format!("{} and {} %", percent(fit[0], 1), percent(fit[1], 1))
}

/// Significant digits, as short as they allow.
pub(super) fn short(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-4..1e5).contains(&rounded.abs()) { format!("{rounded:e}") } else { rounded.to_string() }
}

/// Kind, amplitude, what else defines it, and its ramps.
pub(super) fn excitation(signal: &RampedExcitation) -> String {
    let hz = |omega: f64| short(omega / TAU, 3);
    let kind = match &signal.excitation {
        Excitation::SquareWaves(o) => format!(
            "square waves of {} V with random holds of {} to {} samples",
            short(o.amplitude, 3),
            o.hold_min,
            o.hold_max
        ),
        Excitation::Prbs(o) => format!(
            "a maximal-length PRBS of {} V, 2^{} - 1 values of {}",
            short(o.amplitude, 3),
            o.order,
            count(o.hold, "sample", "samples")
        ),
        Excitation::Multisine(o) => format!(
            "a multisine of {} V from {} Hz to {}, period {}",
            short(o.amplitude, 3),
            hz(o.omega_min),
            o.omega_max.map_or_else(|| "the Nyquist frequency".into(), |omega| format!("{} Hz", hz(omega))),
            count(o.period, "sample", "samples")
        ),
        Excitation::Chirp(o) => {
            format!("a chirp of {} V from {} to {} Hz", short(o.amplitude, 3), hz(o.omega_start), hz(o.omega_end))
        }
    };
    match signal.ramp {
        0.0 => kind,
        ramp => format!("{kind}, faded in and out over {} s", short(ramp, 3)),
    }
}

/// `a, b and c`.
pub(super) fn and<T: Display>(items: &[T]) -> String {
    let texts: Vec<String> = items.iter().map(T::to_string).collect();
    match texts.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A number of things.
pub(super) fn count(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

/// The first letter as a capital.
pub(super) fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// `0.2 to 0.3`.
pub(super) fn range([low, high]: [f64; 2]) -> String {
    format!("{} to {}", short(low, 3), short(high, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_a_reader_expects_them() {
        assert_eq!((fixed(-0.001, 1), fixed(-0.06, 1)), ("0.0".into(), "-0.1".into()));
        assert_eq!(percent(f64::NAN, 1), NONE);
        assert_eq!((percent(f64::NEG_INFINITY, 1), percent(-1e9, 1)), ("failed".into(), "< -999".into()));
        assert_eq!(
            (short(0.30000000000000004, 3), short(1e9, 3), short(1000.0, 3)),
            ("0.3".into(), "1e9".into(), "1000".into())
        );
        assert_eq!(and(&["a", "b", "c"]), "a, b and c");
        assert_eq!(sentence("in all"), "In all");
    }
}
