//! summary.json: the stable contract for scripts.

use super::artefacts::{SCHEMA, pairs};
use super::certificate::RunCertificate;
use super::pipeline::{Identification, StageTimes};
use super::redesign;
use super::response::{decibel, model_responses};
use super::robustness;
use super::uncertainty::{summary_entry, with_deviations};
use super::verdict::{Method, ModelVerdict};
use crate::Result;
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;
use youla::c64;

/// The summary of a run, schema 1; magnitudes are those of output 1 from input 1.
///
/// ```text
/// {"schema":1, "nominal":{"fit":{record:[per output]}, "robustness"}, "methods":{method:{"order", "s_order", "s_stable",
///  "stabilised_by_controller", "fit", "modes":[{"hz","zeta"}], "poles":[[re,im]], "robustness"}}, "channel_scales",
///  "frequency_response":{"hz", "indirect_db", "coherence", "<method>_db"}, "bezout_residual", "seconds":{stage: s}}
/// ```
///
/// With a reduction there is `reduction`: its order, errors in open and closed loop, whether the controller stabilises it.
/// With an uncertainty there is `uncertainty`, and the modes of `hansen` have deviations and intervals; those of `grey_box` have them
/// where its parameters have a covariance. It has `parameters`, `level`, `correlations`, `verdict`, `structures` and `lost`.
/// A method or an indirect response that could not be had is listed under `refused` with its reason. Numbers that do not exist are null.
///
/// # Errors
/// Those of the frequency responses, modes and derived quantities.
pub fn summary(found: &Identification, seconds: &StageTimes) -> Result<Value> {
    let mut methods = Map::new();
    let mut refused = Map::new();
    for v in &found.verdict.models {
        if !matches!(v.method, Method::Nominal | Method::TruePlant) {
            methods.insert(v.method.key().into(), method_entry(found, v)?);
        }
    }
    for refusal in found.refusals() {
        refused.insert(refusal.key.into(), json!(refusal.error.to_string()));
    }
    let mut all = json!({
        "schema": SCHEMA,
        "name": found.settings.name,
        "nominal": {
            "fit": found.verdict.of(Method::Nominal).map(fits),
            "robustness": found.verdict.of(Method::Nominal).map(|v| robustness::summary_entry(&v.robustness)),
        },
        "methods": methods,
        "refused": refused,
        "frequency_response": response_entry(found)?,
        "data": found.data.json(),
        "bezout_residual": found.factorisation.bezout_residual,
        "controller_mismatch": found.signals.controller_mismatch,
        "seconds": seconds.iter().map(|(s, t)| (s.name().to_owned(), json!(t))).collect::<Map<_, _>>(),
    });
    if let Some(v) = found.verdict.of(Method::TruePlant) {
        all["true_plant"] = json!({"fit": fits(v), "robustness": robustness::summary_entry(&v.robustness)});
    }
    if let Some(scales) = &found.verdict.scales {
        all["channel_scales"] = robustness::scales_entry(scales);
    }
    all["certificate"] = json!(found.certificate.as_ref().map(RunCertificate::json));
    if let Some(Ok(new)) = &found.redesign {
        all["redesign"] = redesign::json(new);
    }
    if let Some(Ok(reduction)) = &found.reduction {
        all["reduction"] = reduction.summary();
    }
    if found.hansen.uncertainty.is_some() {
        all["uncertainty"] = summary_entry(found);
    }
    Ok(all)
}

fn method_entry(found: &Identification, v: &ModelVerdict) -> Result<Value> {
    let mut entry = json!({
        "order": v.model.order(),
        "stabilised_by_controller": v.certificate.stable,
        "fit": fits(v),
        "modes": v.modes.iter().map(|m| json!({"hz": m.hz, "zeta": m.zeta})).collect::<Vec<_>>(),
        "poles": pairs(&v.poles),
        "robustness": robustness::summary_entry(&v.robustness),
        "residuals": super::residual_tests::summary_entry(v),
    });
    if let Some(known) = found.uncertainty.of(v.method) {
        let modes = known.modes.iter().map(|band| with_deviations(json!({}), band));
        entry["modes"] = modes.collect::<Vec<_>>().into();
    }
    if let (Method::GreyBox, Some(Ok(run))) = (v.method, &found.grey_box) {
        let shown = run.shown();
        entry["parameters"] = json!(run.rows()?);
        entry["level"] = json!(shown.level);
        entry["correlations"] = json!(shown.correlations);
        entry["verdict"] = json!(shown.verdict);
        entry["structures"] = json!(shown.structures);
        entry["lost"] = json!(run.found.lost());
    }
    if matches!(v.method, Method::Hansen | Method::HansenReduced) {
        entry["s_order"] = json!(found.hansen.deviation.model.order());
        entry["s_stable"] = json!(found.hansen.deviation.stability.stable);
    }
    Ok(entry)
}

fn fits(v: &ModelVerdict) -> Value {
    v.records.iter().map(|r| (r.record.clone(), json!(r.fit))).collect::<Map<_, _>>().into()
}

fn response_entry(found: &Identification) -> Result<Value> {
    let measured = found.indirect.as_ref().and_then(|r| r.as_ref().ok());
    let hz = measured.map_or_else(|| found.hz.clone(), |m| m.response.omega.iter().map(|w| w / TAU).collect());
    let db = |values: Vec<c64>| values.iter().map(|v| decibel(v.norm())).collect::<Vec<f64>>();
    let mut entry = Map::new();
    if let Some(m) = measured {
        entry.insert("indirect_db".into(), json!(db(m.response.entry(0, 0))));
        entry.insert("coherence".into(), json!(m.coherence_y.col_as_slice(0)));
    }
    for (method, response) in model_responses(found, &hz)? {
        entry.insert(format!("{}_db", method.key()), json!(db(response.entry(0, 0))));
    }
    entry.insert("hz".into(), json!(hz));
    Ok(entry.into())
}
