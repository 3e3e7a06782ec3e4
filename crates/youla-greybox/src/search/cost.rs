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
///
/// ```
/// use youla_greybox::{DeclaredStructure, GreyBoxOptions, Problem, Structure, Template, greybox_cost};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::Mat;
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(500, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let bearing = DeclaredStructure::new(&Template::Bearing.declaration()?)?;
/// let y = simulate(&bearing.model(&bearing.start())?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let truth = bearing.start();
/// let records = [Experiment::new(u.as_ref(), y.as_ref())];
/// assert!(greybox_cost(&Problem::new(&bearing, &records, time), &truth, &GreyBoxOptions::default())? < 1e-15);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn greybox_cost(problem: &Problem<'_>, theta: &[f64], options: &GreyBoxOptions) -> Result<f64> {
    let shifted = Shifted::new(problem.experiments, &options.delays)?;
    let compared = comparison(problem, options);
    let criterion = Criterion::new(problem.structure, theta, &shifted.experiments(), problem.time, compared)?;
    Ok(criterion.evaluate(&criterion.start(theta))?.cost)
}
