//! Whether the declared controller reproduces the logged input, and which single change would make it do so.
//!
//! With positive feedback `u = K (y - r) + d` the declared K is simulated on the logged `e = y - r`, from the state that fits best,
//! and compared with `w = u - d`:
//! ```text
//! residual = |w - K e| / |w|     (about their means)
//! ```
//! Where it is large the same is tried with one thing changed at a time: the sign, one sample earlier or later, a factor on each channel or on
//! one gain of the controller by least squares, two channels or inputs and outputs exchanged, the input limited to its own range, d left out or with the other sign. A change
//! is proposed where it brings the residual below a tenth of what it was and below `controller_caution` twice over, or to nearly nothing.
//! Then other readings of the numbers of the controller are tried ([`Reading`]): another rule of discretisation, another form, another clock.
//! Where none is, the law is compared part by part ([`Parts`]): a controller that was switched or is scheduled.
//! Where no excitation is declared, the residual is the excitation itself, if the controller is right.

mod gains;
mod log;
mod messages;
mod parts;

pub(super) use messages::not_simulated;
pub use parts::Parts;

use super::options::CheckOptions;
use crate::error::Result;
use log::Log;
use youla::MatRef;
use youla::lti::{Discrete, StateSpace};

/// A change that would make the controller fit the log.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The other sign of feedback, or of all outputs.
    Sign,
    /// The other sign of the logged input.
    InputSign,
    /// Inputs and outputs exchanged in the log.
    Roles,
    /// Two inputs exchanged in the log.
    ExchangedInputs(usize, usize),
    /// A linear trend in the outputs.
    Trend,
    /// y (and r) shifted by so many rows, later if positive.
    Shift(isize),
    /// u shifted by so many rows relative to y, r and the excitation, earlier if positive.
    InputShift(isize),
    /// A factor on all channels of `y - r`: a gain of the controller.
    Gain(f64),
    /// A factor on one measured output, counted from 0, and not on its reference.
    ChannelGain(usize, f64),
    /// A factor on one reference.
    ReferenceGain(usize, f64),
    /// A factor on one logged input.
    InputGain(usize, f64),
    /// A factor on one excitation.
    ExcitationGain(usize, f64),
    /// Another value of one gain of the controller, with its key.
    Part(String, f64),
    /// Two outputs exchanged.
    Exchanged(usize, usize),
    /// The input limited to the range that it has in the log.
    Saturation([f64; 2]),
    /// The input was logged before the excitation was added.
    WithoutExcitation,
    /// The excitation with the other sign.
    ExcitationSign,
    /// The reference was added at the input.
    ReferenceAtInput,
    /// The excitation was added at the reference.
    ExcitationAtReference,
    /// Another reading of the numbers of the controller, in words.
    Reading(String),
}

/// Another controller that the stated numbers may mean.
#[derive(Debug, Clone)]
pub struct Reading {
    /// What is read otherwise, behind "with".
    pub words: String,
    /// The controller, positive feedback.
    pub controller: StateSpace<Discrete>,
}

/// A part of a controller with a gain of its own.
#[derive(Debug, Clone)]
pub struct GainPart {
    /// The key of the gain.
    pub key: String,
    /// Its stated value.
    pub value: f64,
    /// Factor and power of the gain in what the key states: 1 and 1 but for times, `ti = kp ki^-1` and `td = kd / kp`.
    pub stated: (f64, i32),
    /// The part with a gain of one, positive feedback.
    pub controller: StateSpace<Discrete>,
}

/// A controller as it is stated.
#[derive(Debug, Clone, Copy)]
pub struct Declared<'a> {
    /// The controller, positive feedback.
    pub controller: &'a StateSpace<Discrete>,
    /// What its numbers may mean beside it.
    pub readings: &'a [Reading],
    /// Its parts with a gain each, where it has such.
    pub parts: &'a [GainPart],
}

impl<'a> From<&'a StateSpace<Discrete>> for Declared<'a> {
    fn from(controller: &'a StateSpace<Discrete>) -> Self {
        Declared { controller, readings: &[], parts: &[] }
    }
}

/// How far the declared controller explains the logged input.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerCheck {
    /// Relative residual; infinite for a controller that diverges where a reading of its numbers does not.
    pub residual: f64,
    /// Whether an excitation at the plant input is declared.
    pub excited: bool,
    /// Whether a declared reference moves.
    pub guided: bool,
    /// Share of what the controller leaves of the input that the declared excitation explains, where it matters.
    pub contained: Option<f64>,
    /// The change that leaves least, and what it leaves, where one would help.
    pub change: Option<(Change, f64)>,
    /// Where no single change helps, how the law changes along the record.
    pub parts: Option<Parts>,
}

/// The logged signals of the controller.
#[derive(Debug, Clone, Copy)]
pub struct ControllerRecord<'a> {
    /// Plant input as applied, samples x m.
    pub u: MatRef<'a, f64>,
    /// Measured output, samples x p.
    pub y: MatRef<'a, f64>,
    /// Excitation added at the plant input, samples x m.
    pub input_excitation: Option<MatRef<'a, f64>>,
    /// Reference, samples x p.
    pub reference: Option<MatRef<'a, f64>>,
}

/// Magnitude of a pole up to which a controller that integrates can be simulated.
/// A controller typed with six digits has an integrator within it. Chosen, not measured.
const INTEGRATOR: f64 = 1.0 + 1e-6;
/// And less than this share of what a change before it leaves.
/// Chosen, not measured.
const CLEARER: f64 = 0.8;
/// What changes leave below which they explain alike: a log of five digits leaves this.
const ROUNDING: f64 = 1e-5;
/// What a law that ran as stated leaves of a log of four digits.
const DIGITS: f64 = 1e-4;
/// A change must leave less than this share of the residual.
/// Chosen, not measured.
const HELPS: f64 = 0.1;

/// Share of what the controller leaves of the input that the excitation in it must explain.
/// A wrong controller leaves the most of the excitation; another signal explains 7 lags over the samples. Chosen, not measured.
const CONTAINED: f64 = 0.1;

/// Compares a controller (positive feedback, `u = K y`) with a record.
///
/// # Errors
/// Shapes; [`youla::Error::Unstable`] for a controller that is unstable by itself, which cannot be simulated.
///
/// ```
/// use youla_loop::check::{Change, CheckOptions, ControllerRecord, controller};
/// use youla::{Mat, lti::{Discrete, StateSpace}};
/// let gain = Mat::from_fn(1, 1, |_, _| -2.0);
/// let empty = |rows, columns| Mat::zeros(rows, columns);
/// let k = StateSpace::new(empty(0, 0), empty(0, 1), empty(1, 0), gain, Discrete::new(0.01)?)?;
/// let y = Mat::from_fn(500, 1, |k, _| (0.1 * k as f64).sin());
/// let u = Mat::from_fn(500, 1, |k, _| 2.0 * y[(k, 0)]);
/// let record = ControllerRecord { u: u.as_ref(), y: y.as_ref(), input_excitation: None, reference: None };
/// let found = controller(&k, record, &CheckOptions::default())?;
/// assert_eq!(found.change.unwrap().0, Change::Sign);
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn controller<'a>(
    declared: impl Into<Declared<'a>>,
    record: ControllerRecord<'_>,
    options: &CheckOptions,
) -> Result<ControllerCheck> {
    let Declared { controller: k, readings, parts: of_gain } = declared.into();
    let log = Log::new(record);
    let excited = record.input_excitation.is_some();
    let moves = |r: MatRef<'_, f64>| r.col_iter().any(|c| c.iter().any(|v| *v != c[0]));
    let guided = record.reference.is_some_and(moves);
    let other = |residual: f64| reading(readings, &log, residual.min(1.0), options);
    if let Err(error) = simulated(k) {
        let change = Some(other(f64::INFINITY).ok_or(error)?);
        return Ok(ControllerCheck { residual: f64::INFINITY, excited, guided, contained: None, change, parts: None });
    }
    let residual = log.residual(k, &log.e, &log.w)?;
    let mut change = None;
    let cautious = residual > options.controller_caution;
    // Beside travel a law with a wrong delay explains nearly all of the input, and the right one all of it.
    let tried = if cautious {
        log.changes(k, of_gain)?
    } else if residual > DIGITS {
        log.shifts(k)?
    } else {
        Vec::new()
    };
    for (candidate, left) in tried {
        // The simpler changes come first; a factor of -1 fits rounding better than a sign does.
        if change.as_ref().is_none_or(|(_, best)| left + ROUNDING < CLEARER * (best + ROUNDING)) {
            change = Some((candidate, left));
        }
    }
    change = change.filter(|(_, left)| *left < HELPS * residual && *left < 5.0 * options.controller_caution);
    let tells =
        |change: &Option<(Change, f64)>| change.as_ref().is_some_and(|(_, left)| *left <= options.controller_caution);
    if cautious && !tells(&change) {
        change = other(residual).or(change);
    }
    // A change that leaves more than a caution may only resemble what happened: a law that explains every part goes before it.
    let varies = (excited || guided) && cautious && !tells(&change);
    let parts = if varies { parts::parts(&log, k, options.controller_caution)? } else { None };
    let parts = parts.filter(|parts| change.is_none() || parts.explain_all());
    let change = change.filter(|_| parts.is_none());
    let contained = if excited && change.is_none() && cautious { Some(log.contained(k)?) } else { None };
    Ok(ControllerCheck { residual, excited, guided, contained, change, parts })
}

/// Refuses a controller that is unstable by itself.
fn simulated(k: &StateSpace<Discrete>) -> Result<()> {
    if k.worst_pole()?.is_some_and(|pole| pole.norm() > INTEGRATOR) {
        k.require_stable("the declared controller, to be simulated by itself")?;
    }
    Ok(())
}

/// The reading that explains the input, with what it leaves.
fn reading(readings: &[Reading], log: &Log<'_>, residual: f64, options: &CheckOptions) -> Option<(Change, f64)> {
    let of = |reading: &Reading| {
        simulated(&reading.controller).ok()?;
        let left = log.residual(&reading.controller, &log.e, &log.w).ok()?;
        Some((Change::Reading(reading.words.clone()), left))
    };
    let best = readings.iter().filter_map(of).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 < HELPS * residual && best.1 <= options.controller_caution).then_some(best)
}

impl ControllerCheck {
    /// Whether the controller explains an input that something from outside moves: then no channel is shifted.
    pub(super) fn agrees(&self, options: &CheckOptions) -> bool {
        self.residual <= options.controller_caution && self.change.is_none() && (self.excited || self.guided)
    }

    /// Samples at which another controller takes over or the declared one comes back.
    pub(super) fn switches(&self) -> Vec<usize> {
        match &self.parts {
            Some(Parts::Switched { holds, .. }) => holds.iter().flat_map(|at| [at.start, at.end]).collect(),
            _ => Vec::new(),
        }
    }
}
