//! A disturbance at one frequency in what a model leaves of a record: its frequency, amplitudes and sidebands.

use crate::identify::likelihood::choose::problem::{Choice, Problem};
use crate::identify::likelihood::data::spectra::{Mask, Spectra};
use crate::linalg::{TINY, golden_section};
use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, c64};
use rustfft::FftPlanner;
use std::convert::Infallible;
use std::f64::consts::{PI, TAU};

/// Largest half width of the band that does not count, over its middle.
pub(super) const WIDEST: f64 = 0.25;
/// Half bands of a disturbance within which a mode may stand for its sidebands.
const SIDEBANDS: f64 = 2.0;
/// Lines beside the band that does not count from which the amplitudes are estimated, for each slow change: ten equations for each unknown.
const AROUND: f64 = 5.0;
/// Part of a line within which its frequency is found.
const WITHIN: f64 = 1e-6;
/// Sweeps over the disturbances, which are nearly orthogonal.
const SWEEPS: usize = 2;
/// Half bands within which sidebands are sought, sizes that are tried, each twice the last, and the gain of the likelihood that shows them.
const SKIRT_REACH: f64 = 20.0;
const SKIRTS: i32 = 6;
const SKIRT_NATS: f64 = 5.0;
/// Samples of a record for each slow change at least.
const SAMPLES_PER_CHANGE: usize = 8;

/// A disturbance at one frequency.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    /// Its frequency, and half of the band that does not count.
    pub(super) mask: Mask,
    /// Slow changes of its amplitudes.
    pub(super) changes: usize,
}

impl Line {
    /// Whether a frequency is that of its sidebands.
    pub(super) fn near(&self, turns: f64) -> bool {
        (self.mask.middle - turns).abs() < SIDEBANDS * self.mask.half
    }
}

/// Lines with the sidebands that are in what a model of the records without them leaves.
pub(super) fn with_sidebands(lines: &[Line], problem: &Problem<'_>, choice: &Choice) -> Vec<Line> {
    let bare = Problem { masked: Vec::new(), ..problem.clone() };
    let spectra = bare.spectra(&choice.delays);
    let residuals = choice.found.point.residuals(&spectra);
    let of = |line: &Line| {
        let skirt = skirt(&residuals, &spectra, &line.mask);
        Line { mask: Mask { skirt, ..line.mask }, ..*line }
    };
    lines.iter().map(of).collect()
}

/// Distance from a line of a disturbance at which its sidebands have the power of the noise, of the output where it is the largest, by
/// Whittle's likelihood of the lines beside the band that does not count; 0 where they are not told from none.
fn skirt(residuals: &[Vec<c64>], spectra: &Spectra, mask: &Mask) -> f64 {
    let reach = (SKIRT_REACH * mask.half).min(WIDEST * mask.middle);
    let p = spectra.outputs;
    let of = |i: usize| {
        let mut beside: Vec<(f64, f64)> = Vec::new();
        for (v, lines) in residuals.iter().zip(&spectra.records) {
            let place = |turns: f64| (turns * lines.samples as f64).clamp(1.0, lines.z.len() as f64) as usize - 1;
            for k in place(mask.middle - reach)..place(mask.middle + reach) {
                let turns = (k + 1) as f64 / lines.samples as f64;
                if (turns - mask.middle).abs() > mask.half {
                    beside.push((turns, v[k * p + i].norm_sqr()));
                }
            }
        }
        let cost = |skirt: f64| {
            let mask = Mask { skirt, ..*mask };
            let (mut level, mut logs) = (0.0, 0.0);
            for (turns, power) in &beside {
                level += power / mask.power(*turns);
                logs += mask.power(*turns).ln();
            }
            beside.len() as f64 * (level / beside.len().max(1) as f64).ln() + logs
        };
        let none = cost(0.0);
        let best = (0..SKIRTS).map(|j| 0.5 * mask.half * f64::from(j).exp2()).map(|s| (cost(s), s));
        let (least, found) = best.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((none, 0.0));
        if least < none - SKIRT_NATS { found } else { 0.0 }
    };
    (0..p).map(of).fold(0.0, f64::max)
}

/// The transform of the residual of the last samples of a record: lines from the first x channels.
pub(super) struct Residual {
    pub(super) lines: Mat<c64>,
    pub(super) samples: usize,
}

/// The frequency around a given one at which a cosine and a sine explain most of some residuals, by golden section within half a line of the
/// longest record: a mode that stands for a line has its frequency but for a few hundredths of a line.
pub(super) fn sharpened(residuals: &[Option<Residual>], turns: f64, longest: f64) -> f64 {
    let explained = |turns: f64| residuals.iter().flatten().map(|r| r.explained(turns)).sum::<f64>();
    let half = 0.5 / longest;
    let less = |turns: f64| Ok::<_, Infallible>(-explained(turns));
    let Ok((_, found)) = golden_section([turns - half, turns + half], WITHIN / longest, less);
    found
}

impl Residual {
    /// Square of what a cosine and a sine explain of the lines around them. Their transforms are sums of a geometric series.
    fn explained(&self, turns: f64) -> f64 {
        let samples = self.samples as f64;
        let series = |x: f64| match c64::ONE - c64::cis(TAU * x) {
            step if step.norm() > TINY => (c64::ONE - c64::cis(TAU * (x * samples).fract())) / step,
            _ => c64::new(samples, 0.0),
        };
        let middle = turns * samples - 1.0;
        let from = (middle - AROUND).max(0.0) as usize;
        let end = ((middle + AROUND) as usize + 1).min(self.lines.nrows());
        let p = self.lines.ncols();
        let (mut gram, mut products) = ([0.0; 3], vec![[0.0; 2]; p]);
        for k in from..end {
            let at = (k + 1) as f64 / samples;
            let [sum, other] = [series(turns - at), series(-turns - at)];
            let (cos, sin) = (sum + other, (sum - other) * c64::new(0.0, -1.0));
            let real = |a: c64, b: c64| a.re * b.re + a.im * b.im;
            gram[0] += real(cos, cos);
            gram[1] += real(cos, sin);
            gram[2] += real(sin, sin);
            for (i, product) in products.iter_mut().enumerate() {
                product[0] += real(cos, self.lines[(k, i)]);
                product[1] += real(sin, self.lines[(k, i)]);
            }
        }
        let determinant = (gram[0] * gram[2] - gram[1] * gram[1]).max(TINY);
        let of = |[c, s]: &[f64; 2]| (gram[2] * c * c - 2.0 * gram[1] * c * s + gram[0] * s * s) / determinant;
        products.iter().map(of).sum()
    }
}

/// Disturbances over all rows of a record.
pub(super) fn disturbance(residual: &Residual, rows: usize, taken: &[Line]) -> Mat<f64> {
    of_amplitudes(rows, taken, &amplitudes(residual, rows, taken))
}

/// Cosine and sine of a line over the rows of a record, each with its slow changes.
fn shapes(line: &Line, rows: usize, changes: usize) -> Mat<f64> {
    Mat::from_fn(rows, 2 * changes, |t, c| {
        let (sin, cos) = (TAU * (line.mask.middle * t as f64).fract()).sin_cos();
        let slow = (PI * (c / 2 * t) as f64 / rows as f64).cos();
        slow * if c % 2 == 0 { cos } else { sin }
    })
}

/// Disturbances of given amplitudes over the rows of a record.
pub(super) fn of_amplitudes(rows: usize, taken: &[Line], amplitudes: &[Mat<f64>]) -> Mat<f64> {
    let channels = amplitudes.first().map_or(0, Mat::ncols);
    let add = |sum, (line, a): (&Line, &Mat<f64>)| sum + shapes(line, rows, a.nrows() / 2) * a;
    taken.iter().zip(amplitudes).fold(Mat::zeros(rows, channels), add)
}

/// Amplitudes of each disturbance, two for each slow change, by channel: those of least squares on the lines around it, where the noise is
/// that of its frequency. A drift has thousands of times the power of the noise there.
pub(super) fn amplitudes(residual: &Residual, rows: usize, taken: &[Line]) -> Vec<Mat<f64>> {
    let Residual { lines, samples } = residual;
    let fft = FftPlanner::new().plan_fft_forward(*samples);
    // A short record determines no more.
    let changes = |line: &Line| line.changes.min(samples / SAMPLES_PER_CHANGE).max(1);
    let mut found: Vec<Mat<f64>> = taken.iter().map(|line| Mat::zeros(2 * changes(line), lines.ncols())).collect();
    let mut left = lines.clone();
    for (place, line) in (0..SWEEPS).flat_map(|_| taken.iter().enumerate()) {
        let (mask, changes) = (&line.mask, changes(line));
        let shapes = shapes(line, rows, changes);
        let mut transformed = Mat::<c64>::zeros(lines.nrows(), 2 * changes);
        for (to, shape) in transformed.col_iter_mut().zip(shapes.col_iter()) {
            let mut work: Vec<c64> = shape.iter().skip(rows - samples).map(|x| c64::new(*x, 0.0)).collect();
            fft.process(&mut work);
            to.iter_mut().zip(&work[1..]).for_each(|(to, x)| *to = *x);
        }
        // Row k is line k + 1.
        let (middle, half) =
            (mask.middle * *samples as f64 - 1.0, mask.half * *samples as f64 + AROUND * changes as f64);
        let from = (middle - half).max(0.0) as usize;
        let count = ((middle + half) as usize).min(lines.nrows() - 1) + 1 - from;
        let part = |of: &Mat<c64>| {
            Mat::from_fn(2 * count, of.ncols(), |r, c| {
                let x = of[(from + r % count, c)];
                if r < count { x.re } else { x.im }
            })
        };
        let amplitudes = part(&transformed).qr().solve_lstsq(part(&left));
        left -= &transformed * Mat::from_fn(2 * changes, left.ncols(), |i, j| c64::new(amplitudes[(i, j)], 0.0));
        found[place] += amplitudes;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::data::spectra::Sizes;
    use crate::identify::subspace::Experiment;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// A line of amplitude 1 between two lines of the transform, in the residual of a double integrator under a slow torque, which falls with
    /// the third power of frequency: the error of the amplitudes is that of the noise at the line.
    #[test]
    fn a_drift_does_not_spoil_the_amplitude_of_a_line() {
        let (samples, turns, size) = (4000, 67.5 / 4000.0, 0.05);
        let rng = &mut ChaCha8Rng::seed_from_u64(3);
        let line = |t: usize| (TAU * turns * t as f64 + 0.4).cos();
        let mut work: Vec<c64> = (0..samples).map(|t| c64::new(line(t), 0.0)).collect();
        FftPlanner::new().plan_fft_forward(samples).process(&mut work);
        let lines = Mat::from_fn(samples / 2, 1, |k, _| {
            let size = size * (samples as f64 / 2.0).sqrt() * (67.5 / (k as f64 + 1.0)).powi(3);
            work[k + 1] + c64::new(rng.sample(StandardNormal), rng.sample(StandardNormal)) * size
        });
        let taken = [Line { mask: Mask { middle: turns, half: 5.0 / samples as f64, skirt: 0.0 }, changes: 1 }];
        let residual = Residual { lines, samples };
        let found = disturbance(&residual, samples, &taken);
        let error = (0..samples).map(|t| (found[(t, 0)] - line(t)).powi(2)).sum::<f64>() / samples as f64;
        // Two amplitudes, each of variance 2 size^2 / N: mean square 2 size^2 / N.
        assert!(error < 4.0 * 2.0 * size * size / samples as f64, "{error}");
        // Cramer-Rao: 6 var / (pi^2 A^2 N^3) in shares of the sample rate.
        let residual = [Some(Residual { lines: residual.lines, samples })];
        let found = sharpened(&residual, turns + 0.3 / samples as f64, samples as f64);
        let deviation = (6.0 * size * size / (std::f64::consts::PI.powi(2) * (samples as f64).powi(3))).sqrt();
        assert!((found - turns).abs() < 4.0 * deviation, "{found} {turns} {deviation}");
    }

    /// Sidebands of a phase that walks at random are found beside white noise, within a factor of two, and none where there are none.
    #[test]
    fn sidebands_of_a_phase_that_walks_are_found() {
        let (samples, turns, step, size) = (8000, 0.05, 2e-3, 0.02);
        let rng = &mut ChaCha8Rng::seed_from_u64(5);
        let experiment = Mat::from_fn(samples, 1, |_, _| rng.sample::<f64, _>(StandardNormal));
        let mask = Mask { middle: turns, half: 5.0 / samples as f64, skirt: 0.0 };
        for walks in [false, true] {
            let mut phase = 0.0;
            let y = Mat::from_fn(samples, 1, |t, _| {
                phase += if walks { step * rng.sample::<f64, _>(StandardNormal) } else { 0.0 };
                (TAU * turns * t as f64 + phase).cos() + size * rng.sample::<f64, _>(StandardNormal)
            });
            let sizes = Sizes { u: vec![1.0], y: vec![1.0] };
            let spectra = Spectra::new(&[Experiment::new(experiment.as_ref(), y.as_ref())], &sizes, &[0], 0);
            let found = skirt(&[spectra.records[0].y.clone()], &spectra, &mask);
            // Power of the sidebands (step / (2 pi df))^2 / 4 per sample beside size^2.
            let expected = if walks { step / (2.0 * TAU * size) } else { 0.0 };
            assert!((0.5 * expected..=2.0 * expected).contains(&found), "{found} {expected}");
        }
    }
}
