//! What the report of a run shows: plain data, drawn by [`youla_report`].

pub(crate) mod decibels;
pub(crate) mod further;
pub(crate) mod models;
pub(crate) mod notes;
pub(crate) mod pid;
pub(crate) mod recommended;
pub(crate) mod redesign;
pub(crate) mod verdict;

mod certificate;
pub(crate) mod fit;
mod frequency;
mod loops;
mod nonparametric;
mod records;
mod reduction;
mod residuals;

use crate::Result;
use crate::method::Method;
use crate::result::Identification;
use crate::summary::Summary;
use crate::summary::entries::OrRefused;
use crate::summary::model::ModelEntry;
use further::further_lines;
use notes::notes;
use verdict::verdict_lines;
use youla::identify::subspace::SubspaceModel;
use youla::signal::Channel;
use youla_report::data::{self, MethodRole, ReportData};
use youla_report::pretty_unit;

/// Collects what the report of a run shows; `run` names the run folder.
///
/// # Errors
/// Those of the frequency responses, and settings that TOML cannot hold.
pub fn page(found: &Identification, summary: &Summary, run: &str) -> Result<ReportData> {
    let models: Vec<(&str, &ModelEntry)> =
        found.validation.models.iter().filter_map(|v| Some((v.method.key(), summary.model(v.method)?))).collect();
    let all = || models.iter().copied();
    let structure = summary.model(Method::GreyBox).and_then(|model| model.physical.as_ref());
    Ok(ReportData {
        title: found.settings.name.clone(),
        summary: records::summary_sentence(found),
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        run: run.to_owned(),
        settings: found.settings.to_toml()?,
        sources: found.records.sources.clone(),
        inputs: found.records.inputs.clone(),
        outputs: found.records.outputs.clone(),
        sample_time: Some(found.records.time.ts()),
        methods: found.validation.models.iter().map(|v| method(v.method)).collect(),
        overview: Vec::new(),
        verdict: verdict_lines(found, summary),
        further: further_lines(found, summary),
        notes: notes(found, summary),
        fits: all().flat_map(|(key, model)| models::fits(key, model)).collect(),
        findings: records::findings(found),
        experiments: records::experiments(found)?,
        orders: orders(found),
        verification: records::verification(found)?,
        residuals: residuals::drawn(found),
        frequency: Some(frequency::drawn(found)?),
        poles: all().map(|(key, model)| models::poles(key, model)).collect(),
        modes: all().flat_map(|(key, model)| models::modes(key, model)).collect(),
        unlisted: all().filter_map(|(key, model)| models::unlisted(key, model)).collect(),
        parameters: structure.map_or_else(Vec::new, |of| of.parameters.clone()),
        physical: structure.map(|of| of.estimate.clone()),
        reduction: found.reduced().map(reduction::drawn),
        certificates: all().map(|(key, model)| models::certificate(key, model)).collect(),
        loop_tables: found.certified().map_or_else(Vec::new, |of| certificate::tables(of, found.records.time.ts())),
        recommended: recommended::tables(found),
        redesign: match found.new_pid() {
            Some(new) => Some(pid::drawn(new)),
            None => found.new_controller().map(redesign::drawn).transpose()?,
        },
        margins: all().map(|(key, model)| models::margins(key, model)).collect(),
        margins_caption: margins_caption(found, summary),
        bezout_residual: summary.bezout_residual,
        stages: summary.seconds.iter().map(|(name, t)| data::StageTime { name: name.clone(), seconds: *t }).collect(),
    })
}

fn method(method: Method) -> data::DrawnMethod {
    let role = match method {
        Method::Likelihood => MethodRole::Recommended,
        Method::Nominal => MethodRole::Nominal,
        Method::Direct => MethodRole::Direct,
        Method::Hansen => MethodRole::Hansen,
        Method::HansenReduced => MethodRole::HansenReduced,
        Method::GreyBox => MethodRole::HansenPem,
        Method::TruePlant => MethodRole::Other,
    };
    data::DrawnMethod::new(method.key(), method.label(), role)
}

fn orders(found: &Identification) -> Vec<data::OrderChoice> {
    let choice = |method: Method, label: &str, s: &SubspaceModel| data::OrderChoice {
        method: method.key().into(),
        label: label.into(),
        values: s.singular_values.clone(),
        chosen: s.order.order,
    };
    let mut all = Vec::new();
    if let Some(direct) = found.direct() {
        all.push(choice(Method::Direct, "plant from u to y", direct));
    }
    all.extend(found.scheme().map(|s| choice(Method::Hansen, "S from alpha to beta", &s.deviation)));
    all
}

/// The scales with their channels.
fn margins_caption(found: &Identification, summary: &Summary) -> String {
    let channels = found.records.inputs.iter().chain(&found.records.outputs);
    match &summary.channel_scales {
        OrRefused::Value(scales) => {
            let sizes = scales.inputs.iter().chain(&scales.outputs);
            let size =
                |(c, s): (&Channel, &f64)| format!("{} {s:.3} {}", c.name, pretty_unit(&c.unit)).trim_end().to_owned();
            let each: Vec<String> = channels.zip(sizes).map(size).collect();
            format!("For b(G, K) and the nu-gap, channels are scaled by their {}: {}.", scales.basis, each.join(", "))
        }
        OrRefused::Refused(reason) => {
            format!("b(G, K) and the nu-gap need scaled channels and are not available: {}.", reason.refused)
        }
    }
}
