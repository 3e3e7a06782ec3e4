//! Lines below the answer to "Can it be trusted?": margins, redesign, reduction, physical structure, factors.

use super::{certificate, pid, redesign, reduction};
use crate::method::Method;
use crate::result::Identification;
use crate::summary::Summary;
use youla::control::IsoZone;
use youla_greybox::hansen_pem::PemStart;
use youla_report::data::{ReportPart, Status, Verdict};

/// Lines below the answer, each with its evidence.
pub(crate) fn further_lines(found: &Identification, summary: &Summary) -> Vec<Verdict> {
    let lines = [
        deviation_line(found),
        found.certified().map(certificate::line),
        margin_line(found, summary),
        found.new_controller().map(redesign::line),
        found.new_pid().map(pid::line),
        found.reduced().map(reduction::line),
        grey_box_line(found),
        factor_line(summary),
    ];
    lines.into_iter().flatten().collect()
}

/// Margins of the loop of the recommended model, of G(S) where there is none; nothing where the loop is unstable, which the answer
/// states, and where no controller ran.
fn margin_line(found: &Identification, summary: &Summary) -> Option<Verdict> {
    if found.declared.controller().is_zero() {
        return None;
    }
    let recommended = summary.model(Method::Likelihood).map(|m| (m, "the recommended model"));
    let (model, name) = recommended.or_else(|| Some((summary.model(Method::Hansen)?, "G(S)")))?;
    let robustness = &model.robustness;
    let zone = robustness.iso_14839_zone?;
    let worst = robustness.output_peak_sensitivities.iter().flatten().flatten().copied().fold(0.0, f64::max);
    let disk = robustness.output_disk_margin.as_ref()?;
    let highest = disk.highest_gain.map_or("any higher value".into(), |g| format!("{g:.2}"));
    let text = format!(
        "The peak sensitivity of the loop with {name} is {worst:.2} at the worst output (zone {zone} of ISO 14839-3) and {:.2} for all \
         outputs together. The loop stays stable when the gains of all outputs change by factors between {:.2} and {highest}, or their \
         phases by up to {:.0} degrees.",
        robustness.peak_sensitivity?, disk.lowest_gain?, disk.phase_deg?
    );
    let status = match zone {
        IsoZone::A | IsoZone::B => Status::Good,
        IsoZone::C => Status::Caution,
        IsoZone::D => Status::Bad,
    };
    Some(Verdict { status, text, evidence: ReportPart::Margins })
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
            Status::Caution,
            text + " The fit is more than 1 percentage point below that of G(S): the search ended in a local minimum, or the structure does not describe the plant.",
        ),
        false if run.found.fit_of_plant.is_none() => {
            (Status::Caution, text + " There is no G(S) to compare it with, so a local minimum could not be noticed.")
        }
        false => (Status::Good, text),
    };
    let (doubt, residuals) = match &run.intervals {
        Ok(known) => (!known.residuals.independent() || known.coloured == known.residuals.white(), known.verdict()),
        Err(reason) => (true, format!("There are no intervals: {reason}.")),
    };
    let status = if doubt { Status::Caution } else { status };
    Some(Verdict { status, text: format!("{text} {residuals}"), evidence: ReportPart::Fits })
}

fn factor_line(summary: &Summary) -> Option<Verdict> {
    let residual = summary.bezout_residual?;
    // Half of the digits of double precision; scaled factors have 1e-13 (test `states_are_scaled_before_factorising`).
    let status = if residual < 1e-8 { Status::Good } else { Status::Bad };
    let text = format!("The coprime factors satisfy the Bezout identity to {residual:.1e} (relative).");
    Some(Verdict { status, text, evidence: ReportPart::Certificate })
}

/// Order and fit of S. Stability of S is no evidence that S is right.
fn deviation_line(found: &Identification) -> Option<Verdict> {
    let s = &found.scheme()?.deviation;
    let stable = if s.stability.stable { "stable" } else { "unstable" };
    let fit: Vec<String> = s.fit.percent.iter().map(|f| format!("{f:.1} %")).collect();
    let text = format!("S has order {}, is {stable} and fits beta to {}.", s.model.order(), fit.join(", "));
    let status = if s.stability.stable { Status::Info } else { Status::Bad };
    Some(Verdict { status, text, evidence: ReportPart::Order })
}
