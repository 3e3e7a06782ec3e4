//! A start of a given order from the model that the records ask for: the regressions of a given order alone often lead to a local
//! minimum, as the order leaves no room for a detour.

use super::grow;
use super::problem::{Problem, Task};
use crate::identify::likelihood::search::balancing::balanced;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::Point;
use crate::identify::likelihood::search::with_best_inputs;
use std::sync::Arc;

impl Problem<'_> {
    /// The model of an order of its own, with its least balanced states left out or further modes added.
    pub(crate) fn resized(&self, order: usize) -> Option<Task> {
        let free = Problem { order: None, ..self.clone() };
        let chosen = free.solve(&mut Vec::new())?.chosen;
        let spectra = Arc::new(self.spectra(&chosen.delays));
        let noise = &chosen.found.noise;
        let mut point = chosen.found.point;
        while point.model.order() < order {
            let (_, block) = grow::modes(&spectra, &point, noise, 1).into_iter().next()?;
            point = with_best_inputs(&spectra, grow::with_block(&point.model, block), noise, self.feedthrough);
        }
        let start = match point.model.order() == order {
            true => point,
            false => with_best_inputs(&spectra, truncated(&point, order)?, noise, self.feedthrough),
        };
        Some(Task { spectra, start, origin: "the model of free order".into() })
    }
}

/// The leading balanced states.
fn truncated(point: &Point, order: usize) -> Option<Model> {
    let (a, b, c) = point.model.matrices();
    let [a, b, c] = balanced(a.as_ref(), b.as_ref(), c.as_ref());
    let leading = a.submatrix(0, 0, order, order);
    Model::of(leading, b.subrows(0, order), c.subcols(0, order), point.model.d.clone())
}
