//! The proof of a design on plants that the search has not seen, and the way from the running controller to it.

use super::loops::Loops;
use super::margins::{GridMargins, LIMITS, OnGrid};
use super::options::PidOptions;
use super::scenarios::{Grid, Judged, Scenario, Scenarios};
use super::search::{excesses, worst_excess};
use crate::error::Result;
use rayon::prelude::*;
use std::f64::consts::TAU;
use youla::c64;
use youla::statistics::quantile;

/// Level of bands and of the probability, that of regions and intervals elsewhere.
pub const LEVEL: f64 = 0.95;

/// A figure over the drawn plants: lower end, median and upper end of the band of [`LEVEL`].
pub type Band = [f64; 3];

/// A figure of a loop with the running and the new controller.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureBand {
    /// The loop, counted from 0 in the order of the channels.
    pub channel: usize,
    /// Key of its limit in run.toml, or `bandwidth`.
    pub name: &'static str,
    /// Unit; empty for a factor.
    pub unit: &'static str,
    /// The limit, where it has one.
    pub limit: Option<f64>,
    /// With the running controller.
    pub running: Band,
    /// With the new one.
    pub new: Band,
}

/// What a new controller does at fresh draws.
#[derive(Debug, Clone, PartialEq)]
pub struct PidProof {
    /// Models that were drawn afresh and tested.
    pub models: usize,
    /// Draws that the running controller does not stabilise: the log contradicts them.
    pub impossible: usize,
    /// Models whose new loop is unstable.
    pub unstable: usize,
    /// Models whose new loop is stable and misses a limit.
    pub missed: usize,
    /// Models at which the running controller misses a limit.
    pub running_missed: usize,
    /// How many miss each limit, by its key.
    pub misses: Vec<(&'static str, usize)>,
    /// The largest probability that a model is of these two kinds, at [`LEVEL`] (C. J. Clopper, E. S. Pearson, The use of confidence or
    /// fiducial limits, Biometrika 26 (1934), 404; with none of n it is 3/n).
    pub at_most: f64,
    /// Figures with bands.
    pub figures: Vec<FigureBand>,
    /// Frequencies of the sensitivities, Hz.
    pub hz: Vec<f64>,
    /// Magnitude of the sensitivity of each loop with the running and with the new controller.
    pub sensitivities: Vec<[Vec<Band>; 2]>,
}

impl PidProof {
    /// Whether no model is unstable and the limits hold for the share [`LEVEL`] of models at least; where the log contradicts more than half of the
    /// draws, the models that are left are no region.
    pub fn holds(&self) -> bool {
        self.unstable == 0 && self.at_most <= 1.0 - LEVEL && self.impossible <= self.models
    }

    /// Whether the running controller keeps the limits by the same standard.
    pub(crate) fn running_holds(&self) -> bool {
        at_most(self.running_missed, self.models) <= 1.0 - LEVEL
    }
}

pub(super) fn prove(
    grid: &Grid,
    fresh: &Scenarios,
    before: &[OnGrid],
    new: Judged<'_>,
    limits: &PidOptions,
) -> Result<PidProof> {
    let (after, excesses) = (new.on, excesses(grid, fresh, new, limits)?);
    let models = excesses.len();
    let unstable = excesses.iter().filter(|e| e.is_none()).count();
    let beyond = |e: &&[f64; 5]| e.iter().any(|e| *e > TOLERANCE);
    let missed = excesses.iter().flatten().filter(beyond).count();
    let of_limit = |k: usize| (LIMITS[k], excesses.iter().flatten().filter(|e| e[k] > TOLERANCE).count());
    let now: Vec<&[GridMargins]> = fresh.plants.iter().map(|p| &p.running[..]).collect();
    let then: Vec<Vec<GridMargins>> = fresh.judge(grid, after).into_iter().flatten().collect();
    let then: Vec<&[GridMargins]> = then.iter().map(|of| &of[..]).collect();
    Ok(PidProof {
        models,
        impossible: fresh.impossible,
        unstable,
        missed,
        running_missed: now_missed(fresh, limits),
        misses: (0..LIMITS.len()).map(of_limit).collect(),
        at_most: at_most(unstable + missed, models),
        figures: (0..after.len()).flat_map(|channel| figures(channel, &now, &then, limits)).collect(),
        hz: grid.omega.iter().map(|w| w / TAU).collect(),
        sensitivities: (0..after.len())
            .map(|i| [before, after].map(|on| sensitivity(fresh, on, i, grid.omega.len())))
            .collect(),
    })
}

fn now_missed(fresh: &Scenarios, limits: &PidOptions) -> usize {
    let misses = |p: &&Scenario| worst_excess(&p.running, p, limits).iter().any(|e| *e > TOLERANCE);
    fresh.plants.iter().filter(misses).count()
}

/// An excess that rounding explains.
const TOLERANCE: f64 = 1e-9;

/// The band of values.
pub(super) fn band(mut values: Vec<f64>) -> Band {
    values.sort_by(f64::total_cmp);
    match values.is_empty() {
        true => [f64::NAN; 3],
        false => [0.5 * (1.0 - LEVEL), 0.5, 0.5 * (1.0 + LEVEL)].map(|share| quantile(&values, share)),
    }
}

fn figures(channel: usize, now: &[&[GridMargins]], then: &[&[GridMargins]], limits: &PidOptions) -> Vec<FigureBand> {
    let of = |name, unit, limit, pick: fn(&GridMargins) -> f64| {
        let over = |all: &[&[GridMargins]]| band(all.iter().map(|of| pick(&of[channel])).collect());
        FigureBand { channel, name, unit, limit, running: over(now), new: over(then) }
    };
    let effort = limits.command_effort * of("", "", None, |m| m.effort).running[1];
    vec![
        of("peak_sensitivity", "", Some(limits.peak_sensitivity), |m| m.peak_sensitivity),
        of("gain_margin", "", Some(limits.gain_margin), |m| m.gain),
        of("phase_margin", "degrees", Some(limits.phase_margin), |m| m.phase),
        of("delay_margin", "s", Some(limits.delay_margin), |m| m.delay),
        of("command_effort", "u per y", Some(effort), |m| m.effort),
        of("bandwidth", "Hz", None, |m| m.bandwidth),
    ]
}

fn sensitivity(fresh: &Scenarios, on: &[OnGrid], i: usize, lines: usize) -> Vec<Band> {
    let at = |k: usize| {
        let mut loops = Loops::new(on.len());
        let size = |p: &Scenario| {
            loops.at(p.at(k), on, k);
            1.0 / (c64::ONE + loops.plants[i] * on[i].response[k]).norm()
        };
        band(fresh.plants.iter().map(size).collect())
    };
    (0..lines).into_par_iter().map(at).collect()
}

/// The probability for which `found` or fewer of `count` come with a chance of `1 - LEVEL`.
fn at_most(found: usize, count: usize) -> f64 {
    if found >= count {
        return 1.0;
    }
    let chance = |p: f64| {
        let (mut term, mut sum) = (count as f64 * (1.0 - p).ln(), 0.0);
        for k in 0..=found {
            sum += term.exp();
            term += ((count - k) as f64 / (k + 1) as f64 * p / (1.0 - p)).ln();
        }
        sum
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if chance(middle) > 1.0 - LEVEL { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::at_most;

    /// Rule of three, and Clopper and Pearson's one-sided bounds by SciPy: `beta.ppf(0.95, k + 1, n - k)`.
    #[test]
    fn the_bound_of_a_probability() {
        for (found, count, bound) in
            [(0, 500, 0.005974_f64), (3, 500, 0.015434), (10, 100, 0.163718), (1, 20, 0.216106)]
        {
            assert!((at_most(found, count) - bound).abs() < 2e-6, "{found} of {count}: {}", at_most(found, count));
        }
        assert_eq!(at_most(4, 4), 1.0);
    }
}
