//! The plant without a model: levels for the figure, and what they say of the recommended model.

use crate::page::decibels::{decibel, magnitude};
use crate::records::measured::MeasuredTable;
use crate::result::Identification;
use crate::stages::nonparametric::LinesOfRun;
use crate::stages::responses::ports;
use std::f64::consts::TAU;
use youla::identify::likelihood::ResponseVariance;
use youla::lti::frequency_response;
use youla::signal::{LineGroup, LineResponse};
use youla_report::data::{LevelBasis, LineLevels, LineStatus, ReportPart, Verdict};

/// Standard normal number beyond which a group of lines differs: 3e-7 for one group, below 1e-4 for 300 of them.
const LIMIT: f64 = 5.0;
/// Relative error below which a difference is stated but is no warning: 0.4 dB, less than most sensors are calibrated to. Chosen, not
/// measured.
const SLIGHT: f64 = 0.05;

fn hz(found: &LineResponse) -> Vec<f64> {
    found.response.omega.iter().map(|w| w / TAU).collect()
}

/// Standard deviations in dB, NaN for zero.
fn level(variance: &[f64]) -> Vec<f64> {
    variance.iter().map(|v| if *v > 0.0 { decibel(v.sqrt()) } else { f64::NAN }).collect()
}

/// For the figure.
pub(crate) fn drawn(found: &Identification) -> Vec<LineLevels> {
    if let Some(measured) = &found.records.measured {
        return stated(measured);
    }
    let Some(Ok(LinesOfRun { plant: lines, periodic, .. })) = &found.lines else { return Vec::new() };
    let basis = if *periodic { LevelBasis::Periods } else { LevelBasis::Windows };
    let one = |(output, input): (usize, usize)| LineLevels {
        output,
        input,
        basis,
        period: lines.period,
        periods: lines.periods.clone(),
        hz: hz(lines),
        response_db: magnitude(&lines.response.entry(output, input)),
        noise_db: level(&lines.noise_variance(output, input)),
        total_db: lines.total_variance(output, input).map_or_else(Vec::new, |v| level(&v)),
        distortion_db: lines.distortion_variance(output, input).map_or_else(Vec::new, |v| level(&v)),
    };
    ports(found.records.outputs.len(), found.records.inputs.len()).map(one).collect()
}

/// The values of a measured response of the plant with their stated deviations.
fn stated(measured: &MeasuredTable) -> Vec<LineLevels> {
    let (ResponseVariance::Known(variance), false) = (&measured.table.variance, measured.of_loop) else {
        return Vec::new();
    };
    let hz: Vec<f64> = measured.table.omega.iter().map(|w| w / TAU).collect();
    let (outputs, inputs) = measured.table.values.first().map_or((0, 0), |v| (v.nrows(), v.ncols()));
    let one = |(output, input): (usize, usize)| LineLevels {
        output,
        input,
        basis: LevelBasis::Stated,
        hz: hz.clone(),
        response_db: measured.table.values.iter().map(|v| decibel(v[(output, input)].norm())).collect(),
        noise_db: variance.iter().map(|v| decibel(v[(output, input)].sqrt())).collect(),
        ..LineLevels::default()
    };
    ports(outputs, inputs).map(one).collect()
}

/// The recommended model against the lines, and what no linear model explains.
pub(crate) fn verdict_lines(found: &Identification) -> Vec<Verdict> {
    let Some(Ok(LinesOfRun { closed, plant: lines, periodic: true })) = &found.lines else { return Vec::new() };
    let named = |g: &LineGroup| {
        let ((i, j), [from, to]) = (g.entry, g.hz);
        let (output, input) = (&found.records.outputs[i].name, &found.records.inputs[j].name);
        format!("from {input} to {output} between {} and {} Hz", four_digits(from), four_digits(to))
    };
    let line = |(status, text)| Verdict { status, text, evidence: ReportPart::Frequency };
    let model = found.recommended.as_ref().ok().and_then(|r| frequency_response(&r.plant, &lines.response.omega).ok());
    let agreement = model.and_then(|model| largest(closed.against(&model))).map(|worst| match worst {
        g if g.deviations <= LIMIT => {
            let text = format!(
                "At {} lines of the periodic excitation the recommended model agrees with the response that they show: at most {:.1} \
                 standard deviations for a group of lines (limit {LIMIT}).",
                lines.lines.len(),
                g.deviations.max(0.0)
            );
            (LineStatus::Good, text)
        }
        g => {
            let text = format!(
                "At the lines of the periodic excitation the recommended model differs by {:.1} % from the response that they show \
                 {} ({:.0} standard deviations, limit {LIMIT}): missing dynamics, or a plant that is not linear.",
                100.0 * g.relative,
                named(&g),
                g.deviations
            );
            (if g.relative > SLIGHT { LineStatus::Caution } else { LineStatus::Info }, text)
        }
    });
    let distortion = largest(lines.distortion()).filter(|g| g.deviations > LIMIT).map(|g| {
        let text = format!(
            "A linear model explains at most {:.1} % of the power of the response {}: the rest is nonlinear distortion ({:.0} standard \
             deviations above the noise, limit {LIMIT}).",
            100.0 / (1.0 + g.relative.powi(2)),
            named(&g),
            g.deviations
        );
        (if g.relative > SLIGHT { LineStatus::Caution } else { LineStatus::Info }, text)
    });
    agreement.into_iter().chain(distortion).map(line).collect()
}

/// Four significant digits.
fn four_digits(value: f64) -> String {
    let places = if value > 0.0 { 3 - value.log10().floor() as i32 } else { 0 };
    format!("{value:.0$}", places.clamp(0, 12) as usize)
}

/// The group beyond the limit with the largest relative excess; where there is none, that with the most deviations.
fn largest(groups: Vec<LineGroup>) -> Option<LineGroup> {
    let beyond = groups.iter().filter(|g| g.deviations > LIMIT).max_by(|a, b| a.relative.total_cmp(&b.relative));
    beyond.or_else(|| groups.iter().max_by(|a, b| a.deviations.total_cmp(&b.deviations))).copied()
}
