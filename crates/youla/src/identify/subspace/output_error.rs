//! B, D and the initial states for given A and C, by linear least squares on the simulated outputs; for an unstable A and
//! for the methods of closed loops on the one-step predictions of the observer `A - K C`, whose errors no input contains.
//!
//! The regressors of each experiment are folded into a triangular factor `[R11 R12; 0 R22]` over `[x0 | B D y]`: `R22` holds
//! all that an experiment says about B and D, so that any number of experiments costs no more than one
//! (SLICOT working note 2000-4, section 2.3, for one experiment). The coefficients of known disturbances stand beside x0.

use super::channels::{Channels, Signals};
use super::disturbance::Regressors;
use super::innovation::observer_gain;
use super::modal::Modes;
use super::realisation::OutputPair;
use super::sensitivity::{Predictor, Sensitivity, Unknowns, simulate};
use super::stability::StabilityReport;
use super::{InitialState, SubspaceOptions};
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
    /// Coefficients of the known disturbances per experiment, known signals x outputs.
    pub(super) disturbances: Vec<Mat<f64>>,
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
    solve(data, pair, predictor, by, options)
}

/// The same by the predictions with a given gain, whatever the method.
pub(super) fn fit_predictions(
    data: &Channels,
    pair: &OutputPair,
    gain: MatRef<'_, f64>,
    options: &SubspaceOptions,
) -> Result<Fitted> {
    let (predictor, by) = predictor(pair, Some(gain), false)?;
    solve(data, pair, predictor, by, options)
}

fn solve(
    data: &Channels,
    pair: &OutputPair,
    predictor: Predictor,
    by: InputFit,
    options: &SubspaceOptions,
) -> Result<Fitted> {
    let unknowns = &unknowns(data, pair, options);
    let parts = condense(data, &predictor, unknowns);
    let common = unknowns.common();
    let mut whole = Triangle::new(common + 1, common + 1);
    parts.iter().for_each(|part| whole.fold_rows(part.common()));
    let r = whole.r();
    let solution = least_squares("the regressors of B and D", r.subcols(0, common), r.subcols(common, 1))?;
    let (driven, d) = unknowns.unpack(solution.x.as_ref());
    let own = parts.iter().map(|part| part.own(solution.x.as_ref(), unknowns)).collect::<Result<Vec<_>>>()?;
    let (initial_states, disturbances): (Vec<_>, Vec<_>) = own.into_iter().unzip();
    let outputs = without_disturbances(data, &disturbances);
    let percent = fit_percent(data, &outputs, &predictor, [driven.as_ref(), d.as_ref()], &initial_states);
    let quality = OutputFit { by, percent, unknowns: common, rank: solution.rank, rcond: solution.rcond };
    let b = match &predictor.k {
        Some(k) => driven + k * &d,
        None => driven,
    };
    Ok(Fitted { b, d, initial_states, disturbances, quality })
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
        disturbances: data.disturbances() * data.outputs,
        direct: options.feedthrough.inputs_of_outputs(data.inputs, data.outputs),
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
    /// Coefficients of the known disturbances per experiment, known signals x outputs.
    pub(super) disturbances: Vec<Mat<f64>>,
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
            disturbances: fitted.disturbances.clone(),
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

/// What one experiment says: the triangular factor over `[x0, disturbances | B D y]`, split behind the directions of its own
/// unknowns.
pub(super) struct Part {
    r: Mat<f64>,
    own: usize,
    own_rank: usize,
}

/// One triangular factor per output, joined for each experiment; in modal coordinates where A has them, else output by
/// output.
pub(super) fn condense(data: &Channels, predictor: &Predictor, unknowns: &Unknowns) -> Vec<Part> {
    let prepared: Vec<_> = data
        .experiments
        .par_iter()
        .map(|e| (e, without_known_share(&e.y, predictor), regressors(e, predictor)))
        .collect();
    if let Some(modes) = Modes::of(predictor) {
        return prepared
            .par_iter()
            .map(|(e, targets, known)| join(&modes.condense(e.u.as_ref(), targets.as_ref(), known, unknowns), unknowns))
            .collect();
    }
    let tasks: Vec<_> = prepared.iter().flat_map(|e| (0..unknowns.outputs).map(move |i| (e, i))).collect();
    let triangles: Vec<Mat<f64>> = tasks
        .par_iter()
        .map(|((e, targets, known), i)| condense_output(&e.u, targets, known, *i, predictor, unknowns))
        .collect();
    triangles.chunks(unknowns.outputs).map(|outputs| join(outputs, unknowns)).collect()
}

/// The regressors of the disturbances' coefficients: the known signals, for a predictor each at each output as the predictor
/// passes it on to all outputs.
pub(super) fn regressors(signals: &Signals, predictor: &Predictor) -> Regressors {
    let (w, p) = (&signals.w, signals.y.ncols());
    let plain = Regressors { signals: w.clone(), known: w.ncols(), outputs: p, crossed: false };
    if predictor.k.is_none() || w.ncols() == 0 {
        return plain;
    }
    let crossed: Vec<Mat<f64>> = (0..p * w.ncols())
        .map(|a| {
            let (l, j) = (a / w.ncols(), a % w.ncols());
            let at_output = Mat::from_fn(w.nrows(), p, |k, i| if i == l { w[(k, j)] } else { 0.0 });
            without_known_share(&at_output, predictor)
        })
        .collect();
    let signals = Mat::from_fn(w.nrows(), crossed.len() * p, |k, c| crossed[c / p][(k, c % p)]);
    Regressors { signals, crossed: true, ..plain }
}

/// Outputs without what they drive themselves through K.
fn without_known_share(y: &Mat<f64>, predictor: &Predictor) -> Mat<f64> {
    let Some(k) = &predictor.k else { return y.clone() };
    let (n, p) = (k.nrows(), k.ncols());
    let ak = block(&[&[predictor.a.as_ref(), k.as_ref()]]);
    let c0 = block(&[&[predictor.c.as_ref(), Mat::zeros(p, p).as_ref()]]);
    y - simulate(ak.as_ref(), c0.as_ref(), &vec![0.0; n], y.as_ref())
}

fn condense_output(
    u: &Mat<f64>,
    targets: &Mat<f64>,
    known: &Regressors,
    i: usize,
    predictor: &Predictor,
    unknowns: &Unknowns,
) -> Mat<f64> {
    let target: Vec<f64> = targets.col(i).iter().copied().collect();
    let known = known.of_output(i);
    let piece = PIECE.min(u.nrows());
    let mut triangle = Triangle::new(unknowns.width_of_output(i), piece);
    let mut sensitivity = Sensitivity::new(predictor, i, unknowns);
    for start in (0..u.nrows()).step_by(piece) {
        let count = piece.min(u.nrows() - start);
        let (u, known) = (u.as_ref().subrows(start, count), known.as_ref().subrows(start, count));
        let target = &target[start..start + count];
        triangle.fold(count, |rows| sensitivity.fill(u, known, target, rows));
    }
    triangle.r().to_owned()
}

/// Puts the outputs of one experiment below each other, each with its own row of D.
fn join(outputs: &[Mat<f64>], unknowns: &Unknowns) -> Part {
    let shared = unknowns.own() + unknowns.of_b();
    let mut whole = Triangle::new(unknowns.width(), shared + unknowns.inputs + 1);
    for (i, r) in outputs.iter().enumerate() {
        let (of_d, above) = (unknowns.direct[i].len(), unknowns.of_d_above(i));
        whole.fold(r.nrows(), |mut rows| {
            rows.as_mut().subcols_mut(0, shared).copy_from(r.as_ref().subcols(0, shared));
            rows.as_mut().subcols_mut(shared + above, of_d).copy_from(r.as_ref().subcols(shared, of_d));
            rows.col_mut(unknowns.width() - 1).copy_from(r.col(r.ncols() - 1));
        });
    }
    let own_rank = leading_rank(whole.r(), unknowns.own());
    Part { r: whole.r().to_owned(), own: unknowns.own(), own_rank }
}

impl Part {
    /// `R22`.
    pub(super) fn common(&self) -> MatRef<'_, f64> {
        let (skip, from) = (self.own_rank, self.own);
        self.r.as_ref().submatrix(skip, from, self.r.nrows() - skip, self.r.ncols() - from)
    }

    /// `R11` and `R12`, over the unknowns of the experiment and over B and D.
    pub(super) fn of_own(&self) -> (MatRef<'_, f64>, MatRef<'_, f64>) {
        let (r11, rest) = self.r.as_ref().subrows(0, self.own_rank).split_at_col(self.own);
        (r11, rest.subcols(0, rest.ncols() - 1))
    }

    /// `R11 [x0; a] = r1y - R12 [B; D]`: the initial state and the coefficients of the disturbances.
    fn own(&self, solution: MatRef<'_, f64>, unknowns: &Unknowns) -> Result<(Vec<f64>, Mat<f64>)> {
        let top = self.r.as_ref().subrows(0, self.own_rank);
        let (r11, rest) = top.split_at_col(self.own);
        let (r12, r1y) = rest.split_at_col(unknowns.common());
        let found = least_squares("the regressors of an initial state", r11, (r1y - r12 * solution).as_ref())?.x;
        let x0 = (0..unknowns.states).map(|k| if unknowns.initial > 0 { found[(k, 0)] } else { 0.0 }).collect();
        let known = unknowns.disturbances / unknowns.outputs;
        let a = Mat::from_fn(known, unknowns.outputs, |j, i| found[(unknowns.initial + i * known + j, 0)]);
        Ok((x0, a))
    }
}

/// One-step prediction errors of the observer with gain K, one record per experiment, in scaled units.
pub(super) fn prediction_errors(
    data: &Channels,
    pair: &OutputPair,
    gain: MatRef<'_, f64>,
    fitted: &Fitted,
) -> Vec<Mat<f64>> {
    let predictor = Predictor { a: &pair.a - gain * &pair.c, c: pair.c.clone(), k: Some(gain.to_owned()) };
    let driven = &fitted.b - gain * &fitted.d;
    let outputs = without_disturbances(data, &fitted.disturbances);
    errors(data, &outputs, &predictor, [driven.as_ref(), fitted.d.as_ref()], &fitted.initial_states)
}

/// The outputs without what the known disturbances explain, so that these do not count as the model's merit.
pub(super) fn without_disturbances(data: &Channels, coefficients: &[Mat<f64>]) -> Vec<Mat<f64>> {
    data.experiments.iter().zip(coefficients).map(|(e, a)| &e.y - &e.w * a).collect()
}

/// `y - yhat` of simulation or predictor, one record per experiment.
fn errors(
    data: &Channels,
    outputs: &[Mat<f64>],
    predictor: &Predictor,
    [driven, d]: [MatRef<'_, f64>; 2],
    initial_states: &[Vec<f64>],
) -> Vec<Mat<f64>> {
    let none = Mat::zeros(predictor.a.nrows(), 0);
    let k = predictor.k.as_ref().unwrap_or(&none);
    let ab = block(&[&[predictor.a.as_ref(), driven, k.as_ref()]]);
    let cd = block(&[&[predictor.c.as_ref(), d, Mat::zeros(d.nrows(), k.ncols()).as_ref()]]);
    let pairs: Vec<_> = data.experiments.iter().zip(outputs).zip(initial_states).collect();
    pairs
        .par_iter()
        .map(|((e, y), x0)| {
            let driving = block(&[&[e.u.as_ref(), y.as_ref().subcols(0, k.ncols())]]);
            *y - simulate(ab.as_ref(), cd.as_ref(), x0, driving.as_ref())
        })
        .collect()
}

fn fit_percent(
    data: &Channels,
    outputs: &[Mat<f64>],
    predictor: &Predictor,
    [driven, d]: [MatRef<'_, f64>; 2],
    initial_states: &[Vec<f64>],
) -> Vec<f64> {
    let errors = errors(data, outputs, predictor, [driven, d], initial_states);
    let samples: usize = errors.iter().map(|e| e.nrows()).sum();
    (0..data.outputs)
        .map(|i| {
            let outputs = || outputs.iter().flat_map(|y| y.col(i).iter());
            let mean = outputs().sum::<f64>() / samples as f64;
            let spread = outputs().map(|v| (v - mean).powi(2)).sum::<f64>().sqrt();
            let error = errors.iter().map(|e| e.col(i).norm_l2()).fold(0.0, f64::hypot);
            100.0 * (1.0 - error / spread)
        })
        .collect()
}
