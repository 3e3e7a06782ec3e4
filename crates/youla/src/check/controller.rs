//! Whether the declared controller gives the logged input, and what would make it do so.
//!
//! With positive feedback `u = K (y - r) + d` the declared K is simulated on the logged `e = y - r`, from the state that fits best,
//! and held against `w = u - d`:
//! ```text
//! residual = |w - K e| / |w|     (about their means)
//! ```
//! Where it is large the same is tried with one thing changed at a time: the sign, one sample earlier or later, a factor on each channel of e
//! by least squares, two channels exchanged, the input limited to its own range, d left out or with the other sign. A change
//! is proposed where it brings the residual below a tenth of what it was and below `controller_caution` twice over, or to nearly nothing.
//! Where no excitation is declared, the residual is the excitation itself, if the controller is right.

use super::CheckOptions;
use super::finding::{Finding, Severity, Test, few};
use crate::linalg::least_squares;
use crate::lti::{Discrete, StateSpace, simulate_best};
use crate::units::Channel;
use crate::{Error, Mat, MatRef, Result};

/// A change that would make the controller fit the log.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The other sign of feedback.
    Sign,
    /// y (and r) by so many rows later (positive) or earlier than they stand.
    Shift(isize),
    /// u by so many rows earlier (positive) or later than it stands, against y, r and the excitation.
    InputShift(isize),
    /// A factor on all channels of `y - r`: a gain of the controller.
    Gain(f64),
    /// A factor on one measured output, counted from 0, and not on its reference.
    ChannelGain(usize, f64),
    /// Two outputs exchanged.
    Exchanged(usize, usize),
    /// The input limited to the range that it has in the log.
    Saturation([f64; 2]),
    /// The input was logged before the excitation was added.
    WithoutExcitation,
    /// The excitation with the other sign.
    ExcitationSign,
}

/// How far the declared controller explains the logged input.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerCheck {
    /// Relative residual.
    pub residual: f64,
    /// Whether an excitation at the plant input is declared.
    pub excited: bool,
    /// The change that leaves least, and what it leaves, where one would help.
    pub change: Option<(Change, f64)>,
}

/// What the controller is held against.
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
const INTEGRATOR: f64 = 1.0 + 1e-6;
/// A change must leave less than this share of the residual.
const HELPS: f64 = 0.1;

/// Holds a controller (positive feedback, `u = K y`) against a record.
///
/// # Errors
/// Shapes; [`Error::Unstable`] for a controller that is unstable by itself, which cannot be simulated.
///
/// ```
/// use youla::check::{Change, CheckOptions, ControllerRecord, controller};
/// use youla::{Mat, lti::{Discrete, StateSpace}};
/// let gain = Mat::from_fn(1, 1, |_, _| -2.0);
/// let empty = |rows, columns| Mat::zeros(rows, columns);
/// let k = StateSpace::new(empty(0, 0), empty(0, 1), empty(1, 0), gain, Discrete::new(0.01)?)?;
/// let y = Mat::from_fn(500, 1, |k, _| (0.1 * k as f64).sin());
/// let u = Mat::from_fn(500, 1, |k, _| 2.0 * y[(k, 0)]);
/// let record = ControllerRecord { u: u.as_ref(), y: y.as_ref(), input_excitation: None, reference: None };
/// let found = controller(&k, record, &CheckOptions::default())?;
/// assert_eq!(found.change.unwrap().0, Change::Sign);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn controller(
    k: &StateSpace<Discrete>,
    record: ControllerRecord<'_>,
    options: &CheckOptions,
) -> Result<ControllerCheck> {
    if k.worst_pole()?.is_some_and(|pole| pole.norm() > INTEGRATOR) {
        k.require_stable("the declared controller, to be simulated by itself")?;
    }
    let log = Log::new(record);
    let residual = log.residual(k, &log.e, &log.w)?;
    let excited = record.input_excitation.is_some();
    let mut change = None;
    if residual > options.controller_caution {
        for (candidate, left) in log.changes(k)? {
            if change.as_ref().is_none_or(|(_, best)| left < *best) {
                change = Some((candidate, left));
            }
        }
        let least = HELPS * residual;
        change = change.filter(|(_, left)| *left < least && *left < 5.0 * options.controller_caution);
    }
    Ok(ControllerCheck { residual, excited, change })
}

/// Signals of the controller: `w = K e`.
struct Log<'a> {
    record: ControllerRecord<'a>,
    e: Mat<f64>,
    w: Mat<f64>,
}

impl<'a> Log<'a> {
    fn new(record: ControllerRecord<'a>) -> Self {
        let e = record.reference.map_or_else(|| record.y.to_owned(), |r| record.y - r);
        let w = record.input_excitation.map_or_else(|| record.u.to_owned(), |d| record.u - d);
        Log { record, e, w }
    }

    fn residual(&self, k: &StateSpace<Discrete>, e: &Mat<f64>, w: &Mat<f64>) -> Result<f64> {
        Ok(relative(&(w - simulate_best(k, e.as_ref(), w.as_ref())?), w))
    }

    /// Every change with the residual that it leaves.
    fn changes(&self, k: &StateSpace<Discrete>) -> Result<Vec<(Change, f64)>> {
        let mut all = vec![(Change::Sign, self.residual(&k.negated(), &self.e, &self.w)?)];
        let d = self.record.input_excitation;
        for rows in [-1isize, 1] {
            let (e, w) = shifted(&self.e, &self.w, rows);
            all.push((Change::Shift(rows), self.residual(k, &e, &w)?));
            let Some(d) = d else { continue };
            let (d, u) = shifted(&d.to_owned(), &self.record.u.to_owned(), rows);
            all.push((Change::InputShift(rows), self.residual(k, &e, &(&u - &d))?));
        }
        if let Some(d) = d {
            all.push((Change::WithoutExcitation, self.residual(k, &self.e, &self.record.u.to_owned())?));
            all.push((Change::ExcitationSign, self.residual(k, &self.e, &(self.record.u + d))?));
        }
        all.extend(self.gains(k)?);
        let p = self.e.ncols();
        for (i, j) in (0..p).flat_map(|i| (i + 1..p).map(move |j| (i, j))) {
            let place = |c: usize| {
                if c == i {
                    j
                } else if c == j {
                    i
                } else {
                    c
                }
            };
            let e = match self.record.reference {
                // The measured channels are exchanged, the references are not.
                Some(r) => Mat::from_fn(self.e.nrows(), p, |t, c| self.record.y[(t, place(c))] - r[(t, c)]),
                None => Mat::from_fn(self.e.nrows(), p, |t, c| self.e[(t, place(c))]),
            };
            all.push((Change::Exchanged(i, j), self.residual(k, &e, &self.w)?));
        }
        all.extend(self.saturation(k)?);
        Ok(all)
    }

    /// One factor for all channels of e, and one for each alone, by least squares.
    fn gains(&self, k: &StateSpace<Discrete>) -> Result<Vec<(Change, f64)>> {
        let (n, m, p) = (self.e.nrows(), self.w.ncols(), self.e.ncols());
        let mut parts = Vec::new();
        for channel in 0..p {
            let alone = Mat::from_fn(n, p, |t, c| if c == channel { self.e[(t, c)] } else { 0.0 });
            parts.push(centred(&crate::lti::simulate(k, alone.as_ref(), &vec![0.0; k.order()])?));
        }
        let w = centred(&self.w);
        // The start, where the state is not known, does not count.
        let from = n / 20;
        let stacked = |x: &Mat<f64>| {
            let rows = n - from;
            Mat::from_fn(rows * m, 1, |t, _| x[(from + t % rows, t / rows)])
        };
        let target = stacked(&w);
        let sum = parts.iter().fold(Mat::zeros(n, m), |sum, part| sum + part);
        let mut all = Vec::new();
        let mut one = |change: &dyn Fn(f64) -> Change, regressor: &Mat<f64>, target: &Mat<f64>| -> Result<()> {
            let found = least_squares("the gain of the controller", regressor.as_ref(), target.as_ref())?;
            let left = target - regressor * &found.x;
            all.push((change(found.x[(0, 0)]), left.norm_l2() / stacked(&w).norm_l2()));
            Ok(())
        };
        one(&Change::Gain, &stacked(&sum), &target)?;
        // A channel in another unit is a factor on what was measured; the reference keeps its unit.
        for (channel, part) in parts.iter().enumerate() {
            let measured = match self.record.reference {
                Some(_) => {
                    let alone = Mat::from_fn(n, p, |t, c| if c == channel { self.record.y[(t, c)] } else { 0.0 });
                    centred(&crate::lti::simulate(k, alone.as_ref(), &vec![0.0; k.order()])?)
                }
                None if p > 1 => part.clone(),
                None => continue,
            };
            let others = stacked(&(&sum - &measured));
            one(&|gain| Change::ChannelGain(channel, gain), &stacked(&measured), &(&target - others))?;
        }
        Ok(all)
    }

    fn saturation(&self, k: &StateSpace<Discrete>) -> Result<Option<(Change, f64)>> {
        let u = self.record.u;
        let free = simulate_best(k, self.e.as_ref(), self.w.as_ref())?;
        let free = self.record.input_excitation.map_or_else(|| free.clone(), |d| &free + d);
        let limits = |j: usize| {
            let values = u.col(j);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            [low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
        };
        let all: Vec<[f64; 2]> = (0..u.ncols()).map(limits).collect();
        let held = Mat::from_fn(u.nrows(), u.ncols(), |t, j| free[(t, j)].clamp(all[j][0], all[j][1]));
        let left = relative(&(u - held), &u.to_owned());
        Ok(all.first().map(|limits| (Change::Saturation(*limits), left)))
    }
}

/// `e(k - rows)` beside `w(k)`.
fn shifted(e: &Mat<f64>, w: &Mat<f64>, rows: isize) -> (Mat<f64>, Mat<f64>) {
    let count = e.nrows() - rows.unsigned_abs();
    let (of_e, of_w) = if rows > 0 { (0, rows.unsigned_abs()) } else { (rows.unsigned_abs(), 0) };
    (e.subrows(of_e, count).to_owned(), w.subrows(of_w, count).to_owned())
}

fn centred(x: &Mat<f64>) -> Mat<f64> {
    let mean: Vec<f64> = x.col_iter().map(|c| c.iter().sum::<f64>() / x.nrows() as f64).collect();
    Mat::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] - mean[j])
}

fn relative(left: &Mat<f64>, of: &Mat<f64>) -> f64 {
    let size = centred(of).norm_l2();
    if size > 0.0 { centred(left).norm_l2() / size } else { f64::INFINITY }
}

/// Factors that are known from units: degrees and radians, revolutions, thousands.
const UNITS: [(f64, &str); 4] = [
    (57.295_779_513_082_32, "180 / pi, degrees against radians"),
    (std::f64::consts::TAU, "2 pi, revolutions against radians"),
    (1e3, "1000, milli"),
    (1e6, "1e6, micro"),
];

impl Change {
    fn words(&self, outputs: &[Channel]) -> String {
        let name = |i: usize| outputs.get(i).map_or("an output", |c| c.name.as_str());
        let rows = |rows: isize| if rows > 0 { "later" } else { "earlier" };
        let unit = |gain: f64| {
            let of = |factor: f64| (gain / factor - 1.0).abs() < 0.02 || (gain * factor - 1.0).abs() < 0.02;
            UNITS.iter().find(|(factor, _)| of(*factor)).map_or(String::new(), |(_, text)| format!(" ({text}?)"))
        };
        match self {
            Change::Sign => {
                "the other sign: change `feedback` in [controller] to the other of \"negative\" and \"positive\"".into()
            }
            Change::Shift(by) => format!("the outputs (and references) one sample {} against the input", rows(*by)),
            Change::InputShift(by) => {
                format!("the input one sample {} against all other channels", rows(-*by))
            }
            Change::Gain(gain) => format!("{} times the gain{}", few(*gain), unit(*gain)),
            Change::ChannelGain(i, gain) => format!("{} times {}{}", few(*gain), name(*i), unit(*gain)),
            Change::Exchanged(i, j) => format!("{} and {} exchanged", name(*i), name(*j)),
            Change::Saturation([low, high]) => format!("the input limited to {} ... {}", few(*low), few(*high)),
            Change::WithoutExcitation => "the excitation left out: the input was logged before it was added".into(),
            Change::ExcitationSign => "the other sign of the excitation".into(),
        }
    }

    /// Key in the numbers of a finding, with its value.
    fn number(&self) -> (&'static str, f64) {
        match self {
            Change::Sign => ("sign", -1.0),
            Change::Shift(rows) => ("shift", *rows as f64),
            Change::InputShift(rows) => ("input_shift", *rows as f64),
            Change::Gain(gain) => ("gain", *gain),
            Change::ChannelGain(_, gain) => ("channel_gain", *gain),
            Change::Exchanged(..) => ("exchanged", 1.0),
            Change::Saturation([_, high]) => ("saturation", *high),
            Change::WithoutExcitation => ("without_excitation", 1.0),
            Change::ExcitationSign => ("excitation_sign", -1.0),
        }
    }
}

impl ControllerCheck {
    pub(super) fn finding(&self, record: &str, outputs: &[Channel], options: &CheckOptions) -> Option<Finding> {
        if self.residual <= options.controller_caution {
            return None;
        }
        let percent = few(100.0 * self.residual);
        let (severity, what) = match (&self.change, self.excited) {
            (None, false) => (
                Severity::Note,
                format!(
                    "the declared controller leaves {percent} % of the logged input: that is an excitation which is not \
                     declared, or the controller is another one"
                ),
            ),
            _ => {
                let severe = self.residual > options.controller_defect;
                let severity = if severe { Severity::Defect } else { Severity::Caution };
                (severity, format!("the declared controller leaves {percent} % of the logged input"))
            }
        };
        let advice = match &self.change {
            Some((change, left)) => {
                format!("It would leave {} % with {}", few(100.0 * left), change.words(outputs))
            }
            None if self.excited => {
                "Look for saturation, a delay, another sample time or another controller; no single change of sign, gain, \
                 shift or channels explains it"
                    .into()
            }
            None => "Log the excitation, or accept that the controller cannot be checked".into(),
        };
        let mut finding = Finding::new(Test::Controller, severity, record, what).number("residual", self.residual);
        if let Some((change, left)) = &self.change {
            let (key, value) = change.number();
            finding = finding.number("residual_after", *left).number(key, value);
        }
        Some(finding.advice(&advice))
    }
}

/// The finding for a controller that could not be simulated.
pub(super) fn not_simulated(record: &str, error: &Error) -> Finding {
    let what = format!("the declared controller cannot be held against the logged input: {error}");
    Finding::new(Test::Controller, Severity::Note, record, what)
        .advice("`youla identify` checks it through the coprime factors (controller_mismatch)")
}
