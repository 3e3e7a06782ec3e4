//! The items of the crossover map: noise x feedback x theta.

use super::item::Item;
use super::settings::PaperSettings;

/// First stream of the map; those of the study lie below.
const FIRST: u64 = 1 << 32;

/// Number of loops of the map.
pub fn count(settings: &PaperSettings) -> usize {
    let grid = &settings.crossover;
    grid.noise.len() * grid.theta.len() * grid.command_weights.len() * grid.repetitions
}

/// Loop number `index` of the map. Repetitions run fastest, then theta, noise and the weight of the command. The loops of one
/// repetition and theta have the same excitation and, up to its size, the same noise in all cells.
pub fn crossover(settings: &PaperSettings, index: usize) -> Item {
    let grid = &settings.crossover;
    let (rest, repetition) = (index / grid.repetitions, index % grid.repetitions);
    let (rest, theta) = (rest / grid.theta.len(), rest % grid.theta.len());
    let (weight, noise) = (rest / grid.noise.len(), rest % grid.noise.len());
    Item {
        index,
        stream: FIRST + 2 * (theta * grid.repetitions + repetition) as u64,
        theta: grid.theta[theta],
        noise: grid.noise[noise],
        command_weights: vec![grid.command_weights[weight]],
    }
}
