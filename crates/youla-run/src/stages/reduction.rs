//! The reduction of a run: in its loop, scaled where the method needs it; its sweep as artefact, summary and figure.

use crate::Result;
use crate::records::RunRecords;
use crate::summary::entries::{finite, pair, pairs};
use serde::{Deserialize, Serialize};
use youla::factor::CoprimeFactors;
use youla::lti::{Discrete, StateSpace};
use youla::reduce::{
    LoopReduction, ReductionLoop, ReductionMethod, ReductionOptions, ReductionSweep, SweepRow, reduce_in_loop,
};
use youla_report::data::{self as draw, ReportPart, Status};

/// Closed-loop error from which a reduction is to be looked at.
/// The demonstration reduced from 16 to 6 states has 0.054 (`docs/reduction.md`). Chosen, not measured.
const LARGE_ERROR: f64 = 0.05;

/// A reduction and the scales on which it rests.
#[derive(Debug, Clone)]
pub struct RunReduction {
    /// The options as they were used: with the scales that the records gave.
    pub options: ReductionOptions,
    /// The reduced model, its loop and all orders.
    pub found: LoopReduction<Discrete>,
}

/// Reduces the plant in its loop. Normalised coprime factors depend on the unit of the outputs against that of the inputs: where no
/// scales are given, the rms of the estimation records is theirs.
pub(crate) fn run_reduction(
    factors: &CoprimeFactors<Discrete>,
    plant: &StateSpace<Discrete>,
    records: &RunRecords,
    options: &ReductionOptions,
) -> Result<RunReduction> {
    let mut options = options.clone();
    if options.method == ReductionMethod::NormalisedCoprime {
        let (inputs, outputs) = records.sizes();
        options.output_scale.get_or_insert(outputs);
        options.input_scale.get_or_insert(inputs);
    }
    let model = ReductionLoop::of_plant(factors, plant)?;
    let found = reduce_in_loop(&model, &options)?;
    Ok(RunReduction { options, found })
}

impl RunReduction {
    /// What the artefact of the reduced model holds besides its matrices.
    pub(crate) fn details(&self) -> ReductionDetails<'_> {
        let r = &self.found.reduction;
        ReductionDetails {
            method: r.method,
            hankel_singular_values: &r.hankel,
            error_bound: r.error_bound,
            minimal_order: r.minimal_order,
            kept_poles: pairs(&r.kept),
            unstable_pole: r.unstable_pole.map(pair),
            output_scale: self.options.output_scale.as_deref(),
            input_scale: self.options.input_scale.as_deref(),
            stabilised: self.found.stabilised,
            proposed_order: self.found.proposed_order(),
        }
    }

    /// The entry of summary.json.
    pub(crate) fn entry(&self) -> ReductionEntry {
        let (found, row) = (&self.found, self.found.row());
        let figure = |of: fn(&SweepRow) -> Option<f64>| row.and_then(of).and_then(finite);
        ReductionEntry {
            method: found.reduction.method,
            order: found.order(),
            minimal_order: found.reduction.minimal_order,
            kept: found.reduction.kept.len(),
            error_bound: found.reduction.error_bound.and_then(finite),
            open_loop_error: figure(|r| r.open_loop),
            open_loop_relative: figure(|r| r.open_loop_relative),
            closed_loop_relative: figure(|r| r.closed_loop),
            stabilised_by_controller: found.stabilised,
            proposed_order: found.proposed_order(),
        }
    }

    /// `6-reduce/sweep.json`; what is infinite or does not exist is null.
    pub(crate) fn file(&self) -> SweepFile<'_> {
        let ReductionSweep { method, rows, hankel, kept, minimal_order, plant_norm, response_norm } = &self.found.sweep;
        let row = |r: &SweepRow| SweepEntry {
            order: r.order,
            error_bound: r.error_bound,
            open_loop_error: r.open_loop,
            open_loop_relative: r.open_loop_relative,
            closed_loop_relative: r.closed_loop,
            stabilised_by_controller: r.stabilised,
            worst_closed_loop_pole: r.worst_pole.map(pair),
            failure: r.failure.clone(),
        };
        SweepFile {
            method: *method,
            minimal_order: *minimal_order,
            kept_poles: pairs(kept),
            hankel_singular_values: hankel,
            output_scale: self.options.output_scale.as_deref(),
            input_scale: self.options.input_scale.as_deref(),
            plant_norm: *plant_norm,
            closed_loop_norm: *response_norm,
            chosen: self.found.order(),
            stabilised_by_controller: self.found.stabilised,
            proposed_order: self.found.proposed_order(),
            sentence: self.found.sentence(),
            orders: rows.iter().map(row).collect(),
        }
    }

    /// The sentence of the verdict.
    pub(crate) fn verdict(&self) -> draw::Verdict {
        let found = &self.found;
        let error = found.row().and_then(|row| row.closed_loop);
        let status = match (found.stabilised, error) {
            (false, _) => Status::Bad,
            (true, Some(error)) if error < LARGE_ERROR && found.reduction.unstable_pole.is_none() => Status::Good,
            _ => Status::Caution,
        };
        draw::Verdict { status, text: found.sentence(), evidence: ReportPart::Reduction }
    }

    /// As the report draws it.
    pub(crate) fn drawn(&self) -> draw::Reduction {
        let (r, sweep) = (&self.found.reduction, &self.found.sweep);
        let row = |row: &SweepRow| draw::ReductionOrder {
            order: row.order,
            bound: row.error_bound,
            open_loop: row.open_loop,
            open_loop_relative: row.open_loop_relative,
            closed_loop_relative: row.closed_loop,
            stabilised: row.stabilised,
            worst_pole: row.worst_pole.map(pair),
            failure: row.failure.clone(),
        };
        draw::Reduction {
            label: format!("G(S) by {}", r.method),
            hankel: r.hankel.clone(),
            chosen: self.found.order(),
            kept: r.kept.len(),
            bound: r.error_bound,
            bound_is_gap: r.method == ReductionMethod::NormalisedCoprime,
            plant_norm: sweep.plant_norm,
            orders: sweep.rows.iter().map(row).collect(),
            sentence: self.found.sentence(),
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
    unstable_pole: Option<[f64; 2]>,
    output_scale: Option<&'a [f64]>,
    input_scale: Option<&'a [f64]>,
    stabilised: bool,
    proposed_order: Option<usize>,
}

/// The reduction in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReductionEntry {
    /// Method.
    pub method: ReductionMethod,
    /// States of the reduced model.
    pub order: usize,
    /// States of a minimal realisation of G(S).
    pub minimal_order: usize,
    /// Poles kept as they are.
    pub kept: usize,
    /// Bound of the error; `null` where there is none.
    pub error_bound: Option<f64>,
    /// Largest singular value of the error over frequency.
    pub open_loop_error: Option<f64>,
    /// The same over that of G(S).
    pub open_loop_relative: Option<f64>,
    /// The same of the response from alpha to y; `null` where the controller does not stabilise the reduced model.
    pub closed_loop_relative: Option<f64>,
    /// Whether the controller that ran stabilises the reduced model.
    pub stabilised_by_controller: bool,
    /// Lowest order that it stabilises, where it does not stabilise this one.
    pub proposed_order: Option<usize>,
}

/// `6-reduce/sweep.json`.
#[derive(Serialize)]
pub(crate) struct SweepFile<'a> {
    method: ReductionMethod,
    minimal_order: usize,
    kept_poles: Vec<[f64; 2]>,
    hankel_singular_values: &'a [f64],
    output_scale: Option<&'a [f64]>,
    input_scale: Option<&'a [f64]>,
    plant_norm: Option<f64>,
    closed_loop_norm: Option<f64>,
    chosen: usize,
    stabilised_by_controller: bool,
    proposed_order: Option<usize>,
    sentence: String,
    orders: Vec<SweepEntry>,
}

#[derive(Serialize)]
struct SweepEntry {
    order: usize,
    error_bound: Option<f64>,
    open_loop_error: Option<f64>,
    open_loop_relative: Option<f64>,
    closed_loop_relative: Option<f64>,
    stabilised_by_controller: bool,
    worst_closed_loop_pole: Option<[f64; 2]>,
    failure: Option<String>,
}

/// All orders as lines of text; an empty field where there is no number.
pub(crate) fn as_csv(sweep: &ReductionSweep) -> String {
    let number = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let mut text = String::from(
        "order,error_bound,open_loop_error,open_loop_relative,closed_loop_relative,stabilised_by_controller,worst_pole_re,worst_pole_im\n",
    );
    for r in &sweep.rows {
        let errors = [r.error_bound, r.open_loop, r.open_loop_relative, r.closed_loop].map(number).join(",");
        let pole = [r.worst_pole.map(|p| p.re), r.worst_pole.map(|p| p.im)].map(number).join(",");
        text += &format!("{},{errors},{},{pole}\n", r.order, r.stabilised);
    }
    text
}
