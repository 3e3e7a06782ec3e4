//! The horizons from the data, and models over several horizons.
//!
//! The past p is the order of the vector autoregression with inputs that minimises Akaike's criterion over T columns,
//! ```text
//! y(k) = sum_{i=1..p} Xi_i z(k-i) + [D u(k)] + e(k),    AIC(p) = log det (1/T sum e e') + 2 p (m + l) l / T,   p = 1 ... max
//! ```
//! (on what this autoregression means for the methods: Chiuso, Automatica 43, 1034, 2007): as many lags as the data can tell
//! from noise. The columns of ONE triangular factor stand in the order `[z(k-1), z(k-2), ..., z(k-max), y(k)]`: the residuals of order p are
//! what R holds of y(k) below its first `p (m + l)` columns. The future is `s = max(p, n / l + 1)` block rows, rounded up, so
//! that it is at least as long as the past and holds the largest order n asked for.

use super::channels::Channels;
use super::factorisation::HankelLq;
use super::hankel_layout::HankelLayout;
use super::{Feedthrough, Horizon, Order, SubspaceData, SubspaceModel, SubspaceOptions};
use crate::Result;
use crate::linalg::leading_rank;
use faer::MatRef;

/// Past and future as the data propose them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HorizonReport {
    /// Block rows of the past; equal to the largest one considered where more might have been better.
    pub past: usize,
    /// Block rows of the future.
    pub horizon: usize,
    /// AIC for a past of 1, 2, ... block rows; minus infinity where the autoregression leaves no error.
    pub criterion: Vec<f64>,
}

/// Past and future for the largest order that `options` ask for.
pub(super) fn find(data: &Channels<'_>, max: usize, options: &SubspaceOptions) -> Result<HorizonReport> {
    let feedthrough = options.feedthrough != Feedthrough::None;
    let arrangement = HankelLayout::NewestFirst { feedthrough };
    let triangle = HankelLq::new(data, (max, 1), arrangement, options.factorisation)?;
    let r = triangle.arranged(arrangement, max, 1)?;
    let (m, l) = (data.inputs, data.outputs);
    let before = if feedthrough { m } else { 0 };
    let y = r.as_ref().subcols(before + max * (m + l), l);
    let criterion: Vec<f64> = (1..=max)
        .map(|p| {
            let explained = leading_rank(r.as_ref(), before + p * (m + l));
            let residual = y.subrows(explained, y.nrows() - explained);
            log_det(residual, triangle.columns) + 2.0 * (p * (m + l) * l) as f64 / triangle.columns as f64
        })
        .collect();
    let least = (0..max).min_by(|a, b| criterion[*a].total_cmp(&criterion[*b]));
    let past = 1 + least.unwrap_or(0);
    let horizon = past.max(options.largest_order().div_ceil(l) + 1).max(2);
    Ok(HorizonReport { past, horizon, criterion })
}

/// `log det (E' E / T)`.
fn log_det(residual: MatRef<'_, f64>, columns: usize) -> f64 {
    let covariance = residual.transpose() * residual;
    match covariance.llt(faer::Side::Lower) {
        Ok(factor) => {
            (0..covariance.nrows()).map(|i| 2.0 * factor.L()[(i, i)].ln() - (columns as f64).ln()).sum::<f64>()
        }
        Err(_) => f64::NEG_INFINITY,
    }
}

/// One model of a scan.
#[derive(Debug)]
pub struct ScannedModel {
    /// Block rows of past and future.
    pub horizon: Horizon,
    /// Order asked for.
    pub order: usize,
    /// The model, or the reason why there is none, for example an order beyond this horizon.
    pub model: Result<SubspaceModel>,
}

impl HorizonReport {
    /// The choice.
    pub(super) fn chosen(&self) -> Horizon {
        Horizon::Fixed { future: self.horizon, past: self.past }
    }
}

impl SubspaceData<'_> {
    /// Models over several horizons and orders from this one factorisation, to see what depends on the choice: horizon by
    /// horizon, each with all orders, for which one projection serves.
    ///
    /// # Errors
    /// Those that concern all models: [`crate::Error::OutOfRange`] for a horizon or past longer than those of the factor,
    /// [`crate::Error::Unsupported`], [`crate::Error::InsufficientExcitation`]. What concerns one model stands in its place.
    ///
    /// ```
    /// use youla::{Mat, lti::Discrete};
    /// use youla::identify::subspace::{Experiment, Horizon, SubspaceData, SubspaceOptions};
    /// let u = Mat::from_fn(400, 1, |k, _| ((k * k) as f64).sin());
    /// let mut y = Mat::zeros(400, 1);
    /// for k in 1..399 {
    ///     y[(k + 1, 0)] = 1.2 * y[(k, 0)] - 0.7 * y[(k - 1, 0)] + u[(k, 0)];
    /// }
    /// let options = SubspaceOptions { horizon: 12.into(), ..Default::default() };
    /// let data = SubspaceData::new(&[Experiment::new(u.as_ref(), y.as_ref())], Discrete::new(0.01)?, &options)?;
    /// for found in data.scan(&[4, 8, 12].map(Horizon::from), &[2], &options)? {
    ///     let modes = found.model?.model.modes()?;
    ///     println!("s = {}: {:.2} Hz, damping ratio {:.3}", found.horizon.future(), modes[0].hz, modes[0].zeta);
    ///     assert!((modes[0].hz - 12.60).abs() < 0.01);
    /// }
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn scan(&self, horizons: &[Horizon], orders: &[usize], options: &SubspaceOptions) -> Result<Vec<ScannedModel>> {
        let mut found = Vec::new();
        for &horizon in horizons {
            let options = SubspaceOptions { horizon, ..options.clone() };
            let options = self.checked(&options)?;
            let projected = self.project(&options)?;
            for &order in orders {
                let model = self.model(&projected, &SubspaceOptions { order: Order::Fixed(order), ..options.clone() });
                found.push(ScannedModel { horizon: options.horizon, order, model });
            }
        }
        Ok(found)
    }
}
