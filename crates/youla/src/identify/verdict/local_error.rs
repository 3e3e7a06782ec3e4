//! The error of a model as the excitation shows it, band by band, without a model of it.
//!
//! ```text
//! E = S_vx S_xx^-1 S_xu (S_ux S_xx^-1 S_xu)^-1,      v = y - G u,   x the external excitation
//! ```
//! The excitation is an instrument: it is independent of the noise, so that E has mean zero where G is right, with variance
//! `Phi_v (S_ux S_xx^-1 S_xu)^-1`. What exceeds this is error of the model. Phi_v is what x leaves of v in the band.
//! All lines are those under a Hann window, under which the ends of a record leak nothing into bands without excitation.
//! Neighbouring bands are averaged with the weights of their information, so that a band in which the excitation shows nothing does
//! not speak.

mod inputs;

pub(crate) use inputs::explained_inputs;

use super::excess::{Excess, ExcessBand};
use super::limits::{
    BAND_LINES, BAND_RATIO, HANN_LOSS, KNOWN, LEAST_COMPARED, LEAST_DIRECTION, LEAST_MOVED, LOCAL_CHANCE,
    OVERALL_CHANCE, WEAK_EXCITATION,
};
use super::partition::Partition;
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use faer::{Mat, MatRef, Side, c64};

/// Octaves of the first band that count apart: a band of `BAND_LINES` lines for each of six excitations has eight.
const OCTAVES: usize = 8;

/// One record: lines of the inputs, of what the model leaves, and of the excitation.
pub(crate) struct RecordLines<'a> {
    /// Lines x m.
    pub(crate) u: &'a [c64],
    /// Lines x p.
    pub(crate) v: &'a [c64],
    /// Lines x q.
    pub(crate) x: &'a [c64],
}

/// The lines under a Hann window, `X_k - (X_{k-1} + X_{k+1}) / 2`; the first and the last, which lack a neighbour, are zero.
pub(crate) fn hann(lines: &[c64], channels: usize) -> Vec<c64> {
    let mut out = vec![c64::ZERO; lines.len()];
    for k in channels..lines.len().saturating_sub(channels) {
        out[k] = lines[k] - (lines[k - channels] + lines[k + channels]) * 0.5;
    }
    out
}

/// Numbers of channels: inputs, outputs, excitations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Channels {
    pub(crate) m: usize,
    pub(crate) p: usize,
    pub(crate) q: usize,
}

/// The error in one band.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    /// Middle of the band as a share of the sample rate.
    pub(crate) share: f64,
    /// Entries of E, row by row.
    pub(crate) error: Vec<c64>,
    /// Variance of each entry.
    pub(crate) variance: Vec<f64>,
    /// Whether every direction of the inputs is moved enough for its error to be compared with that of another record.
    pub(crate) compares: bool,
    /// Of the first band: frequencies, shares of the sample rate, with their portions of the power of the inputs.
    pub(crate) power: Vec<(f64, f64)>,
}

/// The errors of all bands; `None` where the excitation does not reach every input.
#[derive(Debug, Clone)]
pub(crate) struct LocalErrors {
    pub(crate) bands: Vec<Option<Band>>,
    /// Where they are.
    pub(crate) partition: Partition,
    /// By how many standard deviations the errors of all bands exceed chance; `None` where the bands have no more degrees of
    /// freedom than the model has parameters.
    pub(crate) significance: Option<f64>,
}

impl LocalErrors {
    /// In some bands; `parameters` of the model were fitted to the same records.
    pub(crate) fn new(
        records: &[RecordLines<'_>],
        channels: Channels,
        partition: &Partition,
        parameters: usize,
    ) -> Self {
        let sums = sums(records, channels, partition);
        let least = least_power(&sums, channels);
        let reached: Vec<Option<Explained>> =
            sums.iter().map(|sums| Explained::new(sums, least(sums), channels)).collect();
        let (mut statistic, mut degrees) = (0.0, -(parameters as f64));
        let mut bands = Vec::with_capacity(partition.count());
        for (k, (sums, share)) in sums.iter().zip(partition.middles()).enumerate() {
            // A band of few lines says little of its noise, and those beside it nothing of a peak.
            let beside = usize::from(sums.lines < BAND_LINES * channels.q);
            let near = &reached[k.saturating_sub(beside)..(k + 1 + beside).min(reached.len())];
            let found = reached[k].as_ref().and_then(|own| error_of(sums, own, near, channels));
            if let Some(found) = &found {
                statistic += found.statistic;
                degrees += found.degrees;
            }
            let whole = found.filter(|f| f.degrees == (2 * channels.m * channels.p) as f64);
            let band = |f: BandError| Band {
                share,
                error: f.error,
                variance: f.variance,
                compares: f.compares,
                power: sums.power(),
            };
            bands.push(whole.map(band));
        }
        let significance = (degrees > 0.0).then(|| chi_square_deviations(statistic, degrees));
        LocalErrors { bands, partition: partition.clone(), significance }
    }

    /// Whether the excitation moves every input in any band.
    pub(crate) fn shows_all(&self) -> bool {
        self.bands.iter().any(Option::is_some)
    }

    /// The lowest and the highest share of the sample rate at which the bands within [`BAND_RATIO`] show an entry of the response within [`KNOWN`] of
    /// it, from zero where the first band does; `power` is the square of the response in a band.
    pub(crate) fn range_shown(&self, entry: usize, power: &dyn Fn(usize) -> f64) -> Option<[f64; 2]> {
        let shares: Vec<f64> = self.partition.middles().collect();
        let of = |k: usize| self.bands[k].as_ref().map_or(0.0, |band| 1.0 / band.variance[entry].max(TINY));
        let known = |k: &usize| {
            let from = shares.partition_point(|s| *s < shares[*k] / BAND_RATIO);
            let end = shares.partition_point(|s| *s <= shares[*k] * BAND_RATIO);
            (from..end).map(of).sum::<f64>() * KNOWN * KNOWN * power(*k) > 1.0
        };
        let first = (0..shares.len()).find(known)?;
        let last = (0..shares.len()).rev().find(known)?;
        Some([if first == 0 { 0.0 } else { shares[first] }, shares[last]])
    }

    /// Squares of the errors beyond their variances.
    pub(crate) fn excess(&self) -> Excess {
        let of = |b: &Band| {
            let squares = b.error.iter().zip(&b.variance).map(|(e, v)| e.norm_sqr() - v).collect();
            ExcessBand { share: b.share, squares, chance: b.variance.clone(), freedom: 1.0, power: b.power.clone() }
        };
        let overall = self.significance.is_some_and(|s| s > OVERALL_CHANCE);
        let least = if overall { OVERALL_CHANCE } else { LOCAL_CHANCE };
        Excess { bands: self.bands.iter().flatten().map(of).collect(), least }
    }

    /// Scatter of the errors of several groups of records beyond their variances.
    pub(crate) fn scatter(groups: &[LocalErrors]) -> Excess {
        let count = groups.iter().map(|g| g.bands.len()).min().unwrap_or(0);
        let bands = (0..count).filter_map(|k| {
            let all: Vec<&Band> = groups.iter().filter_map(|g| g.bands[k].as_ref().filter(|b| b.compares)).collect();
            let entries = all.first().filter(|_| all.len() > 1)?.error.len();
            let (squares, chance) = (0..entries).map(|i| scatter_of(&all, i)).unzip();
            let (share, power) = (all[0].share, all[0].power.clone());
            Some(ExcessBand { share, squares, chance, freedom: all.len() as f64 - 1.0, power })
        });
        Excess { bands: bands.collect(), least: LOCAL_CHANCE }
    }

    /// Squares of the difference of the errors of two records beyond their variances: of the model of one and another record, twice the
    /// scatter between records.
    pub(crate) fn difference<'a>([one, other]: [&'a LocalErrors; 2]) -> Excess {
        let of = |(a, b): (&'a Option<Band>, &'a Option<Band>)| {
            let compared = |of: &'a Option<Band>| of.as_ref().filter(|band| band.compares);
            let (a, b) = (compared(a)?, compared(b)?);
            let chance: Vec<f64> = a.variance.iter().zip(&b.variance).map(|(a, b)| a + b).collect();
            let apart = a.error.iter().zip(&b.error).map(|(a, b)| (a - b).norm_sqr());
            let squares = apart.zip(&chance).map(|(square, chance)| square - chance).collect();
            Some(ExcessBand { share: a.share, squares, chance, freedom: 1.0, power: a.power.clone() })
        };
        Excess { bands: one.bands.iter().zip(&other.bands).filter_map(of).collect(), least: LOCAL_CHANCE }
    }
}

/// `sum w |E_k - mean|^2` less its mean by chance over that of a unit scatter, and this mean by chance over it.
fn scatter_of(groups: &[&Band], entry: usize) -> (f64, f64) {
    let weights: Vec<f64> = groups.iter().map(|b| 1.0 / b.variance[entry].max(TINY)).collect();
    let total: f64 = weights.iter().sum();
    let mean = groups.iter().zip(&weights).fold(c64::ZERO, |s, (b, w)| s + b.error[entry] * *w) / total;
    let spread: f64 = groups.iter().zip(&weights).map(|(b, w)| w * (b.error[entry] - mean).norm_sqr()).sum();
    let freedom = groups.len() as f64 - 1.0;
    let unit = total - weights.iter().map(|w| w * w).sum::<f64>() / total;
    ((spread - freedom) / unit, freedom / unit)
}

/// Sums of products over the lines of a band.
struct Sums {
    lines: usize,
    xx: Mat<c64>,
    /// Of the excitation under one more window, which says where in the record it lies.
    hh: Mat<c64>,
    ux: Mat<c64>,
    vx: Mat<c64>,
    vv: Vec<f64>,
    uu: Mat<c64>,
    /// Of the first band, of each octave below its upper edge: `sum |u|^2`, `sum share |u|^2`; zero of the others.
    octaves: [[f64; 2]; OCTAVES],
}

impl Sums {
    /// Of the first band, the mean frequency of each octave, a share of the sample rate, and its portion of the power of the inputs.
    fn power(&self) -> Vec<(f64, f64)> {
        let total: f64 = self.octaves.iter().map(|octave| octave[0]).sum();
        let of = |[power, moment]: &[f64; 2]| (moment / power, power / total);
        self.octaves.iter().filter(|octave| octave[0] > 0.0).map(of).collect()
    }
}

/// Least power of a direction of the excitation over the lines of a band.
fn least_power(all: &[Sums], channels: Channels) -> impl Fn(&Sums) -> f64 {
    let power = |s: &Sums| (0..channels.q).map(|i| s.xx[(i, i)].re).sum::<f64>();
    let lines = all.iter().map(|s| s.lines).sum::<usize>().max(1);
    let of_line = WEAK_EXCITATION * all.iter().map(power).sum::<f64>() / lines as f64;
    move |sums| (of_line * sums.lines as f64).max(TINY)
}

fn sums(records: &[RecordLines<'_>], Channels { m, p, q }: Channels, partition: &Partition) -> Vec<Sums> {
    let zeros = |rows: usize| Mat::<c64>::zeros(rows, q);
    let empty = |_| Sums {
        lines: 0,
        xx: zeros(q),
        hh: zeros(q),
        ux: zeros(m),
        vx: zeros(p),
        vv: vec![0.0; p],
        uu: Mat::zeros(m, m),
        octaves: [[0.0; 2]; OCTAVES],
    };
    let mut all: Vec<Sums> = (0..partition.count()).map(empty).collect();
    for r in records {
        let total = r.v.len() / p.max(1);
        let h = hann(r.x, q);
        for k in 0..total {
            let band = partition.of(k as f64 / total as f64);
            let sums = &mut all[band];
            sums.lines += 1;
            (0..p).for_each(|i| sums.vv[i] += r.v[k * p + i].norm_sqr());
            for j in 0..m {
                (0..m).for_each(|i| sums.uu[(i, j)] += r.u[k * m + i] * r.u[k * m + j].conj());
            }
            if band == 0 {
                let share = 0.5 * (k + 1) as f64 / total as f64;
                let below = (0.5 * partition.first() / share).log2() as usize;
                let power: f64 = r.u[k * m..][..m].iter().map(c64::norm_sqr).sum();
                let octave = &mut sums.octaves[below.min(OCTAVES - 1)];
                *octave = [octave[0] + power, octave[1] + share * power];
            }
            for a in 0..q {
                let xa = r.x[k * q + a].conj();
                (0..q).for_each(|b| sums.xx[(b, a)] += r.x[k * q + b] * xa);
                (0..q).for_each(|b| sums.hh[(b, a)] += h[k * q + b] * h[k * q + a].conj());
                (0..m).for_each(|j| sums.ux[(j, a)] += r.u[k * m + j] * xa);
                (0..p).for_each(|i| sums.vx[(i, a)] += r.v[k * p + i] * xa);
            }
        }
    }
    all
}

/// By how much the variance of a sum of the noise with the excitation exceeds that for an excitation spread over the record, along each column
/// of `turn`: a sweep is at one frequency at one time, and the window weighs the noise there as it weighs the sweep. With noise of equal power
/// on the lines without a window,
/// ```text
/// var sum_k V_k X_k^* = Phi_v / (3/2) sum_k |H X_k|^2,      H the window,
/// ```
/// against `HANN_LOSS Phi_v sum_k |X_k|^2` of the mean over the record. It is never taken as less: at the ends the window leaves little to go by.
fn centred(sums: &Sums, basis: &Mat<c64>, turn: MatRef<'_, c64>) -> Vec<f64> {
    let under = basis.adjoint() * &sums.hh * basis * turn;
    let of = |k: usize| (0..turn.nrows()).map(|a| (turn[(a, k)].conj() * under[(a, k)]).re).sum::<f64>();
    (0..turn.ncols()).map(|k| (of(k) / (1.5 * HANN_LOSS)).max(1.0)).collect()
}

/// Chi-square of a band, its degrees of freedom, the error of each entry and its variance.
struct BandError {
    statistic: f64,
    degrees: f64,
    error: Vec<c64>,
    variance: Vec<f64>,
    compares: bool,
}

/// What the excitation explains in a band.
struct Explained {
    /// Directions of the excitation of unit power, q x their number.
    basis: Mat<c64>,
    /// Sums of the inputs with them.
    u: Mat<c64>,
    /// Sums of what the model leaves with them.
    v: Mat<c64>,
    /// Power of v that they leave, of each output, and its complex degrees of freedom.
    left: Vec<f64>,
    free: f64,
}

impl Explained {
    /// `None` where the excitation has no power, or leaves no line to estimate the noise from.
    fn new(sums: &Sums, least: f64, Channels { p, .. }: Channels) -> Option<Self> {
        let eigen = sums.xx.self_adjoint_eigen(Side::Lower).ok()?;
        let strong: Vec<usize> = (0..sums.xx.nrows()).filter(|k| eigen.S()[*k].re > least).collect();
        let free = sums.lines as f64 / HANN_LOSS - strong.len() as f64;
        if strong.is_empty() || free < 1.0 {
            return None;
        }
        let of_unit_power = |i: usize, k: usize| eigen.U()[(i, strong[k])] / eigen.S()[strong[k]].re.sqrt();
        let basis = Mat::from_fn(sums.xx.nrows(), strong.len(), of_unit_power);
        let (u, v) = (&sums.ux * &basis, &sums.vx * &basis);
        let left = (0..p).map(|i| sums.vv[i] - v.row(i).squared_norm_l2()).collect();
        Some(Explained { basis, u, v, left, free })
    }

    /// Power of the noise of an output for each degree of freedom.
    fn noise(bands: &[&Explained], output: usize) -> f64 {
        let free: f64 = bands.iter().map(|band| band.free).sum();
        bands.iter().map(|band| band.left[output]).sum::<f64>() / free
    }
}

/// The error of a band; `near` are it and the bands beside it.
fn error_of(
    sums: &Sums,
    own: &Explained,
    near: &[Option<Explained>],
    Channels { m, p, .. }: Channels,
) -> Option<BandError> {
    let Explained { basis, u, v, free, .. } = own;
    let near: Vec<&Explained> = near.iter().flatten().collect();
    // Of correlated lines a sum has the variance of `HANN_LOSS` times as many.
    let noise = |i: usize| Explained::noise(&near, i).max(Explained::noise(&[own], i)).max(TINY);
    let noise: Vec<f64> = (0..p).map(noise).collect();
    let of_inputs = &sums.uu - u * u.adjoint();
    let svd = u.thin_svd().ok()?;
    let sizes: Vec<f64> = (0..m.min(basis.ncols())).map(|k| svd.S()[k].re).collect();
    // A direction of the inputs that the excitation hardly moves shows the noise that the feedback brings there: E would be that of K.
    let moved = |k: usize| {
        let along = svd.U().col(k);
        let noise = (along.adjoint() * &of_inputs * along).re.max(0.0) / *free;
        sizes[k] > LEAST_DIRECTION * sizes[0] && sizes[k] * sizes[k] > LEAST_MOVED * noise
    };
    let rank = (0..sizes.len()).take_while(|k| moved(*k)).count();
    // v V: the error along each direction of the excited inputs, with the variance of the noise
    let along = v * svd.V();
    let centred = centred(sums, basis, svd.V());
    let degrees = (2 * rank * p) as f64;
    let (mut error, mut variance) = (vec![c64::ZERO; p * m], vec![0.0; p * m]);
    let mut statistic = 0.0;
    for i in 0..p {
        (0..rank).for_each(|k| statistic += 2.0 * along[(i, k)].norm_sqr() / (noise[i] * centred[k]));
        for j in 0..m {
            let entry = |sum: c64, k: usize| sum + along[(i, k)] / sizes[k] * svd.U()[(j, k)].conj();
            error[i * m + j] = (0..rank).fold(c64::ZERO, entry);
            let of = |k: usize| noise[i] * centred[k] * (svd.U()[(j, k)].norm() / sizes[k]).powi(2);
            variance[i * m + j] = (0..rank).map(of).sum();
        }
    }
    // Mean of the square of Student's variable with `2 free` degrees of freedom.
    let free = near.iter().map(|band| band.free).sum::<f64>();
    statistic *= ((free - 1.0) / free).max(0.5);
    let last = rank.checked_sub(1)?;
    let noise: f64 = (0..m).map(|j| svd.U()[(j, last)].norm_sqr() * of_inputs[(j, j)].re.max(0.0) / own.free).sum();
    let compares = sizes[last] > LEAST_COMPARED * sizes[0] && sizes[last] * sizes[last] > LEAST_MOVED * noise;
    Some(BandError { statistic, degrees, error, variance, compares })
}

#[cfg(test)]
mod tests;
