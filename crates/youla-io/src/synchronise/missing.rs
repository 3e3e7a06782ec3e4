//! Missing samples as their conditional mean, given all channels in the rows around them.
//!
//! With the covariance C of the channels over a window of 2 w + 1 rows, known entries o and missing entries m,
//! ```text
//! E(x_m | x_o) = C_mo C_oo^-1 x_o
//! ```
//! (Little and Rubin, Statistical analysis with missing data, chapter 11). C is taken from the windows that lack nothing. The error of the
//! mean is not correlated with what it was made from, so that a filled input does not bias a model as a noisy one would; while it is small,
//! it acts as noise. Under feedback an input follows from outputs, references and excitation, and its error is small.

use super::StampedChannel;
use faer::Side;
use faer::linalg::solvers::Solve;
use std::collections::HashMap;
use youla::Mat;

/// Half widths of the window, from the widest.
const HALF_WIDTHS: [usize; 5] = [10, 7, 5, 3, 2];
/// Most entries of a window, but for the narrowest one.
const MOST_ENTRIES: usize = 160;
/// Most operations of the solutions, entries cubed for each row that lacks something: some ten seconds.
const MOST_OPERATIONS: f64 = 1e11;
/// Least complete windows for each entry of one.
const WINDOWS_PER_ENTRY: usize = 4;
/// Most windows of which a covariance is taken.
const MOST_WINDOWS: usize = 20_000;
/// Windows on which the error is measured: every fifth of the complete ones, at most this many.
const TRIALS: usize = 1000;
/// Added to the variances, as a share of them: an input is a linear function of other entries where nothing disturbs it.
const RIDGE: f64 = 1e-9;
/// Largest power of the filled errors as a share of that of the channel. Of 25 simulated loops whose rows were dropped in runs of one to three,
/// the stated deviations held up to 0.8 %; at 2.8 % one model was off by 3.5 of them.
const LARGEST_POWER: f64 = 0.01;

/// Fills the missing entries of the parts; number of entries and error as a share of the size of each channel.
pub(super) fn fill(
    channels: &[StampedChannel],
    columns: &mut [Vec<f64>],
    parts: &[(usize, usize)],
) -> Result<Vec<(usize, f64)>, String> {
    let count = |c: &Vec<f64>| parts.iter().map(|&(from, to)| c[from..to].iter().filter(|v| v.is_nan()).count()).sum();
    let missing: Vec<usize> = columns.iter().map(count).collect();
    if missing.iter().all(|n| *n == 0) {
        return Ok(vec![(0, 0.0); columns.len()]);
    }
    let rows: usize = parts.iter().map(|(from, to)| to - from).sum();
    let windows = Windows::new(columns, parts, missing.iter().sum()).ok_or_else(|| {
        let (n, c) = missing.iter().zip(channels).max_by_key(|(n, _)| **n).map_or((0, ""), |(n, c)| (*n, &c.channel.name));
        format!(
            "too few rows in a row are complete to fill what is missing (channel {c:?} lacks {n} of {rows} samples); log fewer channels, \
             or at a rate that the logger keeps"
        )
    })?;
    let patterns = windows.patterns(columns, parts);
    let mut solved = Solved::new();
    for (_, at, mask) in &patterns {
        if !solved.contains_key(&(*at, mask.as_slice())) {
            let weights =
                windows.weights(mask, *at).ok_or("the covariance of the channels is singular; log it again")?;
            solved.insert((*at, mask), weights);
        }
    }
    let errors = windows.errors(columns, &patterns, &solved);
    for (c, (error, n)) in errors.iter().zip(&missing).enumerate() {
        let power = error * error * *n as f64 / rows as f64;
        if power > LARGEST_POWER {
            return Err(format!(
                "channel {:?} lacks {n} of {rows} samples, and what the rows around them say of one is wrong by {:.0} % of the size of the \
                 channel: their power would be {:.1} % of its own, at most {:.0} % are taken; log at a rate that the logger keeps",
                channels[c].channel.name,
                100.0 * error,
                100.0 * power,
                100.0 * LARGEST_POWER
            ));
        }
    }
    let found: Vec<Vec<(usize, f64)>> = patterns
        .iter()
        .map(|(row, at, mask)| windows.estimate(columns, (*row, *at), mask, &solved[&(*at, mask.as_slice())]))
        .collect();
    for ((row, ..), entries) in patterns.iter().zip(found) {
        entries.into_iter().for_each(|(c, value)| columns[c][*row] = value);
    }
    Ok(missing.into_iter().zip(errors).collect())
}

/// A row with missing entries, the row of its window in which it lies, and the entries of the window that are known.
type Pattern = (usize, usize, Vec<bool>);

/// Weights by the row of the window that is estimated, and what of the window is known.
type Solved<'a> = HashMap<(usize, &'a [bool]), Mat<f64>>;

/// Windows of 2 w + 1 rows; entry (row, channel) is number row * channels + channel.
struct Windows {
    half: usize,
    channels: usize,
    /// First rows of complete windows on which the error is measured.
    trials: Vec<usize>,
    means: Vec<f64>,
    sizes: Vec<f64>,
    /// Of entries of unit size.
    covariance: Mat<f64>,
}

impl Windows {
    /// The widest that the complete rows determine, for so many missing entries.
    fn new(columns: &[Vec<f64>], parts: &[(usize, usize)], missing: usize) -> Option<Windows> {
        let channels = columns.len();
        let narrowest = HALF_WIDTHS[HALF_WIDTHS.len() - 1];
        let (half, complete) = HALF_WIDTHS.into_iter().find_map(|half| {
            let entries = channels * (2 * half + 1);
            let complete = complete(columns, parts, 2 * half + 1);
            let operations = missing as f64 * (entries as f64).powi(3);
            let fits = entries <= MOST_ENTRIES && operations <= MOST_OPERATIONS || half == narrowest;
            (fits && complete.len() >= WINDOWS_PER_ENTRY * entries).then_some((half, complete))
        })?;
        let (mut trials, mut taken) = (Vec::new(), Vec::new());
        complete.iter().enumerate().for_each(|(k, at)| if k % 5 == 4 { trials.push(*at) } else { taken.push(*at) });
        let thin = |all: Vec<usize>, most: usize| -> Vec<usize> {
            let step = all.len().div_ceil(most);
            all.into_iter().step_by(step.max(1)).collect()
        };
        let (trials, taken) = (thin(trials, TRIALS), thin(taken, MOST_WINDOWS));
        let moments = |c: &Vec<f64>| {
            let known = || parts.iter().flat_map(|&(from, to)| &c[from..to]).filter(|v| !v.is_nan());
            let n = known().count() as f64;
            let mean = known().sum::<f64>() / n;
            (mean, (known().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
        };
        let (means, sizes): (Vec<f64>, Vec<f64>) = columns.iter().map(moments).unzip();
        let mut windows = Windows { half, channels, trials, means, sizes, covariance: Mat::zeros(0, 0) };
        let samples = Mat::from_fn(taken.len(), windows.entries(), |k, e| windows.entry(columns, taken[k], e));
        windows.covariance = samples.transpose() * &samples * faer::Scale(1.0 / taken.len() as f64);
        Some(windows)
    }

    fn entries(&self) -> usize {
        self.channels * (2 * self.half + 1)
    }

    /// Entry `e` of the window that begins at `first`, of unit size.
    fn entry(&self, columns: &[Vec<f64>], first: usize, e: usize) -> f64 {
        let (row, c) = (e / self.channels, e % self.channels);
        if self.sizes[c] > 0.0 { (columns[c][first + row] - self.means[c]) / self.sizes[c] } else { 0.0 }
    }

    /// The rows that lack an entry; at the ends of a part the window lies on one side of the row.
    fn patterns(&self, columns: &[Vec<f64>], parts: &[(usize, usize)]) -> Vec<Pattern> {
        let mut found = Vec::new();
        for &(from, to) in parts {
            for row in (from..to).filter(|&row| columns.iter().any(|c| c[row].is_nan())) {
                let first = row.saturating_sub(self.half).clamp(from, to - 2 * self.half - 1);
                let known = |e: usize| !columns[e % self.channels][first + e / self.channels].is_nan();
                found.push((row, row - first, (0..self.entries()).map(known).collect()));
            }
        }
        found
    }

    /// Entries of row `at` of the window that are not known.
    fn absent<'a>(&self, known: &'a [bool], at: usize) -> impl Iterator<Item = usize> + use<'a> {
        (at * self.channels..(at + 1) * self.channels).filter(|e| !known[*e])
    }

    /// Weights of the known entries, one column for each entry of row `at` that is not known.
    fn weights(&self, known: &[bool], at: usize) -> Option<Mat<f64>> {
        let there: Vec<usize> = (0..known.len()).filter(|e| known[*e]).collect();
        let absent: Vec<usize> = self.absent(known, at).collect();
        let ridge = |i: usize, j: usize| if i == j { RIDGE } else { 0.0 };
        let own = Mat::from_fn(there.len(), there.len(), |i, j| self.covariance[(there[i], there[j])] + ridge(i, j));
        let cross = Mat::from_fn(there.len(), absent.len(), |i, j| self.covariance[(there[i], absent[j])]);
        Some(own.llt(Side::Lower).ok()?.solve(cross))
    }

    /// The estimates of the missing channels of a row, in units of the channels.
    fn estimate(
        &self,
        columns: &[Vec<f64>],
        (row, at): (usize, usize),
        known: &[bool],
        weights: &Mat<f64>,
    ) -> Vec<(usize, f64)> {
        let there = (0..known.len()).filter(|e| known[*e]);
        let values: Vec<f64> = there.map(|e| self.entry(columns, row - at, e)).collect();
        let estimate = |(k, e): (usize, usize)| {
            let c = e % self.channels;
            let mean: f64 = values.iter().zip(weights.col(k).iter()).map(|(v, w)| v * w).sum();
            (c, self.means[c] + self.sizes[c] * mean)
        };
        self.absent(known, at).enumerate().map(estimate).collect()
    }

    /// Root mean square of the error of each channel as a share of its size, on complete windows from which the patterns were taken away.
    fn errors(&self, columns: &[Vec<f64>], patterns: &[Pattern], solved: &Solved<'_>) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.channels];
        // Patterns of the whole record in turn.
        let step = (patterns.len() / self.trials.len()).max(1);
        for (k, first) in self.trials.iter().enumerate() {
            let (_, at, mask) = &patterns[k * step % patterns.len()];
            for (c, value) in self.estimate(columns, (first + at, *at), mask, &solved[&(*at, mask.as_slice())]) {
                sums[c].0 += ((value - columns[c][first + at]) / self.sizes[c].max(f64::MIN_POSITIVE)).powi(2);
                sums[c].1 += 1.0;
            }
        }
        sums.into_iter().map(|(sum, n)| if n > 0.0 { f64::sqrt(sum / n) } else { 0.0 }).collect()
    }
}

/// First rows of the windows of `width` rows that lack nothing.
fn complete(columns: &[Vec<f64>], parts: &[(usize, usize)], width: usize) -> Vec<usize> {
    let mut found = Vec::new();
    for &(from, to) in parts {
        let mut run = 0;
        for row in from..to {
            run = if columns.iter().any(|c| c[row].is_nan()) { 0 } else { run + 1 };
            if run >= width {
                found.push(row + 1 - width);
            }
        }
    }
    found
}
