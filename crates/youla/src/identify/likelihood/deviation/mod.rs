//! Standard deviations of the response, from the information of the record and from the scatter over models that the record
//! does not distinguish.
//!
//! ```text
//! var G = slopes (J'J)^-1 slopes^* + sum of w_c |G_c - G|^2,     w_c ~ exp(-criterion / 2)
//! ```
//! The weights are those of Schwarz's criterion, which approximates the posterior probability of a model, with Akaike's penalty for lags
//! (Burnham and Anderson, Model selection and multimodel inference, section 2.9): with Schwarz's, 95 % intervals of a 2 x 2 plant of four lags
//! under slow noise held 60 %, as two poles for four were the better choice, and wrong.

mod finite;
pub(crate) mod innovation;
pub(crate) mod interpolation;
pub(crate) mod mode_estimates;
pub(crate) mod physical;
pub(crate) mod region;
pub(crate) mod response_error;
pub(crate) mod root;
#[cfg(feature = "serde")]
mod stored;

use crate::identify::likelihood::choose::loads::Nuisance;
use crate::identify::likelihood::choose::problem::{Choice, Solution};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::identify::verdict::limits::{BEYOND_CHANCE, LARGEST_IN_BAND};
use crate::identify::verdict::{Excess, NonlinearPart, Witness};
use crate::linalg::TINY;
use faer::{Mat, c64};
use interpolation::Interpolated;
use response_error::ResponseError;
use root::Root;

/// Rivals of less weight are left out.
const LEAST_WEIGHT: f64 = 1e-12;

/// Inverse of the leading triangle of `[R r; 0 *]` with columns of unit length, and these lengths; directions that the record
/// does not determine are left large.
pub(crate) fn inverse_root(factor: &Mat<f64>, parameters: usize) -> Mat<f64> {
    let rows = parameters.min(factor.nrows());
    let lengths: Vec<f64> = (0..parameters).map(|j| factor.col(j).norm_l2().max(TINY)).collect();
    let unit = Mat::from_fn(rows, parameters, |i, j| factor[(i, j)] / lengths[j]);
    let Ok(svd) = unit.svd() else { return Mat::zeros(parameters, parameters) };
    let (s, v) = (svd.S().column_vector(), svd.V());
    Mat::from_fn(parameters, rows, |i, j| v[(i, j)] / s[j].max(1e-10 * s[0]) / lengths[i])
}

/// Frequencies as shares of the sample rate over which the evidence is averaged: from that of 20 periods in the records.
pub(crate) fn grid(samples: usize) -> Vec<f64> {
    geometric((20.0 / samples.max(40) as f64).clamp(1e-4, 1e-2), 0.495, 150)
}

/// Frequencies below those, from that of one period in the records: deviations are stated there too.
pub(crate) fn slow(samples: usize) -> Vec<f64> {
    let to = grid(samples)[0];
    let from = (1.0 / samples.max(40) as f64).min(0.9 * to);
    let points = (10.0 * (to / from).ln()) as usize + 1;
    geometric(from, to, points + 1).into_iter().take(points).collect()
}

fn geometric(from: f64, to: f64, points: usize) -> Vec<f64> {
    (0..points).map(|k| from * (to / from).powf(k as f64 / (points - 1) as f64)).collect()
}

/// Response of a model with its dead times, scaled channels.
pub(crate) fn delayed(model: &Model, delays: &[usize], share: f64) -> Vec<c64> {
    let z = c64::cis(std::f64::consts::TAU * share);
    let phases = phases(delays, z);
    model.response(z).into_iter().enumerate().map(|(k, g)| g * phases[k % delays.len()]).collect()
}

/// Factor of each input by its dead time.
fn phases(delays: &[usize], z: c64) -> Vec<c64> {
    delays.iter().map(|delay| z.conj().powu(*delay as u32)).collect()
}

/// The error of the response in independent directions, scaled channels.
#[derive(Debug, Clone)]
pub(crate) struct Directions {
    model: Model,
    delays: Vec<usize>,
    chart: Chart,
    /// Independent errors of the parameters.
    root: Root,
    /// Models that the record does not distinguish, with the roots of their weights.
    rivals: Vec<(Model, Vec<usize>, f64)>,
    /// Variance of the parameters by their scatter over pieces of the records, in units of that of the noise; it is in `root`.
    scatter: f64,
    /// The errors that the excitation shows: distortion, differences between groups of records, and between records and fresh ones.
    seen: Option<[Excess; 3]>,
    /// Whether the excitation shows that an entry has another form than the model, by an error beyond that of a band of validity: then no more is
    /// known of the entry anywhere than the excitation shows.
    of_another_form: Vec<bool>,
    /// What acts at an input or an output and is no linear function of it.
    nonlinear: Vec<NonlinearPart>,
    /// The outputs that were interpolated.
    interpolated: Vec<Interpolated>,
}

/// Mean squares of the error of each entry, by what causes them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parts {
    /// Noise of the records.
    pub(crate) noise: Vec<f64>,
    /// Models of other structure that the records do not tell from the chosen one.
    pub(crate) choice: Vec<f64>,
    /// Differences between records and parts of records beyond their noise.
    pub(crate) variation: Vec<f64>,
    /// What the excitation causes and the model does not explain, and the error of interpolated outputs.
    pub(crate) distortion: Vec<f64>,
}

impl Parts {
    /// Their sum.
    pub(crate) fn total(&self) -> Vec<f64> {
        let all = [&self.noise, &self.choice, &self.variation, &self.distortion];
        (0..self.noise.len()).map(|i| all.iter().map(|part| part[i]).sum()).collect()
    }
}

impl Directions {
    /// `scatter` is the factor of the variance of the parameters by their scatter over pieces of the records, `nuisance` what else was estimated.
    pub(crate) fn new(
        spectra: &Spectra,
        solution: &Solution,
        (scatter, nuisance): (f64, &Nuisance),
        witness: Option<Witness>,
    ) -> Self {
        let found = &solution.chosen.found;
        let chart = Chart::new(&found.point.model, found.feedthrough);
        let root = Root::new(spectra, &found.point, &chart, &found.noise, nuisance).scaled(scatter.sqrt());
        let model = (found.point.model.clone(), solution.chosen.delays.clone());
        let of = |(c, criterion): (&Choice, f64)| (c.found.point.model.clone(), c.delays.clone(), criterion);
        let rivals = solution.weighed().map(of);
        let seen = witness.map(|w| [w.distortion, w.variation, w.against_fresh]);
        Directions { scatter, ..Directions::of_parts(model, chart, root, rivals.collect()) }.with_seen(seen)
    }

    /// A model with its delays, the roots of the covariance of its parameters, and rivals with their criteria.
    pub(crate) fn of_parts(
        (model, delays): (Model, Vec<usize>),
        chart: Chart,
        root: Root,
        rivals: Vec<(Model, Vec<usize>, f64)>,
    ) -> Self {
        let least = rivals.iter().map(|(.., criterion)| *criterion).fold(f64::INFINITY, f64::min);
        let weighed =
            |(model, delays, criterion): (Model, Vec<usize>, f64)| (model, delays, (-0.5 * (criterion - least)).exp());
        let rivals: Vec<(Model, Vec<usize>, f64)> = rivals.into_iter().map(weighed).collect();
        let total: f64 = rivals.iter().map(|(.., weight)| weight).sum::<f64>().max(TINY);
        let kept = rivals.into_iter().filter(|(.., weight)| *weight > LEAST_WEIGHT * total);
        let rivals = kept.map(|(model, delays, weight)| (model, delays, (weight / total).sqrt())).collect();
        Directions {
            model,
            delays,
            chart,
            root,
            rivals,
            scatter: 1.0,
            seen: None,
            of_another_form: Vec::new(),
            nonlinear: Vec::new(),
            interpolated: Vec::new(),
        }
    }

    /// The same with what acts at an input or an output and is no linear function of it, and with the outputs that were interpolated.
    pub(crate) fn with(self, nonlinear: Vec<NonlinearPart>, interpolated: Vec<Interpolated>) -> Self {
        Directions { nonlinear, interpolated, ..self }
    }

    /// The same with the errors that the excitation shows.
    pub(super) fn with_seen(self, seen: Option<[Excess; 3]>) -> Self {
        let of_band = |share: f64| self.powers(share).iter().map(|g| LARGEST_IN_BAND * LARGEST_IN_BAND * g).collect();
        let exceeds = |[distortion, ..]: &[Excess; 3]| distortion.exceeds(&of_band, BEYOND_CHANCE);
        let of_another_form = seen.as_ref().map(exceeds).unwrap_or_default();
        Directions { seen, of_another_form, ..self }
    }

    /// Independent errors of the parameters.
    pub(crate) fn errors(&self) -> usize {
        self.root.errors()
    }

    /// The model with independent errors of its parameters, in standard deviations, and its dead times.
    pub(crate) fn moved(&self, errors: &[f64]) -> (Model, &[usize]) {
        (self.chart.moved(&self.model, &self.root.step(errors)), &self.delays)
    }

    /// Models of another structure that the record does not distinguish, with their dead times and weights.
    pub(crate) fn rivals(&self) -> impl Iterator<Item = (&Model, &[usize], f64)> {
        let others = |(model, delays, _): &&(Model, Vec<usize>, f64)| {
            model.order() != self.model.order() || *delays != self.delays
        };
        self.rivals.iter().filter(others).map(|(model, delays, root)| (model, delays.as_slice(), root * root))
    }

    /// The rival that a number between 0 and 1 picks, with the frequency of its weight, and of all together at most half: Akaike's criterion
    /// weighs lags, that of Schwarz has chosen. `None` for the model itself.
    pub(crate) fn rival_at(&self, chance: f64) -> Option<(&Model, &[usize])> {
        let all: f64 = self.rivals().map(|(.., weight)| weight).sum();
        let (share, mut passed) = (if all > 0.5 { 0.5 / all } else { 1.0 }, 0.0);
        self.rivals().find_map(|(model, delays, weight)| {
            passed += weight * share;
            (chance < passed).then_some((model, delays))
        })
    }

    /// The error of the response, scaled channels, under the friction and the play of the records: the loop ran with both. Below one period of the
    /// records, a share of the sample rate, models of other structure differ as they do at that period: what is slower no record tells from none.
    pub(crate) fn at(&self, share: f64, period: f64) -> ResponseError {
        let Columns { g, parameters, mut rivals, variation, distortion, .. } = self.columns(share);
        if share < period {
            let of_period = self.columns(period);
            let factor = |i: usize| if of_period.g[i] == c64::ZERO { c64::ONE } else { g[i] / of_period.g[i] };
            rivals = Mat::from_fn(rivals.nrows(), rivals.ncols(), |i, k| of_period.rivals[(i, k)] * factor(i));
        }
        // What the excitation shows of an error is its size, not its phase.
        let alone = variation.iter().zip(&distortion).map(|(a, b)| a + b).collect();
        let (first, entries) = (parameters.shared.ncols(), rivals.nrows());
        let mut shared = Mat::<c64>::zeros(entries, first + rivals.ncols());
        shared.subcols_mut(0, first).copy_from(&parameters.shared);
        shared.subcols_mut(first, rivals.ncols()).copy_from(&rivals);
        ResponseError { shared, alone, ..parameters }
    }

    /// The same, also against the plant without them.
    pub(crate) fn against_linear(&self, share: f64) -> ResponseError {
        let mut error = self.at(share, share);
        self.add_linear(share, &mut error.alone, &delayed(&self.model, &self.delays, share));
        error
    }

    /// Adds what friction and play do linearly to the mean squares of the errors of the response g.
    fn add_linear(&self, share: f64, errors: &mut [f64], g: &[c64]) {
        if !self.nonlinear.is_empty() {
            let modes = self.model.sum_of_modes(c64::cis(std::f64::consts::TAU * share));
            self.nonlinear.iter().for_each(|part| part.add_linear(share, errors, self.model.inputs, (g, &modes)));
        }
    }

    /// Mean squares of the error of each entry by their causes, also against the plant without the friction and the play of the records.
    pub(crate) fn parts(&self, share: f64) -> Parts {
        let Columns { g, parameters, squares, rivals, variation, mut distortion } = self.columns(share);
        self.add_linear(share, &mut distortion, &g);
        let squares = self.finite(share, &g, &parameters, &squares);
        let noise: Vec<f64> = squares.iter().map(|square| square / self.scatter).collect();
        let choice = |i: usize| (0..rivals.ncols()).map(|k| rivals[(i, k)].norm_sqr()).sum::<f64>();
        Parts {
            choice: (0..rivals.nrows()).map(choice).collect(),
            variation: noise.iter().zip(variation).map(|(noise, v)| (self.scatter - 1.0) * noise + v).collect(),
            noise,
            distortion,
        }
    }

    /// Squares of the magnitudes of the entries of the response.
    fn powers(&self, share: f64) -> Vec<f64> {
        delayed(&self.model, &self.delays, share).iter().map(|g| g.norm_sqr()).collect()
    }

    fn columns(&self, share: f64) -> Columns {
        let z = c64::cis(std::f64::consts::TAU * share);
        let (entries, m) = (self.model.inputs * self.model.outputs, self.model.inputs);
        let phases = phases(&self.delays, z);
        let g = delayed(&self.model, &self.delays, share);
        let others: Vec<_> = self.rivals.iter().map(|(model, delays, _)| delayed(model, delays, share)).collect();
        let (own, shared) = self.root.seen(&self.chart, &self.model, z);
        let parameters = ResponseError { own, shared, alone: vec![0.0; entries], inputs: m };
        let parameters = parameters.scaled(|_, j| phases[j]);
        let squares = parameters.squares();
        let rivals = Mat::from_fn(entries, others.len(), |i, k| (others[k][i] - g[i]) * self.rivals[k].2);
        let near = |k: usize| self.seen.as_ref().map(|seen| (&seen[k], seen[k].near(share, entries).0));
        let mut distortion = near(0).map_or_else(|| vec![0.0; entries], |(_, squares)| squares);
        // Differences between records are alike from band to band as they are, or relative to the response, which falls by decades at low
        // frequencies and turns at a resonance.
        let powers = |share: f64| self.powers(share);
        if self.of_another_form.contains(&true) {
            let known = self.seen.as_ref().map_or_else(Vec::new, |[seen, ..]| seen.with_chance(share, &powers));
            let of_form = distortion.iter_mut().zip(known).zip(&self.of_another_form).filter(|(_, other)| **other);
            of_form.for_each(|((distortion, known), _)| *distortion = distortion.max(known));
        }
        let mut variation = vec![0.0_f64; entries];
        for (excess, plain) in [1, 2].into_iter().filter_map(near) {
            let relative = excess.near_in_units(share, &powers).0;
            variation.iter_mut().zip(plain.iter().zip(&relative)).for_each(|(v, (a, b))| *v = v.max(*a).max(*b));
        }
        // What moved parameters explain of the differences between records is not counted twice.
        for (i, variation) in variation.iter_mut().enumerate() {
            *variation = (*variation - squares[i] * (1.0 - 1.0 / self.scatter)).max(0.0);
        }
        // It moves the outputs as its channel does, and does not average out over records of the same kind.
        self.nonlinear.iter().for_each(|part| part.add(share, &mut distortion, m, &g));
        for output in &self.interpolated {
            output.add(share, &mut distortion, m, &|share| delayed(&self.model, &self.delays, share));
        }
        Columns { g, parameters, squares, rivals, variation, distortion }
    }
}

/// The response at a frequency and its errors: those of the parameters with their mean squares, columns of rivals, and mean squares of what has no
/// phase.
struct Columns {
    g: Vec<c64>,
    parameters: ResponseError,
    squares: Vec<f64>,
    rivals: Mat<c64>,
    variation: Vec<f64>,
    distortion: Vec<f64>,
}
