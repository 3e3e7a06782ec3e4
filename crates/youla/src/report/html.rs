//! One file: template, style, figures' code, plotting library and data.
//!
//! The file makes no request (its content security policy forbids it). Data stands in the file as JSON in which every `<`
//! is written `\u003c`, so that no text of the user can end the script element or open a comment in it.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, Value, context};

use super::data::{ReportData, Role};
use super::{phase, tables};
use crate::{Error, Result};

const TEMPLATE: &str = include_str!("../../assets/report.html");
const STYLE: &str = include_str!("../../assets/report.css");
const FIGURES: [&str; 4] = [
    include_str!("../../assets/figures/theme.js"),
    include_str!("../../assets/figures/plot.js"),
    include_str!("../../assets/figures/poles.js"),
    include_str!("../../assets/figures/report.js"),
];
const UPLOT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../../assets/uplot/LICENSE");

/// Most points of all time curves together; about 14 bytes each keep the file below 5 MB.
const ALL_POINTS: usize = 260_000;

/// Renders a report as one HTML file.
///
/// The text is complete: style, code and data are inside, nothing is fetched. Where the curves over time together hold
/// more points than a file of 5 MB takes, they are thinned further, again by minimum and maximum per bucket.
///
/// # Errors
/// [`Error::ReportData`] and [`Error::ReportTemplate`] where data or template cannot be written as text.
///
/// ```
/// use youla::report::{ReportData, html};
/// let page = html(&ReportData { title: "Gas bearing".into(), ..ReportData::default() })?;
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn html(data: &ReportData) -> Result<String> {
    let drawn = prepared_for_drawing(data);
    let json = serde_json::to_string(&drawn).map_err(|source| Error::ReportData { source })?;
    let page = context! {
        report => Serde(without_curves(data)),
        fits => Serde(tables::fit_rows(data)),
        modes => Serde(tables::mode_rows(data)),
        has => parts(data),
        style => safe(format!("{UPLOT_STYLE}\n{STYLE}")),
        library => safe(format!("/*!\nuPlot\n{UPLOT_LICENCE}*/\n{UPLOT}")),
        figures => safe(FIGURES.concat()),
        json => safe(json.replace('<', "\\u003c")),
    };
    environment()
        .and_then(|environment| environment.get_template("report.html")?.render(page))
        .map_err(|source| Error::ReportTemplate { source })
}

fn prepared_for_drawing(data: &ReportData) -> ReportData {
    let mut drawn = data.clone();
    let points = all_points(&drawn);
    if points > ALL_POINTS {
        thin(&mut drawn, super::trace::MAX_POINTS * ALL_POINTS / points);
    }
    let roles: Vec<_> = drawn.methods.iter().map(|method| (method.key.clone(), method.role)).collect();
    if let Some(response) = &mut drawn.frequency {
        phase::align(response, |key| roles.iter().find(|(k, _)| k == key).map_or(Role::Other, |(_, role)| *role));
    }
    drawn
}

fn all_points(data: &ReportData) -> usize {
    let signals = data.experiments.iter().flat_map(|experiment| &experiment.signals).map(|signal| &signal.trace);
    let outputs = data.verification.iter().flat_map(|record| &record.outputs);
    let predictions = outputs.clone().flat_map(|output| &output.predictions);
    let curves = signals
        .chain(outputs.map(|output| &output.measured))
        .chain(predictions.flat_map(|prediction| [&prediction.predicted, &prediction.residual]));
    curves.map(|trace| trace.values.len()).sum()
}

fn thin(data: &mut ReportData, points: usize) {
    for experiment in &mut data.experiments {
        experiment.clock.fit_into(points);
        for signal in &mut experiment.signals {
            signal.trace = signal.trace.thinned(&experiment.clock);
        }
    }
    for record in &mut data.verification {
        record.clock.fit_into(points);
        for output in &mut record.outputs {
            output.measured = output.measured.thinned(&record.clock);
            for prediction in &mut output.predictions {
                prediction.predicted = prediction.predicted.thinned(&record.clock);
                prediction.residual = prediction.residual.thinned(&record.clock);
            }
        }
    }
}

/// What the template reads: all but the curves, which only the figures need.
fn without_curves(data: &ReportData) -> ReportData {
    ReportData { experiments: Vec::new(), verification: Vec::new(), frequency: None, ..data.clone() }
}

fn parts(data: &ReportData) -> Value {
    use super::data::SignalKind::{Alpha, Beta};
    let mut kinds = data.experiments.iter().flat_map(|experiment| &experiment.signals).map(|signal| signal.kind);
    context! {
        data => kinds.clone().any(|kind| !matches!(kind, Alpha | Beta)),
        signals => kinds.any(|kind| matches!(kind, Alpha | Beta)),
        verification => !data.verification.is_empty(),
        frequency => data.frequency.is_some(),
        indirect => data.frequency.as_ref().is_some_and(|response| !response.indirect.is_empty()),
    }
}

fn safe(text: String) -> Value {
    Value::from_safe_string(text)
}

fn environment() -> Result<Environment<'static>, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("fixed", |value: f64, digits: usize| printed(format!("{value:.digits$}")));
    environment.add_filter("scientific", |value: f64| printed(format!("{value:.1e}")));
    environment.add_filter("significant", |value: f64| printed(significant(value)));
    environment.add_template("report.html", TEMPLATE)?;
    Ok(environment)
}

/// Four significant digits without an exponent.
fn significant(value: f64) -> String {
    let places = super::numbers::decimals(value, 4).clamp(0, 12) as usize;
    format!("{value:.places$}")
}

/// Numbers in tables have a minus sign as wide as a digit.
fn printed(number: String) -> String {
    number.replace('-', "\u{2212}")
}
