//! The plants at which a design is judged: drawn from the whole region of the model, their responses computed once.
//!
//! A draw has the parameters of [`Region::draws`]. What the excitation shows beyond the parameters (variation between records,
//! distortion) has a size b at each frequency and no plant; a draw adds it to the response with a phase and a size of chance,
//!
//! ```text
//! G(w) + b(w) x(w),     x complex normal of unit variance, independent at knots and between them the weighted sum of two
//! ```
//!
//! The stability of the loop is exact by eigenvalues for the drawn parameters, and by the winding number with b x.

use super::channels::each;
use super::loops::Loops;
use super::margins::{GridMargins, OnGrid, margins};
use super::pid::PidController;
use crate::error::Result;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use youla::c64;
use youla::control::{closed_loop, with_input_port};
use youla::identify::likelihood::{Draw, Region};
use youla::lti::{Discrete, StateSpace, frequency_response};

/// Lines in equal steps of the logarithm of the frequency, and in equal steps of the frequency. Chosen: the margins of a random loop are
/// then within 3 % of the exact ones.
const LINES: [usize; 2] = [240, 120];
/// The lowest line against the Nyquist frequency. Chosen, not measured.
const LOWEST: f64 = 2e-4;
/// Where the winding number starts, against the lowest line: the characteristic polynomials are real at 0 Hz, where a plant may have a pole.
const START: f64 = 1e-3;
/// Lines to either side of a resonance, a step being a share of its half width. Chosen, not measured.
const AT_RESONANCE: [f64; 8] = [0.15, 0.5, 1.0, 1.6, 2.5, 4.0, 7.0, 12.0];
/// Modes with more damping need no lines of their own. Chosen, not measured.
const LIGHTLY_DAMPED: f64 = 0.2;
/// Knots of the error without a plant for each octave: the local error is judged over a third of an octave.
const KNOTS: f64 = 3.0;
/// Streams of the error without a plant lie beside those of the draws.
const STREAM: u64 = 1 << 32;

/// Frequencies of the judgement.
pub(super) struct Grid {
    pub(super) ts: f64,
    /// Lines up to the Nyquist frequency, rad/s.
    pub(super) omega: Vec<f64>,
    /// The lines, and behind them the frequency at which the winding number starts.
    every: Vec<f64>,
    /// `z^-1` at each of the last.
    pub(super) q: Vec<c64>,
    /// Weights of the mean over all frequencies.
    pub(super) weights: Vec<f64>,
}

impl Grid {
    /// Dense at the resonances of the systems.
    pub(super) fn new(time: Discrete, systems: &[&StateSpace<Discrete>]) -> Result<Self> {
        let (ts, nyquist) = (time.ts(), PI / time.ts());
        let (log, linear) = (LINES[0], LINES[1]);
        let mut omega: Vec<f64> = (0..=log).map(|k| nyquist * LOWEST.powf(1.0 - k as f64 / log as f64)).collect();
        omega.extend((1..linear).map(|k| nyquist * k as f64 / linear as f64));
        for pole in systems.iter().map(|s| s.poles()).collect::<youla::Result<Vec<_>>>()?.into_iter().flatten() {
            let (decay, at) = (-pole.norm().ln() / ts, pole.arg().abs() / ts);
            let half = decay.abs().max(1e-4 * at);
            if pole.im > 0.0 && half < LIGHTLY_DAMPED * at {
                omega.extend(AT_RESONANCE.iter().flat_map(|step| [at - step * half, at + step * half]));
            }
        }
        omega.retain(|w| *w >= nyquist * LOWEST && *w <= nyquist * (1.0 + 1e-12));
        omega.sort_by(f64::total_cmp);
        omega.dedup_by(|a, b| *a - *b < 1e-9 * *b);
        let at = |k: usize| omega[k.min(omega.len() - 1)];
        let weights = (0..omega.len())
            .map(|k| {
                let below = if k == 0 { -omega[0] } else { at(k - 1) };
                0.5 * (at(k + 1) - below) / nyquist
            })
            .collect();
        let every: Vec<f64> = omega.iter().copied().chain([START * omega[0]]).collect();
        let q = every.iter().map(|w| c64::cis(-w * ts)).collect();
        Ok(Grid { ts, omega, every, q, weights })
    }

    pub(super) fn controller(&self, c: &PidController) -> OnGrid {
        let mut on = OnGrid { numerator: Vec::new(), denominator: Vec::new(), response: Vec::new() };
        for q in &self.q {
            let [numerator, denominator] = c.at(self.ts, *q);
            on.numerator.push(numerator);
            on.denominator.push(denominator);
            on.response.push(numerator / denominator);
        }
        on
    }

    /// Each channel of a controller `u = K y` that couples none as C = -K.
    pub(super) fn each(&self, k: &StateSpace<Discrete>) -> Result<Vec<OnGrid>> {
        each(k)?.iter().map(|k| self.any(k)).collect()
    }

    fn any(&self, k: &StateSpace<Discrete>) -> Result<OnGrid> {
        let poles = k.poles()?;
        let response: Vec<c64> = frequency_response(k, &self.every)?.entry(0, 0).iter().map(|k| -k).collect();
        let denominator: Vec<c64> =
            self.q.iter().map(|q| poles.iter().fold(c64::ONE, |d, p| d * (c64::ONE - p * q))).collect();
        let numerator = response.iter().zip(&denominator).map(|(c, d)| c * d).collect();
        Ok(OnGrid { numerator, denominator, response })
    }
}

/// A plant at which designs are judged.
pub(super) struct Scenario {
    pub(super) plant: StateSpace<Discrete>,
    /// The responses of all entries, row by row, line by line.
    response: Vec<c64>,
    /// Their number at a line.
    entries: usize,
    /// The inverse of the characteristic polynomial of the running loop, up to that of the plant.
    pub(super) reference: Vec<c64>,
    /// Of each loop under the running controller.
    pub(super) running: Vec<GridMargins>,
}

/// A controller, whole and for each channel on the grid.
#[derive(Clone, Copy)]
pub(super) struct Judged<'a> {
    pub(super) system: &'a StateSpace<Discrete>,
    pub(super) on: &'a [OnGrid],
}

/// Draws of a region.
pub(super) struct Scenarios {
    pub(super) plants: Vec<Scenario>,
    /// Draws that the running controller does not stabilise: the log contradicts them.
    pub(super) impossible: usize,
}

impl Scenarios {
    /// `count` draws; a draw depends on the seed and its place only.
    pub(super) fn new(grid: &Grid, region: &Region, running: Judged<'_>, (count, seed): (usize, u64)) -> Result<Self> {
        let beyond = beyond(grid, region);
        let draws = region.draws(count, seed);
        let found: Vec<Option<Scenario>> = draws
            .into_par_iter()
            .enumerate()
            .map(|(place, Draw { plant, .. })| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(STREAM + place as u64);
                Scenario::new(grid, plant, running, |g| disturb(g, grid, &beyond, &mut rng))
            })
            .collect();
        let all = found.len();
        let plants: Vec<Scenario> = found.into_iter().flatten().collect();
        Ok(Scenarios { impossible: all - plants.len(), plants })
    }

    /// Those of several regions as one set, and further plants.
    pub(super) fn joined(sets: Vec<Scenarios>, further: impl Iterator<Item = Scenario>) -> Self {
        let impossible = sets.iter().map(|set| set.impossible).sum();
        Scenarios { plants: sets.into_iter().flat_map(|set| set.plants).chain(further).collect(), impossible }
    }

    /// Margins of each loop at each; `None` where the whole is unstable.
    pub(super) fn judge(&self, grid: &Grid, on: &[OnGrid]) -> Vec<Option<Vec<GridMargins>>> {
        self.plants.par_iter().map(|plant| margins(grid, plant, on)).collect()
    }

    /// Whether each loop is stable, by its poles.
    pub(super) fn stable(&self, k: &StateSpace<Discrete>) -> Result<Vec<bool>> {
        let ports = with_input_port(k)?;
        let stable = |s: &Scenario| closed_loop(&s.plant, &ports).and_then(|l| l.is_stable()).unwrap_or(false);
        Ok(self.plants.par_iter().map(stable).collect())
    }
}

impl Scenario {
    /// `None` for a plant that the running controller does not stabilise.
    pub(super) fn new(
        grid: &Grid,
        plant: StateSpace<Discrete>,
        running: Judged<'_>,
        disturb: impl FnOnce(&mut [c64]),
    ) -> Option<Self> {
        let looped = closed_loop(&plant, &with_input_port(running.system).ok()?).ok()?;
        if !looped.is_stable().ok()? {
            return None;
        }
        let (on, m) = (running.on, running.on.len());
        let entries = m * m;
        let found = frequency_response(&plant, &grid.every).ok()?;
        let response = found.iter().flat_map(|g| (0..entries).map(move |at| g[(at / m, at % m)])).collect();
        let mut found = Scenario { plant, response, entries, reference: Vec::new(), running: Vec::new() };
        let mut loops = Loops::new(m);
        found.reference = (0..grid.every.len()).map(|k| c64::ONE / loops.at(found.at(k), on, k)).collect();
        disturb(&mut found.response);
        Some(Scenario { running: margins(grid, &found, on)?, ..found })
    }

    /// The responses of all entries at line k, row by row.
    pub(super) fn at(&self, k: usize) -> &[c64] {
        &self.response[self.entries * k..self.entries * (k + 1)]
    }

    /// The plant of one loop while the others are closed.
    pub(super) fn of_loop(&self, on: &[OnGrid], i: usize) -> Vec<c64> {
        let mut loops = Loops::new(on.len());
        let at = |k: usize| {
            loops.at(self.at(k), on, k);
            loops.plants[i]
        };
        (0..self.reference.len() - 1).map(at).collect()
    }
}

/// Root mean square of what the excitation shows beyond the parameters, of each entry at each line.
fn beyond(grid: &Grid, region: &Region) -> Vec<f64> {
    let m = region.parts.variation[0].ncols();
    let size = |k: usize, at: usize| {
        let entry = (at / m, at % m);
        region.parts.variation[k][entry].hypot(region.parts.distortion[k][entry])
    };
    let at = |w: &f64| {
        let hz = w / TAU;
        let above = region.hz.partition_point(|f| *f < hz).clamp(1, region.hz.len() - 1);
        let (low, high) = (region.hz[above - 1], region.hz[above]);
        let share = ((hz - low) / (high - low)).clamp(0.0, 1.0);
        (0..m * m).map(move |entry| (1.0 - share) * size(above - 1, entry) + share * size(above, entry))
    };
    grid.omega.iter().flat_map(at).collect()
}

/// Adds the error without a plant, independent from entry to entry.
fn disturb(response: &mut [c64], grid: &Grid, beyond: &[f64], rng: &mut ChaCha8Rng) {
    let octaves = (grid.omega[grid.omega.len() - 1] / grid.omega[0]).log2();
    let half = 0.5f64.sqrt();
    let mut normal = || half * rng.sample::<f64, _>(StandardNormal);
    let (lines, entries) = (grid.omega.len(), response.len() / grid.every.len());
    for entry in 0..entries {
        let knots: Vec<c64> = (0..(KNOTS * octaves) as usize + 2).map(|_| c64::new(normal(), normal())).collect();
        for (k, w) in grid.omega.iter().enumerate() {
            let place = KNOTS * (w / grid.omega[0]).log2();
            let (knot, share) = (place as usize, place.fract());
            let x = knots[knot] * (1.0 - share).sqrt() + knots[knot + 1] * share.sqrt();
            response[entries * k + entry] += x * beyond[entries * k + entry];
        }
        // Below the lowest line the error is that of the lowest line.
        response[entries * lines + entry] += knots[0] * beyond[entry];
    }
}
