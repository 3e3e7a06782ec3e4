//! What the known loop says: controller and excitation.

use super::super::Evidence;
use super::super::model::Model;
use super::super::noise::Noise;
use super::super::problem::Solution;
use super::super::search::with_best_ends;
use super::super::spectra::{Lines, Sizes, Spectra};
use super::excess;
use crate::identify::subspace::Experiment;
use crate::lti::{Discrete, StateSpace};
use faer::{Mat, MatRef, c64};
use rustfft::FftPlanner;

/// Bands in which residual and excitation are compared.
const BANDS: usize = 40;

/// Whitened residuals of the lines, lines x p.
fn whitened(lines: &Lines, residual: &[c64], noise: &Noise) -> Vec<c64> {
    let p = noise.root.nrows();
    let mut filters = vec![c64::ZERO; p];
    let mut out = vec![c64::ZERO; residual.len()];
    for (k, z) in lines.z.iter().enumerate() {
        noise.filters(*z, &mut filters);
        for i in 0..p {
            for j in 0..=i {
                out[k * p + i] += filters[j] * residual[k * p + j] * noise.root[(i, j)];
            }
        }
    }
    out
}

/// Lines of further signals, samples x channels, without their first `skip` samples.
pub(crate) fn lines_of(signal: MatRef<'_, f64>, skip: usize) -> Vec<c64> {
    let (samples, q) = (signal.nrows().saturating_sub(skip), signal.ncols());
    let count = samples / 2;
    let mut out = vec![c64::ZERO; count * q];
    if samples < 2 {
        return out;
    }
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let root = (samples as f64).sqrt();
    for j in 0..q {
        let mut work: Vec<c64> = (0..samples).map(|t| c64::new(signal[(t + skip, j)] / root, 0.0)).collect();
        fft.process(&mut work);
        (0..count).for_each(|k| out[k * q + j] = work[k + 1]);
    }
    out
}

/// Does the excitation explain what the model leaves? Chi-square over bands, as excess in standard deviations.
pub(crate) fn residual_and_excitation(
    spectra: &Spectra,
    solution: &Solution,
    excitation: &[MatRef<'_, f64>],
    skip: usize,
) -> Evidence {
    let found = &solution.chosen.found;
    let residuals = found.point.residuals(spectra);
    let p = spectra.outputs;
    let (mut statistic, mut degrees) = (0.0, -(found.parameters as f64));
    for ((lines, residual), x) in spectra.records.iter().zip(&residuals).zip(excitation) {
        let q = x.ncols();
        let x = lines_of(*x, skip);
        let e = whitened(lines, residual, &found.noise);
        let count = lines.z.len();
        let total: f64 = x.iter().map(|v| v.norm_sqr()).sum::<f64>() / count.max(1) as f64;
        for band in 0..BANDS {
            let (from, to) = (band * count / BANDS, (band + 1) * count / BANDS);
            let mut gram = Mat::<c64>::zeros(q, q);
            let mut cross = Mat::<c64>::zeros(q, p);
            for k in from..to {
                for a in 0..q {
                    let xa = x[k * q + a].conj();
                    (0..q).for_each(|b| gram[(a, b)] += xa * x[k * q + b]);
                    (0..p).for_each(|i| cross[(a, i)] += xa * e[k * p + i]);
                }
            }
            let Ok(eigen) = gram.self_adjoint_eigen(faer::Side::Lower) else { continue };
            let (u, s) = (eigen.U(), eigen.S().column_vector());
            for l in 0..q {
                if s[l].re < 1e-4 * total * (to - from) as f64 {
                    continue;
                }
                for i in 0..p {
                    let along = (0..q).fold(c64::ZERO, |sum, a| sum + u[(a, l)].conj() * cross[(a, i)]);
                    statistic += 2.0 * along.norm_sqr() / s[l].re;
                    degrees += 2.0;
                }
            }
        }
    }
    Evidence::new(
        "Does the excitation explain what the model leaves, in standard deviations beyond chance?",
        excess(statistic, degrees),
        5.0,
    )
}

/// How well a controller explains the inputs: rms of `u - K (y - r) - d` over rms of `u - d`, ends of the records free.
pub(crate) fn controller(
    controller: &StateSpace<Discrete>,
    records: &[(MatRef<'_, f64>, MatRef<'_, f64>)],
) -> Option<Evidence> {
    let experiments: Vec<Experiment<'_>> = records.iter().map(|(from, to)| Experiment { u: *from, y: *to }).collect();
    let (m, p) = (controller.inputs(), controller.outputs());
    let d = (0..p * m).map(|x| controller.d()[(x / m, x % m)]).collect();
    let model = Model::of(controller.a(), controller.b(), controller.c(), d)?;
    let sizes = Sizes { u: vec![1.0; m], y: vec![1.0; p] };
    let spectra = Spectra::new(&experiments, &sizes, &vec![0; m], 0);
    let point = with_best_ends(&spectra, model, &Noise::white(p));
    let power = |v: &[Vec<c64>]| v.iter().flatten().map(|x| x.norm_sqr()).sum::<f64>();
    let left = power(&point.residuals(&spectra));
    let all: f64 = spectra.records.iter().map(|r| r.y.iter().map(|x| x.norm_sqr()).sum::<f64>()).sum();
    Some(Evidence::new(
        "Which share of the inputs does the stated controller not explain?",
        (left / all.max(1e-300)).sqrt(),
        0.05,
    ))
}
