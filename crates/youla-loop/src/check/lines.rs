//! Narrow lines in the outputs: unbalance, run-out, gears, mains ([`youla::signal::spectral_lines`]).

use super::finding::{Finding, Severity, Test, few, with_unit};
use youla::signal::{Channel, SpectralLine};

/// Lines that are listed at most.
/// Chosen, not measured.
const LISTED: usize = 8;

/// One finding for the lines of a channel.
pub(super) fn finding(lines: &[SpectralLine], record: &str, channel: &Channel) -> Option<Finding> {
    let strongest = lines.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))?;
    let listed: Vec<String> = lines
        .iter()
        .take(LISTED)
        .map(|line| {
            let multiple = match line.multiple {
                Some(m) if m > 1 => format!(" ({m}x of the first)"),
                _ => String::new(),
            };
            format!("{:.3} Hz with {}{multiple}", line.hz, with_unit(line.amplitude, &channel.unit))
        })
        .collect();
    let more = if lines.len() > LISTED { ", ..." } else { "" };
    let plural = if lines.len() == 1 { "a line" } else { "lines" };
    let what = format!("it has {plural} that the excitation does not contain: {}{more}", listed.join(", "));
    let advice = "The recommended model takes such lines out by itself. [hansen] and [direct] do not: declare the frequencies, or a \
                  tachometer, in [data.disturbance], as an undeclared line takes two states of their models";
    Some(
        Finding::new(
            Test::Lines,
            Severity::Caution,
            record,
            format!("{what} (power {} times that of the neighbouring frequencies)", few(strongest.ratio)),
        )
        .channel(&channel.name)
        .number("count", lines.len() as f64)
        .number("hz", strongest.hz)
        .number("lowest_hz", lines[0].hz)
        .number("amplitude", strongest.amplitude)
        .number("ratio", strongest.ratio)
        .advice(advice),
    )
}
