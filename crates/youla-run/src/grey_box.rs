//! A physical structure in a run: the prediction-error method, started from the result of the scheme, with intervals, and
//! beside other structures.

use super::factorise::Factorisation;
use super::grey_box_loop::{Criterion, outputs_without_lines};
use super::records::RunRecords;
use super::settings::{Prediction, RunSettings};
use super::signals::DeviationSignals;
use crate::Result;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use youla::identify::hansen::HansenModel;
use youla_greybox::hansen_pem::{HansenPem, HansenPemOptions};
use youla_greybox::{
    Declaration, DeclaredStructure, GreyBoxIntervals, GreyBoxOptions, IntervalOptions, Structure, compare,
    likelihood_ratio,
};
use youla_report::data::{PhysicalEstimate, PhysicalParameter, PhysicalStructure};

/// What is known of the plant's physics, the table `[grey_box]` of run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GreyBoxSettings {
    /// The structure; explained in `docs/grey-box.md`.
    pub structure: Declaration,
    /// Whether the initial values of the parameters are a second start, beside the projection of G(S).
    #[serde(default = "yes")]
    pub start_from_initial: bool,
    /// What is compared with the outputs: the plant alone, driven by the measured u, or the loop with the declared controller,
    /// driven by the known excitations.
    #[serde(default)]
    pub prediction: Prediction,
    /// The search.
    #[serde(default)]
    pub pem: GreyBoxOptions,
    /// Intervals of the parameters.
    #[serde(default)]
    pub intervals: IntervalOptions,
    /// Further structures, estimated in the same way and compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alternative: Vec<AlternativeStructure>,
}

/// A structure to compare with that of `[grey_box.structure]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlternativeStructure {
    /// Name in tables.
    pub name: String,
    /// The structure.
    pub structure: Declaration,
    /// Whether one of the two holds the other, as with more or fewer fixed parameters: then the likelihood ratio is tested.
    #[serde(default)]
    pub nested: bool,
}

impl GreyBoxSettings {
    /// A structure, everything else as when absent.
    pub fn new(structure: Declaration) -> Self {
        GreyBoxSettings {
            structure,
            start_from_initial: yes(),
            prediction: Prediction::default(),
            pem: GreyBoxOptions::default(),
            intervals: IntervalOptions::default(),
            alternative: Vec::new(),
        }
    }

    /// What is wrong with a structure, beside `inputs` and `outputs` channels.
    pub(super) fn problem(&self, inputs: usize, outputs: usize) -> Option<String> {
        let of = |(place, declaration): (String, &Declaration)| match DeclaredStructure::new(declaration) {
            Err(e) => Some(format!("{place} {e}")),
            Ok(structure) if structure.ports() != (inputs, outputs) => {
                let (m, p) = structure.ports();
                Some(format!("{place} has {m} inputs and {p} outputs, but [data] lists {inputs} and {outputs}"))
            }
            Ok(_) => None,
        };
        let own = ("[grey_box.structure]".to_owned(), &self.structure);
        let others = self
            .alternative
            .iter()
            .map(|a| (format!("[grey_box.alternative.structure] of {:?}", a.name), &a.structure));
        std::iter::once(own).chain(others).find_map(of)
    }
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
    /// Its intervals, or why there are none.
    pub intervals: Result<GreyBoxIntervals>,
    /// This structure and the alternatives; empty without any.
    pub compared: Vec<PhysicalStructure>,
}

/// Estimates the structure, where one is declared.
pub(super) fn grey_box(
    factorisation: &Factorisation,
    signals: &DeviationSignals,
    records: &RunRecords,
    hansen: &HansenModel,
    settings: &RunSettings,
) -> Option<Result<GreyBoxRun>> {
    let asked = settings.grey_box.as_ref()?;
    Some(estimate(factorisation, signals, records, hansen, settings, asked).map_err(|e| e.within("[grey_box]")))
}

fn estimate(
    factorisation: &Factorisation,
    signals: &DeviationSignals,
    records: &RunRecords,
    hansen: &HansenModel,
    settings: &RunSettings,
    asked: &GreyBoxSettings,
) -> Result<GreyBoxRun> {
    let outputs = outputs_without_lines(records)?;
    let options =
        HansenPemOptions { hansen: settings.hansen.clone(), pem: asked.pem.clone(), ..HansenPemOptions::default() };
    let criterion = Criterion::new(asked.prediction, factorisation, signals, records, &outputs, &options)?;
    let of = |declaration: &Declaration| -> Result<(DeclaredStructure, HansenPem)> {
        let structure = DeclaredStructure::new(declaration)?;
        let nominal = asked.start_from_initial.then(|| structure.start());
        let found = criterion.estimate(hansen, &structure, nominal.as_deref())?;
        Ok((structure, found))
    };
    let (structure, found) = of(&asked.structure)?;
    let intervals = criterion.intervals(&structure, &found.model, &asked.intervals);
    let others = asked.alternative.iter().map(|other| (other, of(&other.structure).map(|(_, found)| found)));
    let compared = if asked.alternative.is_empty() { Vec::new() } else { table(&found, &others.collect::<Vec<_>>())? };
    Ok(GreyBoxRun { structure, found, intervals, compared })
}

/// The structures beside each other.
fn table(
    declared: &HansenPem,
    others: &[(&AlternativeStructure, Result<HansenPem>)],
) -> Result<Vec<PhysicalStructure>> {
    let estimated = others.iter().filter_map(|(other, found)| Some((other.name.as_str(), &found.as_ref().ok()?.model)));
    let models: Vec<_> = [("[grey_box.structure]", &declared.model)].into_iter().chain(estimated).collect();
    let mut rows = Vec::new();
    for (ranked, (_, model)) in compare(&models)?.into_iter().zip(&models) {
        rows.push(PhysicalStructure {
            name: ranked.name,
            unknowns: Some(ranked.unknowns),
            fit: model.fit.clone(),
            aic: Some(ranked.aic),
            bic: Some(ranked.bic),
            ..PhysicalStructure::default()
        });
    }
    for (other, found) in others {
        match found {
            Err(reason) => {
                let (name, failure) = (other.name.clone(), Some(reason.to_string()));
                rows.push(PhysicalStructure { name, failure, ..PhysicalStructure::default() });
            }
            Ok(found) if other.nested => {
                let (one, two) = (&declared.model, &found.model);
                let test =
                    if one.unknowns < two.unknowns { likelihood_ratio(one, two) } else { likelihood_ratio(two, one) };
                let test =
                    test.map_err(|e| e.within(format!("alternative {:?}, which is said to be nested", other.name)))?;
                if let Some(row) = rows.iter_mut().skip(1).find(|row| row.name == other.name) {
                    row.statistic = Some(test.statistic);
                    row.degrees_of_freedom = Some(test.degrees_of_freedom);
                    row.p_value = Some(test.p_value);
                }
            }
            Ok(_) => {}
        }
    }
    Ok(rows)
}

impl GreyBoxRun {
    /// Name, unit, value, standard deviation, interval and bound of each free parameter, then of each derived quantity.
    pub(super) fn rows(&self) -> Result<Vec<PhysicalParameter>> {
        let (model, known) = (&self.found.model, self.intervals.as_ref().ok());
        let unit = |name: &str| {
            let known = self.structure.parameters().iter().find(|p| p.name == name);
            known.map_or_else(String::new, |p| p.unit.clone())
        };
        let parameter = |(j, name): (usize, String)| PhysicalParameter {
            unit: unit(&name),
            value: model.parameters[j],
            deviation: known.map(|k| k.parameters[j].deviation),
            interval: known.map(|k| k.parameters[j].interval),
            at_bound: model.at_bounds.iter().find(|b| b.parameter == name).map(|b| b.value),
            derived: false,
            name,
        };
        let derived = self.structure.derived(&model.parameters, known.map(|k| k.covariance.as_ref()))?;
        let derived = derived.into_iter().map(|d| {
            let half = d.deviation.zip(known).map(|(deviation, k)| k.half_width() * deviation);
            PhysicalParameter {
                name: d.name,
                unit: String::new(),
                value: d.value,
                deviation: d.deviation,
                interval: half.map(|half| [d.value - half, d.value + half]),
                at_bound: None,
                derived: true,
            }
        });
        Ok(self.structure.names().into_iter().enumerate().map(parameter).chain(derived).collect())
    }

    /// What the report shows beside the parameters.
    pub(super) fn shown(&self) -> PhysicalEstimate {
        let known = self.intervals.as_ref().ok();
        let correlations = known
            .map_or_else(Vec::new, |k| k.correlations.row_iter().map(|row| row.iter().copied().collect()).collect());
        let verdict = match &self.intervals {
            Ok(known) => known.verdict(),
            Err(reason) => format!("There are no intervals: {reason}."),
        };
        let (names, structures) = (self.structure.names(), self.compared.clone());
        PhysicalEstimate { level: known.map(|k| k.level), verdict, names, correlations, structures }
    }

    /// Parameters, intervals, searches and what the data do not determine.
    pub(super) fn details(&self) -> Result<Value> {
        let (found, model) = (&self.found, &self.found.model);
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
        let residuals = match &self.intervals {
            Ok(known) => json!({"test": known.residuals, "colour": known.colour, "coloured": known.coloured}),
            Err(reason) => json!({"refused": reason.to_string()}),
        };
        let shown = self.shown();
        Ok(json!({
            "parameters": self.rows()?, "level": shown.level, "correlations": shown.correlations, "residuals": residuals,
            "verdict": shown.verdict, "structures": shown.structures, "fit": model.fit, "residual": model.residual,
            "stop": model.stop, "iterations": model.iterations, "rank": model.rank, "rcond": model.rcond,
            "undetermined": model.undetermined.sentences(), "runs": runs, "won": found.won, "lost": found.lost(),
        }))
    }
}
