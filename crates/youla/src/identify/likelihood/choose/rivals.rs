//! Models that Schwarz's criterion does not choose and that the records may not tell from the chosen one: with poles of their own for each channel,
//! an integrator beside a pole outside of the unit circle, and lags in place of a dead time. They count by Akaike's criterion where it is that of lags,
//! and are searched to their end whatever Schwarz's says on the way.

use super::neighbours::FAST;
use super::problem::{Choice, Problem, Task};
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::model::Model;
use std::sync::Arc;

/// Ratio of the decays of the first and the last of the poles that are tried in place of one.
const APART: f64 = 1.5;

/// The same model with every real pole once for each output, or for each input where these are fewer: entries of a process with lags of their
/// own share no poles, and a pole that they share is what is left of several. The decays of the copies lie apart by a ratio. `None` where
/// nothing would change.
fn with_own_poles(model: &Model, ratio: f64) -> Option<Model> {
    let (m, p) = (model.inputs, model.outputs);
    let by_output = m == 1 || (2..=m).contains(&p);
    let copies = if by_output { p } else { m };
    if copies < 2 || model.blocks.iter().all(|block| block.states > 1) {
        return None;
    }
    let of_real = |block: &Block| -> Vec<Block> {
        let copy = |k: usize| {
            let (b, c): (Vec<f64>, Vec<f64>) = if by_output {
                (block.b.iter().map(|b| b * block.c[k]).collect(), (0..p).map(|o| f64::from(o == k)).collect())
            } else {
                ((0..m).map(|j| f64::from(j == k)).collect(), block.c.iter().map(|c| c * block.b[k]).collect())
            };
            let a = vec![block.a[0].signum() * block.a[0].abs().powf(ratio.powf(k as f64 / (copies - 1) as f64 - 0.5))];
            Block { a, b, c, ..block.clone() }.levelled()
        };
        if block.states == 1 { (0..copies).map(copy).collect() } else { vec![block.clone()] }
    };
    Some(Model { blocks: model.blocks.iter().flat_map(of_real).collect(), ..model.clone() })
}

/// The same with the poles of the first channel the slowest, and the fastest.
fn with_poles_of_their_own(model: &Model) -> Vec<Model> {
    let parts = model.separated();
    [APART, 1.0 / APART].into_iter().filter_map(|ratio| with_own_poles(parts.as_ref()?, ratio)).collect()
}

/// Models with what they are.
type Named = Vec<(Model, &'static str)>;

impl Problem<'_> {
    /// Starts of all kinds; none where the order is fixed.
    pub(super) fn rivals(&self, best: &Choice) -> Vec<Task> {
        if self.order.is_some() {
            return Vec::new();
        }
        let model = &best.found.point.model;
        let own = with_poles_of_their_own(model).into_iter().map(|model| (model, "poles of their own"));
        let integrator = model.with_integrator_beside().map(|model| (model, "an integrator beside a pole outside"));
        let here = (best.delays.clone(), own.chain(integrator).collect());
        let groups = std::iter::once(here).chain(self.lags_for_delays(best));
        groups.flat_map(|(delays, models)| self.starts_of(best, &delays, models)).collect()
    }

    /// The models with their best inputs, as far as their order is allowed.
    fn starts_of(&self, best: &Choice, delays: &[usize], mut models: Named) -> Vec<Task> {
        models.retain(|(model, _)| model.order() <= self.largest_order);
        if models.is_empty() {
            return Vec::new();
        }
        let spectra = Arc::new(self.spectra(delays));
        let task = |(model, origin): (Model, &str)| self.beside(&best.found.noise, model, &spectra, origin);
        models.into_iter().map(task).collect()
    }

    /// One lag, and two, in place of the whole dead time of an input: several lags that are hardly distinguished look like one dead time.
    fn lags_for_delays(&self, best: &Choice) -> Vec<(Vec<usize>, Named)> {
        let of_input = |j: usize| {
            let (d, mut delays) = (best.delays[j] as f64, best.delays.clone());
            delays[j] = 0;
            let lags = [vec![1.0 - 1.0 / d], vec![(1.0 - 2.0 / d).max(FAST); 2]];
            let models = lags.iter().filter_map(|lags| best.found.point.model.with_lags(j, lags));
            (delays, models.map(|model| (model, "lags for a dead time")).collect())
        };
        let free = self.dead_time.is_none();
        (0..best.delays.len()).filter(|j| free && best.delays[*j] > 1).map(of_input).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::c64;

    /// Poles of their own that have not moved yet are the model that they come from, by output as by input.
    #[test]
    fn poles_of_their_own_begin_as_the_model() {
        let lag = |a: f64, b: &[f64], c: &[f64]| Block { states: 1, a: vec![a], b: b.to_vec(), c: c.to_vec() };
        let wide = vec![lag(0.9, &[0.2, -0.1], &[1.0, 0.5]), lag(0.5, &[0.3, 0.4], &[-0.7, 2.0])];
        let tall = vec![lag(0.9, &[0.2, -0.1], &[1.0, 0.5, 3.0])];
        for (outputs, blocks, order) in [(2, wide, 4), (3, tall, 2)] {
            let model = Model { inputs: 2, outputs, blocks, d: vec![0.0; 2 * outputs] };
            let own = with_own_poles(&model, 1.0).unwrap();
            assert_eq!(own.order(), order);
            let z = c64::cis(0.3);
            for (a, b) in own.response(z).into_iter().zip(model.response(z)) {
                assert!((a - b).norm() < 1e-12 * b.norm(), "{a} {b}");
            }
            let apart = with_own_poles(&model, APART).unwrap();
            let ratio = apart.poles()[0].norm().ln() / apart.poles()[1].norm().ln();
            assert!((ratio * APART - 1.0).abs() < 1e-12, "{ratio}");
        }
    }
}
