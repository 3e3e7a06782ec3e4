//! The small-gain product of Q over the region of S.
//!
//! With `S + dS` in place of S the loop `alpha = Q beta` stays stable for every stable dS with
//! ```text
//! max over omega of sigma_max(Q (I - S Q)^-1 (omega)) |dS(omega)|_F < 1
//! ```
//! alpha and beta in units in which the deviations of the entries of S are of one size (K. Zhou, J. C. Doyle, K. Glover, Robust
//! and Optimal Control, 1996, theorem 9.1). The region of S gives `|dS|_F` at each frequency; the product is not
//! computed between the grid points; the test of drawn models covers those.

use crate::error::{Error, Result};
use faer::prelude::*;
use youla::identify::subspace::{ResponseBand, Uncertainty};
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla::{Mat, c64};

/// Frequencies of the grid, half of them spaced linearly and half logarithmically up to Nyquist.
/// Chosen, not measured.
const POINTS: usize = 200;

/// The product for Q (from beta to alpha); `None` where S has no region.
///
/// # Errors
/// Those of the frequency responses; [`youla::Error::AlgebraicLoop`] where `I - S Q` is singular at a frequency.
pub fn small_gain(
    s: &StateSpace<Discrete>,
    q: &StateSpace<Discrete>,
    uncertainty: &Uncertainty,
) -> Result<Option<f64>> {
    let omega = grid(s.time());
    let Some(band) = uncertainty.response(&omega)? else { return Ok(None) };
    let (of_s, of_q) = (frequency_response(s, &omega)?, frequency_response(q, &omega)?);
    let (p, m) = (s.outputs(), s.inputs());
    let (rows, columns) = sizes(&band, p, m);
    let mut largest: f64 = 0.0;
    for k in 0..omega.len() {
        let loop_gain = Mat::from_fn(p, p, |i, j| c64::new(eye(p)[(i, j)], 0.0)) - of_s.at(k) * of_q.at(k);
        let closed = loop_gain.transpose().partial_piv_lu().solve(of_q.at(k).transpose()).transpose().to_owned();
        let scaled = Mat::from_fn(m, p, |i, j| closed[(i, j)] * columns[i] * rows[j]);
        let sigma = scaled.singular_values().map_err(|_| Error::Method(youla::Error::AlgebraicLoop { rcond: 0.0 }))?;
        let radius: f64 = (0..p)
            .flat_map(|i| (0..m).map(move |j| (i, j)))
            .map(|(i, j)| squared_radius(&band, k, i, j) / (rows[i] * columns[j]).powi(2))
            .sum();
        largest = largest.max(sigma.first().copied().unwrap_or(0.0) * radius.sqrt());
    }
    Ok(Some(largest))
}

/// Largest Frobenius norm over frequency of a departure of S within its region, beta per alpha; `None` where S has no region.
///
/// # Errors
/// Those of the frequency responses.
pub fn region_radius(s: &StateSpace<Discrete>, uncertainty: &Uncertainty) -> Result<Option<f64>> {
    let omega = grid(s.time());
    let Some(band) = uncertainty.response(&omega)? else { return Ok(None) };
    let entries = || (0..s.outputs()).flat_map(|i| (0..s.inputs()).map(move |j| (i, j)));
    let radius = |k: usize| entries().map(|(i, j)| squared_radius(&band, k, i, j)).sum::<f64>().sqrt();
    Ok(Some((0..omega.len()).map(radius).fold(0.0, f64::max)))
}

fn grid(time: Discrete) -> Vec<f64> {
    let nyquist = std::f64::consts::PI / time.ts();
    let half = POINTS / 2;
    let linear = (1..=half).map(|k| nyquist * k as f64 / (half + 1) as f64);
    let logarithmic = (0..half).map(|k| nyquist * 10f64.powf(-3.0 + 3.0 * k as f64 / half as f64));
    linear.chain(logarithmic).collect()
}

/// Square of the longest half axis of the region of an entry.
fn squared_radius(band: &ResponseBand, k: usize, i: usize, j: usize) -> f64 {
    let [rr, ri, ii] = band.covariance[band.place(k, i, j)];
    let (mean, half) = (0.5 * (rr + ii), 0.5 * (rr - ii));
    band.ellipse * (mean + (half * half + ri * ri).sqrt())
}

/// Sizes of the rows and columns of dS, so that its entries divided by both are alike.
fn sizes(band: &ResponseBand, p: usize, m: usize) -> (Vec<f64>, Vec<f64>) {
    let count = band.response.omega.len();
    let rms = |i: usize, j: usize| {
        ((0..count).map(|k| squared_radius(band, k, i, j)).sum::<f64>() / count as f64).sqrt().max(f64::MIN_POSITIVE)
    };
    let rows: Vec<f64> = (0..p).map(|i| (0..m).map(|j| rms(i, j)).sum::<f64>() / m as f64).collect();
    let column = |j: usize| (0..p).map(|i| rms(i, j) / rows[i]).sum::<f64>() / p as f64;
    (rows.clone(), (0..m).map(column).collect())
}
