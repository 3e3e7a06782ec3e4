//! B, D and the initial states for given A and C, by linear least squares on the simulated outputs; for an unstable A on
//! the one-step predictions of the observer `A - K C`.
//!
//! The regressors of each experiment are folded into a triangular factor `[R11 R12; 0 R22]` over `[x0 | B D y]`: `R22` holds
//! all that an experiment says about B and D, so that any number of experiments costs no more than one
//! (SLICOT working note 2000-4, section 2.3, for one experiment).

use super::channels::{Channels, Signals};
use super::innovation::observer_gain;
use super::realisation::OutputPair;
use super::sensitivity::{Predictor, Sensitivity, Unknowns, predict};
use super::stability::StabilityReport;
use super::{Feedthrough, InitialState, SubspaceOptions};
use crate::Result;
use crate::linalg::{Triangle, leading_rank, least_squares};
use faer::{Mat, MatRef};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Samples folded in at a time.
const PIECE: usize = 4000;

/// The outputs to which B, D and x0 were fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InputFit {
    /// Simulated from the inputs alone.
    Simulation,
    /// Predicted one step ahead with the Kalman gain.
    Prediction,
    /// Predicted one step ahead with an observer gain of unit covariances, there being no Kalman gain.
    Observer,
}

/// How B and D were found and how well the model reproduces the outputs it was found from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputFit {
    /// What was fitted.
    pub by: InputFit,
    /// `100 (1 - |y - yhat| / |y - mean y|)` per output over all experiments, percent, eq. (26).
    pub percent: Vec<f64>,
    /// Number of unknowns in B and D.
    pub unknowns: usize,
    /// How many of them (in combination) the data determine.
    pub rank: usize,
    /// Reciprocal condition number of their regressors, columns of unit length.
    pub rcond: f64,
}

/// Result of the fit, in scaled units.
pub(super) struct Fitted {
    pub(super) b: Mat<f64>,
    pub(super) d: Mat<f64>,
    pub(super) initial_states: Vec<Vec<f64>>,
    pub(super) quality: OutputFit,
}

/// Finds B, D and the initial states.
pub(super) fn fit(
    data: &Channels,
    pair: &OutputPair,
    kalman_gain: Option<MatRef<'_, f64>>,
    stability: &StabilityReport,
    options: &SubspaceOptions,
) -> Result<Fitted> {
    let (predictor, by) = predictor(pair, kalman_gain, stability)?;
    let unknowns = Unknowns {
        states: pair.a.nrows(),
        inputs: data.inputs,
        outputs: data.outputs,
        initial: if options.initial_state == InitialState::Estimated { pair.a.nrows() } else { 0 },
        feedthrough: options.feedthrough == Feedthrough::Estimated,
    };
    let parts: Vec<Part> = data.experiments.par_iter().map(|e| condense(e, &predictor, unknowns)).collect();
    let common = unknowns.common();
    let mut whole = Triangle::new(common + 1, common + 1);
    parts.iter().for_each(|part| whole.fold_rows(part.common()));
    let r = whole.r();
    let solution = least_squares("the regressors of B and D", r.subcols(0, common), r.subcols(common, 1))?;
    let (driven, d) = unpack(solution.x.as_ref(), unknowns);
    let initial_states =
        parts.iter().map(|part| part.initial_state(solution.x.as_ref(), unknowns)).collect::<Result<Vec<_>>>()?;
    let percent = fit_percent(data, &predictor, driven.as_ref(), d.as_ref(), &initial_states);
    let quality = OutputFit { by, percent, unknowns: common, rank: solution.rank, rcond: solution.rcond };
    let b = driven + &predictor.k * &d;
    Ok(Fitted { b, d, initial_states, quality })
}

/// The simulation of a stable model, else its one-step predictor.
fn predictor(
    pair: &OutputPair,
    kalman_gain: Option<MatRef<'_, f64>>,
    stability: &StabilityReport,
) -> Result<(Predictor, InputFit)> {
    let (k, by) = match kalman_gain {
        _ if stability.stable => (Mat::zeros(pair.a.nrows(), pair.c.nrows()), InputFit::Simulation),
        Some(gain) => (gain.to_owned(), InputFit::Prediction),
        None => (observer_gain(pair)?, InputFit::Observer),
    };
    Ok((Predictor { a: &pair.a - &k * &pair.c, c: pair.c.clone(), k }, by))
}

/// What one experiment says: the triangular factor over `[x0 | B D y]`, split behind the directions of x0.
struct Part {
    r: Mat<f64>,
    initial: usize,
    initial_rank: usize,
}

fn condense(signals: &Signals, predictor: &Predictor, unknowns: Unknowns) -> Part {
    let Signals { u, y } = signals;
    let p = unknowns.outputs;
    let piece = PIECE.min(u.nrows());
    let mut triangle = Triangle::new(unknowns.width(), piece * p);
    let mut sensitivity = Sensitivity::new(predictor, unknowns);
    for start in (0..u.nrows()).step_by(piece) {
        let count = piece.min(u.nrows() - start);
        let (u, y) = (u.as_ref().subrows(start, count), y.as_ref().subrows(start, count));
        triangle.fold(count * p, |rows| sensitivity.fill(u, y, rows));
    }
    let initial_rank = leading_rank(triangle.r(), unknowns.initial);
    Part { r: triangle.r().to_owned(), initial: unknowns.initial, initial_rank }
}

impl Part {
    /// `R22`.
    fn common(&self) -> MatRef<'_, f64> {
        let (skip, from) = (self.initial_rank, self.initial);
        self.r.as_ref().submatrix(skip, from, self.r.nrows() - skip, self.r.ncols() - from)
    }

    /// `R11 x0 = r1y - R12 [B; D]`.
    fn initial_state(&self, solution: MatRef<'_, f64>, unknowns: Unknowns) -> Result<Vec<f64>> {
        if self.initial == 0 {
            return Ok(vec![0.0; unknowns.states]);
        }
        let top = self.r.as_ref().subrows(0, self.initial_rank);
        let (r11, rest) = top.split_at_col(self.initial);
        let (r12, r1y) = rest.split_at_col(unknowns.common());
        let x0 = least_squares("the regressors of an initial state", r11, (r1y - r12 * solution).as_ref())?.x;
        Ok(x0.col(0).iter().copied().collect())
    }
}

/// `B - K D` and D from the vector of unknowns.
fn unpack(solution: MatRef<'_, f64>, unknowns: Unknowns) -> (Mat<f64>, Mat<f64>) {
    let Unknowns { states: n, inputs: m, outputs: p, feedthrough, .. } = unknowns;
    let driven = Mat::from_fn(n, m, |l, q| solution[(q * n + l, 0)]);
    let d = Mat::from_fn(p, m, |i, q| if feedthrough { solution[(m * n + q * p + i, 0)] } else { 0.0 });
    (driven, d)
}

fn fit_percent(
    data: &Channels,
    predictor: &Predictor,
    driven: MatRef<'_, f64>,
    d: MatRef<'_, f64>,
    initial_states: &[Vec<f64>],
) -> Vec<f64> {
    let pairs: Vec<_> = data.experiments.iter().zip(initial_states).collect();
    let errors: Vec<Mat<f64>> =
        pairs.par_iter().map(|(e, x0)| &e.y - predict(predictor, driven, d, x0, e.u.as_ref(), e.y.as_ref())).collect();
    let samples: usize = errors.iter().map(|e| e.nrows()).sum();
    (0..data.outputs)
        .map(|i| {
            let outputs = || data.experiments.iter().flat_map(|e| e.y.col(i).iter());
            let mean = outputs().sum::<f64>() / samples as f64;
            let spread = outputs().map(|v| (v - mean).powi(2)).sum::<f64>().sqrt();
            let error = errors.iter().map(|e| e.col(i).norm_l2()).fold(0.0, f64::hypot);
            100.0 * (1.0 - error / spread)
        })
        .collect()
}
