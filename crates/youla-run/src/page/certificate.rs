//! The certificate on the page.

use crate::stages::certificate::RunCertificate;
use youla::validate::MarginInterval;
use youla_report::data::{EvidenceTable, LineStatus, ReportPart, Verdict};
use youla_report::{numbers, with_minus};

/// The controller on the region of the plant.
pub(super) fn line(certificate: &RunCertificate) -> Verdict {
    let status = if certificate.band.holds() { LineStatus::Good } else { LineStatus::Caution };
    Verdict { status, text: sentence(certificate), evidence: ReportPart::Certificate }
}

fn sentence(certificate: &RunCertificate) -> String {
    let band = &certificate.band;
    let level = 100.0 * band.level;
    let (stabilises, contradicted) = match band.holds() {
        true => (format!("stabilises all {} plants", band.within), ""),
        false => (
            format!("does not stabilise {} of the {} plants", band.unstable_within, band.within),
            ", although the machine ran with it",
        ),
    };
    let (worst, own) = (numbers::radius(band.worst_within), numbers::radius(band.radius.value));
    let [_, low, high] = numbers::with_bounds(band.radius.value, band.radius.bounds);
    format!(
        "The running controller {stabilises} drawn from the {level:.0} % region of all parameters together{contradicted}; the largest pole of their \
         loops has |z| = {worst}. That region reaches further than the region at one frequency, from which the part of the margin that is left is \
         computed, and than the interval of one figure: the largest pole of the loop of the model has |z| = {own}, {level:.0} % interval \
         {low} to {high}."
    )
}

/// Margins with intervals; none where the loop is unstable.
pub(super) fn tables(certificate: &RunCertificate, sample_time: f64) -> Vec<EvidenceTable> {
    if certificate.margins.is_empty() {
        return Vec::new();
    }
    let (unit, of_second) = numbers::delay_unit(Some(sample_time));
    let row = |m: &MarginInterval| {
        let (name, factor) = match m.name.strip_suffix(", seconds") {
            Some(what) => (format!("{what}, {unit}"), of_second),
            None => (m.name.to_owned(), 1.0),
        };
        let [value, low, high] = numbers::with_bounds(factor * m.interval.value, m.interval.bounds.map(|b| factor * b));
        std::iter::once(name).chain([value, format!("{low} to {high}")].map(with_minus)).collect()
    };
    let rows = certificate.margins.iter().map(row).collect();
    vec![EvidenceTable {
        text: sentence(certificate),
        caption: "Gain, phase and delay margins are those of the worst single channel. The coprime margin is computed with channels scaled by their rms."
            .into(),
        ..EvidenceTable::new("Margins of the loop with intervals", &["Figure", "Estimate", "Interval"], rows)
    }]
}
