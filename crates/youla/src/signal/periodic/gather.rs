//! From records to lines: period, transforms of the periods, settling, means and scatter.

use super::settling::settling_periods;
use super::{ExcitationPeriod, PeriodicExperiment, detect_period};
use crate::linalg::{check_finite, check_shape};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// What all experiments say at all lines.
pub(super) struct Lines {
    pub period: usize,
    pub lines: Vec<usize>,
    /// For each experiment.
    pub periods: Vec<usize>,
    /// For each experiment.
    pub settling: Vec<usize>,
    /// For each experiment, means of d and z over the periods times the root of their number, channel after channel.
    means: Vec<Vec<c64>>,
    /// One q x q matrix after the other, column-major.
    noise: Vec<c64>,
    /// Numbers of channels of d and z.
    channels: (usize, usize),
}

/// One line: means weighted by the root of the number of periods, and the covariance of one period.
pub(super) struct Line {
    /// m x E.
    pub d: Mat<c64>,
    /// q x E.
    pub z: Mat<c64>,
    /// q x q.
    pub noise: Mat<c64>,
}

impl Lines {
    pub(super) fn at(&self, k: usize) -> Line {
        let ((m, q), count, lines) = (self.channels, self.means.len(), self.lines.len());
        let d = Mat::from_fn(m, count, |j, e| self.means[e][j * lines + k]);
        let z = Mat::from_fn(q, count, |i, e| self.means[e][(m + i) * lines + k]);
        let noise = MatRef::from_column_major_slice(&self.noise[k * q * q..(k + 1) * q * q], q, q).to_owned();
        Line { d, z, noise }
    }
}

pub(super) fn gather(experiments: &[PeriodicExperiment]) -> Result<Lines> {
    let common = common_period(experiments)?;
    let (m, q) = (experiments[0].d.ncols(), experiments[0].z.ncols());
    let lines = common.lines.len();
    let mut out = Lines {
        period: common.samples,
        lines: common.lines.clone(),
        periods: Vec::new(),
        settling: Vec::new(),
        means: Vec::new(),
        noise: vec![c64::new(0.0, 0.0); lines * q * q],
        channels: (m, q),
    };
    let fft = FftPlanner::new().plan_fft_forward(common.samples);
    for (e, experiment) in experiments.iter().enumerate() {
        let first = common.first[e];
        let all = (common.end[e] - first) / common.samples;
        let transform = |t: usize| transform_period(experiment, first + t * common.samples, &common.lines, &fft);
        let transforms: Vec<Vec<c64>> = (0..all).into_par_iter().map(transform).collect();
        let (d, z): (Vec<_>, Vec<_>) =
            transforms.iter().map(|x| (x[..m * lines].to_vec(), x[m * lines..].to_vec())).unzip();
        let settling = settling_periods(&z, lines);
        add_scatter(&z[settling..], lines, &mut out.noise);
        let mut mean = weighted_mean(&d[settling..]);
        mean.extend(weighted_mean(&z[settling..]));
        out.means.push(mean);
        out.settling.push(settling);
        out.periods.push(all - settling);
    }
    let degrees: usize = out.periods.iter().map(|p| p - 1).sum();
    out.noise.iter_mut().for_each(|x| *x /= degrees as f64);
    Ok(out)
}

/// Shapes and finite numbers of experiment number e.
pub(super) fn check_experiment(experiment: &PeriodicExperiment, (m, q): (usize, usize), e: usize) -> Result<()> {
    let within = |error| Error::Within { part: format!("experiment {}", e + 1), source: Box::new(error) };
    check_shape("the excitation", experiment.d, (experiment.z.nrows(), m)).map_err(within)?;
    check_shape("the measured signals", experiment.z, (experiment.d.nrows(), q)).map_err(within)?;
    check_finite("the excitation", experiment.d).map_err(within)?;
    check_finite("the measured signals", experiment.z).map_err(within)
}

/// The period of all experiments, and the rows of each.
pub(super) struct Common {
    pub(super) samples: usize,
    pub(super) lines: Vec<usize>,
    pub(super) first: Vec<usize>,
    pub(super) end: Vec<usize>,
}

pub(super) fn common_period(experiments: &[PeriodicExperiment]) -> Result<Common> {
    let Some(first) = experiments.first() else {
        return Err(Error::Ports { what: "the number of experiments".into(), expected: 1, found: 0 });
    };
    let (m, q) = (first.d.ncols(), first.z.ncols());
    let mut common: Option<Common> = None;
    for (e, experiment) in experiments.iter().enumerate() {
        check_experiment(experiment, (m, q), e)?;
        let within = |error| Error::Within { part: format!("experiment {}", e + 1), source: Box::new(error) };
        let found = detect_period(experiment.d).map_err(within)?;
        let common = common.get_or_insert_with(|| Common::new(&found));
        if found.samples != common.samples {
            return Err(Error::UnequalPeriods { experiment: e + 1, found: found.samples, first: common.samples });
        }
        common.lines.retain(|line| found.lines.binary_search(line).is_ok());
        common.first.push(found.rows.start);
        common.end.push(found.rows.end);
    }
    common.filter(|c| !c.lines.is_empty()).ok_or(Error::NotPeriodic { what: "the excitation".into(), longest: 0 })
}

impl Common {
    fn new(found: &ExcitationPeriod) -> Self {
        Common { samples: found.samples, lines: found.lines.clone(), first: Vec::new(), end: Vec::new() }
    }
}

/// Values at the lines of all channels of d and then z; two real channels share one complex transform.
pub(super) fn transform_period(
    e: &PeriodicExperiment,
    first: usize,
    lines: &[usize],
    fft: &Arc<dyn Fft<f64>>,
) -> Vec<c64> {
    let period = fft.len();
    let columns: Vec<_> = e.d.col_iter().chain(e.z.col_iter()).map(|c| c.subrows(first, period)).collect();
    let mut out = Vec::with_capacity(columns.len() * lines.len());
    for pair in columns.chunks(2) {
        let second = |k: usize| pair.get(1).map_or(0.0, |c| c[k]);
        let mut buffer: Vec<c64> = (0..period).map(|k| c64::new(pair[0][k], second(k))).collect();
        fft.process(&mut buffer);
        let mirrored = |l: usize| (buffer[l], buffer[period - l].conj());
        out.extend(lines.iter().map(|&l| (mirrored(l).0 + mirrored(l).1) * 0.5));
        if pair.len() == 2 {
            out.extend(lines.iter().map(|&l| (mirrored(l).0 - mirrored(l).1) * c64::new(0.0, -0.5)));
        }
    }
    out
}

/// Mean times the root of the number of periods, so that products of means weight each experiment by its periods.
pub(super) fn weighted_mean(periods: &[Vec<c64>]) -> Vec<c64> {
    let scale = 1.0 / (periods.len() as f64).sqrt();
    (0..periods[0].len()).map(|k| periods.iter().map(|p| p[k]).sum::<c64>() * scale).collect()
}

/// Adds `sum over the periods of (Z - mean) (Z - mean)^H` at each line.
fn add_scatter(periods: &[Vec<c64>], lines: usize, noise: &mut [c64]) {
    let q = periods[0].len() / lines;
    let scale = 1.0 / periods.len() as f64;
    let mean: Vec<c64> = (0..q * lines).map(|k| periods.iter().map(|p| p[k]).sum::<c64>() * scale).collect();
    for (k, matrix) in noise.chunks_exact_mut(q * q).enumerate() {
        for period in periods {
            let rest = |i: usize| period[i * lines + k] - mean[i * lines + k];
            for j in 0..q {
                let other = rest(j).conj();
                (0..q).for_each(|i| matrix[i + j * q] += rest(i) * other);
            }
        }
    }
}
