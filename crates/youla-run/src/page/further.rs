//! Lines below the answer to "Can it be trusted?": the loop where nothing is wrong with it, redesign, reduction, physical structure, factors.

use super::{loops, pid, redesign, reduction};
use crate::result::Identification;
use crate::summary::Summary;
use youla_greybox::hansen_pem::PemStart;
use youla_report::data::{LineStatus, ReportPart, Verdict};

/// Lines below the answer, each with its evidence.
pub(crate) fn further_lines(found: &Identification, summary: &Summary) -> Vec<Verdict> {
    let of_loop = loops::lines(found, summary).into_iter().filter(|line| !loops::warns(line));
    let lines = [
        found.new_controller().map(|new| redesign::line(new, found.redesign_reservation())),
        found.new_pid().map(pid::line),
        found.reduced().map(reduction::line),
        grey_box_line(found),
        factor_line(summary),
    ];
    deviation_line(found).into_iter().chain(of_loop).chain(lines.into_iter().flatten()).collect()
}

/// The fit of the physical structure against that of G(S).
fn grey_box_line(found: &Identification) -> Option<Verdict> {
    let run = found.structure()?;
    let fit = |values: &[f64]| values.iter().map(|f| format!("{f:.1} %")).collect::<Vec<_>>().join(", ");
    let model = fit(&run.found.model.fit);
    let plant = run.found.fit_of_plant.as_ref().map_or_else(String::new, |plant| format!(", G(S) to {}", fit(plant)));
    let start = match run.found.won {
        PemStart::Projection => "the projection of G(S)",
        PemStart::Nominal => "its initial values",
        PemStart::Direct => "the projection of a model of u and y by PBSIDopt",
    };
    let text = format!(
        "The physical structure fits the estimation records to {model} per output{plant} (search started from {start})."
    );
    let (status, text) = match run.found.local_minimum_suspected {
        true => (
            LineStatus::Caution,
            text + " The fit is more than 1 percentage point below that of G(S): the search ended in a local minimum, or the structure does not describe the plant.",
        ),
        false if run.found.fit_of_plant.is_none() => (
            LineStatus::Caution,
            text + " There is no G(S) to compare it with, so a local minimum could not be noticed.",
        ),
        false => (LineStatus::Good, text),
    };
    let (doubt, residuals) = match &run.intervals {
        Ok(known) => (!known.residuals.independent() || known.coloured == known.residuals.white(), known.verdict()),
        Err(reason) => (true, format!("There are no intervals: {reason}.")),
    };
    let status = if doubt { LineStatus::Caution } else { status };
    Some(Verdict { status, text: format!("{text} {residuals}"), evidence: ReportPart::Fits })
}

fn factor_line(summary: &Summary) -> Option<Verdict> {
    let residual = summary.bezout_residual?;
    // Half of the digits of double precision; scaled factors have 1e-13 (test `states_are_scaled_before_factorising`).
    let status = if residual < 1e-8 { LineStatus::Good } else { LineStatus::Bad };
    let text = format!("The coprime factors satisfy the Bezout identity to {residual:.1e} (relative).");
    Some(Verdict { status, text, evidence: ReportPart::Certificate })
}

/// Order and fit of S. Stability of S is no evidence that S is right.
fn deviation_line(found: &Identification) -> Option<Verdict> {
    let s = &found.scheme()?.deviation;
    let stable = if s.stability.stable { "stable" } else { "unstable" };
    let fit: Vec<String> = s.fit.percent.iter().map(|f| format!("{f:.1} %")).collect();
    let text = format!("S has order {}, is {stable} and fits beta to {}.", s.model.order(), fit.join(", "));
    let status = if s.stability.stable { LineStatus::Info } else { LineStatus::Bad };
    Some(Verdict { status, text, evidence: ReportPart::Order })
}
