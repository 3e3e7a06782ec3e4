//! What all pages share: one file with template, style, script, plotting library and data.
//!
//! The file makes no request (its content security policy forbids it). Data is in the file as JSON in which every `<`
//! is written `\u003c`, so that no text of the user can end the script element or open a comment in it.

use minijinja::syntax::SyntaxConfig;
use minijinja::{Environment, HtmlEscape, Value, context};

use super::drawings::Drawings;
use super::numbers::{fit, radius};
use super::svg::pretty_unit;
use crate::{Error, Result};

/// The frame that each page fills.
const FRAME: &str = include_str!("../assets/page.html");
const STYLE: &str = include_str!("../assets/report.css");
/// Draws any figure, the same on every page.
const SCRIPT: [&str; 7] = [
    include_str!("../assets/figures/base.js"),
    include_str!("../assets/figures/marks.js"),
    include_str!("../assets/figures/boxes.js"),
    include_str!("../assets/figures/cells.js"),
    include_str!("../assets/figures/panel.js"),
    include_str!("../assets/figures/figure.js"),
    include_str!("../assets/figures/page.js"),
];
const UPLOT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../assets/uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../assets/uplot/LICENSE");

/// What another page needs to look and to write numbers as a report does.
#[derive(Debug, Clone)]
pub struct PageParts {
    /// Style sheet, with that of the plotting library.
    pub style: String,
    /// The plotting library, uPlot, with its licence.
    pub library: String,
    /// Elements, choices, numbers and axes as text.
    pub helpers: &'static str,
}

/// The parts of a page that do not depend on what it shows.
pub fn page_parts() -> PageParts {
    PageParts {
        style: format!("{UPLOT_STYLE}\n{STYLE}"),
        library: format!("/*!\nuPlot\n{UPLOT_LICENCE}*/\n{UPLOT}"),
        helpers: SCRIPT[0],
    }
}

/// Most points of all lines of a page together; about 16 bytes each keep the file below 5 MB.
pub(super) const ALL_POINTS: usize = 230_000;

/// Renders a page.
///
/// `template` extends the frame and reads `content`; the script draws `data`.
pub(super) fn render(template: &str, content: Value, data: &Drawings) -> Result<String> {
    let json = serde_json::to_string(data).map_err(|source| Error::ReportData { source })?;
    let parts = page_parts();
    let page = context! {
        style => safe(parts.style),
        library => safe(parts.library),
        script => safe(SCRIPT.concat()),
        json => safe(json.replace('<', "\\u003c")),
        ..content
    };
    rendered(template, page).map_err(|source| Error::ReportTemplate { source })
}

fn rendered(template: &str, page: Value) -> Result<String, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("fixed", |value: f64, digits: usize| with_minus(format!("{value:.digits$}")));
    environment.add_filter("fit", |value: f64| with_minus(fit(value, 1)));
    environment.add_filter("radius", |value: f64| with_minus(radius(value)));
    environment.add_filter("scientific", |value: f64| with_minus(format!("{value:.1e}")));
    environment.add_filter("significant", |value: f64| with_minus(significant(value)));
    environment.add_filter("two_digits", |value: f64| with_minus(digits(value, 2)));
    environment.add_filter("printed", with_minus);
    environment.add_filter("sentence", |text: String| safe(prose(&text)));
    environment.add_filter("unit", |unit: String| pretty_unit(&unit));
    environment.add_filter("magnitude", |pole: Vec<f64>| pole.iter().fold(0.0_f64, |size, part| size.hypot(*part)));
    environment.add_template("page.html", FRAME)?;
    environment.add_template("content.html", template)?;
    environment.get_template("content.html")?.render(page)
}

fn safe(text: String) -> Value {
    Value::from_safe_string(text)
}

/// Four significant digits.
fn significant(value: f64) -> String {
    digits(value, 4)
}

/// So many significant digits, without an exponent down to 1e-5.
fn digits(value: f64, count: i32) -> String {
    match value {
        v if !v.is_finite() => "not known".into(),
        0.0 => "0".into(),
        v if v.abs() < 1e-5 => format!("{v:.1e}"),
        v => format!("{v:.0$}", super::numbers::decimals(v, count).clamp(0, 12) as usize),
    }
}

/// A text with minus signs, and what it quotes by backticks as code.
fn prose(text: &str) -> String {
    let escaped = HtmlEscape(&with_minus_signs(text.to_owned())).to_string();
    let parts: Vec<&str> = escaped.split('`').collect();
    // An odd mark at the end quotes nothing.
    let quotes = parts.len() - 1 - (parts.len() - 1) % 2;
    let mark = |k: usize| match k {
        _ if k >= quotes => "`",
        k if k % 2 == 0 => "<code>",
        _ => "</code>",
    };
    let rest = parts.iter().enumerate().skip(1).map(|(k, part)| format!("{}{part}", mark(k - 1)));
    std::iter::once(parts[0].to_owned()).chain(rest).collect()
}

/// A text with minus signs before its numbers and between two; hyphens of words and ranges stay.
fn with_minus_signs(text: String) -> String {
    let chars: Vec<char> = text.chars().collect();
    let negative = |k: usize| {
        let number = chars.get(k + 1).is_some_and(char::is_ascii_digit);
        let exponent = k > 1 && chars[k - 1] == 'e' && chars[k - 2].is_ascii_digit();
        let spaced = k > 1 && chars[k - 2].is_ascii_digit() && chars[k - 1] == ' ' && chars.get(k + 1) == Some(&' ');
        let between = spaced && chars.get(k + 2).is_some_and(char::is_ascii_digit);
        between
            || number && (exponent || k == 0 || !(chars[k - 1].is_alphanumeric() || "-_/.)]".contains(chars[k - 1])))
    };
    chars.iter().enumerate().map(|(k, c)| if *c == '-' && negative(k) { '\u{2212}' } else { *c }).collect()
}

/// Numbers in tables have a minus sign as wide as a digit.
pub fn with_minus(number: String) -> String {
    number.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::{prose, with_minus_signs};

    #[test]
    fn numbers_have_minus_signs_and_words_keep_their_hyphens() {
        let text = with_minus_signs("fit -3.5 % (-1 dB), 2e-5, closed-loop run-001, 10-20 Hz, [-1, -2]".into());
        assert_eq!(
            text,
            "fit \u{2212}3.5 % (\u{2212}1 dB), 2e\u{2212}5, closed-loop run-001, 10-20 Hz, [\u{2212}1, \u{2212}2]"
        );
    }

    #[test]
    fn what_is_quoted_is_code_and_nothing_else_is_markup() {
        assert_eq!(prose("by `skip` or `segments`."), "by <code>skip</code> or <code>segments</code>.");
        assert_eq!(prose("<b> of `a"), "&lt;b&gt; of `a");
        assert_eq!(prose("|z| = 1 - 4.1e-6"), "|z| = 1 \u{2212} 4.1e\u{2212}6");
    }
}
