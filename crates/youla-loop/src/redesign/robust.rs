//! The small-gain product of Q over the region of S.
//!
//! With `S + dS` in place of S the loop `alpha = Q beta` stays stable for every stable dS with
//! ```text
//! max over omega of sigma_max(Q (I - S Q)^-1 (omega)) |dS(omega)|_F < 1
//! ```
//! alpha and beta in units in which the deviations of the entries of S are of one size (K. Zhou, J. C. Doyle, K. Glover, Robust
//! and Optimal Control, 1996, theorem 9.1). The region of the plant gives `|dS|_F` at each frequency,
//! ```text
//! dS = T_(beta,n) dG T_(u,alpha)        T: the loop of the plant with J_K, n at its outputs
//! ```
//! The product is not computed between the grid points; the test of drawn plants covers those.

use crate::error::{Error, Result};
use faer::prelude::*;
use youla::control::closed_loop;
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::{EntryErrors, Region};
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla::{Mat, c64};

/// Frequencies of the grid, half of them spaced linearly and half logarithmically up to Nyquist.
/// Chosen, not measured.
const POINTS: usize = 200;
/// The 95 % quantile of chi-square with the two degrees of freedom of a complex number.
const ELLIPSE: f64 = 5.991;

/// The departures of S that the region of a plant holds.
#[derive(Debug, Clone, Copy)]
pub struct DeviationRegion<'a> {
    /// The factors of the running controller.
    pub factors: &'a CoprimeFactors<Discrete>,
    /// The identified plant.
    pub plant: &'a StateSpace<Discrete>,
    /// Its region.
    pub region: &'a Region,
}

impl DeviationRegion<'_> {
    /// The small-gain product for Q (from beta to alpha) over the departures of S.
    ///
    /// # Errors
    /// Those of the frequency responses; [`youla::Error::AlgebraicLoop`] where `I - S Q` is singular at a frequency.
    pub fn small_gain(&self, s: &StateSpace<Discrete>, q: &StateSpace<Discrete>) -> Result<f64> {
        let omega = grid(s.time());
        let errors = self.errors(&omega)?;
        let (of_s, of_q) = (frequency_response(s, &omega)?, frequency_response(q, &omega)?);
        let (p, m) = (s.outputs(), s.inputs());
        let (rows, columns) = sizes(&errors, p, m);
        let mut largest: f64 = 0.0;
        for (k, error) in errors.iter().enumerate() {
            let loop_gain = Mat::from_fn(p, p, |i, j| c64::new(eye(p)[(i, j)], 0.0)) - of_s.at(k) * of_q.at(k);
            let closed = loop_gain.transpose().partial_piv_lu().solve(of_q.at(k).transpose()).transpose().to_owned();
            let scaled = Mat::from_fn(m, p, |i, j| closed[(i, j)] * columns[i] * rows[j]);
            let singular = |_| Error::Method(youla::Error::AlgebraicLoop { rcond: 0.0 });
            let sigma = scaled.singular_values().map_err(singular)?;
            let entries = (0..p).flat_map(|i| (0..m).map(move |j| (i, j)));
            let radius: f64 = entries.map(|(i, j)| squared_radius(error, i, j) / (rows[i] * columns[j]).powi(2)).sum();
            largest = largest.max(sigma.first().copied().unwrap_or(0.0) * radius.sqrt());
        }
        Ok(largest)
    }

    /// Largest Frobenius norm over frequency of a departure of S within the region, beta per alpha.
    ///
    /// # Errors
    /// Those of the frequency responses.
    pub fn radius(&self) -> Result<f64> {
        let (p, m) = (self.plant.outputs(), self.plant.inputs());
        let entries = || (0..p).flat_map(|i| (0..m).map(move |j| (i, j)));
        let radius = |e: &EntryErrors| entries().map(|(i, j)| squared_radius(e, i, j)).sum::<f64>().sqrt();
        Ok(self.errors(&grid(self.plant.time()))?.iter().map(radius).fold(0.0, f64::max))
    }

    /// The error of S at angular frequencies.
    fn errors(&self, omega: &[f64]) -> Result<Vec<EntryErrors>> {
        let (m, p) = (self.plant.inputs(), self.plant.outputs());
        let whole = closed_loop(self.plant, &self.factors.j_k()?)?;
        let response = frequency_response(&whole, omega)?;
        let at = |k: usize| {
            let t = response.at(k);
            let (beta, u) = (t.submatrix(m + p, m, p, p), t.submatrix(0, 0, m, m));
            self.region.at(omega[k] / std::f64::consts::TAU).between(beta, u).entries()
        };
        Ok((0..omega.len()).map(at).collect())
    }
}

fn grid(time: Discrete) -> Vec<f64> {
    let nyquist = std::f64::consts::PI / time.ts();
    let half = POINTS / 2;
    let linear = (1..=half).map(|k| nyquist * k as f64 / (half + 1) as f64);
    let logarithmic = (0..half).map(|k| nyquist * 10f64.powf(-3.0 + 3.0 * k as f64 / half as f64));
    linear.chain(logarithmic).collect()
}

/// Square of the longest half axis of the region of an entry.
fn squared_radius(error: &EntryErrors, i: usize, j: usize) -> f64 {
    let [rr, ri, ii] = error.covariance((i, j));
    let (mean, half) = (0.5 * (rr + ii), 0.5 * (rr - ii));
    ELLIPSE * (mean + (half * half + ri * ri).sqrt())
}

/// Sizes of the rows and columns of dS, so that its entries divided by both are alike.
fn sizes(errors: &[EntryErrors], p: usize, m: usize) -> (Vec<f64>, Vec<f64>) {
    let rms = |i: usize, j: usize| {
        let mean = errors.iter().map(|e| squared_radius(e, i, j)).sum::<f64>() / errors.len() as f64;
        mean.sqrt().max(f64::MIN_POSITIVE)
    };
    let rows: Vec<f64> = (0..p).map(|i| (0..m).map(|j| rms(i, j)).sum::<f64>() / m as f64).collect();
    let column = |j: usize| (0..p).map(|i| rms(i, j) / rows[i]).sum::<f64>() / p as f64;
    (rows.clone(), (0..m).map(column).collect())
}
