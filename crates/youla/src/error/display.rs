//! How poles, times, lists of names and limits of an order are printed.

use faer::c64;
use std::fmt::Write;

/// Names the worst pole where there is one.
pub(super) fn worst_pole(pole: Option<c64>) -> String {
    pole.map_or(String::new(), |p| format!("; the worst pole is {}", Pole(p)))
}

/// A relative residual in brackets; nothing where none was computed.
pub(super) fn in_brackets(residual: f64) -> String {
    if residual.is_nan() { String::new() } else { format!(" (relative residual {residual:.1e})") }
}

/// Prints a pole as `-1.2 + 3.4i` with its magnitude.
pub struct Pole(pub c64);

impl std::fmt::Display for Pole {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let c64 { re, im } = self.0;
        let magnitude = re.hypot(im);
        if im == 0.0 {
            write!(f, "{re:.6}")
        } else {
            let sign = if im < 0.0 { '-' } else { '+' };
            write!(f, "{re:.6} {sign} {:.6}i (magnitude {magnitude:.6})", im.abs())
        }
    }
}

/// Prints a time without the last digits, which hold the rounding of a difference.
pub struct Seconds(pub f64);

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        FullNumber(format!("{:.9e}", self.0).parse().unwrap_or(self.0)).fmt(f)
    }
}

/// Prints a number in full, or as a power of ten where that takes too many digits.
pub struct FullNumber(pub f64);

impl std::fmt::Display for FullNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let FullNumber(v) = *self;
        if v == 0.0 || !v.is_finite() || (1e-9..1e15).contains(&v.abs()) {
            write!(f, "{v}")
        } else {
            write!(f, "{v:e}")
        }
    }
}

/// Most characters of a name in a message, and most names of a list.
const LONGEST: usize = 60;
const SHOWN: usize = 10;

/// A name of a user's file, short enough for a message.
///
/// ```
/// assert_eq!(youla::error::short("speed"), "speed");
/// assert_eq!(youla::error::short(&"x".repeat(1000)).chars().count(), 60);
/// ```
pub fn short(name: &str) -> String {
    match name.char_indices().nth(LONGEST) {
        None => name.to_owned(),
        Some(_) => name.chars().take(LONGEST - 1).chain(['\u{2026}']).collect(),
    }
}

/// Prints a list of names, the first ten of them, each up to sixty characters.
pub struct Names<'a>(pub &'a [String]);

impl std::fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, name) in self.0.iter().take(SHOWN).enumerate() {
            f.write_str(if k == 0 { "" } else { ", " })?;
            short(name)
                .chars()
                .map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c })
                .try_for_each(|c| f.write_char(c))?;
        }
        match self.0.len() {
            0 => f.write_str("nothing"),
            n if n > SHOWN => write!(f, " and {} more", n - SHOWN),
            _ => Ok(()),
        }
    }
}
