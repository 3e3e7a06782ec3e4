//! Responses at the lines of a periodic excitation, with noise and nonlinear distortion told apart by the data alone.
//!
//! At a line, `Z = T D + V` over the experiments: D (m x E) is the excitation, Z (q x E) the mean over the periods of any signals
//! of the loop. D does not depend on the noise, so `T = (sum P Z D^H) M`, `M = (sum P D D^H)^-1`, is unbiased however much noise the
//! loop feeds back; P is the number of periods. With C the covariance of one period, `cov vec T = M^T (x) C`:
//!
//! - the scatter over the periods gives C of the noise, of all channels jointly;
//! - the scatter of the experiments around T D gives C of noise and distortion, because distortion repeats with the period;
//! - the difference is the distortion.
//!
//! Signals `z = beta` with `d = alpha` give S; `z = [u, y]` gives the closed loop and, by [`LineResponse::plant`], `G = T_y T_u^-1`.
//!
//! Source: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. (2012), sections 2.7 and 4.3;
//! J. Schoukens, K. Godfrey, M. Schoukens, IEEE Control Syst. Mag. 38(4) (2018), 49.

mod agreement;
mod gather;
mod interpolate;
mod levels;
mod local;
mod period;
mod settling;

pub use agreement::LineGroup;
pub(crate) use levels::Excited;
pub use local::local_response;
pub use period::{ExcitationPeriod, detect_period};

use crate::lti::{Discrete, FrequencyResponse};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Scale, c64};
use gather::{Line, Lines, gather};
use interpolate::{Estimate, at_line, interpolated};
use std::f64::consts::TAU;

/// One record under periodic excitation; row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct PeriodicExperiment<'a> {
    /// Excitation that is injected into the loop, samples x m, free of noise.
    pub d: MatRef<'a, f64>,
    /// Measured signals, samples x q.
    pub z: MatRef<'a, f64>,
}

/// A response at the excited lines with its covariance, `cov vec T = M^T (x) C` at each line.
#[derive(Debug, Clone)]
pub struct LineResponse {
    /// Response from d to z, q x m at each line.
    pub response: FrequencyResponse,
    /// The excited lines, multiples of `1 / (period ts)` Hz.
    pub lines: Vec<usize>,
    /// Length of a period in samples.
    pub period: usize,
    /// Periods in the mean, for each experiment.
    pub periods: Vec<usize>,
    /// Settling periods at the beginning that were left out, for each experiment.
    pub settling: Vec<usize>,
    /// Degrees of freedom of the noise variance at a line.
    pub(super) degrees: f64,
    /// M, m x m at each line.
    pub(super) excitation: Vec<Mat<c64>>,
    /// C of the noise, q x q at each line.
    pub(super) noise: Vec<Mat<c64>>,
    /// C of noise and distortion, q x q at each line; empty unless there are more experiments than inputs.
    pub(super) total: Vec<Mat<c64>>,
    /// Where the response is interpolated, each line's own values; else empty.
    pub(super) own: Vec<OwnLine>,
}

/// The signals at a line that one input excites alone.
#[derive(Debug, Clone)]
pub(super) struct OwnLine {
    /// The input.
    pub(super) input: usize,
    /// Means of d over the periods times the root of their number, m x E.
    pub(super) excitation: Mat<c64>,
    /// The same of z, q x E.
    pub(super) means: Mat<c64>,
}

/// Estimates the response from `d` to `z` at the lines that `d` excites; the period is detected, settling periods are left out.
///
/// All experiments have the same period. With m excitations, either at least m experiments excite them in independent ways, and more
/// of them, with other phases, give the total variance and the distortion; or each input has lines of its own (a multisine on all
/// inputs at a time): between its lines the response is then a local polynomial of degree 2 over 5 m lines, without total
/// variance. The stated variance equals the observed one (held by `variance_is_calibrated`).
///
/// # Errors
/// [`Error::NotPeriodic`] unless every record holds two whole periods, [`Error::UnequalPeriods`], [`Error::TooFewSamples`],
/// [`Error::Shape`], [`Error::NotFinite`]; [`Error::Ports`] without an experiment; [`Error::NotExcited`] with the inputs that are not
/// excited, or not independently of each other.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::{PeriodicExperiment, line_response}};
/// let d = Mat::from_fn(320, 1, |k, _| ((k % 32) as f64 * 0.3).sin());
/// let z = Mat::from_fn(320, 1, |k, _| 3.0 * d[(k, 0)] + 1e-3 * ((k * k) as f64).sin());
/// let found = line_response(&[PeriodicExperiment { d: d.as_ref(), z: z.as_ref() }], Discrete::new(1.0)?)?;
/// let deviation = found.noise_variance(0, 0)[0].sqrt();
/// assert!((found.response.at(0)[(0, 0)].re - 3.0).abs() < 1e-3 && deviation < 1e-3);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn line_response(experiments: &[PeriodicExperiment], time: Discrete) -> Result<LineResponse> {
    let gathered = gather(experiments)?;
    let step = TAU / (gathered.period as f64 * time.ts());
    let omega: Vec<f64> = gathered.lines.iter().map(|&l| l as f64 * step).collect();
    let (q, m) = (experiments[0].z.ncols(), experiments[0].d.ncols());
    let mut values = Vec::new();
    let (mut excitation, mut noise, mut total) = (Vec::new(), Vec::new(), Vec::new());
    let all: Vec<Line> = (0..gathered.lines.len()).map(|k| gathered.at(k)).collect();
    let apart = all.iter().all(|line| invertible(line.d.as_ref() * line.d.adjoint()).is_some());
    for (k, line) in all.iter().enumerate() {
        let estimate = if apart { at_line(line) } else { interpolated(&gathered.lines, &all, k) };
        let Some(Estimate { t, m: m_k, c }) = estimate else { return Err(not_excited(&all, k, omega[k] / TAU)) };
        values.extend((0..m).flat_map(|j| (0..q).map(move |i| (i, j))).map(|at| t[at]));
        if apart && experiments.len() > m {
            let rest = &line.z - &t * &line.d;
            total.push(&rest * rest.adjoint() * Scale(c64::new(1.0 / (experiments.len() - m) as f64, 0.0)));
        }
        excitation.push(m_k);
        noise.push(c);
    }
    let response = FrequencyResponse::new(omega, values, q, m);
    let Lines { lines, period, periods, settling, .. } = gathered;
    let degrees = 2.0 * periods.iter().map(|count| count - 1).sum::<usize>() as f64;
    let own = if apart { Vec::new() } else { all.into_iter().map(OwnLine::new).collect() };
    Ok(LineResponse { response, lines, period, periods, settling, degrees, excitation, noise, total, own })
}

impl OwnLine {
    fn new(line: Line) -> Self {
        let power = |j: &usize| line.d.row(*j).squared_norm_l2();
        let input = (0..line.d.nrows()).max_by(|a, b| power(a).total_cmp(&power(b))).unwrap_or(0);
        OwnLine { input, excitation: line.d, means: line.z }
    }
}

/// The inputs that lack excitation: those without power around the line, all where their excitations depend on each other.
fn not_excited(all: &[Line], k: usize, hz: f64) -> Error {
    let near = &all[k.saturating_sub(2)..(k + 3).min(all.len())];
    let power = |j: usize| near.iter().map(|line| line.d.row(j).squared_norm_l2()).sum::<f64>();
    let inputs = 0..all[k].d.nrows();
    let strongest = inputs.clone().map(power).fold(0.0, f64::max);
    let without: Vec<usize> = inputs.clone().filter(|&j| power(j) <= SINGULAR * strongest).collect();
    let (inputs, how) = match without.is_empty() {
        true => (inputs.collect(), "depend on each other"),
        false => (without, "have no power"),
    };
    Error::NotExcited { inputs: inputs.into_iter().map(|j: usize| j + 1).collect(), how, hz }
}

impl LineResponse {
    /// The plant between u and y, where d has the m signals that u has and `z = [u, y]`: `G = T_y T_u^-1`, p x m.
    ///
    /// To first order `dG = [-G I] dT T_u^-1`, so the covariance keeps its form: `M -> T_u^-H M T_u^-1`, `C -> [-G I] C [-G I]^H`.
    ///
    /// # Errors
    /// [`Error::Ports`] unless z has more signals than d, [`Error::Singular`] with the first line at which d does not reach u.
    pub fn plant(&self) -> Result<LineResponse> {
        let (q, m) = (self.response.at(0).nrows(), self.response.at(0).ncols());
        if q <= m {
            let what = "the number of signals u and y together".into();
            return Err(Error::Ports { what, expected: m + 1, found: q });
        }
        let p = q - m;
        let mut plant = LineResponse { excitation: Vec::new(), noise: Vec::new(), total: Vec::new(), ..self.clone() };
        let mut values = Vec::new();
        for (k, t) in self.response.iter().enumerate() {
            let hz = self.response.omega[k] / TAU;
            let w = inverse(t.subrows(0, m).to_owned(), || format!("the response from d to u at {hz:.6} Hz"))?;
            let g = t.subrows(m, p) * &w;
            values.extend((0..m).flat_map(|j| (0..p).map(move |i| (i, j))).map(|at| g[at]));
            let a = output_rest(g.as_ref());
            plant.excitation.push(w.adjoint() * &self.excitation[k] * &w);
            plant.noise.push(&a * &self.noise[k] * a.adjoint());
            if let Some(total) = self.total.get(k) {
                plant.total.push(&a * total * a.adjoint());
            }
        }
        plant.response = FrequencyResponse::new(self.response.omega.clone(), values, p, m);
        Ok(plant)
    }
}

/// `[-G I]`, which takes `z = [u, y]` to `y - G u`.
pub(crate) fn output_rest(g: MatRef<c64>) -> Mat<c64> {
    let (p, m) = (g.nrows(), g.ncols());
    Mat::from_fn(p, m + p, |i, j| if j < m { -g[(i, j)] } else { c64::new(f64::from(u8::from(j == m + i)), 0.0) })
}

/// The inverse, which the formulas hold as a factor of the covariance; refused where it does not exist.
pub(crate) fn inverse(a: Mat<c64>, what: impl Fn() -> String) -> Result<Mat<c64>> {
    let rcond = reciprocal_condition(a.as_ref());
    invertible(a).ok_or_else(|| Error::Singular { what: what(), rcond })
}

fn invertible(a: Mat<c64>) -> Option<Mat<c64>> {
    let works = reciprocal_condition(a.as_ref()) >= SINGULAR;
    works.then(|| a.partial_piv_lu().solve(Mat::<c64>::identity(a.nrows(), a.nrows())))
}

fn reciprocal_condition(a: MatRef<c64>) -> f64 {
    match a.singular_values() {
        Ok(s) if s.first().is_some_and(|largest| *largest > 0.0) => s[s.len() - 1] / s[0],
        _ => 0.0,
    }
}

/// Reciprocal condition number below which experiments count as dependent.
const SINGULAR: f64 = 1e-10;

#[cfg(test)]
mod tests;
