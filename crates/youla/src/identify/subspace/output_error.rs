//! B, D and the initial states for given A and C, by linear least squares on the simulated outputs; for an unstable A and
//! for the methods of closed loops on the one-step predictions of the observer `A - K C`, whose errors no input contains.
//!
//! The regressors of each experiment are folded into a triangular factor `[R11 R12; 0 R22]` over `[x0 | B D y]`: `R22` holds
//! all that an experiment says about B and D, so that any number of experiments costs no more than one
//! (SLICOT working note 2000-4, section 2.3, for one experiment). One pass over the records is all: the length of the
//! residual of an output, and with it the fit, is that of the same factor times `[x0; B; D; -1]`.

use super::batch::{Batch, Pass, Segment, each_batch};
use super::channels::Channels;
use super::innovation::observer_gain;
use super::modal::{ModalSums, Modes};
use super::realisation::OutputPair;
use super::sensitivity::{KnownShare, Predictor, Sensitivity, Unknowns};
use super::stability::StabilityReport;
use super::{Feedthrough, InitialState, SubspaceOptions};
use crate::Result;
use crate::linalg::{Triangle, leading_rank, least_squares};
use crate::record::SampleStream;
use faer::{ColRef, Mat, MatRef};
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
    stream: &mut dyn SampleStream,
    data: &Channels,
    pair: &OutputPair,
    kalman_gain: Option<MatRef<'_, f64>>,
    stability: &StabilityReport,
    options: &SubspaceOptions,
) -> Result<Fitted> {
    let simulated = stability.stable && !options.weight.is_for_closed_loops();
    let (predictor, by) = predictor(pair, kalman_gain, simulated)?;
    let unknowns = Unknowns {
        states: pair.a.nrows(),
        inputs: data.inputs,
        outputs: data.outputs,
        initial: if options.initial_state == InitialState::Estimated { pair.a.nrows() } else { 0 },
        feedthrough: options.feedthrough == Feedthrough::Estimated,
    };
    let factors = condense(stream, data, &predictor, unknowns)?;
    let parts: Vec<Part> = factors.iter().map(|outputs| join(outputs, unknowns)).collect();
    let common = unknowns.common();
    let mut whole = Triangle::new(common + 1, common + 1);
    parts.iter().for_each(|part| whole.fold_rows(part.common()));
    let r = whole.r();
    let solution = least_squares("the regressors of B and D", r.subcols(0, common), r.subcols(common, 1))?;
    let (driven, d) = unpack(solution.x.as_ref(), unknowns);
    let initial_states =
        parts.iter().map(|part| part.initial_state(solution.x.as_ref(), unknowns)).collect::<Result<Vec<_>>>()?;
    let percent = (0..data.outputs)
        .map(|i| {
            let error = |(outputs, x0): (&Vec<Mat<f64>>, &Vec<f64>)| {
                residual(outputs[i].as_ref(), i, x0, solution.x.as_ref(), unknowns)
            };
            let error = factors.iter().zip(&initial_states).map(error).fold(0.0, f64::hypot);
            100.0 * (1.0 - error / data.spread[i])
        })
        .collect();
    let quality = OutputFit { by, percent, unknowns: common, rank: solution.rank, rcond: solution.rcond };
    let b = match &predictor.k {
        Some(k) => driven + k * &d,
        None => driven,
    };
    Ok(Fitted { b, d, initial_states, quality })
}

/// The simulation of the model or its one-step predictor.
fn predictor(
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
struct Part {
    r: Mat<f64>,
    initial: usize,
    initial_rank: usize,
}

/// One triangular factor per experiment and output over `[x0 | B | its row of D | y]`; in modal coordinates where A has them,
/// else output by output.
fn condense(
    stream: &mut dyn SampleStream,
    data: &Channels,
    predictor: &Predictor,
    unknowns: Unknowns,
) -> Result<Vec<Vec<Mat<f64>>>> {
    let modes = Modes::of(predictor);
    let pass = Pass { overlap: 0, scale: Some(&data.scale), lengths: Some(&data.lengths) };
    let mut factors = Vec::new();
    let mut unfinished = None;
    each_batch(stream, &pass, |batch| {
        let begun: Vec<_> = batch
            .segments
            .iter()
            .map(|segment| {
                let carried = unfinished.take();
                (segment, carried.unwrap_or_else(|| Regressors::new(predictor, modes.as_ref(), unknowns)))
            })
            .collect();
        let done: Vec<_> = begun
            .into_par_iter()
            .map(|(segment, mut regressors)| {
                regressors.add(batch, segment);
                if segment.ends { Ok(regressors.factors()) } else { Err(regressors) }
            })
            .collect();
        for regressors in done {
            match regressors {
                Ok(outputs) => factors.push(outputs),
                Err(ongoing) => unfinished = Some(ongoing),
            }
        }
        Ok(())
    })?;
    Ok(factors)
}

/// The regressors of one experiment, as far as it has been read.
struct Regressors<'a> {
    unknowns: Unknowns,
    known: Option<KnownShare>,
    way: Way<'a>,
}

enum Way<'a> {
    Modal(&'a Modes, Box<ModalSums<'a>>),
    ByOutputs(Vec<(Sensitivity, Triangle)>),
}

impl<'a> Regressors<'a> {
    fn new(predictor: &Predictor, modes: Option<&'a Modes>, unknowns: Unknowns) -> Self {
        let output = |i| (Sensitivity::new(predictor, i, unknowns), Triangle::new(unknowns.width_of_output(), 1));
        let way = match modes {
            Some(modes) => Way::Modal(modes, Box::new(ModalSums::new(modes, unknowns))),
            None => Way::ByOutputs((0..unknowns.outputs).map(output).collect()),
        };
        Regressors { unknowns, known: KnownShare::new(predictor), way }
    }

    fn add(&mut self, batch: &Batch, segment: &Segment) {
        let (u, y) = batch.rows(segment).split_at_col(self.unknowns.inputs);
        let without = self.known.as_mut().map(|known| known.without(y));
        let targets = without.as_ref().map_or(y, |without| without.as_ref());
        match &mut self.way {
            Way::Modal(_, sums) => sums.add(u, targets),
            Way::ByOutputs(outputs) => outputs.par_iter_mut().enumerate().for_each(|(i, (sensitivity, triangle))| {
                fold_output(sensitivity, triangle, u, targets.col(i));
            }),
        }
    }

    fn factors(&self) -> Vec<Mat<f64>> {
        match &self.way {
            Way::Modal(modes, sums) => modes.by_outputs(sums.factor(), self.unknowns),
            Way::ByOutputs(outputs) => outputs.iter().map(|(_, triangle)| triangle.r().to_owned()).collect(),
        }
    }
}

fn fold_output(sensitivity: &mut Sensitivity, triangle: &mut Triangle, u: MatRef<'_, f64>, target: ColRef<'_, f64>) {
    triangle.make_room(PIECE.min(u.nrows()));
    for start in (0..u.nrows()).step_by(PIECE) {
        let count = PIECE.min(u.nrows() - start);
        let (u, target) = (u.subrows(start, count), target.subrows(start, count));
        triangle.fold(count, |rows| sensitivity.fill(u, target, rows));
    }
    triangle.make_room(1);
}

/// Length of the residual of output i, from its factor.
fn residual(r: MatRef<'_, f64>, i: usize, x0: &[f64], solution: MatRef<'_, f64>, unknowns: Unknowns) -> f64 {
    let (initial, of_b, of_d) = (unknowns.initial, unknowns.of_b(), unknowns.of_d_row());
    let regressors = r.subcols(0, r.ncols() - 1);
    let by = Mat::from_fn(initial + of_b + of_d, 1, |k, _| match k {
        k if k < initial => x0[k],
        k if k < initial + of_b => solution[(k - initial, 0)],
        k => solution[(of_b + i * of_d + k - initial - of_b, 0)],
    });
    (r.subcols(r.ncols() - 1, 1) - regressors * by).norm_l2()
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
    let d = Mat::from_fn(p, m, |i, q| if feedthrough { solution[(m * n + i * m + q, 0)] } else { 0.0 });
    (driven, d)
}
