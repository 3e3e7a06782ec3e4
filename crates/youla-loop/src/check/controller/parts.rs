//! The law from part to part of a record: controllers are switched, and scheduled with speed or load.
//!
//! Each part has the factor on the gain that [`gains`](super::gains) gives and what it leaves of w, over the size of w.

use super::gains::{Beside, factor};
use super::log::{Log, centred};
use crate::check::finding::few;
use crate::error::Result;
use std::ops::Range;
use youla::Mat;
use youla::lti::{Discrete, StateSpace};

/// Parts of a record, and rows of a part for each state of the controller, at least.
/// Chosen, not measured.
const PARTS: usize = 40;
const ROWS: usize = 25;
/// Parts in a row under another controller, at least, and under the declared one somewhere: one or two hold an interruption.
/// Chosen, not measured.
const STRETCH: usize = 3;
/// What a factor leaves of a part that it explains, in thresholds of a caution: a schedule varies within a part.
/// Chosen, not measured.
const EXPLAINED: f64 = 5.0;
/// Share of the parts that factors must explain for a schedule, or the declared law for interruptions, and the quotient of the quantiles of
/// factors at 5 and 95 % that is a schedule.
/// Chosen, not measured.
const MOST: f64 = 0.9;
const SPREAD: f64 = 1.05;
/// A factor below this is none.
const NONE: f64 = 0.01;

/// How the law of a record changes.
#[derive(Debug, Clone, PartialEq)]
pub enum Parts {
    /// The declared controller explains these samples, counted from 0, and another one ran in the others.
    Switched {
        /// First sample of each stretch, and the one behind its last.
        holds: Vec<Range<usize>>,
        /// The most that it leaves of one of them.
        residual: f64,
        /// Least and largest factor on its gain in the others, where that explains them.
        factors: Option<[f64; 2]>,
    },
    /// The declared controller explains all but a few parts, which begin and end at these samples: a reset, a held command, wrong samples.
    Interrupted(Vec<Range<usize>>),
    /// A factor on the gain that varies explains the record: its quantiles at 5 and 95 % of the parts.
    Scheduled([f64; 2]),
}

/// A part: what the declared law leaves, the factor on its gain, and what that leaves.
struct Part {
    declared: f64,
    factor: f64,
    left: f64,
}

/// Looks for a change of the law; `caution` is the residual up to which a law holds.
pub(super) fn parts(log: &Log<'_>, k: &StateSpace<Discrete>, caution: f64) -> Result<Option<Parts>> {
    let rows = (log.w.nrows() / PARTS).max(ROWS * (k.order() + k.inputs()));
    let count = log.w.nrows() / rows;
    if count < 2 * STRETCH {
        return Ok(None);
    }
    let beside = Beside::new(k)?;
    // The last part has the rest of the rows.
    let samples =
        |parts: Range<usize>| parts.start * rows..if parts.end == count { log.w.nrows() } else { parts.end * rows };
    let all = (0..count).map(|i| part(log, k, &beside, samples(i..i + 1))).collect::<Result<Vec<Part>>>()?;
    let holds: Vec<bool> = all.iter().map(|p| p.declared <= caution).collect();
    let explained = |p: &&Part| p.left <= EXPLAINED * caution;
    let factors = |of: &[&Part]| {
        let mut sorted: Vec<f64> = of.iter().map(|p| p.factor).collect();
        sorted.sort_by(f64::total_cmp);
        [0.05, 0.95].map(|share| youla::statistics::quantile(&sorted, share))
    };
    let stretches = stretches(&holds);
    let longest = stretches.iter().filter(|s| holds[s.start]).map(Range::len).max();
    // The parts at the ends of stretches hold the change itself.
    let inner = |i: &usize| !holds[*i] && (*i == 0 || !holds[i - 1]) && holds.get(i + 1) != Some(&true);
    let others: Vec<&Part> = (0..count).filter(inner).map(|i| &all[i]).collect();
    if longest.is_some_and(|longest| longest >= STRETCH) {
        let (held, broken): (Vec<_>, Vec<_>) = stretches.into_iter().partition(|s| holds[s.start]);
        if broken.is_empty() {
            let joints = joints(log, k, (0..count).map(|i| samples(i..i + 1)), caution)?;
            return Ok((!joints.is_empty()).then_some(Parts::Interrupted(joints)));
        }
        if broken.iter().any(|s| s.len() < STRETCH) || others.is_empty() {
            let most = holds.iter().filter(|holds| **holds).count() as f64 >= MOST * count as f64;
            return Ok(most.then(|| Parts::Interrupted(broken.into_iter().map(samples).collect())));
        }
        let held = held.into_iter().map(|s| ends(log, k, samples(s), rows, caution)).collect::<Result<Vec<_>>>()?;
        let left = held.iter().map(|at| residual(log, k, at)).collect::<Result<Vec<f64>>>()?;
        let residual = left.into_iter().fold(0.0, f64::max);
        let factors = others.iter().all(explained).then(|| factors(&others));
        return Ok(Some(Parts::Switched { holds: held, residual, factors }));
    }
    let scaled: Vec<&Part> = all.iter().filter(explained).collect();
    if (scaled.len() as f64) < MOST * count as f64 {
        return Ok(None);
    }
    let [low, high] = factors(&scaled);
    Ok((low > 0.0 && high > SPREAD * low).then_some(Parts::Scheduled([low, high])))
}

fn part(log: &Log<'_>, k: &StateSpace<Discrete>, beside: &Beside, at: Range<usize>) -> Result<Part> {
    let (e, w) = (log.e.subrows(at.start, at.len()), log.w.subrows(at.start, at.len()));
    let (v, size) = (beside.response(k, e)?, centred(&w.to_owned()).norm_l2().max(f64::MIN_POSITIVE));
    let w = beside.of(w)?;
    let (factor, left) = factor(&v, &w);
    Ok(Part { declared: (&w - &v).norm_l2() / size, factor, left: left / size })
}

/// Runs of equal values.
fn stretches(holds: &[bool]) -> Vec<Range<usize>> {
    let starts: Vec<usize> = (0..holds.len()).filter(|i| *i == 0 || holds[*i] != holds[i - 1]).collect();
    let end = |k: usize| starts.get(k + 1).copied().unwrap_or(holds.len());
    starts.iter().enumerate().map(|(k, start)| *start..end(k)).collect()
}

/// The samples around which the law, which holds in each part, does not go on from one part to the next: two logs one behind the other.
fn joints(
    log: &Log<'_>,
    k: &StateSpace<Discrete>,
    parts: impl Iterator<Item = Range<usize>>,
    caution: f64,
) -> Result<Vec<Range<usize>>> {
    let parts: Vec<Range<usize>> = parts.collect();
    let mut found = Vec::new();
    for pair in parts.windows(2) {
        if residual(log, k, &(pair[0].start..pair[1].end))? > caution {
            let end = ends(log, k, pair[0].clone(), pair[1].len(), caution)?.end;
            found.push(end.saturating_sub(1)..(end + 1).min(pair[1].end));
        }
    }
    Ok(found)
}

fn residual(log: &Log<'_>, k: &StateSpace<Discrete>, at: &Range<usize>) -> Result<f64> {
    let of = |x: &Mat<f64>| x.subrows(at.start, at.len()).to_owned();
    log.residual(k, &of(&log.e), &of(&log.w))
}

/// The first and the last sample that the law explains together with the parts at the ends of a stretch, by bisection.
fn ends(
    log: &Log<'_>,
    k: &StateSpace<Discrete>,
    within: Range<usize>,
    rows: usize,
    caution: f64,
) -> Result<Range<usize>> {
    let most = |explains: &dyn Fn(usize) -> Result<bool>, most: usize| -> Result<usize> {
        let (mut low, mut high) = (0, most + 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if explains(middle)? { low = middle } else { high = middle }
        }
        Ok(low)
    };
    let before = |more: usize| Ok(residual(log, k, &(within.start - more..within.start + rows))? <= caution);
    let behind = |more: usize| Ok(residual(log, k, &(within.end - rows..within.end + more))? <= caution);
    let start = within.start - most(&before, within.start.min(rows))?;
    let end = within.end + most(&behind, (log.w.nrows() - within.end).min(rows))?;
    Ok(start..end)
}

impl Parts {
    /// Whether each part is explained, by the declared law or by a factor on its gain.
    pub(super) fn explain_all(&self) -> bool {
        matches!(self, Parts::Scheduled(_) | Parts::Switched { factors: Some(_), .. })
    }

    /// The finding and the remedy in words; `row` is that of the first sample.
    pub(super) fn words(&self, row: usize, percent: &str) -> [String; 2] {
        let factor = |[low, high]: &[f64; 2]| match (low.abs().max(high.abs()) < NONE, high / low < SPREAD) {
            (true, _) => "no controller".to_owned(),
            (_, true) => format!("one of {} times its gain", few(0.5 * (low + high))),
            _ => format!("one of {} to {} times its gain", few(*low), few(*high)),
        };
        let list = |of: &[Range<usize>]| {
            let rows = |at: &Range<usize>| format!("{} to {}", row + at.start, row + at.end - 1);
            of.iter().map(rows).collect::<Vec<_>>().join(", ")
        };
        match self {
            Parts::Switched { holds, residual, factors } => [
                format!(
                    "the controller changes in the record: the declared one explains rows {} but for {} %, and not the others{}",
                    list(holds),
                    few(100.0 * residual),
                    factors.as_ref().map_or(String::new(), |of| format!(", in which {} ran", factor(of)))
                ),
                "Cut the record there by `take` and `skip`, and identify each part with the controller that ran".to_owned(),
            ],
            Parts::Interrupted(at) => [
                format!("the declared controller explains all of the record but rows {}", list(at)),
                "Look there for a reset of the integrator, a command that was held, a limit, wrong samples, or the end of one log and the start of \
                 another; leave the rows out by `segments` \
                 where the input is not the one that acted"
                    .to_owned(),
            ],
            Parts::Scheduled(of) => [
                format!(
                    "the gain of the controller varies along the record: the declared one does not explain {percent} % of the logged input, \
                     {} does",
                    factor(of)
                ),
                "The model does not need the controller, but margins and certificate are those of the declared one: log with fixed gains, or \
                 look for a limit or another path into the input"
                    .to_owned(),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::check::{CheckOptions, ControllerCheck, ControllerRecord, Parts, controller};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use youla::Mat;
    use youla::lti::{Discrete, StateSpace};

    const ROWS: usize = 4000;

    /// `x+ = 0.95 x + 0.1 u` under `u = d - gain(t) (1.5 y + integral of y)`: what the check says of the law with a gain of 1.
    fn checked(seed: u64, gain: impl Fn(usize) -> f64, wrong: impl Fn(usize) -> f64) -> ControllerCheck {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || rng.sample::<f64, _>(StandardNormal);
        let (mut x, mut integral) = (0.0, 0.0);
        let rows: Vec<[f64; 3]> = (0..ROWS)
            .map(|t| {
                let (d, y) = (draw(), x + 0.1 * draw());
                let u = d - gain(t) * (1.5 * y + integral);
                integral += 0.02 * y;
                x = 0.95 * x + 0.1 * u;
                [u, y + wrong(t), d]
            })
            .collect();
        let [u, y, d] = [0, 1, 2].map(|j| Mat::from_fn(ROWS, 1, |t, _| rows[t][j]));
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        let time = Discrete::new(1e-3).unwrap();
        let k = StateSpace::new(number(1.0), number(0.02), number(-1.0), number(-1.5), time).unwrap();
        let record =
            ControllerRecord { u: u.as_ref(), y: y.as_ref(), input_excitation: Some(d.as_ref()), reference: None };
        controller(&k, record, &CheckOptions::default()).unwrap()
    }

    /// Planted: the gain is 1.4 times as large between two rows. Both are found, within ten rows, and the factor.
    #[test]
    fn a_controller_that_is_switched_is_found_with_its_rows() {
        for seed in 0..20 {
            let at = [1000 + 37 * seed as usize, 2800 + 11 * seed as usize];
            let found = checked(seed, |t| if (at[0]..at[1]).contains(&t) { 1.4 } else { 1.0 }, |_| 0.0);
            let Some(Parts::Switched { holds, factors: Some([low, high]), .. }) = &found.parts else {
                panic!("seed {seed}: {found:?}")
            };
            assert!(holds.len() == 2 && holds[0].start == 0 && holds[1].end == ROWS, "seed {seed}: {holds:?}");
            let near = holds[0].end.abs_diff(at[0]) <= 10 && holds[1].start.abs_diff(at[1]) <= 10;
            assert!(near && (low - 1.4).abs() < 0.02 && (high - 1.4).abs() < 0.02, "seed {seed}: {holds:?} for {at:?}");
        }
    }

    /// Planted: a gain that varies by 30 % to either side over the record.
    #[test]
    fn a_gain_that_varies_along_the_record_is_a_schedule() {
        for seed in 0..20 {
            let found = checked(seed, |t| 1.0 + 0.3 * (t as f64 * std::f64::consts::TAU / 3000.0).sin(), |_| 0.0);
            let Some(Parts::Scheduled([low, high])) = found.parts else { panic!("seed {seed}: {found:?}") };
            assert!((low - 0.7).abs() < 0.03 && (high - 1.3).abs() < 0.03, "seed {seed}: {low} {high}");
        }
    }

    /// Controls: the declared law and one with another gain throughout. Wrong samples of the output are named with their rows.
    #[test]
    fn wrong_samples_are_an_interruption_and_another_gain_no_change() {
        for seed in 0..20 {
            assert_eq!(checked(seed, |_| 1.0, |_| 0.0).parts, None, "seed {seed}");
            assert_eq!(checked(seed, |_| 1.4, |_| 0.0).parts, None, "seed {seed}");
            let wrong = checked(seed, |_| 1.0, |t| if t / 60 == 30 { 3.0 } else { 0.0 });
            let Some(Parts::Interrupted(at)) = &wrong.parts else { panic!("seed {seed}: {wrong:?}") };
            assert!(at.len() == 1 && at[0].contains(&1800) && at[0].contains(&1859), "seed {seed}: {at:?}");
        }
    }
}
