//! B, D and the initial states for given A and C, by linear least squares on the simulated outputs; for an unstable A and
//! for the methods of closed loops on the one-step predictions of the observer `A - K C`, whose errors no input contains.
//!
//! The regressors of each experiment are folded into a triangular factor `[R11 R12; 0 R22]` over `[x0 | B D y]`: `R22` holds
//! all that an experiment says about B and D, so that any number of experiments costs no more than one
//! (SLICOT working note 2000-4, section 2.3, for one experiment). The coefficients of known disturbances are beside x0.

use crate::Result;
use crate::identify::subspace::innovation::observer_gain;
use crate::identify::subspace::inputs::condense::{Factors, condense};
use crate::identify::subspace::inputs::sensitivity::{Predictor, Unknowns};
use crate::identify::subspace::output_pair::OutputPair;
use crate::identify::subspace::records::channels::Channels;
use crate::identify::subspace::stability::StabilityReport;
use crate::identify::subspace::{InitialState, SubspaceOptions};
use crate::linalg::{SequentialQr, leading_rank, least_squares};
use faer::{Mat, MatRef};

/// The outputs to which B, D and x0 were fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
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
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
pub(crate) struct Fitted {
    pub(crate) b: Mat<f64>,
    pub(crate) d: Mat<f64>,
    pub(crate) initial_states: Vec<Vec<f64>>,
    /// Coefficients of the known disturbances per experiment, known signals x outputs.
    pub(crate) disturbances: Vec<Mat<f64>>,
    pub(crate) quality: OutputFit,
}

/// Finds B, D and the initial states.
pub(crate) fn fit(
    data: &Channels<'_>,
    pair: &OutputPair,
    kalman_gain: Option<MatRef<'_, f64>>,
    stability: &StabilityReport,
    options: &SubspaceOptions,
) -> Result<Fitted> {
    let (predictor, by) = predictor(pair, kalman_gain, is_simulated(stability, options))?;
    solve(data, pair, predictor, by, options)
}

fn solve(
    data: &Channels<'_>,
    pair: &OutputPair,
    predictor: Predictor,
    by: InputFit,
    options: &SubspaceOptions,
) -> Result<Fitted> {
    let unknowns = &unknowns(data, pair, options);
    let factors = condense(data, &predictor, unknowns);
    let parts: Vec<Part> = factors.iter().map(|f| join(f, unknowns)).collect();
    let count = unknowns.common();
    let mut whole = SequentialQr::new(count + 1, count + 1);
    parts.iter().for_each(|part| whole.fold_rows(part.common()));
    let r = whole.r();
    let solution = least_squares("the regressors of B and D", r.subcols(0, count), r.subcols(count, 1))?;
    let common = solution.x.as_ref();
    let (driven, d) = unknowns.unpack(common);
    let own = parts.iter().map(|part| part.own(common, unknowns)).collect::<Result<Vec<_>>>()?;
    let (initial_states, disturbances): (Vec<_>, Vec<_>) = own.iter().map(|own| split(own, unknowns)).unzip();
    let left = |i: usize| {
        let pairs = factors.iter().zip(&own);
        pairs.map(|(f, own)| residual(&f[i], i, own, common, unknowns)).fold(0.0, f64::hypot)
    };
    let spread = data.spread(&disturbances)?;
    let percent = (0..data.outputs).map(|i| 100.0 * (1.0 - left(i) / spread[i])).collect();
    let quality = OutputFit { by, percent, unknowns: count, rank: solution.rank, rcond: solution.rcond };
    let b = match &predictor.k {
        Some(k) => driven + k * &d,
        None => driven,
    };
    Ok(Fitted { b, d, initial_states, disturbances, quality })
}

fn is_simulated(stability: &StabilityReport, options: &SubspaceOptions) -> bool {
    stability.stable && !options.method.is_for_closed_loops()
}

fn unknowns(data: &Channels<'_>, pair: &OutputPair, options: &SubspaceOptions) -> Unknowns {
    Unknowns {
        states: pair.a.nrows(),
        inputs: data.inputs,
        outputs: data.outputs,
        initial: if options.initial_state == InitialState::Estimated { pair.a.nrows() } else { 0 },
        disturbances: data.disturbances() * data.outputs,
        direct: options.feedthrough.inputs_of_outputs(data.inputs, data.outputs),
    }
}

/// The simulation of the model or its one-step predictor.
pub(crate) fn predictor(
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
pub(crate) struct Part {
    r: Mat<f64>,
    own: usize,
    own_rank: usize,
}

/// Puts the outputs of one experiment below each other, each with its own row of D.
pub(crate) fn join(outputs: &Factors, unknowns: &Unknowns) -> Part {
    let shared = unknowns.own() + unknowns.of_b();
    let mut whole = SequentialQr::new(unknowns.width(), shared + unknowns.inputs + 1);
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
    pub(crate) fn common(&self) -> MatRef<'_, f64> {
        let (skip, from) = (self.own_rank, self.own);
        self.r.as_ref().submatrix(skip, from, self.r.nrows() - skip, self.r.ncols() - from)
    }

    /// `R11 [x0; a] = r1y - R12 [B; D]`: the unknowns of the experiment.
    fn own(&self, common: MatRef<'_, f64>, unknowns: &Unknowns) -> Result<Mat<f64>> {
        let top = self.r.as_ref().subrows(0, self.own_rank);
        let (r11, rest) = top.split_at_col(self.own);
        let (r12, r1y) = rest.split_at_col(unknowns.common());
        Ok(least_squares("the regressors of an initial state", r11, (r1y - r12 * common).as_ref())?.x)
    }
}

/// The initial state and the coefficients of the disturbances among the unknowns of an experiment.
fn split(own: &Mat<f64>, unknowns: &Unknowns) -> (Vec<f64>, Mat<f64>) {
    let x0 = (0..unknowns.states).map(|k| if unknowns.initial > 0 { own[(k, 0)] } else { 0.0 }).collect();
    let known = unknowns.disturbances / unknowns.outputs;
    (x0, Mat::from_fn(known, unknowns.outputs, |j, i| own[(unknowns.initial + i * known + j, 0)]))
}

/// Length of the residual of output i over an experiment, from its factor.
fn residual(r: &Mat<f64>, i: usize, own: &Mat<f64>, common: MatRef<'_, f64>, unknowns: &Unknowns) -> f64 {
    let (shared, of_b) = (unknowns.own() + unknowns.of_b(), unknowns.of_b());
    let by = Mat::from_fn(r.ncols() - 1, 1, |k, _| match k {
        k if k < unknowns.own() => own[(k, 0)],
        k if k < shared => common[(k - unknowns.own(), 0)],
        k => common[(of_b + unknowns.of_d_above(i) + k - shared, 0)],
    });
    let (regressors, target) = r.as_ref().split_at_col(r.ncols() - 1);
    (target - regressors * by).norm_l2()
}
