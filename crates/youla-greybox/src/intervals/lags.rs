//! Signals with a past, taken in piece by piece, and sums of their products over lags: memory independent of the record.

use crate::prediction::sensitivity::PIECE;
use crate::prediction::small_qr::dot;

/// The latest piece of several signals and `lags` samples before it; zero before the start.
pub(super) struct History {
    lags: usize,
    count: usize,
    /// One column of `lags + PIECE` values per signal.
    columns: Vec<Vec<f64>>,
}

impl History {
    pub(super) fn new(signals: usize, lags: usize) -> Self {
        History { lags, count: 0, columns: vec![vec![0.0; lags + PIECE]; signals] }
    }

    /// Forgets the past, for the next experiment.
    pub(super) fn restart(&mut self) {
        self.count = 0;
        self.columns.iter_mut().for_each(|column| column.fill(0.0));
    }

    /// Takes in the next `count` samples, at most a piece; `value(signal, sample)`.
    pub(super) fn take(&mut self, count: usize, value: impl Fn(usize, usize) -> f64) {
        for (signal, column) in self.columns.iter_mut().enumerate() {
            column.copy_within(self.count..self.count + self.lags, 0);
            column[self.lags..].iter_mut().take(count).enumerate().for_each(|(k, v)| *v = value(signal, k));
        }
        self.count = count;
    }

    /// The latest piece of a signal, `lag` samples earlier.
    pub(super) fn before(&self, signal: usize, lag: usize) -> &[f64] {
        &self.columns[signal][self.lags - lag..][..self.count]
    }
}

/// `sum_t a(t) b(t - lag)` for pairs (a, b) of signals.
pub(super) struct LagSums {
    history: History,
    pairs: Vec<(usize, usize)>,
    /// For each pair, over the lags from 0 on.
    pub(super) sums: Vec<Vec<f64>>,
}

impl LagSums {
    pub(super) fn new(signals: usize, pairs: Vec<(usize, usize)>, lags: usize) -> Self {
        let sums = vec![vec![0.0; lags + 1]; pairs.len()];
        LagSums { history: History::new(signals, lags), pairs, sums }
    }

    pub(super) fn restart(&mut self) {
        self.history.restart();
    }

    pub(super) fn take(&mut self, count: usize, value: impl Fn(usize, usize) -> f64) {
        self.history.take(count, value);
        for ((a, b), sums) in self.pairs.iter().zip(&mut self.sums) {
            let now = self.history.before(*a, 0);
            sums.iter_mut().enumerate().for_each(|(lag, sum)| *sum += dot(now, self.history.before(*b, lag)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of different lengths give the sums over the whole.
    #[test]
    fn sums_over_pieces_are_those_over_the_whole() {
        let value = |signal: usize, t: usize| ((t * t + 3 * signal) as f64 * 0.61).sin();
        let mut sums = LagSums::new(2, vec![(0, 0), (0, 1), (1, 1)], 200);
        let mut first = 0;
        for count in [100, 128, 5, 128, 60] {
            sums.take(count, |signal, k| value(signal, first + k));
            first += count;
        }
        for (pair, (a, b)) in [(0, 0), (0, 1), (1, 1)].into_iter().enumerate() {
            for lag in [0, 1, 7, 130, 200] {
                let direct: f64 = (lag..first).map(|t| value(a, t) * value(b, t - lag)).sum();
                assert!((sums.sums[pair][lag] - direct).abs() < 1e-10, "{pair} {lag}");
            }
        }
        sums.restart();
        sums.take(1, |_, _| 1.0);
        let before = sums.sums[0].clone();
        sums.take(1, |_, _| 1.0);
        assert_eq!(sums.sums[0][1] - before[1], 1.0);
        assert_eq!(sums.sums[0][2] - before[2], 0.0);
    }
}
