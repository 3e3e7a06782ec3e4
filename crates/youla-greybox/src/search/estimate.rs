//! From records to an estimate with its diagnostics.

use crate::GreyBoxOptions;
use crate::delays::Shifted;
use crate::problem::Problem;
use crate::result::GreyBoxModel;
use crate::search::bounds::Bounds;
use crate::search::criterion::{Comparison, Criterion, Point};
use crate::search::fit::reproduction;
use crate::search::levenberg::{Outcome, minimise};
use crate::search::uncertainty::{Information, spread};
use crate::{Error, Result};
use faer::Scale;
use youla::Mat;
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, StateSpace, simulate};

/// A search that has ended.
struct Searched {
    outcome: Outcome,
    /// Factor of `(J' J)^-1` in the covariance.
    variance: f64,
    /// `(J' J)^-1` over the free parameters.
    inverse: Option<Mat<f64>>,
    sizes: Vec<f64>,
}

pub(crate) fn estimate(problem: &Problem<'_>, start: &[f64], options: &GreyBoxOptions) -> Result<GreyBoxModel> {
    options.check()?;
    let (structure, time) = (problem.structure, problem.time);
    if structure.names().is_empty() {
        let (what, must) = ("the number of free parameters of the structure".into(), "at least 1");
        return Err(Error::Method(youla::Error::OutOfRange { what, value: 0.0, must }));
    }
    if problem.closure.is_some() && options.delays.iter().any(|delay| *delay > 0) {
        let (what, instead) = ("a delay of an input inside of a simulated loop", "put it into the controller");
        return Err(Error::Method(youla::Error::Unsupported { what, instead }));
    }
    let shifted = Shifted::new(problem.experiments, &options.delays)?;
    let experiments = &shifted.experiments();
    let criterion = Criterion::new(structure, start, experiments, time, comparison(problem, options))?;
    let names = criterion.names();
    let bounds = Bounds::new(structure, start)?.extended(&names);
    let begin = criterion.start(start);
    let Searched { outcome, variance, inverse, sizes } = search(&criterion, &bounds, &begin, options)?;
    let point = &outcome.point;
    let (parameters, gain) = criterion.split(&point.theta);
    let information = Information::new(&outcome.linearisation, &sizes, criterion.energy.sqrt());
    let all = |inverse: Mat<f64>| Scale(variance) * spread(inverse.as_ref(), &outcome.face.free, names.len());
    let own = parameters.len();
    let model = structure.sampled(&parameters, time)?;
    let initial_states = criterion.initial_states(point);
    let (fit, residual) = compared(experiments, &criterion, point)?;
    let simulates = criterion.simulates();
    let simulation_fit = if simulates { fit.clone() } else { simulated_fit(experiments, &model, &initial_states)? };
    Ok(GreyBoxModel {
        covariance: inverse.map(|inverse| all(inverse).as_ref().submatrix(0, 0, own, own).to_owned()),
        stable: model.is_stable()?,
        continuous: structure.sample_time().is_none().then(|| structure.model(&parameters)).transpose()?,
        model: shifted.delays.put_before(model)?,
        gain,
        initial_states: shifted.initial_states(initial_states),
        cost: point.cost,
        fit,
        residual,
        simulation_fit,
        residuals: criterion.degrees_of_freedom + criterion.unknowns(),
        unknowns: criterion.unknowns(),
        stop: outcome.stop,
        relative_offset: outcome.face.here.relative_offset(criterion.degrees_of_freedom),
        iterations: outcome.work.iterations,
        evaluations: outcome.work.evaluations,
        diverged: outcome.work.diverged,
        rank: information.rank,
        rcond: information.rcond,
        undetermined: information.undetermined(&names, &sizes),
        at_bounds: bounds.touched(&point.theta),
        parameters,
    })
}

/// What the criterion compares.
pub(crate) fn comparison<'a>(problem: &Problem<'a>, options: &'a GreyBoxOptions) -> Comparison<'a> {
    Comparison {
        closure: problem.closure,
        noise: &options.noise,
        initial_state: options.initial_state,
        deviations: &options.output_deviations,
    }
}

/// The minimum from `start`.
fn search(criterion: &Criterion<'_>, bounds: &Bounds, start: &[f64], options: &GreyBoxOptions) -> Result<Searched> {
    let outcome = minimise(criterion, bounds, start, options)?;
    let variance = 2.0 * outcome.point.cost / criterion.degrees_of_freedom as f64;
    let theta = &outcome.point.theta;
    let size = |(j, (v, scale)): (usize, (&f64, &f64))| match v.abs() {
        0.0 => *scale,
        own if j < criterion.physical => own,
        gain => gain.max(*scale),
    };
    let sizes: Vec<f64> = theta.iter().zip(&criterion.scales).enumerate().map(size).collect();
    let free_sizes: Vec<f64> = outcome.face.free.iter().map(|j| sizes[*j]).collect();
    let inverse = Information::new(&outcome.face.here, &free_sizes, criterion.energy.sqrt()).inverse;
    Ok(Searched { outcome, variance, inverse, sizes })
}

/// Fit and root mean square of what the criterion compares.
fn compared(experiments: &[Experiment<'_>], criterion: &Criterion<'_>, point: &Point) -> Result<(Vec<f64>, Vec<f64>)> {
    let p = criterion.outputs();
    let deviations = criterion.in_units_of_outputs(&vec![1.0; p]);
    let error = |e: &Vec<f64>| Mat::from_fn(e.len() / p, p, |k, i| e[k * p + i] * deviations[i]);
    let errors: Vec<Mat<f64>> = criterion.residuals(point)?.iter().map(error).collect();
    let outputs = reproduction(&measured(experiments), &errors);
    Ok((outputs.iter().map(|o| o.fit).collect(), outputs.iter().map(|o| o.residual).collect()))
}

/// Fit of the simulation, minus infinity where it diverges.
fn simulated_fit(
    experiments: &[Experiment<'_>],
    model: &StateSpace<Discrete>,
    initial_states: &[Vec<f64>],
) -> Result<Vec<f64>> {
    let mut errors = Vec::new();
    for (e, x0) in experiments.iter().zip(initial_states) {
        match simulate(model, e.u, x0) {
            Ok(simulated) => errors.push(e.y - simulated),
            Err(youla::Error::Diverged { .. }) => return Ok(vec![f64::NEG_INFINITY; model.outputs()]),
            Err(other) => return Err(other.into()),
        }
    }
    let fit = |fit: f64| if fit.is_finite() { fit } else { f64::NEG_INFINITY };
    Ok(reproduction(&measured(experiments), &errors).iter().map(|o| fit(o.fit)).collect())
}

fn measured<'a>(experiments: &[Experiment<'a>]) -> Vec<youla::MatRef<'a, f64>> {
    experiments.iter().map(|e| e.y).collect()
}
