//! The response from records of any excitation: a polynomial model of response and transient over the lines of a window.
//!
//! With r the distance from the middle of the window, the transforms of a record obey
//! ```text
//! Z = B(r) D + T(r) + V,    B, T polynomials of degree R
//! ```
//! T is what both ends of the record leave; it is smooth like the response and so needs no window function. `B(0)` is the response
//! in the middle.
//!
//! Source: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. (2012), section 7.2.

use super::gather::check_experiment;
use super::{LineResponse, PeriodicExperiment, invertible};
use crate::lti::{Discrete, FrequencyResponse};
use crate::{Error, Result};
use faer::{Mat, MatRef, Scale, c64};
use rayon::prelude::*;
use rustfft::FftPlanner;
use std::f64::consts::TAU;

/// Degree R of the polynomials: an odd one costs parameters and gains no order of the error in the middle of the window.
const DEGREE: usize = 2;
/// Degrees of freedom that a window leaves for the noise.
const SPARE: usize = 8;
/// Power of the excitation relative to that of the strongest window, below which a window holds none.
const EXCITED: f64 = 1e-10;

/// Transform of one record: `exp(-i omega t)` sums over the root of the number of samples.
struct Transform {
    samples: usize,
    /// Lines x m.
    d: Mat<c64>,
    /// Lines x q.
    z: Mat<c64>,
}

/// Estimates the response from `d` to `z` in windows of at least `width` lines of the longest record, side by side, so that the
/// estimates do not depend on each other. Windows that `d` does not excite are left out. Records may have different lengths.
///
/// A window has as many lines as leave 8 degrees of freedom where `width` is smaller. `lines` of the result are those in the middle
/// of the windows; there is no total variance, as one record does not tell distortion from noise. Stated over observed variance, held by
/// a test: 1.01.
///
/// # Errors
/// [`Error::Ports`] without a record, [`Error::Shape`], [`Error::NotFinite`]; [`Error::TooFewSamples`] where no record fills a window;
/// [`Error::NotExcited`] where no window is excited.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::{PeriodicExperiment, local_response}};
/// let d = Mat::from_fn(800, 1, |k, _| (1e-3 * (k * k) as f64).sin()); // a swept sine
/// let z = Mat::from_fn(800, 1, |k, _| if k < 3 { 0.0 } else { 2.0 * d[(k - 3, 0)] });
/// let record = PeriodicExperiment { d: d.as_ref(), z: z.as_ref() };
/// let found = local_response(&[record], Discrete::new(1.0)?, 15)?;
/// assert!((found.response.at(3)[(0, 0)].norm() - 2.0).abs() < 0.01);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn local_response(experiments: &[PeriodicExperiment], time: Discrete, width: usize) -> Result<LineResponse> {
    let Some(first) = experiments.first() else {
        return Err(Error::Ports { what: "the number of experiments".into(), expected: 1, found: 0 });
    };
    let (m, q) = (first.d.ncols(), first.z.ncols());
    experiments.iter().enumerate().try_for_each(|(e, experiment)| check_experiment(experiment, (m, q), e))?;
    let transforms: Vec<Transform> = experiments.iter().map(Transform::new).collect();
    let longest = transforms.iter().map(|t| t.samples).max().unwrap_or(0);
    let unknowns = (DEGREE + 1) * (m + experiments.len());
    let lines_of_all: f64 = transforms.iter().map(|t| t.samples as f64 / longest as f64).sum();
    let width = width.max(((unknowns + DEGREE + SPARE) as f64 / lines_of_all).ceil() as usize);
    let centres: Vec<usize> =
        (0..).map(|k| 1 + width / 2 + k * width).take_while(|c| 2 * (c + width / 2) < longest).collect();
    if centres.is_empty() {
        let (what, found, needed) = ("the longest record".into(), longest, 2 * width + 4);
        return Err(Error::TooFewSamples { what, found, needed });
    }
    let window = |centre: &usize| Window::new(&transforms, (*centre, width, longest));
    let windows: Vec<Window> = centres.par_iter().map(window).collect();
    let strongest = windows.iter().map(|w| w.power).fold(0.0, f64::max);
    let estimate = |(centre, w): (&usize, &Window)| {
        (w.power > EXCITED * strongest).then(|| w.estimate(m)).flatten().map(|found| (*centre, found))
    };
    let found: Vec<(usize, Local)> = centres.par_iter().zip(&windows).filter_map(estimate).collect();
    if found.is_empty() {
        let hz = centres[0] as f64 / (longest as f64 * time.ts());
        return Err(Error::NotExcited {
            inputs: (1..=m).collect(),
            how: "have no power, or depend on each other,",
            hz,
        });
    }
    let step = TAU / (longest as f64 * time.ts());
    let omega = found.iter().map(|(centre, _)| *centre as f64 * step).collect();
    let values =
        found.iter().flat_map(|(_, local)| local.t.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<_>>()));
    let response = FrequencyResponse::new(omega, values.collect(), q, m);
    let spare = found.iter().map(|(_, local)| local.spare).fold(f64::INFINITY, f64::min);
    let (mut lines, mut excitation, mut noise) = (Vec::new(), Vec::new(), Vec::new());
    for (centre, local) in found {
        lines.push(centre);
        excitation.push(local.m);
        noise.push(local.c);
    }
    Ok(LineResponse {
        response,
        lines,
        period: longest,
        periods: vec![1; experiments.len()],
        settling: vec![0; experiments.len()],
        degrees: 2.0 * spare,
        excitation,
        noise,
        total: Vec::new(),
        own: Vec::new(),
    })
}

impl Transform {
    fn new(experiment: &PeriodicExperiment) -> Self {
        let samples = experiment.d.nrows();
        let fft = FftPlanner::new().plan_fft_forward(samples);
        let scale = (samples as f64).sqrt().recip();
        let of = |signal: MatRef<f64>| {
            let mut out = Mat::zeros(samples / 2 + 1, signal.ncols());
            for (j, column) in signal.col_iter().enumerate() {
                let mut buffer: Vec<c64> = column.iter().map(|x| c64::new(x * scale, 0.0)).collect();
                fft.process(&mut buffer);
                (0..out.nrows()).for_each(|k| out[(k, j)] = buffer[k]);
            }
            out
        };
        Transform { samples, d: of(experiment.d), z: of(experiment.z) }
    }
}

/// The lines of all records in a window.
struct Window {
    /// Regressors of B and T: columns are lines.
    theta: Mat<c64>,
    /// z, columns are lines.
    z: Mat<c64>,
    power: f64,
}

struct Local {
    t: Mat<c64>,
    m: Mat<c64>,
    c: Mat<c64>,
    spare: f64,
}

impl Window {
    fn new(transforms: &[Transform], (centre, width, longest): (usize, usize, usize)) -> Self {
        let (m, q) = (transforms[0].d.ncols(), transforms[0].z.ncols());
        let half = width as f64 / 2.0;
        let mut rows: Vec<(usize, usize, f64)> = Vec::new();
        for (e, transform) in transforms.iter().enumerate() {
            let share = transform.samples as f64 / longest as f64;
            // r in lines of the longest record
            let distance = |k: usize| k as f64 / share - centre as f64;
            let from = ((centre as f64 - half) * share).ceil().max(1.0) as usize;
            let inside = (from..transform.d.nrows()).take_while(|k| distance(*k) < half);
            rows.extend(inside.map(|k| (e, k, distance(k) / half)));
        }
        let unknowns = (DEGREE + 1) * (m + transforms.len());
        let theta = Mat::from_fn(unknowns, rows.len(), |i, l| {
            let (e, k, r) = rows[l];
            let (degree, of) = (i / (m + transforms.len()), i % (m + transforms.len()));
            let signal = match of.checked_sub(m) {
                None => transforms[e].d[(k, of)],
                Some(record) => c64::new(f64::from(u8::from(record == e)), 0.0),
            };
            signal * r.powi(degree as i32)
        });
        let z = Mat::from_fn(q, rows.len(), |i, l| transforms[rows[l].0].z[(rows[l].1, i)]);
        let power = rows.iter().map(|(e, k, _)| transforms[*e].d.row(*k).squared_norm_l2()).sum();
        Window { theta, z, power }
    }

    /// `None` where the lines do not excite the inputs independently.
    fn estimate(&self, m: usize) -> Option<Local> {
        let inverse = invertible(&self.theta * self.theta.adjoint())?;
        let spare = self.theta.ncols() as f64 - self.theta.nrows() as f64;
        if spare < 1.0 {
            return None;
        }
        let all = &self.z * self.theta.adjoint() * &inverse;
        let left = &self.z - &all * &self.theta;
        let c = &left * left.adjoint() * Scale(c64::new(1.0 / spare, 0.0));
        Some(Local { t: all.subcols(0, m).to_owned(), m: inverse.submatrix(0, 0, m, m).to_owned(), c, spare })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lti::{StateSpace, frequency_response};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// One mode at 0.06 of the sample rate, from rest, with white noise of this deviation in y; `u = d + gain y`.
    fn record(
        samples: usize,
        zeta: f64,
        (noise, gain): (f64, f64),
        seed: u64,
    ) -> ([Mat<f64>; 2], StateSpace<Discrete>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
        let w = TAU * 0.06;
        let pole = c64::cis(w * (1.0 - zeta * zeta).sqrt()) * (-zeta * w).exp();
        let a = Mat::from_fn(2, 2, |i, j| [[pole.re, -pole.im], [pole.im, pole.re]][i][j]);
        let b = Mat::from_fn(2, 1, |i, _| [1.0, 0.2][i]);
        let c = Mat::from_fn(1, 2, |_, j| [0.1, 0.05][j]);
        let time = Discrete::new(1.0).unwrap();
        let plant = StateSpace::new(a, b, c, Mat::zeros(1, 1), time).unwrap();
        let d = Mat::from_fn(samples, 1, |_, _| white());
        let (mut x, mut z) = ([0.0; 2], Mat::zeros(samples, 2));
        for t in 0..samples {
            let y = 0.1 * x[0] + 0.05 * x[1] + noise * white();
            let u = d[(t, 0)] + gain * y;
            (z[(t, 0)], z[(t, 1)]) = (u, y);
            x = [pole.re * x[0] - pole.im * x[1] + u, pole.im * x[0] + pole.re * x[1] + 0.2 * u];
        }
        ([d, z], plant)
    }

    fn response(d: &Mat<f64>, z: &Mat<f64>, width: usize) -> LineResponse {
        let record = PeriodicExperiment { d: d.as_ref(), z: z.as_ref() };
        local_response(&[record], Discrete::new(1.0).unwrap(), width).unwrap()
    }

    /// In a loop with noise, well damped: stated over observed variance of the closed loop and of the plant.
    #[test]
    fn the_stated_variance_is_the_observed_one() {
        let mut sums = [[0.0; 2]; 2];
        for seed in 0..40 {
            let ([d, z], plant) = record(3000, 0.5, (0.5, -0.4), seed);
            let closed = response(&d, &z, 15);
            let found = closed.plant().unwrap();
            let exact = frequency_response(&plant, &found.response.omega).unwrap();
            let of_loop: Vec<c64> = exact.iter().map(|g| g[(0, 0)] / (1.0 + 0.4 * g[(0, 0)])).collect();
            for k in 0..found.lines.len() {
                sums[0][0] += closed.noise_variance(1, 0)[k];
                sums[0][1] += (closed.response.at(k)[(1, 0)] - of_loop[k]).norm_sqr();
                sums[1][0] += found.noise_variance(0, 0)[k];
                sums[1][1] += (found.response.at(k)[(0, 0)] - exact.at(k)[(0, 0)]).norm_sqr();
            }
        }
        let ratios = sums.map(|[stated, observed]| stated / observed);
        assert!(ratios.iter().all(|r| (0.85..1.15).contains(r)), "{ratios:?}");
    }

    #[test]
    fn records_of_other_lengths_join_and_bad_ones_are_refused() {
        let ([d, z], plant) = record(3000, 0.3, (0.05, 0.0), 1);
        let ([short, of_short], _) = record(1700, 0.3, (0.05, 0.0), 2);
        let records = [
            PeriodicExperiment { d: d.as_ref(), z: z.as_ref() },
            PeriodicExperiment { d: short.as_ref(), z: of_short.as_ref() },
        ];
        let time = Discrete::new(1.0).unwrap();
        let both = local_response(&records, time, 15).unwrap();
        let one = local_response(&records[..1], time, 15).unwrap();
        assert!(both.noise_variance(1, 0)[5] < one.noise_variance(1, 0)[5]);
        let exact = frequency_response(&plant, &both.response.omega).unwrap();
        let error =
            |k: usize| (both.response.at(k)[(1, 0)] - exact.at(k)[(0, 0)]).norm() / both.noise_variance(1, 0)[k].sqrt();
        assert!((0..both.lines.len()).all(|k| error(k) < 5.0));
        let says = |d: &Mat<f64>, z: &Mat<f64>, part: &str| {
            let record = PeriodicExperiment { d: d.as_ref(), z: z.as_ref() };
            let message = local_response(&[record], time, 15).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        };
        says(&Mat::zeros(100, 1), &Mat::zeros(100, 1), "have no power, or depend on each other, around");
        says(&Mat::zeros(9, 1), &Mat::zeros(9, 1), "the longest record: 9 samples are too few");
        says(&Mat::zeros(9, 1), &Mat::zeros(8, 1), "experiment 1: the excitation is 9 x 1, but must be 8 x 1");
    }
}
