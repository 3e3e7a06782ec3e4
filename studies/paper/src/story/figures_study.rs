//! The controllers of the study, and Figures 4 and 5.

use super::figures::{axis, fit_axis, line, logarithmic, points, ranged};
use super::words::AXES;
use crate::study::{Paper, RowStatus, StudyMethod, StudyRow, deciles, quantile};
use youla_report::figure::{Axis, Content, Curve, Figure, Layout, Panel, Sample};

/// Command weight and both peaks over theta.
pub(super) fn controllers(paper: &Paper) -> Figure {
    let rows: Vec<&StudyRow> = of(paper, StudyMethod::Nominal);
    let theta = || rows.iter().map(|r| r.theta).collect::<Vec<_>>();
    let cloud = |value: &dyn Fn(&StudyRow) -> f64| {
        let found = |r: &&StudyRow| if r.status == RowStatus::NoController { f64::NAN } else { value(r) };
        points(StudyMethod::Nominal, "", theta(), rows.iter().map(found).collect())
    };
    let limit = paper.settings.controller.peak_sensitivity;
    let bound = || line(StudyMethod::Nominal, "limit", paper.settings.study.theta.to_vec(), vec![limit; 2]);
    let peak = |title: &str, value: &dyn Fn(&StudyRow) -> f64| {
        panel(paper, title, ranged("peak", "", [1.0, limit + 0.2]), vec![cloud(value), bound()])
    };
    Figure {
        key: "controllers".into(),
        title: "Controllers of the study".into(),
        caption: format!(
            "Weight of the command that was chosen for each nominal model (small is strong feedback), and the peaks of \
             the output sensitivity that its controller reaches with the nominal model and with the true plant; the \
             line is the limit of {limit}."
        ),
        panels: vec![
            panel(paper, "weight of the command", logarithmic("weight", "1/V^2"), vec![cloud(&|r| r.command_weight)]),
            peak("peak sensitivity with the nominal model", &|r| r.peak_nominal),
            peak("peak sensitivity with the true plant", &|r| r.peak_plant),
        ],
        ..Figure::default()
    }
}

/// Fit over theta for PEM and Hansen.
pub(super) fn figure_4(paper: &Paper) -> Figure {
    let panels = AXES.iter().enumerate().map(|(i, name)| {
        let curves = [StudyMethod::Pem, StudyMethod::Hansen, StudyMethod::HansenPem, StudyMethod::Auto]
            .into_iter()
            .flat_map(|m| [cloud(paper, m, i), medians(paper, m, i)]);
        panel(paper, name, fit_axis(name), curves.filter(|c| !c.x.is_empty()).collect())
    });
    Figure {
        key: "figure-4".into(),
        title: "Figure 4".into(),
        caption:
            "Fit (26) on the record without noise over theta for PEM, the Hansen scheme and PEM started at its result, \
                  one point per nominal model, with the medians of the tenths of theta as lines; points at the lower edge lie below it, and \
                  those of their own shape have no model."
                .into(),
        panels: panels.collect(),
        ..Figure::default()
    }
}

/// Boxes of the fit, direct identification against Hansen.
pub(super) fn figure_5(paper: &Paper) -> Figure {
    let values = |m: StudyMethod, i: usize| of(paper, m).iter().map(|r| r.fit[i]).collect::<Vec<_>>();
    let compared = [StudyMethod::Direct, StudyMethod::Hansen, StudyMethod::HansenPem, StudyMethod::Auto];
    let lowest = compared.iter().flat_map(|m| [0, 1].map(|i| whisker(&values(*m, i)))).fold(90.0, f64::min);
    let view = [((lowest / 10.0).floor() * 10.0).clamp(-20.0, 90.0), 100.0];
    let panels = AXES.iter().enumerate().map(|(i, name)| {
        let sample = |m: StudyMethod| Sample { method: m.key().into(), note: String::new(), values: values(m, i) };
        let samples = compared.into_iter().map(sample).filter(|s| !s.values.is_empty()).collect();
        Panel {
            title: (*name).into(),
            x: Axis::default(),
            y: ranged(&format!("fit {name}"), "%", view),
            content: Content::Boxes(samples),
            ..Panel::default()
        }
    });
    Figure {
        key: "figure-5".into(),
        title: "Figure 5".into(),
        caption: "Fit (26) on the record without noise of all nominal models, direct subspace identification against \
                  the Hansen scheme, and PEM started at its result; loops without a model count as the lowest, points at the lower edge lie below it."
            .into(),
        layout: Layout::Beside,
        panels: panels.collect(),
        ..Figure::default()
    }
}

/// The rows of a method by rising theta.
fn of(paper: &Paper, method: StudyMethod) -> Vec<&StudyRow> {
    let mut rows: Vec<&StudyRow> = paper.study.iter().filter(|r| r.method == method).collect();
    rows.sort_by(|a, b| a.theta.total_cmp(&b.theta));
    rows
}

fn cloud(paper: &Paper, method: StudyMethod, i: usize) -> Curve {
    let rows = of(paper, method);
    points(method, "", rows.iter().map(|r| r.theta).collect(), rows.iter().map(|r| r.fit[i]).collect())
}

/// At the middle of each tenth that has loops; a gap where half of them or more gave no model.
fn medians(paper: &Paper, method: StudyMethod, i: usize) -> Curve {
    let tenths = deciles(&paper.study, method, paper.settings.study.theta);
    let filled = || tenths.iter().filter(|d| d.count > 0);
    let finite = |v: f64| if v.is_finite() { v } else { f64::NAN };
    let middle = |d: &crate::study::Decile| 0.5 * (d.theta[0] + d.theta[1]);
    line(method, "median", filled().map(middle).collect(), filled().map(|d| finite(d.median[i])).collect())
}

fn panel(paper: &Paper, title: &str, y: Axis, curves: Vec<Curve>) -> Panel {
    let [low, high] = paper.settings.study.theta;
    let x = if high > low { ranged("theta", "", [low, high]) } else { axis("theta", "") };
    Panel { title: title.into(), x, y, content: Content::Curves(curves), ..Panel::default() }
}

/// Where the lower whisker of a box may end, 100 for no values.
fn whisker(values: &[f64]) -> f64 {
    let (low, high) = (quantile(values, 0.25), quantile(values, 0.75));
    let end = low - 1.5 * (high - low);
    if end.is_nan() { 100.0 } else { end }
}
