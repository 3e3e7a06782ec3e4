//! The picture of an excitation: alpha over time, its energy over frequency, and what the nominal loop does under it.

use crate::excite::RunExcitation;
use youla::signal::Channel;
use youla_report::data::{Method, Role};
use youla_report::figure::{Axis, Content, Curve, Drawn, Figure, Panel};

/// Range of the energy density, dB.
const DECIBELS: [f64; 2] = [-60.0, 20.0];

/// The picture and the styles of its curves.
pub(crate) fn figure(found: &RunExcitation) -> (Figure, Vec<Method>) {
    let excited = &found.excited;
    let mut panels = vec![over_time(found), over_frequency(found)];
    let signals = [(&found.inputs, &excited.u), (&found.outputs, &excited.y)];
    let peaks = &mut excited.summary.predicted.iter();
    for (channels, values) in signals {
        for (j, channel) in channels.iter().enumerate() {
            let limit = peaks.next().and_then(|p| p.limit);
            panels.push(predicted(found, channel, values.col(j).iter().copied().collect(), limit));
        }
    }
    let figure = Figure {
        key: "excite".into(),
        title: format!("Excitation of {}", found.name),
        caption: "The sequence, its energy density over its mean in the band, and what the nominal loop does under it."
            .into(),
        panels,
        ..Figure::default()
    };
    (figure, curves(found))
}

/// The curves of the picture, in the order of the legend.
fn curves(found: &RunExcitation) -> Vec<Method> {
    let columns = found.columns.iter().map(|c| Method::new(&c.name, &c.name, Role::Other));
    let fixed = [
        Method::new("predicted", "predicted by the nominal loop", Role::Hansen),
        Method::new("limit", "limit", Role::Direct),
        Method::new("notch", "to be kept free", Role::Nominal),
    ];
    columns.chain(fixed).collect()
}

fn time_axis() -> Axis {
    Axis { label: "time".into(), unit: "s".into(), ..Axis::default() }
}

fn line(method: &str, x: Vec<f64>, y: Vec<f64>) -> Curve {
    Curve { method: method.into(), drawn: Drawn::Line, x, y, ..Curve::default() }
}

fn over_time(found: &RunExcitation) -> Panel {
    let (alpha, ts) = (&found.excited.alpha, found.excited.time.ts());
    let times: Vec<f64> = (0..alpha.nrows()).map(|k| k as f64 * ts).collect();
    let one = |(j, c): (usize, &Channel)| line(&c.name, times.clone(), alpha.col(j).iter().copied().collect());
    Panel {
        title: "excitation".into(),
        x: time_axis(),
        y: Axis { label: "α".into(), unit: common_unit(&found.columns), ..Axis::default() },
        content: Content::Curves(found.columns.iter().enumerate().map(one).collect()),
        ..Panel::default()
    }
}

/// The unit that all channels have, if there is one.
fn common_unit(channels: &[Channel]) -> String {
    match channels {
        [first, rest @ ..] if rest.iter().all(|c| c.unit == first.unit) => first.unit.clone(),
        _ => String::new(),
    }
}

fn over_frequency(found: &RunExcitation) -> Panel {
    let (spectrum, summary) = (&found.excited.spectrum, &found.excited.summary);
    let range = [summary.band[0] / 3.0, (3.0 * summary.band[1]).min(0.5 / summary.sample_time)];
    let shown: Vec<usize> =
        (0..spectrum.hz.len()).filter(|k| (range[0]..=range[1]).contains(&spectrum.hz[*k])).collect();
    let hz: Vec<f64> = shown.iter().map(|k| spectrum.hz[*k]).collect();
    let value = |d: f64| if d.is_nan() { f64::NAN } else { d.max(DECIBELS[0]) };
    let columns = found.columns.iter().zip(&spectrum.decibels);
    let mut drawn: Vec<Curve> =
        columns.map(|(c, d)| line(&c.name, hz.clone(), shown.iter().map(|k| value(d[*k])).collect())).collect();
    // The edges of all bands as one line with gaps.
    let edges: Vec<f64> = summary.notches.iter().flat_map(|n| n.band).flat_map(|hz| [hz, hz, hz]).collect();
    if !edges.is_empty() {
        let y = (0..edges.len()).map(|k| [DECIBELS[0], DECIBELS[1], f64::NAN][k % 3]).collect();
        drawn.push(line("notch", edges, y));
    }
    Panel {
        title: "energy density".into(),
        x: Axis { label: "frequency".into(), unit: "Hz".into(), range: Some(range), log: true, also: None },
        y: Axis {
            label: "over its mean in the band".into(),
            unit: "dB".into(),
            range: Some(DECIBELS),
            ..Axis::default()
        },
        content: Content::Curves(drawn),
        ..Panel::default()
    }
}

fn predicted(found: &RunExcitation, channel: &Channel, values: Vec<f64>, limit: Option<f64>) -> Panel {
    let ts = found.excited.time.ts();
    let times: Vec<f64> = (0..values.len()).map(|k| k as f64 * ts).collect();
    let end = times.last().copied().unwrap_or(0.0);
    let mut drawn = vec![line("predicted", times, values)];
    if let Some(limit) = limit {
        // There and back, with a gap between, is one entry of the legend.
        drawn.push(line("limit", vec![0.0, end, end, end], vec![limit, limit, f64::NAN, f64::NAN]));
        drawn.push(line("limit", vec![0.0, end], vec![-limit, -limit]));
    }
    Panel {
        title: channel.name.clone(),
        x: time_axis(),
        y: Axis { label: channel.name.clone(), unit: channel.unit.clone(), ..Axis::default() },
        content: Content::Curves(drawn),
        ..Panel::default()
    }
}
