//! The region of a model in the metric of the loop that ran: which part of the margin it takes.
//!
//! ```text
//! kappa(w) = sigma_max((I + G G*)^-1/2 dG (I + G* G)^-1/2)          chordal distance to the edge of the 95 % region
//! rho(w)   = 1 / sigma_max([I; K] (I - G K)^-1 [I, G])              chordal distance to the nearest plant that K does not tolerate
//! r        = max over w of kappa / rho
//! ```
//! K stabilises every plant of the region where r < 1 (G. Vinnicombe, Uncertainty and Feedback, 2001). The metric depends on the units
//! of the channels, and the condition suffices in any. Several are taken at each frequency and the least quotient counts: units in
//! which G is small, where it is `|dG K (I - G K)^-1|`, units in which G and K have the same size, and units in which G is large, where
//! it is `|dG / G| |S|` for one channel. So an error of the plant counts by `|dG / G| |S| min(1, |G K|)`: little where the loop gain is
//! high, little where it is low.

use super::limits::{BELOW_ONE_PERIOD, EDGE, LARGEST_IN_BAND};
use crate::identify::likelihood::deviation::region::{Region, ResponseError};
use crate::linalg::TINY;
use crate::lti::{Discrete, StateSpace, frequency_response, largest_singular_value};
use crate::{Mat, MatRef, Result, c64};
use faer::linalg::solvers::Solve;
use faer::{Scale, Side};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// What the region takes of the margin of the loop that ran.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LoopRatio {
    /// Frequencies, Hz.
    pub hz: Vec<f64>,
    /// `kappa / rho` at each.
    pub ratio: Vec<f64>,
    /// The largest.
    pub largest: f64,
    /// Its frequency, Hz.
    pub largest_hz: f64,
}

/// A loop at one frequency.
pub(crate) struct LoopAt {
    /// Frequency, Hz.
    pub(crate) hz: f64,
    /// (I - G K)^-1, p x p.
    pub(crate) s: Mat<c64>,
    /// K (I - G K)^-1, m x p.
    pub(crate) ks: Mat<c64>,
    chordal: Vec<Chordal>,
}

/// The matrices on both sides of dG, the right one over rho.
struct Chordal {
    left: Mat<c64>,
    right: Mat<c64>,
}

impl LoopAt {
    /// Of plant and controller `u = K y` at some frequencies.
    ///
    /// # Errors
    /// Frequencies on a pole of either.
    pub(crate) fn all(plant: &StateSpace<Discrete>, k: &StateSpace<Discrete>, hz: &[f64]) -> Result<Vec<LoopAt>> {
        let omega: Vec<f64> = hz.iter().map(|hz| TAU * hz).collect();
        let (g, k) = (frequency_response(plant, &omega)?, frequency_response(k, &omega)?);
        Ok(hz.iter().enumerate().map(|(i, hz)| LoopAt::new(*hz, g.at(i).to_owned(), k.at(i))).collect())
    }

    fn new(hz: f64, g: Mat<c64>, k: MatRef<'_, c64>) -> Self {
        let difference = identity(g.nrows()) - &g * k;
        let s = difference.partial_piv_lu().solve(identity(g.nrows()));
        let ks = k * &s;
        let chordal = UNITS.iter().filter_map(|unit| Chordal::new(&g, k, &s, *unit)).collect();
        LoopAt { hz, s, ks, chordal }
    }

    /// `kappa / rho` of independent errors of unit variance: the root of the largest mean square.
    pub(crate) fn error(&self, changes: &[Mat<c64>]) -> f64 {
        let additive = size(changes.iter().map(|e| e * &self.ks));
        let chordal = |c: &Chordal| size(changes.iter().map(|e| &c.left * e * &c.right));
        self.chordal.iter().map(chordal).fold(additive, f64::min)
    }

    /// `kappa / rho` of the edge of the 95 % region.
    pub(crate) fn ratio(&self, error: &ResponseError) -> f64 {
        EDGE * self.error(&error.changes().collect::<Vec<_>>())
    }
}

/// Sizes of G over that of K in the units in which the chordal distance is taken.
const UNITS: [f64; 3] = [1.0, 30.0, 1000.0];

impl Chordal {
    /// In units in which the size of G over that of K is given; `None` where the loop has a pole at the frequency.
    fn new(g: &Mat<c64>, k: MatRef<'_, c64>, s: &Mat<c64>, size: f64) -> Option<Self> {
        let (gain, feedback) = (largest_singular_value(g.as_ref()).ok()?, largest_singular_value(k).ok()?);
        let unit = (size * feedback.max(TINY) / gain.max(TINY)).sqrt();
        let (g, k) = (g * Scale(c64::new(unit, 0.0)), k * Scale(c64::new(1.0 / unit, 0.0)));
        let (p, m) = (g.nrows(), g.ncols());
        let tall = Mat::from_fn(p + m, p, |i, j| if i < p { identity(p)[(i, j)] } else { k[(i - p, j)] });
        let wide = Mat::from_fn(p, p + m, |i, j| if j < p { identity(p)[(i, j)] } else { g[(i, j - p)] });
        let nearest = largest_singular_value((&tall * s * &wide).as_ref()).ok()?;
        let left = inverse_root(&(identity(p) + &g * g.adjoint()))?;
        let right = inverse_root(&(identity(m) + g.adjoint() * &g))? * Scale(c64::new(unit * nearest, 0.0));
        Some(Chordal { left, right })
    }
}

fn identity(n: usize) -> Mat<c64> {
    Mat::identity(n, n)
}

/// `A^-1/2` of a Hermitian matrix that is at least the identity.
fn inverse_root(a: &Mat<c64>) -> Option<Mat<c64>> {
    let eigen = a.self_adjoint_eigen(Side::Lower).ok()?;
    let scaled = Mat::from_fn(a.nrows(), a.nrows(), |i, k| eigen.U()[(i, k)] / eigen.S()[k].re.max(1.0).sqrt());
    Some(&scaled * eigen.U().adjoint())
}

/// Root of the largest mean square of `|x* E y|` over unit vectors on one side, of a sum of independent matrices.
fn size(changes: impl Iterator<Item = Mat<c64>>) -> f64 {
    let mut sides: Option<[Mat<c64>; 2]> = None;
    for e in changes {
        let squares = [&e * e.adjoint(), e.adjoint() * &e];
        sides = Some(match sides {
            None => squares,
            Some([a, b]) => [a + &squares[0], b + &squares[1]],
        });
    }
    let largest = |m: &Mat<c64>| largest_singular_value(m.as_ref()).unwrap_or(f64::INFINITY);
    sides.map_or(0.0, |[a, b]| largest(&a).max(largest(&b)).sqrt())
}

/// Changes of one entry each, from the mean squares of the entries, row by row.
pub(crate) fn entries(squares: &[f64], inputs: usize) -> impl Iterator<Item = Mat<c64>> + '_ {
    let outputs = squares.len() / inputs.max(1);
    let one = move |(at, square): (usize, &f64)| {
        let size = c64::new(square.max(0.0).sqrt(), 0.0);
        Mat::from_fn(outputs, inputs, |i, j| if i * inputs + j == at { size } else { c64::ZERO })
    };
    squares.iter().enumerate().map(one)
}

impl LoopRatio {
    /// Of a region in the loop; from [`BELOW_ONE_PERIOD`] of the lowest stated frequency on.
    pub(crate) fn new(loops: &[LoopAt], error_at: impl Fn(f64) -> ResponseError + Sync) -> Self {
        let ratio: Vec<f64> = loops.par_iter().map(|at| at.ratio(&error_at(at.hz))).collect();
        let worst = (0..ratio.len()).max_by(|a, b| ratio[*a].total_cmp(&ratio[*b]));
        let (largest, largest_hz) = worst.map_or((0.0, 0.0), |k| (ratio[k], loops[k].hz));
        LoopRatio { hz: loops.iter().map(|at| at.hz).collect(), ratio, largest, largest_hz }
    }
}

/// Frequencies at which a loop is judged: those of the region, those of the poles of plant and loop, and both sides of these.
pub(crate) fn judged_hz(region: &Region, poles: &[c64], ts: f64) -> Vec<f64> {
    let (first, last) = (region.hz[0] * BELOW_ONE_PERIOD, region.hz[region.hz.len() - 1]);
    let of_pole = |z: &c64| {
        let s = z.ln() / ts;
        let hz = s.im.abs() / TAU;
        [-1.0, 0.0, 1.0].map(|side| hz + side * s.re.abs() / TAU)
    };
    let mut hz: Vec<f64> = region.hz.clone();
    hz.extend(poles.iter().filter(|z| z.norm() > 0.0).flat_map(of_pole));
    hz.retain(|hz| (first..=last).contains(hz));
    hz.sort_by(f64::total_cmp);
    hz.dedup();
    hz
}

/// Bands in which the standard deviation of an entry is within its limit, `[low, high]` in Hz.
pub(crate) fn bands(hz: &[f64], within: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    let mut open = false;
    for (k, hz) in hz.iter().enumerate() {
        match (within(k), open) {
            (true, false) => out.push([*hz, *hz]),
            (true, true) => out.iter_mut().next_back().into_iter().for_each(|band| band[1] = *hz),
            _ => {}
        }
        open = within(k);
    }
    out.retain(|[low, high]| high > low);
    out
}

/// Whether a standard deviation is within the limit of a band.
pub(crate) fn valid(deviation: f64, g: c64) -> bool {
    deviation <= LARGEST_IN_BAND * g.norm()
}
