//! The tests of a record that depend on its external signals: trends, excitation and noise, lines.

use super::regression::Lagged;
use super::{ChannelNames, CheckOptions, Finding, LoggedRecord, drift, excitation, lines, noise};
use crate::error::Result;
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

/// Lines of every output that nothing outside of the loop has.
pub(super) fn of_lines(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    fed_back: bool,
    options: &CheckOptions,
) -> Vec<Finding> {
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
        lines::finding(&spectral_lines(values, &known, record.time, options.line_false_alarm), record.name, channel)
    };
    outputs.iter().zip(&names.outputs).filter_map(one).collect()
}
