//! What is known of the noise: the predictor that belongs to it.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// The model of the noise, which decides what is predicted from what.
///
/// ```
/// use youla_greybox::{InnovationStart, NoiseModel};
/// assert_eq!(NoiseModel::default(), NoiseModel::OutputError);
/// let free = NoiseModel::Innovation(InnovationStart::default());
/// assert_ne!(free, NoiseModel::OutputError);
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseModel {
    /// White noise at the outputs: the prediction is the simulation.
    #[default]
    OutputError,
    /// White innovations e, `x+ = Ad x + Bd u + K e, y = C x + D u + e` with a free gain K: noise that enters anywhere in
    /// the plant. The prediction is one step ahead, and stable for every K that is taken.
    Innovation(InnovationStart),
    /// Output noise of known colour, `y = G u + H e`: the residual is `H^-1 (y - yhat)`.
    Filter(NoiseFilter),
}

/// The models of the noise that need nothing to be known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseKind {
    /// White noise at the outputs: the simulation is fitted.
    #[default]
    OutputError,
    /// White innovations with a free gain K: the prediction one step ahead is fitted, by a stable predictor.
    Innovation,
}

impl From<NoiseKind> for NoiseModel {
    fn from(kind: NoiseKind) -> Self {
        match kind {
            NoiseKind::OutputError => NoiseModel::OutputError,
            NoiseKind::Innovation => NoiseModel::Innovation(InnovationStart::default()),
        }
    }
}

/// Where the search for the gain K begins.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct InnovationStart {
    /// K in the states of the sampled structure, n x p, row by row; zero when empty.
    pub gain: Vec<Vec<f64>>,
}

impl InnovationStart {
    /// At a gain K, n x p.
    pub(crate) fn of(gain: MatRef<'_, f64>) -> Self {
        InnovationStart { gain: rows(gain) }
    }
}

/// `H(z) = I + C (zI - A)^-1 B` at the sample time of the data, p x p, with a stable inverse.
///
/// ```
/// use youla_greybox::NoiseFilter;
/// // y = 1 / (1 - 0.9 z^-1) e
/// let drift = NoiseFilter { a: vec![vec![0.9]], b: vec![vec![1.0]], c: vec![vec![0.9]] };
/// assert_eq!(drift.a[0][0], 0.9);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseFilter {
    /// A, row by row.
    pub a: Vec<Vec<f64>>,
    /// B, row by row.
    pub b: Vec<Vec<f64>>,
    /// C, row by row.
    pub c: Vec<Vec<f64>>,
}

impl NoiseFilter {
    /// `H^-1`, checked for `outputs` outputs.
    pub(crate) fn inverse(&self, outputs: usize, time: Discrete) -> Result<StateSpace<Discrete>> {
        let [a, b, c] = [("A", &self.a), ("B", &self.b), ("C", &self.c)]
            .map(|(letter, rows)| matrix(&format!("the matrix {letter} of the noise filter"), rows));
        let filter = StateSpace::new(a?, b?, c?, youla::linalg::eye(outputs), time)?;
        let inverse = filter.inverse()?;
        inverse.require_stable("the inverse of the noise filter")?;
        Ok(inverse)
    }
}

/// The rows of a matrix.
fn rows(matrix: MatRef<'_, f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// A matrix from its rows.
pub(crate) fn matrix(what: &str, rows: &[Vec<f64>]) -> Result<Mat<f64>> {
    let columns = rows.first().map_or(0, Vec::len);
    match rows.iter().position(|row| row.len() != columns) {
        Some(bad) => {
            let what = format!("row {} of {what}", bad + 1);
            Err(Error::Method(youla::Error::Shape { what, expected: (1, columns), found: (1, rows[bad].len()) }))
        }
        None => Ok(Mat::from_fn(rows.len(), columns, |i, j| rows[i][j])),
    }
}
