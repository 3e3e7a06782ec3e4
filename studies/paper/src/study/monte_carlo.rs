//! The items of Figs 4 and 5.

use super::item::{Item, generator};
use super::settings::PaperSettings;
use rand::RngExt;

/// Stream of theta; those of the records lie above.
const THETA: u64 = 1 << 40;

/// Nominal model number `index`, with theta drawn from a stream of its own, so that any part of the study can be computed
/// without the others. `noise` is that of the rig, um rms.
pub fn monte_carlo(settings: &PaperSettings, noise: f64, index: usize) -> Item {
    let [low, high] = settings.study.theta;
    let theta = low + (high - low) * generator(settings.seed, THETA + index as u64).random::<f64>();
    let command_weights = settings.controller.command_weights.clone();
    Item { index, stream: 2 * index as u64, theta, noise, command_weights }
}
