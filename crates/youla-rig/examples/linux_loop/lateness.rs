//! How late the samples began.

use std::fmt;

/// Lateness up to here has a class of its own for each microsecond.
const CLASSES: usize = 10_000;

/// A histogram of fixed size, so that the loop allocates nothing.
pub(crate) struct Lateness {
    /// Nanoseconds between samples.
    period: u64,
    classes: Vec<u64>,
    samples: u64,
    largest: u64,
    longest: u64,
    missed: u64,
}

impl Lateness {
    pub(crate) fn new(period: u64) -> Self {
        Lateness { period, classes: vec![0; CLASSES], samples: 0, largest: 0, longest: 0, missed: 0 }
    }

    /// A sample that began so late and took so long, nanoseconds. One that begins a whole period late has missed its own.
    pub(crate) fn add(&mut self, late: u64, took: u64) {
        let class = usize::try_from(late / 1000).unwrap_or(CLASSES).min(CLASSES - 1);
        if let Some(count) = self.classes.get_mut(class) {
            *count += 1;
        }
        self.samples += 1;
        self.largest = self.largest.max(late);
        self.longest = self.longest.max(took);
        self.missed += u64::from(late >= self.period);
    }

    /// Microseconds within which this share of the samples began, parts of 10 000.
    fn within(&self, share: u64) -> u64 {
        let mut left = (self.samples * share).div_ceil(10_000);
        // The last class has no upper end but the largest.
        for (microseconds, count) in (1..CLASSES as u64).zip(&self.classes) {
            left = left.saturating_sub(*count);
            if left == 0 {
                return microseconds;
            }
        }
        self.largest.div_ceil(1000)
    }
}

impl fmt::Display for Lateness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rest = self.classes.as_slice();
        let mut from = 0;
        for to in [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, CLASSES] {
            let (these, others) = rest.split_at(to - from);
            let count: u64 = these.iter().sum();
            let end = if to == CLASSES { "more".into() } else { to.to_string() };
            if count > 0 {
                writeln!(f, "{from:>6} to {end:>5} us  {count:>9}")?;
            }
            (rest, from) = (others, to);
        }
        let microseconds = |nanoseconds: u64| nanoseconds as f64 / 1000.0;
        write!(
            f,
            "lateness of {} samples: median below {} us, 99 % below {} us, 99.99 % below {} us, largest {:.1} us; {} missed their \
             period; longest sample {:.1} us",
            self.samples,
            self.within(5000),
            self.within(9900),
            self.within(9999),
            microseconds(self.largest),
            self.missed,
            microseconds(self.longest)
        )
    }
}
