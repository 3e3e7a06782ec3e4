//! Text: how wide it is, where it breaks, how units are written.

use super::font;
use crate::figure::Axis;

/// Size of titles, axis labels and legend, points.
pub(super) const LABEL: f64 = 9.0;
/// Size of the numbers at the axes, points.
pub(super) const TICK: f64 = 8.0;
/// Size of remarks below a box, points.
pub(super) const REMARK: f64 = 7.0;
/// From one line of text to the next, in sizes.
pub(super) const LEADING: f64 = 1.2;

/// Width of a text in the font of the figures.
pub(super) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(font::em).sum::<f64>() * size
}

/// Breaks a text at spaces into lines of at most `most` points; a word alone may be wider.
pub(super) fn wrapped(text: &str, size: f64, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(line, size) + width(" ", size) + width(word, size) <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The size at which the widest word of a text fits into `most` points, at most `size`.
pub(super) fn fitting(text: &str, size: f64, most: f64) -> f64 {
    let widest = text.split_whitespace().map(|word| width(word, size)).fold(most, f64::max);
    size * most / widest
}

/// `label (unit)` as it is at an axis.
pub(super) fn axis_label(axis: &Axis) -> String {
    match axis.unit.as_str() {
        "" => axis.label.clone(),
        unit => format!("{} ({})", axis.label, pretty_unit(unit)).trim_start().to_owned(),
    }
}

/// The letter u before a letter is the prefix micro, and `deg` the sign.
pub fn pretty_unit(unit: &str) -> String {
    let mut rest = unit.chars();
    match (rest.next(), rest.next()) {
        (Some('u'), Some(next)) if next.is_ascii_alphabetic() => format!("µ{}", &unit[1..]),
        _ if unit == "deg" => "°".to_owned(),
        _ => unit.to_owned(),
    }
}

/// A minus sign as wide as a digit.
pub(super) fn minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}

/// The same at the start of a text that may be a number.
pub(super) fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit() || c == '.') => format!("\u{2212}{rest}"),
        _ => text.to_owned(),
    }
}

/// `10` with an exponent.
pub(super) fn power_of_ten(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_as_in_print() {
        let label =
            |label: &str, unit: &str| axis_label(&Axis { label: label.into(), unit: unit.into(), ..Axis::default() });
        assert_eq!(label("horizontal", "um"), "horizontal (µm)");
        assert_eq!(label("phase", "deg"), "phase (°)");
        assert_eq!(label("speed", "u"), "speed (u)");
        assert_eq!(label("theta", ""), "theta");
    }

    #[test]
    fn lines_break_at_spaces_and_keep_all_words() {
        let text = "the fit of the Hansen scheme";
        let lines = wrapped(text, 9.0, 60.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| width(line, 9.0) <= 60.0));
        assert_eq!(lines.join(" "), text);
        assert!(wrapped(" ", 9.0, 60.0).is_empty());
    }

    #[test]
    fn exponents_are_raised() {
        assert_eq!(power_of_ten(-12), "10⁻¹²");
    }
}
