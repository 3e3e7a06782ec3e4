//! One mode more: the pair of poles, of a grid, that explains most of what a model leaves.
//!
//! For each pair `lambda, conj lambda` the residues R (p x m) are fitted to the whitened residual by least squares,
//! ```text
//! E = (R / (z - lambda) + conj R / (z - conj lambda)) U,
//! ```
//! the best grid points become starts with the dominant pair of directions of R (rank one adds two states).

use super::block::Block;
use super::model::Model;
use super::noise::Noise;
use super::spectra::Spectra;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side, c64};

/// Damping ratios of the grid.
const DAMPINGS: [f64; 3] = [0.02, 0.1, 0.4];

/// Blocks of two states that promise most, the best first, with the decrease of the sum of squares that they promise.
pub(crate) fn modes(spectra: &Spectra, residuals: &[Vec<c64>], noise: &Noise, count: usize) -> Vec<(f64, Block)> {
    let samples = spectra.samples().max(16) as f64;
    let lowest = (12.0 / samples).max(1e-4);
    let mut grid = Vec::new();
    for damping in DAMPINGS {
        let mut share = lowest;
        while share < 0.48 {
            let w = std::f64::consts::TAU * share;
            grid.push(c64::cis(w * (1.0_f64 - damping * damping).sqrt()) * (-damping * w).exp());
            share *= 1.0 + 1.5 * damping;
        }
    }
    let fits = Fits::new(spectra, residuals, noise);
    let mut found: Vec<(f64, c64, Mat<f64>)> =
        grid.into_iter().filter_map(|pole| fits.at(pole).map(|(g, r)| (g, pole, r))).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<(f64, c64, Mat<f64>)> = Vec::new();
    for candidate in found {
        let far = chosen.iter().all(|c| (c.1.arg() / candidate.1.arg()).ln().abs() > 0.2);
        if far && chosen.len() < count {
            chosen.push(candidate);
        }
    }
    let (m, p) = (spectra.inputs, spectra.outputs);
    chosen.into_iter().filter_map(|(gain, pole, residues)| Some((gain, block(pole, &residues, m, p)?))).collect()
}

/// Appends a block to a model.
pub(crate) fn with_block(model: &Model, block: Block) -> Model {
    let mut wider = model.clone();
    wider.blocks.push(block);
    wider
}

/// The rank-one block of residues, `[Re R; Im R]` stacked by inputs: 2 m x p.
fn block(pole: c64, residues: &Mat<f64>, m: usize, p: usize) -> Option<Block> {
    let r = Mat::<c64>::from_fn(p, m, |i, j| c64::new(residues[(j, i)], residues[(m + j, i)]));
    let svd = r.svd().ok()?;
    let size = svd.S().column_vector()[0].re.sqrt();
    let left = |i: usize| svd.U()[(i, 0)] * size;
    let right = |j: usize| svd.V()[(j, 0)].conj() * size;
    let mut b = vec![0.0; 2 * m];
    let mut c = vec![0.0; 2 * p];
    for j in 0..m {
        (b[j], b[m + j]) = (right(j).re, right(j).im);
    }
    for i in 0..p {
        (c[2 * i], c[2 * i + 1]) = (2.0 * left(i).re, -2.0 * left(i).im);
    }
    Some(Block { states: 2, a: vec![pole.re, -pole.im, pole.im, pole.re], b, c })
}

/// Whitened residuals, and inputs seen through the filters of each output; cross terms of the covariance are left out.
struct Fits<'a> {
    spectra: &'a Spectra,
    whitened: Vec<Vec<c64>>,
    gains: Vec<Vec<c64>>,
}

impl<'a> Fits<'a> {
    fn new(spectra: &'a Spectra, residuals: &[Vec<c64>], noise: &Noise) -> Self {
        let p = spectra.outputs;
        let (mut whitened, mut gains) = (Vec::new(), Vec::new());
        for (lines, v) in spectra.records.iter().zip(residuals) {
            let mut gain = vec![c64::ZERO; v.len()];
            for (k, z) in lines.z.iter().enumerate() {
                noise.filters(*z, &mut gain[k * p..(k + 1) * p]);
                for i in 0..p {
                    gain[k * p + i] *= lines.weight[k] / noise.covariance[(i, i)].sqrt();
                }
            }
            whitened.push(v.iter().zip(&gain).map(|(v, g)| v * g).collect());
            gains.push(gain);
        }
        Fits { spectra, whitened, gains }
    }

    /// Decrease and residues for a pole.
    fn at(&self, pole: c64) -> Option<(f64, Mat<f64>)> {
        let (m, p) = (self.spectra.inputs, self.spectra.outputs);
        let (mut promised, mut residues) = (0.0, Mat::<f64>::zeros(2 * m, p));
        let mut gram = vec![Mat::<f64>::zeros(2 * m, 2 * m); p];
        let mut cross = Mat::<f64>::zeros(2 * m, p);
        let mut columns = vec![c64::ZERO; 2 * m];
        for ((lines, e), gains) in self.spectra.records.iter().zip(&self.whitened).zip(&self.gains) {
            for (k, z) in lines.z.iter().enumerate() {
                let (one, two) = ((z - pole).inv(), (z - pole.conj()).inv());
                let (even, odd) = (one + two, c64::new(0.0, 1.0) * (one - two));
                for j in 0..m {
                    let u = lines.u[k * m + j];
                    (columns[j], columns[m + j]) = (even * u, odd * u);
                }
                for o in 0..p {
                    let g = gains[k * p + o];
                    let power = g.norm_sqr();
                    let seen = g.conj() * e[k * p + o];
                    for a in 0..2 * m {
                        let conj = columns[a].conj();
                        cross[(a, o)] += (conj * seen).re;
                        for b in 0..=a {
                            gram[o][(a, b)] += power * (conj * columns[b]).re;
                        }
                    }
                }
            }
        }
        for o in 0..p {
            (0..2 * m).for_each(|a| gram[o][(a, a)] *= 1.0 + 1e-9);
            let factor = gram[o].llt(Side::Lower).ok()?;
            let right = cross.subcols(o, 1).to_owned();
            let solved = factor.solve(&right);
            promised += (right.transpose() * &solved)[(0, 0)];
            residues.subcols_mut(o, 1).copy_from(&solved);
        }
        promised.is_finite().then_some((promised, residues))
    }
}
