//! Nonlinear functions at the inputs.

use super::super::Evidence;
use super::super::chart::Chart;
use super::super::linearise::{Extra, linearise_with};
use super::super::problem::Solution;
use super::super::spectra::Spectra;
use super::excess;
use faer::c64;
use rustfft::FftPlanner;

/// Does a nonlinear function of the input, or of the velocity, act at the input?
pub(crate) fn nonlinear(spectra: &Spectra, solution: &Solution) -> Evidence {
    let found = &solution.chosen.found;
    let (m, p) = (spectra.inputs, spectra.outputs);
    let model = &found.point.model;
    let residuals = found.point.residuals(spectra);
    let functions: usize = 4;
    let count = functions * m;
    let mut planner = FftPlanner::new();
    let mut values = Vec::new();
    for (lines, residual) in spectra.records.iter().zip(&residuals) {
        let (samples, half) = (lines.samples, lines.z.len());
        let (forward, inverse) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
        let root = (samples as f64).sqrt();
        let in_time = |pick: &dyn Fn(usize) -> c64| {
            let mut work = vec![c64::ZERO; samples];
            for k in 0..half {
                let v = pick(k);
                work[k + 1] = v;
                work[samples - 1 - k] = v.conj();
            }
            inverse.process(&mut work);
            work.iter().map(|v| v.re / root).collect::<Vec<f64>>()
        };
        let mut columns = vec![c64::ZERO; half * p * count];
        let responses: Vec<Vec<c64>> = lines.z.iter().map(|z| model.response(*z)).collect();
        for j in 0..m {
            let u = in_time(&|k| lines.u[k * m + j]);
            // velocity of the output that this input moves most
            let power = |i: usize| responses.iter().map(|g| g[i * m + j].norm_sqr()).sum::<f64>();
            let seen = (0..p).max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(0);
            let clean = in_time(&|k| (lines.y[k * p + seen] - residual[k * p + seen]) * (c64::ONE - lines.z[k].conj()));
            let size = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len().max(1) as f64).sqrt().max(1e-300);
            let (su, sv) = (size(&u), size(&clean));
            let shapes: [&dyn Fn(usize) -> f64; 4] =
                [&|t| (u[t] / su).powi(3), &|t| (u[t] / su) * (u[t] / su).abs(), &|t| (u[t] / su).powi(2), &|t| {
                    (clean[t] / (0.1 * sv)).tanh()
                }];
            for (f, shape) in shapes.iter().enumerate() {
                let mut work: Vec<c64> = (0..samples).map(|t| c64::new(shape(t) / root, 0.0)).collect();
                forward.process(&mut work);
                for k in 0..half {
                    for i in 0..p {
                        columns[(k * p + i) * count + f * m + j] = responses[k][i * m + j] * work[k + 1];
                    }
                }
            }
        }
        values.push(columns);
    }
    let chart = Chart::new(model, found.feedthrough);
    let linearised =
        linearise_with(spectra, &found.point, &chart, &found.noise, &Extra { count, values: &values, quick: false });
    let (parameters, factor) = (chart.parameters(), &linearised.factor);
    let statistic: f64 =
        (parameters..(parameters + count).min(factor.nrows())).map(|i| factor[(i, parameters + count)].powi(2)).sum();
    Evidence::new(
        "Does a nonlinear function at the inputs explain what the model leaves, in standard deviations beyond chance?",
        excess(statistic, count as f64),
        5.0,
    )
}
