//! `[certificate]`: what a run states about the loop of its model beyond the poles of the estimate.

use crate::Result;
use crate::stages::context::SchemeContext;
use crate::stages::controller_errors::{ControllerErrorEffect, ControllerErrorEntry, controller_errors};
use crate::stages::validate::robustness::channel_scales;
use crate::summary::entries::{BandEntry, IntervalEntry, finite, pairs};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::control::{LinearMargins, WorstMargins};
use youla::identify::hansen::HansenModel;
use youla::identify::subspace::{Interval, Uncertainty};
use youla::validate::{BandCertificate, BandOptions, ExactCertificate, certify_band, certify_deviation};
use youla_report::{data as draw, with_minus};

/// What a run states about the loop of G(S) with the controller that ran.
#[derive(Debug, Clone)]
pub struct RunCertificate {
    /// The exact test by S, with its identity.
    pub exact: ExactCertificate,
    /// The controller on every model within the region of S; `None` without an uncertainty.
    pub band: Option<BandCertificate>,
    /// Margins with intervals, by name, where `[certificate]` is given; empty without an uncertainty or where the loop of the
    /// estimate is unstable.
    pub margins: Vec<(String, Interval)>,
    /// S with a controller that is described wrongly, where it was asked for.
    pub controller_errors: Vec<ControllerErrorEffect>,
}

/// The certificate of a run.
///
/// # Errors
/// Numerical conditions of the estimate itself.
pub(crate) fn certificate(context: SchemeContext<'_>, hansen: &HansenModel) -> Result<RunCertificate> {
    let run = context.run;
    let settings = run.settings.certificate.unwrap_or_default();
    let (factors, deviation) = (&context.factorisation.factors, &hansen.deviation);
    let exact = certify_deviation(factors, &deviation.model, None)?;
    let band = match &deviation.uncertainty {
        // K stabilises G(S) exactly where S is stable.
        Some(uncertainty) => certify_band(uncertainty, &BandOptions::default(), |_| Ok(true), |s| Ok(s.clone()))?,
        None => None,
    };
    let asked = run.settings.certificate.is_some();
    let margins = if exact.stable && asked { margins(context, hansen)? } else { Vec::new() };
    let controller_errors = if settings.controller_errors { controller_errors(context)? } else { Vec::new() };
    Ok(RunCertificate { exact, band, margins, controller_errors })
}

/// Margins of the loop of G(S) with their intervals; those that do not exist, or have no derivative, are left out.
///
/// The delta method takes derivatives, and gets them from the responses of a loop at the frequencies where that of the estimate is
/// critical; a bootstrap takes each replicate exactly.
fn margins(context: SchemeContext<'_>, hansen: &HansenModel) -> Result<Vec<(String, Interval)>> {
    let Some(uncertainty) = &hansen.deviation.uncertainty else { return Ok(Vec::new()) };
    let SchemeContext { run, factorisation, .. } = context;
    let (factors, controller) = (&factorisation.factors, &run.declared.controller);
    let scales = channel_scales(run.records).ok();
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

/// The certificate in `7-validate/certificate.json` and summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CertificateEntry {
    /// Whether S is stable, and with it the loop of G(S).
    pub stable: bool,
    /// Poles of S, `[re, im]`.
    pub deviation_poles: Vec<[f64; 2]>,
    /// Largest relative difference of the two sides of the identity behind that test.
    pub identity_residual: Option<f64>,
    /// The controller on every model within the region of S; `null` without an uncertainty.
    pub band: Option<BandEntry>,
    /// Margins with intervals, by name.
    pub margins: BTreeMap<String, IntervalEntry>,
    /// What errors in the description of the controller do to the result.
    pub controller_errors: Vec<ControllerErrorEntry>,
}

impl RunCertificate {
    /// One sentence on the region of S.
    pub(crate) fn band_sentence(&self) -> Option<String> {
        let band = self.band.as_ref()?;
        let level = 100.0 * band.level;
        let [low, high] = band.radius.bounds;
        // The interval is of one figure, the region of all parameters of S at once: it reaches further.
        let interval = format!(
            "G(S) itself has {:.5}, with a {level:.0} % interval of {low:.5} to {high:.5} for this figure alone; the region holds all \
             parameters at once and is wider",
            band.radius.value
        );
        Some(if band.holds() {
            format!(
                "The controller stabilises all {} models drawn from the {level:.0} % confidence region of S; the largest pole among them has |z| = {:.5}. {interval}.",
                band.within, band.worst_within
            )
        } else {
            format!(
                "The controller does not stabilise {} of the {} models drawn from the {level:.0} % confidence region of S; the largest pole among them has |z| = {:.5}. {interval}.",
                band.unstable_within, band.within, band.worst_within
            )
        })
    }

    /// As `7-validate/certificate.json` and summary.json hold it.
    pub(crate) fn entry(&self) -> CertificateEntry {
        let margin = |(name, interval): &(String, Interval)| {
            (name.replace(',', "").replace(' ', "_"), IntervalEntry::from(interval))
        };
        CertificateEntry {
            stable: self.exact.stable,
            deviation_poles: pairs(&self.exact.deviation_poles),
            identity_residual: finite(self.exact.identity_residual),
            band: self.band.as_ref().map(BandEntry::from),
            margins: self.margins.iter().map(margin).collect(),
            controller_errors: self.controller_errors.iter().map(ControllerErrorEntry::from).collect(),
        }
    }

    /// The tables of the report.
    pub(crate) fn tables(&self) -> Vec<draw::EvidenceTable> {
        let mut tables = Vec::new();
        if !self.margins.is_empty() {
            let row = |(name, i): &(String, Interval)| {
                let cells = [format!("{:.3}", i.value), format!("{:.3} to {:.3}", i.bounds[0], i.bounds[1])];
                std::iter::once(name.clone()).chain(cells.map(with_minus)).collect()
            };
            tables.push(draw::EvidenceTable {
                title: "Margins of the loop of G(S) with intervals".into(),
                text: self.band_sentence().unwrap_or_default(),
                columns: ["Figure", "Estimate", "Interval"].map(String::from).to_vec(),
                rows: self.margins.iter().map(row).collect(),
                caption: "Gain, phase and delay margins are those of the worst single channel. The coprime margin is computed with channels scaled by their rms."
                    .into(),
            });
        }
        tables.extend(crate::stages::controller_errors::table(&self.controller_errors));
        tables
    }
}
