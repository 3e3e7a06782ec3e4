//! What the external excitation says of a model: its error, band by band, in all records, and how this error differs between groups of
//! records.

use super::excess::Excess;
use super::limits::BAND_RATIO;
use super::local_error::{Channels, LocalErrors, RecordLines, explained_inputs, hann};
use super::partition::Partition;
use crate::identify::likelihood::LoopSignals;
use crate::identify::likelihood::choose::problem::{Problem, Solution};
use crate::identify::likelihood::data::spectra::{Lines, Spectra, lines_of, long_enough};
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::with_best_ends;
use crate::identify::subspace::Experiment;
use crate::linalg::TINY;
use faer::{Mat, MatRef, c64};

/// Records that are a group each, at most; more are joined.
const MOST_GROUPS: usize = 6;

/// Records by their lines: inputs, what the model leaves of the outputs, and the excitation.
struct Group {
    /// Of each record.
    records: Vec<[Vec<c64>; 3]>,
    /// Of each record and line, what whitens the noise of the model, over its mean over the record.
    whitening: Vec<Vec<f64>>,
}

/// The error of the model as the excitation shows it.
#[derive(Debug, Clone)]
pub(crate) struct Witness {
    /// In all records.
    pub(crate) whole: LocalErrors,
    /// The same in bands that are narrow at low frequency.
    pub(crate) narrow: LocalErrors,
    /// Mean squares of these errors beyond chance.
    pub(crate) distortion: Excess,
    /// Mean squares of the differences between groups of records beyond chance.
    pub(crate) variation: Excess,
    /// The same of the estimation records and the fresh ones, which differ by as much as the model and a record that is not there.
    pub(crate) against_fresh: Excess,
    /// Inputs of the estimation records as far as the excitation explains them, lines x m.
    excited: Vec<Vec<c64>>,
}

type Pair<'a> = (Experiment<'a>, MatRef<'a, f64>);

impl Group {
    fn new(problem: &Problem<'_>, solution: &Solution, records: &[Pair<'_>]) -> Option<Self> {
        let found = &solution.chosen.found;
        let records: Vec<&Pair<'_>> = records.iter().filter(|(_, x)| long_enough(x.nrows(), problem.skip)).collect();
        let experiments: Vec<Experiment<'_>> = records.iter().map(|(e, _)| *e).collect();
        let spectra = problem.spectra_of(&experiments, &solution.chosen.delays);
        if spectra.records.is_empty() {
            return None;
        }
        let point = with_best_ends(&spectra, found.point.model.clone(), &found.noise);
        let residuals = point.residuals(&spectra);
        let whitening = spectra.records.iter().map(|lines| whitening(&found.noise, lines)).collect();
        let all = spectra.records.into_iter().zip(residuals).zip(records);
        let records = all.map(|((lines, v), (_, x))| [lines.u, v, lines_of(*x, problem.skip)]).collect();
        Some(Group { records, whitening })
    }

    /// Under a Hann window, each line times what whitens the noise: of a band in which the noise falls by decades, as below a slow load and an
    /// integrator, the strongest lines would decide alone, and their noise would be taken for that of all.
    fn windowed(self, Channels { m, p, q }: Channels) -> Self {
        let of = |([u, v, x], by): ([Vec<c64>; 3], &Vec<f64>)| {
            let white = |lines: Vec<c64>, channels: usize| {
                let mut lines = hann(&lines, channels);
                lines.chunks_mut(channels).zip(by).for_each(|(line, by)| line.iter_mut().for_each(|v| *v *= *by));
                lines
            };
            [white(u, m), white(v, p), white(x, q)]
        };
        let records = self.records.into_iter().zip(&self.whitening).map(of).collect();
        Group { records, ..self }
    }

    fn lines(&self) -> impl Iterator<Item = RecordLines<'_>> {
        self.records.iter().map(|[u, v, x]| RecordLines { u, v, x })
    }
}

/// One over the root of the power of the noise on each line, over the mean of all; of several outputs the root of the mean over them of one over
/// their powers.
fn whitening(noise: &Noise, lines: &Lines) -> Vec<f64> {
    let p = noise.regression.len();
    let of_outputs = noise.of_each_output(lines);
    let of_line = |(values, weight): (&[c64], &f64)| {
        (values.iter().map(c64::norm_sqr).sum::<f64>() / p as f64).sqrt() / weight.max(TINY)
    };
    let mut out: Vec<f64> = of_outputs.chunks(p).zip(&lines.weight).map(of_line).collect();
    let mean = out.iter().sum::<f64>() / out.len().max(1) as f64;
    out.iter_mut().for_each(|v| *v /= mean.max(TINY));
    out
}

impl Witness {
    /// From the records of estimation and the fresh ones with the signals of the loop; `None` where the excitation is not known.
    pub(crate) fn new(
        problem: &Problem<'_>,
        solution: &Solution,
        [estimation, fresh]: [&[LoopSignals<'_>]; 2],
        verification: &[Experiment<'_>],
    ) -> Option<Self> {
        let moving = moving(estimation, fresh);
        let [estimating, verifying] = [estimation, fresh].map(|signals| moving_columns(signals, &moving));
        let of_records = pairs(problem.experiments, estimating.as_ref()?)?;
        let of_fresh = verifying.as_ref().and_then(|columns| pairs(verification, columns)).unwrap_or_default();
        if moving.is_empty() {
            return None;
        }
        let q = of_records.iter().map(|(_, x)| x.ncols()).max().unwrap_or(0);
        let channels = Channels { m: problem.inputs(), p: problem.outputs(), q };
        let group = |records: &[Pair<'_>]| Some(Group::new(problem, solution, records)?.windowed(channels));
        let plain = Group::new(problem, solution, &of_records)?;
        let excited = explained_inputs(&plain.lines().collect::<Vec<_>>(), channels);
        let (first, second) = (plain.windowed(channels), group(&of_fresh));
        let all: Vec<RecordLines<'_>> = first.lines().chain(second.iter().flat_map(Group::lines)).collect();
        let lines = |all: &[RecordLines<'_>]| all.iter().map(|r| r.v.len() / channels.p).sum::<usize>();
        let parameters = solution.chosen.found.parameters;
        let whole = LocalErrors::new(&all, channels, &Partition::equal(lines(&all), channels), parameters);
        let narrow = LocalErrors::new(&all, channels, &Partition::narrow(lines(&all), all.len(), channels), 0);
        let mut groups: Vec<Group> = split(&of_records, problem.skip).iter().filter_map(|g| group(g)).collect();
        let has_fresh = second.is_some();
        groups.extend(second);
        let of_group = |g: &Group| lines(&g.lines().collect::<Vec<_>>());
        let shared = Partition::equal(groups.iter().map(of_group).min().unwrap_or(0), channels);
        let of = |g: &Group| LocalErrors::new(&g.lines().collect::<Vec<_>>(), channels, &shared, 0);
        let errors: Vec<LocalErrors> = groups.iter().map(of).collect();
        let fresh = errors.last().filter(|_| has_fresh);
        let against_fresh = fresh.map(|fresh| LocalErrors::difference([&of(&first), fresh])).unwrap_or_default();
        let variation = LocalErrors::scatter(&errors);
        Some(Witness { distortion: whole.excess(), variation, against_fresh, whole, narrow, excited })
    }
}

impl Witness {
    /// Whether the excitation shows the response near a frequency, a share of the sample rate.
    pub(crate) fn shows(&self, turns: f64) -> bool {
        self.shows_between(turns, turns)
    }

    /// Whether the excitation shows the response near or between two frequencies, shares of the sample rate.
    pub(crate) fn shows_between(&self, one: f64, other: f64) -> bool {
        let place = |share: f64| self.whole.partition.of(2.0 * share);
        let (first, last) = (place(one.min(other) / BAND_RATIO), place(one.max(other) * BAND_RATIO));
        self.whole.bands.get(first..=last).is_some_and(|near| near.iter().any(Option::is_some))
    }

    /// The lines of the estimation records with the part of the inputs that the excitation explains; `None` where it does not reach all.
    pub(crate) fn excited(&self, spectra: &Spectra) -> Option<Spectra> {
        if !self.whole.shows_all() || self.excited.len() != spectra.records.len() {
            return None;
        }
        let mut out = spectra.clone();
        out.records.iter_mut().zip(&self.excited).for_each(|(lines, u)| lines.u.clone_from(u));
        Some(out)
    }
}

/// The channels of the excitation that are not constant in every record: others only take lines from the bands.
fn moving(estimation: &[LoopSignals<'_>], fresh: &[LoopSignals<'_>]) -> Vec<usize> {
    let known: Vec<MatRef<'_, f64>> = estimation.iter().chain(fresh).filter_map(|s| s.excitation).collect();
    let channels = known.iter().map(|x| x.ncols()).min().unwrap_or(0);
    let moves = |x: &MatRef<'_, f64>, c: usize| x.col(c).iter().any(|v| *v != x[(0, c)]);
    (0..channels).filter(|c| known.iter().any(|x| moves(x, *c))).collect()
}

/// These channels of each record; `None` where the excitation of one is not known.
fn moving_columns(signals: &[LoopSignals<'_>], moving: &[usize]) -> Option<Vec<Mat<f64>>> {
    let of = |x: MatRef<'_, f64>| Mat::from_fn(x.nrows(), moving.len(), |t, c| x[(t, moving[c])]);
    signals.iter().map(|s| s.excitation.map(of)).collect()
}

/// Records with their excitation.
fn pairs<'a>(experiments: &[Experiment<'a>], excitation: &'a [Mat<f64>]) -> Option<Vec<Pair<'a>>> {
    (experiments.len() == excitation.len())
        .then(|| experiments.iter().zip(excitation).map(|(e, x)| (*e, x.as_ref())).collect())
}

/// The halves of a single record; of several each record, of many several together.
fn split<'a>(records: &[Pair<'a>], skip: usize) -> Vec<Vec<Pair<'a>>> {
    if let [(e, x)] = records {
        let (rows, half) = (e.u.nrows(), e.u.nrows() / 2);
        let cut = |from: usize, to: usize| {
            let rows = to - from;
            (Experiment::new(e.u.subrows(from, rows), e.y.subrows(from, rows)), x.subrows(from, rows))
        };
        return vec![vec![cut(0, half)], vec![cut(half.saturating_sub(skip), rows)]];
    }
    let count = records.len().min(MOST_GROUPS);
    (0..count).map(|g| records.iter().skip(g).step_by(count).copied().collect()).collect()
}
