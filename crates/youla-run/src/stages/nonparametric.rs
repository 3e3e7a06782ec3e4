//! The plant without a model, at the lines of a periodic excitation with noise and distortion told apart, or in windows of other ones.

use crate::records::LoopRecord;
use crate::result::Identification;
use crate::stages::context::RunContext;
use crate::stages::responses::{decibel, is_constant, magnitude, ports};
use crate::summary::PortCurves;
use crate::summary::entries::finite;
use crate::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use youla::lti::frequency_response;
use youla::signal::{
    LineGroup, LineResponse, LocalModel, PeriodicExperiment, detect_period, line_response, local_response,
};
use youla::{Error as Method, Mat};
use youla_report::data::{LevelBasis, LineLevels, ReportPart, Status, Verdict};

/// Standard normal number beyond which a group of lines differs: 3e-7 for one group, below 1e-4 for 300 of them.
const LIMIT: f64 = 5.0;
/// Relative error below which a difference is stated but is no warning: 0.4 dB, less than most sensors are calibrated to. Chosen, not
/// measured.
const SLIGHT: f64 = 0.05;

/// The loop and its plant without a model.
#[derive(Debug, Clone)]
pub struct LinesOfRun {
    /// From the excitation to u and y.
    pub closed: LineResponse,
    /// G.
    pub plant: LineResponse,
    /// Whether the excitation is periodic; else the lines are the middles of windows of local polynomials.
    pub periodic: bool,
}

/// Most windows of a response by local polynomials: more of them are closer than the points of a figure.
const WINDOWS: usize = 400;

/// What a known excitation shows without a model: at its lines where it is periodic, else by local polynomials. `None` where no
/// excitation is known, or none that reaches all inputs.
///
/// The error is the reason why a periodic excitation shows nothing, for example inputs that are not excited independently.
pub(crate) fn lines(run: RunContext<'_>) -> Option<Result<LinesOfRun>> {
    let records = &run.records.estimation;
    let excitations: Vec<&Mat<f64>> = records.iter().map(excitation).collect::<Option<_>>()?;
    let signals: Vec<Mat<f64>> = records.iter().map(inputs_and_outputs).collect();
    let both = excitations.iter().zip(&signals);
    let experiments: Vec<_> = both.map(|(d, z)| PeriodicExperiment { d: d.as_ref(), z: z.as_ref() }).collect();
    let periodic = !matches!(detect_period(excitations.first()?.as_ref()), Err(Method::NotPeriodic { .. }));
    let time = run.records.time;
    let closed = match periodic {
        true => line_response(&experiments, time),
        false => {
            let longest = records.iter().map(LoopRecord::samples).max()?;
            local_response(&experiments, time, LocalModel::Polynomial, longest.div_ceil(2 * WINDOWS))
        }
    };
    let found = closed.and_then(|closed| Ok(LinesOfRun { plant: closed.plant()?, closed, periodic }));
    (periodic || found.is_ok()).then(|| found.map_err(Error::from))
}

/// The one signal that moves the loop, with a channel for each input.
fn excitation(record: &LoopRecord) -> Option<&Mat<f64>> {
    let known = [&record.input_excitation, &record.alpha, &record.reference];
    let moving: Vec<&Mat<f64>> = known.into_iter().flatten().filter(|d| !is_constant(d)).collect();
    match moving[..] {
        [d] if d.ncols() == record.u.ncols() => Some(d),
        _ => None,
    }
}

fn inputs_and_outputs(record: &LoopRecord) -> Mat<f64> {
    let m = record.u.ncols();
    let value = |t: usize, k: usize| if k < m { record.u[(t, k)] } else { record.y[(t, k - m)] };
    Mat::from_fn(record.samples(), m + record.y.ncols(), value)
}

/// The plant at the lines of a periodic excitation, of others in windows of local polynomials; magnitudes and levels in dB, `[output][input][line]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LinesEntry {
    /// Frequencies of the lines, Hz.
    pub hz: Vec<f64>,
    /// Samples of a period; of the longest record where the excitation is not periodic.
    pub period: usize,
    /// Periods that were averaged, for each estimation record.
    pub periods: Vec<usize>,
    /// The response.
    pub response_db: PortCurves,
    /// Standard deviation by noise.
    pub noise_db: PortCurves,
    /// Standard deviation by noise and nonlinear distortion, with more records than inputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub total_db: Option<PortCurves>,
    /// Standard deviation by nonlinear distortion of one realisation; null where the noise hides it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion_db: Option<PortCurves>,
}

impl From<&LineResponse> for LinesEntry {
    fn from(found: &LineResponse) -> Self {
        let (p, m) = (found.response.at(0).nrows(), found.response.at(0).ncols());
        let curves = |of: &dyn Fn(usize, usize) -> Vec<f64>| -> PortCurves {
            (0..p).map(|i| (0..m).map(|j| of(i, j).into_iter().map(finite).collect()).collect()).collect()
        };
        let several = found.total_variance(0, 0).is_some();
        let of = |variance: &dyn Fn(usize, usize) -> Option<Vec<f64>>| {
            several.then(|| curves(&|i, j| variance(i, j).map_or_else(Vec::new, |v| level(&v))))
        };
        LinesEntry {
            hz: hz(found),
            period: found.period,
            periods: found.periods.clone(),
            response_db: curves(&|i, j| magnitude(&found.response.entry(i, j))),
            noise_db: curves(&|i, j| level(&found.noise_variance(i, j))),
            total_db: of(&|i, j| found.total_variance(i, j)),
            distortion_db: of(&|i, j| found.distortion_variance(i, j)),
        }
    }
}

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
        return measured.levels();
    }
    let Some(Ok(LinesOfRun { plant: lines, periodic, .. })) = &found.lines else { return Vec::new() };
    let basis = if *periodic { LevelBasis::Periods } else { LevelBasis::Windows };
    let one = |(output, input): (usize, usize)| LineLevels {
        output,
        input,
        basis,
        hz: hz(lines),
        response_db: magnitude(&lines.response.entry(output, input)),
        noise_db: level(&lines.noise_variance(output, input)),
        total_db: lines.total_variance(output, input).map_or_else(Vec::new, |v| level(&v)),
        distortion_db: lines.distortion_variance(output, input).map_or_else(Vec::new, |v| level(&v)),
    };
    ports(found.records.outputs.len(), found.records.inputs.len()).map(one).collect()
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
            (Status::Good, text)
        }
        g => {
            let text = format!(
                "At the lines of the periodic excitation the recommended model differs by {:.1} % from the response that they show \
                 {} ({:.0} standard deviations, limit {LIMIT}): missing dynamics, or a plant that is not linear.",
                100.0 * g.relative,
                named(&g),
                g.deviations
            );
            (if g.relative > SLIGHT { Status::Caution } else { Status::Info }, text)
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
        (if g.relative > SLIGHT { Status::Caution } else { Status::Info }, text)
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
