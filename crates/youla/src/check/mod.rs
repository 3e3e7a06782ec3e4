//! What is wrong with the data before anything is identified from them.
//!
//! One file per test; each is a public function from samples to a typed result, with its equation and source. [`check_record`] runs
//! all of them on one record and says what they found as [`Finding`]s: which test, how serious, where, how bad, what to do.
//! Nothing is repaired. What the thresholds are and why stands in [`CheckOptions`].
//!
//! | file | test |
//! |---|---|
//! | `timing` | steps of the time column: irregular, missing, repeated, of another unit |
//! | `clipping` | values held at a limit |
//! | `stuck` | a channel that stands still |
//! | `quantisation` | steps of a channel against its innovation |
//! | `drift` | a trend that the input does not explain |
//! | `outliers` | single wrong samples |
//! | `delay` | dead time, channels shifted against each other |
//! | `excitation` | rank, crest factor and band of the excitation |
//! | `noise` | signal-to-noise ratio |
//! | `lines` | narrow lines of unbalance or mains |
//! | `feedback` | whether the input depends on the output |
//! | `controller` | whether the declared controller gives the logged input |
//! | `regression` | what several tests share: all regressions of a record from one triangular factor |

mod clipping;
mod controller;
mod delay;
mod drift;
mod excitation;
mod feedback;
mod finding;
mod lines;
mod noise;
mod options;
mod outliers;
mod quantisation;
mod regression;
mod stuck;
mod timing;

pub use clipping::{Clipping, Limit, clipping};
pub use controller::{Change, ControllerCheck, ControllerRecord, controller};
pub use delay::{Delay, delay};
pub use drift::{Drift, drift};
pub use excitation::{Excitation, excitation};
pub use feedback::{Feedback, feedback};
pub use finding::{Finding, Severity, Test, by_severity};
pub use lines::{Line, lines};
pub use noise::{Noise, noise};
pub use options::CheckOptions;
pub use outliers::{Outliers, outliers};
pub use quantisation::{Quantisation, quantisation};
pub use stuck::{Standstill, stuck};
pub use timing::{Gap, Timing, timing};

use crate::lti::{Discrete, StateSpace};
use crate::units::Channel;
use crate::{Error, MatRef, Result};
use regression::Lagged;

/// A record as it was logged; row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct LoggedRecord<'a> {
    /// Name in findings.
    pub name: &'a str,
    /// Clock of the samples.
    pub time: Discrete,
    /// Row of the file, counted from 1, in which the first sample stands.
    pub first_row: usize,
    /// Plant input as applied, samples x m.
    pub u: MatRef<'a, f64>,
    /// Measured output, samples x p.
    pub y: MatRef<'a, f64>,
    /// Known excitation added at the plant input, samples x m.
    pub input_excitation: Option<MatRef<'a, f64>>,
    /// Known reference, samples x p.
    pub reference: Option<MatRef<'a, f64>>,
    /// Known excitation alpha of Fig. 3, samples x m.
    pub alpha: Option<MatRef<'a, f64>>,
}

/// Names and units of the channels of a [`LoggedRecord`]; empty where it has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChannelNames {
    /// Of u.
    pub inputs: Vec<Channel>,
    /// Of y.
    pub outputs: Vec<Channel>,
    /// Of the excitation at the plant input.
    pub input_excitation: Vec<Channel>,
    /// Of the reference.
    pub reference: Vec<Channel>,
    /// Of alpha.
    pub alpha: Vec<Channel>,
}

/// Samples of a record, at least.
const SHORTEST: usize = 16;
/// Order of persistency that is asked for where nothing is said.
const ORDER: usize = 40;

/// Runs all tests but that of the time column on one record; `controller` is the one that ran, with positive feedback, where
/// it is declared. Findings come in the order of the tests.
///
/// # Errors
/// [`Error::OutOfRange`] for options outside of their range, and numerical conditions of the tests.
pub fn check_record(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    declared: Option<&StateSpace<Discrete>>,
    options: &CheckOptions,
) -> Result<Vec<Finding>> {
    options.check()?;
    if record.u.nrows() < SHORTEST {
        let what = format!("it has {} samples; nothing can be tested below {SHORTEST}", record.u.nrows());
        return Ok(vec![Finding::new(Test::Timing, Severity::Caution, record.name, what)]);
    }
    let mut all = Vec::new();
    let (m, p) = (record.u.ncols(), record.y.ncols());
    let moving: Vec<MatRef<'_, f64>> = [record.input_excitation, record.alpha, record.reference]
        .into_iter()
        .flatten()
        .filter(|x| !constant(*x))
        .collect();
    let known: usize = moving.iter().map(|x| x.ncols()).sum();
    let groups = [vec![record.u, record.y], moving].concat();
    let lagged = Lagged::new(&groups, options.lags);
    let wrong = match &lagged {
        Some(lagged) => Some(outliers::of_outputs(lagged, m, p, options)?),
        None => None,
    };
    of_channels(record, names, wrong.as_deref(), options, &mut all);
    let mut fed_back = declared.is_some();
    if let Some(lagged) = &lagged {
        for ((found, _), channel) in wrong.iter().flatten().zip(&names.outputs) {
            all.extend(found.finding(record.name, record.first_row, channel, options));
        }
        all.extend(trends(record, names, lagged, options)?);
        let feedback = feedback::of_record(lagged, m, p, known, options)?;
        fed_back |= feedback.detected;
        let input = names.inputs.get(feedback.input).map_or("u", |c| c.name.as_str());
        all.extend(feedback.finding(record.name, input, declared.is_some()));
        let added = record.input_excitation.filter(|d| !constant(*d)).map(|_| m + p);
        let places = delay::Places { inputs: m, outputs: p, added, known: m + p..m + p + known, feedback: fed_back };
        let found = delay::of_record(lagged, &places, options)?;
        all.extend(found.findings(record.name, &names.inputs, &names.outputs, fed_back));
    }
    all.extend(of_excitation(record, names, fed_back, options)?);
    all.extend(of_lines(record, names, fed_back, options));
    if let Some(k) = declared.filter(|_| record.alpha.is_none()) {
        match controller(k, of_controller(record), options) {
            Ok(found) => all.extend(found.finding(record.name, &names.outputs, options)),
            Err(error @ (Error::Diverged { .. } | Error::Unstable { .. })) => {
                all.push(controller::not_simulated(record.name, &error))
            }
            Err(error) => return Err(error),
        }
    }
    all.sort_by_key(|finding| finding.test);
    Ok(all)
}

fn of_controller<'a>(record: &LoggedRecord<'a>) -> ControllerRecord<'a> {
    let LoggedRecord { u, y, input_excitation, reference, .. } = *record;
    ControllerRecord { u, y, input_excitation, reference }
}

fn constant(x: MatRef<'_, f64>) -> bool {
    x.col_iter().all(|c| c.iter().all(|v| *v == c[0]))
}

/// Tests of one channel at a time: limits, standstill, steps.
fn of_channels(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    innovations: Option<&[(Outliers, f64)]>,
    options: &CheckOptions,
    all: &mut Vec<Finding>,
) {
    for (data, channels, output) in [(record.u, &names.inputs, false), (record.y, &names.outputs, true)] {
        for (j, channel) in channels.iter().enumerate() {
            let values: Vec<f64> = data.col(j).iter().copied().collect();
            let limits = options.limits.get(&channel.name).copied();
            let found = clipping(&values, limits, options);
            all.extend(found.findings(record.name, record.first_row, channel, output, values.len()));
            // A channel at its limit stands still there; that has been said.
            let held = |value: f64| found.lower.iter().chain(&found.upper).any(|limit| limit.value == value);
            if let Some(standstill) = stuck(&values, options).filter(|s| !held(s.value)) {
                all.push(standstill.finding(record.name, record.first_row, channel));
            }
            let innovation = innovations.filter(|_| output).and_then(|i| i.get(j)).map(|(_, sigma)| *sigma);
            if let Some(steps) = quantisation(&values, options).filter(|_| output) {
                all.extend(steps.finding(record.name, channel, innovation, options));
            }
        }
    }
}

/// Trends beside the dynamics; of an integrating plant that is held at a constant reference, of its control error.
fn trends(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    lagged: &Lagged,
    options: &CheckOptions,
) -> Result<Vec<Finding>> {
    let (m, p) = (record.u.ncols(), record.y.ncols());
    let found = match drift::by_regression(lagged, m, p)? {
        Some(found) => found.into_iter().map(Some).collect(),
        None if record.reference.is_some_and(constant) => {
            (0..p).map(|j| drift(&record.y.col(j).iter().copied().collect::<Vec<f64>>())).collect()
        }
        None => Vec::new(),
    };
    let pairs = found.iter().zip(&names.outputs);
    Ok(pairs.filter_map(|(drift, channel)| drift.as_ref()?.finding(record.name, channel, options)).collect())
}

/// Rank, band and effect of what excites the record: the known excitations, else the input.
fn of_excitation(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    fed_back: bool,
    options: &CheckOptions,
) -> Result<Vec<Finding>> {
    let order = options.excitation_order.unwrap_or(ORDER);
    let nyquist = 0.5 / record.time.ts();
    let mut all = Vec::new();
    let known = [
        (record.input_excitation, &names.input_excitation, false),
        (record.alpha, &names.alpha, false),
        (record.reference, &names.reference, true),
    ];
    let mut causes: Vec<MatRef<'_, f64>> = Vec::new();
    let mut declared = false;
    for (data, channels, may_rest) in known {
        let Some(data) = data else { continue };
        causes.extend(data.col_iter().map(|c| c.as_mat()).filter(|c| !constant(*c)));
        // A reference beside another excitation need not excite everything.
        if may_rest && (declared || constant(data)) {
            continue;
        }
        declared = true;
        let found = excitation(data, record.time, order)?;
        all.extend(found.findings(record.name, channels, (true, may_rest), nyquist, options));
    }
    if !declared {
        let found = excitation(record.u, record.time, order)?;
        all.extend(found.findings(record.name, &names.inputs, (false, false), nyquist, options));
    }
    if causes.is_empty() && !fed_back {
        causes.extend(record.u.col_iter().map(|c| c.as_mat()).filter(|c| !constant(*c)));
    }
    if !causes.is_empty() {
        let found = noise(crate::linalg::block(&[&causes]).as_ref(), record.y, record.time)?;
        let pairs = found.iter().flatten().zip(&names.outputs);
        all.extend(pairs.map(|(noise, channel)| noise.finding(record.name, channel)));
    }
    Ok(all)
}

/// Lines of every output that nothing outside of the loop has.
fn of_lines(record: &LoggedRecord<'_>, names: &ChannelNames, fed_back: bool, options: &CheckOptions) -> Vec<Finding> {
    let mut known: Vec<Vec<f64>> = Vec::new();
    let columns = |x: MatRef<'_, f64>| x.col_iter().map(|c| c.iter().copied().collect()).collect::<Vec<Vec<f64>>>();
    for x in [record.input_excitation, record.alpha, record.reference].into_iter().flatten() {
        known.extend(columns(x));
    }
    if known.is_empty() && !fed_back {
        known = columns(record.u);
    }
    let known: Vec<&[f64]> = known.iter().map(Vec::as_slice).collect();
    let outputs = columns(record.y);
    let one = |(values, channel): (&Vec<f64>, &Channel)| {
        lines::finding(&lines(values, &known, record.time, options), record.name, channel)
    };
    outputs.iter().zip(&names.outputs).filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mat;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// `x+ = 0.9 x + 0.3 u`, `y = x + n`, `u = d - 1.5 y`, all noise white: over 200 seeds nothing but notes, and the notes
    /// that hold.
    #[test]
    fn a_clean_loop_is_clean() {
        let time = Discrete::new(1e-3).unwrap();
        let empty = |rows, columns| Mat::zeros(rows, columns);
        let gain = Mat::from_fn(1, 1, |_, _| -1.5);
        let k = StateSpace::new(empty(0, 0), empty(0, 1), empty(1, 0), gain, time).unwrap();
        let one = |name: &str| vec![Channel::new(name, "V")];
        let names =
            ChannelNames { inputs: one("u"), outputs: one("y"), input_excitation: one("d"), ..Default::default() };
        let options = CheckOptions { lags: 8, excitation_order: Some(20), ..CheckOptions::default() };
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut draw = || rng.sample::<f64, _>(StandardNormal);
            let (mut x, mut rows) = (0.0, Vec::new());
            for _ in 0..1200 {
                let (d, y) = (draw(), x + 0.2 * draw());
                let u = d - 1.5 * y;
                rows.push([u, y, d]);
                x = 0.9 * x + 0.3 * u;
            }
            let [u, y, d] = [0, 1, 2].map(|j| Mat::from_fn(1200, 1, |k, _| rows[k][j]));
            let (input_excitation, name, first_row) = (Some(d.as_ref()), "log", 1);
            let (u, y) = (u.as_ref(), y.as_ref());
            let record = LoggedRecord { name, time, first_row, u, y, input_excitation, reference: None, alpha: None };
            let found = check_record(&record, &names, Some(&k), &options).unwrap();
            let serious: Vec<_> = found.iter().filter(|f| f.severity > Severity::Note).collect();
            assert!(serious.is_empty(), "seed {seed}: {serious:?}");
            assert!(found.iter().any(|f| f.test == Test::Noise), "seed {seed}");
        }
    }
}
