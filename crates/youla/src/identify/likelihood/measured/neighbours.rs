//! Models one step away: another dead time, one pole or pair less, one mode more.

use super::choose::{Fitted, Problem, Task};
use super::search::with_best_inputs;
use super::subspace::Subspace;
use crate::identify::likelihood::choose::neighbours::sets;
use crate::identify::likelihood::search::model::Model;
use rayon::prelude::*;

impl Problem<'_> {
    /// One sample of dead time more or less, one pole or pair less, one more.
    pub(super) fn neighbours(&self, at: &Fitted) -> Vec<Task> {
        let mut tasks = self.other_delays(at);
        if self.options().order.is_none() {
            tasks.extend(self.smaller(at));
            tasks.extend(self.larger(at));
        }
        tasks
    }

    fn other_delays(&self, at: &Fitted) -> Vec<Task> {
        if self.options().dead_time.is_some() {
            return Vec::new();
        }
        let mut tasks = Vec::new();
        for j in 0..at.delays.len() {
            for delay in [at.delays[j].checked_sub(1), Some(at.delays[j] + 1)].into_iter().flatten() {
                let mut delays = at.delays.clone();
                delays[j] = delay;
                let lines = self.lines(&delays);
                let without = fastest(&at.model).filter(|_| delay > at.delays[j] && self.options().order.is_none());
                let starts = [Some(at.model.clone()), without.map(|k| at.model.without(&[k]))];
                for start in starts.into_iter().flatten() {
                    let start = with_best_inputs(&lines, &start, at.feedthrough);
                    let delays = delays.clone();
                    let task = |start| Task { start, delays, feedthrough: at.feedthrough, origin: "another dead time" };
                    tasks.extend(start.map(task));
                }
            }
        }
        tasks
    }

    fn smaller(&self, at: &Fitted) -> Vec<Task> {
        let parts = at.model.separated().unwrap_or_else(|| at.model.clone());
        let lines = self.lines(&at.delays);
        let left = |set: Vec<usize>| {
            let model = parts.without(&set);
            (model.order() > 0).then(|| with_best_inputs(&lines, &model, at.feedthrough)).flatten()
        };
        let mut found: Vec<(f64, Model)> = sets(&parts)
            .into_par_iter()
            .filter_map(left)
            .map(|model| (self.criterion(lines.energy(&model), &model, at.feedthrough, lines.rows()), model))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(3);
        found.into_iter().map(|(_, start)| Task { start, ..Task::same(at, "one mode less") }).collect()
    }

    /// One pole or pair that the residual asks for.
    fn larger(&self, at: &Fitted) -> Vec<Task> {
        let mut left = self.lines(&at.delays);
        for line in &mut left.lines {
            let g = at.model.response(line.z);
            line.columns.iter_mut().for_each(|column| column.y = column.rest(&g, self.response().inputs));
        }
        let lines = self.lines(&at.delays);
        let Some(subspace) = Subspace::new(&left, 4) else { return Vec::new() };
        let wider = |more: usize| {
            if at.model.order() + more > self.largest_order() || more > subspace.orders() {
                return None;
            }
            let mut model = at.model.clone();
            model.blocks.extend(with_best_inputs(&left, &subspace.model(more)?, false)?.blocks);
            let start = with_best_inputs(&lines, &model, at.feedthrough)?;
            Some(Task { start, ..Task::same(at, "one mode more") })
        };
        [1, 2, 4].into_iter().filter_map(wider).collect()
    }
}

/// The block whose poles are nearest to zero.
fn fastest(model: &Model) -> Option<usize> {
    let size = |k: &usize| model.blocks[*k].poles().iter().map(|p| p.norm()).fold(0.0, f64::max);
    (0..model.blocks.len()).min_by(|a, b| size(a).total_cmp(&size(b))).filter(|_| model.blocks.len() > 1)
}
