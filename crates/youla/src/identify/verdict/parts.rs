//! Parts of the records against each other and against fresh records: do they ask for the same model, with the same noise?
//!
//! With `[R_k r_k]` the triangular factor of part k and `[R r]` that of all parts together,
//! ```text
//! sum_k |r_k|^2 - |r|^2 ~ chi-square with (K - 1) parameters degrees of freedom
//! ```
//! where one model holds for all parts (G. C. Chow, Econometrica 28 (1960), 591).

use super::limits::{KNOWN, LARGEST_DIFFERENCE, LARGEST_NOISE_RATIO, OVERALL_CHANCE};
use crate::identify::likelihood::Evidence;
use crate::identify::likelihood::choose::problem::{Problem, Solution};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::deviation::{grid, inverse_root};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::linearise::{compressed, linearise, stacked};
use crate::identify::likelihood::search::point::energy;
use crate::identify::likelihood::search::{with_best_ends, with_slope_of_unstable};
use crate::identify::subspace::Experiment;
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use faer::{Mat, c64};

/// Pieces of a record with at least so many samples each.
const PIECES: [(usize, usize); 2] = [(8, 1000), (4, 500)];
/// Triangular factor of a part of the records at the model.
struct Part {
    factor: Mat<f64>,
    energy: f64,
    samples: f64,
}

/// The parts of the records.
pub(crate) struct Parts {
    halves: [Option<Part>; 2],
    whole: Option<Part>,
    fresh: Option<Part>,
    parameters: usize,
    /// How many times the scatter of the parameters over the pieces exceeds what the information of the records says, where that is
    /// beyond chance; else 1.
    pub(crate) scatter: f64,
}

impl Part {
    fn new(problem: &Problem<'_>, solution: &Solution, experiments: &[Experiment<'_>]) -> Option<Part> {
        let found = &solution.chosen.found;
        let spectra = Spectra::new(experiments, &problem.sizes, &solution.chosen.delays, problem.skip);
        if spectra.records.is_empty() {
            return None;
        }
        let point = with_best_ends(&spectra, found.point.model.clone(), &found.noise);
        let chart = Chart::new(&point.model, found.feedthrough);
        let linearised = linearise(&spectra, &point, &chart, &found.noise);
        let energy = energy(&spectra, &point.residuals(&spectra), &found.noise);
        let factor = with_slope_of_unstable(linearised.factor, &spectra, &point.model, &chart);
        Some(Part { factor, energy, samples: (spectra.samples() * spectra.outputs) as f64 })
    }

    fn together(parts: &[&Part]) -> Option<Part> {
        let (first, others) = parts.split_first()?;
        let mut factor = first.factor.clone();
        others.iter().for_each(|part| factor = compressed(&stacked(&factor, &part.factor)));
        let sum = |of: fn(&Part) -> f64| parts.iter().map(|p| of(p)).sum::<f64>();
        Some(Part { factor, energy: sum(|p| p.energy), samples: sum(|p| p.samples) })
    }

    /// `|r|^2`, what the parameters of this part alone lower the sum of squares by.
    fn explained(&self, parameters: usize) -> f64 {
        (0..parameters.min(self.factor.nrows())).map(|i| self.factor[(i, parameters)].powi(2)).sum()
    }

    /// The step that this part asks for, and the root of its covariance.
    fn step(&self, parameters: usize) -> (Vec<f64>, Mat<f64>) {
        let root = inverse_root(&self.factor, parameters);
        let rows = parameters.min(self.factor.nrows());
        let gradient = |j: usize| (0..rows).map(|i| self.factor[(i, j)] * self.factor[(i, parameters)]).sum::<f64>();
        let gradient: Vec<f64> = (0..parameters).map(gradient).collect();
        let inner: Vec<f64> =
            (0..root.ncols()).map(|k| (0..parameters).map(|j| root[(j, k)] * gradient[j]).sum()).collect();
        let step = (0..parameters).map(|j| (0..root.ncols()).map(|k| root[(j, k)] * inner[k]).sum()).collect();
        (step, root)
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
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for e in problem.experiments {
            let rows = e.u.nrows();
            let count = PIECES.iter().find(|(count, least)| rows >= count * least).map_or(2, |(count, _)| *count);
            for k in 0..count {
                let (from, to) = ((k * rows / count).saturating_sub(problem.skip), (k + 1) * rows / count);
                let piece = Experiment::new(e.u.subrows(from, to - from), e.y.subrows(from, to - from));
                let part = Part::new(problem, solution, &[piece]);
                if k < count / 2 { first.extend(part) } else { second.extend(part) }
            }
        }
        let pieces: Vec<&Part> = first.iter().chain(&second).collect();
        let scatter = chow(&pieces, parameters).filter(|(significance, _)| *significance > OVERALL_CHANCE);
        let refs = |parts: &'_ [Part]| Part::together(&parts.iter().collect::<Vec<_>>());
        Parts {
            halves: [refs(&first), refs(&second)],
            whole: Part::together(&pieces),
            fresh: if fresh.is_empty() { None } else { Part::new(problem, solution, fresh) },
            parameters,
            scatter: scatter.map_or(1.0, |(_, ratio)| ratio.max(1.0)),
        }
    }

    /// Whether halves and fresh records agree.
    pub(crate) fn evidence(&self, solution: &Solution) -> Vec<Evidence> {
        let mut out = Vec::new();
        if let [Some(a), Some(b)] = &self.halves {
            out.extend(self.compared(a, b, "the two halves of the records", solution));
        }
        if let (Some(a), Some(b)) = (&self.whole, &self.fresh) {
            out.extend(self.compared(a, b, "the estimation and the verification records", solution));
        }
        out
    }

    fn compared(&self, a: &Part, b: &Part, which: &str, solution: &Solution) -> [Evidence; 2] {
        let significance = chow(&[a, b], self.parameters).map_or(0.0, |(significance, _)| significance);
        let question = format!("Difference of the models from {which}, relative to them, beyond chance (same model)");
        let same = Evidence::new(question, self.difference(a, b, solution), LARGEST_DIFFERENCE);
        let ratio = (b.energy / b.samples) / (a.energy / a.samples).max(TINY);
        let noise = format!("Ratio of the noise powers in {which} (stationarity)");
        [same.beyond_chance(significance), Evidence::new(noise, ratio.max(1.0 / ratio), LARGEST_NOISE_RATIO)]
    }

    /// Root mean square over frequency of the relative difference of the responses of two parts, less what chance explains, where
    /// both know the response.
    fn difference(&self, a: &Part, b: &Part, solution: &Solution) -> f64 {
        let found = &solution.chosen.found;
        let model = &found.point.model;
        let chart = Chart::new(model, found.feedthrough);
        let ((sa, ra), (sb, rb)) = (a.step(self.parameters), b.step(self.parameters));
        let (mut sum, mut count) = (0.0, 0);
        for share in grid(solution.samples) {
            let z = c64::cis(std::f64::consts::TAU * share);
            let slopes = chart.response_slopes(model, z);
            let size: f64 = model.response(z).iter().map(|g| g.norm_sqr()).sum();
            let along = |i: usize, v: &dyn Fn(usize) -> f64| {
                (0..slopes.ncols()).fold(c64::ZERO, |s, j| s + slopes[(i, j)] * v(j)).norm_sqr()
            };
            let of = |root: &Mat<f64>, i: usize| (0..root.ncols()).map(|c| along(i, &|j| root[(j, c)])).sum::<f64>();
            let entries = 0..slopes.nrows();
            let variance: f64 = entries.clone().map(|i| of(&ra, i) + of(&rb, i)).sum();
            if variance < KNOWN * KNOWN * size {
                let apart: f64 = entries.map(|i| along(i, &|j| sa[j] - sb[j])).sum();
                sum += (apart - variance) / size;
                count += 1;
            }
        }
        if count > 0 { (sum / f64::from(count)).max(0.0).sqrt() } else { 0.0 }
    }
}
