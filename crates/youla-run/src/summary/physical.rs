//! A physical structure of a run: parameters, intervals, the structures that were compared.

use super::entries::OrRefused;
use crate::Result;
use crate::stages::grey_box::GreyBoxRun;
use serde::{Deserialize, Serialize};
use youla_greybox::hansen_pem::{PemRun, PemStart};
use youla_greybox::{ResidualTest, Stop, Structure};
use youla_report::data::{PhysicalEstimate, PhysicalParameter};

/// A physical structure in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PhysicalEntry {
    /// Parameters, then derived quantities.
    pub parameters: Vec<PhysicalParameter>,
    /// Intervals, correlations and comparison of structures.
    #[serde(flatten)]
    pub estimate: PhysicalEstimate,
    /// Whether the fit is clearly below that of the black-box model: a local minimum, or a structure that does not describe the plant.
    pub local_minimum_suspected: bool,
}

impl PhysicalEntry {
    /// Of an estimate.
    ///
    /// # Errors
    /// Those of the derived quantities.
    pub(crate) fn new(run: &GreyBoxRun) -> Result<Self> {
        let known = run.intervals.as_ref();
        let correlations =
            |rows: youla::MatRef<'_, f64>| rows.row_iter().map(|r| r.iter().copied().collect()).collect();
        Ok(PhysicalEntry {
            parameters: parameters(run)?,
            estimate: PhysicalEstimate {
                level: known.ok().map(|k| k.level),
                verdict: known.map_or_else(|e| format!("There are no intervals: {e}."), |k| k.verdict()),
                names: run.structure.names(),
                correlations: known.map_or_else(|_| Vec::new(), |k| correlations(k.correlations.as_ref())),
                structures: run.compared.clone(),
            },
            local_minimum_suspected: run.found.local_minimum_suspected,
        })
    }
}

/// Name, unit, value, standard deviation, interval and bound of each free parameter, then of each derived quantity.
fn parameters(run: &GreyBoxRun) -> Result<Vec<PhysicalParameter>> {
    let (model, known) = (&run.found.model, run.intervals.as_ref().ok());
    let unit = |name: &str| {
        let known = run.structure.parameters().iter().find(|p| p.name == name);
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
    let derived = run.structure.derived(&model.parameters, known.map(|k| k.covariance.as_ref()))?;
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
    Ok(run.structure.names().into_iter().enumerate().map(parameter).chain(derived).collect())
}

/// `details` of `4-identify/grey_box.json`: parameters, intervals, searches and what the data do not determine.
#[derive(Serialize)]
pub(crate) struct PhysicalDetails<'a> {
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

impl<'a> PhysicalDetails<'a> {
    /// Of an estimate.
    ///
    /// # Errors
    /// As [`PhysicalEntry::new`].
    pub(crate) fn new(run: &'a GreyBoxRun) -> Result<Self> {
        let (found, model) = (&run.found, &run.found.model);
        let search = |run: &PemRun| SearchEntry {
            start: run.start,
            cost_at_start: run.cost_at_start,
            cost: run.cost.as_ref().ok().copied(),
            failure: run.cost.as_ref().err().map(ToString::to_string),
        };
        let residuals = run.intervals.as_ref().map(|known| ResidualsEntry {
            test: &known.residuals,
            colour: &known.colour,
            coloured: known.coloured,
        });
        Ok(PhysicalDetails {
            physical: PhysicalEntry::new(run)?,
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
}
