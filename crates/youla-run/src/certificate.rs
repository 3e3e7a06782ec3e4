//! `[certificate]`: what a run states about the loop of its model beyond the poles of the estimate.

use super::controller_errors::{ControllerErrorEffect, controller_errors};
use super::pipeline::Identification;
use super::robustness::channel_scales;
use crate::Result;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use youla::control::{LinearMargins, WorstMargins};
use youla::identify::subspace::{Interval, Uncertainty};
use youla::validate::{BandCertificate, BandOptions, ExactCertificate, certify_band, certify_deviation};
use youla_report::{data as draw, with_minus};

/// Choices of the certificate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CertificateSettings {
    /// Models that are drawn from the region of S, where its uncertainty was asked for.
    pub band: BandOptions,
    /// Whether S is identified again with a controller that is described wrongly.
    pub controller_errors: bool,
    /// Relative error of the gain of the controller that is tried, both ways.
    pub gain_error: f64,
    /// Limit of u that is tried, as a part of the largest |u| of each record and channel.
    pub saturation: f64,
}

impl Default for CertificateSettings {
    fn default() -> Self {
        CertificateSettings {
            band: BandOptions::default(),
            controller_errors: false,
            gain_error: 0.05,
            saturation: 0.9,
        }
    }
}

impl CertificateSettings {
    /// What is wrong with the numbers.
    pub(super) fn problem(&self) -> Option<String> {
        let part = |x: f64| x > 0.0 && x < 1.0;
        match self {
            _ if self.band.draws < 20 => {
                Some(format!("[certificate] band.draws is {}, but must be at least 20", self.band.draws))
            }
            _ if !part(self.gain_error) => {
                Some(format!("[certificate] gain_error is {}, but must be above 0 and below 1", self.gain_error))
            }
            _ if !part(self.saturation) => {
                Some(format!("[certificate] saturation is {}, but must be above 0 and below 1", self.saturation))
            }
            _ => None,
        }
    }
}

/// What a run states about the loop of G(S) with the controller that ran.
#[derive(Debug, Clone)]
pub struct RunCertificate {
    /// The exact test by S, with its identity.
    pub exact: ExactCertificate,
    /// The controller on every model within the region of S; `None` without an uncertainty.
    pub band: Option<BandCertificate>,
    /// Margins with intervals, by name, where `[certificate]` stands; empty without an uncertainty or where the loop of the
    /// estimate is unstable.
    pub margins: Vec<(String, Interval)>,
    /// S with a controller that is described wrongly, where it was asked for.
    pub controller_errors: Vec<ControllerErrorEffect>,
}

/// The certificate of a run.
///
/// # Errors
/// Numerical conditions of the estimate itself.
pub(super) fn certificate(found: &Identification) -> Result<RunCertificate> {
    let settings = found.settings.certificate.unwrap_or_default();
    let (factors, deviation) = (&found.factorisation.factors, &found.hansen.deviation);
    let exact = certify_deviation(factors, &deviation.model, None)?;
    let band = match &deviation.uncertainty {
        // K stabilises G(S) exactly where S is stable.
        Some(uncertainty) => certify_band(uncertainty, &settings.band, |_| Ok(true), |s| Ok(s.clone()))?,
        None => None,
    };
    let asked = found.settings.certificate.is_some();
    let margins = if exact.stable && asked { margins(found)? } else { Vec::new() };
    let controller_errors = if settings.controller_errors { controller_errors(found, &settings)? } else { Vec::new() };
    Ok(RunCertificate { exact, band, margins, controller_errors })
}

/// Margins of the loop of G(S) with their intervals; those that do not exist, or have no derivative, are left out.
///
/// The delta method takes derivatives, and gets them from the responses of a loop at the frequencies where that of the estimate is
/// critical; a bootstrap takes each replicate exactly.
fn margins(found: &Identification) -> Result<Vec<(String, Interval)>> {
    let Some(uncertainty) = &found.hansen.deviation.uncertainty else { return Ok(Vec::new()) };
    let (factors, controller) = (&found.factorisation.factors, &found.factorisation.controller);
    let scales = channel_scales(&found.records.estimation).ok();
    let intervals = match uncertainty {
        Uncertainty::Delta(delta) => {
            let linear = LinearMargins::new(&factors.plant_of(&delta.model)?, controller, scales.as_ref())?;
            uncertainty.intervals(|s| Ok(figures(&linear.at(&factors.plant_of(s)?)?)))?
        }
        _ => uncertainty
            .intervals(|s| Ok(figures(&WorstMargins::of(&factors.plant_of(s)?, controller, scales.as_ref())?)))?,
    };
    let named = MARGINS.into_iter().map(String::from).zip(intervals);
    Ok(named.filter(|(_, interval)| interval.value.is_finite() && interval.deviation.is_finite()).collect())
}

/// Names of the margins that get intervals, in the order of [`figures`].
const MARGINS: [&str; 7] = [
    "peak sensitivity, worst output",
    "peak sensitivity, all outputs",
    "lowest gain factor",
    "highest gain factor",
    "phase margin, degrees",
    "delay margin, ms",
    "normalised coprime margin",
];

/// In the order of [`MARGINS`]; NaN where a margin does not exist.
fn figures(worst: &WorstMargins) -> Vec<f64> {
    let all = [
        worst.output_sensitivity,
        worst.all_outputs_sensitivity,
        worst.lowest_gain,
        worst.highest_gain,
        worst.phase_degrees,
        worst.delay.map(|seconds| 1e3 * seconds),
        worst.coprime,
    ];
    all.map(|figure| figure.unwrap_or(f64::NAN)).to_vec()
}

impl RunCertificate {
    /// One sentence on the region of S.
    pub(super) fn band_sentence(&self) -> Option<String> {
        let band = self.band.as_ref()?;
        let level = 100.0 * band.level;
        let [low, high] = band.radius.bounds;
        let interval = format!("{level:.0} % interval of it {low:.5} to {high:.5}");
        Some(if band.holds() {
            format!(
                "The controller stabilises every one of the {} models within the {level:.0} % region of S, at worst with {:.5} ({interval}).",
                band.within, band.worst_within
            )
        } else {
            format!(
                "The controller does not stabilise {} of the {} models within the {level:.0} % region of S, at worst with {:.5} ({interval}).",
                band.unstable_within, band.within, band.worst_within
            )
        })
    }

    /// For `7-validate/certificate.json` and summary.json.
    pub(super) fn json(&self) -> Value {
        let margins: serde_json::Map<String, Value> = self
            .margins
            .iter()
            .map(|(name, interval)| (name.replace(',', "").replace(' ', "_"), json!(interval)))
            .collect();
        let errors: Vec<Value> = self.controller_errors.iter().map(ControllerErrorEffect::json).collect();
        json!({
            "stable": self.exact.stable,
            "deviation_poles": super::artefacts::pairs(&self.exact.deviation_poles),
            "identity_residual": self.exact.identity_residual,
            "band": self.band.map(|band| {
                let mut entry = json!(band);
                entry["holds"] = json!(band.holds());
                entry
            }),
            "margins": margins,
            "controller_errors": errors,
        })
    }

    /// The tables of the report.
    pub(super) fn tables(&self) -> Vec<draw::EvidenceTable> {
        let mut tables = Vec::new();
        if !self.margins.is_empty() {
            let row = |(name, i): &(String, Interval)| {
                let cells = [format!("{:.3}", i.value), format!("{:.3} to {:.3}", i.bounds[0], i.bounds[1])];
                std::iter::once(name.clone()).chain(cells.map(with_minus)).collect()
            };
            tables.push(draw::EvidenceTable {
                title: "The loop of G(S) under the uncertainty of S".into(),
                text: self.band_sentence().unwrap_or_default(),
                columns: ["Figure", "Estimate", "Interval"].map(String::from).to_vec(),
                rows: self.margins.iter().map(row).collect(),
                caption: "Gain, phase and delay of one channel at a time, the worst one; the coprime margin in channels scaled by their rms."
                    .into(),
            });
        }
        tables.extend(super::controller_errors::table(&self.controller_errors));
        tables
    }
}
