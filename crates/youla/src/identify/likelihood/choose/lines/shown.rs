//! Disturbances at single frequencies that the records show without a model.
//!
//! Where something else than the excitation puts a line into u and y, a model of y from u passes through `y / u` there, with the feedback
//! the inverse of K: a narrow mode of the plant that puts a pole of the loop on the unit circle. A walk that begins with the line in the
//! records adds such a mode for each. The cosines and sines of u and of y obey `y = G u + cos, sin` whatever G is, so that both are subtracted
//! before the walk, and what G does not make of those of u is the disturbance.

use super::fit::{Line, Residual, WIDEST, amplitudes, of_amplitudes, sharpened, with_sidebands};
use super::{Cleaned, LOWEST, SHAPES, residuals, subtracted};
use crate::identify::likelihood::choose::loads;
use crate::identify::likelihood::choose::problem::{Choice, Problem};
use crate::identify::likelihood::data::spectra::{Mask, Sizes, lines_of, long_enough};
use crate::identify::likelihood::search::driven::NARROW;
use crate::identify::likelihood::search::with_best_ends;
use crate::identify::likelihood::{Candidate, LoopSignals};
use crate::identify::subspace::Experiment;
use crate::lti::Discrete;
use crate::signal::{SpectralLine, spectral_lines};
use faer::{Mat, MatRef, c64};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Probability that a channel of noise shows a line.
const FALSE_ALARM: f64 = 1e-3;
/// Largest part of the lines of a record that do not count for disturbances.
const MOST_MASKED: f64 = 0.1;

/// Frequencies of the lines of inputs and outputs that the excitation does not explain, shares of the sample rate; none where the excitation of a
/// record is not known.
pub(super) fn shown(records: &[Experiment<'_>], known: &[LoopSignals<'_>]) -> Vec<f64> {
    let excitations: Option<Vec<MatRef<'_, f64>>> = known.iter().map(|s| s.excitation).collect();
    let Some(excitations) = excitations.filter(|all| all.len() == records.len()) else { return Vec::new() };
    let Ok(samples) = Discrete::new(1.0) else { return Vec::new() };
    let of = |(e, excitation): (&Experiment<'_>, MatRef<'_, f64>)| {
        let found = spectral_lines(&[e.u, e.y], &[excitation], samples, FALSE_ALARM);
        found.into_iter().flatten()
    };
    let mut found: Vec<SpectralLine> = records.par_iter().zip(excitations).flat_map_iter(of).collect();
    found.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    // Lines of several channels and records are one within a line of the longest record, at the frequency of the strongest.
    let longest = records.iter().map(|e| e.u.nrows()).max().unwrap_or(1) as f64;
    let mut turns: Vec<f64> = Vec::new();
    for line in found {
        if turns.iter().all(|other| (other - line.hz).abs() * longest >= 1.0) {
            turns.push(line.hz);
        }
    }
    turns
}

/// Frequencies of the poles of the loop that are narrower than a line of the records, shares of the sample rate: the mode that stands for a
/// disturbance puts one there, and of a loop that is damped there is no other.
pub(super) fn of_loop(all: &Problem<'_>, now: &Cleaned) -> Vec<f64> {
    let longest = all.experiments.iter().map(|e| e.u.nrows()).max().unwrap_or(1) as f64;
    let choice = &now.solution.chosen;
    let narrow = |z: &c64| z.im > 0.0 && z.norm().ln().abs() * longest < NARROW * TAU;
    let new = |turns: &f64| !now.lines.iter().any(|line| line.near(*turns));
    let poles = all.poles(choice).map(|[_, of_loop]| of_loop).unwrap_or_default();
    poles.iter().filter(|z| narrow(z)).map(|z| z.arg() / TAU).filter(new).collect()
}

/// The model of the records without disturbances at some frequencies; `None` where there are none, where they would take too much of the records,
/// and where a mode of the model is at one of them: the inputs move it on the lines beside.
pub(super) fn without(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    turns: &[f64],
    table: &mut Vec<Candidate>,
) -> Option<Cleaned> {
    let longest = all.experiments.iter().map(|e| e.u.nrows()).max()? as f64;
    let (changes, half) = (SHAPES[0].0, SHAPES[0].1 / longest);
    let line = |turns: &f64| Line { mask: Mask { middle: *turns, half, skirt: 0.0 }, changes };
    let apart = |turns: &&f64| **turns * longest > LOWEST && half <= WIDEST * **turns;
    let lines: Vec<Line> = turns.iter().filter(apart).map(line).collect();
    if lines.is_empty() || 4.0 * half * lines.len() as f64 > MOST_MASKED {
        return None;
    }
    let sines =
        [all.experiments, fresh].map(|records| records.iter().map(|e| sines(e, all.skip, &lines)).collect::<Vec<_>>());
    let pure = [(all.experiments, &sines[0]), (fresh, &sines[1])].map(|(records, sines)| {
        let of = |(e, sines): (&Experiment<'_>, &Vec<Mat<f64>>)| without_sines(e, &lines, sines);
        records.iter().zip(sines).map(of).collect::<Vec<_>>()
    });
    let [estimation, verification] =
        pure.each_ref().map(|all| all.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect::<Vec<_>>());
    let masked: Vec<Mask> = lines.iter().map(|line| line.mask).collect();
    let problem = Problem { experiments: &estimation, masked, ..all.clone() };
    let mut now = loads::solve(&problem, &verification, table)?;
    let choice = now.solution.chosen.clone();
    let moved = |pole: &c64| pole.im > 0.0 && lines.iter().any(|line| line.near(pole.arg() / TAU));
    if choice.found.point.model.poles().iter().any(moved) {
        return None;
    }
    let outputs = [(all.experiments, &sines[0]), (fresh, &sines[1])].map(|(records, sines)| {
        let of =
            |(e, sines): (&Experiment<'_>, &Vec<Mat<f64>>)| without_unexplained(e, &lines, sines, &choice, &all.sizes);
        records.iter().zip(sines).map(of).collect()
    });
    (now.lines, now.outputs) = (lines, Some(outputs));
    // Steps of load act beside the inputs with their lines.
    now.inputs = now.steps.as_ref().map(|steps| loads::inputs(all, fresh, steps));
    let left = [(0, all.experiments), (1, fresh)].map(|(k, records)| {
        let clean = now.records(k, records);
        let problem = now.problem(all, &clean);
        let model = choice.found.point.model.clone();
        let point = with_best_ends(&problem.spectra(&choice.delays), model, &choice.found.noise);
        residuals(&point, &problem, &choice, records)
    });
    now.lines.iter_mut().for_each(|line| line.mask.middle = sharpened(&left[0], line.mask.middle, longest));
    now.outputs = Some([(all.experiments, &left[0]), (fresh, &left[1])].map(|of| subtracted(of, &now.lines)));
    now.lines = with_sidebands(&now.lines, &problem, &choice);
    let records = now.records(0, all.experiments);
    let problem = now.problem(all, &records);
    let spectra = Arc::new(problem.spectra(&choice.delays));
    let (model, origin) = (choice.found.point.model, "without lines that the records show");
    let task = problem.beside(&choice.found.noise, model, &spectra, origin);
    let again = problem.run(vec![task], f64::INFINITY, table);
    now.solution = problem.solve_from(again, table)?;
    Some(now)
}

/// Cosine and sine of each line in the inputs and outputs of a record; none of a record that is too short.
fn sines(e: &Experiment<'_>, skip: usize, lines: &[Line]) -> Vec<Mat<f64>> {
    let (rows, m) = (e.u.nrows(), e.u.ncols());
    if !long_enough(rows, skip) {
        return Vec::new();
    }
    let (samples, channels) = (rows - skip, m + e.y.ncols());
    let of = |t: usize, c: usize| c.checked_sub(m).map_or_else(|| e.u[(t, c)], |i| e.y[(t, i)]);
    let transformed = lines_of(Mat::from_fn(rows, channels, of).as_ref(), skip);
    let of = |k: usize, c: usize| transformed[k * channels + c] * (samples as f64).sqrt();
    amplitudes(&Residual { lines: Mat::from_fn(samples / 2, channels, of), samples }, rows, lines)
}

/// Inputs and outputs without cosine and sine of each line.
fn without_sines(e: &Experiment<'_>, lines: &[Line], sines: &[Mat<f64>]) -> (Mat<f64>, Mat<f64>) {
    if sines.is_empty() {
        return (e.u.to_owned(), e.y.to_owned());
    }
    let all = of_amplitudes(e.u.nrows(), lines, sines);
    (e.u - all.subcols(0, e.u.ncols()), e.y - all.subcols(e.u.ncols(), e.y.ncols()))
}

/// Outputs without what a model does not make, at each line, of cosine and sine of the inputs.
fn without_unexplained(
    e: &Experiment<'_>,
    lines: &[Line],
    sines: &[Mat<f64>],
    choice: &Choice,
    sizes: &Sizes,
) -> Mat<f64> {
    let of = |(line, sines): (&Line, &Mat<f64>)| unexplained(line, sines, choice, sizes);
    let left: Vec<Mat<f64>> = lines.iter().zip(sines).map(of).collect();
    if left.is_empty() { e.y.to_owned() } else { e.y - of_amplitudes(e.y.nrows(), lines, &left) }
}

/// Cosine and sine of the outputs at a line that a model does not make of those of the inputs: `c cos + s sin` is the real part of
/// `(c - i s) exp(i w t)`.
fn unexplained(line: &Line, sines: &Mat<f64>, choice: &Choice, sizes: &Sizes) -> Mat<f64> {
    let z = c64::cis(TAU * line.mask.middle);
    let g = choice.found.point.model.response(z);
    let (m, turn) = (choice.delays.len(), |j: usize| z.powi(-(choice.delays[j] as i32)));
    let phasor = |c: usize| c64::new(sines[(0, c)], -sines[(1, c)]);
    Mat::from_fn(2, sines.ncols() - m, |part, i| {
        let of = |j: usize| g[i * m + j] * turn(j) * phasor(j) / sizes.u[j];
        let made = (0..m).map(of).fold(c64::ZERO, |sum, y| sum + y);
        let left = phasor(m + i) - made * sizes.y[i];
        if part == 0 { left.re } else { -left.im }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Drive;
    use crate::identify::likelihood::{LikelihoodOptions, LoopKnowledge, problem};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const DRIVE: Drive = Drive { pole: 0.98 };

    /// A drive under a periodic excitation with run-out of whole periods in both parts of the record, so that no transient shows it and some of its
    /// lines are those of the excitation: u, y and d.
    fn run_out(seed: u64) -> [Mat<f64>; 3] {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let period: Vec<f64> = (0..2000).map(|_| rng.sample(StandardNormal)).collect();
        let turn = |t: usize, multiple: usize| 0.2 * (TAU * 0.009 * (multiple * t) as f64 + 0.2).sin();
        DRIVE.records(6000, |t| {
            let out: f64 = [1, 2, 3, 5].iter().map(|multiple| turn(t, *multiple)).sum();
            [period[t % period.len()], 0.0, out + 0.02 * rng.sample::<f64, _>(StandardNormal)]
        })
    }

    /// The model of a drive with run-out has no oscillating mode, is trusted, and has its response within 2.5 stated deviations, in six of
    /// six records; the frequencies that are taken out are those of the run-out. A walk that begins with the run-out in the records refuses the first.
    /// With the order given it is the same.
    #[test]
    fn run_out_of_whole_periods_leaves_no_modes() {
        let given = LikelihoodOptions { order: Some(2), ..LikelihoodOptions::default() };
        for (seed, options) in (0..6).map(|seed| (seed, LikelihoodOptions::default())).chain([(0, given)]) {
            let found = DRIVE.recommended(&run_out(seed), &options);
            let poles = found.plant.poles().unwrap();
            let oscillates = poles.iter().any(|z| z.im != 0.0);
            assert!(!oscillates && found.trusted(), "seed {seed}: {poles:?} {:?}", found.reasons());
            let lines = found.evidence.iter().find(|e| e.question.ends_with("(lines)")).unwrap();
            let hz = lines.note.split([' ', ',']).filter_map(|word| word.parse::<f64>().ok()).collect::<Vec<_>>();
            let of_run_out = |hz: &f64| [9.0, 18.0, 27.0, 45.0].iter().any(|line| (hz - line).abs() < 0.01);
            assert!(hz.len() == 4 && hz.iter().all(of_run_out), "seed {seed}: {}", lines.note);
            let error = DRIVE.largest_error(&found);
            assert!(error < 2.5, "seed {seed}: {error}");
        }
    }

    /// The walk that begins with the run-out in the records puts poles of the loop there, and no other one is narrower than a line.
    #[test]
    fn run_out_shows_as_poles_of_the_loop() {
        let k = Drive::controller();
        let mut shown = 0;
        for seed in 0..3 {
            let [u, y, d] = run_out(seed);
            let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
            let (explained, excitation) = (&u - &d, Some(d.as_ref()));
            let signals =
                LoopSignals { seen: y.as_ref(), explained: explained.as_ref(), applied: u.as_ref(), excitation };
            let known = LoopKnowledge::new(Some(&k), Some(&k), vec![signals], Vec::new()).unwrap();
            let all = problem(&experiment, Some(&known), &LikelihoodOptions::default()).unwrap();
            let walked = loads::solve(&all, &[], &mut Vec::new()).unwrap();
            let found = of_loop(&all, &walked);
            let of_run_out = |turns: &f64| [0.009, 0.018, 0.027, 0.045].iter().any(|line| (turns - line).abs() < 1e-5);
            assert!(found.iter().all(of_run_out), "seed {seed}: {found:?}");
            shown += found.len();
        }
        assert!(shown > 3, "{shown}");
    }

    /// No disturbance is named where what excites the records is not known, nor where the excitation has the lines.
    #[test]
    fn lines_of_the_excitation_are_no_disturbances() {
        let [u, y, d] = run_out(0);
        let turn = |t: usize, multiple: usize| (TAU * 0.009 * (multiple * t) as f64).sin();
        let turns = Mat::from_fn(u.nrows(), 2, |t, j| match j {
            0 => d[(t, 0)],
            _ => [1, 2, 3, 5].iter().map(|multiple| turn(t, *multiple)).sum(),
        });
        let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
        let [u, y, d] = [u.as_ref(), y.as_ref(), d.as_ref()];
        let count =
            |excitation| shown(&experiment, &[LoopSignals { seen: y, explained: u, applied: u, excitation }]).len();
        assert_eq!((count(Some(d)), count(Some(turns.as_ref())), count(None)), (4, 0, 0));
        assert!(shown(&experiment, &[]).is_empty());
    }
}
