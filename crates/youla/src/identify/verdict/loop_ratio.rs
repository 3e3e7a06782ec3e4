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
use crate::identify::likelihood::deviation::region::Region;
use crate::identify::likelihood::deviation::response_error::{Covariance, ResponseError};
use crate::linalg::TINY;
use crate::lti::{Discrete, StateSpace, frequency_response, largest_singular_value};
use crate::{Mat, MatRef, Result, c64};
use faer::linalg::solvers::Solve;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Par, Scale, Side};
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

/// The matrices on both sides of dG, `(I + G G*)^-1/2` and `(I + G* G)^-1/2`, the right one over rho.
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
        Ok(hz.par_iter().enumerate().map(|(i, hz)| LoopAt::new(*hz, g.at(i).to_owned(), k.at(i))).collect())
    }

    fn new(hz: f64, g: Mat<c64>, k: MatRef<'_, c64>) -> Self {
        let difference = identity(g.nrows()) - &g * k;
        let s = difference.partial_piv_lu().solve(identity(g.nrows()));
        let ks = k * &s;
        let chordal = UNITS.iter().filter_map(|unit| Chordal::new(&g, k, &s, *unit)).collect();
        LoopAt { hz, s, ks, chordal }
    }

    /// `(I - G K)^-1` in units of some sizes of the outputs.
    pub(super) fn sensitivity(&self, sizes: &[f64]) -> Mat<c64> {
        Mat::from_fn(sizes.len(), sizes.len(), |i, j| self.s[(i, j)] * (sizes[j] / sizes[i]))
    }

    /// `kappa / rho` of an error: the root of the largest mean square.
    pub(crate) fn error(&self, error: &ResponseError) -> f64 {
        let (all, one) = (error.all(), identity(self.s.nrows()));
        let additive = size(&all, one.as_ref(), self.ks.as_ref());
        let chordal = |c: &Chordal| size(&all, c.left.as_ref(), c.right.as_ref());
        self.chordal.iter().map(chordal).fold(additive, f64::min)
    }

    /// `kappa / rho` of the edge of the 95 % region.
    pub(crate) fn ratio(&self, error: &ResponseError) -> f64 {
        EDGE * self.error(error)
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
        // The roots are triangular: norms do not depend on which root it is.
        let [of_outputs, of_inputs] = [identity(p) + &g * g.adjoint(), identity(m) + g.adjoint() * &g];
        let (outputs, inputs) = (of_outputs.llt(Side::Lower).ok()?, of_inputs.llt(Side::Lower).ok()?);
        let of_controller = (identity(p) + k.adjoint() * &k).llt(Side::Lower).ok()?;
        let nearest = largest_singular_value((of_controller.L().adjoint() * s * outputs.L()).as_ref()).ok()?;
        let inverse = |root: MatRef<'_, c64>| {
            let mut inverse = identity(root.nrows());
            solve_lower_triangular_in_place(root, inverse.as_mut(), Par::Seq);
            inverse
        };
        let right = inverse(inputs.L()).adjoint() * Scale(c64::new(unit * nearest, 0.0));
        Some(Chordal { left: inverse(outputs.L()), right })
    }
}

fn identity(n: usize) -> Mat<c64> {
    Mat::identity(n, n)
}

/// Root of the largest mean square of `|x* left E right y|` over unit vectors on one side.
fn size(error: &Covariance, left: MatRef<'_, c64>, right: MatRef<'_, c64>) -> f64 {
    let (inner, outer) = (right * right.adjoint(), left.adjoint() * left);
    let [rows, columns] = error.sides(inner.as_ref(), outer.as_ref());
    // All eigenvalues of a positive semidefinite matrix are its singular values.
    let largest = |m: Mat<c64>| m.self_adjoint_eigenvalues(Side::Lower).ok()?.last().copied();
    let largest = |m: Mat<c64>| largest(m).filter(|e| !e.is_nan()).unwrap_or(f64::INFINITY);
    let (rows, columns) = (left * whole(&rows) * left.adjoint(), right.adjoint() * whole(&columns) * right);
    largest(rows).max(largest(columns)).max(0.0).sqrt()
}

/// A Hermitian matrix from its lower half.
fn whole(lower: &Mat<c64>) -> Mat<c64> {
    let entry = |i: usize, j: usize| if i >= j { lower[(i, j)] } else { lower[(j, i)].conj() };
    Mat::from_fn(lower.nrows(), lower.ncols(), entry)
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
