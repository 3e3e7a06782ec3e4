//! Measured responses with their covariance.

use crate::lti::{Discrete, FrequencyResponse};
use crate::signal::{Excited, LineResponse, inverse};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};
use std::f64::consts::{PI, TAU};

/// A response from a table: of a plant from u to y, or of a loop from its excitation to u and y.
#[derive(Debug, Clone)]
pub struct ResponseTable {
    /// Angular frequencies, rad/s, increasing.
    pub omega: Vec<f64>,
    /// The response at each of them.
    pub values: Vec<Mat<c64>>,
    /// What is known of the errors.
    pub variance: ResponseVariance,
}

/// Variance `E |error|^2` of each entry of a response, a matrix for each frequency.
#[derive(Debug, Clone, PartialEq)]
pub enum ResponseVariance {
    /// Nothing is known: the distance of the lines from the model says it.
    Unknown,
    /// Up to a common factor, as of a coherence from an unknown number of averages.
    Proportional(Vec<Mat<f64>>),
    /// In full.
    Known(Vec<Mat<f64>>),
}

impl ResponseVariance {
    fn stated(&self) -> Option<&[Mat<f64>]> {
        match self {
            ResponseVariance::Unknown => None,
            ResponseVariance::Proportional(all) | ResponseVariance::Known(all) => Some(all),
        }
    }
}

/// A measured response as lines `Y = G U + V` of which `[U; Y]` has a known covariance.
#[derive(Debug, Clone)]
pub struct MeasuredResponse {
    pub(super) time: Discrete,
    pub(super) omega: Vec<f64>,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// The experiments of each line.
    pub(super) lines: Vec<Vec<Column>>,
    /// Degrees of freedom of the covariances at a line; infinite where they are stated; `None` where their size is not known.
    pub(super) degrees: Option<f64>,
    /// Whether covariances of unknown size are stated.
    pub(super) proportional: bool,
    /// Whether U is known without error.
    pub(super) exact_inputs: bool,
}

/// One experiment of a line.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub(super) u: Vec<c64>,
    pub(super) y: Vec<c64>,
    /// Of `[u; y]`.
    pub(super) covariance: Mat<c64>,
}

impl Column {
    fn new(signals: &[c64], inputs: usize, covariance: Mat<c64>) -> Self {
        let (u, y) = signals.split_at(inputs);
        Column { u: u.to_vec(), y: y.to_vec(), covariance }
    }
}

impl MeasuredResponse {
    /// The lines of a periodic excitation, from the excitation of a loop to `z = [u, y]`; u has as many signals as the excitation.
    ///
    /// # Errors
    /// [`Error::Ports`] unless z has more signals than the excitation.
    pub fn of_loop_lines(found: &LineResponse, time: Discrete) -> Result<Self> {
        let (q, m) = (found.response.at(0).nrows(), found.response.at(0).ncols());
        if q <= m {
            let what = "the number of signals u and y together".into();
            return Err(Error::Ports { what, expected: m + 1, found: q });
        }
        let columns = |k: usize| {
            let Excited { outputs, covariance, .. } = found.excited(k);
            let column = |e: usize| outputs.col(e).iter().copied().collect::<Vec<_>>();
            (0..outputs.ncols()).map(|e| Column::new(&column(e), m, covariance.clone())).collect()
        };
        let lines = (0..found.lines.len()).map(columns).collect();
        let (omega, degrees) = (found.response.omega.clone(), Some(found.degrees()));
        Ok(MeasuredResponse {
            time,
            omega,
            inputs: m,
            outputs: q - m,
            lines,
            degrees,
            proportional: false,
            exact_inputs: false,
        })
    }

    /// The lines of a periodic excitation that is itself the input, as alpha of the deviation system S with `z = beta`.
    pub fn of_system_lines(found: &LineResponse, time: Discrete) -> Self {
        let (p, m) = (found.response.at(0).nrows(), found.response.at(0).ncols());
        let columns = |k: usize| {
            let Excited { inputs, outputs, covariance } = found.excited(k);
            let whole = Mat::from_fn(m + p, m + p, |i, j| match i >= m && j >= m {
                true => covariance[(i - m, j - m)],
                false => c64::ZERO,
            });
            let column = |e: usize| {
                let signals: Vec<c64> = inputs.col(e).iter().chain(outputs.col(e).iter()).copied().collect();
                Column::new(&signals, m, whole.clone())
            };
            (0..outputs.ncols()).map(column).collect()
        };
        let lines = (0..found.lines.len()).map(columns).collect();
        let (omega, degrees) = (found.response.omega.clone(), Some(found.degrees()));
        MeasuredResponse { time, omega, inputs: m, outputs: p, lines, degrees, proportional: false, exact_inputs: true }
    }

    /// The response of a plant from u to y, p x m.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`]; [`Error::OutOfRange`] for a frequency that is negative, above the Nyquist frequency or not
    /// above the one before it, and for a negative variance.
    pub fn of_plant(table: &ResponseTable, time: Discrete) -> Result<Self> {
        let (p, m) = table.checked(time)?;
        let column = |k: usize, j: usize| {
            let mut signals = vec![c64::ZERO; m];
            signals[j] = c64::ONE;
            signals.extend(table.values[k].col(j).iter());
            let variance = |i: usize| if i < m { 0.0 } else { table.variance(k, i - m, j) };
            Column::new(&signals, m, diagonal(m + p, variance))
        };
        Ok(table.lines(time, (p, m, true), column))
    }

    /// The response of a loop from its excitation to `[u; y]`, (m + p) x m.
    ///
    /// # Errors
    /// Those of [`MeasuredResponse::of_plant`]; [`Error::Ports`] without an output.
    pub fn of_loop(table: &ResponseTable, time: Discrete) -> Result<Self> {
        let (q, m) = table.checked(time)?;
        if q <= m {
            let what = "the number of signals u and y together".into();
            return Err(Error::Ports { what, expected: m + 1, found: q });
        }
        let column = |k: usize, j: usize| {
            let signals: Vec<c64> = table.values[k].col(j).iter().copied().collect();
            Column::new(&signals, m, diagonal(q, |i| table.variance(k, i, j)))
        };
        Ok(table.lines(time, (q - m, m, false), column))
    }

    /// Whether the covariance of `Y - G U` depends on G, or on shares that residuals show.
    pub(super) fn depends_on_plant(&self) -> bool {
        !(self.known() || self.proportional) || !self.exact_inputs
    }

    /// Whether the covariance is known.
    pub(super) fn known(&self) -> bool {
        self.degrees.is_some()
    }
}

fn diagonal(size: usize, entry: impl Fn(usize) -> f64) -> Mat<c64> {
    Mat::from_fn(size, size, |i, j| c64::new(if i == j { entry(i) } else { 0.0 }, 0.0))
}

impl ResponseTable {
    /// The response of the plant: that of the table, or `T_y T_u^-1` of a loop whose first rows are the inputs.
    ///
    /// # Errors
    /// [`Error::Ports`] for a loop without outputs, or a table without frequencies; [`Error::Singular`] with the first frequency at which
    /// the excitation does not reach all inputs.
    pub fn plant(&self, of_loop: bool) -> Result<FrequencyResponse> {
        let (rows, m) = self.values.first().map_or((0, 0), |v| (v.nrows(), v.ncols()));
        let p = if of_loop { rows.saturating_sub(m) } else { rows };
        if p == 0 || m == 0 {
            return Err(Error::Ports { what: "the number of outputs of the response".into(), expected: 1, found: p });
        }
        let mut values = Vec::new();
        for (t, omega) in self.values.iter().zip(&self.omega) {
            let g = match of_loop {
                false => t.clone(),
                true => {
                    let what = || format!("the response from the excitation to the inputs at {} Hz", omega / TAU);
                    t.subrows(m, p) * inverse(t.subrows(0, m).to_owned(), what)?
                }
            };
            values.extend(g.col_iter().flat_map(|column| column.iter().copied().collect::<Vec<_>>()));
        }
        Ok(FrequencyResponse::new(self.omega.clone(), values, p, m))
    }

    fn lines(
        &self,
        time: Discrete,
        (outputs, inputs, exact_inputs): (usize, usize, bool),
        column: impl Fn(usize, usize) -> Column,
    ) -> MeasuredResponse {
        let line = |k: usize| (0..inputs).map(|j| column(k, j)).collect();
        MeasuredResponse {
            time,
            omega: self.omega.clone(),
            inputs,
            outputs,
            lines: (0..self.omega.len()).map(line).collect(),
            degrees: matches!(self.variance, ResponseVariance::Known(_)).then_some(f64::INFINITY),
            exact_inputs,
            proportional: matches!(self.variance, ResponseVariance::Proportional(_)),
        }
    }

    fn variance(&self, k: usize, i: usize, j: usize) -> f64 {
        self.variance.stated().map_or(0.0, |v| v[k][(i, j)])
    }

    /// Shapes and values; the size of the response.
    fn checked(&self, time: Discrete) -> Result<(usize, usize)> {
        let shape = self.values.first().map_or((0, 0), |v| (v.nrows(), v.ncols()));
        let count = self.omega.len();
        if self.values.len() != count || shape.0 == 0 || shape.1 == 0 {
            let what = "the number of values of the response".into();
            return Err(Error::Ports { what, expected: count.max(1), found: self.values.len() });
        }
        let mut before = -1.0;
        for (k, omega) in self.omega.iter().enumerate() {
            let hz = omega / TAU;
            let at = |e: Error| e.within(format!("the response at {hz} Hz"));
            check_frequency(*omega, before, time).map_err(|must| Error::OutOfRange {
                what: format!("frequency {} of the response, in Hz", k + 1),
                value: hz,
                must,
            })?;
            before = *omega;
            check_shape("the response", (self.values[k].nrows(), self.values[k].ncols()), shape).map_err(at)?;
            check_values(self.values[k].as_ref()).map_err(at)?;
        }
        self.check_variance(shape)?;
        Ok(shape)
    }

    fn check_variance(&self, shape: (usize, usize)) -> Result<()> {
        for (k, variance) in self.variance.stated().into_iter().flatten().enumerate() {
            let hz = self.omega.get(k).map_or(f64::NAN, |w| w / TAU);
            let at = |e: Error| e.within(format!("the response at {hz} Hz"));
            check_shape("its variance", (variance.nrows(), variance.ncols()), shape).map_err(at)?;
            let bad = variance.col_iter().flat_map(|c| c.iter()).find(|v| !(v.is_finite() && **v >= 0.0));
            if let Some(bad) = bad {
                let must = "a number of at least zero";
                return Err(at(Error::OutOfRange { what: "its variance".into(), value: *bad, must }));
            }
        }
        match self.variance.stated() {
            Some(variance) if variance.len() != self.omega.len() => Err(Error::Ports {
                what: "the number of variances of the response".into(),
                expected: self.omega.len(),
                found: variance.len(),
            }),
            _ => Ok(()),
        }
    }
}

fn check_frequency(omega: f64, before: f64, time: Discrete) -> std::result::Result<(), &'static str> {
    // A frequency of a file has some six digits.
    const ROUNDING: f64 = 1e-6;
    if !(omega.is_finite() && omega >= 0.0) {
        return Err("a number of at least zero");
    }
    if omega * time.ts() > PI * (1.0 + ROUNDING) {
        return Err("at most half the sample rate: a response above it is that of an alias");
    }
    if omega <= before {
        return Err("above the frequency before it: sort the rows, and average those of equal frequency");
    }
    Ok(())
}

fn check_shape(what: &str, found: (usize, usize), expected: (usize, usize)) -> Result<()> {
    if found == expected { Ok(()) } else { Err(Error::Shape { what: what.into(), expected, found }) }
}

fn check_values(values: MatRef<'_, c64>) -> Result<()> {
    for j in 0..values.ncols() {
        for i in 0..values.nrows() {
            if !(values[(i, j)].re.is_finite() && values[(i, j)].im.is_finite()) {
                return Err(Error::NotFinite { what: "the response".into(), row: i + 1, column: j + 1 });
            }
        }
    }
    Ok(())
}
