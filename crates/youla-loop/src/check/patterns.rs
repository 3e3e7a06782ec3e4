//! Patterns of wrong samples, of a jump and of a burst in the innovation of one output.

use super::options::CheckOptions;
use super::outliers::Outliers;
use youla::Mat;
use youla::linalg::least_squares;
use youla::statistics::{quantile, robust_deviation};

/// Share of the energy of the innovation around a wrong sample that it must make.
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const EXPLAINED: f64 = 0.8;
/// Magnitudes in the tail of an innovation with which a candidate is compared.
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const TAIL: f64 = 0.995;

/// Least size of a wrong sample, in deviations of the output. A converter of 12 bits over a range of 8 deviations has steps of 2e-3, and half
/// of one is rounding. In a log with less noise the innovation is what the regression cannot follow, which has no distribution to test against.
const ROUNDING: f64 = 1e-3;
/// The same in the first samples, where a state from before the record still acts, which a regression of finite length cannot follow: a
/// tank with a dead time leaves 8e-3.
const AT_THE_START: f64 = 0.03;
/// Most wrong samples in a row that are told from a burst.
/// Chosen, not measured.
const IN_A_ROW: usize = 3;
/// A wrong sample that explains this share of what a shock does is taken for one: where the output is nearly white, both look alike.
/// Chosen; a shock of a second-order process leaves a wrong sample 27 %.
const ALIKE: f64 = 0.8;
/// Least size of a wrong sample in a row against the largest: less is what the regression misses of its neighbour.
/// Chosen, not measured.
const LEAST_OF_A_ROW: f64 = 0.1;
/// Places that are looked at.
/// Chosen, not measured.
const PLACES: usize = 100;
/// Great innovations of a burst, and their root mean square in deviations of the output, at least.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const BURST: usize = 8;
const BURST_SIZE: f64 = 0.03;

/// The innovation of one output in which wrong samples are looked for.
pub(super) struct Search<'a> {
    e: Vec<f64>,
    a: &'a [f64],
    /// Pattern of a jump.
    sums: Vec<f64>,
    length: f64,
    /// Robust deviation of the innovation.
    sigma: f64,
}

/// Samples from the first one with their sizes, or the jump there.
struct Explanation {
    sizes: Vec<f64>,
    jump: bool,
    /// What the plant felt: nothing is wrong with the samples.
    shock: bool,
    energy: f64,
}

impl<'a> Search<'a> {
    pub(super) fn new(e: Vec<f64>, a: &'a [f64]) -> Self {
        let mut sum = 0.0;
        let all = a.iter().copied().chain(std::iter::repeat_n(0.0, 2 * a.len()));
        let added = |a: f64| {
            sum += a;
            sum
        };
        let sums = all.map(added).collect();
        let length = a.iter().map(|v| v * v).sum::<f64>().sqrt();
        let sigma = robust_deviation(e.iter().copied());
        Search { e, a, sums, length, sigma }
    }

    fn at(&self, k: usize) -> f64 {
        self.e.get(k).copied().unwrap_or(0.0)
    }

    fn lambda(&self, k: usize) -> f64 {
        self.a.iter().enumerate().map(|(j, a)| a * self.at(k + j)).sum::<f64>() / self.length
    }

    /// What is wrong; samples are counted from the first innovation, sizes in deviations of the output.
    pub(super) fn wrong(mut self, options: &CheckOptions) -> Outliers {
        let mut lambda: Vec<f64> = (0..self.e.len()).map(|k| self.lambda(k)).collect();
        let mut sorted: Vec<f64> = lambda.iter().map(|v| v.abs()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let sigma = robust_deviation(lambda.iter().copied());
        let least = (options.outlier * sigma).max(2.0 * quantile(&sorted, TAIL)).max(ROUNDING * self.length);
        let total: f64 = self.e.iter().map(|v| v * v).sum();
        let (mut found, mut taken, mut rest) = (Vec::new(), 0.0, Vec::new());
        let (mut jump, reach) = (None, self.a.len());
        let start = lambda.iter_mut().take(2 * reach);
        start.filter(|l| l.abs() < AT_THE_START * self.length).for_each(|l| *l = 0.0);
        for _ in 0..PLACES {
            let Some((k, l)) = lambda.iter().copied().enumerate().max_by(|x, y| x.1.abs().total_cmp(&y.1.abs())) else {
                break;
            };
            if l.abs() <= least || least <= 0.0 {
                break;
            }
            let first = k.saturating_sub(IN_A_ROW - 1);
            let best = (first..=k + 1).flat_map(|k| self.explanations(k).into_iter().map(move |why| (k, why)));
            let window: f64 = (first..first + self.sums.len()).map(|i| self.at(i) * self.at(i)).sum();
            // What is left, four times as much for each further number and for a jump, which is rare; a quarter more for a shock, which one wrong
            // sample resembles where the output is nearly white.
            let weight = |why: &Explanation| match why {
                why if why.shock => 5.0,
                why => 4f64.powi(why.sizes.len() as i32 + i32::from(why.jump)),
            };
            let score = |why: &Explanation| (window - why.energy).max(0.0) * weight(why);
            match best.min_by(|a, b| score(&a.1).total_cmp(&score(&b.1))) {
                Some((k, why)) if !why.shock => {
                    taken += why.energy;
                    self.subtract(k, &why);
                    match why.jump {
                        true => jump = jump.or(Some((k, why.sizes[0]))),
                        false => found.extend(why.sizes.iter().enumerate().map(|(j, w)| (k + j, *w))),
                    }
                    let last = (k + self.sums.len()).min(lambda.len());
                    (k.saturating_sub(reach)..last).for_each(|i| lambda[i] = self.lambda(i));
                    // What is left of a place is not looked at again.
                    let near = (k + reach).min(lambda.len());
                    lambda[k.saturating_sub(IN_A_ROW)..near].fill(0.0);
                }
                _ => {
                    rest.push(k);
                    let last = (k + reach).min(lambda.len());
                    lambda[k.saturating_sub(reach)..last].fill(0.0);
                }
            }
        }
        found.sort_unstable_by_key(|(k, _)| *k);
        let share = if total > 0.0 { (taken / total).min(1.0) } else { 0.0 };
        let (samples, sizes) = found.into_iter().unzip();
        Outliers { samples, sizes, share, jump, burst: self.burst(&rest) }
    }

    /// What explains the innovation from sample k on.
    fn explanations(&self, k: usize) -> Vec<Explanation> {
        let around = |length: usize| {
            let energy: f64 = (k..k + length).map(|i| self.at(i) * self.at(i)).sum();
            (energy - length as f64 * self.sigma * self.sigma).max(0.0)
        };
        let size: f64 = self.sums.iter().map(|s| s * s).sum();
        let along: f64 = self.sums.iter().enumerate().map(|(j, s)| s * self.at(k + j)).sum();
        let jump = Explanation { sizes: vec![along / size], jump: true, shock: false, energy: along * along / size };
        let felt = self.at(k);
        let shock = Explanation { sizes: vec![felt], jump: false, shock: true, energy: felt * felt };
        let samples = (1..=IN_A_ROW).filter_map(|count| self.samples(k, count));
        let enough = |why: &Explanation| {
            let rows = if why.jump { self.sums.len() } else { self.a.len() + why.sizes.len() - 1 };
            // The first innovation of a jump is the jump; slow residuals of what the regression lacks have none.
            if why.jump && (self.at(k) - why.sizes[0]).abs() > 0.5 * why.sizes[0].abs() {
                return false;
            }
            let largest = why.sizes.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            let each = why.sizes.iter().all(|s| s.abs() > LEAST_OF_A_ROW * largest);
            each && why.energy > 0.0 && why.energy > EXPLAINED * around(rows)
        };
        let mut found: Vec<Explanation> = samples.chain([jump]).filter(enough).collect();
        let single = found.iter().find(|why| !why.jump && why.sizes.len() == 1);
        if single.is_none_or(|why| why.energy < ALIKE * shock.energy) {
            found.push(shock);
        }
        found
    }

    /// Sizes of so many wrong samples from k on, by least squares.
    fn samples(&self, k: usize, count: usize) -> Option<Explanation> {
        let rows = self.a.len() + count - 1;
        let a = |i: usize| self.a.get(i).copied().unwrap_or(0.0);
        let pattern = Mat::from_fn(rows, count, |i, j| if i >= j { a(i - j) } else { 0.0 });
        let e = Mat::from_fn(rows, 1, |i, _| self.at(k + i));
        let sizes = least_squares("the sizes of wrong samples", pattern.as_ref(), e.as_ref()).ok()?.x;
        let energy = (&pattern * &sizes).squared_norm_l2();
        Some(Explanation { sizes: sizes.col(0).iter().copied().collect(), jump: false, shock: false, energy })
    }

    fn subtract(&mut self, k: usize, why: &Explanation) {
        let pattern = if why.jump { &self.sums[..] } else { self.a };
        for (first, w) in why.sizes.iter().enumerate() {
            for (j, s) in pattern.iter().enumerate() {
                if let Some(e) = self.e.get_mut(k + first + j) {
                    *e -= w * s;
                }
            }
        }
    }

    /// The stretch of great innovations around the first place that nothing explains.
    fn burst(&self, places: &[usize]) -> Option<[usize; 2]> {
        let great = |k: usize| self.at(k).abs() > GREAT * self.sigma;
        let (mut first, reach) = (*places.first()?, self.a.len());
        let mut last = first;
        while let Some(k) = (first.saturating_sub(reach)..first).find(|k| great(*k)) {
            first = k;
        }
        while let Some(k) = (last + 1..=last + reach).rev().find(|k| great(*k)) {
            last = k;
        }
        let count = (first..=last).filter(|k| great(*k)).count();
        let energy: f64 = (first..=last).map(|k| self.at(k) * self.at(k)).sum();
        let size = (energy / (last - first + 1) as f64).sqrt() / self.length;
        let short = last - first < self.e.len() / 10;
        (short && count >= BURST && size > BURST_SIZE).then_some([first, last])
    }
}

/// Deviations of a great innovation.
/// Chosen; no false alarm in the clean logs of `docs/check.md`.
const GREAT: f64 = 8.0;
