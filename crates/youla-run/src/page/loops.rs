//! Lines on the loop of the recommended model: the controller on the region of the plant, and its margins.

use super::certificate;
use crate::method::Method;
use crate::result::Identification;
use crate::summary::Summary;
use youla::control::IsoZone;
use youla_report::data::{LineStatus, ReportPart, Verdict};
use youla_report::numbers;

/// Both lines, as far as the run has them. Those that warn are part of the answer, the others stand below it.
pub(super) fn lines(found: &Identification, summary: &Summary) -> Vec<Verdict> {
    found.certified().map(certificate::line).into_iter().chain(margin_line(found, summary)).collect()
}

/// Whether a line belongs to the answer.
pub(super) fn warns(line: &Verdict) -> bool {
    matches!(line.status, LineStatus::Caution | LineStatus::Bad)
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
    let (zone, together) = (robustness.iso_14839_zone?, robustness.peak_sensitivity?);
    let worst = robustness.output_peak_sensitivities.iter().flatten().flatten().copied().fold(0.0, f64::max);
    let disk = robustness.output_disk_margin.as_ref()?;
    let [lowest, highest] = numbers::factors(disk.lowest_gain?, disk.highest_gain);
    let status = status(zone, IsoZone::of(together));
    let all = match status {
        LineStatus::Caution if zone <= IsoZone::B => {
            ", where the same limits give a warning: changes of several outputs at once act more than those of one"
        }
        _ => "",
    };
    let of_all = match (format!("{worst:.2}"), format!("{together:.2}")) {
        (worst, together) if worst == together => String::new(),
        (_, together) => format!(" and {together} for all outputs together{all}"),
    };
    let text = format!(
        "The peak sensitivity of the loop with {name} is {worst:.2} at the worst output (zone {zone} of ISO 14839-3){of_all}. The loop stays \
         stable when the gains of all outputs change by factors between {lowest} and {highest}, or their phases by up to {} degrees.",
        degrees(disk.phase_deg?)
    );
    Some(Verdict { status, text, evidence: ReportPart::Margins })
}

/// By the zone of the worst output; a peak of all outputs together beyond zone B is a warning too.
fn status(worst: IsoZone, together: IsoZone) -> LineStatus {
    match (worst, together) {
        (IsoZone::D, _) => LineStatus::Bad,
        (IsoZone::C, _) | (_, IsoZone::C | IsoZone::D) => LineStatus::Caution,
        _ => LineStatus::Good,
    }
}

/// Whole degrees, two significant digits below ten.
fn degrees(value: f64) -> String {
    let places = numbers::decimals(value, 2).clamp(0, 6) as usize;
    format!("{value:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_of_all_outputs_together_is_a_warning_where_each_by_itself_is_harmless() {
        assert_eq!(status(IsoZone::A, IsoZone::B), LineStatus::Good);
        assert_eq!(status(IsoZone::A, IsoZone::D), LineStatus::Caution);
        assert_eq!(status(IsoZone::C, IsoZone::C), LineStatus::Caution);
        assert_eq!(status(IsoZone::D, IsoZone::D), LineStatus::Bad);
        assert_eq!([degrees(0.18587), degrees(37.88), degrees(140.2)], ["0.19", "38", "140"]);
    }
}
