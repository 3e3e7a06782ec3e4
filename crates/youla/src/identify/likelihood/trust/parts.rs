//! Parts of the records against each other.

use super::super::Evidence;
use super::super::chart::Chart;
use super::super::deviation::inverse_root;
use super::super::linearise::linearise;
use super::super::point::energy;
use super::super::problem::{Problem, Solution};
use super::super::search::with_best_ends;
use super::super::spectra::Spectra;
use super::excess;
use crate::identify::subspace::Experiment;
use faer::Mat;

/// Triangular factor of a part of the records at the model.
struct Part {
    factor: Mat<f64>,
    energy: f64,
    samples: f64,
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
        Some(Part { factor: linearised.factor, energy, samples: (spectra.samples() * spectra.outputs) as f64 })
    }

    /// Chi-square of the difference of the parameters that two parts ask for, as excess; and how often it exceeds its mean.
    fn against(&self, other: &Part, parameters: usize) -> f64 {
        let wanted = |part: &Part| {
            let root = inverse_root(&part.factor, parameters);
            // Newton step = root root' R' r
            let gradient: Vec<f64> = (0..parameters)
                .map(|j| {
                    (0..parameters.min(part.factor.nrows()))
                        .map(|i| part.factor[(i, j)] * part.factor[(i, parameters)])
                        .sum()
                })
                .collect();
            let inner: Vec<f64> =
                (0..root.ncols()).map(|k| (0..parameters).map(|j| root[(j, k)] * gradient[j]).sum()).collect();
            let step: Vec<f64> =
                (0..parameters).map(|j| (0..root.ncols()).map(|k| root[(j, k)] * inner[k]).sum()).collect();
            (step, &root * root.transpose())
        };
        let ((a, ca), (b, cb)) = (wanted(self), wanted(other));
        let covariance = ca + cb;
        let Ok(eigen) = covariance.self_adjoint_eigen(faer::Side::Lower) else { return 0.0 };
        let (u, s) = (eigen.U(), eigen.S().column_vector());
        let statistic: f64 = (0..parameters)
            .map(|k| {
                let along: f64 = (0..parameters).map(|j| u[(j, k)] * (a[j] - b[j])).sum();
                along * along / s[k].max(1e-14 * s[parameters - 1])
            })
            .sum();
        excess(statistic, parameters as f64)
    }
}

/// Do both halves of the record, and fresh records, ask for the same parameters, with the same noise?
pub(crate) fn parts(problem: &Problem<'_>, solution: &Solution, fresh: &[Experiment<'_>]) -> Vec<Evidence> {
    let half = |second: bool| -> Vec<Experiment<'_>> {
        let cut = |e: &Experiment<'_>| {
            let (rows, middle) = (e.u.nrows(), e.u.nrows() / 2);
            let (from, count) = if second { (middle, rows - middle) } else { (0, middle) };
            (from, count)
        };
        problem
            .experiments
            .iter()
            .map(|e| {
                let (f, c) = cut(e);
                Experiment { u: e.u.subrows(f, c), y: e.y.subrows(f, c) }
            })
            .collect()
    };
    let parameters = Chart::new(&solution.chosen.found.point.model, solution.chosen.found.feedthrough).parameters();
    let (first, second) = (Part::new(problem, solution, &half(false)), Part::new(problem, solution, &half(true)));
    let mut out = Vec::new();
    let mut compare = |a: &Option<Part>, b: &Option<Part>, question: &str, noise: &str| {
        if let (Some(a), Some(b)) = (a, b) {
            out.push(Evidence::new(question, a.against(b, parameters), 5.0));
            let ratio = (b.energy / b.samples) / (a.energy / a.samples).max(1e-300);
            out.push(Evidence::new(noise, ratio.max(1.0 / ratio), 1.3));
        }
    };
    compare(
        &first,
        &second,
        "Do the halves of the records ask for other parameters, in standard deviations beyond chance?",
        "How many times is the noise of one half of the records that of the other (powers)?",
    );
    if !fresh.is_empty() {
        let all = Part::new(problem, solution, problem.experiments);
        let new = Part::new(problem, solution, fresh);
        compare(
            &all,
            &new,
            "Do fresh records ask for other parameters, in standard deviations beyond chance?",
            "How many times is the noise of fresh records that of the others (powers)?",
        );
    }
    out
}
