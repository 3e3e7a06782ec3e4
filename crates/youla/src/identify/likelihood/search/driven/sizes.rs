//! The most likely variances of noise at the inputs and of the sensors of several outputs.
//!
//! ```text
//! minus the logarithm of the likelihood:  sum n (log det Phi + tr (Phi^-1 P)),     Phi = sum_j q_j M_j + diag(r)
//! ```
//! over bins of n lines with the mean power P of the residuals and the mean M_j of `g_j g_j*` for the column g_j of the plant, times that of the
//! colour (P. Whittle, The analysis of multiple stationary time series, J. R. Stat. Soc. B 15 (1953), 125), by Fisher's scoring in the logarithms
//! of q, r and 1 - c from what is most likely of each output alone. The colour is scored as well: autoregressions of single outputs do not mend
//! what a wrong one does to their cross spectra.

use super::gains::{LINES, Responses, hidden, longest};
use super::kalman::Entry;
use super::size::size;
use crate::identify::likelihood::data::lanes::Lanes;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::autoregression::{Regression, ends_of_bins};
use crate::identify::likelihood::search::block::{Block, invert};
use crate::identify::likelihood::search::model::Model;
use crate::linalg::{Damping, Trial};
use faer::prelude::*;
use faer::{Mat, Side, c64};
use pulp::Arch;
use std::sync::LazyLock;

/// Poles c of noise with a colour from which the most likely one is sought, with corners 1 - c from 0.1 down to 1e-4 rad per sample, a factor of 3
/// apart.
const COLOURS: [f64; 6] = [0.9, 0.97, 0.99, 0.997, 0.999, 0.9999];

/// Largest width of a bin, rad per sample: enough for a few variances.
const WIDTH: f64 = 0.03;
/// Steps at most, and decrease of the cost below which there are no further ones: the likelihood is flat to half a nat.
const STEPS: usize = 12;
const FLAT: f64 = 0.5;
/// Largest change of a logarithm in a step.
const LARGEST: f64 = 3.0;
/// Least and largest corner 1 - c of a colour, rad per sample: below, the noise is a random walk, above it is white.
const CORNERS: [f64; 2] = [1e-5, 0.5];
/// Variance of a sensor over the mean power of its residual at least: rounding.
const LEAST: f64 = 1e-9;

/// Lines of about one frequency.
struct Bin {
    /// Number of lines of the full circle.
    count: f64,
    /// Mean of 1 / z.
    back: c64,
    /// Sum of the power of the residuals, p x p.
    power: Vec<c64>,
    /// M_j one after the other, p x p each.
    gains: Vec<c64>,
}

/// The power of residuals and what the plant makes of white noise at each input.
pub(crate) struct Bins {
    inputs: usize,
    outputs: usize,
    bins: Vec<Bin>,
}

/// Cosines of the ends of the bins.
static ENDS: LazyLock<Vec<f64>> = LazyLock::new(|| ends_of_bins(WIDTH));

impl Bins {
    /// Of the residuals of a model, lines x p per record.
    pub(crate) fn new(model: &Model, spectra: &Spectra, residuals: &[Vec<c64>]) -> Self {
        let (m, p) = (model.inputs, model.outputs);
        let empty =
            || Bin { count: 0.0, back: c64::ZERO, power: vec![c64::ZERO; p * p], gains: vec![c64::ZERO; m * p * p] };
        let mut bins: Vec<Bin> = (0..ENDS.len()).map(|_| empty()).collect();
        let all = vec![hidden(model, longest(spectra), 0..p); p];
        let blocks: Vec<Block> = model.blocks.iter().map(Block::quickened).collect();
        let every = spectra.lines().div_ceil(LINES).max(1);
        for (lines, v) in spectra.records.iter().zip(residuals) {
            let z: Vec<c64> = lines.z.iter().step_by(every).copied().collect();
            let mut bin = 0;
            let each = |at: usize, (g, lane): (&[Lanes], usize)| {
                let k = at * every;
                let g = |x: usize| c64::new(g[x].re[lane], g[x].im[lane]);
                while lines.z[k].re < ENDS[bin] {
                    bin += 1;
                }
                let bin = &mut bins[bin];
                let (share, twice) = (lines.share[k], lines.weight[k].powi(2));
                bin.count += share;
                bin.back += lines.z[k].conj() * share;
                for i in 0..p {
                    for l in 0..p {
                        bin.power[i * p + l] += v[k * p + i] * v[k * p + l].conj() * twice;
                        for j in 0..m {
                            bin.gains[(j * p + i) * p + l] += g(i * m + j) * g(l * m + j).conj() * share;
                        }
                    }
                }
            };
            Arch::new().dispatch(Responses { blocks: &blocks, inputs: m, hidden: &all, z: &z, each });
        }
        bins.retain(|bin| bin.count > 0.0);
        for Bin { count, back, power, gains } in &mut bins {
            *back /= back.norm();
            gains.iter_mut().for_each(|g| *g /= *count);
            (*count, _) = (*count * every as f64, power.iter_mut().for_each(|v| *v *= every as f64));
        }
        Bins { inputs: m, outputs: p, bins }
    }

    /// The most likely variances and colour, with autoregressions behind them; `None` where white noise of the sensors alone has the lesser
    /// criterion of Schwarz at every output.
    pub(super) fn entry(&self, behind: &[Regression], samples: f64, coloured: bool) -> Option<Entry> {
        let p = self.outputs;
        let whitened = |bin: &Bin| {
            let filter: Vec<c64> = behind.iter().map(|regression| regression.at(bin.back)).collect();
            (0..p * p).map(|x| filter[x / p] * bin.power[x] * filter[x % p].conj() / bin.count).collect()
        };
        let powers: Vec<Vec<c64>> = self.bins.iter().map(whitened).collect();
        let mut best = self.alone(&powers, samples, None);
        for pole in COLOURS.iter().filter(|_| coloured) {
            let other = self.alone(&powers, samples, Some(*pole));
            if other.0 < best.0 - samples.ln() {
                best = other;
            }
        }
        let (_, entry) = best;
        self.together(&powers, entry?)
    }

    /// The sum of the costs of the outputs with noise at the inputs of each by itself, and the variances of these.
    fn alone(&self, powers: &[Vec<c64>], samples: f64, colour: Option<f64>) -> (f64, Option<Entry>) {
        let (m, p) = (self.inputs, self.outputs);
        let (mut total, mut sensors, mut at_inputs) = (0.0, Vec::with_capacity(p), Vec::with_capacity(p));
        for i in 0..p {
            let of_bin = |(bin, power): (&Bin, &Vec<c64>)| {
                let gain: f64 = (0..m).map(|j| bin.gains[(j * p + i) * p + i].re).sum();
                [bin.count, power[i * p + i].re * bin.count, gain * shape(colour, bin.back)]
            };
            let lines: Vec<[f64; 3]> = self.bins.iter().zip(powers).map(of_bin).collect();
            let (cost, ratio) = size(&lines, samples);
            let count: f64 = lines.iter().map(|line| line[0]).sum();
            let power = |ratio: f64| lines.iter().map(|line| line[1] / (1.0 + ratio * line[2])).sum::<f64>() / count;
            let sensor = power(ratio.unwrap_or(0.0));
            at_inputs.extend(ratio.map(|ratio| (ratio * sensor).ln()));
            sensors.push(sensor);
            total += cost;
        }
        let mean = at_inputs.iter().sum::<f64>() / at_inputs.len().max(1) as f64;
        let usable = !at_inputs.is_empty() && mean.is_finite() && sensors.iter().all(|s| *s > 0.0);
        (total, usable.then(|| Entry { inputs: vec![mean.exp(); m], sensors, colour, free: Vec::new() }))
    }

    /// The most likely variances of all together.
    fn together(&self, powers: &[Vec<c64>], start: Entry) -> Option<Entry> {
        let (m, p) = (self.inputs, self.outputs);
        let count: f64 = self.bins.iter().map(|bin| bin.count).sum();
        let mean = |i: usize| {
            self.bins.iter().zip(powers).map(|(b, power)| b.count * power[i * p + i].re).sum::<f64>() / count
        };
        let least: Vec<f64> = (0..p).map(|i| (LEAST * mean(i)).ln()).collect();
        let corner = start.colour.map(|pole| 1.0 - pole);
        let mut sizes: Vec<f64> = start.inputs.iter().chain(&start.sensors).chain(&corner).map(|v| v.ln()).collect();
        let free = sizes.len();
        let mut now = self.scored(powers, &sizes)?;
        let mut damping = Damping::new(1e-3);
        for _ in 0..STEPS {
            let (value, slope, information) = &now;
            let lower = damping.descend(|damping| {
                let damped = |i: usize, j: usize| information[(i, j)] * if i == j { 1.0 + damping } else { 1.0 };
                let ridge = |i: usize, j: usize| damped(i, j) + if i == j { f64::MIN_POSITIVE } else { 0.0 };
                let Ok(factor) = Mat::from_fn(free, free, ridge).llt(Side::Lower) else { return Trial::Negligible };
                let step = factor.solve(slope);
                let promised = 0.5 * (slope.transpose() * &step)[(0, 0)];
                if promised.is_nan() || promised < FLAT {
                    return Trial::Negligible;
                }
                let mut moved: Vec<f64> =
                    sizes.iter().enumerate().map(|(a, v)| v - step[(a, 0)].clamp(-LARGEST, LARGEST)).collect();
                moved[m..].iter_mut().zip(&least).for_each(|(v, least)| *v = v.max(*least));
                moved[m + p..].iter_mut().for_each(|v| *v = v.clamp(CORNERS[0].ln(), CORNERS[1].ln()));
                match self.scored(powers, &moved) {
                    Some(scored) if scored.0 < *value => {
                        let ratio = (value - scored.0) / promised;
                        Trial::Lower { point: (moved, scored), ratio }
                    }
                    _ => Trial::Rejected,
                }
            });
            let Some((moved, scored)) = lower else { break };
            (sizes, now) = (moved, scored);
        }
        // K has the ratios alone.
        let mean = sizes[m..m + p].iter().sum::<f64>() / p as f64;
        let of = |range: &[f64]| range.iter().map(|v| (v - mean).exp()).collect();
        let colour = sizes.get(m + p).map(|v| 1.0 - v.exp());
        Some(Entry { inputs: of(&sizes[..m]), sensors: of(&sizes[m..m + p]), colour, free: Vec::new() })
    }

    /// The cost of logarithms of variances and of the corner of the colour, its slope and the lower triangle of Fisher's information; `None` where a
    /// spectrum is singular.
    fn scored(&self, powers: &[Vec<c64>], sizes: &[f64]) -> Option<(f64, Mat<f64>, Mat<f64>)> {
        let (m, p, count) = (self.inputs, self.outputs, sizes.len());
        let colour = sizes.get(m + p).map(|v| 1.0 - v.exp());
        let (mut cost, mut slope, mut information) = (0.0, Mat::zeros(count, 1), Mat::zeros(count, count));
        let variances: Vec<f64> = sizes.iter().map(|v| v.exp()).collect();
        let (mut inverse, mut rest) = (vec![c64::ZERO; p * p], vec![c64::ZERO; p * p]);
        // Phi^-1 dPhi of the inputs and of the colour; that of a sensor is a column of Phi^-1.
        let places: Vec<usize> = (0..m).chain(m + p..count).collect();
        let mut parts = vec![c64::ZERO; places.len() * p * p];
        for (Bin { count: lines, back, gains, .. }, power) in self.bins.iter().zip(powers) {
            let shape = shape(colour, *back);
            let spectrum = |i: usize, l: usize| {
                let torque = (0..m).fold(c64::ZERO, |sum, j| sum + gains[(j * p + i) * p + l] * variances[j] * shape);
                if i == l { torque + variances[m + i] } else { torque }
            };
            let determinant = invert(p, spectrum, &mut inverse);
            product(p, &inverse, power, &mut rest);
            let trace = |v: &[c64]| (0..p).map(|i| v[i * p + i].re).sum::<f64>();
            cost += lines * (determinant.ln() + trace(&rest));
            let (of_inputs, of_colour) = parts.split_at_mut(m * p * p);
            for (j, part) in of_inputs.chunks_mut(p * p).enumerate() {
                product(p, &inverse, &gains[j * p * p..(j + 1) * p * p], part);
                part.iter_mut().for_each(|v| *v *= variances[j] * shape);
            }
            if let Some(pole) = colour {
                // Slope of the logarithm of the shape in that of 1 - c.
                let along = -2.0 * (1.0 - pole) * (*back / (c64::ONE - back * pole)).re;
                let torque = |x: usize| (0..m).fold(c64::ZERO, |sum, j| sum + of_inputs[j * p * p + x]);
                of_colour.iter_mut().enumerate().for_each(|(x, v)| *v = torque(x) * along);
            }
            let both = |a: &[c64], b: &[c64]| {
                let mut sum = 0.0;
                (0..p * p).for_each(|x| sum += (a[x] * b[x % p * p + x / p]).re);
                sum
            };
            // tr (v Phi^-1 dPhi) of the sensor i.
            let at_sensor = |v: &[c64], i: usize| {
                variances[m + i] * (0..p).map(|l| (v[i * p + l] * inverse[l * p + i]).re).sum::<f64>()
            };
            for (a, part) in places.iter().zip(parts.chunks(p * p)) {
                slope[(*a, 0)] += lines * (trace(part) - both(part, &rest));
                for (b, other) in places.iter().zip(parts.chunks(p * p)).filter(|(b, _)| *b <= a) {
                    information[(*a, *b)] += lines * both(part, other);
                }
                (0..p).for_each(|i| information[((*a).max(m + i), (*a).min(m + i))] += lines * at_sensor(part, i));
            }
            for i in 0..p {
                slope[(m + i, 0)] += lines * (variances[m + i] * inverse[i * p + i].re - at_sensor(&rest, i));
                for l in 0..=i {
                    let power = variances[m + i] * variances[m + l] * inverse[i * p + l].norm_sqr();
                    information[(m + i, m + l)] += lines * power;
                }
            }
        }
        cost.is_finite().then_some((cost, slope, information))
    }
}

/// `1 / |1 - c / z|^2`, of white noise 1.
fn shape(colour: Option<f64>, back: c64) -> f64 {
    colour.map_or(1.0, |pole| 1.0 / (c64::ONE - back * pole).norm_sqr())
}

/// The product of two p x p matrices.
fn product(p: usize, a: &[c64], b: &[c64], out: &mut [c64]) {
    for x in 0..p * p {
        out[x] = (0..p).fold(c64::ZERO, |sum, l| sum + a[x / p * p + l] * b[l * p + x % p]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::data::spectra::Sizes;
    use crate::identify::subspace::Experiment;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SAMPLES: usize = 20_000;

    /// Two masses on a beam, positions measured, both pushed by slow torque of variances 1 and 0.04, sensors of 1e-4 and 4e-4: the second of
    /// two equal periods, so that its ends are alike.
    fn pushed() -> (Model, Mat<f64>) {
        let a = Mat::from_fn(4, 4, |i, j| {
            [[1.0, 0.0, 0.1, 0.0], [0.0, 1.0, 0.0, 0.1], [-0.06, 0.05, 0.95, 0.0], [0.05, -0.07, 0.0, 0.95]][i][j]
        });
        let b = Mat::from_fn(4, 2, |i, j| if i == j + 2 { 0.1 } else { 0.0 });
        let c = Mat::from_fn(2, 4, |i, j| if i == j { 1.0 } else { 0.0 });
        let rng = &mut ChaCha8Rng::seed_from_u64(3);
        let normal = Mat::from_fn(SAMPLES, 4, |_, _| rng.sample::<f64, _>(StandardNormal));
        let (mut x, mut w, mut y) = (Mat::<f64>::zeros(4, 1), Mat::<f64>::zeros(2, 1), Mat::zeros(SAMPLES, 2));
        for t in (0..SAMPLES).chain(0..SAMPLES) {
            let seen = &c * &x;
            (0..2).for_each(|i| y[(t, i)] = seen[(i, 0)] + [0.01, 0.02][i] * normal[(t, i)]);
            x = &a * &x + &b * &w;
            (0..2).for_each(|j| w[(j, 0)] = 0.985 * w[(j, 0)] + [1.0, 0.2][j] * normal[(t, 2 + j)]);
        }
        (Model::of(a.as_ref(), b.as_ref(), c.as_ref(), vec![0.0; 4]).unwrap(), y)
    }

    fn bins() -> Bins {
        let (model, y) = pushed();
        let u = Mat::zeros(SAMPLES, 2);
        let unit = Sizes { u: vec![1.0; 2], y: vec![1.0; 2] };
        let spectra = Spectra::new(&[Experiment::new(u.as_ref(), y.as_ref())], &unit, &[0, 0], 0);
        Bins::new(&model, &spectra, std::slice::from_ref(&spectra.records[0].y))
    }

    /// Ratios of the variances within 15 %, three deviations of the smallest part, and the corner of the colour within 20 %.
    #[test]
    fn variances_and_colour_of_two_outputs_are_found() {
        let found = bins().entry(&[Regression::default(), Regression::default()], SAMPLES as f64, true).unwrap();
        let unit = found.sensors[0] / 1e-4;
        assert!((found.sensors[1] / unit / 4e-4).ln().abs() < 0.1, "{found:?}");
        for (own, of_machine) in found.inputs.iter().zip([1.0, 0.04]) {
            assert!((own / unit / of_machine).ln().abs() < 0.15, "{found:?}");
        }
        assert!(((1.0 - found.colour.unwrap()) / 0.015).ln().abs() < 0.2, "{found:?}");
    }

    /// Where the powers are the spectra, the information is the slope of the slope, by central differences.
    #[test]
    fn the_information_is_that_of_the_cost() {
        let bins = bins();
        let at = [0.2_f64, -1.0, -8.0, -7.0, -3.0];
        let variances = at.map(f64::exp);
        let spectrum = |bin: &Bin| -> Vec<c64> {
            let shape = shape(Some(1.0 - variances[4]), bin.back);
            let torque = |x: usize| (bin.gains[x] * variances[0] + bin.gains[4 + x] * variances[1]) * shape;
            (0..4).map(|x| torque(x) + if x % 3 == 0 { variances[2 + x / 3] } else { 0.0 }).collect()
        };
        let powers: Vec<Vec<c64>> = bins.bins.iter().map(spectrum).collect();
        let (_, slope, information) = bins.scored(&powers, &at).unwrap();
        assert!(slope.norm_max() < 1e-9 * information.norm_max(), "{slope:?}");
        for b in 0..at.len() {
            let moved = |h: f64| {
                let mut moved = at;
                moved[b] += h;
                bins.scored(&powers, &moved).unwrap().1
            };
            let difference = (moved(1e-5) - moved(-1e-5)) * faer::Scale(1.0 / 2e-5);
            for a in b..at.len() {
                let error = (information[(a, b)] - difference[(a, 0)]).abs();
                assert!(error < 1e-6 * information.norm_max(), "{a} {b}: {error}");
            }
        }
    }

    /// The slope is that of the cost by central differences.
    #[test]
    fn the_slope_is_that_of_the_cost() {
        let bins = bins();
        let powers: Vec<Vec<c64>> =
            bins.bins.iter().map(|bin| bin.power.iter().map(|v| v / bin.count).collect()).collect();
        let at = [0.2_f64, -1.0, -8.0, -7.0, -3.0];
        let (_, slope, _) = bins.scored(&powers, &at).unwrap();
        for a in 0..at.len() {
            let moved = |h: f64| {
                let mut moved = at;
                moved[a] += h;
                bins.scored(&powers, &moved).unwrap().0
            };
            let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((slope[(a, 0)] - difference).abs() < 1e-6 * difference.abs().max(1.0), "{a}: {difference}");
        }
    }
}
