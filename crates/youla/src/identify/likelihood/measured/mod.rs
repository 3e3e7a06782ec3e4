//! The model that a measured response supports: maximum likelihood on its lines, weighted by their covariance; starts from a
//! frequency-domain subspace method, order and dead time by evidence.
//!
//! Every experiment e of a line k gives `Y = G U + V`, where `[U; Y]` has the known covariance C, so that
//! ```text
//! -2 log likelihood = 2 sum over k, e of |W (Y - G U)|^2,     W^H W = ([-G I] C [-G I]^H)^-1
//! ```
//! For a response from the excitation d to `[u, y]` the input is in error as well, and G needs no quotient of responses; for the
//! response of a plant U is the identity.
//!
//! Source: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. (2012), chapters 9 and 12.
//!
//! | step | module |
//! |---|---|
//! | lines with their covariance | `data` |
//! | scaled channels, dead time, whitening | `lines` |
//! | starts of all orders from one decomposition | `subspace` |
//! | search in local coordinates | `search` |
//! | order, dead time and direct path by Schwarz's criterion | `choose`, `neighbours` |
//! | questions to the lines | `evidence` |

mod choose;
mod data;
mod evidence;
mod lines;
mod neighbours;
mod search;
mod subspace;
#[cfg(test)]
mod tests;

pub use data::{MeasuredResponse, ResponseTable, ResponseVariance};

use super::LikelihoodOptions;
use crate::identify::likelihood::deviation::region::Region;
use crate::identify::likelihood::deviation::root::Root;
use crate::identify::likelihood::deviation::{Directions, inverse_root, mode_estimates, physical};
use crate::identify::likelihood::recommendation::{Predictor, Recommendation};
use crate::identify::verdict::of_response;
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Mat, Result};
use choose::Problem;
use std::f64::consts::TAU;

/// The model that a measured response supports, with its evidence.
///
/// Order, dead time and direct path are chosen by Schwarz's criterion where the options leave them open. Without a stated variance
/// the lines state it by their distance from the model; a model that misses dynamics is then noticed only by errors of neighbouring
/// lines that agree. The predictor has no gain: lines do not tell how noise and initial state share the outputs.
///
/// A controller `u = K y` that ran during the measurement must stabilise the model; without one nothing is asked of the loop.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::TooFewSamples`] says how many lines are needed, [`Error::Ports`] and [`Error::OutOfRange`] name an option that cannot
/// be met; [`Error::NoCandidate`] where no search ends; ports of the controller.
pub(crate) fn recommend_from_response(
    response: &MeasuredResponse,
    controller: Option<&StateSpace<Discrete>>,
    options: &LikelihoodOptions,
) -> Result<Recommendation> {
    let problem = Problem::new(response, options)?.refined();
    let mut candidates = Vec::new();
    let (chosen, rivals) =
        problem.solve(&mut candidates).ok_or(Error::NoCandidate { samples: response.omega.len() })?;
    let lines = problem.weighed(&chosen);
    let chart = chosen.chart();
    let factor = search::linearise(&lines, &chosen.model, &chart);
    let scale = if response.known() { 1.0 } else { (chosen.energy / lines.rows() as f64).sqrt() };
    let root = Root::dense(inverse_root(&factor, chart.parameters())).scaled(scale);
    let shares: Vec<f64> = response.omega.iter().map(|w| w * response.time.ts() / TAU).collect();
    let others = rivals.iter().map(|c| (c.model.clone(), c.delays.clone(), c.criterion)).collect();
    let modes = mode_estimates::of_blocks(&chosen.model, &chart, &root, response.time);
    let directions = Directions::of_parts((chosen.model.clone(), chosen.delays.clone()), chart, root, others);
    let plant = physical::realised(&chosen.model, &chosen.delays, problem.sizes(), response.time)?;
    let region = Region::new(problem.sizes().clone(), response.time, &shares, directions);
    let judged = of_response(&plant, &region, controller)?;
    let evidence = std::iter::once(evidence::of_lines(&problem, &chosen)).chain(judged.evidence).collect();
    Ok(Recommendation {
        predictor: without_noise(&plant),
        plant,
        dead_time: chosen.delays.clone(),
        order: chosen.model.order(),
        region,
        modes,
        candidates,
        evidence,
        loop_ratio: judged.loop_ratio,
        entry_bands: judged.entry_bands,
        bands: judged.bands,
    })
}

fn without_noise(plant: &StateSpace<Discrete>) -> Predictor {
    Predictor {
        a: plant.a().to_owned(),
        b: plant.b().to_owned(),
        c: plant.c().to_owned(),
        d: plant.d().to_owned(),
        k: None,
        covariance: Mat::zeros(plant.outputs(), plant.outputs()),
    }
}
