//! All tests but that of the time column on one record.

use super::finding::with_unit;
use super::outside::{constant, of_excitation, of_lines, of_roles, trends};
use super::regression::Lagged;
use super::sequence::{self, Break};
use super::{
    CheckOptions, ControllerCheck, ControllerRecord, Declared, Finding, Outliers, Severity, Test, clipping, controller,
    delay, feedback, flatline, outliers, quantisation, stuck,
};
use crate::error::{Error, Result};
use youla::MatRef;
use youla::lti::Discrete;
use youla::signal::Channel;

/// A record as it was logged; row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct LoggedRecord<'a> {
    /// Name in findings.
    pub name: &'a str,
    /// Clock of the samples.
    pub time: Discrete,
    /// Row of the file, counted from 1, of the first sample.
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
/// Fewer leave no degree of freedom to any test. Chosen, not measured.
const SHORTEST: usize = 16;

/// Runs all tests but that of the time column on one record; `controller` is the one that ran, with positive feedback, where
/// it is declared; the controller 0 declares an open loop. Findings come in the order of the tests.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for options outside of their range, and numerical conditions of the tests.
pub fn check_record(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    declared: Option<Declared<'_>>,
    options: &CheckOptions,
) -> Result<Vec<Finding>> {
    options.check()?;
    let open = declared.map(|declared| declared.controller.is_zero());
    let declared = declared.filter(|declared| !declared.controller.is_zero());
    if record.u.nrows() < SHORTEST {
        let what = format!("it has {} samples; the tests require at least {SHORTEST}", record.u.nrows());
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
    let of_controller = match declared.filter(|_| record.alpha.is_none()) {
        Some(k) => of_controller(k, record, names, options, &mut all)?,
        None => None,
    };
    let mut fed_back = declared.is_some();
    if let Some(lagged) = &lagged {
        for ((found, _), channel) in wrong.iter().flatten().zip(&names.outputs) {
            all.extend(found.findings(record.name, record.first_row, channel, options));
        }
        let switches = of_controller.as_ref().map_or(Vec::new(), ControllerCheck::switches);
        all.extend(broken(record, names, lagged, (wrong.as_deref().unwrap_or_default(), &switches), &groups)?);
        all.extend(trends(record, names, lagged, options)?);
        let feedback = feedback::of_record(lagged, m, p, known, options)?;
        fed_back |= feedback.detected;
        let input = names.inputs.get(feedback.input).map_or("u", |c| c.name.as_str());
        all.extend(feedback.finding(record.name, input, declared.is_some()));
        let added = record.input_excitation.filter(|d| !constant(*d)).map(|_| m + p);
        let aligned = of_controller.is_some_and(|found| found.agrees(options));
        let places =
            delay::Places { inputs: m, outputs: p, added, known: m + p..m + p + known, feedback: fed_back, aligned };
        let found = delay::of_record(lagged, &places, options)?;
        all.extend(found.findings(record.name, &names.inputs, &names.outputs, fed_back));
    }
    all.extend(of_roles(record, names, open));
    all.extend(of_excitation(record, names, fed_back, options)?);
    all.extend(of_lines(record, names, fed_back, options));
    all.sort_by_key(|finding| finding.test);
    Ok(all)
}

/// The declared controller against the log; `None` where it cannot be simulated.
fn of_controller(
    k: Declared<'_>,
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    options: &CheckOptions,
    all: &mut Vec<Finding>,
) -> Result<Option<ControllerCheck>> {
    let LoggedRecord { u, y, input_excitation, reference, .. } = *record;
    match controller(k, ControllerRecord { u, y, input_excitation, reference }, options) {
        Ok(found) => {
            all.extend(found.finding((record.name, record.first_row), &names.inputs, &names.outputs, options));
            Ok(Some(found))
        }
        Err(error @ (Error::Method(youla::Error::Diverged { .. }) | Error::Method(youla::Error::Unstable { .. }))) => {
            all.push(controller::not_simulated(record.name, &error));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Rows lost or logged twice, but for those at wrong samples of an output and at another controller, which break the equation of the input too.
fn broken(
    record: &LoggedRecord<'_>,
    names: &ChannelNames,
    lagged: &Lagged,
    (wrong, switches): (&[(Outliers, f64)], &[usize]),
    groups: &[MatRef<'_, f64>],
) -> Result<Vec<Finding>> {
    let (m, p) = (record.u.ncols(), record.y.ncols());
    let known = groups[2..].iter().map(|x| x.ncols()).sum();
    let repeated = sequence::repeated(groups, record.y);
    let mut all: Vec<Break> = repeated.into_iter().map(Break::Twice).collect();
    if all.is_empty() {
        all = sequence::of_record(lagged, m, p, known)?;
    }
    let near = |at: usize, k: usize| k.abs_diff(at) <= lagged.lags;
    let other = |found: &Break| {
        let (Break::Lost(at) | Break::Twice(at) | Break::Jump(at, ..) | Break::Wrong(at, ..)) = *found;
        let of = |o: &Outliers| o.samples.iter().any(|k| near(at, *k)) || o.jump.is_some_and(|(k, _)| near(at, k));
        let switched = switches.iter().any(|k| near(at, *k));
        !matches!(found, Break::Twice(_)) && (switched || wrong.iter().any(|(o, _)| of(o)))
    };
    let rest = all.into_iter().filter(|found| !other(found));
    Ok(rest.map(|found| found.finding(record.name, record.first_row, &names.outputs)).collect())
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
            // A channel at its limit is constant; that is reported as clipping.
            let held = |value: f64| found.lower.iter().chain(&found.upper).any(|limit| limit.value == value);
            let external = record.input_excitation.is_some() || record.reference.is_some() || record.alpha.is_some();
            if values.iter().all(|v| *v == values[0]) && (output || external) {
                let what = format!("it is constant at {} throughout", with_unit(values[0], &channel.unit));
                let advice = "Check the sensor, its cable and the column; the plant has to move in all channels";
                let finding = Finding::new(Test::Stuck, Severity::Defect, record.name, what);
                all.push(finding.channel(&channel.name).advice(advice));
                continue;
            }
            if let Some(standstill) = stuck(&values, options).filter(|s| !held(s.value)) {
                all.push(standstill.finding(record.name, record.first_row, channel));
            }
            if let Some(period) = flatline::held(&values, options) {
                all.push(flatline::of_held(period, record.name, channel, output));
            }
            let innovation = innovations.filter(|_| output).and_then(|i| i.get(j)).map(|(_, sigma)| *sigma);
            if let Some(steps) = quantisation(&values, options).filter(|_| output) {
                all.extend(steps.finding(record.name, channel, innovation, options));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use youla::Mat;
    use youla::lti::StateSpace;

    /// `x+ = 0.9 x + 0.3 u`, `y = x + n`, `u = d - 1.5 y`, all noise white: u, y and d.
    fn clean(seed: u64) -> [Mat<f64>; 3] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || rng.sample::<f64, _>(StandardNormal);
        let (mut x, mut rows) = (0.0, Vec::new());
        for _ in 0..1200 {
            let (d, y) = (draw(), x + 0.2 * draw());
            let u = d - 1.5 * y;
            rows.push([u, y, d]);
            x = 0.9 * x + 0.3 * u;
        }
        [0, 1, 2].map(|j| Mat::from_fn(1200, 1, |k, _| rows[k][j]))
    }

    /// What is found in a log with these columns as input, output and excitation under a gain; `None` where none is declared.
    fn found_in([u, y, d]: [&Mat<f64>; 3], gain: Option<f64>) -> Vec<Finding> {
        let time = Discrete::new(1e-3).unwrap();
        let k = gain.map(|gain| StateSpace::gain(Mat::from_fn(1, 1, |_, _| gain), time).unwrap());
        let one = |name: &str| vec![Channel::new(name, "V")];
        let names =
            ChannelNames { inputs: one("u"), outputs: one("y"), input_excitation: one("d"), ..Default::default() };
        let options = CheckOptions { lags: 8, excitation_order: Some(20), ..CheckOptions::default() };
        let (input_excitation, name, first_row) = (Some(d.as_ref()), "log", 1);
        let (u, y) = (u.as_ref(), y.as_ref());
        let record = LoggedRecord { name, time, first_row, u, y, input_excitation, reference: None, alpha: None };
        check_record(&record, &names, k.as_ref().map(Into::into), &options).unwrap()
    }

    /// The excitation is another channel, in its unit or another, with an offset: a defect. Of the input it is a question where nobody
    /// says whether a controller ran, and right where none did.
    #[test]
    fn an_excitation_that_is_another_channel_is_found() {
        let [u, y, d] = clean(1);
        let scaled = |x: &Mat<f64>| Mat::from_fn(x.nrows(), 1, |k, _| 1e3 * x[(k, 0)] + 7.0);
        let role = |d: &Mat<f64>, gain: Option<f64>| {
            let found = found_in([&u, &y, d], gain).into_iter().find(|f| f.what.contains("holds the samples"));
            found.map(|f| (f.severity, f.what.contains("of the output y")))
        };
        assert_eq!(role(&d, Some(-1.5)), None);
        assert_eq!(role(&y, Some(-1.5)), Some((Severity::Defect, true)));
        assert_eq!(role(&scaled(&u), Some(-1.5)), Some((Severity::Defect, false)));
        assert_eq!(role(&u, None), Some((Severity::Caution, false)));
        assert_eq!(role(&u, Some(0.0)), None);
    }

    /// u and y exchanged in the log: the law explains y from u.
    #[test]
    fn exchanged_inputs_and_outputs_are_named() {
        let [u, y, d] = clean(2);
        let of = |found: Vec<Finding>| found.into_iter().find(|f| f.test == Test::Controller).unwrap();
        let exchanged = of(found_in([&y, &u, &d], Some(-1.5)));
        assert_eq!(exchanged.severity, Severity::Defect);
        assert!(
            exchanged.advice.contains("inputs and outputs exchanged: u was measured and y was applied"),
            "{exchanged:?}"
        );
        assert_eq!(of(found_in([&u, &y, &d], Some(-1.5))).severity, Severity::Note);
    }

    /// Over 200 seeds nothing but notes, and the notes that hold.
    #[test]
    fn a_clean_loop_is_clean() {
        for seed in 0..200 {
            let [u, y, d] = clean(seed);
            let found = found_in([&u, &y, &d], Some(-1.5));
            let serious: Vec<_> = found.iter().filter(|f| f.severity > Severity::Note).collect();
            assert!(serious.is_empty(), "seed {seed}: {serious:?}");
            assert!(found.iter().any(|f| f.test == Test::Noise), "seed {seed}");
        }
    }
}
