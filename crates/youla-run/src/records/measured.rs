//! `[[data.response]]`: a measured response instead of estimation records.

use crate::records::SourceFile;
use crate::settings::{DataFile, DataSettings};
use crate::{Error, Result};
use std::path::Path;
use youla::identify::likelihood::{Evidence, MeasuredResponse, ResponseTable};
use youla::lti::{Discrete, FrequencyResponse, StateSpace, frequency_response};
use youla::signal::IndirectResponse;
use youla::{Mat, c64};
use youla_io::{ChannelSpec, ResponseSignals, read_response, sha256};

/// Largest part of the inputs that the stated controller may leave, errors of the response included.
const LARGEST_REST: f64 = 0.1;

/// A response as it was read.
#[derive(Debug, Clone)]
pub struct MeasuredTable {
    /// Name in reports.
    pub name: String,
    /// Frequencies, values and variances.
    pub table: ResponseTable,
    /// Whether it is that of the loop, from the excitation to inputs and outputs; else that of the plant.
    pub of_loop: bool,
    /// Where it came from.
    pub source: SourceFile,
}

impl MeasuredTable {
    /// As the estimation takes it.
    ///
    /// # Errors
    /// Those of [`MeasuredResponse::of_plant`] and [`MeasuredResponse::of_loop`].
    pub(crate) fn response(&self, time: Discrete) -> Result<MeasuredResponse> {
        let made = match self.of_loop {
            true => MeasuredResponse::of_loop(&self.table, time),
            false => MeasuredResponse::of_plant(&self.table, time),
        };
        made.map_err(|e| Error::from(e).within(format!("[[data.response]] {}", self.source.path)))
    }

    /// Root mean square of each input and output over the frequencies, for excitations of size one.
    pub(crate) fn sizes(&self, inputs: usize) -> (Vec<f64>, Vec<f64>) {
        let rows = self.table.values.first().map_or(0, Mat::nrows);
        let size = |i: usize| {
            let power = |value: &Mat<c64>| value.row(i).squared_norm_l2();
            let mean = self.table.values.iter().map(power).sum::<f64>() / self.table.values.len().max(1) as f64;
            if mean > 0.0 { mean.sqrt() } else { 1.0 }
        };
        let all: Vec<f64> = (0..rows).map(size).collect();
        match self.of_loop {
            true => (all[..inputs].to_vec(), all[inputs..].to_vec()),
            false => (vec![1.0; inputs], all),
        }
    }

    /// Whether a controller explains the inputs of a loop whose excitation is added to them, `T_u = I + K T_y`.
    ///
    /// # Errors
    /// A pole of the controller at a frequency of the table.
    pub(crate) fn controller(&self, controller: &StateSpace<Discrete>) -> Result<Option<Evidence>> {
        if !self.of_loop {
            return Ok(None);
        }
        let k = frequency_response(controller, &self.table.omega)?;
        let (mut rest, mut all) = (0.0, 0.0);
        for (t, k) in self.table.values.iter().zip(k.iter()) {
            let (m, p) = (k.nrows(), k.ncols());
            let fed_back = t.subrows(0, m) - Mat::<c64>::identity(m, m);
            rest += (&fed_back - k * t.subrows(m, p)).squared_norm_l2();
            all += t.subrows(0, m).squared_norm_l2();
        }
        let question = "Part of the inputs that the stated controller does not explain (controller)";
        Ok(Some(Evidence::new(question, (rest / all.max(f64::MIN_POSITIVE)).sqrt(), LARGEST_REST)))
    }

    /// The plant at its frequencies, as the figures show it; there is no coherence.
    ///
    /// # Errors
    /// Those of [`MeasuredTable::plant`].
    pub(crate) fn shown(&self) -> Result<IndirectResponse> {
        let response = self.plant()?;
        let (p, m) = (response.at(0).nrows(), response.at(0).ncols());
        let unknown = |columns: usize| Mat::from_fn(response.omega.len(), columns, |_, _| f64::NAN);
        Ok(IndirectResponse { coherence_y: unknown(p), coherence_u: unknown(m), segments: 0, response })
    }

    /// The plant, of a loop by the quotient `T_y T_u^-1`.
    ///
    /// # Errors
    /// [`youla::Error::Singular`] with the frequency at which the excitation does not reach all inputs.
    pub fn plant(&self) -> Result<FrequencyResponse> {
        Ok(self.table.plant(self.of_loop)?)
    }
}

/// Reads the response that the settings name.
///
/// # Errors
/// Those of [`read_response`].
pub(crate) fn read_measured(settings: &DataSettings, folder: &Path, file: &DataFile) -> Result<MeasuredTable> {
    let path = folder.join(&file.file);
    let names = |channels: &[ChannelSpec]| channels.iter().map(|c| c.source().to_string()).collect::<Vec<_>>();
    let excitations = [&settings.input_excitation, &settings.alpha, &settings.reference];
    let known = excitations.into_iter().find(|channels| channels.len() == settings.inputs.len());
    let signals = ResponseSignals {
        inputs: names(&settings.inputs),
        outputs: names(&settings.outputs),
        excitations: known.map_or_else(Vec::new, |d| names(d)),
    };
    let read = read_response(&path, &signals, &settings.csv).map_err(|e| e.within("[[data.response]]"))?;
    let stem = file.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(MeasuredTable {
        name: file.name.clone().unwrap_or(stem),
        table: read.table,
        of_loop: read.of_loop,
        source: SourceFile {
            path: file.file.display().to_string(),
            purpose: "response".into(),
            sha256: sha256(&path)?,
        },
    })
}
