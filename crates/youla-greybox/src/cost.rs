//! The value of the criterion without a search: to choose between starts.

use super::criterion::Criterion;
use super::delays::Shifted;
use super::estimate::{Setting, comparison};
use super::{GreyBoxOptions, Structure};
use crate::Result;
use youla::identify::subspace::Experiment;
use youla::lti::Discrete;

/// [`super::GreyBoxModel::cost`] of the structure at `theta`: half the sum of squares of the residuals, each divided by the
/// deviation of its output, with the best initial states where they are estimated, and with the gain of the innovation form
/// at its start.
///
/// # Errors
/// As [`super::greybox`] with the start `theta`.
///
/// ```
/// use youla_greybox::{BearingStructure, GreyBoxOptions, greybox_cost};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::{Mat, rig::Bearing};
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(500, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let y = simulate(&Bearing::default().plant()?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let truth = BearingStructure::parameters(&Bearing::default());
/// let records = [Experiment { u: u.as_ref(), y: y.as_ref() }];
/// assert!(greybox_cost(&BearingStructure, &truth, &records, time, &GreyBoxOptions::default())? < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn greybox_cost(
    structure: &dyn Structure,
    theta: &[f64],
    experiments: &[Experiment<'_>],
    time: Discrete,
    options: &GreyBoxOptions,
) -> Result<f64> {
    let shifted = Shifted::new(experiments, &options.delays)?;
    let setting = Setting { closure: None, confined: false };
    let criterion = Criterion::new(structure, theta, &shifted.experiments(), time, comparison(setting, options))?;
    Ok(criterion.evaluate(&criterion.start(theta))?.cost)
}
