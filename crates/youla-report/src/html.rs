//! A run as a page.

use std::collections::BTreeMap;

use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;

use super::data::{DrawnMethod, LoopMargins, MethodRole, ReportData};
use super::drawings::drawings;
use super::figure::Figure;
use super::run_figures::{FigureChoice, RunFigure, run_drawings};
use super::tables::ShownMode;
use super::{numbers, page, tables};
use crate::Result;

const TEMPLATE: &str = include_str!("../assets/report.html");

/// Renders a report as one HTML file.
///
/// The text is complete: style, code and data are inside, nothing is fetched. Where the curves over time together hold
/// more points than a file of 5 MB takes, they are thinned further, again by minimum and maximum per bucket.
///
/// # Errors
/// [`crate::Error::ReportData`] and [`crate::Error::ReportTemplate`] where data or template cannot be written as text.
///
/// ```
/// use youla_report::{ReportData, html};
/// let page = html(&ReportData { title: "Gas bearing".into(), ..ReportData::default() })?;
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), youla_report::Error>(())
/// ```
pub fn html(data: &ReportData) -> Result<String> {
    let (figures, methods) = (placed(data)?, methods(data));
    let content = context! {
        subject => Serde(subject(data)),
        report => Serde(without_curves(data)),
        fits => Serde(tables::fit_rows(data)),
        modes => Serde(tables::mode_rows(data)),
        delay => Serde(numbers::delay_unit(data.sample_time)),
        has => figures.iter().map(|(place, _)| (place.as_str(), true)).collect::<BTreeMap<_, _>>(),
    };
    page::render(TEMPLATE, content, &drawings(&methods, &figures))
}

/// The model that the result is about: the recommended one, where there is none G(S).
#[derive(Serialize)]
struct Subject<'a> {
    method: &'a DrawnMethod,
    modes: Vec<ShownMode>,
    margins: Option<&'a LoopMargins>,
    largest_pole: Option<f64>,
}

/// Nothing for a comparison of runs, and where nothing is known of the model.
fn subject(data: &ReportData) -> Option<Subject<'_>> {
    let of = |role: MethodRole| data.methods.iter().find(|method| method.role == role);
    let method = of(MethodRole::Recommended).or_else(|| of(MethodRole::Hansen)).filter(|_| data.overview.is_empty())?;
    let certificate = data.certificates.iter().find(|one| one.method == method.key);
    let subject = Subject {
        method,
        modes: data.modes.iter().filter(|mode| mode.method == method.key).map(ShownMode::from).collect(),
        margins: data.margins.iter().find(|margins| margins.method == method.key),
        largest_pole: certificate.and_then(|one| one.worst_closed_loop_pole).map(|[re, im]| re.hypot(im)),
    };
    (!subject.modes.is_empty() || subject.margins.is_some()).then_some(subject)
}

/// The figures with the name of their place on the page.
fn placed(data: &ReportData) -> Result<Vec<(String, Figure)>> {
    let everything = FigureChoice::default();
    let mut placed = Vec::new();
    for kind in RunFigure::ALL {
        let place = match kind {
            RunFigure::Bode | RunFigure::Nyquist | RunFigure::Levels | RunFigure::SingularValues => "frequency",
            other => other.key(),
        };
        let drawings = run_drawings(data, kind, &everything)?;
        placed.extend(drawings.into_iter().map(|drawing| (place.to_owned(), drawing.figure)));
    }
    Ok(placed)
}

/// The methods of the run, and the loops that a new controller is compared with.
fn methods(data: &ReportData) -> Vec<DrawnMethod> {
    let loops = data.redesign.iter().flat_map(|new| &new.loops);
    let new = loops.filter(|one| data.methods.iter().all(|method| method.key != one.key));
    data.methods.iter().chain(new).cloned().collect()
}

/// What the template reads: all but the curves, which only the figures need.
fn without_curves(data: &ReportData) -> ReportData {
    ReportData { experiments: Vec::new(), verification: Vec::new(), frequency: None, ..data.clone() }
}
