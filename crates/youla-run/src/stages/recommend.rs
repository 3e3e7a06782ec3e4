//! The recommended model of a run: [`identify`] on its records, with the controller that ran and the nominal model.

use crate::check::{DataCheck, OF_SETTINGS};
use crate::stages::context::RunContext;
use crate::{Error, Result};
use rayon::prelude::*;
use youla::Mat;
use youla::identify::likelihood::{Evidence, Recommendation};
use youla::identify::{Identified, identify, identify_response};
use youla::signal::LoopRecord;
use youla_loop::check::{CheckOptions, Finding, Severity, Test, output_outliers};

/// What a defect of the data means for the verdict: a record that is not what it is said to be supports no model. The controller and single
/// outliers have tests and consequences of their own.
pub(crate) fn defects(data: &DataCheck) -> Option<Evidence> {
    let of_data = |f: &&Finding| f.severity == Severity::Defect && f.record != OF_SETTINGS && !OWN.contains(&f.test);
    refuted("Defects that the check of the data found", data.findings.iter().filter(of_data).collect())
}

/// The same of a stated controller beside which the log names another one: margins, certificate and redesign rest on it, also where it does
/// little to this loop, as that of outputs in a unit in which the loop gain is near zero.
pub(crate) fn named_controllers(data: &DataCheck, model: &Recommendation) -> Option<Evidence> {
    let another = |f: &&Finding| f.severity > Severity::Note && f.shows_another_controller();
    let found = data.findings.iter().filter(another).collect();
    refuted("Records that name another controller than the stated one (controller)", found)
        .filter(|_| model.description() != Some(false))
}

fn refuted(question: &str, found: Vec<&Finding>) -> Option<Evidence> {
    let first = found.first()?;
    let end = if first.advice.is_empty() { String::new() } else { format!(". {}", first.advice) };
    Some(Evidence::new(question, found.len() as f64, 0.0).noted(format!("{}: {}{end}", first.record, first.what)))
}

/// Tests of the data with a test or a consequence of their own in the verdict.
const OWN: [Test; 2] = [Test::Controller, Test::Outliers];

/// Whether a finding is of wrong samples that make much of the innovation: the model is estimated without them.
pub(crate) fn is_of_outliers(finding: &Finding) -> bool {
    finding.test == Test::Outliers && finding.severity > Severity::Note && finding.numbers.contains_key("share")
}

/// Records with the errors of those samples of their outputs.
fn with_errors(records: &[LoopRecord], options: &CheckOptions) -> Result<Vec<LoopRecord>> {
    let of = |record: &LoopRecord| {
        let mut errors = Mat::<f64>::zeros(record.samples(), record.outputs());
        for (output, found) in output_outliers(record.u(), record.y(), options)?.iter().enumerate() {
            if found.share >= options.outlier_share {
                found.samples.iter().zip(&found.sizes).for_each(|(k, size)| errors[(*k, output)] = *size);
            }
        }
        Ok(record.clone().with_output_errors(errors)?)
    };
    records.par_iter().map(of).collect()
}

/// What the model makes of findings: without wrong samples it was estimated; defects that the verdict has weighed and found harmless are cautions, as a
/// run lists no defect beside a trusted model, and a caution on the controller says that its test is passed.
pub(crate) fn weigh(data: &mut DataCheck, model: &Recommendation) {
    for finding in data.findings.iter_mut().filter(|f| is_of_outliers(f)) {
        finding.what += "; the recommended model is estimated without them";
    }
    let weighed = |f: &&mut Finding| match f.severity {
        Severity::Defect => OWN.contains(&f.test),
        Severity::Caution => f.test == Test::Controller,
        Severity::Note => false,
    };
    for finding in data.findings.iter_mut().filter(weighed).filter(|_| model.trusted()) {
        finding.severity = Severity::Caution;
        finding.what += " (the tests of the recommended model find it harmless in this loop)";
    }
}

/// The recommended model of the records of a run, or of its measured response; with `outliers` wrong samples of the outputs are looked for.
///
/// # Errors
/// Those of [`identify`], within `[recommended]`.
pub(crate) fn recommend(run: RunContext<'_>, outliers: bool) -> Result<Recommendation> {
    let (records, running) = (run.records, &run.declared.running);
    let mut options = run.settings.recommended.clone();
    if run.settings.data.outputs.iter().any(|c| c.sampled_every.is_some()) {
        options.sampled_every = run.settings.data.outputs.iter().map(|c| c.sampled_every).collect();
    }
    let nominal = run.declared.nominal.as_ref();
    let within = |e: youla::Error| Error::from(e).within("[recommended]");
    if let Some(measured) = &records.measured {
        let response = measured.response(records.time)?;
        let mut found = identify_response(&response, running, nominal, &options).map_err(within)?.model;
        if !run.settings.data.input_excitation.is_empty() && !running.is_open_loop() {
            found.evidence.extend(measured.controller(running.system())?);
        }
        return Ok(found);
    }
    let found = if outliers {
        let with_errors = |records| with_errors(records, &run.settings.check);
        identify(&with_errors(&records.estimation)?, &with_errors(&records.verification)?, running, nominal, &options)
    } else {
        identify(&records.estimation, &records.verification, running, nominal, &options)
    };
    found.map(|Identified { model, .. }| model).map_err(within)
}
