//! Figures 6 to 10, and the prediction-error method from several starts.

use super::figures::{axis, fit_axis, line, logarithmic, points, ranged};
use super::words::{AXES, both, short};
use crate::study::ExcitedChannel;
use crate::study::{ExperimentModel, Paper, Start, StudyExperiment, StudyMethod};
use std::f64::consts::TAU;
use youla::{Mat, MatRef};
use youla_report::figure::{Axis, Content, Curve, Drawn, Figure, MEASURED, Panel};
use youla_report::numbers::{decimals, rounded};

/// First view of a record, s.
const VIEW: f64 = 0.2;

/// First view of Figure 10 and its record, s.
const ZOOM: f64 = 0.03;
const ZOOM_RECORD: f64 = 0.2;

/// Models that the figures show.
const SHOWN: [StudyMethod; 3] = [StudyMethod::Nominal, StudyMethod::Pem, StudyMethod::Hansen];

/// The model of a method.
pub(super) fn of(experiment: &StudyExperiment, method: StudyMethod) -> Option<&ExperimentModel> {
    experiment.models.iter().find(|m| m.method == method)
}

/// Its fit, NaN where there is none.
pub(super) fn fit_of(experiment: &StudyExperiment, method: StudyMethod) -> [f64; 2] {
    of(experiment, method).map_or([f64::NAN; 2], |m| m.fit)
}

/// Figures 6, 7 and 9: measured and predicted displacement.
pub(super) fn verification(experiment: &StudyExperiment) -> Figure {
    let rows = 0..used(experiment);
    Figure {
        key: format!("figure-{}", experiment.case.figure),
        title: format!("Figure {}", experiment.case.figure),
        caption: format!(
            "Verification record of {} and what the models predict; {}.",
            experiment.case.title,
            fits(experiment)
        ),
        panels: displacement(experiment, rows, first_view(experiment)),
        ..Figure::default()
    }
}

/// Figure 10: the same closely, around a switch of the excitation in the middle of the record.
pub(super) fn zoom(experiment: &StudyExperiment) -> Figure {
    let (ts, samples, settle) = (experiment.verification.time.ts(), used(experiment), experiment.settle);
    let switch =
        switch(experiment.verification.alpha.as_ref(), settle + samples / 2).map_or(samples / 2, |k| k - settle);
    let half = (0.5 * ZOOM_RECORD / ts) as usize;
    let start = rounded((switch + settle) as f64 * ts - ZOOM / 3.0, 6);
    Figure {
        key: "figure-10".into(),
        title: "Figure 10".into(),
        caption: format!(
            "Part of Figure {} around a switch of the excitation: measured displacement and what the models predict.",
            experiment.case.figure
        ),
        panels: displacement(
            experiment,
            switch.saturating_sub(half)..(switch + half).min(samples),
            [start, rounded(start + ZOOM, 6)],
        ),
        ..Figure::default()
    }
}

/// Figure 8: beta of the verification record, measured and predicted from alpha.
pub(super) fn beta(experiment: &StudyExperiment, [measured, predicted]: &[Mat<f64>; 2]) -> Figure {
    let rows = 0..measured.nrows();
    let time = || times(experiment, rows.clone());
    let panel = |i: usize| {
        let curves = vec![
            measured_curve(time(), column(measured, i, rows.clone())),
            line(StudyMethod::Hansen, "", time(), column(predicted, i, rows.clone())),
        ];
        time_panel(i, "beta", first_view(experiment), curves)
    };
    Figure {
        key: "figure-8".into(),
        title: "Figure 8".into(),
        caption: format!(
            "Innovation beta of the verification record of {} as measured, and what S makes of alpha alone.",
            experiment.case.title
        ),
        panels: (0..2).map(panel).collect(),
        ..Figure::default()
    }
}

/// Where the prediction-error method ends over where it starts.
pub(super) fn starts(experiment: &StudyExperiment) -> Figure {
    let runs = &experiment.starts;
    let lowest = runs.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min);
    let over =
        |value: &dyn Fn(&Start) -> f64| -> (Vec<f64>, Vec<f64>) { runs.iter().map(|s| (s.factor, value(s))).unzip() };
    let ends = over(&|_| 0.0).0;
    let span = ends.iter().fold([f64::INFINITY, 0.0], |[l, h], f| [f64::min(l, *f), f64::max(h, *f)]);
    let fit_panel = |i: usize| {
        let (x, y) = over(&|s| s.fit[i]);
        let level = line(StudyMethod::Hansen, "", span.to_vec(), vec![fit_of(experiment, StudyMethod::Hansen)[i]; 2]);
        let curves = vec![points(StudyMethod::Pem, "per start", x, y), level];
        let (x, y, content) = (factor_axis(), fit_axis(AXES[i]), Content::Curves(curves));
        Panel { title: AXES[i].into(), x, y, content, ..Panel::default() }
    };
    let (x, y) = over(&|s| s.cost / lowest);
    let criterion = Panel {
        title: "criterion where the search ended".into(),
        x: factor_axis(),
        y: logarithmic("over the lowest", ""),
        content: Content::Curves(vec![points(StudyMethod::Pem, "per start", x, y)]),
        ..Panel::default()
    };
    Figure {
        key: "pem-starts".into(),
        title: "PEM from several starts".into(),
        caption: format!(
            "{}: fit of PEM on the verification record, and the criterion where its search ended, over the factor on A of \
             the nominal model at which it started; 1 is the start at the nominal model itself, and the line is the fit of \
             the Hansen scheme.",
            experiment.case.title
        ),
        panels: (0..2).map(fit_panel).chain([criterion]).collect(),
        ..Figure::default()
    }
}

fn factor_axis() -> Axis {
    logarithmic("factor on A at the start", "")
}

/// Samples of the verification record from `settle` on.
fn used(experiment: &StudyExperiment) -> usize {
    experiment.verification.y.nrows().saturating_sub(experiment.settle)
}

fn first_view(experiment: &StudyExperiment) -> [f64; 2] {
    let start = experiment.settle as f64 * experiment.verification.time.ts();
    [rounded(start, 6), rounded(start + VIEW, 6)]
}

/// The fits of a caption.
fn fits(experiment: &StudyExperiment) -> String {
    let fit = |m: &StudyMethod| {
        let note = match of(experiment, *m).map(|model| &model.model) {
            Some(Err(_)) | None => " (no model)",
            Some(Ok(_)) => "",
        };
        format!("{} {}{note}", m.label(), both(fit_of(experiment, *m)))
    };
    format!("fits horizontal and vertical: {}", SHOWN.iter().map(fit).collect::<Vec<_>>().join(", "))
}

fn displacement(experiment: &StudyExperiment, rows: std::ops::Range<usize>, view: [f64; 2]) -> Vec<Panel> {
    let panel = |i: usize| {
        let from = experiment.settle;
        let y = column(&experiment.verification.y, i, rows.start + from..rows.end + from);
        let models = SHOWN.into_iter().filter_map(|m| {
            let predicted = &of(experiment, m)?.predicted;
            let complete = predicted.nrows() >= rows.end;
            complete.then(|| line(m, "", times(experiment, rows.clone()), column(predicted, i, rows.clone())))
        });
        let curves = std::iter::once(measured_curve(times(experiment, rows.clone()), y)).chain(models).collect();
        time_panel(i, "displacement", view, curves)
    };
    (0..2).map(panel).collect()
}

fn measured_curve(x: Vec<f64>, y: Vec<f64>) -> Curve {
    Curve { method: MEASURED.into(), x, y, ..Curve::default() }
}

fn time_panel(i: usize, label: &str, view: [f64; 2], curves: Vec<Curve>) -> Panel {
    Panel {
        title: AXES[i].into(),
        x: ranged("time", "s", view),
        y: axis(&format!("{label} {}", AXES[i]), "um"),
        content: Content::Curves(curves),
        ..Panel::default()
    }
}

/// Times of rows counted from `settle`, to a nanosecond.
fn times(experiment: &StudyExperiment, rows: std::ops::Range<usize>) -> Vec<f64> {
    let ts = experiment.verification.time.ts();
    rows.map(|k| rounded((k + experiment.settle) as f64 * ts, 9)).collect()
}

/// One channel, to 1e-5 of its greatest value: the page holds many samples.
fn column(signal: &Mat<f64>, i: usize, rows: std::ops::Range<usize>) -> Vec<f64> {
    let places = decimals(signal.col(i).norm_max(), 5);
    rows.map(|k| rounded(signal[(k, i)], places)).collect()
}

/// The first row from `from` on in which the excitation differs from the row before.
fn switch(alpha: MatRef<'_, f64>, from: usize) -> Option<usize> {
    (from.max(1)..alpha.nrows()).find(|k| (0..2).any(|i| alpha[(*k, i)] != alpha[(k - 1, i)]))
}

/// How the starts of the prediction-error method ended, in sentences.
pub(super) fn starts_in_words(experiment: &StudyExperiment, tried: usize) -> String {
    let runs = &experiment.starts;
    let lowest = runs.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min);
    let converged: Vec<f64> = runs.iter().filter(|s| s.cost <= 1.01 * lowest).map(|s| s.factor).collect();
    let ends = converged.iter().fold([f64::INFINITY, 0.0], |[l, h], f| [f64::min(l, *f), f64::max(h, *f)]);
    let mut text = format!(
        "Of {tried} starts {} end within 1 % of the lowest criterion (factors on A from {} to {})",
        converged.len(),
        short(ends[0], 3),
        short(ends[1], 3)
    );
    let published = experiment.case.published[1];
    let distance = |s: &Start| (0..2).map(|i| (s.fit[i] - published[i]).powi(2)).sum::<f64>();
    let elsewhere = runs.iter().filter(|s| s.cost > 1.01 * lowest);
    match elsewhere.min_by(|a, b| distance(a).total_cmp(&distance(b))) {
        Some(near) => text.push_str(&format!(
            "; the others stop in a local minimum or on the way, and the one of them nearest to the paper's {} starts at the \
             factor {} and ends at {} with a criterion of {} times the lowest.",
            both(published),
            short(near.factor, 3),
            both(near.fit),
            short(near.cost / lowest, 3)
        )),
        None => text.push_str("; none ends elsewhere."),
    }
    text
}

/// Power spectral density of alpha in the first experiment, both axes.
pub(super) fn excitation(paper: &Paper) -> Figure {
    let report = paper.experiments.list.first().map(|e| &e.excitation);
    let hz: Vec<f64> = report.map_or_else(Vec::new, |r| r.omega.iter().map(|w| w / TAU).collect());
    let channels = report.map_or(&[][..], |r| &r.channels);
    // Zero frequency has no place on a logarithmic axis.
    let curve = |(channel, name): (&ExcitedChannel, &&str)| Curve {
        method: MEASURED.into(),
        note: format!("alpha, {name}"),
        drawn: Drawn::Line,
        x: hz.iter().skip(1).copied().collect(),
        y: channel.density.iter().skip(1).copied().collect(),
        ..Curve::default()
    };
    Figure {
        key: "excitation-spectrum".into(),
        title: "Spectrum of the excitation".into(),
        caption: "Power spectral density of alpha in the estimation record of the first experiment; the others are \
                  drawn from the same distribution."
            .into(),
        panels: vec![Panel {
            title: String::new(),
            x: logarithmic("frequency", "Hz"),
            y: logarithmic("density", "V^2/Hz"),
            content: Content::Curves(channels.iter().zip(&AXES).map(curve).collect()),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}
