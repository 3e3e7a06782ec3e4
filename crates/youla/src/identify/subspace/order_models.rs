//! The order by rules that need the models of all orders.
//!
//! With the one-step prediction errors e of the model of order n over all N samples and its `d(n)` parameters,
//! ```text
//! AIC(n) = log det (1/N sum e e') + 2 d(n) / N
//! ```
//! (Akaike, IEEE Trans. Autom. Control 19, 716, 1974). Cross-validation identifies the models from the leading part of each
//! experiment and simulates the rest with an estimated initial state; of the orders whose mean fit (26) is within a
//! tolerance of the best one it takes the lowest. An unstable model has no simulation and is passed over.

use super::order::{ByModels, OrderValue, least, parameters};
use super::output_error::prediction_errors;
use super::projected::Projected;
use super::{AutoOrder, Experiment, Innovation, NoInnovation, Order, OrderRule, SubspaceData, SubspaceModel};
use super::{SubspaceOptions, UncertaintyOptions, view::Signals};
use crate::identify::fit::reproduction;
use crate::lti::simulate_best;
use crate::{Error, Result};
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// The order up to `max` by the rule of `auto`.
pub(super) fn choose(
    data: &SubspaceData<'_>,
    projected: &Projected,
    auto: &AutoOrder,
    max: usize,
    options: &SubspaceOptions,
) -> Result<ByModels> {
    let values = match auto.rule {
        OrderRule::CrossValidation => cross_validation(data, auto.leading, max, options)?,
        _ => {
            let experiments = data.channels.scaled();
            each_order(max, |n| akaike(data, &experiments, projected, n, options))?
        }
    };
    let chosen = match auto.rule {
        OrderRule::CrossValidation => lowest_within(auto.tolerance, &values),
        _ => least(&values),
    };
    let order = chosen.ok_or_else(|| Error::NoSolution {
        what: "the choice of the order".into(),
        condition: format!("no model of an order up to {max} is stable and predicts"),
        residual: f64::NAN,
    })?;
    Ok(ByModels { order, values })
}

/// The value of each order; absent where the model is unstable although stability is required.
fn each_order(max: usize, value: impl Fn(usize) -> Result<Option<f64>> + Sync + Send) -> Result<Vec<OrderValue>> {
    let found: Vec<Result<Option<f64>>> = (1..=max).into_par_iter().map(value).collect();
    let entry = |(k, value): (usize, Result<Option<f64>>)| match value {
        Ok(value) => Ok(OrderValue { order: k + 1, value }),
        Err(Error::Unstable { .. }) => Ok(OrderValue { order: k + 1, value: None }),
        Err(error) => Err(error),
    };
    found.into_iter().enumerate().map(entry).collect()
}

fn lowest_within(tolerance: f64, values: &[OrderValue]) -> Option<usize> {
    let best = values.iter().filter_map(|v| v.value).fold(f64::NEG_INFINITY, f64::max);
    values.iter().find(|v| v.value.is_some_and(|fit| fit >= best - tolerance)).map(|v| v.order)
}

/// `log det Lambda + 2 d(n) / N`; minus infinity where the model leaves no error.
fn akaike(
    data: &SubspaceData<'_>,
    experiments: &[Signals],
    projected: &Projected,
    n: usize,
    options: &SubspaceOptions,
) -> Result<Option<f64>> {
    let scaled = data.scaled_model(projected, n, options)?;
    let gain = match &scaled.estimate.innovation {
        Innovation::Found { gain, .. } => gain,
        Innovation::None { reason: NoInnovation::NoiseFree } => return Ok(Some(f64::NEG_INFINITY)),
        Innovation::None { .. } => return Ok(None),
    };
    let errors = prediction_errors(experiments, &scaled.estimate.pair, gain.as_ref(), &scaled.fitted);
    let samples = errors.iter().map(|e| e.nrows()).sum::<usize>() as f64;
    let l = data.channels.outputs;
    let mut covariance = Mat::<f64>::zeros(l, l);
    errors.iter().for_each(|e| covariance += e.transpose() * e);
    covariance.col_iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v /= samples));
    let log_det = match covariance.llt(faer::Side::Lower) {
        Ok(factor) => (0..l).map(|i| 2.0 * factor.L()[(i, i)].ln()).sum(),
        Err(_) => f64::NEG_INFINITY,
    };
    Ok(Some(log_det + 2.0 * parameters(n, data.channels.inputs, l) / samples))
}

/// Mean fits on the rest of the experiments.
fn cross_validation(
    data: &SubspaceData<'_>,
    leading: f64,
    max: usize,
    options: &SubspaceOptions,
) -> Result<Vec<OrderValue>> {
    if !(leading > 0.0 && leading < 1.0) {
        let what = "the leading part of cross-validation".into();
        return Err(Error::OutOfRange { what, value: leading, must: "between 0 and 1" });
    }
    // The horizons stay those of all data.
    let uncertainty = UncertaintyOptions::default();
    let options = &SubspaceOptions { delays: Vec::new(), uncertainty, ..options.clone() };
    let experiments = data.channels.scaled();
    let parts: Vec<_> = experiments.iter().map(|signals| split(signals, leading)).collect();
    let disturbed = data.channels.disturbances() > 0;
    let first: Vec<Experiment<'_>> = parts
        .iter()
        .map(|([u, y, w], _)| Experiment { disturbance: disturbed.then_some(*w), ..Experiment::new(*u, *y) })
        .collect();
    let leading_data = SubspaceData::new(&first, data.time, options);
    let leading_data = leading_data.map_err(|e| e.within("cross-validation"))?;
    let projected = leading_data.project(options)?;
    each_order(max, |n| {
        let found = leading_data.model(&projected, &SubspaceOptions { order: Order::Fixed(n), ..options.clone() })?;
        if !found.stability.stable {
            return Ok(None);
        }
        let outputs: Vec<Mat<f64>> = (0..parts.len()).map(|e| undisturbed(&found, e, parts[e].1)).collect();
        let errors: Vec<Mat<f64>> = parts
            .iter()
            .zip(&outputs)
            .map(|((_, [u, _, _]), y)| Ok(y - simulate_best(&found.model, *u, y.as_ref())?))
            .collect::<Result<_>>()?;
        let measured: Vec<_> = outputs.iter().map(|y| y.as_ref()).collect();
        let fits = reproduction(&measured, &errors);
        Ok(Some(fits.iter().map(|output| output.fit).sum::<f64>() / fits.len() as f64))
    })
}

/// Inputs, outputs and known disturbances of the leading part and of the rest.
type Part<'a> = [MatRef<'a, f64>; 3];

fn split(signals: &Signals, leading: f64) -> (Part<'_>, Part<'_>) {
    let cut = (leading * signals.u.nrows() as f64) as usize;
    let [(u1, u2), (y1, y2), (w1, w2)] = [&signals.u, &signals.y, &signals.w].map(|m| m.as_ref().split_at_row(cut));
    ([u1, y1, w1], [u2, y2, w2])
}

/// The outputs of the rest without the disturbances as the leading part of their experiment tells them.
fn undisturbed(found: &SubspaceModel, experiment: usize, [_, y, w]: Part<'_>) -> Mat<f64> {
    match found.disturbances.get(experiment) {
        Some(coefficients) => y - w * coefficients,
        None => y.to_owned(),
    }
}
