//! The records of a run on its page: files, findings, signals, predictions.

use crate::Result;
use crate::records::channels_of;
use crate::result::Identification;
use crate::settings::PredictionKind;
use youla::MatRef;
use youla::signal::Channel;
use youla::signal::LoopRecord;
use youla_loop::check::{Finding, Severity};
use youla_report::data::{self, SignalKind};
use youla_report::{Timeline, Trace};

/// From what, in one sentence.
pub(crate) fn summary_sentence(found: &Identification) -> String {
    let records = &found.records;
    let samples: usize = records.estimation.iter().map(LoopRecord::samples).sum();
    let how = match found.declared.controller().is_zero() {
        true => "in open loop",
        false => "in closed loop",
    };
    let from = match &records.measured {
        Some(measured) => {
            let of = if measured.of_loop { "loop" } else { "plant" };
            format!("the response of the {of} at {} frequencies", measured.table.omega.len())
        }
        None => format!("{} with {samples} samples", counted(records.estimation.len(), "record")),
    };
    format!(
        "Identified {how} from {from} (sample time {} s, {}, {}).",
        records.time.ts(),
        counted(records.inputs.len(), "input"),
        counted(records.outputs.len(), "output"),
    )
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// What the check of the data found, the most serious first.
pub(crate) fn findings(found: &Identification) -> Vec<data::DataFinding> {
    let status = |severity: Severity| match severity {
        Severity::Note => data::LineStatus::Info,
        Severity::Caution => data::LineStatus::Caution,
        Severity::Defect => data::LineStatus::Bad,
    };
    let one = |(f, more): (&Finding, usize)| data::DataFinding {
        status: status(f.severity),
        test: f.test.key().into(),
        record: f.record.clone(),
        channel: f.channel.clone(),
        rows: f.rows,
        what: f.what.clone(),
        advice: f.advice.clone(),
        further: more,
    };
    found.data.grouped().into_iter().map(one).collect()
}

/// Signals of the estimation records.
///
/// # Errors
/// Those of [`Trace::new`].
pub(crate) fn experiments(found: &Identification) -> Result<Vec<data::DrawnExperiment>> {
    found.records.estimation.iter().enumerate().map(|(k, r)| experiment(found, k, r)).collect()
}

/// Times that are drawn, around the largest swing of the first output.
fn clock(record: &LoopRecord) -> Timeline {
    let first: Vec<f64> = record.y().col(0).iter().copied().collect();
    Timeline::around_largest_swing(record.time().ts(), &first)
}

fn experiment(found: &Identification, k: usize, record: &LoopRecord) -> Result<data::DrawnExperiment> {
    let clock = clock(record);
    let (u, y) = (&found.records.inputs, &found.records.outputs);
    let named = |prefix: &str, channels: &[Channel]| -> Vec<Channel> {
        channels.iter().map(|c| Channel::new(format!("{prefix} {}", c.name), &c.unit)).collect()
    };
    let mut drawn = Vec::new();
    let mut add = |kind: SignalKind, channels: &[Channel], data: MatRef<'_, f64>| -> Result<()> {
        let dropped = record.samples() - data.nrows();
        for (j, channel) in channels.iter().enumerate() {
            // Samples dropped at the start are a gap, so that all signals share one clock.
            let mut values = vec![f64::NAN; dropped];
            values.extend(data.col(j).iter());
            let trace = Trace::new(&channel.name, &values, &clock)?;
            drawn.push(data::Signal { kind, channel: channel.clone(), trace });
        }
        Ok(())
    };
    let data = &found.settings.data;
    for (specs, excitation) in [
        (&data.input_excitation, record.input_excitation()),
        (&data.reference, record.reference()),
        (&data.alpha, record.alpha()),
    ] {
        if let Some(excitation) = excitation {
            add(SignalKind::Excitation, &channels_of(specs), excitation)?;
        }
    }
    add(SignalKind::Input, u, record.u())?;
    add(SignalKind::Output, y, record.y())?;
    if let Some(signals) = found.signals() {
        let signals = &signals.experiments[k];
        add(SignalKind::Alpha, &named("alpha", u), signals.alpha())?;
        add(SignalKind::Beta, &named("beta", y), signals.beta())?;
    }
    Ok(data::DrawnExperiment { name: record.name().to_owned(), clock, signals: drawn })
}

/// Measured outputs beside the predictions of all models.
///
/// # Errors
/// Those of [`Trace::new`].
pub(crate) fn verification(found: &Identification) -> Result<Vec<data::Verification>> {
    found.records.verification.iter().enumerate().map(|(k, r)| verified(found, k, r)).collect()
}

fn verified(found: &Identification, k: usize, record: &LoopRecord) -> Result<data::Verification> {
    let clock = clock(record);
    let prediction = match found.validation.prediction {
        PredictionKind::OpenLoop => "simulated from the measured input, initial state estimated",
        PredictionKind::ClosedLoop => {
            "simulated under the controller from the known excitations, initial state estimated"
        }
    };
    let outputs = (0..record.outputs())
        .map(|output| {
            let name = &found.records.outputs[output].name;
            let measured: Vec<f64> = record.y().col(output).iter().copied().collect();
            let mut predictions = Vec::new();
            for v in &found.validation.models {
                let Ok(predicted) = &v.records[k].predicted else { continue };
                let values = predicted.col_as_slice(output);
                let residual: Vec<f64> = measured.iter().zip(values).map(|(y, yp)| y - yp).collect();
                predictions.push(data::DrawnPrediction {
                    method: v.method.key().into(),
                    predicted: Trace::new(name, values, &clock)?,
                    residual: Trace::new(name, &residual, &clock)?,
                });
            }
            Ok(data::VerifiedOutput { output, measured: Trace::new(name, &measured, &clock)?, predictions })
        })
        .collect::<Result<_>>()?;
    Ok(data::Verification { record: record.name().to_owned(), prediction: prediction.into(), clock, outputs })
}
