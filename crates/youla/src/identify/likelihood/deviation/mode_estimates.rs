//! Modes of the recommended model with standard deviations, from the slopes of the poles in the parameters of their block:
//!
//! ```text
//! var f = (df/dtheta) (J'J)^-1 (df/dtheta)',     f: natural frequency, damping ratio, magnitude
//! ```

use super::root::Root;
use crate::identify::likelihood::choose::loads::Nuisance;
use crate::identify::likelihood::choose::problem::Choice;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::lti::Discrete;
use crate::lti::modes::{Mode, mode};
use faer::c64;

/// Step of the central differences, in units of the entries of a balanced A.
const STEP: f64 = 1e-6;

/// One real pole or pair with standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeEstimate {
    /// Natural frequency, damping ratio and pole.
    pub mode: Mode,
    /// Standard deviation of the natural frequency, Hz.
    pub hz_deviation: f64,
    /// Standard deviation of the damping ratio.
    pub zeta_deviation: f64,
    /// Standard deviation of the magnitude of the pole.
    pub magnitude_deviation: f64,
}

/// Modes of a choice, by natural frequency.
pub(crate) fn modes(spectra: &Spectra, choice: &Choice, nuisance: &Nuisance, time: Discrete) -> Vec<ModeEstimate> {
    let found = &choice.found;
    let chart = Chart::new(&found.point.model, found.feedthrough);
    let root = Root::new(spectra, &found.point, &chart, &found.noise, nuisance);
    of_blocks(&found.point.model, &chart, &root, time)
}

/// Modes of a model whose parameters have the covariance `root root'`, by natural frequency.
pub(crate) fn of_blocks(model: &Model, chart: &Chart, root: &Root, time: Discrete) -> Vec<ModeEstimate> {
    let mut out = Vec::new();
    let mut at = 0;
    for (place, block) in model.blocks.iter().enumerate() {
        for pole in block.poles().into_iter().filter(|p| p.im >= 0.0) {
            let slopes = slopes(block, (chart, place), pole, time);
            let deviation = |figure: usize| {
                let along = |c: usize| {
                    slopes.iter().enumerate().map(|(q, s)| s[figure] * root.shared[(at + q, c)]).sum::<f64>()
                };
                (0..root.shared.ncols()).map(|c| along(c).powi(2)).sum::<f64>().sqrt()
            };
            out.push(ModeEstimate {
                mode: mode(time, pole),
                hz_deviation: deviation(0),
                zeta_deviation: deviation(1),
                magnitude_deviation: deviation(2),
            });
        }
        at += chart.parameters_of(place);
    }
    out.sort_by(|a, b| a.mode.hz.total_cmp(&b.mode.hz));
    out
}

/// Slopes of frequency, damping and magnitude of a pole in each direction of its block, by central differences.
fn slopes(block: &Block, (chart, place): (&Chart, usize), pole: c64, time: Discrete) -> Vec<[f64; 3]> {
    let figures = |pole: c64| {
        let mode = mode(time, pole);
        [mode.hz, mode.zeta, pole.norm()]
    };
    let moved = |q: usize, step: f64| {
        let mut other = block.clone();
        other.a.iter_mut().enumerate().for_each(|(i, a)| *a += step * chart.direction(place, i, q));
        let distance = |p: &c64| (p - pole).norm();
        let near = other.poles().into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        figures(near.unwrap_or(pole))
    };
    let slope = |q: usize| {
        let (up, down) = (moved(q, STEP), moved(q, -STEP));
        std::array::from_fn(|k| (up[k] - down[k]) / (2.0 * STEP))
    };
    (0..chart.parameters_of(place)).map(slope).collect()
}
