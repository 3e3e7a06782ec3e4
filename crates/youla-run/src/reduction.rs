//! The reduction of a run: in its loop, scaled where the method needs it; its sweep as artefact, summary and figure.

use super::records::RunRecords;
use crate::Result;
use serde_json::{Value, json};
use youla::c64;
use youla::factor::CoprimeFactors;
use youla::identify::hansen::HansenModel;
use youla::lti::Discrete;
use youla::reduce::{
    LoopReduction, ReductionLoop, ReductionMethod, ReductionOptions, ReductionSweep, SweepRow, reduce_in_loop,
};
use youla_report::data::{self as draw, Evidence, Status};

/// Closed-loop error from which a reduction is to be looked at.
const LARGE_ERROR: f64 = 0.05;

/// A reduction and the scales on which it rests.
#[derive(Debug, Clone)]
pub struct RunReduction {
    /// The options as they were used: with the scales that the records gave.
    pub options: ReductionOptions,
    /// The reduced model, its loop and all orders.
    pub found: LoopReduction<Discrete>,
}

/// Reduces G(S) in its loop. Normalised coprime factors depend on the unit of the outputs against that of the inputs: where no
/// scales are given, the rms of the estimation records is theirs.
pub(super) fn run_reduction(
    factors: &CoprimeFactors<Discrete>,
    hansen: &HansenModel,
    records: &RunRecords,
    options: &ReductionOptions,
) -> Result<RunReduction> {
    let mut options = options.clone();
    if options.method == ReductionMethod::NormalisedCoprime {
        let (inputs, outputs) = records.sizes();
        options.output_scale.get_or_insert(outputs);
        options.input_scale.get_or_insert(inputs);
    }
    let model = ReductionLoop::new(factors, &hansen.deviation.model)?;
    let found = reduce_in_loop(&model, &options)?;
    Ok(RunReduction { options, found })
}

impl RunReduction {
    /// What the artefact of the reduced model says besides its matrices.
    pub(super) fn details(&self) -> Value {
        let r = &self.found.reduction;
        json!({
            "method": r.method, "hankel_singular_values": r.hankel, "error_bound": r.error_bound,
            "minimal_order": r.minimal_order, "kept_poles": pairs(&r.kept), "unstable_pole": r.unstable_pole.map(pair),
            "output_scale": self.options.output_scale, "input_scale": self.options.input_scale,
            "stabilised": self.found.stabilised, "proposed_order": self.found.proposed_order(),
        })
    }

    /// The entry of summary.json.
    pub(super) fn summary(&self) -> Value {
        let (found, row) = (&self.found, self.found.row());
        let figure = |of: fn(&SweepRow) -> Option<f64>| row.and_then(of);
        json!({
            "method": found.reduction.method,
            "order": found.order(),
            "minimal_order": found.reduction.minimal_order,
            "kept": found.reduction.kept.len(),
            "error_bound": found.reduction.error_bound,
            "open_loop_error": figure(|r| r.open_loop),
            "open_loop_relative": figure(|r| r.open_loop_relative),
            "closed_loop_relative": figure(|r| r.closed_loop),
            "stabilised_by_controller": found.stabilised,
            "proposed_order": found.proposed_order(),
        })
    }

    /// The sentence of the verdict.
    pub(super) fn verdict(&self) -> draw::Verdict {
        let found = &self.found;
        let error = found.row().and_then(|row| row.closed_loop);
        let status = match (found.stabilised, error) {
            (false, _) => Status::Bad,
            (true, Some(error)) if error < LARGE_ERROR && found.reduction.unstable_pole.is_none() => Status::Good,
            _ => Status::Caution,
        };
        draw::Verdict { status, text: found.sentence(), evidence: Evidence::Reduction }
    }

    /// As the report draws it.
    pub(super) fn drawn(&self) -> draw::Reduction {
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

/// All orders as an artefact; what is infinite or does not exist is null.
pub(super) fn as_json(run: &RunReduction) -> Value {
    let ReductionSweep { method, rows, hankel, kept, minimal_order, plant_norm, response_norm } = &run.found.sweep;
    let row = |r: &SweepRow| {
        json!({
            "order": r.order, "error_bound": r.error_bound, "open_loop_error": r.open_loop,
            "open_loop_relative": r.open_loop_relative, "closed_loop_relative": r.closed_loop,
            "stabilised_by_controller": r.stabilised, "worst_closed_loop_pole": r.worst_pole.map(pair), "failure": r.failure,
        })
    };
    json!({
        "method": method, "minimal_order": minimal_order, "kept_poles": pairs(kept), "hankel_singular_values": hankel,
        "output_scale": run.options.output_scale, "input_scale": run.options.input_scale,
        "plant_norm": plant_norm, "closed_loop_norm": response_norm,
        "chosen": run.found.order(), "stabilised_by_controller": run.found.stabilised,
        "proposed_order": run.found.proposed_order(), "sentence": run.found.sentence(),
        "orders": rows.iter().map(row).collect::<Vec<_>>(),
    })
}

/// All orders as lines of text; an empty field where there is no number.
pub(super) fn as_csv(sweep: &ReductionSweep) -> String {
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

fn pair(pole: c64) -> [f64; 2] {
    [pole.re, pole.im]
}

fn pairs(poles: &[c64]) -> Vec<[f64; 2]> {
    poles.iter().copied().map(pair).collect()
}
