//! Dead time, and channels that are shifted against each other.
//!
//! The output is regressed on the past of y, u and x and, ahead of time, on x(k+1) ... x(k+3), where x is the known excitation, or u
//! itself where the record is open-loop. A cause does not come after its effect: if these future samples explain part of
//! y(k), tested by F, y is too early in the file or x too late. Of a periodic or band-limited x the past tells the future; the test needs
//! samples of x that its past does not tell, and future samples must explain far more than samples as far in the past, which only a
//! memory longer than the regression makes explain anything.
//!
//! An excitation added at the plant input is in u at the same sample, `u(k) - d(k - s) = K y` with s = 0: u is shifted where the controller
//! on the right, any of the order of the regression, leaves a hundredth of the power with another s. No prediction enters.
//!
//! A dead time is stated where the first effect of u on y is clear and all lags before it have none.

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
    /// Per output and input: first lag of u with an effect on y, 0 where y answers in the same sample; `None` where no first lag stands
    /// out.
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
    /// Whether the declared controller reproduces u from y and the excitation, which it does not do with shifted channels.
    pub(super) aligned: bool,
}

pub(super) fn of_record(lagged: &Lagged, at: &Places, options: &CheckOptions) -> Result<Delay> {
    let (m, p) = (at.inputs, at.outputs);
    let outputs: Vec<usize> = (m..m + p).map(|s| lagged.column(s, 0)).collect();
    let constant = vec![lagged.trend(0)];
    // In a loop without known excitation only the past of u is free of the innovation.
    let now: Vec<usize> = if at.feedback { Vec::new() } else { (0..m).map(|s| lagged.column(s, 0)).collect() };
    let past = lagged.fit(&outputs, [lagged.past(0..m + p, 1), now, constant].concat())?;
    let early = if at.aligned { vec![None; p] } else { early(lagged, at, &outputs, &past, options)? };
    let first = |output: usize, input: usize| {
        let t = |lag: isize| t_value(lagged, &past, lagged.column(input, lag), output).abs();
        if !at.feedback && t(0) > options.significance {
            return Some(0);
        }
        let lag = (1..=lagged.lags as isize).find(|lag| t(*lag) > NONE)?;
        // Near the end of the regression a lag stands for the memory that it lacks.
        (t(lag) > CLEAR && lag <= lagged.lags as isize * 2 / 3).then_some(lag as usize)
    };
    let first = (0..p).map(|i| (0..m).map(|j| first(i, j)).collect()).collect();
    let shift = match at.added {
        Some(added) if !at.aligned => (0..m).map(|j| shift_of(lagged, at, j, added + j)).collect::<Result<_>>()?,
        _ => vec![None; m],
    };
    Ok(Delay { early, first, shift })
}

/// Share of the output's innovation that future samples of the cause explain, per output.
fn early(
    lagged: &Lagged,
    at: &Places,
    outputs: &[usize],
    past: &Fit,
    options: &CheckOptions,
) -> Result<Vec<Option<f64>>> {
    let cause = if at.feedback { at.known.clone() } else { 0..at.inputs };
    let known = if at.feedback { lagged.past(at.known.clone(), 0) } else { Vec::new() };
    let columns = [past.columns.clone(), known].concat();
    let next: Vec<usize> = cause.clone().map(|s| lagged.column(s, -1)).collect();
    let new = lagged.fit(&next, columns.clone())?.left.iter().any(|left| *left > NEW * lagged.factored as f64);
    if !new {
        return Ok(vec![None; outputs.len()]);
    }
    let oldest = |column: &usize| lagged.lag(*column).is_some_and(|lag| lag > lagged.lags as isize - AHEAD as isize);
    let short = lagged.fit(outputs, columns.iter().copied().filter(|c| !oldest(c)).collect())?;
    let ahead = cause.flat_map(|s| (1..=AHEAD as isize).map(move |lag| (s, -lag)));
    let ahead: Vec<usize> = ahead.map(|(s, lag)| lagged.column(s, lag)).collect();
    let with = lagged.fit(outputs, [columns.clone(), ahead].concat())?;
    let past = lagged.fit(outputs, columns)?;
    let one = |i: usize| {
        let (gain, remote) = (lagged.gain(&past, &with, i), lagged.gain(&short, &past, i));
        let real = gain.deviations > options.significance && gain.share > EARLY * options.share;
        (real && gain.share > REMOTE * remote.share).then_some(gain.share)
    };
    Ok((0..outputs.len()).map(one).collect())
}

/// Share of the next sample of the cause that must not follow from the past: a smooth or periodic one is known ahead, and its future
/// reflects nonlinearities and a memory that the regression lacks.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const NEW: f64 = 0.05;
/// Future samples must explain this many times the usual share: dynamics that the regression misses leak a little.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const EARLY: f64 = 2.5;
/// They must explain this many times what the oldest samples of the regression do.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const REMOTE: f64 = 4.0;
/// Deviations up to which a lag before the first effect has none, and from which the first effect is clear.
/// A response that rises with the square of time has no two neighbours so far apart. Chosen; `docs/check.md` has the rate.
const NONE: f64 = 3.0;
const CLEAR: f64 = 15.0;

/// Coefficient over its standard deviation.
fn t_value(lagged: &Lagged, fit: &Fit, column: usize, target: usize) -> f64 {
    let Some(k) = fit.columns.iter().position(|c| *c == column) else { return 0.0 };
    let variance = fit.left[target] / lagged.factored.saturating_sub(fit.rank).max(1) as f64;
    let deviation = (variance * fit.inverse[(k, k)]).sqrt();
    if deviation > 0.0 { fit.coefficients[(k, target)] / deviation } else { 0.0 }
}

/// Least part of the power of u that a shift must matter, and how much less than in place it must leave.
/// Rounding of a log with five digits is below; an exact controller leaves rounding only. Chosen, not measured.
const MATTERS: f64 = 1e-9;
const LESS: f64 = 0.01;

/// The lag at which the input contains the excitation, next to the feedback.
fn shift_of(lagged: &Lagged, at: &Places, input: usize, excitation: usize) -> Result<Option<isize>> {
    if lagged.deviations[excitation] == 0.0 || lagged.lags <= 2 * AHEAD {
        return Ok(None);
    }
    let (m, p, reach) = (at.inputs, at.outputs, lagged.lags as isize - AHEAD as isize);
    let others = (m..m + p).chain(at.known.clone().filter(|s| !(m + p..m + p + m).contains(s)));
    let free: Vec<Vec<(usize, f64)>> = others
        .flat_map(|s| (0..=reach).map(move |lag| (s, lag)))
        .map(|(s, lag)| vec![(lagged.column(s, lag), 1.0)])
        .collect();
    let left = |shift: isize| {
        let own = |lag: isize| vec![(lagged.column(input, lag), 1.0), (lagged.column(excitation, lag + shift), -1.0)];
        let columns: Vec<_> =
            (1..=reach).map(own).chain(free.iter().cloned()).chain([vec![(lagged.trend(0), 1.0)]]).collect();
        lagged.left_of(&own(0), &columns)
    };
    let in_place = left(0)?;
    if in_place < MATTERS {
        return Ok(Some(0));
    }
    let mut best = (0, in_place);
    for shift in (-(AHEAD as isize)..=AHEAD as isize).filter(|shift| *shift != 0) {
        let found = left(shift)?;
        if found < best.1 {
            best = (shift, found);
        }
    }
    Ok(Some(if best.1 < LESS * in_place { best.0 } else { 0 }))
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
    let at = Places { inputs: m, outputs: p, added: None, known: m + p..m + p, feedback: closed_loop, aligned: false };
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
            for (j, (input, first)) in inputs.iter().zip(lags).enumerate() {
                let what = match first {
                    Some(0) => format!("it answers {} in the same sample", input.name),
                    Some(lag) if *lag > 1 => format!(
                        "it answers {} after {lag} samples: a dead time of {} beside the sample of the hold",
                        input.name,
                        lag - 1
                    ),
                    _ => continue,
                };
                let advice = match first {
                    Some(0) => {
                        "Use feedthrough = \"estimated\", or check whether the output is logged one sample late or the input early"
                    }
                    _ if self.first.iter().all(|lags| lags.get(j) == Some(first)) => {
                        "State it as `dead_time` in [recommended] if it is known; then the model needs no states for it"
                    }
                    _ => {
                        "`dead_time` in [recommended] holds the least of all outputs for an input; the model has states for what is more"
                    }
                };
                let finding = Finding::new(Test::Delay, Severity::Note, record, what).channel(&output.name);
                all.push(finding.number("lag", first.unwrap_or(0) as f64).advice(advice));
            }
        }
        all
    }
}
