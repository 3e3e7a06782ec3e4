//! B, D and the initial states for given A and C, by linear least squares on the simulated outputs; for an unstable A and
//! for the methods of closed loops on the one-step predictions of the observer `A - K C`, whose errors no input contains.
//!
//! The regressors of each experiment are folded into a triangular factor `[R11 R12; 0 R22]` over `[x0 | B D y]`: `R22` holds
//! all that an experiment says about B and D, so that any number of experiments costs no more than one
//! (SLICOT working note 2000-4, section 2.3, for one experiment).

use super::channels::{Channels, Signals};
use super::innovation::observer_gain;
use super::modal::Modes;
use super::realisation::OutputPair;
use super::sensitivity::{Predictor, Sensitivity, Unknowns, simulate};
use super::stability::StabilityReport;
use super::{Feedthrough, InitialState, SubspaceOptions};
use crate::Result;
use crate::linalg::{Triangle, block, leading_rank, least_squares};
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
    /// Predicted one step ahead with an observer gain of unit covariances, there being no Kalman gain: exact
    /// without noise, biased by noise that is fed back.
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
    let (predictor, by) = predictor(pair, kalman_gain, is_simulated(stability, options))?;
    let unknowns = unknowns(data, pair, options);
    let parts = condense(data, &predictor, unknowns);
    let common = unknowns.common();
    let mut whole = Triangle::new(common + 1, common + 1);
    parts.iter().for_each(|part| whole.fold_rows(part.common()));
    let r = whole.r();
    let solution = least_squares("the regressors of B and D", r.subcols(0, common), r.subcols(common, 1))?;
    let (driven, d) = unknowns.unpack(solution.x.as_ref());
    let initial_states =
        parts.iter().map(|part| part.initial_state(solution.x.as_ref(), unknowns)).collect::<Result<Vec<_>>>()?;
    let percent = fit_percent(data, &predictor, driven.as_ref(), d.as_ref(), &initial_states);
    let quality = OutputFit { by, percent, unknowns: common, rank: solution.rank, rcond: solution.rcond };
    let b = match &predictor.k {
        Some(k) => driven + k * &d,
        None => driven,
    };
    Ok(Fitted { b, d, initial_states, quality })
}

fn is_simulated(stability: &StabilityReport, options: &SubspaceOptions) -> bool {
    stability.stable && !options.weight.is_for_closed_loops()
}

fn unknowns(data: &Channels, pair: &OutputPair, options: &SubspaceOptions) -> Unknowns {
    Unknowns {
        states: pair.a.nrows(),
        inputs: data.inputs,
        outputs: data.outputs,
        initial: if options.initial_state == InitialState::Estimated { pair.a.nrows() } else { 0 },
        feedthrough: options.feedthrough == Feedthrough::Estimated,
    }
}

/// The estimate around which the data are weighted, in scaled units.
pub(super) struct Base {
    pub(super) pair: OutputPair,
    pub(super) predictor: Predictor,
    pub(super) unknowns: Unknowns,
    /// `B - K D`.
    pub(super) driven: Mat<f64>,
    pub(super) d: Mat<f64>,
    pub(super) initial_states: Vec<Vec<f64>>,
    /// Whether the K of the predictor is the Kalman gain.
    pub(super) innovation_gain: bool,
    pub(super) poles_moved: bool,
    pub(super) stable: bool,
}

impl Base {
    /// From the result of [`fit`] with the same arguments.
    pub(super) fn new(
        data: &Channels,
        pair: &OutputPair,
        kalman_gain: Option<MatRef<'_, f64>>,
        stability: &StabilityReport,
        options: &SubspaceOptions,
        fitted: &Fitted,
    ) -> Result<Base> {
        let (predictor, by) = predictor(pair, kalman_gain, is_simulated(stability, options))?;
        let driven = match &predictor.k {
            Some(k) => &fitted.b - k * &fitted.d,
            None => fitted.b.clone(),
        };
        Ok(Base {
            unknowns: unknowns(data, pair, options),
            pair: pair.clone(),
            predictor,
            driven,
            d: fitted.d.clone(),
            initial_states: fitted.initial_states.clone(),
            innovation_gain: by == InputFit::Prediction,
            poles_moved: !stability.moved.is_empty(),
            stable: stability.stable,
        })
    }

    /// B.
    pub(super) fn b(&self) -> Mat<f64> {
        match &self.predictor.k {
            Some(k) => &self.driven + k * &self.d,
            None => self.driven.clone(),
        }
    }
}

/// The simulation of the model or its one-step predictor.
pub(super) fn predictor(
    pair: &OutputPair,
    kalman_gain: Option<MatRef<'_, f64>>,
    simulated: bool,
) -> Result<(Predictor, InputFit)> {
    let (k, by) = match kalman_gain {
        _ if simulated => {
            return Ok((Predictor { a: pair.a.clone(), c: pair.c.clone(), k: None }, InputFit::Simulation));
        }
        Some(gain) => (gain.to_owned(), InputFit::Prediction),
        None => (observer_gain(pair)?, InputFit::Observer),
    };
    Ok((Predictor { a: &pair.a - &k * &pair.c, c: pair.c.clone(), k: Some(k) }, by))
}

/// What one experiment says: the triangular factor over `[x0 | B D y]`, split behind the directions of x0.
pub(super) struct Part {
    r: Mat<f64>,
    initial: usize,
    initial_rank: usize,
}

/// One triangular factor per output, joined for each experiment; in modal coordinates where A has them, else output by
/// output.
pub(super) fn condense(data: &Channels, predictor: &Predictor, unknowns: Unknowns) -> Vec<Part> {
    let targets: Vec<Mat<f64>> =
        data.experiments.par_iter().map(|signals| without_known_share(signals, predictor)).collect();
    if let Some(modes) = Modes::of(predictor) {
        let experiments: Vec<_> = data.experiments.iter().zip(&targets).collect();
        return experiments
            .par_iter()
            .map(|(signals, targets)| join(&modes.condense(signals.u.as_ref(), targets.as_ref(), unknowns), unknowns))
            .collect();
    }
    let tasks: Vec<_> = (0..targets.len()).flat_map(|e| (0..unknowns.outputs).map(move |i| (e, i))).collect();
    let triangles: Vec<Mat<f64>> = tasks
        .par_iter()
        .map(|&(e, i)| condense_output(&data.experiments[e].u, &targets[e], i, predictor, unknowns))
        .collect();
    triangles.chunks(unknowns.outputs).map(|outputs| join(outputs, unknowns)).collect()
}

/// The outputs without what they drive themselves through K.
fn without_known_share(signals: &Signals, predictor: &Predictor) -> Mat<f64> {
    let Some(k) = &predictor.k else { return signals.y.clone() };
    let (n, p) = (k.nrows(), k.ncols());
    let ak = block(&[&[predictor.a.as_ref(), k.as_ref()]]);
    let c0 = block(&[&[predictor.c.as_ref(), Mat::zeros(p, p).as_ref()]]);
    &signals.y - simulate(ak.as_ref(), c0.as_ref(), &vec![0.0; n], signals.y.as_ref())
}

fn condense_output(u: &Mat<f64>, targets: &Mat<f64>, i: usize, predictor: &Predictor, unknowns: Unknowns) -> Mat<f64> {
    let target: Vec<f64> = targets.col(i).iter().copied().collect();
    let piece = PIECE.min(u.nrows());
    let mut triangle = Triangle::new(unknowns.width_of_output(), piece);
    let mut sensitivity = Sensitivity::new(predictor, i, unknowns);
    for start in (0..u.nrows()).step_by(piece) {
        let count = piece.min(u.nrows() - start);
        let (u, target) = (u.as_ref().subrows(start, count), &target[start..start + count]);
        triangle.fold(count, |rows| sensitivity.fill(u, target, rows));
    }
    triangle.r().to_owned()
}

/// Puts the outputs of one experiment below each other, each with its own row of D.
fn join(outputs: &[Mat<f64>], unknowns: Unknowns) -> Part {
    let shared = unknowns.initial + unknowns.of_b();
    let of_d = unknowns.of_d_row();
    let mut whole = Triangle::new(unknowns.width(), unknowns.width_of_output());
    for (i, r) in outputs.iter().enumerate() {
        whole.fold(r.nrows(), |mut rows| {
            rows.as_mut().subcols_mut(0, shared).copy_from(r.as_ref().subcols(0, shared));
            rows.as_mut().subcols_mut(shared + i * of_d, of_d).copy_from(r.as_ref().subcols(shared, of_d));
            rows.col_mut(unknowns.width() - 1).copy_from(r.col(r.ncols() - 1));
        });
    }
    let initial_rank = leading_rank(whole.r(), unknowns.initial);
    Part { r: whole.r().to_owned(), initial: unknowns.initial, initial_rank }
}

impl Part {
    /// `R22`.
    pub(super) fn common(&self) -> MatRef<'_, f64> {
        let (skip, from) = (self.initial_rank, self.initial);
        self.r.as_ref().submatrix(skip, from, self.r.nrows() - skip, self.r.ncols() - from)
    }

    /// `R11` and `R12`, over the initial state and over B and D.
    pub(super) fn of_initial(&self) -> (MatRef<'_, f64>, MatRef<'_, f64>) {
        let (r11, rest) = self.r.as_ref().subrows(0, self.initial_rank).split_at_col(self.initial);
        (r11, rest.subcols(0, rest.ncols() - 1))
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

fn fit_percent(
    data: &Channels,
    predictor: &Predictor,
    driven: MatRef<'_, f64>,
    d: MatRef<'_, f64>,
    initial_states: &[Vec<f64>],
) -> Vec<f64> {
    let none = Mat::zeros(predictor.a.nrows(), 0);
    let k = predictor.k.as_ref().unwrap_or(&none);
    let ab = block(&[&[predictor.a.as_ref(), driven, k.as_ref()]]);
    let cd = block(&[&[predictor.c.as_ref(), d, Mat::zeros(d.nrows(), k.ncols()).as_ref()]]);
    let pairs: Vec<_> = data.experiments.iter().zip(initial_states).collect();
    let errors: Vec<Mat<f64>> = pairs
        .par_iter()
        .map(|(e, x0)| {
            let driving = block(&[&[e.u.as_ref(), e.y.as_ref().subcols(0, k.ncols())]]);
            &e.y - simulate(ab.as_ref(), cd.as_ref(), x0, driving.as_ref())
        })
        .collect();
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
