//! The reduction on the page.

use crate::stages::reduction::RunReduction;
use crate::summary::reduction::orders;
use youla::reduce::ReductionMethod;
use youla_report::data::{DrawnReduction, LineStatus, ReportPart, Verdict};

/// Closed-loop error from which a reduction is to be looked at.
/// The demonstration reduced from 16 to 6 states has 0.054 (`docs/reduction.md`). Chosen, not measured.
const LARGE_ERROR: f64 = 0.05;

pub(super) fn line(run: &RunReduction) -> Verdict {
    let found = &run.found;
    let error = found.row().and_then(|row| row.closed_loop);
    let status = match (found.stabilised, error) {
        (false, _) => LineStatus::Bad,
        (true, Some(error)) if error < LARGE_ERROR && found.reduction.unstable_pole.is_none() => LineStatus::Good,
        _ => LineStatus::Caution,
    };
    Verdict { status, text: found.sentence(), evidence: ReportPart::Reduction }
}

pub(super) fn drawn(run: &RunReduction) -> DrawnReduction {
    let r = &run.found.reduction;
    DrawnReduction {
        label: format!("the recommended model by {}", r.method),
        hankel: r.hankel.clone(),
        chosen: run.found.order(),
        kept: r.kept.len(),
        bound: r.error_bound,
        bound_is_gap: r.method == ReductionMethod::NormalisedCoprime,
        plant_norm: run.found.sweep.plant_norm,
        orders: orders(run),
        sentence: run.found.sentence(),
    }
}
