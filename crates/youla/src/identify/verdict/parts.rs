//! Parts of the records against each other and against fresh records: do they ask for the same model, with the same noise?
//!
//! With `[R_k r_k]` the triangular factor of part k and `[R r]` that of all parts together,
//! ```text
//! sum_k |r_k|^2 - |r|^2 ~ chi-square with (K - 1) parameters degrees of freedom
//! ```
//! where one model holds for all parts (G. C. Chow, Econometrica 28 (1960), 591).

use super::limits::{BEYOND_CHANCE, KNOWN, LARGEST_DIFFERENCE, LARGEST_NOISE_RATIO, OVERALL_CHANCE};
use crate::identify::likelihood::Evidence;
use crate::identify::likelihood::choose::problem::{Problem, Solution};
use crate::identify::likelihood::deviation::root::Root;
use crate::identify::likelihood::deviation::{grid, inverse_root};
use crate::identify::likelihood::search::by_output::{Ends, Normal};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::free_gain::with_gain_of;
use crate::identify::likelihood::search::groups::grouped;
use crate::identify::likelihood::search::linearise::{compressed, linearise, stacked};
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::energy;
use crate::identify::likelihood::search::separable::separable;
use crate::identify::likelihood::search::unstable::{self, with_slope_of_growth};
use crate::identify::likelihood::search::{DAMPED, search, with_best_ends};
use crate::identify::subspace::Experiment;
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use faer::{Mat, c64};
use rayon::prelude::*;

/// Pieces of a record with at least so many samples each.
const PIECES: [(usize, usize); 2] = [(8, 1000), (4, 500)];
/// Frequencies of the grid over which a difference is averaged, a fifth of an octave on each side: a resonance that moved is wider.
const WINDOW: usize = 5;
/// Steps of a search on a part.
const STEPS: usize = 15;

/// What a part of the records says of the parameters: a triangular factor, or normal equations by outputs.
#[derive(Clone)]
enum Information {
    Dense(Mat<f64>),
    ByOutput(Normal),
}

/// A part of the records at the model.
struct Part {
    information: Information,
    energy: f64,
    samples: f64,
}

/// The parts of the records against each other and against fresh ones.
pub(crate) struct Parts {
    comparisons: Vec<Comparison>,
    /// How many times the scatter of the parameters over the pieces exceeds what the information of the records says, where that is
    /// beyond chance; else 1.
    pub(crate) scatter: f64,
}

/// Two parts.
struct Comparison {
    which: &'static str,
    /// Chow's statistic in standard deviations beyond chance.
    significance: f64,
    /// Differences of the responses of the models that were searched on each.
    differences: Vec<At>,
    /// Ratio of the noise powers.
    noise: f64,
}

impl Part {
    fn new(problem: &Problem<'_>, solution: &Solution, experiments: &[Experiment<'_>]) -> Option<Part> {
        let found = &solution.chosen.found;
        let spectra = problem.spectra_of(experiments, &solution.chosen.delays);
        if spectra.records.is_empty() {
            return None;
        }
        let point = with_best_ends(&spectra, found.point.model.clone(), &found.noise);
        let chart = Chart::new(&point.model, found.feedthrough);
        let groups = grouped(&spectra, &point, DAMPED);
        let lines = groups.as_ref().unwrap_or(&spectra);
        let information = if separable(spectra.outputs) {
            let slope = unstable::slope(unstable::growth, &spectra, &point.model, &chart);
            let normal = Normal::new(lines, &point, &chart, &found.noise, Ends::Own);
            Information::ByOutput(normal.with_slope(slope).reduced())
        } else {
            let factor = linearise(lines, &point, &chart, &found.noise).factor;
            // A filter that moves with the poles has no growth beside the squares.
            Information::Dense(match found.noise.enters_at_inputs() {
                true => factor,
                false => with_slope_of_growth(factor, &spectra, &point.model, &chart),
            })
        };
        let energy = energy(&spectra, &point.residuals(&spectra), &found.noise);
        Some(Part { information, energy, samples: (spectra.samples() * spectra.outputs) as f64 })
    }

    fn together(parts: &[&Part]) -> Option<Part> {
        let (first, others) = parts.split_first()?;
        let joined = |sum: Information, part: &&Part| match (sum, &part.information) {
            (Information::Dense(a), Information::Dense(b)) => Information::Dense(compressed(&stacked(&a, b))),
            (Information::ByOutput(a), Information::ByOutput(b)) => Information::ByOutput(a.plus(b)),
            (sum, _) => sum,
        };
        let information = others.iter().fold(first.information.clone(), joined);
        let sum = |of: fn(&Part) -> f64| parts.iter().map(|p| of(p)).sum::<f64>();
        Some(Part { information, energy: sum(|p| p.energy), samples: sum(|p| p.samples) })
    }

    /// `|r|^2`, what the parameters of this part alone lower the sum of squares by.
    fn explained(&self, parameters: usize) -> f64 {
        match &self.information {
            Information::Dense(factor) => {
                (0..parameters.min(factor.nrows())).map(|i| factor[(i, parameters)].powi(2)).sum()
            }
            Information::ByOutput(normal) => normal.factor(0.0).explained(),
        }
    }

    /// The step that this part asks for, and the root of its covariance.
    fn step(&self, chart: &Chart, model: &Model) -> (Vec<f64>, Root) {
        let factor = match &self.information {
            Information::Dense(factor) => factor,
            Information::ByOutput(normal) => {
                let arrow = normal.factor(0.0);
                return (arrow.parameters(normal), Root::of_arrow(&arrow, chart, model));
            }
        };
        let parameters = chart.parameters();
        let root = inverse_root(factor, parameters);
        let rows = parameters.min(factor.nrows());
        let gradient = |j: usize| (0..rows).map(|i| factor[(i, j)] * factor[(i, parameters)]).sum::<f64>();
        let gradient: Vec<f64> = (0..parameters).map(gradient).collect();
        let inner: Vec<f64> =
            (0..root.ncols()).map(|k| (0..parameters).map(|j| root[(j, k)] * gradient[j]).sum()).collect();
        let step = (0..parameters).map(|j| (0..root.ncols()).map(|k| root[(j, k)] * inner[k]).sum()).collect();
        (step, Root::dense(root))
    }
}

/// Chow's statistic of some parts, in standard deviations beyond chance, and over its degrees of freedom.
fn chow(parts: &[&Part], parameters: usize) -> Option<(f64, f64)> {
    let whole = Part::together(parts)?;
    let degrees = ((parts.len() - 1) * parameters) as f64;
    let statistic = parts.iter().map(|p| p.explained(parameters)).sum::<f64>() - whole.explained(parameters);
    (degrees > 0.0).then(|| (chi_square_deviations(statistic, degrees), statistic / degrees))
}

impl Parts {
    /// The pieces of the records, and fresh records.
    pub(crate) fn new(problem: &Problem<'_>, solution: &Solution, fresh: &[Experiment<'_>]) -> Self {
        let found = &solution.chosen.found;
        let parameters = Chart::new(&found.point.model, found.feedthrough).parameters();
        let mut halves = [Half::default(), Half::default()];
        let pieces: Vec<(usize, Experiment<'_>)> =
            problem.experiments.iter().flat_map(|e| pieces(e, problem.skip)).collect();
        let of = |(_, piece): &(usize, Experiment<'_>)| Part::new(problem, solution, &[*piece]);
        let parts: Vec<Option<Part>> = pieces.par_iter().map(of).collect();
        for ((half, piece), part) in pieces.into_iter().zip(parts) {
            let Some(part) = part else { continue };
            halves[half].records.push(piece);
            halves[half].parts.push(part);
        }
        let pieces: Vec<&Part> = halves.iter().flat_map(|half| &half.parts).collect();
        let scatter = chow(&pieces, parameters).filter(|(significance, _)| *significance > OVERALL_CHANCE);
        let of = |half: &Half<'_>| Part::together(&half.parts.iter().collect::<Vec<_>>());
        let compared = |which, [a, b]: [Option<&Part>; 2], records: [&[Experiment<'_>]; 2]| {
            let (a, b) = (a?, b?);
            let significance = chow(&[a, b], parameters).map_or(0.0, |(significance, _)| significance);
            let differences = differences([a, b], records, problem, solution, significance > BEYOND_CHANCE);
            let ratio = (b.energy / b.samples) / (a.energy / a.samples).max(TINY);
            Some(Comparison { which, significance, differences, noise: ratio.max(1.0 / ratio) })
        };
        let [first, second] = [of(&halves[0]), of(&halves[1])];
        let [one, two] = [halves[0].records.as_slice(), halves[1].records.as_slice()];
        let mut comparisons = Vec::new();
        comparisons.extend(compared("the two halves of the records", [first.as_ref(), second.as_ref()], [one, two]));
        let (whole, new) = (Part::together(&pieces), Part::new(problem, solution, fresh));
        let which = "the estimation and the verification records";
        comparisons.extend(compared(which, [whole.as_ref(), new.as_ref()], [problem.experiments, fresh]));
        Parts { comparisons, scatter: scatter.map_or(1.0, |(_, ratio)| ratio.max(1.0)) }
    }

    /// Whether halves and fresh records agree: `|S dG| / |G|` over a third of an octave, largest over the frequencies that the excitation shows
    /// (`shown`): elsewhere models of noise would be compared. `s` is the sensitivity in units of the sizes.
    pub(crate) fn evidence(
        &self,
        ts: f64,
        s: &dyn Fn(f64) -> Option<Mat<c64>>,
        shown: &dyn Fn(f64) -> bool,
    ) -> Vec<Evidence> {
        let of = |c: &Comparison| {
            let question = format!(
                "Difference of the models from {}, relative to them, where the feedback does not suppress it (same model)",
                c.which
            );
            let squares = |at: &At| {
                let through = s(at.share).map_or_else(|| at.apart.norm_l2(), |s| (s * &at.apart).norm_l2());
                [through.powi(2) - (at.chance * at.size).powi(2), at.size * at.size, at.share / ts]
            };
            let squares: Vec<[f64; 3]> = c.differences.iter().filter(|at| shown(at.share)).map(squares).collect();
            let sum = |window: &[[f64; 3]], k: usize| window.iter().map(|w| w[k]).sum::<f64>();
            let of =
                |window: &[[f64; 3]]| ((sum(window, 0) / sum(window, 1)).max(0.0).sqrt(), window[window.len() / 2][2]);
            let figures = squares.windows(WINDOW.min(squares.len().max(1))).map(of);
            let (largest, hz) = figures.fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
            let same = Evidence::new(question, largest, LARGEST_DIFFERENCE).beyond_chance(c.significance).at([hz; 2]);
            let noise = format!("Ratio of the noise powers in {} (stationarity)", c.which);
            [same, Evidence::new(noise, c.noise, LARGEST_NOISE_RATIO).reported()]
        };
        self.comparisons.iter().flat_map(of).collect()
    }
}

/// Half of the records in pieces.
#[derive(Default)]
struct Half<'a> {
    records: Vec<Experiment<'a>>,
    parts: Vec<Part>,
}

/// The pieces of a record, each with the half in which it lies.
fn pieces<'a>(e: &Experiment<'a>, skip: usize) -> Vec<(usize, Experiment<'a>)> {
    let rows = e.u.nrows();
    let count = PIECES.iter().find(|(count, least)| rows >= count * least).map_or(2, |(count, _)| *count);
    let piece = |k: usize| {
        let (from, to) = ((k * rows / count).saturating_sub(skip), (k + 1) * rows / count);
        (2 * k / count, Experiment::new(e.u.subrows(from, to - from), e.y.subrows(from, to - from)))
    };
    (0..count).map(piece).collect()
}

/// The difference of the responses of two parts at one frequency, in units of the sizes of the channels.
struct At {
    share: f64,
    /// G of one less that of the other.
    apart: Mat<c64>,
    /// Its deviation by chance, relative to the response.
    chance: f64,
    /// Norm of the response.
    size: f64,
}

/// The differences of the responses of two parts where both know the response. The models are those of a search on each part
/// (`searched`), or the first step of it.
fn differences(
    [a, b]: [&Part; 2],
    records: [&[Experiment<'_>]; 2],
    problem: &Problem<'_>,
    solution: &Solution,
    searched: bool,
) -> Vec<At> {
    let found = &solution.chosen.found;
    let model = &found.point.model;
    let chart = Chart::new(model, found.feedthrough);
    let ((sa, ra), (sb, rb)) = (a.step(&chart, model), b.step(&chart, model));
    let models = searched.then(|| records.map(|records| on(problem, solution, records)));
    let apart = chart.change(model, &sa.iter().zip(&sb).map(|(a, b)| a - b).collect::<Vec<_>>());
    let (p, m) = (problem.outputs(), problem.inputs());
    let matrix = |g: &[c64]| Mat::from_fn(p, m, |i, j| g[i * m + j]);
    let at = |share: f64| {
        let z = c64::cis(std::f64::consts::TAU * share);
        let of = |root: &Root| {
            let (own, shared) = root.seen(&chart, model, z);
            own.iter().map(Mat::squared_norm_l2).sum::<f64>() + shared.squared_norm_l2()
        };
        let variance = of(&ra) + of(&rb);
        let g = model.response(z);
        let norm = |g: &[c64]| g.iter().map(|g| g.norm_sqr()).sum::<f64>().sqrt();
        let (apart, size) = match &models {
            Some([Some(a), Some(b)]) => {
                let (a, b) = (a.response(z), b.response(z));
                (a.iter().zip(&b).map(|(a, b)| a - b).collect(), norm(&a).hypot(norm(&b)) / 2.0_f64.sqrt())
            }
            _ => (model.response_change(&apart, z), norm(&g)),
        };
        let known = variance < (KNOWN * norm(&g)).powi(2);
        known.then(|| At { share, apart: matrix(&apart), chance: variance.sqrt() / size, size })
    };
    grid(solution.samples).into_par_iter().filter_map(at).collect()
}

/// The model of some records, from that of all, on groups of their lines where they are many.
fn on(problem: &Problem<'_>, solution: &Solution, records: &[Experiment<'_>]) -> Option<Model> {
    let choice = &solution.chosen;
    let lines = problem.spectra_of(records, &choice.delays);
    let start = with_best_ends(&lines, choice.found.point.model.clone(), &choice.found.noise);
    let spectra = grouped(&lines, &start, DAMPED).unwrap_or(lines);
    let problem = problem.with_feedthrough(choice.found.feedthrough);
    let options = problem.options(STEPS, 1.0, &choice.delays);
    let of_gain = with_gain_of(&choice.found, &spectra, &start, &options);
    let found = of_gain.or_else(|| search(&spectra, start, Some(&choice.found.noise), &options))?;
    Some(found.point.model)
}
