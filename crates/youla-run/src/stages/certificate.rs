//! `[certificate]`: what a run states about the loop of its model beyond the poles of the estimate.

use crate::Result;
use crate::stages::context::RunContext;
use crate::stages::validate::robustness::channel_scales;
use crate::summary::entries::{BandEntry, IntervalEntry, finite, pairs};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::control::{closed_loop, with_input_port};
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::Recommendation;
use youla::lti::Discrete;
use youla::validate::{
    BandCertificate, BandOptions, ExactCertificate, MarginInterval, certify_deviation, certify_region, margin_intervals,
};
use youla_report::{data as draw, with_minus};

/// What a run states about the loop of the recommended plant with the controller that ran.
#[derive(Debug, Clone)]
pub struct RunCertificate {
    /// The exact test by S, with its identity.
    pub exact: ExactCertificate,
    /// The controller on every plant within the region.
    pub band: BandCertificate,
    /// Margins with intervals; empty where the loop is unstable.
    pub margins: Vec<MarginInterval>,
}

/// The certificate of a run.
///
/// # Errors
/// Numerical conditions of the estimate itself.
pub(crate) fn certificate(
    run: RunContext<'_>,
    factors: &CoprimeFactors<Discrete>,
    model: &Recommendation,
) -> Result<RunCertificate> {
    let (plant, k) = (&model.plant, &run.declared.controller);
    let exact = certify_deviation(factors, &factors.deviation_of(plant)?, None)?;
    let ports = with_input_port(k)?;
    let band =
        certify_region(&model.region, &BandOptions::default(), |_| Ok(true), |plant| closed_loop(plant, &ports))?;
    let scales = channel_scales(run.records).ok();
    let margins = match exact.stable {
        true => margin_intervals(plant, k, &model.region, scales.as_ref(), band.level)?,
        false => Vec::new(),
    };
    Ok(RunCertificate { exact, band, margins })
}

/// The certificate in `7-validate/certificate.json` and summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
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

impl RunCertificate {
    /// One sentence on the region of S.
    pub(crate) fn band_sentence(&self) -> String {
        let band = &self.band;
        let level = 100.0 * band.level;
        let [low, high] = band.radius.bounds;
        // The interval is of one figure, the region of all parameters at once: it reaches further.
        let interval = format!(
            "The plant itself has {:.5}, with a {level:.0} % interval of {low:.5} to {high:.5} for this figure alone; the region holds all \
             parameters at once and is wider",
            band.radius.value
        );
        if band.holds() {
            format!(
                "The controller stabilises all {} models drawn from the {level:.0} % confidence region of the plant; the largest pole among them has |z| = {:.5}. {interval}.",
                band.within, band.worst_within
            )
        } else {
            format!(
                "The controller does not stabilise {} of the {} models drawn from the {level:.0} % confidence region of the plant; the largest pole among them has |z| = {:.5}. {interval}.",
                band.unstable_within, band.within, band.worst_within
            )
        }
    }

    /// As `7-validate/certificate.json` and summary.json hold it.
    pub(crate) fn entry(&self) -> CertificateEntry {
        let margin = |m: &MarginInterval| (m.name.replace(',', "").replace(' ', "_"), IntervalEntry::from(&m.interval));
        CertificateEntry {
            stable: self.exact.stable,
            deviation_poles: pairs(&self.exact.deviation_poles),
            identity_residual: finite(self.exact.identity_residual),
            band: BandEntry::from(&self.band),
            margins: self.margins.iter().map(margin).collect(),
        }
    }

    /// The tables of the report.
    pub(crate) fn tables(&self) -> Vec<draw::EvidenceTable> {
        let mut tables = Vec::new();
        if !self.margins.is_empty() {
            let row = |m: &MarginInterval| {
                let i = &m.interval;
                let cells = [format!("{:.3}", i.value), format!("{:.3} to {:.3}", i.bounds[0], i.bounds[1])];
                std::iter::once(m.name.to_owned()).chain(cells.map(with_minus)).collect()
            };
            tables.push(draw::EvidenceTable {
                title: "Margins of the loop with intervals".into(),
                text: self.band_sentence(),
                columns: ["Figure", "Estimate", "Interval"].map(String::from).to_vec(),
                rows: self.margins.iter().map(row).collect(),
                caption: "Gain, phase and delay margins are those of the worst single channel. The coprime margin is computed with channels scaled by their rms."
                    .into(),
            });
        }
        tables
    }
}
