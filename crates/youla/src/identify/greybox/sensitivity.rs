//! How the outputs depend on parameters and initial state: one recursion for all sensitivities.
//!
//! With the state x of the model, `v = [x; u]` and the derivatives of the sampled matrices,
//! ```text
//! x_theta+ = Ad x_theta + [dAd dBd] v,    y_theta = C x_theta + [dC dD] v,      x_theta(0) = 0
//! x_0+     = Ad x_0,                      y_0     = C x_0,                      x_0(0) = I
//! ```
//! so all sensitivities are columns of one matrix (n x columns) under one Ad and share one v. Eight columns at a time stay
//! in registers; terms that are zero for all eight are left out beforehand. The rows `[y_0 y_theta e]` are folded into
//! their triangular factor piece by piece, so that memory does not grow with the record.

use super::narrow::NarrowTriangle;
use super::sampled::SampledSlope;
use crate::lti::{Discrete, SimulationState, Simulator, StateSpace};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Columns that are advanced together.
const LANES: usize = 8;
/// Samples folded in at a time; small enough to stay in the cache.
pub(super) const PIECE: usize = 128;
/// Sensitivities below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;

/// The records of one experiment, sample after sample.
pub(super) struct Samples {
    /// m values per sample.
    pub(super) u: Vec<f64>,
    /// p values per sample.
    pub(super) y: Vec<f64>,
    pub(super) count: usize,
    /// Square root of the weight of each residual, in the order of `y`; empty where all are 1.
    pub(super) roots: Vec<f64>,
}

/// The triangular factor over `[y_0 | y_theta | e]` with the residual `e = y - yhat` of the model started at `x0`.
/// `initial` is n where the sensitivity to the initial state is wanted, else 0.
///
/// # Errors
/// [`Error::Diverged`] where the recursion leaves the range of the numbers.
pub(super) fn condense(
    samples: &Samples,
    system: &StateSpace<Discrete>,
    slopes: &[SampledSlope],
    x0: &[f64],
    initial: usize,
) -> Result<Mat<f64>> {
    let mut rows = Rows::new(samples, system, slopes, x0, initial)?;
    let mut triangle = NarrowTriangle::new(rows.columns + 1);
    let mut piece = Vec::new();
    while let count @ 1.. = rows.fill(&mut piece)? {
        triangle.fold(&mut piece, count);
    }
    Ok(triangle.into_factor())
}

/// The rows `[y_0 y_theta e]`, piece by piece.
pub(super) struct Rows<'a> {
    samples: &'a Samples,
    system: &'a StateSpace<Discrete>,
    simulator: Simulator,
    state: SimulationState,
    bank: Bank,
    /// Without that of e.
    columns: usize,
    signals: Vec<f64>,
    next: usize,
}

impl<'a> Rows<'a> {
    pub(super) fn new(
        samples: &'a Samples,
        system: &'a StateSpace<Discrete>,
        slopes: &[SampledSlope],
        x0: &[f64],
        initial: usize,
    ) -> Result<Self> {
        let simulator = Simulator::new(system);
        let state = simulator.start(x0)?;
        let (bank, columns) = (Bank::new(system, slopes, initial), initial + slopes.len());
        let signals = vec![0.0; system.order() + system.inputs()];
        Ok(Rows { samples, system, simulator, state, bank, columns, signals, next: 0 })
    }

    /// Writes the rows of the next samples, column by column; returns how many, 0 at the end.
    pub(super) fn fill(&mut self, piece: &mut Vec<f64>) -> Result<usize> {
        let (n, m, p) = (self.system.order(), self.system.inputs(), self.system.outputs());
        let (first, columns) = (self.next, self.columns);
        let count = PIECE.min(self.samples.count - first);
        if count == 0 {
            return Ok(0);
        }
        let rows = count * p;
        piece.resize(rows * (columns + 1), 0.0);
        for k in 0..count {
            let u = &self.samples.u[(first + k) * m..][..m];
            let y = &self.samples.y[(first + k) * p..][..p];
            self.signals[..n].copy_from_slice(self.state.x());
            self.signals[n..].copy_from_slice(u);
            self.bank.step(&self.signals, |i, column, value| piece[column * rows + k * p + i] = value);
            for (i, (y, model)) in y.iter().zip(self.simulator.step(&mut self.state, u)).enumerate() {
                piece[columns * rows + k * p + i] = y - model;
            }
        }
        if let Some(roots) = self.samples.roots.get(first * p..first * p + rows) {
            for column in piece.chunks_exact_mut(rows) {
                column.iter_mut().zip(roots).for_each(|(value, root)| *value *= root);
            }
        }
        if !piece.iter().fold(0.0, |sum, v| sum + v * v).is_finite() {
            return Err(diverged(first + 1, self.system));
        }
        self.bank.forget_the_vanished();
        self.next += count;
        Ok(rows)
    }
}

/// The sum of squares of the weighted residual of the model started from rest.
///
/// # Errors
/// [`Error::Diverged`] where the simulation leaves the range of the numbers.
pub(super) fn sum_of_squares(samples: &Samples, system: &StateSpace<Discrete>) -> Result<f64> {
    let (m, p) = (system.inputs(), system.outputs());
    let simulator = Simulator::new(system);
    let mut state = simulator.start(&vec![0.0; system.order()])?;
    let mut sum = 0.0;
    for k in 0..samples.count {
        let model = simulator.step(&mut state, &samples.u[k * m..][..m]);
        let residuals = samples.y[k * p..][..p].iter().zip(model).map(|(y, model)| y - model);
        sum += match samples.roots.get(k * p..(k + 1) * p) {
            None => residuals.map(|e| e.powi(2)).sum::<f64>(),
            Some(roots) => residuals.zip(roots).map(|(e, root)| (root * e).powi(2)).sum::<f64>(),
        };
        if !sum.is_finite() {
            return Err(diverged(k + 1, system));
        }
    }
    Ok(sum)
}

/// The residual of the model started at `x0`, without weights, sample after sample.
///
/// # Errors
/// [`Error::Diverged`] where the simulation leaves the range of the numbers.
pub(super) fn residuals(samples: &Samples, system: &StateSpace<Discrete>, x0: &[f64]) -> Result<Vec<f64>> {
    let (m, p) = (system.inputs(), system.outputs());
    let simulator = Simulator::new(system);
    let mut state = simulator.start(x0)?;
    let mut residuals = Vec::with_capacity(samples.y.len());
    for k in 0..samples.count {
        let model = simulator.step(&mut state, &samples.u[k * m..][..m]);
        residuals.extend(samples.y[k * p..][..p].iter().zip(model).map(|(y, model)| y - model));
    }
    match residuals.iter().position(|e| !e.is_finite()) {
        Some(bad) => Err(diverged(bad / p + 1, system)),
        None => Ok(residuals),
    }
}

fn diverged(sample: usize, system: &StateSpace<Discrete>) -> Error {
    let pole = system.worst_pole().ok().flatten();
    Error::Diverged { what: "the simulation of the model to be fitted".into(), sample, pole }
}

/// All sensitivities, in groups of eight columns.
struct Bank {
    groups: Vec<Group>,
    columns: usize,
}

/// Eight columns: their states and what moves them.
struct Group {
    states: Vec<[f64; LANES]>,
    next: Vec<[f64; LANES]>,
    state_rows: Vec<Row>,
    output_rows: Vec<Row>,
}

/// One row of the recursion, without its zeros.
struct Row {
    /// State and coefficient.
    states: Vec<(usize, f64)>,
    /// Signal of v and its coefficient for each column.
    signals: Vec<(usize, [f64; LANES])>,
}

impl Bank {
    fn new(system: &StateSpace<Discrete>, slopes: &[SampledSlope], initial: usize) -> Self {
        let n = system.order();
        let columns = initial + slopes.len();
        let slope_of = |column: usize| column.checked_sub(initial).and_then(|theta| slopes.get(theta));
        let groups = (0..columns).step_by(LANES).map(|first| {
            let lanes = |value: &dyn Fn(usize) -> f64| std::array::from_fn::<f64, LANES, _>(|lane| value(first + lane));
            let rows = |from: MatRef<'_, f64>, part: fn(&SampledSlope) -> MatRef<'_, f64>| {
                (0..from.nrows())
                    .map(|i| Row {
                        states: (0..n).map(|j| (j, from[(i, j)])).filter(|(_, a)| *a != 0.0).collect(),
                        signals: (0..n + system.inputs())
                            .map(|b| (b, lanes(&|column| slope_of(column).map_or(0.0, |slope| part(slope)[(i, b)]))))
                            .filter(|(_, coefficients)| coefficients.iter().any(|c| *c != 0.0))
                            .collect(),
                    })
                    .collect()
            };
            Group {
                states: (0..n)
                    .map(|i| lanes(&|column| if column < initial && column == i { 1.0 } else { 0.0 }))
                    .collect(),
                next: vec![[0.0; LANES]; n],
                state_rows: rows(system.a(), |slope| slope.states.as_ref()),
                output_rows: rows(system.c(), |slope| slope.outputs.as_ref()),
            }
        });
        Bank { groups: groups.collect(), columns }
    }

    /// Hands out the sensitivities of the outputs, `write(output, column, value)`, and advances by one sample.
    #[inline]
    fn step(&mut self, signals: &[f64], mut write: impl FnMut(usize, usize, f64)) {
        for (g, group) in self.groups.iter_mut().enumerate() {
            let columns = LANES.min(self.columns - g * LANES);
            for (i, row) in group.output_rows.iter().enumerate() {
                let values = row.apply(&group.states, signals);
                values[..columns].iter().enumerate().for_each(|(lane, value)| write(i, g * LANES + lane, *value));
            }
            for (next, row) in group.next.iter_mut().zip(&group.state_rows) {
                *next = row.apply(&group.states, signals);
            }
            std::mem::swap(&mut group.states, &mut group.next);
        }
    }

    fn forget_the_vanished(&mut self) {
        let values = self.groups.iter_mut().flat_map(|group| group.states.iter_mut().flatten());
        values.filter(|v| v.abs() < VANISHED).for_each(|v| *v = 0.0);
    }
}

impl Row {
    #[inline]
    fn apply(&self, states: &[[f64; LANES]], signals: &[f64]) -> [f64; LANES] {
        let mut total = [0.0; LANES];
        for (j, coefficient) in &self.states {
            total.iter_mut().zip(&states[*j]).for_each(|(sum, state)| *sum += coefficient * state);
        }
        for (b, coefficients) in &self.signals {
            let signal = signals[*b];
            total.iter_mut().zip(coefficients).for_each(|(sum, coefficient)| *sum += coefficient * signal);
        }
        total
    }
}
