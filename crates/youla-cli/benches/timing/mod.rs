//! Times of pieces of work.

use std::hint::black_box;
use std::time::Instant;

/// Median time in seconds of as many calls as fit into half a second, 3 to 1001 of them, after one to warm up.
pub(crate) fn median<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut call = || {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64()
    };
    let calls = (0.5 / call()).clamp(3.0, 1001.0) as usize;
    middle((0..calls).map(|_| call()).collect())
}

/// The median.
pub(crate) fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
