//! `[nominal]` of run.toml: every form in which users have the nominal model.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use youla::Mat;
use youla::lti::{Continuous, Discrete, PolynomialMatrix, StateSpace};
use youla_io::export::read_model;
use youla_io::read_mat;

/// The domain in which matrices or polynomials are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Domain {
    /// In s, rad/s; a nominal model is discretised by a zero-order hold at the sample time of the data, a controller as `hold` states.
    Continuous,
    /// In z, at the sample time of the data.
    Discrete,
}

/// A transfer function: one polynomial for one input and output, or a matrix `[row][column]` of polynomials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "expected a list of coefficients, or a matrix [row][column] of such lists")]
pub enum Polynomials {
    /// Coefficients of the only entry.
    Single(Vec<f64>),
    /// Coefficients per entry, `[row][column]`.
    Matrix(PolynomialMatrix),
}

impl Polynomials {
    /// As a matrix with the given shape; a single polynomial stands for every entry.
    pub(super) fn spread(&self, rows: usize, columns: usize) -> PolynomialMatrix {
        match self {
            Polynomials::Single(c) => vec![vec![c.clone(); columns]; rows],
            Polynomials::Matrix(m) => m.clone(),
        }
    }

    pub(super) fn shape(&self) -> (usize, usize) {
        match self {
            Polynomials::Single(_) => (1, 1),
            Polynomials::Matrix(m) => (m.len(), m.first().map_or(0, Vec::len)),
        }
    }
}

/// The nominal model G(0).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum NominalModel {
    /// `numerator / denominator` in descending powers of s or z; a single denominator is common to all entries.
    TransferFunction {
        /// The domain in which it is given.
        domain: Domain,
        /// Numerator coefficients.
        numerator: Polynomials,
        /// Denominator coefficients.
        denominator: Polynomials,
    },
    /// State-space matrices, row by row.
    StateSpace {
        /// The domain in which it is given.
        domain: Domain,
        /// A, n x n.
        a: Vec<Vec<f64>>,
        /// B, n x m.
        b: Vec<Vec<f64>>,
        /// C, p x n.
        c: Vec<Vec<f64>>,
        /// D, p x m; zero when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        d: Option<Vec<Vec<f64>>>,
    },
    /// A file: `a`, `b`, `c`, `d` and the sample time `ts`, as a run folder and `youla export` write them, in JSON, MATLAB (5 or
    /// 7.3) or NumPy form. A MATLAB file may lack `ts`.
    ModelFile {
        /// Path of the file, relative to run.toml.
        file: PathBuf,
        /// `"continuous"` for matrices in s of a MATLAB file; discrete when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        domain: Option<Domain>,
    },
}

impl NominalModel {
    /// The discrete-time nominal model at the sample time of the data, in the states in which it was given.
    ///
    /// # Errors
    /// Whatever is wrong with the matrices, polynomials or file.
    pub fn realise(&self, folder: &Path, time: Discrete) -> Result<StateSpace<Discrete>> {
        self.system(folder, time).map_err(|e| e.within("[nominal]"))
    }

    fn system(&self, folder: &Path, time: Discrete) -> Result<StateSpace<Discrete>> {
        match self {
            NominalModel::TransferFunction { domain, numerator, denominator } => {
                let (p, m) = numerator.shape();
                let (num, den) = (numerator.spread(p, m), denominator.spread(p, m));
                match domain {
                    Domain::Continuous => Ok(StateSpace::transfer_matrix(&num, &den, Continuous)?.zoh(time)?),
                    Domain::Discrete => Ok(StateSpace::transfer_matrix(&num, &den, time)?),
                }
            }
            NominalModel::StateSpace { domain, a, b, c, d } => {
                let (a, b, c) = (matrix("A", a)?, matrix("B", b)?, matrix("C", c)?);
                let d = d.as_ref().map_or_else(|| Ok(Mat::zeros(c.nrows(), b.ncols())), |d| matrix("D", d))?;
                sampled([a, b, c, d], *domain, time)
            }
            NominalModel::ModelFile { file, domain } => {
                model_file(&folder.join(file), domain.unwrap_or(Domain::Discrete), time)
            }
        }
    }
}

/// The matrices of a gain without states, whose empty lists say nothing of their other size.
pub(super) fn sized([a, b, c, d]: [Mat<f64>; 4]) -> [Mat<f64>; 4] {
    if a.nrows() > 0 || b.nrows() > 0 || c.ncols() > 0 {
        return [a, b, c, d];
    }
    let (b, c) = (Mat::zeros(0, d.ncols()), Mat::zeros(d.nrows(), 0));
    [Mat::zeros(0, 0), b, c, d]
}

fn sampled(matrices: [Mat<f64>; 4], domain: Domain, time: Discrete) -> Result<StateSpace<Discrete>> {
    let [a, b, c, d] = sized(matrices);
    match domain {
        Domain::Continuous => Ok(StateSpace::new(a, b, c, d, Continuous)?.zoh(time)?),
        Domain::Discrete => Ok(StateSpace::new(a, b, c, d, time)?),
    }
}

/// The model of a file. A discrete-time one that states a sample time must have that of the data; only a MATLAB file may state none,
/// or hold matrices in s.
pub(super) fn model_file(file: &Path, domain: Domain, time: Discrete) -> Result<StateSpace<Discrete>> {
    let is_mat = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("mat"));
    if !is_mat && domain == Domain::Discrete {
        let system = read_model(file)?.system;
        check_sample_time(file, system.time().ts(), time)?;
        return sampled([system.a(), system.b(), system.c(), system.d()].map(|m| m.to_owned()), domain, time);
    }
    let variables = read_mat(file)?;
    if domain == Domain::Discrete && variables.variables().iter().any(|v| v.name == "ts") {
        check_sample_time(file, variables.scalar("ts")?, time)?;
    }
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| variables.matrix(name));
    sampled([a?, b?, c?, d?], domain, time)
}

fn check_sample_time(file: &Path, ts: f64, time: Discrete) -> Result<()> {
    if (ts / time.ts() - 1.0).abs() < 1e-6 {
        return Ok(());
    }
    let what = format!("{} and the data", file.display());
    Err(Error::Method(youla::Error::SampleTimeMismatch { what, left: ts, right: time.ts() }))
}

pub(super) fn matrix(name: &str, rows: &[Vec<f64>]) -> Result<Mat<f64>> {
    let columns = rows.first().map_or(0, Vec::len);
    match rows.iter().position(|r| r.len() != columns) {
        Some(bad) => Err(Error::Method(youla::Error::Shape {
            what: format!("row {} of the matrix {name}", bad + 1),
            expected: (1, columns),
            found: (1, rows[bad].len()),
        })),
        None => Ok(Mat::from_fn(rows.len(), columns, |i, j| rows[i][j])),
    }
}
