//! The certificate on the page.

use crate::stages::certificate::RunCertificate;
use youla::validate::MarginInterval;
use youla_report::data::{EvidenceTable, ReportPart, Status, Verdict};
use youla_report::with_minus;

/// The controller on the region of the plant.
pub(super) fn line(certificate: &RunCertificate) -> Verdict {
    let status = if certificate.band.holds() { Status::Good } else { Status::Caution };
    Verdict { status, text: sentence(certificate), evidence: ReportPart::Certificate }
}

fn sentence(certificate: &RunCertificate) -> String {
    let band = &certificate.band;
    let level = 100.0 * band.level;
    let [low, high] = band.radius.bounds;
    let stabilises = match band.holds() {
        true => format!("stabilises all {}", band.within),
        false => format!("does not stabilise {} of the {}", band.unstable_within, band.within),
    };
    // The interval is of one figure, the region of all parameters at once: it reaches further.
    format!(
        "The controller {stabilises} models drawn from the {level:.0} % confidence region of the plant; the largest pole of their loops has \
         |z| = {:.5}. The loop of the model itself has {:.5}, with a {level:.0} % interval of {low:.5} to {high:.5} for this figure alone; \
         the region holds all parameters at once and is wider.",
        band.worst_within, band.radius.value
    )
}

/// Margins with intervals; none where the loop is unstable.
pub(super) fn tables(certificate: &RunCertificate) -> Vec<EvidenceTable> {
    if certificate.margins.is_empty() {
        return Vec::new();
    }
    let row = |m: &MarginInterval| {
        let i = &m.interval;
        let cells = [format!("{:.3}", i.value), format!("{:.3} to {:.3}", i.bounds[0], i.bounds[1])];
        std::iter::once(m.name.to_owned()).chain(cells.map(with_minus)).collect()
    };
    let rows = certificate.margins.iter().map(row).collect();
    vec![EvidenceTable {
        text: sentence(certificate),
        caption: "Gain, phase and delay margins are those of the worst single channel. The coprime margin is computed with channels scaled by their rms."
            .into(),
        ..EvidenceTable::new("Margins of the loop with intervals", &["Figure", "Estimate", "Interval"], rows)
    }]
}
