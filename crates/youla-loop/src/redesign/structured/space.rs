//! The parameters of the search: logarithms, so that every gain has the sign of the running controller and a step is a factor,
//!
//! ```text
//! [ln ki] ln kp [ln kd  ln filter]  and for each notch  ln hz  ln width  ln depth
//! ```
//!
//! The first is what the design raises: the integral of y over time after a step of load at the plant input is `load / ki`, and without
//! an integral part y settles at `load / (kp + 1/G(0))`.

use super::options::{PidOptions, PidTerms};
use super::pid::{Discretisation, Notch, PidController, PidGains};
use super::scenarios::Grid;
use std::f64::consts::{PI, TAU};
use youla::c64;

/// Bounds of the frequency of a notch as shares of the sample rate, of its width and of its depth. Chosen, not measured.
const NOTCH: [[f64; 2]; 3] = [[0.001, 0.48], [0.03, 1.5], [0.01, 1.0]];
/// The fastest filter against the sample time: by Tustin's rule a faster one rings.
const FASTEST: [f64; 2] = [0.05, 0.5];
/// A gain that acts on nothing, for a part that a start lacks. Chosen, not measured.
const LITTLE: f64 = 1e-3;

/// A gain that acts on nothing drifts no further than its logarithm to this. Chosen, not measured.
const FAR: f64 = 60.0;

/// What is searched.
pub(super) struct Space<'a> {
    pub(super) options: &'a PidOptions,
    pub(super) discretisation: Discretisation,
    pub(super) delay: usize,
    /// 1 or -1.
    pub(super) sign: f64,
    pub(super) ts: f64,
}

impl Space<'_> {
    fn terms(&self) -> PidTerms {
        self.options.terms
    }

    /// Parameters to be found.
    pub(super) fn size(&self) -> usize {
        let parts = 1 + usize::from(self.terms().integral()) + 2 * usize::from(self.terms().derivative());
        parts + 3 * self.options.notches
    }

    pub(super) fn controller(&self, x: &[f64]) -> PidController {
        let mut values = x.iter().map(|x| x.clamp(-FAR, FAR).exp());
        let mut next = || values.next().unwrap_or(1.0);
        let ki = if self.terms().integral() { self.sign * next() } else { 0.0 };
        let kp = self.sign * next();
        let fastest = self.ts * FASTEST[usize::from(self.discretisation == Discretisation::Tustin)];
        let (kd, derivative_filter) =
            if self.terms().derivative() { (self.sign * next(), next().max(fastest)) } else { (0.0, 0.0) };
        let [hz, width, depth] = NOTCH;
        let notches = (0..self.options.notches).map(|_| Notch {
            hz: (next() * self.ts).clamp(hz[0], hz[1]) / self.ts,
            width: next().clamp(width[0], width[1]),
            depth: next().clamp(depth[0], depth[1]),
        });
        let notches = notches.collect();
        let gains = PidGains { discretisation: self.discretisation, kp, ki, kd, derivative_filter };
        PidController { gains, notches, delay: self.delay }
    }

    /// The parameters of a controller; a part that it lacks gets a gain that acts on nothing.
    pub(super) fn parameters(&self, c: &PidController) -> Vec<f64> {
        let PidGains { kp, ki, kd, derivative_filter, .. } = c.gains;
        let all = kp.abs().max(ki.abs() * self.ts).max(kd.abs() / self.ts).max(1e-300);
        let log = |gain: f64, unit: f64| (self.sign * gain).max(LITTLE * LITTLE * all * unit).ln();
        let mut x = Vec::new();
        if self.terms().integral() {
            x.push(log(ki, 1.0 / self.ts));
        }
        x.push(log(kp, 1.0));
        if self.terms().derivative() {
            x.extend([log(kd, self.ts), derivative_filter.max(self.ts * FASTEST[0]).ln()]);
        }
        x.extend(c.notches.iter().flat_map(|n| [n.hz.ln(), n.width.ln(), n.depth.ln()]));
        x
    }

    /// The running controller, with notches that do nothing.
    pub(super) fn of_running(&self, running: &PidController, grid: &Grid, plant: &[c64]) -> Vec<f64> {
        let notches = self.notches(grid, plant, 1.0);
        self.parameters(&PidController { gains: running.gains, notches, delay: self.delay })
    }

    /// Notches at the highest resonances.
    fn notches(&self, grid: &Grid, plant: &[c64], depth: f64) -> Vec<Notch> {
        let at = resonances(grid, plant, self.options.notches).into_iter();
        at.map(|hz| Notch { hz, width: 0.3, depth }).collect()
    }

    /// Controllers by loop shaping on the response of a plant: a crossover, the corner of the integral below it, that of the
    /// derivative above it, and a part of the gain that gives this crossover; notches at the highest resonances, or none that acts.
    pub(super) fn shaped(&self, grid: &Grid, plant: &[c64]) -> Vec<Vec<f64>> {
        let mut all = Vec::new();
        let depths: &[f64] = if self.options.notches > 0 { &[0.1, 1.0] } else { &[1.0] };
        for at in (0..CROSSOVERS).map(|k| LOWEST.powf(1.0 - (k as f64 + 0.5) / CROSSOVERS as f64) * PI / self.ts) {
            for (below, above) in [0.1, 0.3, 1.0, 3.0, 30.0].iter().flat_map(|b| [0.03, 0.3, 1.0, 3.0].map(|a| (*b, a)))
            {
                for depth in depths {
                    let gains = PidGains {
                        discretisation: self.discretisation,
                        kp: self.sign,
                        ki: self.sign * at * below,
                        kd: self.sign * above / at,
                        derivative_filter: 0.1 / at,
                    };
                    let notches = self.notches(grid, plant, *depth);
                    let x = self.parameters(&PidController { gains, notches, delay: self.delay });
                    let c = self.controller(&x);
                    let line = grid.omega.partition_point(|w| *w < at).min(grid.omega.len() - 1);
                    let [n, d] = c.at(self.ts, grid.q[line]);
                    let unit = (n / d * plant[line]).norm().max(1e-300);
                    all.extend([0.03, 0.1, 0.3, 0.8].map(|gain| self.scaled(&x, gain / unit)));
                }
            }
        }
        all
    }

    /// With another gain, all parts alike.
    fn scaled(&self, x: &[f64], factor: f64) -> Vec<f64> {
        let terms = self.terms();
        let gains = 1 + usize::from(terms.integral()) + usize::from(terms.derivative());
        x.iter().enumerate().map(|(k, x)| if k < gains { x + factor.ln() } else { *x }).collect()
    }
}

/// Crossovers that are tried, and the lowest of them against the Nyquist frequency. Chosen, not measured.
const CROSSOVERS: usize = 14;
const LOWEST: f64 = 5e-4;

/// The frequencies of the highest peaks of the response over its neighbourhood, Hz; at a quarter of the sample rate where there are too few.
fn resonances(grid: &Grid, plant: &[c64], count: usize) -> Vec<f64> {
    let size: Vec<f64> = plant.iter().map(|g| g.norm()).collect();
    let mut peaks: Vec<(f64, f64)> = (1..size.len() - 1)
        .filter(|k| size[*k] > size[k - 1] && size[*k] >= size[k + 1])
        .map(|k| (size[k] * grid.omega[k], grid.omega[k] / TAU))
        .collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    let found = peaks.into_iter().map(|(_, hz)| hz);
    found.chain(std::iter::repeat(0.25 / grid.ts)).take(count).collect()
}
