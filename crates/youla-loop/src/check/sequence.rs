//! Rows that are lost or logged twice where the time column does not show it, and offsets that jump.
//!
//! Under a controller the input is a difference equation of its own past, the outputs and the known excitations, nearly without noise:
//! ```text
//! u(k) = sum_i (A_i u(k-i) + B_i y(k-i) + C_i x(k-i)) + e(k)
//! ```
//! Where e stands out at a few rows and nearly vanishes once one unknown row is put in before them, or a row is taken out, or an offset
//! is taken off an output from there on, that is what happened. Rows in which all channels repeat the row before are counted directly where repeated values of y are rare.

use super::finding::{Finding, Severity, Test, with_unit};
use super::regression::{Fit, Lagged};
use crate::error::Result;
use youla::linalg::least_squares;
use youla::signal::Channel;
use youla::statistics::robust_deviation;
use youla::{Mat, MatRef};

/// What happened to a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Break {
    /// One row is lost before this sample, counted from 0.
    Lost(usize),
    /// This sample repeats the one before.
    Twice(usize),
    /// From this sample on an output, counted from 0, has an offset, in its unit.
    Jump(usize, usize, f64),
    /// From this sample on an output, counted from 0, is wrong in so many samples.
    Wrong(usize, usize, usize),
}

/// Deviation of e, in those of u, up to which the equation is taken as exact.
/// Converters of 12 bits leave 1e-3. Chosen, not measured.
const EXACT: f64 = 0.02;
/// Deviations from which e stands out, and part of u that it must be at least.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const GREAT: f64 = 20.0;
const LEAST: f64 = 1e-7;
/// Part of its energy that may be left.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const LEFT: f64 = 0.01;
/// Share that counts as nothing when explanations are compared.
const ROUNDING: f64 = 1e-6;
/// Most wrong samples in a row, and least offset or error in deviations of the output.
/// Chosen, not measured.
const IN_A_ROW: usize = 3;
const SIZE: f64 = 0.05;
/// Share of the rows that keep the value of the row before, from which an input is held; a controller at every second row keeps half.
const HELD: f64 = 0.4;
/// Breaks that are looked for; more are no accident.
const PLACES: usize = 3;

/// Breaks of a record of m inputs, p outputs and known excitations, in this order. None without an excitation in the log: where one
/// begins or changes that is not logged, the equation breaks as at a lost row.
pub(super) fn of_record(lagged: &Lagged, m: usize, p: usize, known: usize) -> Result<Vec<Break>> {
    let mut all = Vec::new();
    if known == 0 {
        return Ok(all);
    }
    for input in (0..m).filter(|input| !held(lagged, *input)) {
        let outside = m + p..m + p + known;
        let columns =
            [lagged.past(0..m, 1), lagged.past(m..m + p, 0), lagged.past(outside, 0), vec![lagged.trend(0)]].concat();
        let (fit, e) = lagged.robust_fit(&[lagged.column(input, 0)], columns)?;
        let sigma = robust_deviation(e[0].iter().copied());
        let least = (GREAT * sigma).max(LEAST);
        let great: Vec<usize> = (0..e[0].len()).filter(|k| e[0][*k].abs() > least).collect();
        let starts: Vec<usize> = great
            .iter()
            .enumerate()
            .filter(|(i, k)| *i == 0 || **k > great[i - 1] + lagged.lags)
            .map(|(_, k)| *k)
            .collect();
        if sigma > EXACT || starts.len() > PLACES {
            continue;
        }
        let equation = Equation { lagged, fit: &fit, input, outputs: [m, p], sigma };
        for first in starts {
            let at = first + lagged.lags;
            // Where the equation has not held before, nothing says that it broke.
            if first < lagged.lags {
                continue;
            }
            // Where an excitation begins, directions are excited that the regression could not tell before.
            if (m + p..m + p + known).any(|s| begins(lagged, s, at)) {
                continue;
            }
            if let Some(found) = equation.explanation(at).filter(|found| !all.contains(found)) {
                all.push(found);
            }
        }
    }
    Ok(all)
}

/// Whether an input keeps its value in so many rows that its controller acts less often than the log has rows: it is no difference equation
/// in these rows.
fn held(lagged: &Lagged, input: usize) -> bool {
    let samples = lagged.rows + lagged.lags;
    let kept = (1..samples).filter(|k| lagged.sample(input, *k) == lagged.sample(input, k - 1)).count();
    kept as f64 > HELD * samples as f64
}

/// Whether a signal that rested for all lags moves at a sample or next to it.
fn begins(lagged: &Lagged, signal: usize, at: usize) -> bool {
    let moves = |k: usize| lagged.sample(signal, k) != lagged.sample(signal, k - 1);
    let rests = |k: usize| (k.saturating_sub(lagged.lags).max(1)..k).all(|i| !moves(i));
    (at.saturating_sub(1).max(1)..=at + 1).any(|k| moves(k) && rests(k))
}

struct Equation<'a> {
    lagged: &'a Lagged,
    fit: &'a Fit,
    input: usize,
    /// Place of the first output, and their number.
    outputs: [usize; 2],
    sigma: f64,
}

impl Equation<'_> {
    fn explanation(&self, at: usize) -> Option<Break> {
        let places = at.saturating_sub(1).max(self.lagged.lags + 1)..=at + 1;
        let [m, p] = self.outputs;
        let outputs = (0..p).flat_map(|i| (0..=IN_A_ROW).map(move |count| (i, count)));
        let of_outputs = places.clone().flat_map(|k| outputs.clone().map(move |(i, count)| (k, i, count)));
        let of_outputs = of_outputs.filter_map(|(k, i, count)| self.output(k, (i, m + i), count));
        let of_rows = places.flat_map(|k| [(Break::Twice(k), 0), (Break::Lost(k), self.signals().len() as i32)]);
        let of_rows = of_rows.filter_map(|(found, numbers)| Some((found, self.left(found)?, numbers)));
        let enough = of_outputs.chain(of_rows).filter(|found| found.1 < LEFT);
        // What is left, four times as much for each further number.
        let score = |found: &(Break, f64, i32)| (found.1 + ROUNDING) * 4f64.powi(found.2);
        enough.min_by(|a, b| score(a).total_cmp(&score(b))).map(|found| found.0)
    }

    /// The offset of an output from a sample on (`count` 0), or so many wrong samples of it; the part of the energy of e that is left, and
    /// how many numbers are fitted.
    fn output(&self, at: usize, (output, signal): (usize, usize), count: usize) -> Option<(Break, f64, i32)> {
        let rows = self.lagged.lags.min((self.lagged.rows + self.lagged.lags).saturating_sub(at));
        if rows < 4 {
            return None;
        }
        let e = Mat::from_fn(rows, 1, |j, _| self.error(at + j, &|lag| Some(at + j - lag)));
        let pattern = Mat::from_fn(rows, count.max(1), |j, c| match count {
            0 => -(0..=j).map(|lag| self.coefficient(signal, lag)).sum::<f64>(),
            _ => j.checked_sub(c).map_or(0.0, |lag| -self.coefficient(signal, lag)),
        });
        let x = least_squares("wrong samples of an output", pattern.as_ref(), e.as_ref()).ok()?.x;
        let rest = &e - &pattern * &x;
        let size = x.norm_max();
        let found = match count {
            0 => Break::Jump(at, output, x[(0, 0)] * self.lagged.deviations[signal]),
            _ => Break::Wrong(at, output, count),
        };
        let share = self.share(&rest, &e)?;
        (size > SIZE).then_some((found, share, count.max(1) as i32))
    }

    fn share(&self, rest: &Mat<f64>, before: &Mat<f64>) -> Option<f64> {
        let usual = before.nrows() as f64 * (4.0 * self.sigma).powi(2);
        let before = before.squared_norm_l2();
        (before > 2.0 * usual).then(|| (rest.squared_norm_l2() - usual).max(0.0) / before)
    }

    /// Part of the energy of e after the break that the changed sequence leaves, beyond that of the usual e.
    fn left(&self, found: Break) -> Option<f64> {
        let (at, lags) = match found {
            Break::Lost(at) => (at, self.lagged.lags),
            // The repeated row itself is none.
            Break::Twice(at) | Break::Jump(at, ..) | Break::Wrong(at, ..) => (at + 1, self.lagged.lags),
        };
        let rows = lags.min(self.lagged.rows + lags - 1 - at.min(self.lagged.rows + lags - 1));
        if rows < 4 {
            return None;
        }
        let plain = Mat::from_fn(rows, 1, |j, _| self.error(at + j, &|lag| Some(at + j - lag)));
        let changed = Mat::from_fn(rows, 1, |j, _| {
            self.error(at + j, &|lag| match found {
                Break::Lost(_) if lag == j + 1 => None,
                Break::Lost(_) if lag > j + 1 => Some(at + j + 1 - lag),
                Break::Twice(_) if lag > j => (at + j).checked_sub(lag + 1),
                _ => Some(at + j - lag),
            })
        });
        let rest = match found {
            Break::Lost(_) => {
                // The samples of the lost row are unknown: one column for each signal with a lag.
                let signals = self.signals();
                let of = |j: usize, s: usize| self.coefficient(signals[s], j + 1);
                let unknown = Mat::from_fn(rows, signals.len(), of);
                let x = least_squares("the lost row", unknown.as_ref(), changed.as_ref()).ok()?.x;
                &changed - &unknown * x
            }
            _ => changed,
        };
        self.share(&rest, &plain)
    }

    fn signals(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self
            .fit
            .columns
            .iter()
            .filter(|c| self.lagged.lag(**c).is_some())
            .map(|c| self.lagged.signal(*c))
            .collect();
        all.dedup();
        all
    }

    fn coefficient(&self, signal: usize, lag: usize) -> f64 {
        if lag > self.lagged.lags {
            return 0.0;
        }
        let column = self.lagged.column(signal, lag as isize);
        self.fit.columns.iter().position(|c| *c == column).map_or(0.0, |k| self.fit.coefficients[(k, 0)])
    }

    /// `u(t)` less its equation, where the sample of each lag is taken from elsewhere; `None` counts as 0.
    fn error(&self, t: usize, place: &dyn Fn(usize) -> Option<usize>) -> f64 {
        let mut left = self.lagged.sample(self.input, t);
        for (k, column) in self.fit.columns.iter().enumerate() {
            let value = match self.lagged.lag(*column) {
                Some(lag) => place(lag as usize).map_or(0.0, |at| self.lagged.sample(self.lagged.signal(*column), at)),
                None => 1.0,
            };
            left -= self.fit.coefficients[(k, 0)] * value;
        }
        left
    }
}

/// Samples, counted from 0, in which all channels repeat the sample before; none before the outputs first move, and where these repeat themselves
/// by their steps or because they are held: then the other channels repeat beside some of them by chance.
pub(super) fn repeated(groups: &[MatRef<'_, f64>], y: MatRef<'_, f64>) -> Vec<usize> {
    let same = |x: MatRef<'_, f64>, k: usize| (0..x.ncols()).all(|j| x[(k, j)] == x[(k - 1, j)]);
    let moves = (1..y.nrows()).find(|k| !same(y, *k)).unwrap_or(y.nrows());
    let rows: Vec<usize> = (moves..y.nrows()).filter(|k| groups.iter().all(|x| same(*x, *k))).collect();
    let held = || (moves..y.nrows()).filter(|k| same(y, *k)).count() >= HELD_ROWS * rows.len();
    let by_chance = rows.is_empty() || rows.len() > PLACES || held() || (0..y.ncols()).any(|j| in_steps(y, j));
    if by_chance { Vec::new() } else { rows }
}

/// Samples in which the outputs repeat, for each row in which all channels do, from which the outputs are held.
/// Chosen: the repeated rows of a log repeat its outputs once each.
const HELD_ROWS: usize = 3;

/// Whether the smallest differences between successive samples are equal to each other: then some are zero by chance.
fn in_steps(y: MatRef<'_, f64>, j: usize) -> bool {
    let step = |k: usize| (y[(k, j)] - y[(k - 1, j)]).abs();
    let least = (1..y.nrows()).map(step).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    (1..y.nrows()).filter(|k| step(*k) > 0.0 && step(*k) < 1.5 * least).count() > 2
}

impl Break {
    pub(super) fn finding(self, record: &str, first: usize, outputs: &[Channel]) -> Finding {
        let (at, what, advice) = match self {
            Break::Jump(at, output, by) => {
                let none = Channel::new("", "");
                return jump(record, first + at, by, outputs.get(output).unwrap_or(&none));
            }
            Break::Wrong(at, output, count) => {
                let channel = outputs.get(output).map_or("", |c| c.name.as_str());
                let rows = if count == 1 { "1 outlier".to_owned() } else { format!("{count} outliers in a row") };
                let what = format!("{rows}: the input does not show it, though it follows the output everywhere else");
                let finding = Finding::new(Test::Outliers, Severity::Caution, record, what).channel(channel);
                return finding.rows(first + at, first + at + count - 1).advice("Exclude the rows by `segments`");
            }
            Break::Lost(at) => (
                at,
                format!("a row is lost before row {}, though the time column does not show it", first + at),
                "Split the record there by `segments`; check the logger for overruns and rewritten time stamps",
            ),
            Break::Twice(at) => (
                at,
                format!("row {} repeats the row before in all channels", first + at),
                "Remove the row, or split the record there by `segments`",
            ),
        };
        Finding::new(Test::Timing, Severity::Defect, record, what).rows(first + at, first + at).advice(advice)
    }
}

/// An offset that is added from a row on.
pub(super) fn jump(record: &str, row: usize, by: f64, channel: &Channel) -> Finding {
    let what = format!("its offset jumps by {} at row {row}", with_unit(by, &channel.unit));
    let advice = "Use the parts before and after this row as two `segments`, each with its own mean; check sensor, range switch and \
                  zeroing, and without a time column whether a row is missing there";
    let finding = Finding::new(Test::Drift, Severity::Defect, record, what).channel(&channel.name);
    finding.rows(row, row).number("jump", by).advice(advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row that a log has twice is found; where a sensor delivers every second sample, an input that is held for five repeats beside it.
    #[test]
    fn rows_of_held_sensors_repeat_by_chance() {
        let moving = |t: usize| (0.37 * t as f64).sin();
        let log = |at: &dyn Fn(usize) -> [f64; 2]| Mat::from_fn(400, 2, |t, j| at(t)[j]);
        let place = |t: usize| if t < 200 { t } else { t - 1 };
        let twice = log(&|t| [moving(3 * place(t)), moving(place(t))]);
        assert_eq!(repeated(&[twice.as_ref()], twice.subcols(1, 1)), [200]);
        let held = log(&|t| [moving(t / 5 * 5), moving(t / 2 * 2)]);
        assert!(repeated(&[held.as_ref()], held.subcols(1, 1)).is_empty());
    }
}
