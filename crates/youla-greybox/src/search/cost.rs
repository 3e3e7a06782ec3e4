//! The value of the criterion without a search: to choose between starts.

use crate::Result;
use crate::delays::Shifted;
use crate::search::criterion::Criterion;
use crate::search::estimate::comparison;
use crate::{GreyBoxOptions, Problem};

/// [`crate::GreyBoxModel::cost`] of the structure at `theta`: half the sum of squares of the residuals, each divided by the
/// deviation of its output, with the best initial states where they are estimated, and with the gain of the innovation form
/// at its start.
///
/// # Errors
/// As [`crate::greybox`] with the start `theta`.
pub(crate) fn greybox_cost(problem: &Problem<'_>, theta: &[f64], options: &GreyBoxOptions) -> Result<f64> {
    let shifted = Shifted::new(problem.experiments, &options.delays)?;
    let compared = comparison(problem, options);
    let criterion = Criterion::new(problem.structure, theta, &shifted.experiments(), problem.time, compared)?;
    Ok(criterion.evaluate(&criterion.start(theta))?.cost)
}
