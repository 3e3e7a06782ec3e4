//! The model that a record supports, without a tuning key: maximum likelihood on the lines of the records' Fourier transforms,
//! starts from long regressions, order and dead time by evidence.
//!
//! ```text
//! Y(k) = G(z) U(k) + C (z I - A)^-1 z t + H(z) E(k),        z = exp(2 pi i k / N)
//! -2 log likelihood = N log det Lambda + 2 N log |det A_u|
//! ```
//! The vector t describes both ends of a record (`spectra`), H for an autoregression per output, A_u for the poles outside the
//! unit circle (`search`). The plant and its noise are found together, so that the estimate holds in closed loop, where the
//! input is correlated with the noise (Ljung, System Identification, section 13.4), and for unstable plants.
//!
//! | step | module |
//! |---|---|
//! | records as lines of their Fourier transforms | `data` |
//! | starts: states of long regressions of several pasts; dead time from the newest inputs of a regression | `choose::{states, starts, dead_time}` |
//! | search in local coordinates, the noise estimated with it | `search` |
//! | one mode more, one less, another dead time, until Schwarz's criterion falls no more | `choose::{solve, neighbours, grow}` |
//! | standard deviations: information of the record, and scatter of models that it does not distinguish | `deviation` |
//! | questions to the records, each with a figure and a limit | `identify::verdict` |

pub(super) mod choose;
pub(super) mod data;
pub(super) mod deviation;
mod known_loop;
#[cfg(test)]
mod many_channels;
#[cfg(test)]
mod many_records;
mod measured;
#[cfg(test)]
mod noise_at_inputs;
#[cfg(test)]
mod noise_by_own_path;
mod options;
#[cfg(test)]
mod random_walk_loads;
mod recommendation;
pub(super) mod search;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod two_inputs;

pub use super::subspace::Experiment;
pub use super::verdict::LoopRatio;
pub use super::verdict::limits::LARGEST_IN_BAND;
pub use choose::solve::INDISTINCT;
pub use deviation::interpolation::INTERPOLATION_POINTS;
pub use deviation::mode_estimates::ModeEstimate;
pub use deviation::region::{Draw, Interval, Region, RegionParts};
pub use deviation::response_error::{EntryErrors, ResponseError};
pub use known_loop::{LoopKnowledge, LoopSignals};
pub(crate) use measured::recommend_from_response;
pub use measured::{MeasuredResponse, ResponseTable, ResponseVariance};
pub use options::LikelihoodOptions;
pub use recommendation::{Candidate, Evidence, Predictor, Recommendation, TestOutcome, figure};

use super::verdict::limits::{BAND_RATIO, CANCELLED_MODE};
use super::verdict::{self, Judged, Judgement, Parts, Witness};
use crate::linalg::{check_finite, check_shape};
use crate::lti::Discrete;
use crate::{Error, MatRef, Result};
use choose::deadline::Deadline;
use choose::lines::{self, Cleaned};
use choose::problem::Problem;
use choose::unseen::{WithoutUnseen, is_damped, without_unseen};
use data::spectra::Sizes;
use deviation::Directions;
use deviation::interpolation::Interpolated;

/// Largest dead time that is tried, samples.
const LARGEST_DEAD_TIME: usize = 20;
/// Samples per parameter of the smallest model, below which nothing is tried.
const SAMPLES_PER_PARAMETER: usize = 10;

/// Records with fewer samples are left out where there is a longer one: their ends take as many parameters as they have information. A log with
/// lost rows has such stretches.
pub const SHORTEST_RECORD: usize = 100;
/// Largest order of a model: time and memory grow with its square and more, 43 s at 100 for a log of 40 000 samples and 14 GB at 500.
pub const LARGEST_ORDER: usize = 100;

/// The model that the records support, with its evidence.
///
/// The records of `estimation` decide; those of `verification` (which may be empty) are asked whether they agree. What is known of
/// the loop is asked too; without it nothing shows that an excitation, not the noise, moved the plant, and the model is not trusted.
/// Records shorter than [`SHORTEST_RECORD`] are left out where there are longer ones.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::Shape`], [`Error::NotFinite`] and [`Error::ConstantChannel`] name the channel, [`Error::TooFewSamples`] says how many
/// are needed, [`Error::OutOfRange`] an option that cannot be met, [`Error::Unsupported`] refuses a known disturbance;
/// [`Error::NoCandidate`] where no search ends.
///
/// ```
/// use youla::identify::likelihood::{Experiment, LikelihoodOptions, recommend};
/// use youla::{Mat, lti::Discrete};
/// # use rand::{RngExt, SeedableRng};
/// # let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
/// # let mut random = || rng.random::<f64>() - 0.5;
/// let u = Mat::from_fn(2000, 1, |_, _| random());
/// let (mut x, mut y) = (0.0, Mat::zeros(2000, 1));
/// for t in 0..2000 {
///     y[(t, 0)] = x + 0.1 * random();
///     x = 0.9 * x + u[(t, 0)];
/// }
/// let records = [Experiment::new(u.as_ref(), y.as_ref())];
/// let found = recommend(&records, &[], None, Discrete::new(1e-3)?, &LikelihoodOptions::default())?;
/// assert_eq!((found.order, found.dead_time[0]), (1, 0));
/// assert!((found.plant.a()[(0, 0)] - 0.9).abs() < 0.005);
/// assert!(!found.trusted()); // nothing is known of what moved u
/// # Ok::<(), youla::Error>(())
/// ```
pub fn recommend(
    estimation: &[Experiment<'_>],
    verification: &[Experiment<'_>],
    known: Option<&LoopKnowledge<'_>>,
    time: Discrete,
    options: &LikelihoodOptions,
) -> Result<Recommendation> {
    check(estimation, verification)?;
    let [estimating, verifying] = [estimation, verification].map(long_enough);
    let known = known.map(|known| known.of_records(&estimating, &verifying));
    let [estimation, verification] = [(estimation, &estimating), (verification, &verifying)]
        .map(|(all, kept)| kept.iter().map(|k| all[*k]).collect::<Vec<_>>());
    let (estimation, verification, known) = (estimation.as_slice(), verification.as_slice(), known.as_ref());
    let all = problem(estimation, known, options)?;
    let mut candidates = Vec::new();
    let signals = known.map_or(&[][..], |known| &known.estimation);
    let found = lines::solve(&all, verification, signals, &mut candidates);
    let found = found.ok_or(Error::NoCandidate { samples: all.samples().0 })?;
    let (p, given) = (all.sizes.y.len(), &options.sampled_every);
    if !given.is_empty() && given.len() != p {
        return Err(Error::Ports {
            what: "the number of steps of interpolated outputs".into(),
            expected: p,
            found: given.len(),
        });
    }
    let of = |(output, step): (usize, &Option<f64>)| Some(Interpolated::new(output, time.ts() / (*step)?));
    let interpolated = given.iter().enumerate().filter_map(of).collect();
    let on = Records { all: &all, verification, known, time, interpolated };
    let (mut recommended, doubts) = on.judged(&found, 1.0)?;
    if let Some((unseen, widening)) = on.without_unseen(&found, &recommended, &doubts, &mut candidates) {
        let (without, _) = on.judged(&unseen.found, widening)?;
        if without.failures() < recommended.failures() && !without.is_contradicted_beside(&recommended) {
            recommended = without;
            recommended.evidence.push(unseen.evidence(time.ts()));
        }
    }
    recommended.evidence.extend(all.deadline.as_ref().and_then(Deadline::evidence));
    Ok(Recommendation { candidates, ..recommended })
}

/// What a model is judged on.
struct Records<'a> {
    all: &'a Problem<'a>,
    verification: &'a [Experiment<'a>],
    known: Option<&'a LoopKnowledge<'a>>,
    time: Discrete,
    /// The outputs that were interpolated.
    interpolated: Vec<Interpolated>,
}

/// What says whether modes of a model are those of the noise.
struct Doubts {
    witness: Option<Witness>,
    /// Whether what the excitation moves alone determines the loop.
    informed: bool,
}

impl Records<'_> {
    /// The model without the modes that only the noise may have shown, and the widening of its region: disturbances at one frequency; those that the
    /// excitation does not show, or where the model does not rest on the noise that the feedback brings to the inputs those in the gap of the
    /// excitation in which it fails a test; or those at whose frequencies it fails one.
    fn without_unseen(
        &self,
        found: &Cleaned,
        judged: &Recommendation,
        Doubts { witness, informed }: &Doubts,
        candidates: &mut Vec<Candidate>,
    ) -> Option<(WithoutUnseen, f64)> {
        let witness = witness.as_ref().filter(|_| !judged.trusted())?;
        let failed: Vec<[f64; 2]> = judged.evidence.iter().filter(|e| !e.holds()).filter_map(|e| e.hz).collect();
        let at = failed.iter().filter(|[low, high]| low == high).map(|[hz, _]| hz * self.time.ts());
        let apart = |turns: f64| at.clone().all(|at| witness.shows_between(turns, at));
        let shown = |turns: f64| if *informed { apart(turns) } else { witness.shows(turns) };
        let damped = is_damped(self.all, &found.solution.chosen);
        if let Some(without) = without_unseen(self.all, found, &damped, candidates) {
            return Some((without, 1.0));
        }
        if let Some(without) = without_unseen(self.all, found, &shown, candidates) {
            return Some((without.beside(&found.solution.chosen), 1.0));
        }
        let near = |hz: f64| failed.iter().any(|[low, high]| (low / BAND_RATIO..high * BAND_RATIO).contains(&hz));
        let passed = |turns: f64| !near(turns / self.time.ts());
        without_unseen(self.all, found, &passed, candidates).map(|without| (without, CANCELLED_MODE))
    }

    /// The model with its evidence, the squares of its deviations times `widening`, and what says whether its modes are those of the noise.
    fn judged(&self, found: &Cleaned, widening: f64) -> Result<(Recommendation, Doubts)> {
        let (known, time) = (self.known, self.time);
        let (estimation, verification) = (found.records(0, self.all.experiments), found.records(1, self.verification));
        let (problem, verification) = (found.problem(self.all, &estimation), verification.as_slice());
        let (solution, spectra) = problem.with_own_noise(&found.solution);
        let (solution, choice) = (&solution, &solution.chosen);
        let shares = [deviation::slow(spectra.samples()), deviation::grid(spectra.samples())].concat();
        let parts = Parts::new(&problem, solution, verification);
        let signals = known.map(|known| [known.estimation.as_slice(), known.verification.as_slice()]);
        let witness = signals.and_then(|signals| Witness::new(&problem, solution, signals, verification));
        let (nonlinear, nonlinear_parts) = verdict::nonlinear(&spectra, solution);
        let nuisance = found.nuisance(&problem, choice, &spectra);
        let scatter = (widening * parts.scatter, &nuisance);
        let directions = Directions::new(&spectra, solution, scatter, witness.clone())
            .with(nonlinear_parts, self.interpolated.clone());
        let plant = deviation::physical::plant(choice, &problem.sizes, time)?;
        let region = deviation::region::Region::new(problem.sizes.clone(), time, &shares, directions);
        let judged = Judged {
            problem: &problem,
            spectra: &spectra,
            solution,
            known,
            witness: witness.as_ref(),
            parts: &parts,
            plant: &plant,
            region: &region,
            nonlinear,
        };
        let Judgement { mut evidence, loop_ratio, entry_bands, bands, informed } = verdict::judge(&judged)?;
        evidence.extend(found.evidence(self.all, self.verification, time.ts()));
        let recommended = Recommendation {
            predictor: deviation::innovation::predictor(&plant, &choice.found.noise, &problem.sizes.y),
            plant,
            dead_time: choice.delays.clone(),
            order: choice.order(),
            region,
            modes: deviation::mode_estimates::modes(&spectra, choice, &nuisance, time),
            candidates: Vec::new(),
            evidence,
            loop_ratio,
            entry_bands,
            bands,
        };
        Ok((recommended, Doubts { witness, informed }))
    }
}

/// The records that are not left out, by their places.
fn long_enough(records: &[Experiment<'_>]) -> Vec<usize> {
    let long = |k: &usize| records[*k].u.nrows() >= SHORTEST_RECORD;
    let some = (0..records.len()).any(|k| long(&k));
    (0..records.len()).filter(|k| long(k) || !some).collect()
}

/// Shapes, finite entries, channels that move.
fn check(estimation: &[Experiment<'_>], verification: &[Experiment<'_>]) -> Result<()> {
    let (m, p) = estimation.first().map_or((0, 0), |e| (e.u.ncols(), e.y.ncols()));
    for (kind, records) in [("estimation", estimation), ("verification", verification)] {
        for (k, e) in records.iter().enumerate() {
            let what = |signal: &str| format!("{signal} of {kind} record {}", k + 1);
            check_shape(&what("u"), e.u, (e.u.nrows(), m))?;
            check_shape(&what("y"), e.y, (e.u.nrows(), p))?;
            check_finite(&what("u"), e.u)?;
            check_finite(&what("y"), e.y)?;
            if e.disturbance.is_some_and(|w| w.ncols() > 0) {
                return Err(Error::Unsupported {
                    what: "the recommended model of an Experiment with a known disturbance",
                    instead: "subtract the disturbance from the outputs first, or use subspace, which estimates it",
                });
            }
        }
    }
    check_moving("input", &estimation.iter().map(|e| e.u).collect::<Vec<_>>())?;
    check_moving("output", &estimation.iter().map(|e| e.y).collect::<Vec<_>>())
}

/// Fails at the first channel that is constant in every record.
fn check_moving(signal: &str, records: &[MatRef<'_, f64>]) -> Result<()> {
    for j in 0..records.first().map_or(0, |r| r.ncols()) {
        let first = records.iter().find(|r| r.nrows() > 0).map_or(0.0, |r| r[(0, j)]);
        if records.iter().all(|r| r.col(j).iter().all(|v| *v == r[(0, j)])) {
            return Err(Error::ConstantChannel { what: format!("{signal} {}", j + 1), value: first });
        }
    }
    Ok(())
}

fn problem<'a>(
    experiments: &'a [Experiment<'a>],
    known: Option<&'a LoopKnowledge<'a>>,
    options: &LikelihoodOptions,
) -> Result<Problem<'a>> {
    let (m, p) = experiments.first().map_or((0, 0), |e| (e.u.ncols(), e.y.ncols()));
    let longest = experiments.iter().map(|e| e.u.nrows()).max().unwrap_or(0);
    let order = options.order.unwrap_or(1);
    let needed = SAMPLES_PER_PARAMETER * (order * (m + p).div_ceil(p.max(1)) + 8);
    if m == 0 || p == 0 || longest < needed {
        return Err(Error::TooFewSamples { what: "the longest record".into(), found: longest, needed });
    }
    let given = options.dead_time.as_deref();
    if let Some(given) = given.filter(|given| given.len() != m) {
        return Err(Error::Ports { what: "the number of dead times".into(), expected: m, found: given.len() });
    }
    let skip = given.map_or(LARGEST_DEAD_TIME.min(longest / 16), |given| given.iter().copied().max().unwrap_or(0));
    if skip > longest / 4 {
        let must = "at most a quarter of the longest record, in samples";
        return Err(Error::OutOfRange { what: "the dead time".into(), value: skip as f64, must });
    }
    let within = 1..=LARGEST_ORDER;
    if let Some(order) = [order, options.largest_order].into_iter().find(|order| !within.contains(order)) {
        return Err(Error::OutOfRange { what: "the order".into(), value: order as f64, must: "from 1 to 100" });
    }
    let sizes = Sizes::of(experiments);
    // What is stated wrongly must not spoil what is logged rightly: the controller enters after it has passed.
    let stated = known.filter(|known| verdict::explains(known));
    let direct = stated.and_then(|known| known.direct(&sizes)).filter(|_| options.feedthrough != Some(false));
    Ok(Problem {
        experiments,
        direct,
        open_loop: known.is_some_and(|known| known.controller.is_none()),
        sizes,
        skip,
        feedthrough: options.feedthrough.unwrap_or(false),
        order: options.order,
        dead_time: options.dead_time.clone(),
        largest_order: options.largest_order,
        masked: Vec::new(),
        feedback: stated.and_then(|known| known.feedback).filter(|k| !k.is_zero()),
        filter_moves: false,
        watched: false,
        deadline: options.time_limit.map(Deadline::after),
    })
}
