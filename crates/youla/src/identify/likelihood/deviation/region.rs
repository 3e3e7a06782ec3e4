//! The region of the recommended model: which plants the records do not tell from it, and what any figure of the plant inherits.
//!
//! ```text
//! dG(w) = sum_k e_k d_k(w),        e_k independent of unit variance
//! ```
//! with one direction d_k for each independent error of the parameters, for each model that the records do not distinguish, and
//! for what the excitation shows beyond both. Figures that depend on the response at one frequency take the directions
//! there; figures of the poles take the directions of the parameters.

use super::response_error::{EntryErrors, ResponseError, root_of};
use super::{Directions, Parts, physical};
use crate::control::ChannelScales;
use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::search::model::Model;
use crate::lti::{Discrete, StateSpace};
use crate::statistics::two_sided_student;
use crate::{Mat, Result, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

/// Step of the central differences along an independent error of the parameters, in its standard deviations: small against the
/// curvature of a figure, large against rounding.
const STEP: f64 = 1e-3;
/// The criterion of N samples takes `2 N log |z|` for a pole outside of the unit circle (the noise passes it mirrored), which the normal
/// distribution of the parameters lacks: at `1 + OUTSIDE / N` the likelihood is that without it times exp(-3).
const OUTSIDE: f64 = 3.0;
/// Draws in place of one with such a pole, at most; then it is left out.
const REDRAWN: usize = 100;
/// A rival of less weight, for which a figure does not exist, does not make its interval unbounded.
const NEGLIGIBLE: f64 = 0.01;

/// A figure with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Interval {
    /// Of the estimate.
    pub value: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Bounds at the level of the interval.
    pub bounds: [f64; 2],
}

impl Interval {
    /// The normal interval of a figure at a level, for example 0.95.
    pub(crate) fn normal(value: f64, deviation: f64, level: f64) -> Self {
        let half = two_sided_student(level, f64::INFINITY) * deviation;
        Interval { value, deviation, bounds: [value - half, value + half] }
    }
}

/// A plant that is drawn from the region.
#[derive(Debug, Clone)]
pub struct Draw {
    /// The plant.
    pub plant: StateSpace<Discrete>,
    /// How far out it lies: the plants within the region of a level are those of the smallest distances.
    pub distance: f64,
}

/// Root mean square of the error of each entry by its cause, in the form of [`Region::absolute`].
#[derive(Debug, Clone, PartialEq)]
pub struct RegionParts {
    /// Noise of the records.
    pub noise: Vec<Mat<f64>>,
    /// Models of other structure that the records do not tell from this one.
    pub choice: Vec<Mat<f64>>,
    /// Differences between records, and between parts of records, beyond their noise: a machine that changes, or depends on its
    /// operating point.
    pub variation: Vec<Mat<f64>>,
    /// What the excitation causes and a linear model of this order does not explain.
    pub distortion: Vec<Mat<f64>>,
}

impl RegionParts {
    /// Names of the parts, each with its deviations.
    pub fn named(&self) -> [(&'static str, &[Mat<f64>]); 4] {
        [
            ("noise", &self.noise),
            ("choice", &self.choice),
            ("variation", &self.variation),
            ("distortion", &self.distortion),
        ]
    }
}

/// The region of a model: stated deviations of its response, draws, and intervals of its figures.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "super::stored::StoredRegion", try_from = "super::stored::StoredRegion"))]
pub struct Region {
    /// Frequencies, Hz.
    pub hz: Vec<f64>,
    /// Root mean square of the complex error of each entry, p x m, one matrix per frequency, physical units.
    pub absolute: Vec<Mat<f64>>,
    /// What causes it: the squares of the parts sum to that of `absolute`.
    pub parts: RegionParts,
    /// The frequencies as shares of the sample rate, from which a stored region is computed again to the bit.
    #[cfg(feature = "serde")]
    pub(super) shares: Vec<f64>,
    pub(super) sizes: Sizes,
    pub(super) time: Discrete,
    pub(super) directions: Directions,
}

impl Region {
    /// Stated at frequencies that are shares of the sample rate.
    pub(crate) fn new(sizes: Sizes, time: Discrete, shares: &[f64], directions: Directions) -> Self {
        let (m, p) = (sizes.u.len(), sizes.y.len());
        let of = |v: &[f64]| Mat::from_fn(p, m, |i, j| root_of(v[i * m + j]) * sizes.y[i] / sizes.u[j]);
        let hz = shares.iter().map(|share| share / time.ts()).collect();
        let parts: Vec<Parts> = shares.par_iter().map(|share| directions.parts(*share)).collect();
        let all = |pick: fn(&Parts) -> &[f64]| parts.iter().map(|p| of(pick(p))).collect();
        let absolute = parts.iter().map(|p| of(&p.total())).collect();
        let parts = RegionParts {
            noise: all(|p| &p.noise),
            choice: all(|p| &p.choice),
            variation: all(|p| &p.variation),
            distortion: all(|p| &p.distortion),
        };
        Region {
            hz,
            absolute,
            parts,
            #[cfg(feature = "serde")]
            shares: shares.to_vec(),
            sizes,
            time,
            directions,
        }
    }

    /// Sizes of the channels, root mean square over the records.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for a channel of size zero.
    pub(crate) fn channel_scales(&self) -> Result<ChannelScales> {
        ChannelScales::new(self.sizes.u.clone(), self.sizes.y.clone())
    }

    /// The error in the loop that ran, with the friction and the play of its machine, at a frequency, Hz, up to that of Nyquist, by the errors of the
    /// parameters: also beyond `hz`, as below one period of the records, where a slow pole moves the response most. What the excitation shows
    /// beyond the parameters is that of the nearest band, and models of another structure differ below that period, relative to the response, as they
    /// do there: a lag that is slower no record tells from none.
    pub fn at(&self, hz: f64) -> ResponseError {
        let period = self.hz.first().map_or(0.0, |hz| self.share(*hz));
        self.in_units(self.directions.at(self.share(hz), period))
    }

    /// The errors of the entries at frequencies, Hz, those of `absolute`: against the plant without friction and play, whose linear parts the model
    /// holds.
    pub fn entry_errors(&self, hz: &[f64]) -> Vec<EntryErrors> {
        hz.par_iter().map(|hz| self.in_units(self.directions.against_linear(self.share(*hz))).entries()).collect()
    }

    fn share(&self, hz: f64) -> f64 {
        (hz * self.time.ts()).clamp(0.0, 0.5)
    }

    /// An error of scaled channels in physical units.
    fn in_units(&self, error: ResponseError) -> ResponseError {
        let Sizes { u, y } = &self.sizes;
        error.scaled(|i, j| c64::new(y[i] / u[j], 0.0))
    }

    /// Intervals of figures of the plant, in the order in which `of` gives them, by the delta method: central differences along
    /// each independent error of the parameters, and the figures of the models that the records do not distinguish.
    ///
    /// What the excitation shows beyond the parameters has no plant and is not in these intervals: margins, which depend on the
    /// response at one frequency, take [`Self::at`].
    ///
    /// # Errors
    /// Those of `of` for the estimate and for plants near it.
    pub fn intervals<F>(&self, level: f64, of: F) -> Result<Vec<Interval>>
    where
        F: Fn(&StateSpace<Discrete>) -> Result<Vec<f64>> + Sync,
    {
        self.intervals_by(level, &of, &of)
    }

    /// The same with figures of plants near the estimate that are equal to first order and cost less.
    ///
    /// # Errors
    /// As [`Self::intervals`].
    pub(crate) fn intervals_by<N, F>(&self, level: f64, near: N, of: F) -> Result<Vec<Interval>>
    where
        N: Fn(&StateSpace<Discrete>) -> Result<Vec<f64>> + Sync,
        F: Fn(&StateSpace<Discrete>) -> Result<Vec<f64>> + Sync,
    {
        let values = of(&self.estimate()?)?;
        let slopes: Vec<Result<Vec<f64>>> = (0..self.directions.errors())
            .into_par_iter()
            .map(|k| {
                let moved = |step: f64| {
                    let mut errors = vec![0.0; self.directions.errors()];
                    errors[k] = step;
                    near(&self.plant_at(&errors)?)
                };
                let (up, down) = (moved(STEP)?, moved(-STEP)?);
                Ok(up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * STEP)).collect())
            })
            .collect();
        let mut variances = vec![0.0; values.len()];
        for slopes in slopes {
            variances.iter_mut().zip(slopes?).for_each(|(v, s)| *v += s * s);
        }
        for (plant, weight) in self.rivals() {
            let figures = plant.and_then(|plant| of(&plant));
            for (k, variance) in variances.iter_mut().enumerate() {
                match &figures {
                    Ok(figures) => *variance += weight * (figures[k] - values[k]).powi(2),
                    Err(_) if weight > NEGLIGIBLE => *variance = f64::INFINITY,
                    Err(_) => {}
                }
            }
        }
        Ok(values.into_iter().zip(variances).map(|(value, v)| Interval::normal(value, v.sqrt(), level)).collect())
    }

    /// Plants as the estimate could have come out, in the order of drawing: the parameters are normal, but no more poles than those of the estimate
    /// lie outside of the unit circle; a model that the records do not distinguish comes with the frequency of its weight, in half of the draws
    /// at most, at distance zero. A draw depends on the seed and its place only.
    pub fn draws(&self, count: usize, seed: u64) -> Vec<Draw> {
        // the lowest frequency is that of one period in the records
        let radius = 1.0 + OUTSIDE * self.hz.first().map_or(0.0, |hz| hz * self.time.ts());
        let outside = |model: &Model| model.poles().iter().filter(|pole| pole.norm() > radius).count();
        let allowed = outside(&self.directions.model);
        let draw = |place: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(place);
            let chance: f64 = rng.random();
            if let Some(rival) = self.directions.rival_at(chance) {
                let (model, delays) = rival;
                let plant = physical::realised(model, delays, &self.sizes, self.time).ok()?;
                return Some(Draw { plant, distance: 0.0 });
            }
            let drawn = || (0..self.directions.errors()).map(|_| rng.sample(StandardNormal)).collect::<Vec<f64>>();
            let (errors, (model, delays)) = std::iter::repeat_with(drawn)
                .take(REDRAWN)
                .map(|errors| (self.directions.moved(&errors), errors))
                .find_map(|(moved, errors)| (outside(&moved.0) <= allowed).then_some((errors, moved)))?;
            let distance = errors.iter().map(|e| e * e).sum::<f64>().sqrt();
            let plant = physical::realised(&model, delays, &self.sizes, self.time).ok()?;
            Some(Draw { plant, distance })
        };
        (0..count as u64).into_par_iter().filter_map(draw).collect()
    }

    /// The plant without errors.
    pub(crate) fn estimate(&self) -> Result<StateSpace<Discrete>> {
        self.plant_at(&vec![0.0; self.directions.errors()])
    }

    /// The plant with independent errors of its parameters, in standard deviations.
    fn plant_at(&self, errors: &[f64]) -> Result<StateSpace<Discrete>> {
        let (model, delays) = self.directions.moved(errors);
        physical::realised(&model, delays, &self.sizes, self.time)
    }

    /// Models of another structure that the records do not distinguish, with their weights.
    fn rivals(&self) -> impl Iterator<Item = (Result<StateSpace<Discrete>>, f64)> + '_ {
        let realised = |(model, delays, weight)| (physical::realised(model, delays, &self.sizes, self.time), weight);
        self.directions.rivals().map(realised)
    }
}

#[cfg(test)]
mod tests {
    use super::super::root::Root;
    use super::*;
    use crate::identify::likelihood::search::chart::Chart;

    /// The region of one pole that is known to a deviation, from 1000 samples, beside a rival as likely with a small lag of 1e5 samples.
    fn region(pole: f64, deviation: f64, lag: f64) -> Region {
        let one = Mat::<f64>::identity(1, 1);
        let model = Model::of((&one * pole).as_ref(), one.as_ref(), one.as_ref(), vec![0.0]).unwrap();
        let mut chart = Chart::fixed(&model);
        chart.directions[0] = Mat::from_fn(3, 1, |i, _| if i == 0 { 1.0 } else { 0.0 });
        let a = Mat::from_fn(2, 2, |i, j| if i == j { [pole, 1.0 - 1e-5][i] } else { 0.0 });
        let (b, c) = (Mat::from_fn(2, 1, |_, _| 1.0), Mat::from_fn(1, 2, |_, j| [1.0, lag * 1e-5][j]));
        let rival = Model::of(a.as_ref(), b.as_ref(), c.as_ref(), vec![0.0]).unwrap();
        let rivals = [model.clone(), rival].map(|model| (model, vec![0], 0.0)).into();
        let directions = Directions::of_parts((model, vec![0]), chart, Root::dense(&one * deviation), rivals);
        let sizes = Sizes { u: vec![1.0], y: vec![1.0] };
        Region::new(sizes, Discrete::new(1.0).unwrap(), &[1e-3, 0.1, 0.4], directions)
    }

    /// Below one period of the records the parameters count as there, and a lag of which the records show nothing as at that period.
    #[test]
    fn the_error_at_zero_is_that_of_the_parameters_and_no_slower_lag() {
        let at_zero =
            |deviation, lag| region(0.9, deviation, lag).at(0.0).entries().of_magnitude(c64::new(10.0, 0.0), (0, 0));
        // d (1 / (1 - a)) = da / (1 - a)^2, with half of the weight on the rival, whose first mode is the same
        assert!((at_zero(1e-3, 0.0) - 0.1).abs() < 1e-9, "{}", at_zero(1e-3, 0.0));
        // a lag of half of the gain at zero frequency is 1e-5 / 2 pi 1e-3 of it at the period of the records
        assert!(at_zero(1e-9, 5.0) < 0.01, "{}", at_zero(1e-9, 5.0));
        assert!(at_zero(1e-9, 5.0) > 0.0);
    }

    /// A rival that has all of the weight is drawn in half of the cases: the model was chosen beside it.
    #[test]
    fn a_rival_is_drawn_in_half_of_the_cases() {
        let mut region = region(0.9, 1e-3, 5.0);
        region.directions.rivals[0].2 = 0.0;
        region.directions.rivals[1].2 = 1.0;
        let lags = region.draws(500, 1).iter().filter(|d| d.plant.order() == 2).count();
        assert!((200..300).contains(&lags), "{lags}");
    }

    fn drawn(pole: f64) -> Vec<Draw> {
        let alone = |mut region: Region| {
            region.directions.rivals.clear();
            region
        };
        alone(region(pole, 0.2, 0.0)).draws(500, 1)
    }

    /// A third of the normal distribution lies outside of the circle, where the records of a stable plant cannot lie.
    #[test]
    fn a_draw_has_no_more_poles_outside_than_the_estimate() {
        let draws = drawn(0.9);
        assert_eq!(draws.len(), 500);
        assert!(draws.iter().all(|draw| draw.plant.a()[(0, 0)] <= 1.003));
        // the normal distribution that is cut at 1.003, half a deviation above its mean: P(z < -1) / P(z < 0.515)
        let below = draws.iter().filter(|draw| draw.plant.a()[(0, 0)] < 0.7).count() as f64 / 500.0;
        assert!((below - 0.159 / 0.697).abs() < 0.06, "{below}");
        assert!(drawn(1.1).iter().any(|draw| draw.plant.a()[(0, 0)] > 1.2));
    }
}
