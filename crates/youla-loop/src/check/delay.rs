//! Dead time, and channels that are shifted against each other.
//!
//! The output is regressed on its past, that of u and, ahead of time, on x(k+1) ... x(k+3), where x is the known excitation, or u
//! itself where the record is open-loop. A cause does not come after its effect: if these future samples explain part of
//! y(k), tested by F, y is too early in the file or x too late. The regression contains the whole past, so that slow dynamics and
//! periodic excitations do not leak into the test. The dead time is that of the first lag of u with a t value beyond
//! `significance`. An excitation added at the plant input must be in u at the same sample; where another lag is the first with such a t
//! value and a substantial coefficient, u is shifted.

use super::finding::{Finding, Severity, Test, few};
use super::options::CheckOptions;
use super::regression::{AHEAD, Fit, Lagged};
use crate::error::Result;
use youla::signal::Channel;

/// Delays and shifts of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Delay {
    /// Per output: share of the innovation that future samples of the excitation explain, where that is more than chance.
    pub early: Vec<Option<f64>>,
    /// Per output and input: first lag of u with an effect on y, 0 where y answers in the same sample; `None` where none
    /// of the lags has one.
    pub first: Vec<Vec<Option<usize>>>,
    /// Per input: lag at which u contains the excitation added there; 0 without a shift.
    pub shift: Vec<Option<isize>>,
}

/// Positions of the signals in the regression.
pub(super) struct Places {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// First signal and number of known excitations added at the plant input.
    pub(super) added: Option<usize>,
    /// First signal and number of all known excitations.
    pub(super) known: std::ops::Range<usize>,
    /// Whether u depends on y.
    pub(super) feedback: bool,
}

pub(super) fn of_record(lagged: &Lagged, at: &Places, options: &CheckOptions) -> Result<Delay> {
    let (m, p) = (at.inputs, at.outputs);
    let outputs: Vec<usize> = (m..m + p).map(|s| lagged.column(s, 0)).collect();
    let constant = vec![lagged.trend(0)];
    // In a loop without known excitation only the past of u is free of the innovation.
    let now: Vec<usize> = if at.feedback { Vec::new() } else { (0..m).map(|s| lagged.column(s, 0)).collect() };
    let past = lagged.fit(&outputs, [lagged.past(0..m + p, 1), now, constant.clone()].concat())?;
    let cause = if at.feedback { at.known.clone() } else { 0..m };
    let mut early = vec![None; p];
    let next: Vec<usize> = cause.clone().map(|s| lagged.column(s, -1)).collect();
    let new = lagged.fit(&next, past.columns.clone())?.left.iter().any(|left| *left > NEW * lagged.rows as f64);
    if new {
        let ahead = cause.flat_map(|s| (1..=AHEAD as isize).map(move |lag| (s, -lag)));
        let ahead: Vec<usize> = ahead.map(|(s, lag)| lagged.column(s, lag)).collect();
        let with = lagged.fit(&outputs, [past.columns.clone(), ahead].concat())?;
        for (i, early) in early.iter_mut().enumerate() {
            let gain = lagged.gain(&past, &with, i);
            *early =
                (gain.deviations > options.significance && gain.share > EARLY * options.share).then_some(gain.share);
        }
    }
    let first = |output: usize, input: usize| {
        let from = isize::from(at.feedback);
        (from..=lagged.lags as isize)
            .find(|lag| t_value(lagged, &past, lagged.column(input, *lag), output).abs() > options.significance)
            .map(|lag| lag as usize)
    };
    let first = (0..p).map(|i| (0..m).map(|j| first(i, j)).collect()).collect();
    let shift = match at.added {
        Some(added) => (0..m).map(|j| shift_of(lagged, at, j, added + j, options)).collect::<Result<_>>()?,
        None => vec![None; m],
    };
    Ok(Delay { early, first, shift })
}

/// Share of the next sample of the cause that must not follow from the past: a smooth trajectory is known ahead, and its future
/// reflects nonlinearities that the regression lacks.
/// Chosen, not measured.
const NEW: f64 = 1e-3;
/// Future samples must explain this many times the usual share: dynamics that the regression misses leak a little.
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const EARLY: f64 = 2.5;

/// Coefficient over its standard deviation.
fn t_value(lagged: &Lagged, fit: &Fit, column: usize, target: usize) -> f64 {
    let Some(k) = fit.columns.iter().position(|c| *c == column) else { return 0.0 };
    let variance = fit.left[target] / lagged.rows.saturating_sub(fit.rank).max(1) as f64;
    let deviation = (variance * fit.inverse[(k, k)]).sqrt();
    if deviation > 0.0 { fit.coefficients[(k, target)] / deviation } else { 0.0 }
}

/// Share of the largest coefficient of the excitation from which one of them counts.
/// Chosen, not measured.
const SUBSTANTIAL: f64 = 0.2;

/// The lag at which the input contains the excitation, next to the feedback.
fn shift_of(
    lagged: &Lagged,
    at: &Places,
    input: usize,
    excitation: usize,
    options: &CheckOptions,
) -> Result<Option<isize>> {
    if lagged.deviations[excitation] == 0.0 {
        return Ok(None);
    }
    let (m, p) = (at.inputs, at.outputs);
    let others = at.known.clone().filter(|s| *s != excitation).flat_map(|s| lagged.past(s..s + 1, 0)).collect();
    let own = lagged.past(excitation..excitation + 1, -(AHEAD as isize));
    let columns = [lagged.past(0..m, 1), lagged.past(m..m + p, 0), others, own, vec![lagged.trend(0)]].concat();
    let fit = lagged.fit(&[lagged.column(input, 0)], columns)?;
    let lags = -(AHEAD as isize)..=lagged.lags as isize;
    let coefficient = |lag: isize| {
        let column = lagged.column(excitation, lag);
        fit.columns.iter().position(|c| *c == column).map_or(0.0, |k| fit.coefficients[(k, 0)].abs())
    };
    let largest = lags.clone().map(coefficient).fold(0.0, f64::max);
    // Where the relation is exact, tiny coefficients have large t values too.
    let counts = |lag: isize| {
        let t = t_value(lagged, &fit, lagged.column(excitation, lag), 0);
        t.abs() > options.significance && coefficient(lag) > SUBSTANTIAL * largest
    };
    Ok(lags.into_iter().find(|lag| counts(*lag)))
}

/// Delays and shifts of a record of inputs and outputs alone; `closed_loop` where u depends on y.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of the regressions.
///
/// ```
/// use youla::Mat;
/// use youla_loop::check::{CheckOptions, delay};
/// let u = Mat::from_fn(3000, 1, |k, _| (((k * k) % 8191) as f64 / 8191.0) - 0.5);
/// let y = Mat::from_fn(3000, 1, |k, _| if k < 4 { 0.0 } else { 2.0 * u[(k - 4, 0)] + 0.1 * u[(3000 - k, 0)] });
/// let found = delay(u.as_ref(), y.as_ref(), false, &CheckOptions::default())?.unwrap();
/// assert_eq!((found.first[0][0], found.early[0]), (Some(4), None));
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn delay(
    u: youla::MatRef<'_, f64>,
    y: youla::MatRef<'_, f64>,
    closed_loop: bool,
    options: &CheckOptions,
) -> Result<Option<Delay>> {
    let Some(lagged) = Lagged::new(&[u, y], options.lags) else { return Ok(None) };
    let (m, p) = (u.ncols(), y.ncols());
    let at = Places { inputs: m, outputs: p, added: None, known: m + p..m + p, feedback: closed_loop };
    of_record(&lagged, &at, options).map(Some)
}

impl Delay {
    pub(super) fn findings(&self, record: &str, inputs: &[Channel], outputs: &[Channel], closed: bool) -> Vec<Finding> {
        let mut all = Vec::new();
        let cause = if closed { "the excitation" } else { "the input" };
        for (output, share) in outputs.iter().zip(&self.early) {
            let Some(share) = share else { continue };
            let what = format!(
                "it moves before {cause}: up to three future samples explain {} % of its innovation",
                few(100.0 * share)
            );
            let advice = "Check that all channels were sampled with one clock; shift the input to earlier rows, or the output to later \
                          ones, until this finding disappears";
            let finding = Finding::new(Test::Delay, Severity::Defect, record, what).channel(&output.name);
            all.push(finding.number("share", *share).advice(advice));
        }
        for (input, shift) in inputs.iter().zip(&self.shift) {
            let Some(lag) = shift.filter(|lag| *lag != 0) else { continue };
            let (side, rows) = if lag > 0 { ("later", lag) } else { ("earlier", -lag) };
            let plural = if rows == 1 { "" } else { "s" };
            let what = format!("it contains the excitation {rows} sample{plural} {side} than the excitation channel");
            let advice = "Shift the channels until the excitation and the input that contains it are in the same row";
            let finding = Finding::new(Test::Delay, Severity::Defect, record, what).channel(&input.name);
            all.push(finding.number("lag", lag as f64).advice(advice));
        }
        for (output, lags) in outputs.iter().zip(&self.first) {
            for (input, first) in inputs.iter().zip(lags) {
                let what = match first {
                    Some(0) => format!("it answers {} in the same sample", input.name),
                    Some(lag) if *lag > 1 => format!(
                        "it answers {} after {lag} samples, {} more than a plant behind a hold",
                        input.name,
                        lag - 1
                    ),
                    _ => continue,
                };
                let advice = match first {
                    Some(0) => {
                        "Use feedthrough = \"estimated\", or check whether the output is logged one sample late or the input early"
                    }
                    _ => "Declare `delays` if this is dead time; then the model needs no states for it",
                };
                let finding = Finding::new(Test::Delay, Severity::Note, record, what).channel(&output.name);
                all.push(finding.number("lag", first.unwrap_or(0) as f64).advice(advice));
            }
        }
        all
    }
}
