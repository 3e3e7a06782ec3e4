//! The reduction in summary.json, in the artefacts of `6-reduce` and as CSV.

use super::entries::{pair, pairs};
use crate::stages::reduction::RunReduction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use youla::reduce::{ReductionMethod, SweepRow};
use youla_report::data::ReductionOrder;

/// Reduction of the recommended plant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReductionEntry {
    /// Method.
    pub method: ReductionMethod,
    /// States of a minimal realisation of the plant.
    pub minimal_order: usize,
    /// Poles kept as they are.
    pub kept: usize,
    /// Lowest order that the controller stabilises, where it does not stabilise this one.
    pub proposed_order: Option<usize>,
    /// The reduced model.
    #[serde(flatten)]
    pub chosen: ReductionOrder,
}

impl From<&RunReduction> for ReductionEntry {
    fn from(run: &RunReduction) -> Self {
        let (found, reduction) = (&run.found, &run.found.reduction);
        let of_order = ReductionOrder {
            order: found.order(),
            error_bound: reduction.error_bound,
            stabilised_by_controller: found.stabilised,
            ..ReductionOrder::default()
        };
        ReductionEntry {
            method: reduction.method,
            minimal_order: reduction.minimal_order,
            kept: reduction.kept.len(),
            proposed_order: found.proposed_order(),
            chosen: found.row().map_or(of_order, order),
        }
    }
}

/// `details` of `6-reduce/hansen_reduced.json`.
#[derive(Serialize)]
pub(crate) struct ReductionDetails<'a> {
    method: ReductionMethod,
    hankel_singular_values: &'a [f64],
    error_bound: Option<f64>,
    minimal_order: usize,
    kept_poles: Vec<[f64; 2]>,
    /// A pole outside of the unit circle where the bound is not valid because of it.
    unstable_pole: Option<[f64; 2]>,
    /// Sizes of the outputs by which the error was scaled.
    output_scale: Option<&'a [f64]>,
    /// Sizes of the inputs.
    input_scale: Option<&'a [f64]>,
    stabilised_by_controller: bool,
    proposed_order: Option<usize>,
}

impl<'a> From<&'a RunReduction> for ReductionDetails<'a> {
    fn from(run: &'a RunReduction) -> Self {
        let r = &run.found.reduction;
        ReductionDetails {
            method: r.method,
            hankel_singular_values: &r.hankel,
            error_bound: r.error_bound,
            minimal_order: r.minimal_order,
            kept_poles: pairs(&r.kept),
            unstable_pole: r.unstable_pole.map(pair),
            output_scale: run.options.output_scale.as_deref(),
            input_scale: run.options.input_scale.as_deref(),
            stabilised_by_controller: run.found.stabilised,
            proposed_order: run.found.proposed_order(),
        }
    }
}

/// `6-reduce/sweep.json`; what is infinite or does not exist is null.
#[derive(Serialize)]
pub(crate) struct SweepFile<'a> {
    #[serde(flatten)]
    details: ReductionDetails<'a>,
    plant_norm: Option<f64>,
    closed_loop_norm: Option<f64>,
    chosen: usize,
    sentence: String,
    orders: Vec<ReductionOrder>,
}

impl<'a> From<&'a RunReduction> for SweepFile<'a> {
    fn from(run: &'a RunReduction) -> Self {
        SweepFile {
            details: run.into(),
            plant_norm: run.found.sweep.plant_norm,
            closed_loop_norm: run.found.sweep.response_norm,
            chosen: run.found.order(),
            sentence: run.found.sentence(),
            orders: orders(run),
        }
    }
}

/// Every order that was tried.
pub(crate) fn orders(run: &RunReduction) -> Vec<ReductionOrder> {
    run.found.sweep.rows.iter().map(order).collect()
}

fn order(row: &SweepRow) -> ReductionOrder {
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    ReductionOrder {
        order: row.order,
        error_bound: finite(row.error_bound),
        open_loop_error: finite(row.open_loop),
        open_loop_relative: finite(row.open_loop_relative),
        closed_loop_relative: finite(row.closed_loop),
        stabilised_by_controller: row.stabilised,
        worst_closed_loop_pole: row.worst_pole.map(pair),
        failure: row.failure.clone(),
    }
}

/// `6-reduce/sweep.csv`: one line per order.
pub(crate) fn as_csv(orders: &[ReductionOrder]) -> String {
    let number = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let mut text = String::from(
        "order,error_bound,open_loop_error,open_loop_relative,closed_loop_relative,stabilised_by_controller,worst_pole_re,worst_pole_im\n",
    );
    for r in orders {
        let errors = [r.error_bound, r.open_loop_error, r.open_loop_relative, r.closed_loop_relative];
        let pole = [0, 1].map(|k| r.worst_closed_loop_pole.map(|p| p[k]));
        let [errors, pole] =
            [&errors[..], &pole].map(|all| all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(","));
        text += &format!("{},{errors},{},{pole}\n", r.order, r.stabilised_by_controller);
    }
    text
}
