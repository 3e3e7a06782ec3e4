//! What is projected: a sampled frequency response on a grid, and what an error counts at each of its values.

use crate::linalg::check_shape;
use crate::lti::{Discrete, StateSpace, frequency_response};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};
use std::f64::consts::PI;

/// Values of a sampled p x m system at angular frequencies below the Nyquist frequency, with a weight for each value.
///
/// ```
/// use youla::identify::greybox::{FrequencyTarget, logarithmic_grid};
/// use youla::{lti::Discrete, rig::Bearing};
/// let model = Bearing::default().plant()?.zoh(Discrete::new(2e-4)?)?;
/// let target = FrequencyTarget::of_model(&model, &logarithmic_grid([60.0, 12_000.0], 100)?)?;
/// assert_eq!((target.omega().len(), target.outputs(), target.inputs()), (100, 2, 2));
/// # Ok::<(), youla::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct FrequencyTarget {
    omega: Vec<f64>,
    values: Vec<Mat<c64>>,
    weights: Vec<Mat<f64>>,
    time: Discrete,
}

impl FrequencyTarget {
    /// A response from its values, one p x m matrix for each frequency in rad/s, all with weight 1.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a frequency that is not between 0 and the Nyquist frequency; [`Error::Ports`] without
    /// any or with another number of values; [`Error::Shape`]; [`Error::NotFinite`].
    pub fn new(omega: &[f64], values: Vec<Mat<c64>>, time: Discrete) -> Result<Self> {
        let nyquist = PI / time.ts();
        if let Some(bad) = omega.iter().find(|w| !(**w > 0.0 && **w < nyquist)) {
            let must = "positive and below the Nyquist frequency, in rad/s";
            return Err(Error::OutOfRange { what: "a frequency of the response".into(), value: *bad, must });
        }
        let shape = values.first().map_or((0, 0), |first| (first.nrows(), first.ncols()));
        if values.len() != omega.len() || shape.0 * shape.1 == 0 {
            let what = "the number of values of the frequency response".into();
            return Err(Error::Ports { what, expected: omega.len().max(1), found: values.len() });
        }
        for value in &values {
            let what = "a value of the frequency response";
            let sizes = Mat::from_fn(value.nrows(), value.ncols(), |i, j| value[(i, j)].norm());
            check_shape(what, sizes.as_ref(), shape)?;
            crate::linalg::check_finite(what, sizes.as_ref())?;
        }
        let weights = vec![Mat::from_fn(shape.0, shape.1, |_, _| 1.0); omega.len()];
        Ok(FrequencyTarget { omega: omega.to_vec(), values, weights, time })
    }

    /// The response of a model at the angular frequencies `omega`, rad/s.
    ///
    /// # Errors
    /// As [`FrequencyTarget::new`]; [`Error::PoleOnBoundary`].
    pub fn of_model(model: &StateSpace<Discrete>, omega: &[f64]) -> Result<Self> {
        let values = frequency_response(model, omega)?.iter().map(|g| g.to_owned()).collect();
        Self::new(omega, values, model.time())
    }

    /// The same with the weights W, p x m for each frequency: `sum |W (G - G_theta)|^2` entry by entry. A value that is not
    /// known has the weight 0.
    ///
    /// # Errors
    /// [`Error::Ports`], [`Error::Shape`], [`Error::OutOfRange`] for a weight that is not a number from 0.
    pub fn weighted(mut self, weights: Vec<Mat<f64>>) -> Result<Self> {
        if weights.len() != self.omega.len() {
            let what = "the number of weights of the frequency response".into();
            return Err(Error::Ports { what, expected: self.omega.len(), found: weights.len() });
        }
        for weight in &weights {
            check_shape("a weight of the frequency response", weight.as_ref(), (self.outputs(), self.inputs()))?;
            let entries = weight.col_iter().flat_map(|column| column.iter());
            if let Some(bad) = entries.into_iter().find(|w| !(**w >= 0.0 && w.is_finite())) {
                let what = "a weight of the frequency response".into();
                return Err(Error::OutOfRange { what, value: *bad, must: "a number from 0" });
            }
        }
        self.weights = weights;
        Ok(self)
    }

    /// Angular frequencies, rad/s.
    pub fn omega(&self) -> &[f64] {
        &self.omega
    }

    /// Number of outputs p.
    pub fn outputs(&self) -> usize {
        self.values[0].nrows()
    }

    /// Number of inputs m.
    pub fn inputs(&self) -> usize {
        self.values[0].ncols()
    }

    /// Sample time.
    pub fn time(&self) -> Discrete {
        self.time
    }

    /// G at frequency number `k`.
    pub(super) fn value(&self, k: usize) -> MatRef<'_, c64> {
        self.values[k].as_ref()
    }

    /// W at frequency number `k`.
    pub(super) fn weight(&self, k: usize) -> MatRef<'_, f64> {
        self.weights[k].as_ref()
    }

    /// `sum_k |W G|^2` for each entry, p x m.
    pub(super) fn entries(&self) -> Mat<f64> {
        let sum = |i, j| self.values.iter().zip(&self.weights).map(|(g, w)| square(g, w, i, j)).sum();
        Mat::from_fn(self.outputs(), self.inputs(), sum)
    }

    /// `|W G|`.
    pub(super) fn size(&self) -> f64 {
        self.energies().sum::<f64>().sqrt()
    }

    /// `sum_ij |W G|^2` for each frequency.
    fn energies(&self) -> impl Iterator<Item = f64> + '_ {
        let (p, m) = (self.outputs(), self.inputs());
        self.values
            .iter()
            .zip(&self.weights)
            .map(move |(g, w)| (0..p * m).map(|entry| square(g, w, entry % p, entry / p)).sum())
    }

    /// The frequencies between which all but a share of `|W G|^2` lies on either side.
    pub(super) fn band(&self, share: f64) -> [f64; 2] {
        let mut order: Vec<(f64, f64)> = self.omega.iter().copied().zip(self.energies()).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = order.iter().map(|(_, e)| e).sum();
        let at = |part: f64| {
            let mut sum = 0.0;
            let beyond = order.iter().find(|(_, e)| {
                sum += e;
                sum >= part * total
            });
            beyond.or(order.last()).map_or(1.0, |(omega, _)| *omega)
        };
        [at(share), at(1.0 - share)]
    }

    /// Every `step`-th frequency, with at least two kept.
    pub(super) fn thinned(&self, step: usize) -> Self {
        let kept: Vec<usize> = (0..self.omega.len()).step_by(step.max(1)).collect();
        FrequencyTarget {
            omega: kept.iter().map(|k| self.omega[*k]).collect(),
            values: kept.iter().map(|k| self.values[*k].clone()).collect(),
            weights: kept.iter().map(|k| self.weights[*k].clone()).collect(),
            time: self.time,
        }
    }
}

/// `|W G|^2` of one entry.
fn square(g: &Mat<c64>, w: &Mat<f64>, i: usize, j: usize) -> f64 {
    g[(i, j)].norm_sqr() * w[(i, j)].powi(2)
}

/// `count` angular frequencies from `band[0]` to `band[1]`, rad/s, with equal ratios.
///
/// # Errors
/// [`Error::OutOfRange`] for fewer than two frequencies or a band that is not positive and increasing.
pub fn logarithmic_grid(band: [f64; 2], count: usize) -> Result<Vec<f64>> {
    if count < 2 {
        let what = "the number of frequencies".into();
        return Err(Error::OutOfRange { what, value: count as f64, must: "at least 2" });
    }
    let [low, high] = band;
    if !(low > 0.0 && high > low && high.is_finite()) {
        let what = "the lower end of the band of frequencies".into();
        return Err(Error::OutOfRange { what, value: low, must: "positive and below the upper end" });
    }
    let ratio = (high / low).ln() / (count - 1) as f64;
    Ok((0..count).map(|k| if k + 1 == count { high } else { low * (ratio * k as f64).exp() }).collect())
}
