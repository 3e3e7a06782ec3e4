//! One mode more: the pair of poles, of a grid, that explains most of what a model leaves.
//!
//! For each pair `lambda, conj lambda` the residues R (p x m) are fitted to the whitened residual by least squares,
//! ```text
//! E = (R / (z - lambda) + conj R / (z - conj lambda)) U,
//! ```
//! the best grid points become starts with the dominant pair of directions of R (rank one adds two states).

use crate::identify::likelihood::data::lanes::{LANES, Lanes, add_real_product};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::groups::grouped;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::Point;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side, c64};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

/// Damping ratios of the grid.
const DAMPINGS: [f64; 3] = [0.02, 0.1, 0.4];

/// Blocks of two states that promise most, the best first, with the decrease of the sum of squares that they promise.
pub(crate) fn modes(spectra: &Spectra, point: &Point, noise: &Noise, count: usize) -> Vec<(f64, Block)> {
    let groups = grouped(spectra, point, DAMPINGS[0]);
    let spectra = groups.as_ref().unwrap_or(spectra);
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
    let fits = Fits::new(spectra, &point.residuals(spectra), noise);
    let mut found: Vec<(f64, c64, Mat<f64>)> =
        grid.into_par_iter().filter_map(|pole| fits.at(pole).map(|(g, r)| (g, pole, r))).collect();
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

/// Whitened residuals, and inputs seen through the filters of each output; cross terms of the noise are left out.
struct Fits<'a> {
    spectra: &'a Spectra,
    whitened: Vec<Vec<c64>>,
    gains: Vec<Vec<c64>>,
}

impl<'a> Fits<'a> {
    fn new(spectra: &'a Spectra, residuals: &[Vec<c64>], noise: &Noise) -> Self {
        let (mut whitened, mut gains) = (Vec::new(), Vec::new());
        for (lines, v) in spectra.records.iter().zip(residuals) {
            let gain = noise.of_each_output(lines);
            whitened.push(v.iter().zip(&gain).map(|(v, g)| v * g).collect());
            gains.push(gain);
        }
        Fits { spectra, whitened, gains }
    }

    /// Decrease and residues for a pole.
    fn at(&self, pole: c64) -> Option<(f64, Mat<f64>)> {
        let (m, p) = (self.spectra.inputs, self.spectra.outputs);
        let (mut promised, mut residues) = (0.0, Mat::<f64>::zeros(2 * m, p));
        let (mut gram, cross) = Arch::new().dispatch(Normal { fits: self, pole });
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

/// The normal equations for a pole, a Gram matrix per output and the products with its residual, with the widest instructions that the
/// processor has.
struct Normal<'a> {
    fits: &'a Fits<'a>,
    pole: c64,
}

impl NullaryFnOnce for Normal<'_> {
    type Output = (Vec<Mat<f64>>, Mat<f64>);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Normal { fits: Fits { spectra, whitened, gains }, pole } = self;
        let (m, p) = (spectra.inputs, spectra.outputs);
        let size = 2 * m;
        let mut gram = vec![[0.0; LANES]; p * size * size];
        let mut cross = vec![[0.0; LANES]; p * size];
        let mut columns = vec![Lanes::ZERO; size];
        for ((lines, e), gains) in spectra.records.iter().zip(whitened).zip(gains) {
            let total = lines.z.len();
            for first in (0..total).step_by(LANES) {
                // Lines beyond the last repeat it with a gain of zero.
                let line = |l: usize| (first + l).min(total - 1);
                let z = Lanes::gather(|l| lines.z[line(l)]);
                let (one, two) = (z.plus(-pole).inverse(), z.plus(-pole.conj()).inverse());
                let (even, mut odd) = (one.sum(&two), two.scaled(-1.0).sum(&one));
                (odd.re, odd.im) = (odd.im.map(|v| -v), odd.re);
                for j in 0..m {
                    let u = Lanes::gather(|l| lines.u[line(l) * m + j]);
                    (columns[j], columns[m + j]) = (even.times(&u), odd.times(&u));
                }
                for o in 0..p {
                    let at = |of: &[c64], l: usize| if first + l < total { of[(first + l) * p + o] } else { c64::ZERO };
                    let gain = Lanes::gather(|l| at(gains, l));
                    let seen = gain.conj().times(&Lanes::gather(|l| at(e, l)));
                    for a in 0..size {
                        let weighed = columns[a].times(&gain);
                        add_real_product(&mut cross[o * size + a], &columns[a], &seen);
                        for b in 0..=a {
                            add_real_product(&mut gram[(o * size + a) * size + b], &weighed, &columns[b].times(&gain));
                        }
                    }
                }
            }
        }
        let total = |lanes: &[f64; LANES]| lanes.iter().sum::<f64>();
        let of = |o: usize| Mat::from_fn(size, size, |a, b| total(&gram[(o * size + a) * size + b]));
        ((0..p).map(of).collect(), Mat::from_fn(size, p, |a, o| total(&cross[o * size + a])))
    }
}
