//! Minimum and maximum per bucket: a long record with few points and the outline of the whole.
//!
//! The record is cut in buckets of equal numbers of samples. Of each bucket the smallest and the largest sample survive,
//! at their own times; so do the first and the last sample of the record and every sample of a `detail` window.

use std::ops::Range;

/// One sample that is drawn: its row in the record, and its value.
pub(super) type Point = (usize, f64);

/// Reduces `points` (rising in row) of a record of `samples` rows to two per bucket of `width` rows outside of `detail`.
///
/// Values that are not finite are left out where the bucket has finite ones, and make one gap where it has none.
pub(super) fn min_max(
    points: impl Iterator<Item = Point>,
    samples: usize,
    detail: &Range<usize>,
    width: usize,
) -> Vec<Point> {
    let mut kept = Vec::new();
    let mut bucket = Bucket::default();
    for (row, value) in points {
        if detail.contains(&row) || row == 0 || row + 1 == samples {
            bucket.close(&mut kept);
            kept.push((row, value));
        } else {
            if bucket.number != row / width {
                bucket.close(&mut kept);
                bucket.number = row / width;
            }
            bucket.add((row, value));
        }
    }
    bucket.close(&mut kept);
    kept
}

/// Bucket width with which a record keeps to `points` points, given the length of its detail window.
pub(super) fn width_for(samples: usize, detail: usize, points: usize) -> usize {
    if samples <= points {
        return 1;
    }
    // Two ends, and the two buckets that the detail window may cut in two, cost up to six points.
    let buckets = (points.saturating_sub(detail + 6) / 2).max(1);
    (samples - detail).div_ceil(buckets)
}

#[derive(Default)]
struct Bucket {
    number: usize,
    extremes: Option<(Point, Point)>,
    gap: Option<usize>,
}

impl Bucket {
    fn add(&mut self, point: Point) {
        if !point.1.is_finite() {
            self.gap.get_or_insert(point.0);
            return;
        }
        let (low, high) = self.extremes.get_or_insert((point, point));
        if point.1 < low.1 {
            *low = point;
        }
        if point.1 > high.1 {
            *high = point;
        }
    }

    fn close(&mut self, kept: &mut Vec<Point>) {
        let gap = self.gap.take();
        match self.extremes.take() {
            Some((low, high)) if low.0 == high.0 => kept.push(low),
            Some((low, high)) => kept.extend(if low.0 < high.0 { [low, high] } else { [high, low] }),
            None => kept.extend(gap.map(|row| (row, f64::NAN))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn record(samples: usize) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        (0..samples).map(|_| random.random_range(-1.0..1.0)).collect()
    }

    fn reduce(values: &[f64], detail: Range<usize>, points: usize) -> Vec<Point> {
        let width = width_for(values.len(), detail.len(), points);
        min_max(values.iter().copied().enumerate(), values.len(), &detail, width)
    }

    #[test]
    fn extremes_ends_and_detail_survive_within_the_budget() {
        for (samples, detail) in
            [(240_000, 100_000..101_200), (4001, 0..0), (9_999, 0..1_000), (50_000, 49_000..50_000)]
        {
            let mut values = record(samples);
            values[samples / 3] = 7.0;
            values[samples / 7 + 1] = -9.0;
            let kept = reduce(&values, detail.clone(), 4000);
            assert!(kept.len() <= 4000 && kept.len() > 1500, "{} points", kept.len());
            assert!(kept.contains(&(samples / 3, 7.0)) && kept.contains(&(samples / 7 + 1, -9.0)));
            assert_eq!(kept[0], (0, values[0]));
            assert_eq!(kept[kept.len() - 1], (samples - 1, values[samples - 1]));
            assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
            assert!(kept.iter().all(|&(row, value)| values[row] == value));
            assert_eq!(kept.iter().filter(|point| detail.contains(&point.0)).count(), detail.len());
        }
    }

    #[test]
    fn every_bucket_keeps_its_own_extremes() {
        let values = record(10_000);
        let width = width_for(values.len(), 0, 500);
        let kept = reduce(&values, 0..0, 500);
        for (number, bucket) in values[1..values.len() - 1].chunk_by_rows(width).enumerate() {
            let largest = bucket.iter().copied().fold(f64::MIN, f64::max);
            assert!(kept.iter().any(|&(row, value)| row / width == number && value == largest));
        }
    }

    #[test]
    fn a_short_record_is_drawn_whole() {
        let values = record(3000);
        assert_eq!(reduce(&values, 0..0, 4000), values.iter().copied().enumerate().collect::<Vec<_>>());
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let mut values = record(100_000);
        values[40_000..60_000].fill(f64::NAN);
        let kept = reduce(&values, 0..0, 1000);
        assert!(kept.iter().any(|point| point.1.is_nan()));
        assert!(kept.iter().filter(|point| point.1.is_nan()).all(|point| (40_000..60_000).contains(&point.0)));
    }

    /// Buckets of rows 1 .. n-2, cut at multiples of the width as counted from row 0.
    trait ByRows {
        fn chunk_by_rows(&self, width: usize) -> impl Iterator<Item = &[f64]>;
    }

    impl ByRows for [f64] {
        fn chunk_by_rows(&self, width: usize) -> impl Iterator<Item = &[f64]> {
            let first = (width - 1).min(self.len());
            std::iter::once(&self[..first]).chain(self[first..].chunks(width))
        }
    }
}
