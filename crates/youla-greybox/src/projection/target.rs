//! What is projected: a sampled frequency response on a grid, and what an error counts at each of its values.
//!
//! It is held as responses U (m x r) and Y (p x r) of inputs and outputs of the plant to r excitations, `Y = G U`; a plain G
//! has `U = I`. In a loop, where U and Y come from the excitation alone, this needs no division by U, which is small where
//! the loop keeps the excitation from the plant.

use crate::{Error, Result};
use faer::{Mat, MatRef, Scale, c64};
use std::f64::consts::PI;
use youla::linalg::{check_finite, check_shape};
use youla::lti::{Discrete, FrequencyResponse, StateSpace, frequency_response};

/// Values of a sampled p x m system at angular frequencies below the Nyquist frequency, with a weight for each value.
///
/// ```
/// use youla_greybox::{DeclaredStructure, FrequencyTarget, Structure, Template, logarithmic_grid};
/// use youla::lti::Discrete;
/// let bearing = DeclaredStructure::new(&Template::Bearing.declaration()?)?;
/// let model = bearing.model(&bearing.start())?.zoh(Discrete::new(2e-4)?)?;
/// let target = FrequencyTarget::of_model(&model, &logarithmic_grid([60.0, 12_000.0], 100)?)?;
/// assert_eq!((target.omega().len(), target.outputs(), target.inputs()), (100, 2, 2));
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct FrequencyTarget {
    omega: Vec<f64>,
    /// U, m x r each.
    excited: Vec<Mat<c64>>,
    /// Y, p x r each.
    values: Vec<Mat<c64>>,
    /// W, p x r each.
    weights: Vec<Mat<f64>>,
    time: Discrete,
    /// sigma, 1/s.
    decay: f64,
}

impl FrequencyTarget {
    /// A response from its values, one p x m matrix for each frequency in rad/s, all with weight 1.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] for a frequency that is not between 0 and the Nyquist frequency; [`youla::Error::Ports`] without
    /// any or with another number of values; [`youla::Error::Shape`]; [`youla::Error::NotFinite`].
    pub fn new(omega: &[f64], values: Vec<Mat<c64>>, time: Discrete) -> Result<Self> {
        let inputs = values.first().map_or(0, |first| first.ncols());
        let one = |i: usize, j: usize| c64::new(if i == j { 1.0 } else { 0.0 }, 0.0);
        let excited = vec![Mat::from_fn(inputs, inputs, one); values.len()];
        Self::of_excitation(omega, excited, values, time)
    }

    /// The responses of inputs (m x r) and outputs (p x r) of the plant to the same r excitations, all with weight 1.
    ///
    /// # Errors
    /// As [`FrequencyTarget::new`].
    pub fn of_excitation(omega: &[f64], inputs: Vec<Mat<c64>>, outputs: Vec<Mat<c64>>, time: Discrete) -> Result<Self> {
        let nyquist = PI / time.ts();
        if let Some(bad) = omega.iter().find(|w| !(**w > 0.0 && **w < nyquist)) {
            let must = "positive and below the Nyquist frequency, in rad/s";
            return Err(Error::Method(youla::Error::OutOfRange {
                what: "a frequency of the response".into(),
                value: *bad,
                must,
            }));
        }
        for all in [&inputs, &outputs] {
            let size = all.first().map_or(0, |first| first.nrows() * first.ncols());
            if all.len() != omega.len() || size == 0 {
                let what = "the number of values of the frequency response".into();
                return Err(Error::Method(youla::Error::Ports {
                    what,
                    expected: omega.len().max(1),
                    found: all.len(),
                }));
            }
            for value in all {
                let what = "a value of the frequency response";
                let sizes = Mat::from_fn(value.nrows(), value.ncols(), |i, j| value[(i, j)].norm());
                check_shape(what, sizes.as_ref(), (all[0].nrows(), inputs[0].ncols()))?;
                check_finite(what, sizes.as_ref())?;
            }
        }
        let weights = vec![Mat::from_fn(outputs[0].nrows(), outputs[0].ncols(), |_, _| 1.0); omega.len()];
        Ok(FrequencyTarget { omega: omega.to_vec(), excited: inputs, values: outputs, weights, time, decay: 0.0 })
    }

    /// The response of a model at the angular frequencies `omega`, rad/s.
    ///
    /// # Errors
    /// As [`FrequencyTarget::new`]; [`youla::Error::PoleOnBoundary`].
    pub fn of_model(model: &StateSpace<Discrete>, omega: &[f64]) -> Result<Self> {
        let values = frequency_response(model, omega)?.iter().map(|g| g.to_owned()).collect();
        Self::new(omega, values, model.time())
    }

    /// The same with the weights W, as large as the values: `sum |W (Y - G_theta U)|^2` entry by entry. A value that is not
    /// known has the weight 0.
    ///
    /// # Errors
    /// [`youla::Error::Ports`], [`youla::Error::Shape`], [`youla::Error::OutOfRange`] for a weight that is not a number from 0.
    pub(crate) fn weighted(mut self, weights: Vec<Mat<f64>>) -> Result<Self> {
        if weights.len() != self.omega.len() {
            let what = "the number of weights of the frequency response".into();
            return Err(Error::Method(youla::Error::Ports { what, expected: self.omega.len(), found: weights.len() }));
        }
        for weight in &weights {
            check_shape("a weight of the frequency response", weight.as_ref(), (self.outputs(), self.columns()))?;
            let entries = weight.col_iter().flat_map(|column| column.iter());
            if let Some(bad) = entries.into_iter().find(|w| !(**w >= 0.0 && w.is_finite())) {
                let what = "a weight of the frequency response".into();
                return Err(Error::Method(youla::Error::OutOfRange { what, value: *bad, must: "a number from 0" }));
            }
        }
        self.weights = weights;
        Ok(self)
    }

    /// Says that the values are those at `z = exp((decay + j omega) ts)`, decay in 1/s: of signals times `exp(-decay t)`. Modes
    /// that live longer than `1 / decay`, which a record of that length cannot show, are flat there.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] unless it is a number from 0.
    pub fn decaying(mut self, decay: f64) -> Result<Self> {
        if !(decay >= 0.0 && decay.is_finite()) {
            let what = "the decay of a frequency response".into();
            return Err(Error::Method(youla::Error::OutOfRange {
                what,
                value: decay,
                must: "a number from 0, in 1/s",
            }));
        }
        self.decay = decay;
        Ok(self)
    }

    /// Says that the inputs reach the structure by these whole samples later: `U_j exp(-s ts d_j)`. After
    /// [`FrequencyTarget::decaying`]; none when empty.
    ///
    /// # Errors
    /// [`youla::Error::Ports`] for another number of delays than inputs.
    pub(crate) fn behind_delays(mut self, delays: &[usize]) -> Result<Self> {
        if delays.is_empty() {
            return Ok(self);
        }
        if delays.len() != self.inputs() {
            let what = "the number of delays of the frequency response".into();
            return Err(Error::Method(youla::Error::Ports { what, expected: self.inputs(), found: delays.len() }));
        }
        for k in 0..self.omega.len() {
            let sample = self.s(k) * self.time.ts();
            for (j, delay) in delays.iter().enumerate() {
                let turn = (-sample * *delay as f64).exp();
                self.excited[k].row_mut(j).iter_mut().for_each(|u| *u *= turn);
            }
        }
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
        self.excited[0].nrows()
    }

    /// Number of excitations r; m for a plain response.
    pub(crate) fn columns(&self) -> usize {
        self.values[0].ncols()
    }

    /// Sample time.
    pub fn time(&self) -> Discrete {
        self.time
    }

    /// `sigma + j omega` at frequency number `k`.
    pub(super) fn s(&self, k: usize) -> c64 {
        c64::new(self.decay, self.omega[k])
    }

    /// The response of a model on the grid.
    pub(super) fn response(&self, model: &StateSpace<Discrete>) -> Result<FrequencyResponse> {
        frequency_response(&decayed(model, self.decay)?, &self.omega).map_err(Error::from)
    }

    /// U at frequency number `k`.
    pub(super) fn excited(&self, k: usize) -> MatRef<'_, c64> {
        self.excited[k].as_ref()
    }

    /// Y at frequency number `k`.
    pub(super) fn value(&self, k: usize) -> MatRef<'_, c64> {
        self.values[k].as_ref()
    }

    /// W at frequency number `k`.
    pub(super) fn weight(&self, k: usize) -> MatRef<'_, f64> {
        self.weights[k].as_ref()
    }

    /// `sum_k |W Y|^2` for each entry, p x r.
    pub(super) fn entries(&self) -> Mat<f64> {
        let sum = |i, j| self.values.iter().zip(&self.weights).map(|(g, w)| square(g, w, i, j)).sum();
        Mat::from_fn(self.outputs(), self.columns(), sum)
    }

    /// `|W Y|`.
    pub(super) fn size(&self) -> f64 {
        self.energies().sum::<f64>().sqrt()
    }

    /// `sum_ij |W Y|^2` for each frequency.
    fn energies(&self) -> impl Iterator<Item = f64> + '_ {
        let (p, r) = (self.outputs(), self.columns());
        self.values
            .iter()
            .zip(&self.weights)
            .map(move |(g, w)| (0..p * r).map(|entry| square(g, w, entry % p, entry / p)).sum())
    }

    /// The frequencies between which all but a share of `|W Y|^2` lies on either side.
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
            excited: kept.iter().map(|k| self.excited[*k].clone()).collect(),
            values: kept.iter().map(|k| self.values[*k].clone()).collect(),
            weights: kept.iter().map(|k| self.weights[*k].clone()).collect(),
            time: self.time,
            decay: self.decay,
        }
    }
}

/// `|W Y|^2` of one entry.
fn square(g: &Mat<c64>, w: &Mat<f64>, i: usize, j: usize) -> f64 {
    g[(i, j)].norm_sqr() * w[(i, j)].powi(2)
}

/// The system with the response `G(z exp(decay ts))`: `(A, B) exp(-decay ts)`.
pub(crate) fn decayed(model: &StateSpace<Discrete>, decay: f64) -> Result<StateSpace<Discrete>> {
    let factor = Scale((-decay * model.time().ts()).exp());
    StateSpace::new(factor * model.a(), factor * model.b(), model.c().to_owned(), model.d().to_owned(), model.time())
        .map_err(Error::from)
}

/// `count` angular frequencies from `band[0]` to `band[1]`, rad/s, with equal ratios.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for fewer than two frequencies or a band that is not positive and increasing.
pub fn logarithmic_grid(band: [f64; 2], count: usize) -> Result<Vec<f64>> {
    if count < 2 {
        let what = "the number of frequencies".into();
        return Err(Error::Method(youla::Error::OutOfRange { what, value: count as f64, must: "at least 2" }));
    }
    let [low, high] = band;
    if !(low > 0.0 && high > low && high.is_finite()) {
        let what = "the lower end of the band of frequencies".into();
        return Err(Error::Method(youla::Error::OutOfRange {
            what,
            value: low,
            must: "positive and below the upper end",
        }));
    }
    let ratio = (high / low).ln() / (count - 1) as f64;
    Ok((0..count).map(|k| if k + 1 == count { high } else { low * (ratio * k as f64).exp() }).collect())
}
