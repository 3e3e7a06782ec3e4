//! The criterion and its linearisation.
//!
//! ```text
//! V(theta) = 1/2 min_x0 sum_k |W (y(k) - yhat(k; theta, x0))|^2,     W = diag(1 / deviations)
//! ```
//! with yhat the simulation of the plant or of the system around it (`simulated.rs`); theta holds the parameters of the
//! structure, then those of the noise. Estimated initial states enter linearly and are solved for at every theta (variable
//! projection). The rows over `[y_0 | y_theta | e]` of one experiment have the factor `[R11 R12 r1; 0 R22 r2]`; with `e`
//! taken at the best x0, the gradient of V is exactly `-R22' r2`, and `R22` is the Jacobian in Kaufman's approximation (L.
//! Kaufman, BIT 15 (1975), 49), the one that belongs to the covariance of theta alone. Those of the steady state move with
//! theta.

use crate::Result;
use crate::checks::{check_records, check_start, check_time, checked_deviations, checked_scales};
use crate::closure::Closure;
use crate::prediction::linearisation::Linearisation;
use crate::prediction::noise::NoiseModel;
use crate::prediction::sampled::{Coordinates, Sample, SampledSlope, sample, sampled_slopes};
use crate::prediction::sensitivity::{Samples, condense, residuals, sum_of_squares};
use crate::prediction::sensitivity_bank::InitialCondition;
use crate::prediction::simulated::{Simulated, with_scaled_outputs, with_scaled_slopes};
use crate::prediction::steady::{steady_slopes, steady_state};
use crate::structure::Structure;
use youla::Mat;
use youla::identify::subspace::{Experiment, InitialState};
use youla::linalg::{SequentialQr, leading_rank, least_squares};
use youla::lti::{Discrete, StateSpace};

/// Data and structure, checked and scaled.
pub(crate) struct Criterion<'a> {
    structure: &'a dyn Structure,
    pub(crate) experiments: Vec<Samples>,
    coordinates: Coordinates,
    simulated: Simulated<'a>,
    initial_state: InitialState,
    /// Of the noise of each output that is compared.
    deviations: Vec<f64>,
    time: Discrete,
    /// Initial states per experiment that are estimated.
    pub(crate) initial: usize,
    /// Number of parameters of the structure.
    pub(crate) physical: usize,
    /// Number of all parameters q.
    pub(crate) parameters: usize,
    /// Residuals minus unknowns.
    pub(crate) degrees_of_freedom: usize,
    /// Sum of squares of the scaled outputs.
    pub(crate) energy: f64,
    /// Typical sizes of the parameters.
    pub(crate) scales: Vec<f64>,
}

/// What is compared, and how.
pub(crate) struct Comparison<'a> {
    pub(crate) closure: Option<Closure<'a>>,
    pub(crate) noise: &'a NoiseModel,
    pub(crate) initial_state: InitialState,
    pub(crate) deviations: &'a [f64],
}

/// The criterion at one parameter vector.
pub(crate) struct Point {
    pub(crate) theta: Vec<f64>,
    /// V.
    pub(crate) cost: f64,
    /// In the coordinates of the criterion.
    pub(crate) plant: Sample,
    /// What is simulated, its outputs divided by the deviations.
    pub(crate) sampled: StateSpace<Discrete>,
    pub(crate) initial_states: Vec<Vec<f64>>,
}

/// Derivatives with respect to all parameters.
pub(crate) struct Slopes {
    /// Of what is simulated, its outputs divided by the deviations.
    pub(crate) simulated: Vec<SampledSlope>,
    /// Of the plant, where that rests at the first sample and is not what is simulated.
    resting: Option<Vec<SampledSlope>>,
}

impl<'a> Criterion<'a> {
    pub(crate) fn new(
        structure: &'a dyn Structure,
        start: &[f64],
        experiments: &[Experiment<'_>],
        time: Discrete,
        comparison: Comparison<'a>,
    ) -> Result<Self> {
        let Comparison { closure, noise, initial_state, deviations } = comparison;
        let physical = structure.names().len();
        check_start(start, physical)?;
        check_time(structure, time)?;
        let mut scales = checked_scales(structure.scales(), physical)?;
        let coordinates = Coordinates::new(structure, start, time)?;
        let (order, outputs) = (coordinates.states.len(), coordinates.outputs);
        let deviations = checked_deviations(deviations, outputs)?;
        let simulated = Simulated::new(closure, noise, (order, outputs), time)?;
        let states = order + simulated.further_states();
        let initial = if initial_state == InitialState::Estimated { states } else { 0 };
        let parameters = physical + simulated.gains();
        let unknowns = parameters + initial * experiments.len();
        let inputs = simulated.inputs(coordinates.inputs);
        let rows = check_records(experiments, (inputs, outputs), unknowns)?;
        scales.resize(parameters, 1.0);
        let experiments: Vec<Samples> =
            experiments.iter().map(|e| simulated.samples(e, &deviations)).collect::<Result<_>>()?;
        let energy = experiments.iter().flat_map(|e| &e.y).map(|y| y * y).sum();
        let degrees_of_freedom = rows - unknowns;
        Ok(Criterion {
            structure,
            experiments,
            coordinates,
            simulated,
            initial_state,
            deviations,
            time,
            initial,
            physical,
            parameters,
            degrees_of_freedom,
            energy,
            scales,
        })
    }

    /// The start of a search: that of the structure, then that of the noise.
    pub(crate) fn start(&self, theta: &[f64]) -> Vec<f64> {
        let gain = match &self.simulated {
            Simulated::Predictor(predictor) => predictor.start(&self.coordinates.states),
            _ => Vec::new(),
        };
        [theta, &gain].concat()
    }

    /// The value of the criterion, with the best initial states.
    pub(crate) fn evaluate(&self, theta: &[f64]) -> Result<Point> {
        let (own, gain) = theta.split_at(self.physical);
        let plant = sample(self.structure, own, &self.coordinates, self.time)?;
        let seen = self.simulated.system(&plant.discrete, gain)?;
        let sampled = with_scaled_outputs(seen.as_ref().unwrap_or(&plant.discrete), &self.deviations)?;
        let mut point = Point { theta: theta.to_vec(), cost: 0.0, plant, sampled, initial_states: Vec::new() };
        for samples in &self.experiments {
            let (x0, sum) = self.begun(samples, &point)?;
            point.initial_states.push(x0);
            point.cost += 0.5 * sum;
        }
        Ok(point)
    }

    /// The initial state of an experiment, and the sum of squares with it.
    fn begun(&self, samples: &Samples, point: &Point) -> Result<(Vec<f64>, f64)> {
        let states = point.sampled.order();
        if self.initial > 0 {
            let rest = vec![0.0; states];
            let begin = InitialCondition { x0: &rest, slopes: None, estimated: self.initial };
            let factor = condense(samples, &point.sampled, &[], &begin)?;
            let rank = leading_rank(factor.as_ref(), self.initial);
            let (r11, r1) = factor.as_ref().subrows(0, rank).split_at_col(self.initial);
            let x0 = least_squares("the sensitivity to the initial state", r11, r1)?.x;
            let left = factor.col(self.initial).subrows(rank, factor.nrows() - rank).norm_l2();
            return Ok((x0.col(0).iter().copied().collect(), left * left));
        }
        let mut x0 = match self.initial_state {
            InitialState::SteadyState => steady_state(self.resting(point), &self.first(samples))?,
            _ => Vec::new(),
        };
        x0.resize(states, 0.0);
        let sum = sum_of_squares(samples, &point.sampled, &x0)?;
        Ok((x0, sum))
    }

    /// The system that rests at the first sample: the loop where one is simulated, else the plant.
    fn resting<'b>(&self, point: &'b Point) -> &'b StateSpace<Discrete> {
        if matches!(self.simulated, Simulated::Loop(_)) { &point.sampled } else { &point.plant.discrete }
    }

    /// The first sample of the inputs of the plant or loop; zero of an empty record.
    fn first(&self, samples: &Samples) -> Vec<f64> {
        let inputs = self.simulated.inputs(self.coordinates.inputs);
        samples.u.get(..inputs).map_or_else(|| vec![0.0; inputs], <[f64]>::to_vec)
    }

    /// Residual and Jacobian at a point.
    pub(crate) fn linearise(&self, point: &Point) -> Result<Linearisation> {
        let slopes = self.slopes(point, self.plant_slopes(point)?);
        let mut whole = SequentialQr::new(self.parameters + 1, self.initial + self.parameters + 1);
        for (samples, x0) in self.experiments.iter().zip(&point.initial_states) {
            let moved = self.moved(point, &slopes, x0, samples)?;
            let begin = InitialCondition { x0, slopes: moved.as_ref().map(|m| m.as_ref()), estimated: self.initial };
            let factor = condense(samples, &point.sampled, &slopes.simulated, &begin)?;
            let skip = leading_rank(factor.as_ref(), self.initial);
            whole.fold_rows(factor.as_ref().submatrix(skip, self.initial, factor.nrows() - skip, self.parameters + 1));
        }
        Ok(Linearisation::new(whole.r().to_owned()))
    }

    /// Derivatives of the sampled plant with respect to the parameters of the structure.
    pub(crate) fn plant_slopes(&self, point: &Point) -> Result<Vec<SampledSlope>> {
        let own = &point.theta[..self.physical];
        sampled_slopes(self.structure, own, &point.plant, &self.coordinates, self.time)
    }

    /// Derivatives of what is simulated, from those of the plant.
    pub(crate) fn slopes(&self, point: &Point, of_plant: Vec<SampledSlope>) -> Slopes {
        let gain = &point.theta[self.physical..];
        let steady = self.initial_state == InitialState::SteadyState;
        let plant_rests = steady && !matches!(self.simulated, Simulated::Loop(_));
        let resting = plant_rests.then(|| of_plant.clone());
        let simulated = self.simulated.slopes(&point.plant.discrete, gain, of_plant);
        Slopes { simulated: with_scaled_slopes(simulated, &self.deviations), resting }
    }

    /// x_theta(0) of an experiment; `None` where it does not move.
    pub(crate) fn moved(
        &self,
        point: &Point,
        slopes: &Slopes,
        x0: &[f64],
        samples: &Samples,
    ) -> Result<Option<Mat<f64>>> {
        let steady = self.initial_state == InitialState::SteadyState;
        let resting = slopes.resting.as_ref().unwrap_or(&slopes.simulated);
        steady.then(|| self.steady_slopes(point, resting, x0, samples)).transpose()
    }

    /// x_theta(0) over all states and parameters, zero for those that the steady state does not know.
    fn steady_slopes(&self, point: &Point, slopes: &[SampledSlope], x0: &[f64], samples: &Samples) -> Result<Mat<f64>> {
        let system = self.resting(point);
        let known = steady_slopes(system, slopes, &x0[..system.order()], &self.first(samples))?;
        let inside = |i: usize, j: usize| i < known.nrows() && j < known.ncols();
        let entry = |i: usize, j: usize| if inside(i, j) { known[(i, j)] } else { 0.0 };
        Ok(Mat::from_fn(x0.len(), self.parameters, entry))
    }

    /// The residuals of each experiment, sample after sample, divided by the deviations of the outputs.
    pub(crate) fn residuals(&self, point: &Point) -> Result<Vec<Vec<f64>>> {
        let pairs = self.experiments.iter().zip(&point.initial_states);
        pairs.map(|(samples, x0)| residuals(samples, &point.sampled, x0)).collect()
    }

    /// Parameters and estimated initial states.
    pub(crate) fn unknowns(&self) -> usize {
        self.parameters + self.initial * self.experiments.len()
    }

    /// Number of outputs p.
    pub(crate) fn outputs(&self) -> usize {
        self.deviations.len()
    }

    /// One number per output, back in its units.
    pub(crate) fn in_units_of_outputs(&self, scaled: &[f64]) -> Vec<f64> {
        scaled.iter().zip(&self.deviations).map(|(value, deviation)| value * deviation).collect()
    }

    /// The initial states of a point in the coordinates of the structure, those of a controller behind them.
    pub(crate) fn initial_states(&self, point: &Point) -> Vec<Vec<f64>> {
        let states = &self.coordinates.states;
        let shown = if matches!(self.simulated, Simulated::Filtered(_)) { states.len() } else { usize::MAX };
        let scales = || states.iter().copied().chain(std::iter::repeat(1.0)).take(shown);
        point.initial_states.iter().map(|x0| x0.iter().zip(scales()).map(|(z, t)| z * t).collect()).collect()
    }

    /// The parameters of the structure and the gain K of the innovation form in its states.
    pub(crate) fn split(&self, theta: &[f64]) -> (Vec<f64>, Option<Mat<f64>>) {
        let (own, gain) = theta.split_at(self.physical);
        let gain = match &self.simulated {
            Simulated::Predictor(predictor) => Some(predictor.gain(gain, &self.coordinates.states)),
            _ => None,
        };
        (own.to_vec(), gain)
    }

    /// Whether the residual is that of a simulation of the plant or of the loop.
    pub(crate) fn simulates(&self) -> bool {
        matches!(self.simulated, Simulated::Plant | Simulated::Loop(_))
    }

    /// Names of all parameters.
    pub(crate) fn names(&self) -> Vec<String> {
        let order = self.coordinates.states.len();
        let gain = |k: usize| format!("K[{}, {}] of the noise", k % order + 1, k / order + 1);
        self.structure.names().into_iter().chain((0..self.parameters - self.physical).map(gain)).collect()
    }
}
