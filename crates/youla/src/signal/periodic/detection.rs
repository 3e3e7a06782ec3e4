//! Lines that a periodic excitation leaves out: what appears there is noise and nonlinear distortion, nothing else.
//!
//! With odd lines only in the excitation, even nonlinearities answer at even lines and odd ones at odd lines, so that left-out odd
//! lines tell the two apart from one record. The noise comes from the scatter over the periods.
//!
//! Source: J. Schoukens, K. Godfrey, M. Schoukens, IEEE Control Syst. Mag. 38(4) (2018), 49.

use super::PeriodicExperiment;
use super::gather::{common_period, transform_period, weighted_mean};
use super::settling::settling_periods;
use crate::lti::Discrete;
use crate::{Error, Result};
use faer::Mat;
use rayon::prelude::*;
use rustfft::FftPlanner;
use std::f64::consts::TAU;

/// Levels at the lines that an excitation leaves out.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectionLines {
    /// The lines, up to the highest excited one; multiples of `1 / (period ts)` Hz.
    pub lines: Vec<usize>,
    /// Angular frequencies, rad/s.
    pub omega: Vec<f64>,
    /// Whether every excited line is odd, so that even lines show even nonlinearities and odd ones odd nonlinearities.
    pub parity: bool,
    /// Mean square of what repeats with the period, lines x q, noise included; mean over the experiments.
    pub repeating: Mat<f64>,
    /// The part of it that noise explains, lines x q.
    pub noise: Mat<f64>,
}

/// Levels of `z` at the lines that `d` leaves out; period and settling as in [`super::line_response`].
///
/// A level of one line has two degrees of freedom: average over neighbouring lines before reading single decibels.
///
/// # Errors
/// Those of [`super::line_response`] on the records; [`Error::NotExcited`] where the excitation leaves no line out.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::{PeriodicExperiment, detection_lines}};
/// // lines 1 and 5 of a period of 32 samples; a square answers at lines 2, 4 and 10
/// let sine = |line: usize, k: usize| (std::f64::consts::TAU * (line * k) as f64 / 32.0).sin();
/// let d = Mat::from_fn(320, 1, |k, _| sine(1, k) + sine(5, k));
/// let z = Mat::from_fn(320, 1, |k, _| d[(k, 0)] + 0.1 * d[(k, 0)].powi(2));
/// let found = detection_lines(&[PeriodicExperiment { d: d.as_ref(), z: z.as_ref() }], Discrete::new(1.0)?)?;
/// assert_eq!(found.lines, [2, 3, 4]);
/// assert!(found.parity && found.repeating[(2, 0)] > 1e-3 && found.repeating[(1, 0)] < 1e-20);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn detection_lines(experiments: &[PeriodicExperiment], time: Discrete) -> Result<DetectionLines> {
    let common = common_period(experiments)?;
    let highest = common.lines.last().copied().unwrap_or(0);
    let lines: Vec<usize> = (1..highest).filter(|line| common.lines.binary_search(line).is_err()).collect();
    let step = TAU / (common.samples as f64 * time.ts());
    if lines.is_empty() {
        let (how, hz) = ("leave no line out", highest as f64 * step / TAU);
        return Err(Error::NotExcited { inputs: (1..=experiments[0].d.ncols()).collect(), how, hz });
    }
    let (m, q, count) = (experiments[0].d.ncols(), experiments[0].z.ncols(), lines.len());
    let fft = FftPlanner::new().plan_fft_forward(common.samples);
    let (mut repeating, mut noise) = (Mat::zeros(count, q), Mat::zeros(count, q));
    // |Z|^2 of a transform to the mean square of the sine
    let unit = 2.0 / (common.samples as f64).powi(2) / experiments.len() as f64;
    for (e, experiment) in experiments.iter().enumerate() {
        let first = common.first[e];
        let all = (common.end[e] - first) / common.samples;
        let transform =
            |t: usize| transform_period(experiment, first + t * common.samples, &lines, &fft)[m * count..].to_vec();
        let z: Vec<_> = (0..all).into_par_iter().map(transform).collect();
        let settled = &z[settling_periods(&z, count)..];
        let periods = settled.len() as f64;
        let mean = weighted_mean(settled);
        for (k, i) in (0..count).flat_map(|k| (0..q).map(move |i| (k, i))) {
            let at = i * count + k;
            let centre = mean[at] / periods.sqrt();
            let scatter: f64 = settled.iter().map(|z| (z[at] - centre).norm_sqr()).sum();
            repeating[(k, i)] += unit * centre.norm_sqr();
            noise[(k, i)] += unit * scatter / (periods - 1.0) / periods;
        }
    }
    Ok(DetectionLines {
        omega: lines.iter().map(|l| *l as f64 * step).collect(),
        parity: common.lines.iter().all(|l| l % 2 == 1),
        lines,
        repeating,
        noise,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Mean levels over the noise at even and at left-out odd lines, of `y = u + even u^2 + odd u^3 + noise`.
    fn levels(even: f64, odd: f64) -> [f64; 2] {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let used: Vec<usize> = (0..40).map(|k| 2 * k + 1).filter(|l| l % 8 != 3).collect();
        let phases: Vec<f64> = used.iter().map(|_| TAU * rng.random::<f64>()).collect();
        let sine = |k: usize, i: usize| (TAU * (used[i] * k % 512) as f64 / 512.0 + phases[i]).cos();
        let d = Mat::from_fn(16 * 512, 1, |k, _| 0.2 * (0..used.len()).map(|i| sine(k % 512, i)).sum::<f64>());
        let z = Mat::from_fn(16 * 512, 1, |k, _| {
            let u = d[(k, 0)];
            u + even * u * u + odd * u.powi(3) + 0.01 * rng.sample::<f64, _>(StandardNormal)
        });
        let record = PeriodicExperiment { d: d.as_ref(), z: z.as_ref() };
        let found = detection_lines(&[record], Discrete::new(1.0).unwrap()).unwrap();
        assert!(found.parity && found.lines.contains(&3) && !found.lines.contains(&5));
        [0, 1].map(|parity| {
            let own = || (0..found.lines.len()).filter(|k| found.lines[*k] % 2 == parity);
            own().map(|k| found.repeating[(k, 0)]).sum::<f64>() / own().map(|k| found.noise[(k, 0)]).sum::<f64>()
        })
    }

    /// 40 even and 10 odd lines: one deviation of the ratio is 0.16 and 0.32.
    #[test]
    fn even_and_odd_nonlinearities_are_told_apart() {
        let [even, odd] = levels(0.0, 0.0);
        assert!((0.5..1.6).contains(&even) && (0.2..2.2).contains(&odd), "{even} {odd}");
        let [even, odd] = levels(0.01, 0.0);
        assert!(even > 20.0 && odd < 2.2, "{even} {odd}");
        let [even, odd] = levels(0.0, 0.01);
        assert!(even < 1.6 && odd > 20.0, "{even} {odd}");
    }
}
