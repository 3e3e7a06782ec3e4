//! The recommended model of a run: [`identify`] on its records, with the controller that ran and the nominal model.

use crate::records::LoopRecord;
use crate::stages::context::RunContext;
use crate::{Error, Result};
use youla::identify::likelihood::{self, Recommendation};
use youla::identify::{Identified, identify};

/// The recommended model of the records of a run, or of its measured response.
///
/// # Errors
/// Those of [`identify`], within `[recommended]`.
pub(crate) fn recommend(run: RunContext<'_>) -> Result<Recommendation> {
    let (records, running, options) = (run.records, &run.declared.running, &run.settings.recommended);
    let within = |e: youla::Error| Error::from(e).within("[recommended]");
    if let Some(measured) = &records.measured {
        let controller = (!running.is_open_loop()).then_some(running.system());
        let response = measured.response(records.time)?;
        let mut found = likelihood::recommend_from_response(&response, controller, options).map_err(within)?;
        if !run.settings.data.input_excitation.is_empty() {
            found.evidence.extend(controller.map(|k| measured.controller(k)).transpose()?.flatten());
        }
        return Ok(found);
    }
    let of = |group: &[LoopRecord]| group.iter().map(LoopRecord::of_method).collect::<youla::Result<Vec<_>>>();
    let (estimation, fresh) = (of(&records.estimation)?, of(&records.verification)?);
    let found = identify(&estimation, &fresh, running, Some(&run.declared.nominal), options);
    found.map(|Identified { model, .. }| model).map_err(within)
}
