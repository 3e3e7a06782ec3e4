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
    /// Up to the Nyquist frequency, rad/s.
    pub(super) omega: Vec<f64>,
    /// `z^-1` at each.
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
        let q = omega.iter().map(|w| c64::cis(-w * ts)).collect();
        Ok(Grid { ts, omega, q, weights })
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

    /// Any controller `u = K y` as C = -K.
    pub(super) fn any(&self, k: &StateSpace<Discrete>) -> Result<OnGrid> {
        let poles = k.poles()?;
        let response: Vec<c64> = frequency_response(k, &self.omega)?.entry(0, 0).iter().map(|k| -k).collect();
        let denominator: Vec<c64> =
            self.q.iter().map(|q| poles.iter().fold(c64::ONE, |d, p| d * (c64::ONE - p * q))).collect();
        let numerator = response.iter().zip(&denominator).map(|(c, d)| c * d).collect();
        Ok(OnGrid { numerator, denominator, response })
    }
}

/// A plant at which designs are judged.
pub(super) struct Scenario {
    pub(super) plant: StateSpace<Discrete>,
    pub(super) response: Vec<c64>,
    /// The inverse of the characteristic polynomial of the running loop, up to that of the plant.
    pub(super) reference: Vec<c64>,
    /// Under the running controller.
    pub(super) running: GridMargins,
}

/// Draws of a region.
pub(super) struct Scenarios {
    pub(super) plants: Vec<Scenario>,
    /// Draws that the running controller does not stabilise: the log contradicts them.
    pub(super) impossible: usize,
}

impl Scenarios {
    /// `count` draws; a draw depends on the seed and its place only.
    pub(super) fn new(
        grid: &Grid,
        region: &Region,
        running: &StateSpace<Discrete>,
        (count, seed): (usize, u64),
    ) -> Result<Self> {
        let c = grid.any(running)?;
        let beyond = beyond(grid, region);
        let draws = region.draws(count, seed);
        let found: Vec<Option<Scenario>> = draws
            .into_par_iter()
            .enumerate()
            .map(|(place, Draw { plant, .. })| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(STREAM + place as u64);
                Scenario::new(grid, plant, (running, &c), |g| disturb(g, grid, &beyond, &mut rng))
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

    /// Margins at each; `None` where the loop is unstable.
    pub(super) fn judge(&self, grid: &Grid, c: &OnGrid) -> Vec<Option<GridMargins>> {
        self.plants.par_iter().map(|plant| margins(grid, plant, c)).collect()
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
        (running, c): (&StateSpace<Discrete>, &OnGrid),
        disturb: impl FnOnce(&mut [c64]),
    ) -> Option<Self> {
        let looped = closed_loop(&plant, &with_input_port(running).ok()?).ok()?;
        if !looped.is_stable().ok()? {
            return None;
        }
        let mut response = frequency_response(&plant, &grid.omega).ok()?.entry(0, 0);
        let characteristic = |response: &[c64]| -> Vec<c64> {
            response.iter().enumerate().map(|(k, g)| c64::ONE / (c.denominator[k] + g * c.numerator[k])).collect()
        };
        let reference = characteristic(&response);
        disturb(&mut response);
        let found = Scenario { plant, response, reference, running: GridMargins::NONE };
        Some(Scenario { running: margins(grid, &found, c)?, ..found })
    }
}

/// Root mean square of what the excitation shows beyond the parameters, at each line.
fn beyond(grid: &Grid, region: &Region) -> Vec<f64> {
    let size = |k: usize| region.parts.variation[k][(0, 0)].hypot(region.parts.distortion[k][(0, 0)]);
    let at = |w: &f64| {
        let hz = w / TAU;
        let above = region.hz.partition_point(|f| *f < hz).clamp(1, region.hz.len() - 1);
        let (low, high) = (region.hz[above - 1], region.hz[above]);
        let share = ((hz - low) / (high - low)).clamp(0.0, 1.0);
        (1.0 - share) * size(above - 1) + share * size(above)
    };
    grid.omega.iter().map(at).collect()
}

/// Adds the error without a plant.
fn disturb(response: &mut [c64], grid: &Grid, beyond: &[f64], rng: &mut ChaCha8Rng) {
    let octaves = (grid.omega[grid.omega.len() - 1] / grid.omega[0]).log2();
    let half = 0.5f64.sqrt();
    let mut normal = || half * rng.sample::<f64, _>(StandardNormal);
    let knots: Vec<c64> = (0..(KNOTS * octaves) as usize + 2).map(|_| c64::new(normal(), normal())).collect();
    for (k, g) in response.iter_mut().enumerate() {
        let place = KNOTS * (grid.omega[k] / grid.omega[0]).log2();
        let (knot, share) = (place as usize, place.fract());
        *g += (knots[knot] * (1.0 - share).sqrt() + knots[knot + 1] * share.sqrt()) * beyond[k];
    }
}
