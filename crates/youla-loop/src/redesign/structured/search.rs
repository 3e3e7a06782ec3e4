//! The search: maximise the disturbance rejection such that every limit holds at every drawn plant.
//!
//! Several starts (the running controller where it is of the structure, loop shaping), each searched by [`evolve`] with the limits as an
//! exact penalty. The plants of a search are few: those at which the running loop is worst, and, round by round, those at which
//! the result of the last round was (constraint generation, R. Hettich, K. O. Kortanek, Semi-infinite programming, SIAM Review 35
//! (1993), 380, section 7.2). The result of the last round holds at all of them.

use super::evolution::{Point, evolve};
use super::margins::{GridMargins, LIMITS, OnGrid, margins};
use super::options::PidOptions;
use super::pid::{PidController, whole};
use super::scenarios::{Grid, Judged, Scenario, Scenarios};
use super::space::Space;
use crate::error::{Error, Result};
use rayon::prelude::*;
use youla::lti::Discrete;

/// Rounds of constraint generation. Chosen: on 60 loops the last was used in none that met its limits.
const ROUNDS: usize = 8;
/// Plants of the first round, and those that a round adds. Chosen, not measured.
const FIRST: usize = 24;
const ADDED: usize = 8;
/// Starts that are searched. Chosen, not measured.
const STARTS: usize = 6;
/// Evaluations for each parameter, of the first and of each later round. With half as many the product of the gains of two loops was lower by 5 to 23 %
/// in three of four loops.
const STEPS: [usize; 2] = [440, 220];
/// A search is repeated from its own result, with steps of the first size, while it gains so much: along an edge of two limits the steps become
/// short before the best point. With three repeats one loop gained 0 to 10 % and two loops 50 %, with ten not 1 % more.
const REPEATS: u64 = 4;
const GAINED: f64 = 0.01;
/// Cost of an excess of a limit, against the logarithm of the gain. The gain follows a limit by less than this: the penalty is exact.
const PENALTY: f64 = 30.0;
/// Excess of an unstable loop.
const UNSTABLE: f64 = 3.0;
/// What the search keeps from its limits, more in each round: about the error of a peak of 2 between the lines of the grid.
const RESERVE: f64 = 0.01;

/// What the search needs.
pub(super) struct Search<'a> {
    /// Of each loop.
    pub(super) spaces: Vec<Space<'a>>,
    pub(super) grid: &'a Grid,
    pub(super) estimate: &'a Scenario,
    pub(super) drawn: &'a Scenarios,
    pub(super) running: Judged<'a>,
    /// Of each loop, where it is a PID.
    pub(super) running_gains: &'a [Option<PidController>],
}

impl Search<'_> {
    /// The controllers, one for each loop, of the best disturbance rejection within the limits.
    ///
    /// # Errors
    /// [`Error::NoPid`] with the limit that stops it.
    pub(super) fn run(&self) -> Result<Vec<PidController>> {
        let mut active = self.worst_of_running();
        let mut starts = self.starts(&active);
        let mut refused = String::new();
        for round in 0..ROUNDS {
            let reserve = RESERVE * (1.0 + 0.5 * round as f64);
            let size = self.spaces.iter().map(Space::size).sum::<usize>();
            let steps = STEPS[usize::from(round > 0)] * size;
            let width = if round == 0 { 0.4 } else { 0.1 };
            let searched = starts.into_par_iter().enumerate().map(|(k, x)| {
                let mut judges = self.judges(&active);
                let mut cost = |x: &[f64], enough| self.cost(x, &mut judges, reserve, enough);
                let mut best = Point { cost: cost(&x, f64::INFINITY), x };
                for repeat in 0..REPEATS {
                    let seed = repeat << 32 | (round * STARTS + k) as u64;
                    let before = best.cost;
                    best = evolve(best, width, (steps, seed), &mut cost);
                    if before - best.cost < GAINED {
                        break;
                    }
                }
                best
            });
            let mut found: Vec<Point> = searched.collect();
            found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            let controllers = self.controllers(&found[0].x);
            let (missed, why) = self.missed(&controllers)?;
            if missed.is_empty() {
                return Ok(controllers);
            }
            refused = why;
            let new: Vec<usize> = missed.into_iter().filter(|k| !active.contains(k)).take(ADDED).collect();
            // The limits exclude each other at plants that the search knew: a further round would end at the same point.
            if new.is_empty() && round > 0 {
                break;
            }
            active.extend(new);
            starts = found.into_iter().take(2).map(|p| p.x).collect();
        }
        Err(Error::NoPid { reason: refused })
    }

    fn limits(&self) -> &PidOptions {
        self.spaces[0].options
    }

    /// The parameters of each loop.
    fn split<'x>(&self, x: &'x [f64]) -> Vec<&'x [f64]> {
        let mut rest = x;
        let of = |space: &Space<'_>| {
            let (own, others) = rest.split_at(space.size());
            rest = others;
            own
        };
        self.spaces.iter().map(of).collect()
    }

    fn controllers(&self, x: &[f64]) -> Vec<PidController> {
        self.spaces.iter().zip(self.split(x)).map(|(space, x)| space.controller(x)).collect()
    }

    /// Estimate and active plants.
    fn judges(&self, active: &[usize]) -> Vec<&Scenario> {
        std::iter::once(self.estimate).chain(active.iter().map(|k| &self.drawn.plants[*k])).collect()
    }

    fn cost(&self, x: &[f64], judges: &mut [&Scenario], reserve: f64, enough: f64) -> f64 {
        let gains: f64 = self.split(x).iter().map(|x| x[0]).sum();
        if -gains > enough {
            return -gains;
        }
        let on: Vec<OnGrid> = self.controllers(x).iter().map(|c| self.grid.controller(c)).collect();
        self.penalised(gains, &on, judges, (reserve, enough))
    }

    /// Minus the gains, and a penalty where a limit is missed at one of the plants. It rises from plant to plant: beyond `enough` the remaining
    /// plants are not evaluated, and the one that exceeded it comes first for the next controller.
    fn penalised(&self, gains: f64, on: &[OnGrid], judges: &mut [&Scenario], (reserve, enough): (f64, f64)) -> f64 {
        let (mut worst, mut unstable, mut cost) = (f64::NEG_INFINITY, 0, -gains);
        for k in 0..judges.len() {
            match excess(self.grid, judges[k], on, self.limits()) {
                Some(of) => worst = of.into_iter().fold(worst, f64::max),
                None => unstable += 1,
            }
            let penalty = if unstable > 0 {
                UNSTABLE + f64::from(unstable) / judges.len() as f64
            } else {
                (worst + reserve).clamp(0.0, UNSTABLE)
            };
            cost = PENALTY * penalty - gains;
            if cost > enough {
                judges.swap(0, k);
                break;
            }
        }
        cost
    }

    /// The drawn plants nearest to instability under the running controller.
    fn worst_of_running(&self) -> Vec<usize> {
        let peak = |k: usize| GridMargins::worst(&self.drawn.plants[k].running).peak_sensitivity;
        let mut order: Vec<usize> = (0..self.drawn.plants.len()).collect();
        order.sort_by(|a, b| peak(*b).total_cmp(&peak(*a)));
        // Half of them the worst, half as they were drawn.
        let mut first: Vec<usize> = order.iter().copied().take(FIRST / 2).collect();
        first.extend(order[first.len()..].iter().copied().filter(|k| *k < FIRST));
        first
    }

    /// The k-th starts of all loops together.
    fn starts(&self, active: &[usize]) -> Vec<Vec<f64>> {
        let each: Vec<Vec<Vec<f64>>> = (0..self.spaces.len()).map(|i| self.starts_of(i, active)).collect();
        let most = each.iter().map(Vec::len).max().unwrap_or(0);
        (0..most).map(|k| each.iter().flat_map(|of| of[k.min(of.len() - 1)].clone()).collect()).collect()
    }

    /// Starts of a loop while the others are as they run.
    fn starts_of(&self, i: usize, active: &[usize]) -> Vec<Vec<f64>> {
        let space = &self.spaces[i];
        let plant = self.estimate.of_loop(self.running.on, i);
        let shaped = space.shaped(self.grid, &plant);
        let few = self.judges(&active[..active.len().min(FIRST / 4)]);
        let cost = |x: &Vec<f64>| {
            let mut on = self.running.on.to_vec();
            on[i] = self.grid.controller(&space.controller(x));
            self.penalised(x[0], &on, &mut few.clone(), (RESERVE, f64::INFINITY))
        };
        let costs: Vec<f64> = shaped.par_iter().map(cost).collect();
        let mut order: Vec<usize> = (0..shaped.len()).collect();
        order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        let running = self.running_gains[i].as_ref().map(|c| space.of_running(c, self.grid, &plant));
        let mut starts: Vec<Vec<f64>> = running.into_iter().collect();
        for k in order {
            let apart = |x: &Vec<f64>| x.iter().zip(&shaped[k]).any(|(a, b)| (a - b).abs() > APART);
            if starts.len() < STARTS && starts.iter().all(apart) {
                starts.push(shaped[k].clone());
            }
        }
        starts
    }

    /// The plants at which a limit is missed, the worst first, and what is missed in a sentence.
    fn missed(&self, controllers: &[PidController]) -> Result<(Vec<usize>, String)> {
        let on: Vec<OnGrid> = controllers.iter().map(|c| self.grid.controller(c)).collect();
        let system = whole(controllers, Discrete::new(self.grid.ts)?)?;
        let excesses = excesses(self.grid, self.drawn, Judged { system: &system, on: &on }, self.limits())?;
        let worst = |k: usize| excesses[k].map_or(f64::INFINITY, |e| e.into_iter().fold(f64::NEG_INFINITY, f64::max));
        let mut missed: Vec<usize> = (0..excesses.len()).filter(|k| worst(*k) > 0.0).collect();
        missed.sort_by(|a, b| worst(*b).total_cmp(&worst(*a)));
        Ok((missed, sentence(&excesses)))
    }
}

/// Two starts nearer than this in every parameter, as a factor of e, are one. Chosen, not measured.
const APART: f64 = 0.7;

/// Of each limit that of the loop that misses it most.
fn excess(grid: &Grid, plant: &Scenario, on: &[OnGrid], limits: &PidOptions) -> Option<[f64; 5]> {
    Some(worst_excess(&margins(grid, plant, on)?, plant, limits))
}

/// Of margins that the loops of a plant have.
pub(super) fn worst_excess(of: &[GridMargins], plant: &Scenario, limits: &PidOptions) -> [f64; 5] {
    let each = of.iter().zip(&plant.running).map(|(m, running)| m.excess(limits, running.effort));
    each.fold([f64::NEG_INFINITY; 5], |a, b| std::array::from_fn(|k| a[k].max(b[k])))
}

/// The excess of each limit at each plant; `None` where the loop is unstable, by its poles or by the winding number.
pub(super) fn excesses(
    grid: &Grid,
    drawn: &Scenarios,
    Judged { system, on }: Judged<'_>,
    limits: &PidOptions,
) -> Result<Vec<Option<[f64; 5]>>> {
    let stable = drawn.stable(system)?;
    let of = |(plant, stable): (&Scenario, &bool)| if *stable { excess(grid, plant, on, limits) } else { None };
    Ok(drawn.plants.par_iter().zip(&stable).map(of).collect())
}

/// What stops a controller: the limits that are missed, the one with the largest factor first, and instability. The nearest controller
/// shares its excess among limits that exclude each other, so that the first alone need not be the one that was set too high.
fn sentence(excesses: &[Option<[f64; 5]>]) -> String {
    let (all, unstable) = (excesses.len(), excesses.iter().filter(|e| e.is_none()).count());
    let most = |limit: usize| excesses.iter().flatten().map(|e| e[limit]).fold(f64::NEG_INFINITY, f64::max);
    let mut missed: Vec<usize> = (0..LIMITS.len()).filter(|limit| most(*limit) > 0.0).collect();
    missed.sort_by(|a, b| most(*b).total_cmp(&most(*a)));
    let one = |limit: &usize| {
        let count = excesses.iter().flatten().filter(|e| e[*limit] > 0.0).count();
        format!("misses {} by a factor of {:.2}, at {count} of {all} models", LIMITS[*limit], most(*limit).exp())
    };
    let mut parts: Vec<String> = missed.iter().map(one).collect();
    if unstable > 0 {
        parts.push(format!("is unstable at {unstable} of {all} models"));
    }
    format!("the nearest controller {}", parts.join(", and "))
}
