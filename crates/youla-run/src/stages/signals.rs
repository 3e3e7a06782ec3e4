//! alpha and beta of the estimation records, with the transient of the filter dropped and the controller checked.

use crate::records::RunRecords;
use crate::{Error, Result};
use faer::Scale;
use std::path::{Path, PathBuf};
use youla::Mat;
use youla::error::Seconds;
use youla::factor::{CoprimeFactors, YoulaSignals};
use youla::linalg::block;
use youla::lti::Discrete;
use youla::signal::Channel;
use youla::signal::LoopRecord;
use youla::signal::Record;
use youla_io::write_csv;

/// Signals of the deviation system for all estimation records.
#[derive(Debug, Clone)]
pub struct DeviationSignals {
    /// One pair per record, after the settling samples.
    pub experiments: Vec<YoulaSignals>,
    /// The part of alpha that the known excitations cause, per record, after the settling samples; empty where no
    /// excitation is known.
    pub expected_alpha: Vec<Mat<f64>>,
    /// Samples dropped at the start of each record.
    pub settle: usize,
    /// `||alpha - expected|| / ||expected||` over all records: 0 when the declared controller is the one that ran and
    /// nothing else (saturation, unknown excitation) acted. `None` where no excitation is known or all are
    /// zero.
    pub controller_mismatch: Option<f64>,
}

/// Relative miss of alpha from which the declared controller is named as a likely cause of a failure.
/// Five times the caution of the check of the data, 1 %. Chosen, not measured.
const SUSPICIOUS_MISMATCH: f64 = 0.05;

impl DeviationSignals {
    /// Where a failure of the scheme happened, with the likely cause when the log contradicts the declared controller.
    pub(crate) fn context(&self) -> String {
        let place = "[hansen] S from alpha to beta";
        match self.controller_mismatch {
            Some(mismatch) if mismatch > SUSPICIOUS_MISMATCH => format!(
                "{place}, where the declared [controller] misses the known excitations by {:.0} % (check its coefficients, \
                 sign, delay and saturation)",
                100.0 * mismatch
            ),
            _ => place.to_owned(),
        }
    }
}

/// Filters every estimation record by the left factors. alpha is always taken from the **measured** u and y, so that
/// saturation and unknown excitations are accounted for; known excitations serve as a check of the controller.
///
/// # Errors
/// [`youla::Error::TooFewSamples`] for a record that the settling samples use up; shapes.
pub(crate) fn deviation_signals(
    factors: &CoprimeFactors<Discrete>,
    records: &[LoopRecord],
    settle: Option<usize>,
) -> Result<DeviationSignals> {
    let stated = settle.is_some();
    let settle = settle.map_or_else(|| factors.settling_samples(REMAINDER), Ok)?;
    let mut experiments = Vec::new();
    let mut expected_alpha = Vec::new();
    for record in records {
        if record.samples() <= settle {
            let what = match stated {
                true => format!("record {}, of which `settle` in [factors] drops the first {settle}", record.name()),
                false => format!(
                    "record {} is {} s long, but the slowest pole of model and controller settles in {} s; check sample_time and the \
                     units of the time in [data], or state `settle` in [factors], which is {settle} samples",
                    record.name(),
                    Seconds(record.samples() as f64 * record.time().ts()),
                    Seconds(settle as f64 * record.time().ts()),
                ),
            };
            let (found, needed) = (record.samples(), settle + 1);
            return Err(Error::Method(youla::Error::TooFewSamples { what, found, needed }));
        }
        let signals = factors.signals(record.u(), record.y())?;
        let signals = match record.disturbance() {
            Some(lines) => signals.with_disturbance(lines.to_owned())?,
            None => signals,
        };
        experiments.push(signals.after(settle)?);
        if let Some(expected) = expected(factors, record)? {
            expected_alpha.push(expected.subrows(settle, expected.nrows() - settle).to_owned());
        }
    }
    let pairs = || experiments.iter().zip(&expected_alpha);
    let size: f64 = pairs().map(|(_, e)| e.squared_norm_l2()).sum();
    // An excitation that is zero throughout says nothing of the controller.
    let controller_mismatch = (size > 0.0).then(|| {
        let miss: f64 = pairs().map(|(s, e)| (s.alpha() - e).squared_norm_l2()).sum();
        (miss / size).sqrt()
    });
    Ok(DeviationSignals { experiments, expected_alpha, settle, controller_mismatch })
}

/// The signals of every estimation record as records of their own, over all samples:
///
/// - `eta_<input> = Vt u - Ut y`, computed from the measured signals;
/// - `alpha_<input>`, the part of eta that the known excitations cause (eta itself where none is known);
/// - `beta_<output> = Mt y - Nt u`, the innovation (28); epsilon of the same filter has the same values.
///
/// # Errors
/// Shapes.
pub fn signal_records(factors: &CoprimeFactors<Discrete>, records: &RunRecords) -> Result<Vec<Record>> {
    let named = |prefix: &str, channels: &[Channel]| -> Vec<Channel> {
        channels.iter().map(|c| Channel::new(format!("{prefix}_{}", c.name), &c.unit)).collect()
    };
    let (u, y) = (&records.inputs, &records.outputs);
    let channels = [named("alpha", u), named("beta", y), named("eta", u)].concat();
    let one = |record: &LoopRecord| {
        let signals = factors.signals(record.u(), record.y())?;
        let (eta, beta) = (signals.alpha(), signals.beta());
        let expected = expected(factors, record)?;
        let alpha = expected.as_ref().map_or(eta, |alpha| alpha.as_ref());
        let data = block(&[&[alpha, beta, eta]]);
        Ok(Record::new(record.name(), channels.clone(), data, record.time())?)
    };
    records.estimation.iter().map(one).collect()
}

/// Writes [`signal_records`] to `folder`, one CSV file each, and returns their paths. The folder is made if need be;
/// files of other names in it stay.
///
/// # Errors
/// [`youla_io::Error::Io`]; then none of these files is there.
pub fn write_signals(records: &[Record], folder: &Path) -> Result<Vec<PathBuf>> {
    let io = |source| Error::File(youla_io::Error::Io { path: folder.to_owned(), source });
    let made = !folder.exists();
    std::fs::create_dir_all(folder).map_err(io)?;
    let paths: Vec<PathBuf> = records.iter().map(|r| folder.join(format!("{}.csv", r.name()))).collect();
    records.iter().zip(&paths).try_for_each(|(record, path)| write_csv(record, path)).inspect_err(|_| {
        // Best effort: the error that led here is the one to report.
        for path in &paths {
            let _ = std::fs::remove_file(path);
        }
        if made {
            let _ = std::fs::remove_dir(folder);
        }
    })?;
    Ok(paths)
}

/// Fraction to which the slowest transient of the filter must have decayed.
/// 60 dB below the start. Chosen, not measured.
const REMAINDER: f64 = 1e-3;

/// `alpha + Vt v1 - Ut r` of the known excitations.
fn expected(factors: &CoprimeFactors<Discrete>, record: &LoopRecord) -> Result<Option<Mat<f64>>> {
    let outside = match (record.input_excitation(), record.reference()) {
        (None, None) => None,
        (v1, r) => {
            let none = |channels| Mat::zeros(record.samples(), channels);
            let (no_v1, no_r) = (none(factors.inputs()), none(factors.outputs()));
            let v2 = Scale(-1.0) * r.unwrap_or(no_r.as_ref());
            Some(factors.alpha_of_excitation(v1.unwrap_or(no_v1.as_ref()), v2.as_ref())?)
        }
    };
    Ok(match (record.alpha(), outside) {
        (Some(alpha), Some(outside)) => Some(alpha + outside),
        (Some(alpha), None) => Some(alpha.to_owned()),
        (None, outside) => outside,
    })
}
