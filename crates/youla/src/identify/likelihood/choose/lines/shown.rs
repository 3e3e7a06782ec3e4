//! Disturbances at single frequencies that the records show without a model.
//!
//! Where something else than the excitation puts a line into u and y, a model of y from u passes through `y / u` there, with the feedback
//! the inverse of K: a narrow mode of the plant that puts a pole of the loop on the unit circle. A walk that begins with the line in the
//! records adds such a mode for each. The cosines and sines of u and of y obey `y = G u + cos, sin` whatever G is, so that both are subtracted
//! before the walk, and what G does not make of those of u is the disturbance.

use super::fit::{Line, Residual, WIDEST, amplitudes, of_amplitudes, sharpened, with_sidebands};
use super::{Cleaned, LOWEST, SHAPES, residuals, subtracted};
use crate::identify::likelihood::choose::loads::{self, Steps, loaded};
use crate::identify::likelihood::choose::problem::{Choice, Problem, Task};
use crate::identify::likelihood::data::spectra::{Mask, Sizes, lines_of, long_enough};
use crate::identify::likelihood::search::driven::NARROW;
use crate::identify::likelihood::search::{with_best_ends, with_best_inputs};
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
pub(crate) fn shown(records: &[Experiment<'_>], known: Option<&[LoopSignals<'_>]>) -> Vec<f64> {
    let excitations: Option<Vec<MatRef<'_, f64>>> = known.unwrap_or_default().iter().map(|s| s.excitation).collect();
    let Some(excitations) = excitations.filter(|all| all.len() == records.len()) else { return Vec::new() };
    let Ok(samples) = Discrete::new(1.0) else { return Vec::new() };
    let column = |x: MatRef<'_, f64>, j: usize| x.col(j).iter().copied().collect::<Vec<f64>>();
    let of = |(e, x): (&Experiment<'_>, MatRef<'_, f64>)| {
        let known: Vec<Vec<f64>> = (0..x.ncols()).map(|j| column(x, j)).collect();
        let known: Vec<&[f64]> = known.iter().map(Vec::as_slice).collect();
        let channels = (0..e.u.ncols()).map(|j| column(e.u, j)).chain((0..e.y.ncols()).map(|j| column(e.y, j)));
        channels.flat_map(|values| spectral_lines(&values, &known, samples, FALSE_ALARM)).collect::<Vec<_>>()
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
    let seen: Vec<Seen> = all.experiments.iter().map(|e| Seen::new(e, all)).collect();
    let line = |turns: &f64| Line { mask: Mask { middle: *turns, half, skirt: 0.0 }, changes };
    let apart = |turns: &&f64| **turns * longest > LOWEST && half <= WIDEST * **turns;
    let lines: Vec<Line> = turns.iter().filter(apart).map(line).collect();
    if lines.is_empty() || all.order.is_some() || 4.0 * half * lines.len() as f64 > MOST_MASKED {
        return None;
    }
    let fresh_seen: Vec<Seen> = fresh.iter().map(|e| Seen::new(e, all)).collect();
    let sines = [&seen, &fresh_seen].map(|seen| seen.iter().map(|s| s.amplitudes(&lines)).collect::<Vec<_>>());
    let pure = [(all.experiments, &sines[0]), (fresh, &sines[1])].map(|(records, sines)| {
        let of = |(e, sines): (&Experiment<'_>, &Vec<Mat<f64>>)| without_sines(e, &lines, sines, &all.sizes);
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
    let whole = |steps: &Steps| [(all.experiments, &steps[0]), (fresh, &steps[1])].map(|(e, steps)| loaded(e, steps));
    now.inputs = now.steps.as_ref().map(whole);
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
    let start = with_best_inputs(&spectra, choice.found.point.model, &choice.found.noise, problem.feedthrough);
    let task = Task { spectra, start, delays: choice.delays, origin: "without lines that the records show".into() };
    let again = problem.run(vec![task], f64::INFINITY, table);
    now.solution = problem.solve_from(again, table)?;
    Some(now)
}

/// Inputs and outputs of a record over their sizes, on its lines; `None` where it has none.
struct Seen {
    residual: Option<Residual>,
    rows: usize,
}

impl Seen {
    fn new(e: &Experiment<'_>, all: &Problem<'_>) -> Self {
        let (rows, m) = (e.u.nrows(), e.u.ncols());
        let of = |t: usize, c: usize| match c.checked_sub(m) {
            None => e.u[(t, c)] / all.sizes.u[c],
            Some(i) => e.y[(t, i)] / all.sizes.y[i],
        };
        let residual = long_enough(rows, all.skip).then(|| {
            let channels = m + e.y.ncols();
            let lines = lines_of(Mat::from_fn(rows, channels, of).as_ref(), all.skip);
            let samples = rows - all.skip;
            let root = (samples as f64).sqrt();
            Residual { lines: Mat::from_fn(samples / 2, channels, |k, c| lines[k * channels + c] * root), samples }
        });
        Seen { residual, rows }
    }

    /// Cosine and sine of each line, by channel.
    fn amplitudes(&self, lines: &[Line]) -> Vec<Mat<f64>> {
        self.residual.as_ref().map_or_else(Vec::new, |residual| amplitudes(residual, self.rows, lines))
    }
}

/// Inputs and outputs without cosine and sine of each line.
fn without_sines(e: &Experiment<'_>, lines: &[Line], sines: &[Mat<f64>], sizes: &Sizes) -> (Mat<f64>, Mat<f64>) {
    let m = e.u.ncols();
    let sine = of_amplitudes(e.u.nrows(), lines, sines);
    let u = |t: usize, j: usize| e.u[(t, j)] - sine[(t, j)] * sizes.u[j];
    let y = |t: usize, i: usize| e.y[(t, i)] - sine[(t, m + i)] * sizes.y[i];
    match sines.is_empty() {
        true => (e.u.to_owned(), e.y.to_owned()),
        false => (Mat::from_fn(e.u.nrows(), m, u), Mat::from_fn(e.y.nrows(), e.y.ncols(), y)),
    }
}

/// Outputs without what a model does not make, at each line, of cosine and sine of the inputs.
fn without_unexplained(
    e: &Experiment<'_>,
    lines: &[Line],
    sines: &[Mat<f64>],
    choice: &Choice,
    sizes: &Sizes,
) -> Mat<f64> {
    let left: Vec<Mat<f64>> = lines.iter().zip(sines).map(|(line, sine)| unexplained(line, sine, choice)).collect();
    let sine = of_amplitudes(e.y.nrows(), lines, &left);
    let y = |t: usize, i: usize| e.y[(t, i)] - sine[(t, i)] * sizes.y[i];
    if left.is_empty() { e.y.to_owned() } else { Mat::from_fn(e.y.nrows(), e.y.ncols(), y) }
}

/// Cosine and sine of the outputs at a line that a model does not make of those of the inputs: `c cos + s sin` is the real part of
/// `(c - i s) exp(i w t)`.
fn unexplained(line: &Line, sines: &Mat<f64>, choice: &Choice) -> Mat<f64> {
    let z = c64::cis(TAU * line.mask.middle);
    let g = choice.found.point.model.response(z);
    let (m, turn) = (choice.delays.len(), |j: usize| z.powi(-(choice.delays[j] as i32)));
    let phasor = |c: usize| c64::new(sines[(0, c)], -sines[(1, c)]);
    Mat::from_fn(2, sines.ncols() - m, |part, i| {
        let made = (0..m).map(|j| g[i * m + j] * turn(j) * phasor(j)).fold(c64::ZERO, |sum, y| sum + y);
        let left = phasor(m + i) - made;
        if part == 0 { left.re } else { -left.im }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::{LikelihoodOptions, LoopKnowledge, recommend};
    use crate::lti::StateSpace;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SAMPLES: usize = 6000;

    /// A drive under `u = -8 y + 7.2 y(t-1) + d`, d periodic, with run-out of whole periods in both records, so that no transient shows it and some of
    /// its lines are those of d: u, y and d.
    fn run_out(seed: u64) -> [Mat<f64>; 3] {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let (mut x, mut v, mut before) = (0.0, 0.0, 0.0);
        let period: Vec<f64> = (0..2000).map(|_| rng.sample(StandardNormal)).collect();
        let mut rows = Vec::with_capacity(SAMPLES);
        for t in 0..SAMPLES {
            let turn = |multiple: usize, size: f64| size * (TAU * 0.009 * (multiple * t) as f64 + size).sin();
            let d = period[t % period.len()];
            let out = turn(1, 0.2) + turn(2, 0.2) + turn(3, 0.2) + turn(5, 0.2);
            let y = x + out + 0.02 * rng.sample::<f64, _>(StandardNormal);
            let u = d - 8.0 * y + 7.2 * before;
            rows.push([u, y, d]);
            before = y;
            x += v;
            v = 0.98 * v + 0.01 * u;
        }
        [0, 1, 2].map(|j| Mat::from_fn(SAMPLES, 1, |t, _| rows[t][j]))
    }

    /// The model of a drive with run-out has no oscillating mode, is trusted, and has its response within 2.5 stated deviations, in six of
    /// six records; the frequencies that are taken out are those of the run-out. A walk that begins with the run-out in the records refuses the first.
    #[test]
    fn run_out_of_whole_periods_leaves_no_modes() {
        let time = Discrete::new(1e-3).unwrap();
        let matrix = |value: f64| Mat::from_fn(1, 1, |_, _| value);
        let k = StateSpace::new(matrix(0.0), matrix(1.0), matrix(7.2), matrix(-8.0), time).unwrap();
        for seed in 0..6 {
            let [u, y, d] = run_out(seed);
            let explained = &u - &d;
            let part = |from: usize, rows: usize| {
                let [u, y, d, explained] = [&u, &y, &d, &explained].map(|x| x.subrows(from, rows));
                (Experiment::new(u, y), LoopSignals { seen: y, explained, applied: u, excitation: Some(d) })
            };
            let ((estimation, first), (fresh, second)) = (part(0, 4000), part(4000, 2000));
            let known = LoopKnowledge::new(Some(&k), Some(&k), vec![first], vec![second]).unwrap();
            let options = LikelihoodOptions::default();
            let found = recommend(&[estimation], &[fresh], Some(&known), time, &options).unwrap();
            let poles = found.plant.poles().unwrap();
            let oscillates = poles.iter().any(|z| z.im != 0.0);
            assert!(!oscillates && found.trusted(), "seed {seed}: {poles:?} {:?}", found.reasons());
            let lines = found.evidence.iter().find(|e| e.question.ends_with("(lines)")).unwrap();
            let hz = lines.note.split([' ', ',']).filter_map(|word| word.parse::<f64>().ok()).collect::<Vec<_>>();
            let of_run_out = |hz: &f64| [9.0, 18.0, 27.0, 45.0].iter().any(|line| (hz - line).abs() < 0.01);
            assert!(hz.len() == 4 && hz.iter().all(of_run_out), "seed {seed}: {}", lines.note);
            for share in [0.002, 0.005, 0.01, 0.02, 0.05, 0.1] {
                let z = c64::cis(TAU * share);
                let truth = 0.01 / ((z - 1.0) * (z - 0.98));
                let omega = TAU * share / time.ts();
                let response = crate::lti::frequency_response(&found.plant, &[omega]).unwrap().at(0)[(0, 0)];
                let [rr, _, ii] = found.region.at(share / time.ts()).entries().covariance((0, 0));
                let z = (response - truth).norm() / (rr + ii).sqrt();
                assert!(z < 2.5, "seed {seed}, {share}: {z}");
            }
        }
    }

    /// No disturbance is named where what excites the records is not known, nor where the excitation has the lines.
    #[test]
    fn lines_of_the_excitation_are_no_disturbances() {
        let [u, y, d] = run_out(0);
        let turn = |t: usize, multiple: usize| (TAU * 0.009 * (multiple * t) as f64).sin();
        let turns = Mat::from_fn(SAMPLES, 2, |t, j| match j {
            0 => d[(t, 0)],
            _ => [1, 2, 3, 5].iter().map(|multiple| turn(t, *multiple)).sum(),
        });
        let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
        let [u, y, d] = [u.as_ref(), y.as_ref(), d.as_ref()];
        let count = |excitation| {
            shown(&experiment, Some(&[LoopSignals { seen: y, explained: u, applied: u, excitation }])).len()
        };
        assert_eq!((count(Some(d)), count(Some(turns.as_ref())), count(None)), (4, 0, 0));
        assert!(shown(&experiment, None).is_empty());
    }
}
