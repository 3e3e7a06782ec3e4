//! The defects that are planted: where, and by which words of a finding each is known.

use super::logs::{Log, size};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::Mat;
use youla::signal::Record;
use youla_loop::check::{Finding, Severity, Test};

/// A defect.
pub(crate) struct Defect {
    pub(crate) name: &'static str,
    /// Changes a log, which has a known excitation at its input and its controller declared.
    pub(crate) plant: fn(&mut Log, &mut ChaCha8Rng),
    /// One of these must be in what it says or advises.
    words: &'static [&'static str],
}

impl Defect {
    /// Whether one of the findings names this defect.
    pub(crate) fn is_named_by(&self, found: &[Finding]) -> bool {
        let says = |f: &Finding| self.words.iter().any(|word| f.what.contains(word) || f.advice.contains(word));
        found.iter().any(|f| (f.severity > Severity::Note || f.test == Test::Outliers) && says(f))
    }
}

/// A row somewhere in the middle.
fn somewhere(log: &Log, rng: &mut ChaCha8Rng) -> usize {
    let n = log.u.nrows();
    rng.random_range(n / 5..4 * n / 5)
}

fn change(x: &mut Mat<f64>, j: usize, of: impl Fn(usize, f64) -> f64) {
    (0..x.nrows()).for_each(|k| x[(k, j)] = of(k, x[(k, j)]));
}

/// Wrong samples of 2 to 5 deviations.
fn wrong(log: &mut Log, rng: &mut ChaCha8Rng, count: usize) {
    let (at, of) = (somewhere(log, rng), size(&log.y));
    for k in at..at + count {
        let by = (2.0 + 3.0 * rng.random::<f64>()) * if rng.random() { of } else { -of };
        log.y[(k, 0)] += by;
    }
}

fn rows(log: &mut Log, of: impl Fn(usize) -> usize, count: usize) {
    let taken = |x: &Mat<f64>| Mat::from_fn(count, x.ncols(), |k, j| x[(of(k), j)]);
    (log.u, log.y) = (taken(&log.u), taken(&log.y));
    log.d = log.d.as_ref().map(taken);
    log.r = log.r.as_ref().map(taken);
    log.times.truncate(count);
    let ts = log.time.ts();
    (log.times.len()..count).for_each(|k| log.times.push(k as f64 * ts));
}

/// One channel `by` rows later than the others.
fn late(x: &mut Mat<f64>, by: isize) {
    let n = x.nrows() as isize;
    *x = Mat::from_fn(x.nrows(), x.ncols(), |k, j| x[((k as isize - by).clamp(0, n - 1) as usize, j)]);
}

fn exchange(x: &mut Mat<f64>) {
    *x = Mat::from_fn(x.nrows(), x.ncols(), |k, j| x[(k, x.ncols() - 1 - j)]);
}

fn negate(x: &mut Mat<f64>) {
    *x = -1.0 * &*x;
}

/// The part of the input that the controller makes, times a factor.
fn scale_law(log: &mut Log, factor: impl Fn(usize) -> f64) {
    let Some(d) = &log.d else { return };
    log.u = Mat::from_fn(d.nrows(), d.ncols(), |k, j| d[(k, j)] + factor(k) * (log.u[(k, j)] - d[(k, j)]));
}

/// What a reader refuses.
pub(crate) fn refused(log: &Log) -> bool {
    let channels = (0..log.y.ncols()).map(|j| youla::signal::Channel::new(format!("y{j}"), "")).collect();
    Record::new("log", channels, log.y.clone(), log.time).is_err()
}

pub(crate) const TWO_BY_TWO: [&str; 2] = ["inputs exchanged", "outputs exchanged"];
pub(crate) const IN_THE_LOOP: [&str; 2] = ["input saturates", "not excited"];

pub(crate) const ALL: [Defect; 29] = [
    Defect { name: "dead output", plant: |log, _| log.y.col_mut(0).fill(0.0), words: &["constant"] },
    Defect { name: "dead input", plant: |log, _| log.u.col_mut(0).fill(0.3), words: &["constant"] },
    Defect {
        name: "output stuck for 60 samples",
        plant: |log, rng| {
            let at = somewhere(log, rng);
            let held = log.y[(at, 0)];
            (at..at + 60).for_each(|k| log.y[(k, 0)] = held);
        },
        words: &["is constant"],
    },
    Defect {
        name: "time in ms",
        plant: |log, _| log.times.iter_mut().for_each(|t| *t *= 1e3),
        words: &["milliseconds"],
    },
    Defect {
        name: "time in us",
        plant: |log, _| log.times.iter_mut().for_each(|t| *t *= 1e6),
        words: &["microseconds"],
    },
    Defect {
        name: "rows missing",
        plant: |log, rng| {
            let at = somewhere(log, rng);
            let times = log.times.clone();
            let n = times.len();
            rows(log, |k| if k < at { k } else { k + 7 }, n - 7);
            log.times =
                times.into_iter().enumerate().filter(|(k, _)| !(at..at + 7).contains(k)).map(|(_, t)| t).collect();
        },
        words: &["missing"],
    },
    Defect { name: "one wrong sample", plant: |log, rng| wrong(log, rng, 1), words: &["outlier"] },
    Defect { name: "two wrong samples in a row", plant: |log, rng| wrong(log, rng, 2), words: &["outlier"] },
    Defect { name: "three wrong samples in a row", plant: |log, rng| wrong(log, rng, 3), words: &["outlier"] },
    Defect {
        name: "burst of 30 samples",
        plant: |log, rng| {
            let (at, of) = (somewhere(log, rng), size(&log.y));
            (at..at + 30).for_each(|k| log.y[(k, 0)] += of * rng.sample::<f64, _>(StandardNormal));
        },
        words: &["burst"],
    },
    Defect {
        name: "offset jumps by 4 deviations",
        plant: |log, rng| {
            let (at, of) = (somewhere(log, rng), size(&log.y));
            change(&mut log.y, 0, |k, y| if k < at { y } else { y + 4.0 * of });
        },
        words: &["jump"],
    },
    Defect {
        name: "drift of 3 deviations",
        plant: |log, _| {
            let (n, of) = (log.y.nrows() as f64, size(&log.y));
            change(&mut log.y, 0, |k, y| y + 3.0 * of * k as f64 / n);
        },
        words: &["drift"],
    },
    Defect {
        name: "row logged twice",
        plant: |log, rng| {
            let (at, n) = (somewhere(log, rng), log.u.nrows());
            rows(log, |k| if k <= at { k } else { k - 1 }, n + 1);
        },
        words: &["repeat"],
    },
    Defect {
        name: "row lost, time rewritten",
        plant: |log, rng| {
            let (at, n) = (somewhere(log, rng), log.u.nrows());
            rows(log, |k| if k < at { k } else { k + 1 }, n - 1);
        },
        words: &["lost"],
    },
    Defect { name: "inputs exchanged", plant: |log, _| exchange(&mut log.u), words: &["u1 and u2 exchanged"] },
    Defect { name: "outputs exchanged", plant: |log, _| exchange(&mut log.y), words: &["y1 and y2 exchanged"] },
    Defect { name: "sign of the input", plant: |log, _| negate(&mut log.u), words: &["opposite sign of the input"] },
    Defect { name: "sign of the output", plant: |log, _| negate(&mut log.y), words: &["the opposite sign:"] },
    Defect {
        name: "sign of the feedback",
        plant: |log, _| log.controller = log.controller.as_ref().map(|k| k.negated()),
        words: &["the opposite sign:"],
    },
    Defect {
        name: "gain of the controller",
        plant: |log, _| {
            log.controller = log
                .controller
                .as_ref()
                .map(|k| k.map_output(&Mat::from_fn(k.outputs(), k.outputs(), |i, j| if i == j { 0.7 } else { 0.0 })))
        },
        words: &["times the gain"],
    },
    Defect {
        name: "controller switched",
        plant: |log, rng| {
            let at = somewhere(log, rng);
            scale_law(log, |k| if k < at { 1.0 } else { 1.5 });
        },
        words: &["the controller changes"],
    },
    Defect {
        name: "gain that varies by 30 %",
        plant: |log, _| {
            let n = log.u.nrows() as f64;
            scale_law(log, |k| 1.0 + 0.3 * (std::f64::consts::TAU * k as f64 / n).sin());
        },
        words: &["varies along the record"],
    },
    Defect {
        name: "input one sample early",
        plant: |log, _| late(&mut log.u, -1),
        words: &["the input one sample later"],
    },
    Defect {
        name: "input one sample late",
        plant: |log, _| late(&mut log.u, 1),
        words: &["the input one sample earlier"],
    },
    Defect {
        name: "output one sample late",
        plant: |log, _| late(&mut log.y, 1),
        words: &["the outputs (and references) one sample earlier"],
    },
    Defect { name: "input saturates", plant: |_, _| (), words: &["clipped"] },
    Defect {
        name: "coarse steps",
        plant: |log, _| {
            let step = 0.5 * size(&log.y);
            (0..log.y.ncols()).for_each(|j| change(&mut log.y, j, |_, y| (y / step).round() * step));
        },
        words: &["resolution"],
    },
    Defect { name: "not excited", plant: |_, _| (), words: &["constant", "nothing but the controller"] },
    Defect {
        name: "wrong column as excitation",
        plant: |log, rng| {
            let of = size(log.d.as_ref().unwrap_or(&log.u));
            log.d = log
                .d
                .as_ref()
                .map(|d| Mat::from_fn(d.nrows(), d.ncols(), |_, _| of * rng.sample::<f64, _>(StandardNormal)));
        },
        words: &["another signal"],
    },
];

/// A value that is not a number.
pub(crate) fn not_a_number(log: &mut Log, rng: &mut ChaCha8Rng) {
    let at = somewhere(log, rng);
    log.y[(at, 0)] = f64::NAN;
}
