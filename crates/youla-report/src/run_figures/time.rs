//! Signals over time.

use super::choice::Chosen;
use super::{RunFigure, axis, choice, key, span};
use crate::data::{DrawnExperiment, Signal, SignalKind};
use crate::figure::{Axis, Content, Curve, Figure, Panel};
use crate::trace::{Timeline, Trace};

/// Height of all panels together, in panels of the usual height.
const TALLEST: f64 = 6.0;

/// Inputs, outputs and excitations.
pub(super) fn data(chosen: &Chosen) -> Vec<Figure> {
    let kinds = [SignalKind::Input, SignalKind::Output, SignalKind::Excitation];
    figures(chosen, RunFigure::Data, &kinds, "Signals of the record from which the models were identified.")
}

/// Alpha and beta.
pub(super) fn signals(chosen: &Chosen) -> Vec<Figure> {
    let kinds = [SignalKind::Alpha, SignalKind::Beta];
    figures(chosen, RunFigure::Signals, &kinds, "The signals from which S was identified.")
}

fn figures(chosen: &Chosen, figure: RunFigure, kinds: &[SignalKind], sentence: &str) -> Vec<Figure> {
    let shown = |e: &DrawnExperiment| e.signals.iter().filter(|s| kinds.contains(&s.kind)).cloned().collect::<Vec<_>>();
    let drawn = |(experiment, signals): (&DrawnExperiment, Vec<Signal>)| {
        let (constant, signals): (Vec<Signal>, Vec<Signal>) = signals.into_iter().partition(is_constant);
        let height = Some((TALLEST / signals.len() as f64).min(1.0)).filter(|height| *height < 1.0);
        let panel = |signal: &Signal| Panel {
            x: Axis { range: detail(&experiment.clock), ..axis("Time", "s") },
            y: axis(greek(&signal.channel.name), &signal.channel.unit),
            content: Content::Curves(vec![curve(signal, &experiment.clock)]),
            height,
            ..Panel::default()
        };
        Figure {
            key: key(figure, &[(&experiment.name, chosen.several_experiments)]),
            title: format!("Signals of {}", experiment.name),
            caption: format!("{sentence} {}{}", statement(&experiment.clock), constants(&constant)),
            panels: signals.iter().map(panel).collect(),
            choice: choice(&[("Record", &experiment.name)]),
            ..Figure::default()
        }
    };
    let experiments = chosen.data.experiments.iter().map(|experiment| (experiment, shown(experiment)));
    experiments.filter(|(_, signals)| signals.iter().any(|signal| !is_constant(signal))).map(drawn).collect()
}

/// A channel with one value only.
fn is_constant(signal: &Signal) -> bool {
    span(signal.trace.points().map(|(_, value)| value)).is_none_or(|[low, high]| low == high)
}

/// The channels that are not drawn, in a sentence.
fn constants(signals: &[Signal]) -> String {
    let names: Vec<String> = signals.iter().map(|signal| greek(&signal.channel.name)).collect();
    if names.is_empty() { String::new() } else { format!(" Not drawn, because constant: {}.", names.join(", ")) }
}

/// Names of the signals of the scheme with their letters.
fn greek(name: &str) -> String {
    match name.split_once(' ') {
        Some(("alpha", channel)) => format!("α {channel}"),
        Some(("beta", channel)) => format!("β {channel}"),
        _ => name.to_owned(),
    }
}

fn curve(signal: &Signal, clock: &Timeline) -> Curve {
    let (method, note) = match signal.kind {
        SignalKind::Input => ("input", ""),
        SignalKind::Output => ("output", ""),
        SignalKind::Excitation => ("excitation", ""),
        SignalKind::Alpha => ("input", "of S"),
        SignalKind::Beta => ("output", "of S"),
    };
    Curve { note: note.into(), ..over_time(method, &signal.trace, clock) }
}

/// A trace as a curve over seconds.
pub(super) fn over_time(method: &str, trace: &Trace, clock: &Timeline) -> Curve {
    let (x, y) = trace.points().map(|(row, value)| (row as f64 * clock.sample_time, value)).unzip();
    Curve { method: method.into(), x, y, ..Curve::default() }
}

/// The window in which every sample is drawn, seconds.
pub(super) fn detail(clock: &Timeline) -> Option<[f64; 2]> {
    let ends = [clock.detail.start, clock.detail.end.saturating_sub(1)];
    (ends[1] > ends[0]).then(|| ends.map(|row| row as f64 * clock.sample_time))
}

/// How much of the record is drawn.
pub(super) fn statement(clock: &Timeline) -> String {
    let seconds = |s: f64| format!("{:.4}", s).trim_end_matches('0').trim_end_matches('.').to_owned();
    let length = format!("{} samples ({} s)", clock.samples, seconds(clock.samples as f64 * clock.sample_time));
    match (clock.bucket, detail(clock)) {
        (1, _) => format!("Every one of {length} is drawn."),
        (bucket, None) => format!("{length}, drawn by minimum and maximum of every {bucket} samples."),
        (bucket, Some([start, end])) => format!(
            "{length}, drawn by minimum and maximum of every {bucket} samples; from {} s to {} s every sample is drawn.",
            seconds(start),
            seconds(end)
        ),
    }
}
