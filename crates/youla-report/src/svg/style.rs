//! Colour, line and marker of each method: those of the page on white paper.

use super::canvas::Paint;
use super::path::Path;
use crate::data::{DrawnMethod, MethodRole};
use crate::figure::MEASURED;
use serde::Serialize;

/// Colour of the measured signal, which no method has.
const MEASURED_STYLE: Style = style("--measured", "#16191d", 0.5, &[], Marker::Circle);
const OTHER_STYLES: [Style; 4] = [
    style("--other-1", "#cc79a7", 0.8, &[6.0, 1.5], Marker::Plus),
    style("--other-2", "#56b4e9", 0.8, &[2.5, 1.0], Marker::Circle),
    style("--other-3", "#8c564b", 0.8, &[1.0, 1.0], Marker::Square),
    style("--other-4", "#6a51a3", 0.8, &[5.0, 1.5, 1.0, 1.5, 1.0, 1.5], Marker::Diamond),
];
/// What is no method and stands before all of them in the legend, and after them.
const BEFORE: [(&str, Style); 6] = [
    (MEASURED, MEASURED_STYLE),
    ("output", MEASURED_STYLE),
    ("input", style("--soft", "#59616b", 0.5, &[], Marker::Square)),
    ("excitation", style("--excitation", "#c77f00", 0.5, &[], Marker::Diamond)),
    ("indirect", style("--indirect", "#e69f00", 0.7, &[], Marker::Circle)),
    ("band of noise", style("--soft", "#59616b", 0.6, &[2.0, 1.5], Marker::Square)),
];
const AFTER: [(&str, Style); 11] = [
    ("deviation, all causes", style("--recommended", "#c2185b", 1.15, &[], Marker::Circle)),
    ("deviation, noise", style("--recommended", "#c2185b", 0.8, &[1.2, 1.2], Marker::Circle)),
    ("deviation, choice", style("--recommended", "#c2185b", 0.8, &[4.0, 1.0, 1.0, 1.0], Marker::Circle)),
    ("deviation, variation", style("--recommended", "#c2185b", 0.8, &[7.0, 2.0], Marker::Circle)),
    ("deviation, distortion", style("--recommended", "#c2185b", 0.8, &[2.5, 2.5], Marker::Circle)),
    ("band of validity", style("--good", "#00704f", 0.6, &[], Marker::Square)),
    ("new pole", style("--soft", "#59616b", 0.7, &[], Marker::Plus)),
    ("unstable pole", style("--bad", "#b3261e", 0.7, &[], Marker::Cross)),
    ("two standard deviations", style("--nominal", "#7f868e", 0.5, &[], Marker::Plus)),
    ("open loop", style("--soft", "#59616b", 0.8, &[4.0, 1.5], Marker::Square)),
    ("bound", style("--ink", "#16191d", 0.7, &[1.2, 1.5], Marker::Down)),
];
/// Dashes of further curves of one method, distinguished by their notes.
const FURTHER_DASHES: [&[f64]; 4] = [&[1.2, 1.2], &[4.0, 1.0, 1.0, 1.0], &[7.0, 2.0], &[2.5, 2.5]];

/// Most strength of an area, so that dark text on it stays legible.
const STRONGEST: f64 = 0.7;

/// How one method is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Style {
    /// Custom property of the style sheet of the page, which has a value for light and one for dark paper.
    pub(crate) property: &'static str,
    /// Its value on white paper.
    pub(super) colour: &'static str,
    pub(crate) width: f64,
    pub(crate) dash: &'static [f64],
    pub(crate) marker: Marker,
}

/// Shape of a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Marker {
    Circle,
    Square,
    Diamond,
    Plus,
    Up,
    Down,
    Cross,
}

const fn style(
    property: &'static str,
    colour: &'static str,
    width: f64,
    dash: &'static [f64],
    marker: Marker,
) -> Style {
    Style { property, colour, width, dash, marker }
}

/// The methods of a page and their styles.
pub(crate) struct Styles<'a> {
    methods: &'a [DrawnMethod],
}

impl<'a> Styles<'a> {
    pub(crate) fn new(methods: &'a [DrawnMethod]) -> Self {
        Styles { methods }
    }

    /// The style of a method; an unknown one is drawn as the first without a role.
    pub(crate) fn of(&self, key: &str) -> Style {
        if key == MEASURED {
            return MEASURED_STYLE;
        }
        let Some(place) = self.place(key) else {
            let known = BEFORE.iter().chain(&AFTER).find(|(name, _)| *name == key);
            return known.map_or(OTHER_STYLES[0], |(_, style)| *style);
        };
        let others = self.methods[..place].iter().filter(|method| method.role == MethodRole::Other).count();
        match self.methods[place].role {
            MethodRole::Recommended => style("--recommended", "#c2185b", 1.15, &[], Marker::Circle),
            MethodRole::Nominal => style("--nominal", "#7f868e", 0.8, &[1.5, 1.5], Marker::Plus),
            MethodRole::Pem => style("--pem", "#b0457b", 0.85, &[5.5, 1.5], Marker::Up),
            MethodRole::PemMultiStart => style("--pem-multi-start", "#8a7a00", 0.85, &[2.5, 1.2], Marker::Down),
            MethodRole::Direct => style("--direct", "#d55e00", 0.85, &[4.5, 1.5, 1.0, 1.5], Marker::Square),
            MethodRole::Hansen => style("--hansen", "#0072b2", 0.95, &[], Marker::Circle),
            MethodRole::HansenReduced => style("--hansen-reduced", "#009e73", 0.85, &[3.5, 2.0], Marker::Diamond),
            MethodRole::HansenPem => style("--hansen-pem", "#5b2ca0", 0.9, &[8.0, 1.2, 1.2, 1.2], Marker::Cross),
            MethodRole::Other => OTHER_STYLES[others % OTHER_STYLES.len()],
        }
    }

    /// Dash of the curve of a method that is the `nth` with a note of its own.
    pub(super) fn dash(&self, key: &str, nth: usize) -> &'static [f64] {
        match nth {
            0 => self.of(key).dash,
            nth => FURTHER_DASHES[(nth - 1) % FURTHER_DASHES.len()],
        }
    }

    /// Name of a method and, behind a comma, its note.
    pub(crate) fn name(&self, key: &str, note: &str) -> String {
        let label = self.place(key).map_or(key, |place| &self.methods[place].label);
        if note.is_empty() { label.to_owned() } else { format!("{label}, {note}") }
    }

    /// Place in the order in which methods are listed: the measured signal first, unknown ones last.
    pub(crate) fn order(&self, key: &str) -> usize {
        let before = BEFORE.iter().any(|(name, _)| *name == key);
        match self.place(key) {
            _ if key == MEASURED => 0,
            Some(place) => place + 1,
            None if before => 0,
            None => usize::MAX,
        }
    }

    fn place(&self, key: &str) -> Option<usize> {
        self.methods.iter().position(|method| method.key == key)
    }
}

/// A colour `#rrggbb` over white, at a strength from 0 to 1; NaN counts as 0.
pub(super) fn tint(colour: &str, strength: f64) -> String {
    let strength = if strength.is_nan() { 0.0 } else { strength.clamp(0.0, 1.0) };
    let part = |at: usize| {
        let full = colour.get(at..at + 2).and_then(|digits| u8::from_str_radix(digits, 16).ok()).unwrap_or(0);
        (255.0 - STRONGEST * strength * (255.0 - f64::from(full))).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", part(1), part(3), part(5))
}

impl Marker {
    /// Filled, or drawn by lines where the shape has no area or is to be hollow.
    pub(super) fn paint(self, colour: &str, hollow: bool) -> Paint<'_> {
        match self {
            Marker::Plus | Marker::Cross => Paint { stroke: colour, width: 0.6, ..Paint::default() },
            _ if hollow => Paint { stroke: colour, width: 0.5, ..Paint::default() },
            _ => Paint { fill: colour, ..Paint::default() },
        }
    }

    /// A shape that can be filled, and so be distinguished from its outline.
    pub(super) fn solid(self) -> Self {
        match self {
            Marker::Plus => Marker::Up,
            Marker::Cross => Marker::Down,
            other => other,
        }
    }

    /// The same for large points, filled or as outlines.
    pub(super) fn large(self, colour: &str, filled: bool) -> Paint<'_> {
        let fill = if filled { colour } else { "" };
        Paint { fill, stroke: colour, width: 0.7, ..Paint::default() }
    }

    /// Adds the shape of half-width `r` around a point.
    pub(super) fn add(self, path: &mut Path, (x, y): (f64, f64), r: f64) {
        let around = |points: &[(f64, f64)]| points.iter().map(|(dx, dy)| (x + dx * r, y + dy * r)).collect::<Vec<_>>();
        match self {
            Marker::Circle => path.circle((x, y), r),
            Marker::Square => path.polygon(around(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)])),
            Marker::Diamond => path.polygon(around(&[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)])),
            Marker::Up => path.polygon(around(&[(0.0, -1.2), (1.15, 0.85), (-1.15, 0.85)])),
            Marker::Down => path.polygon(around(&[(0.0, 1.2), (1.15, -0.85), (-1.15, -0.85)])),
            Marker::Plus => strokes(path, &around(&[(-1.2, 0.0), (1.2, 0.0), (0.0, -1.2), (0.0, 1.2)])),
            Marker::Cross => strokes(path, &around(&[(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)])),
        }
    }
}

fn strokes(path: &mut Path, ends: &[(f64, f64)]) {
    for pair in ends.chunks_exact(2) {
        path.move_to(pair[0]);
        path.line_to(pair[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_style_depends_on_the_list_of_methods_and_not_on_the_figure() {
        let other = |key: &str| DrawnMethod::new(key, key, MethodRole::Other);
        let methods = [other("a"), DrawnMethod::hansen(), other("b"), DrawnMethod::pem()];
        let styles = Styles::new(&methods);
        assert_eq!(styles.of("hansen").colour, "#0072b2");
        assert_eq!(styles.of("pem").colour, "#b0457b");
        assert_eq!(styles.of("b"), OTHER_STYLES[1]);
        assert_eq!(styles.of(MEASURED).colour, "#16191d");
        assert_eq!(styles.name("hansen", "median"), "Hansen G(S), median");
        assert_eq!((styles.order(MEASURED), styles.order("b"), styles.order("c")), (0, 3, usize::MAX));
    }

    #[test]
    fn strength_is_opacity_over_white() {
        assert_eq!(tint("#0072b2", 0.0), "#ffffff");
        assert_eq!(tint("#000000", 1.0 / 0.7), tint("#000000", 1.0));
        assert_eq!(tint("#000000", 1.0), "#4d4d4d");
        assert_eq!(tint("#000000", f64::NAN), "#ffffff");
    }
}
