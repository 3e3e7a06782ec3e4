//! Whether the record supports the model: each figure has a limit, and a model is trusted where all hold.
//!
//! | figure | question |
//! |---|---|
//! | residual and excitation | does the excitation explain what the model leaves? |
//! | parts | do the parts of the record, and fresh records, ask for the same parameters? |
//! | noise of the parts | is the residual of fresh records as large as before? |
//! | nonlinear | does a function of input or velocity, filtered by the model, explain what the model leaves? |
//! | accuracy | how large is the stated deviation against the response? |

mod loop_evidence;
mod nonlinear;
mod parts;

pub(crate) use loop_evidence::of_loop;
pub(crate) use parts::Parts;

use crate::identify::likelihood::Evidence;
use crate::identify::likelihood::choose::problem::Solution;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::deviation::response;
use crate::linalg::TINY;
use faer::c64;

/// What the model and its residual say.
pub(crate) fn of_model(
    spectra: &Spectra,
    solution: &Solution,
    shares: &[f64],
    variances: &[Vec<f64>],
) -> Vec<Evidence> {
    let responses: Vec<_> = shares.iter().map(|s| response(&solution.chosen, *s)).collect();
    vec![accuracy(&responses, variances), nonlinear::nonlinear(spectra, solution)]
}

/// Stated deviation against the response, median over the frequencies.
pub(crate) fn accuracy(responses: &[Vec<c64>], variances: &[Vec<f64>]) -> Evidence {
    let mut shares: Vec<f64> = responses
        .iter()
        .zip(variances)
        .map(|(g, s)| {
            let size = g.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
            s.iter().sum::<f64>().sqrt() / size.max(TINY)
        })
        .collect();
    shares.sort_by(f64::total_cmp);
    let figure = shares.get(shares.len() / 2).copied().unwrap_or(f64::INFINITY);
    Evidence::new("Stated standard deviation over the response, median over frequency (uncertainty)", figure, 1.0)
}
