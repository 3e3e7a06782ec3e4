//! The search from several starts: the given one and points around it.
//!
//! ```text
//! theta_j,k = theta_j factor^(2 h_j,k - 1),   h the points of J. H. Halton, leaped, k = 1 ... starts - 1
//! ```
//! logarithmic in each parameter, within its bounds, signs kept (`projection/design.rs`). The criterion can be computed at all
//! of them and the search begun at the best few only: an evaluation costs a fifth of a step, a search 10 to 50 steps.

use super::projection::{Neighbourhood, spread};
use super::{GreyBoxModel, GreyBoxOptions, Problem, Stop, Structure, greybox, greybox_cost};
use crate::{Error, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use youla::MatRef;
use youla::linalg::check_shape;

/// Every how many-th of Halton's points is taken.
const LEAP: usize = 409;

/// Choices of [`greybox_multi_start`].
///
/// ```
/// use youla_greybox::MultiStartOptions;
/// let screened = MultiStartOptions { starts: 64, searched: Some(4), ..Default::default() };
/// assert_eq!((screened.factor, screened.pem.max_iterations), (4.0, 50));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MultiStartOptions {
    /// Number of starts, the given one among them.
    pub starts: usize,
    /// Each parameter starts between its given value over this and times this. One that is given as zero stays there.
    pub factor: f64,
    /// Only from so many starts, those with the lowest criterion, is a search begun; absent: from all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub searched: Option<usize>,
    /// The search.
    pub pem: GreyBoxOptions,
}

impl Default for MultiStartOptions {
    fn default() -> Self {
        MultiStartOptions { starts: 16, factor: 4.0, searched: None, pem: GreyBoxOptions::default() }
    }
}

/// Where a search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchEnd {
    /// The criterion there.
    pub cost: f64,
    /// Why it ended.
    pub stop: Stop,
    /// Steps that it took.
    pub iterations: usize,
}

/// One start.
#[derive(Debug)]
pub struct StartRun {
    /// The parameters.
    pub start: Vec<f64>,
    /// The criterion there, infinite where there is no model or its simulation diverges.
    pub cost_at_start: f64,
    /// Where the search ended, or why it led to no model; `None` where none was begun.
    pub end: Option<Result<SearchEnd>>,
}

/// Result of [`greybox_multi_start`].
#[derive(Debug)]
pub struct MultiStart {
    /// All starts, the given one first.
    pub runs: Vec<StartRun>,
    /// Number of the start whose search ended lowest, from 0; of equal ones the first.
    pub won: usize,
    /// Its model.
    pub model: GreyBoxModel,
}

/// Searches from `start` and from points around it, all on the threads of rayon's pool, and returns the model with the lowest
/// criterion. The result does not depend on the number of threads.
///
/// # Errors
/// As [`greybox`] where the given start fits nothing or no search leads to a model; [`youla::Error::OutOfRange`] for options without
/// meaning.
///
/// ```
/// use youla_greybox::*;
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::Mat;
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(400, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let bearing = DeclaredStructure::new(&Template::Bearing.declaration()?)?;
/// let y = simulate(&bearing.model(&bearing.start())?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let truth = bearing.start();
/// let start: Vec<f64> = truth.iter().map(|v| 1.3 * v).collect();
/// let options = MultiStartOptions { starts: 4, searched: Some(1), ..Default::default() };
/// let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
/// let found =
///     greybox_multi_start(&Problem::new(&bearing, &experiments, time), &start, &options)?;
/// assert_eq!((found.runs.len(), found.runs.iter().filter(|run| run.end.is_some()).count()), (4, 1));
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn greybox_multi_start(problem: &Problem<'_>, start: &[f64], options: &MultiStartOptions) -> Result<MultiStart> {
    let structure = problem.structure;
    check(structure, start, options)?;
    let limits = structure.bounds();
    let around = Neighbourhood { factor: options.factor, points: options.starts, leap: LEAP, limits: &limits };
    let starts = spread(start, &around);
    let cost = |theta: &Vec<f64>| greybox_cost(problem, theta, &options.pem);
    let costs: Vec<f64> = starts.par_iter().map(|theta| cost(theta).unwrap_or(f64::INFINITY)).collect();
    let chosen = lowest(&costs, options.searched.unwrap_or(options.starts));
    let search = |k: &usize| (*k, greybox(problem, &starts[*k], &options.pem));
    let found: Vec<(usize, Result<GreyBoxModel>)> = chosen.par_iter().map(search).collect();
    let runs = starts.into_iter().zip(costs);
    let mut runs: Vec<StartRun> =
        runs.map(|(start, cost_at_start)| StartRun { start, cost_at_start, end: None }).collect();
    let mut best: Option<(usize, GreyBoxModel)> = None;
    for (k, outcome) in found {
        runs[k].end = Some(outcome.map(|model| {
            let end = SearchEnd { cost: model.cost, stop: model.stop, iterations: model.iterations };
            if best.as_ref().is_none_or(|(_, best)| model.cost < best.cost) {
                best = Some((k, model));
            }
            end
        }));
    }
    match best {
        Some((won, model)) => Ok(MultiStart { runs, won, model }),
        None => Err(first_error(runs)),
    }
}

/// Why the first search led to no model.
fn first_error(runs: Vec<StartRun>) -> Error {
    let first = runs.into_iter().find_map(|run| run.end?.err());
    first.unwrap_or(Error::NoStart).within("the prediction-error method from several starts")
}

fn check(structure: &dyn Structure, start: &[f64], options: &MultiStartOptions) -> Result<()> {
    let theta = MatRef::from_column_major_slice(start, start.len(), 1);
    check_shape("the start vector of the parameters", theta, (structure.names().len(), 1))?;
    let refused =
        |what: &str, value: f64, must| Err(Error::Method(youla::Error::OutOfRange { what: what.into(), value, must }));
    if options.starts == 0 || options.searched == Some(0) {
        return refused("the number of starts, or of those from which a search is begun", 0.0, "at least 1");
    }
    if !(options.factor >= 1.0 && options.factor.is_finite()) {
        return refused("the factor within which starts lie", options.factor, "a number from 1");
    }
    Ok(())
}

/// The numbers of the lowest values, as many as asked for, in rising order of the numbers; of equal values the first.
fn lowest(costs: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    order.truncate(count);
    order.sort_unstable();
    order
}
