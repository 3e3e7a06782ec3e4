//! A physical structure in a run: the prediction-error method, started from the result of the scheme, with intervals, and
//! beside other structures.

pub(crate) mod criterion;

use crate::Result;
use crate::settings::{AlternativeStructure, GreyBoxSettings};
use crate::stages::context::RunContext;
use crate::stages::grey_box::criterion::{Criterion, SchemeStart, StructureSearch, outputs_without_lines};
use youla_greybox::hansen_pem::HansenPemOptions;
use youla_greybox::{Declaration, DeclaredStructure, GreyBoxIntervals, IntervalOptions, compare, likelihood_ratio};
use youla_report::data::PhysicalStructure;

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
    let hansen = run.settings.hansen.clone().unwrap_or_default();
    let options = HansenPemOptions { hansen, pem: asked.search(), ..HansenPemOptions::default() };
    let criterion = Criterion::new(asked.prediction, run, &outputs, &options)?;
    let of = |declaration: &Declaration| -> Result<(DeclaredStructure, StructureSearch)> {
        let structure = DeclaredStructure::new(declaration)?;
        let nominal = (asked.start_from_initial || start.is_none()).then(|| structure.start());
        let found = criterion.estimate(start, &structure, nominal.as_deref())?;
        Ok((structure, found))
    };
    let (structure, found) = of(&asked.structure)?;
    let intervals = criterion.intervals(&structure, &found.model, &IntervalOptions::default());
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
