//! Whether the input depends on the output: then open-loop methods are biased.
//!
//! Input j is regressed on the past of all inputs and, where they are known, on past and present of the excitations, once
//! without and once with the past of the outputs, and with their present where an excitation is known. What the outputs add is tested by F; it is causality in the sense of
//! C. W. J. Granger (Econometrica 37 (1969), 424). Without feedback the past of y adds nothing; a small share is not taken for
//! feedback, because it appears with inputs that their own past predicts nearly exactly.

use super::finding::{Finding, Severity, Test, few};
use super::options::CheckOptions;
use super::regression::Lagged;
use crate::error::Result;

/// Dependence of the inputs on past outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackCheck {
    /// Input, counted from 0, that depends most.
    pub input: usize,
    /// Share of what its own past and the excitations leave of it that past outputs explain.
    pub share: f64,
    /// By how many standard deviations that is more than chance.
    pub deviations: f64,
    /// Whether this counts as feedback.
    pub detected: bool,
}

/// Share of the innovation of an input that present and past outputs explain together, from which they make it.
/// A controller leaves rounding of its converters; an output that answers in the same sample leaves its noise. Chosen, not measured.
const WHOLE: f64 = 0.99;

/// Tests all inputs; the signals are m inputs, p outputs, then the excitations. Two per cent of what is new in the input is
/// the least share, `options.share`.
pub(super) fn of_record(
    lagged: &Lagged,
    m: usize,
    p: usize,
    known: usize,
    options: &CheckOptions,
) -> Result<FeedbackCheck> {
    let outside = m + p..m + p + known;
    let without = [lagged.past(0..m, 1), lagged.past(outside, 0), vec![lagged.trend(0)]].concat();
    let with = [without.clone(), lagged.past(m..m + p, 1)].concat();
    let targets: Vec<usize> = (0..m).map(|s| lagged.column(s, 0)).collect();
    let at_once =
        (known > 0).then(|| lagged.fit(&targets, [without.clone(), lagged.past(m..m + p, 0)].concat())).transpose()?;
    let (without, with) = (lagged.fit(&targets, without)?, lagged.fit(&targets, with)?);
    let mut strongest = FeedbackCheck { input: 0, share: 0.0, deviations: 0.0, detected: false };
    for input in 0..m {
        let gain = lagged.gain(&without, &with, input);
        let detected = gain.deviations > options.significance && gain.share > options.share;
        // Present outputs may also answer the input at once; where they leave nothing of it, they make it.
        let whole = at_once.as_ref().map(|at_once| lagged.gain(&without, at_once, input));
        let (gain, detected) = match whole {
            Some(whole) if !detected && whole.deviations > options.significance && whole.share > WHOLE => (whole, true),
            _ => (gain, detected),
        };
        if (detected, gain.deviations) > (strongest.detected, strongest.deviations) {
            strongest = FeedbackCheck { input, share: gain.share, deviations: gain.deviations, detected };
        }
    }
    Ok(strongest)
}

/// Tests records without known excitations.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of the regressions.
///
/// ```
/// use youla::Mat;
/// use youla_loop::check::{CheckOptions, feedback};
/// let noise = |k: usize| (((k * k) % 8191) as f64 / 8191.0 - 0.5) * 2.0;
/// let mut y = vec![0.0; 4000];
/// for k in 1..4000 {
///     y[k] = 0.9 * y[k - 1] + noise(k);
/// }
/// let u = Mat::from_fn(4000, 1, |k, _| -0.5 * y[k.saturating_sub(1)] + noise(3 * k + 1));
/// let y = Mat::from_fn(4000, 1, |k, _| y[k]);
/// assert!(feedback(u.as_ref(), y.as_ref(), &CheckOptions::default())?.unwrap().detected);
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn feedback(
    u: youla::MatRef<'_, f64>,
    y: youla::MatRef<'_, f64>,
    options: &CheckOptions,
) -> Result<Option<FeedbackCheck>> {
    Lagged::new(&[u, y], options.lags).map(|lagged| of_record(&lagged, u.ncols(), y.ncols(), 0, options)).transpose()
}

impl FeedbackCheck {
    /// `expected` where a controller is declared.
    pub(super) fn finding(&self, record: &str, input: &str, expected: bool) -> Option<Finding> {
        let (severity, what, advice) = match (self.detected, expected) {
            (true, true) => (
                Severity::Note,
                format!(
                    "the input depends on past outputs, as expected under a controller: they explain {} % of its innovation",
                    few(100.0 * self.share)
                ),
                "",
            ),
            (true, false) => (
                Severity::Caution,
                format!(
                    "the input depends on past outputs: they explain {} % of its innovation ({} standard deviations); the \
                     record is from a closed loop",
                    few(100.0 * self.share),
                    few(self.deviations)
                ),
                "Use a method for closed loops: method = \"pbsid-opt\" or \"ssarx\", or the Hansen scheme with the declared controller",
            ),
            (false, true) => (
                Severity::Note,
                "no feedback from past outputs to the input is detected".to_owned(),
                "If the loop was open, say so: `--open-loop`, or a controller without gain in [controller]",
            ),
            (false, false) => return None,
        };
        Some(
            Finding::new(Test::Feedback, severity, record, what)
                .channel(input)
                .number("share", self.share)
                .number("deviations", self.deviations)
                .advice(advice),
        )
    }
}
