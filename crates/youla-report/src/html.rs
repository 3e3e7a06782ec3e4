//! A run as a page.

use minijinja::value::Serde;
use minijinja::{Value, context};

use super::data::{ReportData, Role};
use super::page::{self, ALL_POINTS};
use super::svg::{Print, svg_for};
use super::{phase, tables};
use crate::Result;

const TEMPLATE: &str = include_str!("../assets/report.html");
const FIGURES: [&str; 5] = [
    include_str!("../assets/figures/plane.js"),
    include_str!("../assets/figures/poles.js"),
    include_str!("../assets/figures/nyquist.js"),
    include_str!("../assets/figures/stabilisation.js"),
    include_str!("../assets/figures/report.js"),
];

/// Renders a report as one HTML file.
///
/// The text is complete: style, code and data are inside, nothing is fetched. Where the curves over time together hold
/// more points than a file of 5 MB takes, they are thinned further, again by minimum and maximum per bucket.
///
/// # Errors
/// [`youla::Error::ReportData`] and [`youla::Error::ReportTemplate`] where data or template cannot be written as text.
///
/// ```
/// use youla_report::{ReportData, html};
/// let page = html(&ReportData { title: "Gas bearing".into(), ..ReportData::default() })?;
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn html(data: &ReportData) -> Result<String> {
    // The page allows no fonts but those of the reader's system.
    let in_page = Print { embed_font: false, ..Print::default() };
    let content = context! {
        report => Serde(without_curves(data)),
        fits => Serde(tables::fit_rows(data)),
        modes => Serde(tables::mode_rows(data)),
        has => parts(data),
        redesign_svg => data.redesign.as_ref().map(|new| svg_for(&new.figure, &new.loops, &in_page)).transpose()?,
    };
    page::render(TEMPLATE, content, &FIGURES, &prepared_for_drawing(data))
}

fn prepared_for_drawing(data: &ReportData) -> ReportData {
    let mut drawn = data.clone();
    // Drawn as SVG.
    drawn.redesign = None;
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
