//! Correlations of the residuals over lags, all models in one panel, with the widest band of noise.

use super::choice::Chosen;
use super::verification::channel;
use super::{RunFigure, axis, choice, key};
use crate::data::{Correlation, DrawnResidualTest};
use crate::figure::{Area, Content, Curve, Figure, Layout, Panel};

/// One per record and output.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    let Some(residuals) = &chosen.data.residuals else { return Vec::new() };
    let mut records: Vec<&str> = residuals.tests.iter().map(|test| test.record.as_str()).collect();
    records.dedup();
    let mut figures = Vec::new();
    for (k, record) in records.iter().enumerate().filter(|(k, record)| !records[..*k].contains(record)) {
        let tests: Vec<&DrawnResidualTest> = residuals.tests.iter().filter(|test| test.record == *record).collect();
        let outputs = tests.iter().map(|test| test.auto.len()).max().unwrap_or(0);
        let wanted = (0..outputs).filter(|output| chosen.output.is_none_or(|only| only == *output));
        let several = k > 0 || records.len() > 1 || chosen.several_verifications;
        figures.extend(wanted.map(|output| figure(chosen, record, &tests, output, (several, residuals.external))));
    }
    figures
}

fn figure(
    chosen: &Chosen,
    record: &str,
    tests: &[&DrawnResidualTest],
    output: usize,
    (several, external): (bool, bool),
) -> Figure {
    let name = channel(&chosen.data.outputs, output).name;
    let excitations: &[String] = tests.first().map_or(&[], |test| &test.excitations);
    let cross = excitations.iter().enumerate().map(|(input, excitation)| {
        panel(format!("With {excitation}"), tests, |test| test.cross.get(output * excitations.len() + input), true)
    });
    let auto = panel("With itself".into(), tests, |test| test.auto.get(output), false);
    let judged = if external {
        "Positive lags judge the model; negative ones only show what is fed back."
    } else {
        "No excitation from outside is known: the input holds fed-back noise, and judges nothing."
    };
    Figure {
        key: key(RunFigure::Residuals, &[(record, several), (&name, chosen.data.outputs.len() > 1)]),
        title: format!("Correlations of the residual of {name} on {record}"),
        caption: format!(
            "Correlation of the residual of {name} on {record} with what excites the loop, and with itself. Filled: the widest \
             band of 99 % of all models for residuals that are noise. {judged}"
        ),
        layout: Layout::Beside,
        choice: choice(&[("Record", record), ("Output", &name)]),
        panels: cross.chain([auto]).filter(has_curves).collect(),
    }
}

fn has_curves(panel: &Panel) -> bool {
    matches!(&panel.content, Content::Curves(curves) if !curves.is_empty())
}

fn panel<'a>(
    title: String,
    tests: &[&'a DrawnResidualTest],
    of: impl Fn(&'a DrawnResidualTest) -> Option<&'a Correlation>,
    around_zero: bool,
) -> Panel {
    let all: Vec<(&str, &Correlation)> = tests
        .iter()
        .filter_map(|test| Some((test.method.as_str(), of(test)?)))
        .filter(|(_, found)| !found.values.is_empty())
        .collect();
    let lags = |found: &Correlation| -> Vec<f64> {
        let first = if around_zero { -((found.values.len() as f64 - 1.0) / 2.0) } else { 0.0 };
        (0..found.values.len()).map(|k| first + k as f64).collect()
    };
    let band = all.iter().map(|(_, found)| found.band).fold(0.0, f64::max);
    let longest = all.iter().map(|(_, found)| lags(found)).max_by_key(Vec::len).unwrap_or_default();
    let ends: Vec<f64> = longest.first().into_iter().chain(longest.last()).copied().collect();
    let curve = |(method, found): &(&str, &Correlation)| Curve {
        method: (*method).to_owned(),
        x: lags(found),
        y: found.values.clone(),
        ..Curve::default()
    };
    Panel {
        title,
        x: axis("Lag", "samples"),
        y: axis("Correlation", ""),
        content: Content::Curves(all.iter().map(curve).collect()),
        regions: vec![Area {
            method: "band of noise".into(),
            note: "99 %".into(),
            low: vec![-band; ends.len()],
            high: vec![band; ends.len()],
            x: ends,
        }],
        ..Panel::default()
    }
}
