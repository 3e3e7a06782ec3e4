//! A physical structure in a run: the prediction-error method, started from the result of the scheme, with intervals, and
//! beside other structures.

pub(crate) mod criterion;

use crate::Result;
use crate::settings::{AlternativeStructure, GreyBoxSettings};
use crate::stages::context::RunContext;
use crate::stages::grey_box::criterion::{Criterion, SchemeStart, StructureSearch, outputs_without_lines};
use crate::summary::entries::OrRefused;
use serde::{Deserialize, Serialize};
use youla_greybox::hansen_pem::{HansenPemOptions, PemRun, PemStart};
use youla_greybox::{
    Declaration, DeclaredStructure, GreyBoxIntervals, IntervalOptions, ResidualTest, Stop, Structure, compare,
    likelihood_ratio,
};
use youla_report::data::{PhysicalEstimate, PhysicalParameter, PhysicalStructure};

/// The structure with its estimate.
#[derive(Debug)]
pub struct GreyBoxRun {
    /// The structure.
    pub structure: DeclaredStructure,
    /// Searches and the best model.
    pub found: StructureSearch,
    /// Its intervals, or why there are none.
    pub intervals: Result<GreyBoxIntervals>,
    /// This structure and the alternatives; empty without any.
    pub compared: Vec<PhysicalStructure>,
}

/// Estimates the structure, where one is declared; from its initial values where the scheme gave no model.
pub(crate) fn grey_box(run: RunContext<'_>, start: Option<SchemeStart<'_>>) -> Option<Result<GreyBoxRun>> {
    let asked = run.settings.grey_box.as_ref()?;
    Some(estimate(run, start, asked).map_err(|e| e.within("[grey_box]")))
}

fn estimate(run: RunContext<'_>, start: Option<SchemeStart<'_>>, asked: &GreyBoxSettings) -> Result<GreyBoxRun> {
    let outputs = outputs_without_lines(run.records)?;
    let options =
        HansenPemOptions { hansen: run.settings.hansen.clone(), pem: asked.search(), ..HansenPemOptions::default() };
    let criterion = Criterion::new(asked.prediction, run, &outputs, &options)?;
    let of = |declaration: &Declaration| -> Result<(DeclaredStructure, StructureSearch)> {
        let structure = DeclaredStructure::new(declaration)?;
        let nominal = (asked.start_from_initial || start.is_none()).then(|| structure.start());
        let found = criterion.estimate(start, &structure, nominal.as_deref())?;
        Ok((structure, found))
    };
    let (structure, found) = of(&asked.structure)?;
    let levels = IntervalOptions { level: run.settings.hansen.uncertainty.level, ..IntervalOptions::default() };
    let intervals = criterion.intervals(&structure, &found.model, &levels);
    let others = asked.alternative.iter().map(|other| (other, of(&other.structure).map(|(_, found)| found)));
    let compared = if asked.alternative.is_empty() { Vec::new() } else { table(&found, &others.collect::<Vec<_>>())? };
    Ok(GreyBoxRun { structure, found, intervals, compared })
}

/// The structures beside each other.
fn table(
    declared: &StructureSearch,
    others: &[(&AlternativeStructure, Result<StructureSearch>)],
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
                    test.map_err(|e| e.within(format!("alternative {:?}, which is declared as nested", other.name)))?;
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
    pub(crate) fn rows(&self) -> Result<Vec<PhysicalParameter>> {
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
    pub(crate) fn shown(&self) -> PhysicalEstimate {
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

    /// `details` of `4-identify/grey_box.json`: parameters, intervals, searches and what the data do not determine.
    pub(crate) fn details(&self) -> Result<GreyBoxDetails<'_>> {
        let (found, model) = (&self.found, &self.found.model);
        let search = |run: &PemRun| SearchEntry {
            start: run.start,
            cost_at_start: run.cost_at_start,
            cost: run.cost.as_ref().ok().copied(),
            failure: run.cost.as_ref().err().map(ToString::to_string),
        };
        let residuals = self.intervals.as_ref().map(|known| ResidualsEntry {
            test: &known.residuals,
            colour: &known.colour,
            coloured: known.coloured,
        });
        Ok(GreyBoxDetails {
            physical: self.entry()?,
            residuals: OrRefused::new(residuals),
            fit: &model.fit,
            residual: &model.residual,
            stop: model.stop,
            iterations: model.iterations,
            rank: model.rank,
            rcond: model.rcond,
            undetermined: model.undetermined.sentences(),
            runs: found.runs.iter().map(search).collect(),
            won: found.won,
        })
    }

    /// What summary.json says of the structure.
    pub(crate) fn entry(&self) -> Result<PhysicalEntry> {
        let PhysicalEstimate { level, verdict, correlations, structures, .. } = self.shown();
        let (parameters, local_minimum_suspected) = (self.rows()?, self.found.local_minimum_suspected);
        Ok(PhysicalEntry { parameters, level, correlations, verdict, structures, local_minimum_suspected })
    }
}

/// A physical structure in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PhysicalEntry {
    /// Parameters, then derived quantities: `name`, `unit`, `value`, `deviation`, `interval`, `at_bound`, `derived`.
    #[schemars(with = "Vec<serde_json::Map<String, serde_json::Value>>")]
    pub parameters: Vec<PhysicalParameter>,
    /// Level of the intervals; `null` where there are none.
    pub level: Option<f64>,
    /// Correlations of the parameters, row by row.
    pub correlations: Vec<Vec<f64>>,
    /// What the intervals rest on, in one sentence.
    pub verdict: String,
    /// The structures that were compared, the declared one first.
    #[schemars(with = "Vec<serde_json::Map<String, serde_json::Value>>")]
    pub structures: Vec<PhysicalStructure>,
    /// Whether the fit is clearly below that of G(S): a local minimum, or a structure that does not describe the plant.
    pub local_minimum_suspected: bool,
}

/// `details` of `4-identify/grey_box.json`.
#[derive(Serialize)]
pub(crate) struct GreyBoxDetails<'a> {
    #[serde(flatten)]
    physical: PhysicalEntry,
    residuals: OrRefused<ResidualsEntry<'a>>,
    fit: &'a [f64],
    residual: &'a [f64],
    stop: Stop,
    iterations: usize,
    rank: usize,
    rcond: f64,
    undetermined: Vec<String>,
    runs: Vec<SearchEntry>,
    won: PemStart,
}

#[derive(Serialize)]
struct ResidualsEntry<'a> {
    test: &'a ResidualTest,
    colour: &'a [f64],
    coloured: bool,
}

/// One search.
#[derive(Serialize)]
struct SearchEntry {
    start: PemStart,
    cost_at_start: f64,
    cost: Option<f64>,
    failure: Option<String>,
}
