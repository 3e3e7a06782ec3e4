//! The certificate in `7-validate/certificate.json` and summary.json.

use super::entries::{BandEntry, IntervalEntry, finite, pairs};
use crate::stages::certificate::RunCertificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::validate::MarginInterval;

/// The certificate in `7-validate/certificate.json` and summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CertificateEntry {
    /// Whether S is stable, and with it the loop of G(S).
    pub stable: bool,
    /// Poles of S, `[re, im]`.
    pub deviation_poles: Vec<[f64; 2]>,
    /// Largest relative difference of the two sides of the identity behind that test.
    pub identity_residual: Option<f64>,
    /// The controller on every plant within the region.
    pub band: BandEntry,
    /// Margins with intervals, by name.
    pub margins: BTreeMap<String, IntervalEntry>,
}

/// Margins by name, as keys.
pub(crate) fn margins(all: &[MarginInterval]) -> BTreeMap<String, IntervalEntry> {
    let margin = |m: &MarginInterval| (m.name.replace(',', "").replace(' ', "_"), IntervalEntry::from(&m.interval));
    all.iter().map(margin).collect()
}

impl From<&RunCertificate> for CertificateEntry {
    fn from(certificate: &RunCertificate) -> Self {
        CertificateEntry {
            stable: certificate.exact.stable,
            deviation_poles: pairs(&certificate.exact.deviation_poles),
            identity_residual: finite(certificate.exact.identity_residual),
            band: BandEntry::from(&certificate.band),
            margins: margins(&certificate.margins),
        }
    }
}
