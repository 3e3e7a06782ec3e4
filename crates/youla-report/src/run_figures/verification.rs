//! Measured against predicted, and the residuals beneath.

use super::choice::Chosen;
use super::time::{detail, over_time, statement};
use super::{RunFigure, axis, choice, key, span};
use crate::data::{DrawnPrediction, Verification, VerifiedOutput};
use crate::figure::{Axis, Content, Curve, Figure, MEASURED, Panel};
use crate::with_minus;
use youla::signal::Channel;

/// One per record and output.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    let records = chosen.data.verification.iter();
    records.flat_map(|record| record.outputs.iter().map(|output| figure(chosen, record, output))).collect()
}

fn figure(chosen: &Chosen, record: &Verification, output: &VerifiedOutput) -> Figure {
    let channel = channel(&chosen.data.outputs, output.output);
    let x = Axis { range: detail(&record.clock), ..axis("Time", "s") };
    let several = [chosen.several_verifications, chosen.data.outputs.len() > 1];
    Figure {
        key: key(RunFigure::Verification, &[(&record.record, several[0]), (&channel.name, several[1])]),
        title: format!("{} of {}, measured and predicted", channel.name, record.record),
        caption: format!(
            "{} of {}, {}, with the fits; beneath, measured less predicted. {}",
            channel.name,
            record.record,
            record.prediction,
            statement(&record.clock)
        ),
        choice: choice(&[("Record", &record.record), ("Output", &channel.name)]),
        panels: vec![measured(chosen, record, output, &channel, &x), residuals(chosen, record, output, &channel, &x)],
        ..Figure::default()
    }
}

/// The axis follows what was measured.
fn measured(chosen: &Chosen, record: &Verification, output: &VerifiedOutput, channel: &Channel, x: &Axis) -> Panel {
    let range = span(output.measured.values.iter().copied()).map(|[low, high]| {
        let room = if high > low { high - low } else { 1.0 };
        [low - 0.3 * room, high + 0.3 * room]
    });
    let predicted = |prediction: &DrawnPrediction| Curve {
        note: fit(chosen, record, output.output, &prediction.method),
        ..over_time(&prediction.method, &prediction.predicted, &record.clock)
    };
    let curves = std::iter::once(over_time(MEASURED, &output.measured, &record.clock));
    Panel {
        x: x.clone(),
        y: Axis { range, ..axis(&channel.name, &channel.unit) },
        content: Content::Curves(curves.chain(output.predictions.iter().map(predicted)).collect()),
        ..Panel::default()
    }
}

/// The axis reaches at most as far as what was measured does.
fn residuals(chosen: &Chosen, record: &Verification, output: &VerifiedOutput, channel: &Channel, x: &Axis) -> Panel {
    let width = span(output.measured.values.iter().copied()).map_or(1.0, |[low, high]| high - low);
    let all = output.predictions.iter().flat_map(|prediction| &prediction.residual.values).copied();
    let largest = span(all).map_or(0.0, |[low, high]| low.abs().max(high.abs()));
    let reach = Some(0.6 * width).filter(|reach| *reach > 0.0 && *reach < largest);
    let mut curves: Vec<(f64, Curve)> = output
        .predictions
        .iter()
        .map(|prediction| {
            let swing = span(prediction.residual.values.iter().copied()).map_or(0.0, |[low, high]| high - low);
            let note = fit(chosen, record, output.output, &prediction.method);
            (swing, Curve { note, ..over_time(&prediction.method, &prediction.residual, &record.clock) })
        })
        .collect();
    // The smallest ones on top.
    curves.sort_by(|a, b| b.0.total_cmp(&a.0));
    Panel {
        x: x.clone(),
        y: Axis { range: reach.map(|reach| [-reach, reach]), ..axis("Residual", &channel.unit) },
        content: Content::Curves(curves.into_iter().map(|(_, curve)| curve).collect()),
        height: Some(0.6),
        ..Panel::default()
    }
}

fn fit(chosen: &Chosen, record: &Verification, output: usize, method: &str) -> String {
    let same = |fit: &&crate::data::Fit| fit.record == record.record && fit.output == output && fit.method == method;
    match chosen.data.fits.iter().find(same).map(|fit| fit.fit) {
        None => String::new(),
        Some(None) => "diverged".into(),
        Some(Some(fit)) => with_minus(format!("{fit:.1} %")),
    }
}

/// A channel by its place, named by its number where the run does not name it.
pub(super) fn channel(channels: &[Channel], place: usize) -> Channel {
    channels.get(place).cloned().unwrap_or_else(|| Channel::new(format!("{}", place + 1), ""))
}
