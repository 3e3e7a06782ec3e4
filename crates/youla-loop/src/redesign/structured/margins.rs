//! Margins of a loop on a grid of frequencies, with `L = g C` (negative feedback) at each line, g being the plant of the channel while the
//! others are closed ([`Loops`]):
//!
//! ```text
//! peak sensitivity    max 1 / |1 + L|
//! gain                L real and negative: 1 / |L| above it, |L| below it, the smaller
//! phase, delay        |L| = 1: |arg(-L)|, (arg(-L) mod 2 pi) / omega
//! effort              sqrt(1/pi int_0^pi |C / (1 + L)|^2), the rms of u per rms of white noise of y
//! ```
//!
//! The loop is stable exactly when the winding number about zero of the quotient of its characteristic polynomial by that of a stable
//! loop of the same plant is zero (principle of the argument, both in powers of `z^-1`; the polynomial of the plant cancels),
//!
//! ```text
//! R = det(D + G N) / det(D_r + G N_r),        C = N / D,  C_r = N_r / D_r the running controllers, diagonal
//! ```
//!
//! Between lines L is taken as straight; `margins_equal_the_exact_ones` holds the figures against [`youla::control::margins()`].

use super::loops::Loops;
use super::options::PidOptions;
use super::scenarios::{Grid, Scenario};
use std::f64::consts::{PI, TAU};
use youla::c64;

/// The controller of a channel on the grid: numerators, denominators and their quotients.
#[derive(Clone)]
pub(super) struct OnGrid {
    pub(super) numerator: Vec<c64>,
    pub(super) denominator: Vec<c64>,
    pub(super) response: Vec<c64>,
}

/// Margins of a stable loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridMargins {
    /// Peak of the sensitivity.
    pub peak_sensitivity: f64,
    /// Least factor on the gain, up or down, that makes the loop unstable; infinite where none does.
    pub gain: f64,
    /// Least phase margin, degrees; 180 where the loop has no crossover.
    pub phase: f64,
    /// Least delay margin, seconds; infinite where the loop has no crossover.
    pub delay: f64,
    /// Rms of u per rms of white noise of the sensor, unit of u per unit of y.
    pub effort: f64,
    /// Frequency up to which the sensitivity is below -3 dB, Hz; zero where it is nowhere.
    pub bandwidth: f64,
}

/// The limits of a design in the order in which they are named.
pub(super) const LIMITS: [&str; 5] =
    ["peak_sensitivity", "gain_margin", "phase_margin", "delay_margin", "command_effort"];

impl GridMargins {
    /// Of no loop.
    pub(super) const NONE: GridMargins = GridMargins {
        peak_sensitivity: 0.0,
        gain: f64::INFINITY,
        phase: 180.0,
        delay: f64::INFINITY,
        effort: 0.0,
        bandwidth: 0.0,
    };

    /// Of several loops, the worst of each figure.
    pub(super) fn worst(of: &[GridMargins]) -> GridMargins {
        of.iter().fold(GridMargins { bandwidth: f64::INFINITY, ..Self::NONE }, |a, b| GridMargins {
            peak_sensitivity: a.peak_sensitivity.max(b.peak_sensitivity),
            gain: a.gain.min(b.gain),
            phase: a.phase.min(b.phase),
            delay: a.delay.min(b.delay),
            effort: a.effort.max(b.effort),
            bandwidth: a.bandwidth.min(b.bandwidth),
        })
    }

    /// By how much each limit is missed, as the logarithm of the quotient of figure and limit: at most 0 where it holds. `running` is the
    /// effort of the running controller on the same plant.
    pub(super) fn excess(&self, limits: &PidOptions, running: f64) -> [f64; 5] {
        let below =
            |limit: f64, value: f64| if limit > 0.0 { (limit / value.max(1e-12)).ln() } else { f64::NEG_INFINITY };
        [
            (self.peak_sensitivity / limits.peak_sensitivity).ln(),
            below(limits.gain_margin, self.gain),
            below(limits.phase_margin, self.phase),
            below(limits.delay_margin, self.delay),
            (self.effort / (limits.command_effort * running)).ln(),
        ]
    }
}

/// Margins of each loop of a plant under a controller for each channel; `None` where the whole is unstable.
pub(super) fn margins(grid: &Grid, plant: &Scenario, on: &[OnGrid]) -> Option<Vec<GridMargins>> {
    let mut of: Vec<Walk> = on.iter().map(|_| Walk::new()).collect();
    let mut loops = Loops::new(on.len());
    let start = grid.omega.len();
    let first = loops.at(plant.at(start), on, start) * plant.reference[start];
    let (mut winding, mut before) = (0.0, first);
    for k in 0..start {
        let turned = loops.at(plant.at(k), on, k) * plant.reference[k];
        winding += half_turn(before, turned);
        before = turned;
        of.iter_mut().zip(&loops.plants).zip(on).for_each(|((walk, g), c)| walk.line(grid, k, *g, c.response[k]));
    }
    let turn = before.arg() - first.arg() + TAU * winding;
    let found: Vec<GridMargins> = of.into_iter().map_while(Walk::ended).collect();
    (turn.abs() < 0.5 * PI && found.len() == on.len()).then_some(found)
}

/// The margins of one loop from line to line.
struct Walk {
    found: GridMargins,
    /// L at the first line and at the last one.
    ends: [c64; 2],
    /// `|1 + L|^2` at the last line, and the least between lines.
    distance: f64,
    least: f64,
    /// Whether the sensitivity is below -3 dB up to here.
    rejects: bool,
}

impl Walk {
    fn new() -> Self {
        Walk { found: GridMargins::NONE, ends: [c64::ZERO; 2], distance: 0.0, least: f64::INFINITY, rejects: true }
    }

    fn line(&mut self, grid: &Grid, k: usize, g: c64, c: c64) {
        let (l, before) = (g * c, self.ends[1]);
        let distance = (l + 1.0).norm_sqr();
        self.least = self.least.min(if k == 0 { distance } else { nearest(before, l, distance) });
        self.found.effort += grid.weights[k] * c.norm_sqr() / distance;
        if k == 0 {
            self.ends[0] = l;
        } else {
            crossings(&mut self.found, (before, l), (grid.omega[k - 1], grid.omega[k]));
        }
        if self.rejects && distance < 2.0 {
            self.rejects = false;
            self.found.bandwidth = if k == 0 { 0.0 } else { below_3_db(grid, k, self.distance, distance) };
        }
        (self.ends[1], self.distance) = (l, distance);
    }

    fn ended(mut self) -> Option<GridMargins> {
        ends(&mut self.found, self.ends);
        self.found.peak_sensitivity = 1.0 / self.least.sqrt();
        self.found.effort = self.found.effort.sqrt();
        (self.least > 0.0 && self.found.effort.is_finite()).then_some(self.found)
    }
}

/// Square of the least distance from -1 to the straight line between two points, the second of which has the square `end`.
fn nearest(from: c64, to: c64, end: f64) -> f64 {
    let (start, along) = (from + 1.0, to - from);
    let share = -(start.re * along.re + start.im * along.im) / along.norm_sqr();
    if share > 0.0 && share < 1.0 { (start + along * share).norm_sqr() } else { end }
}

/// Where the straight line between two points passes the real axis.
fn on_real_axis(from: c64, to: c64) -> Option<f64> {
    ((from.im < 0.0) != (to.im < 0.0)).then(|| (from.re * to.im - to.re * from.im) / (to.im - from.im))
}

/// Passages of the negative real axis between two points, counted as turns.
fn half_turn(from: c64, to: c64) -> f64 {
    match on_real_axis(from, to) {
        Some(real) if real < 0.0 => {
            if from.im < 0.0 {
                -1.0
            } else {
                1.0
            }
        }
        _ => 0.0,
    }
}

/// Gain, phase and delay at the crossings between two lines.
fn crossings(found: &mut GridMargins, (from, to): (c64, c64), (low, high): (f64, f64)) {
    if let Some(real) = on_real_axis(from, to) {
        found.gain = found.gain.min(factor(real));
    }
    let (a, b) = (from.norm_sqr(), to.norm_sqr());
    if (a < 1.0) != (b < 1.0) {
        let share = a.ln() / (a.ln() - b.ln());
        let at = -(from + (to - from) * share);
        let angle = at.arg();
        found.phase = found.phase.min(angle.abs().to_degrees());
        found.delay = found.delay.min(angle.rem_euclid(TAU) / (low + share * (high - low)));
    }
}

/// The factor on the gain that makes a loop critical whose response is real there.
fn factor(real: f64) -> f64 {
    if real < 0.0 { (-real).max(-1.0 / real) } else { f64::INFINITY }
}

/// L is real at both ends of all frequencies: at Nyquist, which is a line, and at zero, unless it grows without bound.
fn ends(found: &mut GridMargins, [first, last]: [c64; 2]) {
    for end in [first, last] {
        if end.im.abs() < REAL * end.re.abs() {
            found.gain = found.gain.min(factor(end.re));
        }
    }
    if last.norm_sqr() >= 1.0 {
        found.delay = 0.0;
    }
}

/// An imaginary part below this share of the real part is none. Chosen, not measured.
const REAL: f64 = 0.05;

/// Where `|1 + L|^2` falls below 2, between the lines k - 1 and k, Hz.
fn below_3_db(grid: &Grid, k: usize, before: f64, here: f64) -> f64 {
    let share = (before / 2.0).ln() / (before / here).ln();
    grid.omega[k - 1] * (grid.omega[k] / grid.omega[k - 1]).powf(share) / TAU
}
