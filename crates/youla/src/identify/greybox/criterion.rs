//! The output-error criterion and its linearisation.
//!
//! ```text
//! V(theta) = 1/2 min_x0 sum_k |W (y(k) - yhat(k; theta, x0))|^2,     W = diag(1 / deviations)
//! ```
//! The initial states enter linearly and are solved for at every theta (variable projection). The rows over
//! `[y_0 | y_theta | e]` of one experiment have the factor `[R11 R12 r1; 0 R22 r2]`; with `e` taken at the best x0, the
//! gradient of V is exactly `-R22' r2`, and `R22` is the Jacobian in Kaufman's approximation (L. Kaufman, BIT 15 (1975),
//! 49), the one that belongs to the covariance of theta alone.

use super::closure::{Closure, with_scaled_outputs, with_scaled_slopes};
use super::sampled::{Coordinates, SampledSlope, sampled_slopes};
use super::sensitivity::{Samples, condense, residuals, sum_of_squares};
use super::structure::Structure;
use crate::identify::subspace::{Experiment, InitialState};
use crate::linalg::{Triangle, check_finite, check_shape, leading_rank, least_squares};
use crate::lti::{Continuous, Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Data and structure, checked and scaled.
pub(super) struct Criterion<'a> {
    structure: &'a dyn Structure,
    pub(super) experiments: Vec<Samples>,
    pub(super) coordinates: Coordinates,
    /// The controller around the model, where the loop is simulated.
    closure: Option<Closure<'a>>,
    /// Of the noise of each output that is compared.
    deviations: Vec<f64>,
    time: Discrete,
    /// n where initial states are estimated, else 0.
    pub(super) initial: usize,
    /// Number of parameters q.
    pub(super) parameters: usize,
    /// Residuals minus unknowns.
    pub(super) degrees_of_freedom: usize,
    /// Sum of squares of the scaled outputs.
    pub(super) energy: f64,
    /// Typical sizes of the parameters.
    pub(super) scales: Vec<f64>,
}

/// The criterion at one parameter vector.
pub(super) struct Point {
    pub(super) theta: Vec<f64>,
    /// V.
    pub(super) cost: f64,
    /// In the coordinates of the criterion.
    pub(super) continuous: StateSpace<Continuous>,
    pub(super) plant: StateSpace<Discrete>,
    /// What is simulated: the plant, or the loop around it, its outputs divided by the deviations.
    pub(super) sampled: StateSpace<Discrete>,
    pub(super) initial_states: Vec<Vec<f64>>,
}

/// The linearised criterion `1/2 |r - J step|^2` as the triangular factor of `[J r]`.
#[derive(Clone)]
pub(super) struct Linearisation {
    factor: Mat<f64>,
}

impl<'a> Criterion<'a> {
    pub(super) fn new(
        structure: &'a dyn Structure,
        start: &[f64],
        experiments: &[Experiment<'_>],
        time: Discrete,
        closure: Option<Closure<'a>>,
        initial_state: InitialState,
        deviations: &[f64],
    ) -> Result<Self> {
        let parameters = structure.names().len();
        let theta = MatRef::from_column_major_slice(start, start.len(), 1);
        check_shape("the start vector of the parameters", theta, (parameters, 1))?;
        check_finite("the start vector of the parameters", theta)?;
        let scales = checked_scales(structure.scales(), parameters)?;
        let model = structure.model(start)?;
        let deviations = checked_deviations(deviations, model.outputs())?;
        let order = model.order() + closure.as_ref().map_or(0, Closure::order);
        let inputs = closure.as_ref().map_or(model.inputs(), Closure::inputs);
        let initial = if initial_state == InitialState::Estimated { order } else { 0 };
        let mut rows = 0;
        for (k, Experiment { u, y }) in experiments.iter().enumerate() {
            let named = |what: &str| format!("the {what} record of experiment {}", k + 1);
            check_shape(&named("input"), *u, (u.nrows(), inputs))?;
            check_shape(&named("output"), *y, (u.nrows(), model.outputs()))?;
            check_finite(&named("input"), *u)?;
            check_finite(&named("output"), *y)?;
            rows += y.nrows() * y.ncols();
        }
        let unknowns = parameters + initial * experiments.len();
        if rows <= unknowns {
            let what = format!("the output records ({unknowns} unknowns)");
            return Err(Error::TooFewSamples { what, found: rows, needed: unknowns + 1 });
        }
        let coordinates = Coordinates { states: model.state_scales()?, outputs: vec![1.0; model.outputs()] };
        let experiments: Vec<Samples> = experiments.iter().map(|e| interleave(e, &deviations)).collect();
        let energy = experiments.iter().flat_map(|e| &e.y).map(|y| y * y).sum();
        let degrees_of_freedom = rows - unknowns;
        Ok(Criterion {
            structure,
            experiments,
            coordinates,
            closure,
            deviations,
            time,
            initial,
            parameters,
            degrees_of_freedom,
            energy,
            scales,
        })
    }

    /// The value of the criterion, with the best initial states.
    pub(super) fn evaluate(&self, theta: &[f64]) -> Result<Point> {
        let continuous = self.coordinates.apply(&self.structure.model(theta)?)?;
        let plant = continuous.zoh(self.time)?;
        let closed = self.closure.as_ref().map(|closure| closure.close(&plant)).transpose()?;
        let sampled = with_scaled_outputs(closed.as_ref().unwrap_or(&plant), &self.deviations)?;
        let mut initial_states = Vec::with_capacity(self.experiments.len());
        let mut sum = 0.0;
        for samples in &self.experiments {
            if self.initial == 0 {
                sum += sum_of_squares(samples, &sampled)?;
                initial_states.push(vec![0.0; sampled.order()]);
            } else {
                let factor = condense(samples, &sampled, &[], &vec![0.0; self.initial], self.initial)?;
                let rank = leading_rank(factor.as_ref(), self.initial);
                let (r11, r1) = factor.as_ref().subrows(0, rank).split_at_col(self.initial);
                let x0 = least_squares("the sensitivity to the initial state", r11, r1)?.x;
                initial_states.push(x0.col(0).iter().copied().collect());
                let left = factor.col(self.initial).subrows(rank, factor.nrows() - rank).norm_l2();
                sum += left * left;
            }
        }
        Ok(Point { theta: theta.to_vec(), cost: 0.5 * sum, continuous, plant, sampled, initial_states })
    }

    /// Residual and Jacobian at a point.
    pub(super) fn linearise(&self, point: &Point) -> Result<Linearisation> {
        let slopes = self.simulated_slopes(point, self.plant_slopes(point)?);
        let mut whole = Triangle::new(self.parameters + 1, self.initial + self.parameters + 1);
        for (samples, x0) in self.experiments.iter().zip(&point.initial_states) {
            let factor = condense(samples, &point.sampled, &slopes, x0, self.initial)?;
            let skip = leading_rank(factor.as_ref(), self.initial);
            whole.fold_rows(factor.as_ref().submatrix(skip, self.initial, factor.nrows() - skip, self.parameters + 1));
        }
        Ok(Linearisation { factor: whole.r().to_owned() })
    }

    /// Derivatives of the sampled plant, in the coordinates of the criterion.
    pub(super) fn plant_slopes(&self, point: &Point) -> Result<Vec<SampledSlope>> {
        sampled_slopes(self.structure, &point.theta, &point.continuous, &self.coordinates, self.time)
    }

    /// Derivatives of what is simulated, from those of the plant.
    pub(super) fn simulated_slopes(&self, point: &Point, of_plant: Vec<SampledSlope>) -> Vec<SampledSlope> {
        let slopes = match &self.closure {
            Some(closure) => closure.slopes(&point.plant, of_plant),
            None => of_plant,
        };
        with_scaled_slopes(slopes, &self.deviations)
    }

    /// The residuals of each experiment, sample after sample, divided by the deviations of the outputs, without weights.
    pub(super) fn residuals(&self, point: &Point) -> Result<Vec<Vec<f64>>> {
        let pairs = self.experiments.iter().zip(&point.initial_states);
        pairs.map(|(samples, x0)| residuals(samples, &point.sampled, x0)).collect()
    }

    /// Takes square roots of weights, in the order of the residuals; none for weights of 1.
    pub(super) fn reweigh(&mut self, roots: Vec<Vec<f64>>) {
        let mut roots = roots.into_iter();
        self.experiments.iter_mut().for_each(|samples| samples.roots = roots.next().unwrap_or_default());
    }

    /// Parameters and estimated initial states.
    pub(super) fn unknowns(&self) -> usize {
        self.parameters + self.initial * self.experiments.len()
    }

    /// Number of outputs p.
    pub(super) fn outputs(&self) -> usize {
        self.coordinates.outputs.len()
    }

    /// One number per output, back in its units.
    pub(super) fn in_units_of_outputs(&self, scaled: &[f64]) -> Vec<f64> {
        scaled.iter().zip(&self.deviations).map(|(value, deviation)| value * deviation).collect()
    }

    /// The initial states of a point in the coordinates of the structure, those of a controller behind them.
    pub(super) fn initial_states(&self, point: &Point) -> Vec<Vec<f64>> {
        let scales = || self.coordinates.states.iter().copied().chain(std::iter::repeat(1.0));
        point.initial_states.iter().map(|x0| x0.iter().zip(scales()).map(|(z, t)| z * t).collect()).collect()
    }

    /// What is simulated with a sampled model, in the units of the data.
    pub(super) fn simulated(&self, model: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
        self.closure.as_ref().map_or_else(|| Ok(model.clone()), |closure| closure.close(model))
    }
}

impl Linearisation {
    /// Rows of the factor that belong to the Jacobian J, q columns, triangular.
    pub(super) fn jacobian(&self) -> MatRef<'_, f64> {
        self.factor.as_ref().subcols(0, self.parameters())
    }

    /// The residual r in the same rows.
    pub(super) fn residual(&self) -> MatRef<'_, f64> {
        self.factor.as_ref().subcols(self.parameters(), 1)
    }

    pub(super) fn parameters(&self) -> usize {
        self.factor.ncols() - 1
    }

    /// The same where only these parameters move.
    pub(super) fn along(&self, parameters: &[usize]) -> Linearisation {
        let (rows, count) = (self.factor.nrows(), parameters.len());
        if count == self.parameters() {
            return self.clone();
        }
        let column = |j: usize| parameters.get(j).copied().unwrap_or(self.parameters());
        let mut whole = Triangle::new(count + 1, rows);
        whole.fold_rows(Mat::from_fn(rows, count + 1, |i, j| self.factor[(i, column(j))]).as_ref());
        Linearisation { factor: whole.r().to_owned() }
    }

    /// Length of the part of r that J can remove, over the length of the rest, each by its degrees of freedom: the
    /// distance to the minimum in units of the radius of the confidence region.
    pub(super) fn relative_offset(&self, degrees_of_freedom: usize) -> f64 {
        let rank = leading_rank(self.factor.as_ref(), self.parameters());
        let (removable, rest) = self.residual().split_at_row(rank);
        let per_freedom = |r: MatRef<'_, f64>, freedom: usize| r.norm_l2() / (freedom.max(1) as f64).sqrt();
        let (offset, radius) = (per_freedom(removable, rank), per_freedom(rest, degrees_of_freedom));
        if offset == 0.0 { 0.0 } else { offset / radius }
    }
}

/// One positive size for each parameter.
fn checked_scales(scales: Vec<f64>, parameters: usize) -> Result<Vec<f64>> {
    if scales.len() != parameters {
        let what = "the number of typical sizes of the structure".into();
        return Err(Error::Ports { what, expected: parameters, found: scales.len() });
    }
    match scales.iter().find(|size| !(**size > 0.0 && size.is_finite())) {
        Some(bad) => {
            let what = "a typical size of a parameter".into();
            Err(Error::OutOfRange { what, value: *bad, must: "a positive number" })
        }
        None => Ok(scales),
    }
}

/// One deviation for each output, 1 where none are given.
fn checked_deviations(deviations: &[f64], outputs: usize) -> Result<Vec<f64>> {
    if deviations.is_empty() {
        return Ok(vec![1.0; outputs]);
    }
    if deviations.len() != outputs {
        let what = "the number of output deviations".into();
        return Err(Error::Ports { what, expected: outputs, found: deviations.len() });
    }
    match deviations.iter().find(|d| !(**d > 0.0 && d.is_finite())) {
        Some(bad) => {
            Err(Error::OutOfRange { what: "an output deviation".into(), value: *bad, must: "a positive number" })
        }
        None => Ok(deviations.to_vec()),
    }
}

fn interleave(experiment: &Experiment<'_>, deviations: &[f64]) -> Samples {
    let Experiment { u, y } = experiment;
    let u: Vec<f64> = u.row_iter().flat_map(|row| row.iter().copied()).collect();
    let y = y.row_iter().flat_map(|row| row.iter().zip(deviations).map(|(y, d)| y / d)).collect();
    Samples { u, y, count: experiment.u.nrows(), roots: Vec::new() }
}
