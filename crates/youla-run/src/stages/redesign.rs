//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use crate::records::RunRecords;
use crate::stages::context::RunContext;
use crate::stages::reduction::RunReduction;
use crate::stages::responses::decibel;
use crate::summary::entries::{BandEntry, finite};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use youla::identify::likelihood::Recommendation;
use youla::lti::{SharedMode, frequency_response};
use youla::validate::ExactCertificate;
use youla_io::SystemMatrices;
use youla_io::export::{ExportedController, ObserverData};
use youla_loop::redesign::{LoopFigures, Redesign, RedesignMethod, RedesignProblem, TriedWeight, redesign};
use youla_report::data as draw;
use youla_report::figure::{Axis, Content, Curve, Figure, Panel};

/// Designs on the reduced model where there is one, else on the recommended plant; every new controller is tested on the plant and its
/// region.
///
/// # Errors
/// As [`redesign`].
pub(crate) fn redesigned(
    run: RunContext<'_>,
    recommended: &Recommendation,
    reduced: Option<&RunReduction>,
) -> Option<Result<Redesign>> {
    let (options, factorisation) = (run.settings.redesign.as_ref()?, run.factorisation?);
    let (input, output) = run.records.sizes();
    let problem = RedesignProblem {
        plant: &recommended.plant,
        model: reduced.map_or(&recommended.plant, |r| &r.found.reduction.model),
        factors: &factorisation.factors,
        region: Some(&recommended.region),
        input_size: &input,
        output_size: &output,
    };
    Some(redesign(&problem, options).map_err(|e| Error::from(e).within("[redesign]")))
}

/// The controller as `youla-rt` takes it.
pub(crate) fn exported(records: &RunRecords, redesign: &Redesign) -> ExportedController {
    let (u, y) = (records.inputs.clone(), records.outputs.clone());
    let new = &redesign.controller;
    ExportedController {
        method: redesign.method.key().into(),
        ts: new.system.time().ts(),
        measured: y,
        commanded: u,
        controller: SystemMatrices::new(&new.system),
        observer: new.gains.as_ref().map(|g| ObserverData::new(&g.model, g.f.as_ref(), g.l.as_ref())),
        q: new.q.as_ref().map(SystemMatrices::new),
    }
}

/// A redesign in `8-redesign/redesign.json` and summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RedesignEntry {
    /// What was designed.
    pub method: RedesignMethod,
    /// Weight of the inputs that was taken.
    pub input_weight: f64,
    /// States of the new controller.
    pub order: usize,
    /// The loop with the controller that ran.
    pub present: LoopEntry,
    /// The loop with the new controller, on the model.
    pub predicted: LoopEntry,
    /// The new controller on every model within the region of the plant; `null` without an uncertainty.
    pub band: Option<BandEntry>,
    /// The exact test of the plant with K(Q), for `youla`.
    pub exact: Option<ExactEntry>,
    /// All weights that were tried.
    pub candidates: Vec<TriedWeight>,
}

/// Figures of a loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LoopEntry {
    /// Modes with at least 5 % of the response of y to a disturbance at the plant input.
    pub modes: Vec<SharedModeEntry>,
    /// Least damping ratio of these modes.
    pub least_damping: Option<f64>,
    /// Peak of that response, channels in their rms.
    pub peak_response: Option<f64>,
    /// Peak of the output sensitivity.
    pub peak_sensitivity: Option<f64>,
}

/// A mode with its share of the response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SharedModeEntry {
    /// Natural frequency, Hz.
    pub hz: Option<f64>,
    /// Damping ratio.
    pub zeta: Option<f64>,
    /// Share of the response, 0 to 1.
    pub share: Option<f64>,
}

/// The exact test by S and Q.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ExactEntry {
    /// Whether the loop is stable.
    pub stable: bool,
    /// Largest relative difference of the two sides of its identity.
    pub identity_residual: Option<f64>,
}

/// As `8-redesign/redesign.json` and summary.json hold it.
pub fn entry(redesign: &Redesign) -> RedesignEntry {
    let exact = |e: &ExactCertificate| ExactEntry { stable: e.stable, identity_residual: finite(e.identity_residual) };
    RedesignEntry {
        method: redesign.method,
        input_weight: redesign.input_weight,
        order: redesign.controller.system.order(),
        present: LoopEntry::from(&redesign.present),
        predicted: LoopEntry::from(&redesign.predicted),
        band: redesign.band.as_ref().map(BandEntry::from),
        exact: redesign.exact.as_ref().map(exact),
        candidates: redesign.candidates.clone(),
    }
}

impl From<&LoopFigures> for LoopEntry {
    fn from(of: &LoopFigures) -> Self {
        let mode = |m: &SharedMode| SharedModeEntry {
            hz: finite(m.mode.hz),
            zeta: finite(m.mode.zeta),
            share: finite(m.share),
        };
        LoopEntry {
            modes: of.modes.iter().filter(|m| m.share >= LoopFigures::LEAST_SHARE).map(mode).collect(),
            least_damping: finite(of.least_damping),
            peak_response: finite(of.peak_response),
            peak_sensitivity: finite(of.peak_sensitivity),
        }
    }
}

/// One sentence: what the new controller promises.
pub(crate) fn sentence(redesign: &Redesign) -> String {
    let Redesign { present, predicted, .. } = redesign;
    let band = redesign.band.map_or_else(String::new, |b| {
        format!(
            "; it stabilises all {} models drawn from the {:.0} % confidence region of the plant",
            b.within,
            100.0 * b.level
        )
    });
    let verb = if redesign.gains_damping() { "raises" } else { "lowers" };
    format!(
        "The new controller {verb} the minimum damping of the loop from {:.3} to {:.3}. The peak response to a disturbance at the \
         plant input is {:.2} (present controller: {:.2}) and the peak sensitivity {:.2} (present: {:.2}){band}. These are \
         predictions: the controller has not run yet.",
        present.least_damping,
        predicted.least_damping,
        predicted.peak_response,
        present.peak_response,
        predicted.peak_sensitivity,
        present.peak_sensitivity
    )
}

/// The tables of the report.
pub(crate) fn tables(redesign: &Redesign) -> Vec<draw::EvidenceTable> {
    let modes = |figures: &LoopFigures, name: &str| {
        let row = |m: &SharedMode| {
            let share = format!("{:.0} %", 100.0 * m.share);
            vec![name.to_owned(), format!("{:.2}", m.mode.hz), format!("{:.4}", m.mode.zeta), share]
        };
        figures.modes.iter().filter(|m| m.share >= 0.05).map(row).collect::<Vec<_>>()
    };
    let number = |v: Option<f64>| v.map_or("–".to_owned(), |v| format!("{v:.3}"));
    let candidate = |c: &TriedWeight| {
        let taken = if c.input_weight == redesign.input_weight { "selected" } else { "" };
        let remark = c.refused.clone().unwrap_or_else(|| taken.into());
        vec![
            c.input_weight.to_string(),
            number(c.least_damping),
            number(c.peak_sensitivity),
            number(c.small_gain),
            remark,
        ]
    };
    vec![
        draw::EvidenceTable {
            title: "Modes of the loop, present and predicted".into(),
            text: sentence(redesign),
            columns: ["Loop", "Hz", "ζ", "Share"].map(String::from).to_vec(),
            rows: [modes(&redesign.present, "present"), modes(&redesign.predicted, "new")].concat(),
            caption: "Modes that contribute at least 5 % to the response of y to a disturbance at the plant input, on the design model; channels scaled by their rms."
                .into(),
        },
        draw::EvidenceTable {
            title: "Weights that were tried".into(),
            text: String::new(),
            columns: ["Weight of u", "Minimum damping", "Peak sensitivity", "Small-gain product", ""].map(String::from).to_vec(),
            rows: redesign.candidates.iter().map(candidate).collect(),
            caption: "Among the candidates within the limits that stabilise all drawn models, the one with the largest minimum damping is selected."
                .into(),
        },
    ]
}

/// Points of the responses that are drawn.
/// Chosen, not measured.
const POINTS: usize = 600;

/// The largest gain from a disturbance at the plant input to y over frequency, now and with the new controller.
///
/// # Errors
/// As [`frequency_response`].
pub(crate) fn figure(redesign: &Redesign) -> Result<Figure> {
    let nyquist = 0.5 / redesign.controller.system.time().ts();
    let hz: Vec<f64> =
        (0..POINTS).map(|k| nyquist * 10f64.powf(-2.5 * (1.0 - (k + 1) as f64 / POINTS as f64))).collect();
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let curve = |method: &draw::Method, figures: &LoopFigures| {
        let response = frequency_response(&figures.response, &omega)?;
        let gain = response.iter().map(|g| g.singular_values().map_or(f64::NAN, |s| s.first().copied().unwrap_or(0.0)));
        let y = gain.map(decibel).collect();
        Ok::<_, Error>(Curve { method: method.key.clone(), x: hz.clone(), y, ..Curve::default() })
    };
    let [present, new] = loops();
    let axis = |label: &str, unit: &str, log| Axis { label: label.into(), unit: unit.into(), log, ..Axis::default() };
    let panel = Panel {
        title: String::new(),
        x: axis("Frequency", "Hz", true),
        y: axis("Largest gain", "dB", false),
        content: Content::Curves(vec![curve(&present, &redesign.present)?, curve(&new, &redesign.predicted)?]),
        ..Panel::default()
    };
    Ok(Figure {
        key: "response".into(),
        title: "The loop, present and predicted".into(),
        caption: "Largest gain from a disturbance at the plant input to y, channels in their rms.".into(),
        panels: vec![panel],
        ..Figure::default()
    })
}

/// The two loops as the figure names them.
pub(crate) fn loops() -> [draw::Method; 2] {
    [
        draw::Method::new("present", "controller that ran", draw::Role::Nominal),
        draw::Method::new("new", "new controller", draw::Role::Hansen),
    ]
}
