//! The numbers of the page for scripts.

use super::claims::paper_claims;
use super::figures_experiments::fit_of;
use super::map;
use super::tables_experiments::TABLE_1;
use super::tables_study::compared;
use crate::Result;
use crate::study::{Decile, Paper, StudyExperiment, StudyMethod, deciles, overall};
use serde_json::{Map, Value, json};
use youla_greybox::Structure;
use youla_twin::BearingStructure;

/// Schema of the summary.
const SCHEMA: u32 = 1;

/// Medians, failures, Table 1, winners and claims. Fits are in percent, horizontal then vertical, null where there is none.
/// Nothing in it differs from run to run.
///
/// ```text
/// {"schema":1, "seed", "models", "noise_um",
///  "study":{method:{"all":D, "deciles":[D]}},   D = {"theta", "count", "median", "worse", "usable", "refused", "unstable", "poor_fit"}
///  "crossover":[{"command_weight", "noise_um", "theta", "winner", "lead", "ranking":[{"method", "fit"}]}],
///  "nominal":{"fit", "parameters":{name: value}},
///  "experiments":{key:{"title", "figure", "table_1":{method:{"fit", "paper", "order", "stable", "stabilised"}},
///                 "starts":[{"factor", "cost", "fit", "steps", "stop"}]}},
///  "claims":[{"key", "source", "claim", "outcome", "text"}]}
/// ```
///
/// A cell of the map without a loop has no ranking; one that nobody wins has no winner. A model that is missing has its reason
/// under `refused`.
///
/// # Errors
/// None at present; the type leaves room for them.
pub fn paper_summary(paper: &Paper) -> Result<Value> {
    let study = compared(paper).into_iter().map(|m| (m.key().to_owned(), study_entry(paper, m)));
    let experiments = paper.experiments.list.iter().map(|e| (e.case.key.to_owned(), experiment_entry(e)));
    Ok(json!({
        "schema": SCHEMA,
        "seed": paper.settings.seed,
        "models": paper.settings.study.models,
        "noise_um": paper.rig.sensor.noise.value,
        "study": study.collect::<Map<_, _>>(),
        "crossover": map_entries(paper),
        "nominal": nominal_entry(paper),
        "experiments": experiments.collect::<Map<_, _>>(),
        "claims": paper_claims(paper),
    }))
}

fn study_entry(paper: &Paper, method: StudyMethod) -> Value {
    let theta = paper.settings.study.theta;
    let entry = |d: &Decile| {
        json!({
            "theta": d.theta, "count": d.count, "median": d.median, "worse": d.worse, "usable": d.usable(),
            "refused": d.refused, "unstable": d.unstable, "poor_fit": d.poor_fit,
        })
    };
    let tenths = deciles(&paper.study, method, theta);
    json!({"all": entry(&overall(&paper.study, method, theta)), "deciles": tenths.iter().map(entry).collect::<Vec<_>>()})
}

fn map_entries(paper: &Paper) -> Vec<Value> {
    let entry = |cell: map::MapCell| {
        let ranking =
            cell.winner.iter().flat_map(|w| &w.ranking).map(|(m, fit)| json!({"method": m.key(), "fit": fit}));
        json!({
            "command_weight": cell.at[0], "noise_um": cell.at[1], "theta": cell.at[2],
            "winner": cell.won_by().map(StudyMethod::key),
            "lead": cell.winner.as_ref().map(|w| w.margin),
            "ranking": ranking.collect::<Vec<_>>(),
        })
    };
    map::cells(paper).into_iter().map(entry).collect()
}

fn nominal_entry(paper: &Paper) -> Value {
    let found = &paper.experiments.nominal.found;
    let parameters = BearingStructure.names().into_iter().zip(found.parameters.iter().map(|v| json!(v)));
    json!({"fit": found.fit, "parameters": parameters.collect::<Map<_, _>>()})
}

fn experiment_entry(e: &StudyExperiment) -> Value {
    let model = |(method, published): (StudyMethod, Option<usize>)| {
        let mut entry = json!({"fit": fit_of(e, method), "paper": published.map(|k| e.case.published[k])});
        if let Some(found) = e.models.iter().find(|m| m.method == method) {
            match &found.model {
                Ok(model) => {
                    entry["order"] = json!(model.order());
                    entry["stable"] = json!(found.stable);
                    entry["stabilised"] = json!(found.stabilised);
                }
                Err(reason) => entry["refused"] = json!(reason),
            }
        }
        (method.key().to_owned(), entry)
    };
    let starts = e
        .starts
        .iter()
        .map(|s| json!({"factor": s.factor, "cost": s.cost, "fit": s.fit, "steps": s.steps, "stop": s.stop}));
    json!({
        "title": e.case.title,
        "figure": e.case.figure,
        "table_1": TABLE_1.into_iter().map(model).collect::<Map<_, _>>(),
        "starts": starts.collect::<Vec<_>>(),
    })
}
