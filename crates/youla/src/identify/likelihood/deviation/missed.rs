//! What the model misses of the response, as the excitation shows it band by band, without any model of it.
//!
//! ```text
//! Delta G = S_vx S_xx^-1 S_xu (S_ux S_xx^-1 S_xu)^-1,      v = y - G u,   x the external excitation
//! ```
//! The excitation is an instrument: it is independent of the noise, so that `Delta G` has mean zero where G is right, with variance
//! `Phi_v (S_ux S_xx^-1 S_xu)^-1`. What exceeds this is error of the model: nonlinear friction, a plant that drifts, missing modes.

use crate::identify::likelihood::choose::problem::Choice;
use crate::identify::likelihood::data::spectra::{Spectra, lines_of, long_enough};
use crate::identify::likelihood::search::noise::Noise;
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use faer::{Mat, MatRef, Side, c64};

/// Lines of a band, over all records.
const LINES: usize = 48;
/// Directions of the excitation with less than this share of its mean power are left out.
const WEAK: f64 = 1e-4;
/// Half width of the window over which the error is averaged, as a ratio of frequencies (a third of an octave in all), and the
/// least number of bands in it.
const WINDOW: (f64, usize) = (1.122, 5);
/// Standard deviations beyond chance from which an error is taken to be one.
const BEYOND_CHANCE: f64 = 3.0;

/// Standard deviations by which the mean over a window must exceed chance.
const TOLD: f64 = 2.0;

/// Sums of products over the lines of a band.
struct Sums {
    xx: Mat<c64>,
    ux: Mat<c64>,
    vx: Mat<c64>,
}

/// The error of a band.
#[derive(Debug, Clone)]
struct Band {
    share: f64,
    /// `|Delta G|^2` less its variance, entry by entry.
    excess: Vec<f64>,
    /// That variance.
    variance: Vec<f64>,
}

/// The error of the model beyond what noise explains.
#[derive(Debug, Clone)]
pub(crate) struct Missed {
    bands: Vec<Band>,
    /// By how many standard deviations the errors of all bands exceed chance.
    pub(crate) significance: f64,
}

impl Missed {
    /// Mean square of the error of each entry of G near a frequency (share of the sample rate) beyond what chance explains.
    pub(crate) fn near(&self, share: f64, entries: usize) -> Vec<f64> {
        let (mut sum, mut chance) = (vec![0.0; entries], vec![0.0; entries]);
        let near = self.window(share);
        for band in near {
            sum.iter_mut().zip(&band.excess).for_each(|(s, e)| *s += e / near.len() as f64);
            chance.iter_mut().zip(&band.variance).for_each(|(s, v)| *s += (v / near.len() as f64).powi(2));
        }
        sum.iter_mut().zip(chance).for_each(|(s, c)| *s = if *s > TOLD * c.sqrt() { *s } else { 0.0 });
        sum
    }

    /// The largest mean square of this error that the excitation does not refute: what it shows with its own variance. Zero where
    /// chance explains the errors of all bands.
    pub(crate) fn at_most(&self, share: f64, entries: usize) -> Vec<f64> {
        let mut sum = vec![0.0; entries];
        let near = self.window(share);
        for band in near {
            let all = band.excess.iter().zip(&band.variance);
            sum.iter_mut().zip(all).for_each(|(s, (e, v))| *s += (e + v) / near.len() as f64);
        }
        sum
    }

    /// The bands around a frequency; none where chance explains the errors of all.
    fn window(&self, share: f64) -> &[Band] {
        if self.significance <= BEYOND_CHANCE {
            return &[];
        }
        let (from, to) = (share / WINDOW.0, share * WINDOW.0);
        let mut first = self.bands.partition_point(|b| b.share < from);
        let mut end = self.bands.partition_point(|b| b.share <= to);
        while end - first < WINDOW.1.min(self.bands.len()) {
            first = first.saturating_sub(1);
            end = (end + 1).min(self.bands.len());
        }
        &self.bands[first..end]
    }
}

/// The error that the excitation shows, one matrix per record without their first `skip` samples.
pub(crate) fn missed(spectra: &Spectra, choice: &Choice, excitation: &[MatRef<'_, f64>], skip: usize) -> Missed {
    let (m, p) = (spectra.inputs, spectra.outputs);
    let lines: usize = spectra.records.iter().map(|r| r.z.len()).sum();
    let count = (lines / LINES).max(1);
    let sums = sums(spectra, choice, excitation, skip, count);
    let power = |s: &Mat<c64>| (0..s.nrows()).map(|i| s[(i, i)].re).sum::<f64>();
    let least = WEAK * sums.iter().map(|s| power(&s.xx)).sum::<f64>() / count as f64;
    let (mut statistic, mut degrees, mut bands) = (0.0, -(choice.found.parameters as f64), Vec::new());
    let mut filters = vec![c64::ZERO; p];
    for (band, sums) in sums.iter().enumerate() {
        let share = 0.5 * (band as f64 + 0.5) / count as f64;
        choice.found.noise.filters(c64::cis(std::f64::consts::TAU * share), &mut filters);
        let noise = spectrum(&choice.found.noise, &filters);
        let Some(found) = error_of(sums, least, &noise) else { continue };
        statistic += found.statistic;
        degrees += found.degrees;
        if found.degrees == (2 * m * p) as f64 {
            bands.push(Band { share, excess: found.excess, variance: found.variance });
        }
    }
    Missed { bands, significance: if degrees > 0.0 { chi_square_deviations(statistic, degrees) } else { 0.0 } }
}

/// Powers of the noise of each output.
fn spectrum(noise: &Noise, filters: &[c64]) -> Vec<f64> {
    filters.iter().enumerate().map(|(i, a)| noise.covariance[(i, i)] / a.norm_sqr().max(TINY)).collect()
}

fn sums(spectra: &Spectra, choice: &Choice, excitation: &[MatRef<'_, f64>], skip: usize, count: usize) -> Vec<Sums> {
    let (m, p) = (spectra.inputs, spectra.outputs);
    let q = excitation.first().map_or(0, |x| x.ncols());
    let zeros = |rows: usize| Mat::<c64>::zeros(rows, q);
    let mut all: Vec<Sums> = (0..count).map(|_| Sums { xx: zeros(q), ux: zeros(m), vx: zeros(p) }).collect();
    let residuals = choice.found.point.residuals(spectra);
    let used = excitation.iter().filter(|x| long_enough(x.nrows(), skip));
    for ((lines, v), x) in spectra.records.iter().zip(&residuals).zip(used) {
        let x = lines_of(*x, skip);
        let total = lines.z.len();
        for k in 0..total {
            let sums = &mut all[(k * count / total).min(count - 1)];
            for a in 0..q {
                let xa = x[k * q + a].conj();
                (0..q).for_each(|b| sums.xx[(b, a)] += x[k * q + b] * xa);
                (0..m).for_each(|j| sums.ux[(j, a)] += lines.u[k * m + j] * xa);
                (0..p).for_each(|i| sums.vx[(i, a)] += v[k * p + i] * xa);
            }
        }
    }
    all
}

/// Chi-square of a band, its degrees of freedom and the excess of each entry.
struct BandError {
    statistic: f64,
    degrees: f64,
    excess: Vec<f64>,
    variance: Vec<f64>,
}

fn error_of(sums: &Sums, least: f64, noise: &[f64]) -> Option<BandError> {
    let (m, p) = (sums.ux.nrows(), sums.vx.nrows());
    let eigen = sums.xx.self_adjoint_eigen(Side::Lower).ok()?;
    let strong: Vec<usize> = (0..sums.xx.nrows()).filter(|k| eigen.S()[*k].re > least).collect();
    let root = |of: &Mat<c64>| {
        let along = of * eigen.U();
        Mat::from_fn(of.nrows(), strong.len(), |i, k| along[(i, strong[k])] / eigen.S()[strong[k]].re.sqrt())
    };
    let (u, v) = (root(&sums.ux), root(&sums.vx));
    let svd = u.thin_svd().ok()?;
    let sizes: Vec<f64> = (0..m.min(strong.len())).map(|k| svd.S()[k].re).collect();
    let rank = sizes.iter().filter(|s| **s > 0.03 * sizes[0]).count();
    // v V: the error along each direction of the excited inputs, with the variance of the noise
    let along = &v * svd.V();
    let mut out = BandError {
        statistic: 0.0,
        degrees: (2 * rank * p) as f64,
        excess: vec![0.0; p * m],
        variance: vec![0.0; p * m],
    };
    for i in 0..p {
        (0..rank).for_each(|k| out.statistic += 2.0 * along[(i, k)].norm_sqr() / noise[i].max(TINY));
        for j in 0..m {
            let g = (0..rank).fold(c64::ZERO, |sum, k| sum + along[(i, k)] / sizes[k] * svd.U()[(j, k)].conj());
            let variance: f64 = (0..rank).map(|k| noise[i] * (svd.U()[(j, k)].norm() / sizes[k]).powi(2)).sum();
            out.excess[i * m + j] = g.norm_sqr() - variance;
            out.variance[i * m + j] = variance;
        }
    }
    (rank > 0).then_some(out)
}
