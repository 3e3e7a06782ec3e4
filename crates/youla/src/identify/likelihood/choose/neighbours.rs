//! Models one step away: another dead time, one pole or pair less, one mode more, two modes for one.

use super::grow;
use super::problem::{Choice, LONG, NOISE_ORDER, Problem, Task};
use super::starts::COMPARED;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::{deviance, with_best_inputs};
use faer::Mat;
use rayon::prelude::*;
use std::sync::Arc;

/// Largest change of the dead time of a single input in a step, samples.
const REACH: usize = 12;

/// The same for several inputs, and on long records, whose dead time was chosen on a part of them.
const NEAR_REACH: usize = 2;

/// Pole from which the search of a lag in place of a sample of dead time starts; at zero both are the same.
const FAST: f64 = 0.1;

/// Ratio of the decays of the first and the last of the poles that are tried in place of one.
const APART: f64 = 1.5;

/// Damping ratio up to which a mode is tried as two.
const LIGHTLY_DAMPED: f64 = 0.1;

/// The model with two modes of half the damping in place of block k, apart by its width; `None` where that is not a lightly damped mode.
fn halved(model: &Model, k: usize) -> Option<Model> {
    let block = model.blocks.get(k).filter(|b| b.states == 2)?;
    let pole = block.poles().into_iter().find(|p| p.im > 0.0)?;
    let (decay, angle) = (-pole.norm().ln(), pole.arg());
    if decay <= 0.0 || decay > LIGHTLY_DAMPED * angle {
        return None;
    }
    let moved = |side: f64| {
        // Turned and stretched in its own coordinates: A = T [re im; -im re] T^-1 keeps T.
        let to = faer::c64::from_polar((-0.5 * decay).exp(), angle + side * decay);
        let (scale, shift) = (to.im / pole.im, to.re - pole.re * to.im / pole.im);
        let a = (0..4).map(|i| scale * block.a[i] + if i % 3 == 0 { shift } else { 0.0 }).collect();
        Block { a, ..block.clone() }
    };
    let mut wider = model.clone();
    wider.blocks[k] = moved(-1.0);
    wider.blocks.push(moved(1.0));
    Some(wider)
}

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

/// The lines for other delays.
struct Around {
    spectra: Arc<Spectra>,
    delays: Vec<usize>,
}

/// A step: the place of its delays, and that of the set of blocks that is left out.
#[derive(Clone, Copy)]
struct Step {
    around: usize,
    without: Option<usize>,
}

/// Blocks that may be left out: each alone, and two real poles together, as one of them alone often is needed by the other.
pub(crate) fn sets(parts: &Model) -> Vec<Vec<usize>> {
    let real: Vec<usize> = (0..parts.blocks.len()).filter(|k| parts.blocks[*k].states == 1).collect();
    let pairs = real.iter().enumerate().flat_map(|(k, a)| real[k + 1..].iter().map(move |b| vec![*a, *b]));
    (0..parts.blocks.len()).map(|k| vec![k]).chain(pairs).collect()
}

impl Problem<'_> {
    /// Starts one delay or one block away.
    pub(crate) fn neighbours(&self, best: &Choice) -> Vec<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        let parts = model.separated().unwrap_or_else(|| model.clone());
        let around: Vec<Vec<usize>> = self.shifted(&best.delays).into_iter().chain([best.delays.clone()]).collect();
        let prepared = |delays: Vec<usize>| Around { spectra: Arc::new(self.spectra(&delays)), delays };
        let around: Vec<Around> = around.into_par_iter().map(prepared).collect();
        let sets = sets(&parts);
        let start_of = |step: Step| step.without.map_or_else(|| model.clone(), |set| parts.without(&sets[set]));
        let per_order = (self.samples().0 as f64).ln() * (self.inputs() + self.outputs()) as f64;
        let judged = |step: Step| {
            let spectra = &around[step.around].spectra;
            let every = spectra.every(COMPARED);
            let thin = spectra.thinned(every);
            let start = start_of(step);
            let states = start.order() as f64;
            let point = with_best_inputs(&thin, start, noise, self.feedthrough);
            (deviance(&thin, &point, NOISE_ORDER).0 * every as f64 + per_order * states, step)
        };
        let steps = self.steps(best, &around, &sets);
        let mut starts: Vec<(f64, Step)> = steps.into_par_iter().map(judged).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut tasks = Vec::new();
        for step in self.promising(best, &around, &starts, &sets) {
            let Around { spectra, delays } = &around[step.around];
            let start = with_best_inputs(spectra, start_of(step), noise, self.feedthrough);
            let origin = if step.without.is_some() { "one mode less" } else { "another dead time" };
            tasks.push(Task { spectra: spectra.clone(), start, delays: delays.clone(), origin: origin.into() });
        }
        if let Some(here) = around.last() {
            tasks.extend(self.one_more(best, &here.spectra));
            tasks.extend(self.split(best, &parts, &here.spectra));
        }
        let sooner = around.iter().find(|a| a.delays.len() == 1 && a.delays[0] + 1 == best.delays[0]);
        tasks.extend(sooner.and_then(|sooner| self.pole_for_delay(best, sooner)));
        tasks
    }

    /// One sample of the dead time of a single input as a fast pole: an actuator's lag is often taken for it.
    fn pole_for_delay(&self, best: &Choice, sooner: &Around) -> Option<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        let n = model.order();
        if self.order.is_some() || n + 1 > self.largest_order {
            return None;
        }
        let (a, b, c) = model.matrices();
        let wide = Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
            (true, true) => a[(i, j)],
            (true, false) => b[(i, 0)],
            (false, true) => 0.0,
            (false, false) => FAST,
        });
        let input = Mat::from_fn(n + 1, 1, |i, _| if i == n { 1.0 - FAST } else { 0.0 });
        let output = Mat::from_fn(c.nrows(), n + 1, |i, j| if j < n { c[(i, j)] } else { model.d[i] });
        let lagged = Model::of(wide.as_ref(), input.as_ref(), output.as_ref(), vec![0.0; c.nrows()])?;
        let start = with_best_inputs(&sooner.spectra, lagged, noise, self.feedthrough);
        let origin = "a pole for a sample of dead time".into();
        Some(Task { spectra: sooner.spectra.clone(), start, delays: sooner.delays.clone(), origin })
    }

    /// All steps to be judged by their least squares: every dead time around, every block left out with a near one.
    fn steps(&self, best: &Choice, around: &[Around], sets: &[Vec<usize>]) -> Vec<Step> {
        // A fast mode in excess hides several samples of dead time of a single input.
        let reach = if self.inputs() == 1 { REACH } else { 1 };
        let mut steps = Vec::new();
        for (k, Around { delays, .. }) in around.iter().enumerate() {
            if *delays != best.delays {
                steps.push(Step { around: k, without: None });
            }
            let near = delays.iter().zip(&best.delays).map(|(a, b)| a.abs_diff(*b)).sum::<usize>() <= reach;
            if near && self.order.is_none() {
                // without two poles another dead time looks best as long as the other poles stay where they are
                let here = |set: &usize| sets[*set].len() == 1 || *delays == best.delays;
                steps.extend((0..sets.len()).filter(here).map(|set| Step { around: k, without: Some(set) }));
            }
        }
        steps
    }

    /// The first of each kind, and for a single input the dead times next to the best.
    fn promising(&self, best: &Choice, around: &[Around], starts: &[(f64, Step)], sets: &[Vec<usize>]) -> Vec<Step> {
        let next = |s: &Step| self.inputs() == 1 && around[s.around].delays[0].abs_diff(best.delays[0]) == 1;
        let whole = starts.iter().filter(|s| s.1.without.is_none()).enumerate();
        let whole = whole.filter(|(place, s)| *place < 2 || next(&s.1)).map(|(_, s)| s);
        // of each set of blocks the best dead time
        let less = |blocks: usize, count: usize| {
            let mut seen = Vec::new();
            let of = starts.iter().filter(|s| s.1.without.is_some_and(|set| sets[set].len() == blocks));
            let first: Vec<&(f64, Step)> = of
                .filter(|s| {
                    let new = !seen.contains(&s.1.without);
                    seen.push(s.1.without);
                    new
                })
                .collect();
            first.into_iter().take(count)
        };
        let single = less(1, if self.inputs() == 1 { 2 } else { 1 });
        whole.chain(single).chain(less(2, 1)).map(|s| s.1).collect()
    }

    /// The mode that explains most of what the model leaves, added to it.
    fn one_more(&self, best: &Choice, spectra: &Arc<Spectra>) -> Option<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        if self.order.is_some() || model.order() + 2 > self.largest_order {
            return None;
        }
        let (_, block) = grow::modes(spectra, &best.found.point, noise, 1).into_iter().next()?;
        let wider: Model = grow::with_block(model, block);
        let start = with_best_inputs(spectra, wider, noise, self.feedthrough);
        Some(Task { spectra: spectra.clone(), start, delays: best.delays.clone(), origin: "one mode more".into() })
    }

    /// Two modes in place of a lightly damped one: what two resonances within each other's width leave looks like one mode of more damping,
    /// and no further mode beside it explains the rest. Of all such modes the one whose halves lower the deviance most.
    fn split(&self, best: &Choice, parts: &Model, spectra: &Arc<Spectra>) -> Option<Task> {
        if self.order.is_some() || parts.order() + 2 > self.largest_order {
            return None;
        }
        let (noise, thin) = (&best.found.noise, spectra.thinned(spectra.every(COMPARED)));
        let halves = (0..parts.blocks.len()).filter_map(|k| halved(parts, k));
        let judged = halves.map(|model| {
            let point = with_best_inputs(&thin, model.clone(), noise, self.feedthrough);
            (deviance(&thin, &point, NOISE_ORDER).0, model)
        });
        let (_, model) = judged.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let start = with_best_inputs(spectra, model, noise, self.feedthrough);
        Some(Task { spectra: spectra.clone(), start, delays: best.delays.clone(), origin: "two modes for one".into() })
    }

    /// Real poles of its own for each output or input, those of the first the slowest and the fastest.
    pub(super) fn apart(&self, best: &Choice) -> Vec<Task> {
        let parts = best.found.point.model.separated().filter(|_| self.order.is_none());
        let models = [APART, 1.0 / APART].into_iter().filter_map(|ratio| with_own_poles(parts.as_ref()?, ratio));
        let models: Vec<Model> = models.filter(|model| model.order() <= self.largest_order).collect();
        if models.is_empty() {
            return Vec::new();
        }
        let spectra = Arc::new(self.spectra(&best.delays));
        let task = |model: Model| {
            let start = with_best_inputs(&spectra, model, &best.found.noise, self.feedthrough);
            Task { spectra: spectra.clone(), start, delays: best.delays.clone(), origin: "poles of their own".into() }
        };
        models.into_iter().map(task).collect()
    }

    /// Other delays, input by input: many of a single input, up to two samples away for several and on long records.
    pub(super) fn shifted(&self, delays: &[usize]) -> Vec<Vec<usize>> {
        if self.dead_time.is_some() {
            return Vec::new();
        }
        let near = delays.len() > 1 || self.samples().0 > LONG;
        let reach = if near { NEAR_REACH } else { REACH };
        let mut out = Vec::new();
        for j in 0..delays.len() {
            for d in delays[j].saturating_sub(reach)..=(delays[j] + reach).min(self.skip) {
                if d != delays[j] {
                    let mut other = delays.to_vec();
                    other[j] = d;
                    out.push(other);
                }
            }
        }
        out
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
