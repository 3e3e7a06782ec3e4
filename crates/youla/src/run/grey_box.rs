//! A physical structure in a run: the prediction-error method, started from the result of the scheme.

use super::disturbance::without_lines;
use super::records::RunRecords;
use super::settings::RunSettings;
use super::signals::DeviationSignals;
use crate::factor::CoprimeFactors;
use crate::identify::greybox::{Declaration, DeclaredStructure, GreyBoxOptions, Structure};
use crate::identify::hansen::HansenModel;
use crate::identify::hansen_pem::{HansenPem, HansenPemOptions, pem_from_hansen};
use crate::identify::subspace::Experiment;
use crate::lti::Discrete;
use crate::{Mat, Result};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// What is known of the plant's physics, the table `[grey_box]` of run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GreyBoxSettings {
    /// The structure; its keys stand in `docs/grey-box.md`.
    pub structure: Declaration,
    /// Whether the initial values of the parameters are a second start, beside the projection of G(S).
    #[serde(default = "yes")]
    pub start_from_initial: bool,
    /// The search.
    #[serde(default)]
    pub pem: GreyBoxOptions,
}

fn yes() -> bool {
    true
}

/// The structure with its estimate.
#[derive(Debug)]
pub struct GreyBoxRun {
    /// The structure.
    pub structure: DeclaredStructure,
    /// Projections, searches and the best model.
    pub found: HansenPem,
}

/// Estimates the structure, where one is declared.
pub(super) fn grey_box(
    factors: &CoprimeFactors<Discrete>,
    signals: &DeviationSignals,
    records: &RunRecords,
    hansen: &HansenModel,
    settings: &RunSettings,
) -> Option<Result<GreyBoxRun>> {
    let asked = settings.grey_box.as_ref()?;
    Some(estimate(factors, signals, records, hansen, settings, asked).map_err(|e| e.within("[grey_box]")))
}

fn estimate(
    factors: &CoprimeFactors<Discrete>,
    signals: &DeviationSignals,
    records: &RunRecords,
    hansen: &HansenModel,
    settings: &RunSettings,
    asked: &GreyBoxSettings,
) -> Result<GreyBoxRun> {
    let structure = DeclaredStructure::new(&asked.structure)?;
    let nominal = asked.start_from_initial.then(|| structure.start());
    let options =
        HansenPemOptions { hansen: settings.hansen.clone(), pem: asked.pem.clone(), ..HansenPemOptions::default() };
    let measured = |r: &super::records::LoopRecord| -> Result<Mat<f64>> {
        without_lines(r.y.as_ref(), r.disturbance.as_ref().map(|w| w.as_ref()))
    };
    let outputs = records.estimation.iter().map(measured).collect::<Result<Vec<_>>>()?;
    let experiments: Vec<_> =
        records.estimation.iter().zip(&outputs).map(|(r, y)| Experiment { u: r.u.as_ref(), y: y.as_ref() }).collect();
    let (hansen, signals) = (hansen.clone(), &signals.experiments);
    let found = pem_from_hansen(hansen, factors, signals, &experiments, &structure, nominal.as_deref(), &options)?;
    Ok(GreyBoxRun { structure, found })
}

impl GreyBoxRun {
    /// Name, unit, value, standard deviation and bound of each free parameter, then of each derived quantity.
    pub(super) fn rows(&self) -> Result<Vec<ParameterRow>> {
        let model = &self.found.model;
        let deviations = model.standard_deviations();
        let unit = |name: &str| {
            let known = self.structure.parameters().iter().find(|p| p.name == name);
            known.map_or_else(String::new, |p| p.unit.clone())
        };
        let bound = |name: &str| model.at_bounds.iter().find(|b| b.parameter == name).map(|b| b.value);
        let parameter = |(j, name): (usize, String)| ParameterRow {
            unit: unit(&name),
            value: model.parameters[j],
            deviation: deviations.as_ref().map(|d| d[j]),
            at_bound: bound(&name),
            derived: false,
            name,
        };
        let derived = self.structure.derived(&model.parameters, model.covariance.as_ref().map(|c| c.as_ref()))?;
        let derived = derived.into_iter().map(|d| ParameterRow {
            name: d.name,
            unit: String::new(),
            value: d.value,
            deviation: d.deviation,
            at_bound: None,
            derived: true,
        });
        Ok(self.structure.names().into_iter().enumerate().map(parameter).chain(derived).collect())
    }

    /// Parameters, searches and what the data do not determine.
    pub(super) fn details(&self) -> Result<Value> {
        let (found, model) = (&self.found, &self.found.model);
        let correlations = model.covariance.as_ref().map(|c| {
            let entry = |i: usize, j: usize| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
            (0..c.nrows()).map(|i| (0..c.nrows()).map(|j| entry(i, j)).collect::<Vec<_>>()).collect::<Vec<_>>()
        });
        let runs: Vec<Value> = found
            .runs
            .iter()
            .map(|run| {
                let failure = run.cost.as_ref().err().map(ToString::to_string);
                json!({
                    "start": run.start, "cost_at_start": run.cost_at_start, "cost": run.cost.as_ref().ok(), "failure": failure,
                })
            })
            .collect();
        Ok(json!({
            "parameters": self.rows()?, "correlations": correlations, "fit": model.fit, "residual": model.residual,
            "stop": model.stop, "iterations": model.iterations, "rank": model.rank, "rcond": model.rcond,
            "undetermined": model.undetermined.sentences(), "runs": runs, "won": found.won, "lost": found.lost(),
        }))
    }
}

/// A parameter or derived quantity of the structure, as artefact and report have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterRow {
    /// Name.
    pub name: String,
    /// Unit, empty where none is declared.
    pub unit: String,
    /// Estimate.
    pub value: f64,
    /// Standard deviation, absent where the data do not determine all parameters.
    pub deviation: Option<f64>,
    /// The bound at which it ended.
    pub at_bound: Option<f64>,
    /// Whether it follows from the others.
    pub derived: bool,
}
