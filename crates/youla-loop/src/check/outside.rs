//! The tests of a record that depend on its external signals: trends, excitation and noise, lines.

use super::regression::Lagged;
use super::{ChannelNames, CheckOptions, Finding, LoggedRecord, Severity, Test, drift, excitation, lines, noise};
use crate::error::Result;
use faer::{Col, ColRef};
use youla::MatRef;
use youla::signal::{Channel, spectral_lines};

/// Default of the required order of persistency.
/// Past and future horizon of the default identification, 20 block rows each.
const ORDER: usize = 40;

pub(super) fn constant(x: MatRef<'_, f64>) -> bool {
    x.col_iter().all(|c| c.iter().all(|v| *v == c[0]))
}

/// Trends beside the dynamics; of an integrating plant that is held at a constant reference, of its control error.
pub(super) fn trends(
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
pub(super) fn of_excitation(
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
        let found = noise(youla::linalg::block(&[&causes]).as_ref(), record.y, record.time)?;
        let pairs = found.iter().flatten().zip(&names.outputs);
        all.extend(pairs.map(|(noise, channel)| noise.finding(record.name, channel)));
    }
    Ok(all)
}

/// Greatest difference, over the peak, up to which two channels hold the same samples: the rounding of a log with six digits.
const SAME: f64 = 1e-6;

/// Signals from outside whose samples are those of an output or an input, up to a factor and an offset: one signal for two roles.
/// `open` tells where a controller is declared, and whether it is 0: then the excitation is the input.
pub(super) fn of_roles(record: &LoggedRecord<'_>, names: &ChannelNames, open: Option<bool>) -> Vec<Finding> {
    let known = [
        ("excitation", record.input_excitation, &names.input_excitation),
        ("reference", record.reference, &names.reference),
        ("alpha", record.alpha, &names.alpha),
    ];
    let plant = [("output", record.y, &names.outputs), ("input", record.u, &names.inputs)];
    let mut all = Vec::new();
    for (what, data, channels) in known {
        let columns = data.into_iter().flat_map(|d| d.col_iter()).zip(channels);
        for ((signal, channel), (role, of, others)) in columns.flat_map(|c| plant.map(|p| (c, p))) {
            if role == "input" && open == Some(true) {
                continue;
            }
            let equal = |(x, _): &(_, &Channel)| proportional(*x, signal);
            let Some((_, other)) = of.col_iter().zip(others).find(equal) else { continue };
            let undeclared = role == "input" && open.is_none();
            let severity = if undeclared { Severity::Caution } else { Severity::Defect };
            let found = format!("the {what} holds the samples of the {role} {}, up to a factor", other.name);
            let advice = match undeclared {
                true => {
                    "If a controller ran, choose the column of what was added to its command; if none ran, leave the excitation out"
                }
                false => "Choose the column of the signal that comes from outside, or leave it out",
            };
            all.push(
                Finding::new(Test::Excitation, severity, record.name, found).channel(&channel.name).advice(advice),
            );
        }
    }
    all
}

/// Whether two channels that move are the same about their means, up to a factor.
fn proportional(x: ColRef<'_, f64>, s: ColRef<'_, f64>) -> bool {
    let centred = |x: ColRef<'_, f64>| {
        let mean = x.sum() / x.nrows() as f64;
        Col::from_fn(x.nrows(), |k| x[k] - mean)
    };
    let (x, s) = (centred(x), centred(s));
    let factor = (s.transpose() * &x) / s.squared_norm_l2();
    let limit = SAME * x.norm_max();
    limit > 0.0 && factor.is_finite() && (0..x.nrows()).all(|k| (x[k] - factor * s[k]).abs() <= limit)
}

/// Lines of every output that nothing outside of the loop has.
pub(super) fn of_lines(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    fed_back: bool,
    options: &CheckOptions,
) -> Vec<Finding> {
    let known = [record.input_excitation, record.alpha, record.reference];
    let mut known: Vec<MatRef<'_, f64>> = known.into_iter().flatten().collect();
    if known.is_empty() && !fed_back {
        known.push(record.u);
    }
    let found = spectral_lines(&[record.y], &known, record.time, options.line_false_alarm);
    let one = |(lines, channel): (&Vec<_>, &Channel)| lines::finding(lines, record.name, channel);
    found.iter().zip(&names.outputs).filter_map(one).collect()
}
