//! Continuation from the prediction of an observer to the simulation: for lightly damped plants and starts that are far off.
//!
//! ```text
//! x' = A(theta) x + B(theta) u + Lp (y - C(theta) x - D(theta) u),   yhat = C(theta) x + D(theta) u        y held, as u
//! Lp : Kalman's gain of the model at the start of the stage, for noise rho rms(u_j) at its inputs and rms(y_i) at its outputs
//! ```
//! The criterion of a simulation has a narrow valley: where a mode is off by more than one over the length of the record, model and
//! plant run out of phase, and the gradient says nothing. An observer keeps the model in phase with the measurement, so that only
//! the error over its memory counts, and the valley is as wide as that memory is short. The stages take the observer away: rho
//! falls from large to nearly nothing, each stage starts where the one before ended, and the last is the output-error method
//! itself. The gain does not depend on theta within a stage; a model behind a wrong gain is biased in closed loop and by noise,
//! which matters to the stages on the way only. This is the homotopy of C. P. Vyasarayani, T. Uchida, A. Carvalho and J. McPhee
//! (Multibody Syst. Dyn. 26 (2011), 411) with Kalman's gain for the observer.

use super::options::require_positive;
use super::structure::{Matrix, Slope, Structure};
use super::{GreyBoxModel, GreyBoxOptions, SearchEnd, greybox};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::control::{NoiseCovariance, kalman};
use youla::identify::subspace::Experiment;
use youla::linalg::block;
use youla::lti::{Continuous, Discrete, StateSpace};
use youla::{Mat, MatRef};

/// Choices of [`greybox_continued`].
///
/// ```
/// let options = youla_greybox::ContinuationOptions { stages: 10, ..Default::default() };
/// assert_eq!((options.first, options.last), (3.0, 0.003));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContinuationOptions {
    /// rho of the first stage: the size of the noise that the observer assumes at the inputs, in units of the inputs, where that
    /// at the outputs has the size of the outputs.
    pub first: f64,
    /// rho of the last stage with an observer.
    pub last: f64,
    /// Stages with an observer, with equal ratios of rho.
    pub stages: usize,
    /// Largest number of steps of a stage. A stage need not arrive, and behind a strong observer, where the parameters have little
    /// effect, it should not go far.
    pub stage_iterations: usize,
    /// The search of each stage, and the last one without an observer.
    pub pem: GreyBoxOptions,
}

impl Default for ContinuationOptions {
    fn default() -> Self {
        ContinuationOptions { first: 3.0, last: 0.003, stages: 7, stage_iterations: 15, pem: GreyBoxOptions::default() }
    }
}

/// One stage with an observer.
#[derive(Debug)]
pub struct ContinuationStage {
    /// rho.
    pub noise: f64,
    /// Where its search ended, with the criterion of the predictions; or why it led nowhere: the next stage starts where this
    /// one did.
    pub end: Result<SearchEnd>,
}

/// Result of [`greybox_continued`].
#[derive(Debug)]
pub struct Continuation {
    /// The stages with an observer.
    pub stages: Vec<ContinuationStage>,
    /// Where they led.
    pub start: Vec<f64>,
    /// The model of the search from there, without an observer.
    pub model: GreyBoxModel,
}

/// Searches with an observer that is taken away step by step, then without: [`greybox`] from a start that may be far off.
///
/// # Errors
/// As [`greybox`]; [`youla::Error::OutOfRange`] for options without meaning. A stage that leads nowhere is an outcome.
///
/// # Accuracy
/// See `docs/grey-box.md` for how often it arrives where a search from the true parameters ends.
///
/// ```
/// use youla_greybox::{BearingStructure, ContinuationOptions, greybox_continued};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::{Mat, rig::Bearing};
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(1000, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let y = simulate(&Bearing::default().plant()?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let truth = BearingStructure::parameters(&Bearing::default());
/// let start: Vec<f64> = truth.iter().map(|v| 0.3 * v).collect();
/// let experiment = Experiment { u: u.as_ref(), y: y.as_ref() };
/// let found = greybox_continued(&BearingStructure, &start, &[experiment], time, &ContinuationOptions::default())?;
/// assert!((found.model.parameters[0] / truth[0] - 1.0).abs() < 1e-6);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn greybox_continued(
    structure: &dyn Structure,
    start: &[f64],
    experiments: &[Experiment<'_>],
    time: Discrete,
    options: &ContinuationOptions,
) -> Result<Continuation> {
    check(options)?;
    let observed = Observed::new(experiments)?;
    let pem = of_a_stage(options, observed.outputs.len());
    let mut theta = start.to_vec();
    let mut stages = Vec::with_capacity(options.stages);
    for noise in ladder(options) {
        let found = observed
            .structure(structure, &theta, noise)
            .and_then(|observer| greybox(&observer, &theta, &observed.experiments(experiments), time, &pem));
        let end = found.map(|model| {
            theta = model.parameters;
            SearchEnd { cost: model.cost, stop: model.stop, iterations: model.iterations }
        });
        stages.push(ContinuationStage { noise, end });
    }
    let model = greybox(structure, &theta, experiments, time, &options.pem)?;
    Ok(Continuation { stages, start: theta, model })
}

fn check(options: &ContinuationOptions) -> Result<()> {
    require_positive(&[("the first noise of a continuation", options.first), ("the last noise", options.last)])
}

/// rho of each stage.
fn ladder(options: &ContinuationOptions) -> impl Iterator<Item = f64> {
    let ContinuationOptions { first, last, stages, .. } = *options;
    let ratio = last / first;
    (0..stages).map(move |k| first * ratio.powf(k as f64 / stages.saturating_sub(1).max(1) as f64))
}

/// The search of a stage; the outputs, which are inputs too, have no delay.
fn of_a_stage(options: &ContinuationOptions, outputs: usize) -> GreyBoxOptions {
    let mut pem = GreyBoxOptions { max_iterations: options.stage_iterations, ..options.pem.clone() };
    if !pem.delays.is_empty() {
        pem.delays.extend(vec![0; outputs]);
    }
    pem
}

/// What an observer sees, and the sizes of the signals.
struct Observed {
    /// `[u, y]` of each experiment.
    signals: Vec<Mat<f64>>,
    /// Mean squares per input and per output.
    inputs: Vec<f64>,
    outputs: Vec<f64>,
}

impl Observed {
    fn new(experiments: &[Experiment<'_>]) -> Result<Self> {
        for (k, Experiment { u, y }) in experiments.iter().enumerate() {
            let what = format!("the output record of experiment {}", k + 1);
            youla::linalg::check_shape(&what, *y, (u.nrows(), y.ncols()))?;
        }
        let u: Vec<_> = experiments.iter().map(|e| e.u).collect();
        let y: Vec<_> = experiments.iter().map(|e| e.y).collect();
        Ok(Observed {
            signals: experiments.iter().map(|e| block(&[&[e.u, e.y]])).collect(),
            inputs: mean_squares(&u),
            outputs: mean_squares(&y),
        })
    }

    fn experiments<'a>(&'a self, measured: &[Experiment<'a>]) -> Vec<Experiment<'a>> {
        self.signals.iter().zip(measured).map(|(u, e)| Experiment { u: u.as_ref(), y: e.y }).collect()
    }

    /// The structure behind the observer of its model at `theta`.
    fn structure<'a>(&self, plant: &'a dyn Structure, theta: &[f64], noise: f64) -> Result<Observer<'a>> {
        let diagonal = |values: &[f64], factor: f64| {
            Mat::from_fn(values.len(), values.len(), |i, j| if i == j { factor * values[i] } else { 0.0 })
        };
        let (w, v) = (diagonal(&self.inputs, noise * noise), diagonal(&self.outputs, 1.0));
        let model = plant.model(theta)?;
        let gain = kalman(&model, &NoiseCovariance::at_inputs(&model, w.as_ref(), v.as_ref())?)?;
        Ok(Observer { plant, gain: -gain.l })
    }
}

/// Per column over all records; 1 for a signal that never moves.
fn mean_squares(records: &[MatRef<'_, f64>]) -> Vec<f64> {
    let samples = records.iter().map(|r| r.nrows()).sum::<usize>().max(1) as f64;
    let columns = records.iter().map(|r| r.ncols()).min().unwrap_or(0);
    let mean = |j: usize| records.iter().map(|r| r.col(j).squared_norm_l2()).sum::<f64>() / samples;
    (0..columns).map(mean).map(|square| if square > 0.0 { square } else { 1.0 }).collect()
}

/// A structure with the inputs `[u; y]`, behind an observer of constant gain.
struct Observer<'a> {
    plant: &'a dyn Structure,
    /// Lp, n x p.
    gain: Mat<f64>,
}

impl Structure for Observer<'_> {
    fn names(&self) -> Vec<String> {
        self.plant.names()
    }

    fn model(&self, theta: &[f64]) -> Result<StateSpace<Continuous>> {
        let model = self.plant.model(theta)?;
        let a = model.a() - &self.gain * model.c();
        let b = model.b() - &self.gain * model.d();
        let none = Mat::zeros(model.outputs(), model.outputs());
        let (b, d) = (block(&[&[b.as_ref(), self.gain.as_ref()]]), block(&[&[model.d(), none.as_ref()]]));
        StateSpace::new(a, b, model.c().to_owned(), d, Continuous).map_err(Error::from)
    }

    /// Those of the plant, and `dA -= Lp dC`, `dB -= Lp dD`.
    fn slopes(&self, theta: &[f64], parameter: usize) -> Vec<Slope> {
        let mut slopes = self.plant.slopes(theta, parameter);
        for output in slopes.clone() {
            let matrix = match output.matrix {
                Matrix::C => Matrix::A,
                Matrix::D => Matrix::B,
                Matrix::A | Matrix::B => continue,
            };
            for row in 0..self.gain.nrows() {
                let value = -self.gain[(row, output.row)] * output.value;
                let same = |s: &&mut Slope| (s.matrix, s.row, s.column) == (matrix, row, output.column);
                match slopes.iter_mut().find(same) {
                    Some(there) => there.value += value,
                    None => slopes.push(Slope { matrix, row, column: output.column, value }),
                }
            }
        }
        slopes
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.plant.bounds()
    }

    fn scales(&self) -> Vec<f64> {
        self.plant.scales()
    }
}
