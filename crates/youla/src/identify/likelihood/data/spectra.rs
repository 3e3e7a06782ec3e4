//! Records as lines of their discrete Fourier transform.
//!
//! For `x+ = A x + B u`, `y = C x + D u` over N samples the transforms obey exactly, without any window,
//! ```text
//! Y(k) = (C (z I - A)^-1 B + D) U(k) + C (z I - A)^-1 z t,     t = (x(0) - x(N)) / sqrt(N),   z = exp(2 pi i k / N)
//! ```
//! so that one vector t of n numbers per record describes both ends of it (Pintelon and Schoukens, System Identification,
//! section 6.3). Constants of u and y touch the line k = 0 only, which is left out; what a constant input does to an integrator
//! is a ramp, and t holds it. Nothing is subtracted from the data.

use crate::identify::subspace::Experiment;
use crate::signal::of_two_real;
use faer::{Mat, MatRef, c64};
use rayon::prelude::*;
use rustfft::FftPlanner;
use std::ops::Range;

/// Lines of a record that are summed together: sums over parts in their order do not depend on the number of threads.
const PART: usize = 8192;

/// Least lines on each side of a disturbance that do not count: those into which it leaks where its amplitude is not that of a whole record.
const LEAST_MASKED: f64 = 3.0;

/// A band around a disturbance whose lines do not count, and the sidebands of the disturbance beside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask {
    /// Its middle, share of the sample rate.
    pub(crate) middle: f64,
    /// Half of its width.
    pub(crate) half: f64,
    /// Distance from the middle at which the sidebands have the power of the noise; 0 where there are none.
    pub(crate) skirt: f64,
}

impl Mask {
    /// Power of noise and sidebands over that of the noise. A phase that walks at random has sidebands that fall with the square of the distance.
    pub(crate) fn power(&self, turns: f64) -> f64 {
        1.0 + (self.skirt / (turns - self.middle)).powi(2)
    }
}

/// The parts of a record of so many lines.
pub(crate) fn parts(lines: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    (0..lines.div_ceil(PART)).into_par_iter().map(move |k| k * PART..((k + 1) * PART).min(lines))
}

/// The lines of one record, from the first above zero to the Nyquist frequency.
#[derive(Debug, Clone)]
pub(crate) struct Lines {
    /// Number of samples N.
    pub(crate) samples: usize,
    /// exp(2 pi i k / N).
    pub(crate) z: Vec<c64>,
    /// Root of the number of lines of the full circle for which the line stands: sqrt 2, or 1 at the Nyquist frequency.
    pub(crate) weight: Vec<f64>,
    /// The square of the weight, or the share of a row in the squares of the weights of its group of lines.
    pub(crate) share: Vec<f64>,
    /// What multiplies the share of the ends: 1, or that of a row of a group of lines.
    pub(crate) ends: Vec<c64>,
    /// Input, lines x m, row by row, scaled by 1 / sqrt(N).
    pub(crate) u: Vec<c64>,
    /// Output, lines x p, row by row.
    pub(crate) y: Vec<c64>,
}

impl Lines {
    /// None of a record of so many samples.
    pub(crate) fn new(samples: usize) -> Self {
        Lines {
            samples,
            z: Vec::new(),
            weight: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            u: Vec::new(),
            y: Vec::new(),
        }
    }

    /// Appends a line of others with the same channels.
    pub(crate) fn push(&mut self, from: &Lines, k: usize) {
        let of = |all: &[c64]| {
            let channels = all.len() / from.z.len();
            all[k * channels..(k + 1) * channels].to_vec()
        };
        self.z.push(from.z[k]);
        self.weight.push(from.weight[k]);
        self.share.push(from.share[k]);
        self.ends.push(from.ends[k]);
        self.u.extend(of(&from.u));
        self.y.extend(of(&from.y));
    }
}

/// The lines of all records, channels divided by their sizes.
#[derive(Debug, Clone)]
pub(crate) struct Spectra {
    /// Inputs m.
    pub(crate) inputs: usize,
    /// Outputs p.
    pub(crate) outputs: usize,
    /// Whether a loop may hold the outputs, so that the inputs depend on their noise.
    pub(crate) held: bool,
    /// Samples by which each input is delayed.
    pub(crate) delays: Vec<usize>,
    /// Each record.
    pub(crate) records: Vec<Lines>,
}

impl Spectra {
    /// Transforms records whose input j is delayed by `delays[j]` samples; the first `skip` samples of each record serve as the
    /// past of the delayed inputs, `skip >= max(delays)`.
    pub(crate) fn new(experiments: &[Experiment<'_>], sizes: &Sizes, delays: &[usize], skip: usize) -> Self {
        let (m, p) = (sizes.u.len(), sizes.y.len());
        let mut planner = FftPlanner::new();
        let records = experiments.iter().filter(|e| long_enough(e.u.nrows(), skip)).map(|e| {
            let samples = e.u.nrows() - skip;
            let fft = planner.plan_fft_forward(samples);
            let count = samples / 2;
            let signal = |j: usize, t: usize| match j.checked_sub(m) {
                None => e.u[(t + skip - delays[j], j)] / sizes.u[j],
                Some(i) => e.y[(t + skip, i)] / sizes.y[i],
            };
            let mut lines = Lines {
                samples,
                z: (1..=count).map(|k| c64::cis(std::f64::consts::TAU * k as f64 / samples as f64)).collect(),
                weight: (1..=count).map(|k| if 2 * k == samples { 1.0 } else { 2.0_f64.sqrt() }).collect(),
                share: (1..=count).map(|k| if 2 * k == samples { 1.0 } else { 2.0 }).collect(),
                ends: vec![c64::ONE; count],
                u: vec![c64::ZERO; count * m],
                y: vec![c64::ZERO; count * p],
            };
            // Two real signals to a transform.
            let half = 0.5 / (samples as f64).sqrt();
            for j in (0..m + p).step_by(2) {
                let second = |t: usize| if j + 1 < m + p { signal(j + 1, t) } else { 0.0 };
                let mut work: Vec<c64> = (0..samples).map(|t| c64::new(signal(j, t), second(t))).collect();
                fft.process(&mut work);
                let mut put = |j: usize, k: usize, value: c64| match j.checked_sub(m) {
                    None => lines.u[(k - 1) * m + j] = value,
                    Some(i) if i < p => lines.y[(k - 1) * p + i] = value,
                    Some(_) => {}
                };
                for k in 1..=count {
                    let [first, second] = of_two_real(&work, k, half);
                    put(j, k, first);
                    put(j + 1, k, second);
                }
            }
            lines
        });
        Spectra { inputs: m, outputs: p, held: true, delays: delays.to_vec(), records: records.collect() }
    }

    /// Without the lines in some bands, and with lines beside them that are divided by what the sidebands add to their noise.
    pub(crate) fn masked(mut self, masks: &[Mask]) -> Self {
        let (m, p) = (self.inputs, self.outputs);
        for lines in &mut self.records {
            let samples = lines.samples as f64;
            let sidebands: Vec<&Mask> = masks.iter().filter(|mask| mask.skirt > 0.0).collect();
            for k in (0..lines.z.len()).take_while(|_| !sidebands.is_empty()) {
                let turns = (k + 1) as f64 / samples;
                let power = 1.0 + sidebands.iter().map(|mask| mask.power(turns) - 1.0).sum::<f64>();
                let scale = 1.0 / power.sqrt();
                lines.u[k * m..(k + 1) * m].iter_mut().for_each(|u| *u *= scale);
                lines.y[k * p..(k + 1) * p].iter_mut().for_each(|y| *y *= scale);
                lines.ends[k] *= scale;
            }
            for mask in masks {
                let (at, half) = (mask.middle * samples, (mask.half * samples).max(LEAST_MASKED));
                // The first line is that above zero.
                let place = |line: f64| (line.max(1.0) as usize - 1).min(lines.weight.len());
                let (first, end) = (place((at - half).ceil()), place((at + half).floor() + 1.0));
                lines.weight[first..end].fill(0.0);
                lines.share[first..end].fill(0.0);
            }
        }
        self
    }

    /// Every k-th line, for comparisons of starts.
    pub(crate) fn thinned(&self, every: usize) -> Self {
        let of = |lines: &Lines| {
            let mut out = Lines::new(lines.samples / every);
            (0..lines.z.len()).step_by(every).for_each(|k| out.push(lines, k));
            out
        };
        Spectra { records: self.records.iter().map(of).collect(), delays: self.delays.clone(), ..*self }
    }

    /// Every how many lines leave about `count`, at least every third.
    pub(crate) fn every(&self, count: usize) -> usize {
        (self.samples() / 2).div_ceil(count).max(3)
    }

    /// Number of lines of all records.
    pub(crate) fn lines(&self) -> usize {
        self.records.iter().map(|r| r.z.len()).sum()
    }

    /// Number of samples of all records.
    pub(crate) fn samples(&self) -> usize {
        self.records.iter().map(|r| r.samples).sum()
    }
}

/// Whether a record has lines behind its first `skip` samples.
pub(crate) fn long_enough(rows: usize, skip: usize) -> bool {
    rows > skip + 8
}

/// Lines of further signals, samples x channels, without their first `skip` samples.
pub(crate) fn lines_of(signal: MatRef<'_, f64>, skip: usize) -> Vec<c64> {
    let (samples, q) = (signal.nrows().saturating_sub(skip), signal.ncols());
    let count = samples / 2;
    let mut out = vec![c64::ZERO; count * q];
    if samples < 2 {
        return out;
    }
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let root = (samples as f64).sqrt();
    for j in 0..q {
        let mut work: Vec<c64> = (0..samples).map(|t| c64::new(signal[(t + skip, j)] / root, 0.0)).collect();
        fft.process(&mut work);
        (0..count).for_each(|k| out[k * q + j] = work[k + 1]);
    }
    out
}

/// Sizes of the channels, by which they are divided.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Sizes {
    /// Of the inputs.
    pub(crate) u: Vec<f64>,
    /// Of the outputs.
    pub(crate) y: Vec<f64>,
}

impl Sizes {
    /// Standard deviations over all records, 1 for a channel that is constant.
    pub(crate) fn of(experiments: &[Experiment<'_>]) -> Self {
        let size = |pick: &dyn Fn(&Experiment<'_>) -> Mat<f64>, channels: usize| {
            let parts: Vec<Mat<f64>> = experiments.iter().map(pick).collect();
            let spread = |j: usize| {
                let (mut sum, mut count) = (0.0, 0);
                for part in &parts {
                    let mean = part.col(j).iter().sum::<f64>() / part.nrows().max(1) as f64;
                    sum += part.col(j).iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
                    count += part.nrows();
                }
                let deviation = (sum / count.max(1) as f64).sqrt();
                if deviation > 0.0 && deviation.is_finite() { deviation } else { 1.0 }
            };
            (0..channels).map(spread).collect::<Vec<f64>>()
        };
        let first = experiments.first();
        Sizes {
            u: size(&|e| e.u.to_owned(), first.map_or(0, |e| e.u.ncols())),
            y: size(&|e| e.y.to_owned(), first.map_or(0, |e| e.y.ncols())),
        }
    }
}
