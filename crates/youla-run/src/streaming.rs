//! Subspace identification straight from files that need not fit into memory: what `youla subspace` does.

use crate::folder::artefacts::{ModelFile, Provenance, SCHEMA};
use crate::folder::subspace_details::{LongDetails, SubspaceDetails};
use crate::folder::to_value;
use crate::records::SourceFile;
use crate::settings::{SubspaceTable, parse_table};
use crate::{Error, Result};
use faer::MatMut;
use serde_json::Value;
use std::path::PathBuf;
use youla::identify::subspace::{SubspaceModel, SubspaceOptions, subspace_stream};
use youla::lti::Discrete;
use youla::signal::Channel;
use youla::signal::{JoinedStreams, SampleStream};
use youla_io::{ChannelRef, ChannelSpec, CsvOptions, CsvStream, NpyStream, TimeSource, is_npy, sha256};

/// Files, channels and clock.
#[derive(Debug, Clone)]
pub struct LongRecords {
    /// One experiment each, all of the same form: text (plain or gzip), or NumPy `.npy` of samples x channels.
    pub files: Vec<PathBuf>,
    /// The inputs; in a `.npy` file by number.
    pub inputs: Vec<ChannelRef>,
    /// The outputs.
    pub outputs: Vec<ChannelRef>,
    /// Sample time, or for text files the column with the time.
    pub time: TimeSource,
    /// Form of text files.
    pub csv: CsvOptions,
}

/// A model from long records.
#[derive(Debug, Clone)]
pub struct LongModel {
    /// The model with its evidence.
    pub found: SubspaceModel,
    /// Channels of the inputs.
    pub inputs: Vec<Channel>,
    /// Channels of the outputs.
    pub outputs: Vec<Channel>,
    /// Samples over all experiments.
    pub samples: u64,
    /// Passes over the files.
    pub passes: usize,
}

/// Where a reading is: pass (counted from 1) and samples read in it.
#[derive(Debug, Clone, Copy)]
pub struct ReadingProgress {
    /// Number of the pass.
    pub pass: usize,
    /// Samples read in it.
    pub samples: u64,
}

/// Identifies a model from files in memory that does not depend on their length; `watch` receives every piece that is read.
///
/// # Errors
/// As [`subspace_stream`], [`CsvStream::open`] and [`NpyStream::open`]; [`youla::Error::SampleTimeMismatch`] where files differ,
/// [`youla_io::Error::SampleTimeMissing`] for `.npy` files without a sample time.
pub fn identify_long(
    records: &LongRecords,
    options: &SubspaceOptions,
    watch: &mut (dyn FnMut(ReadingProgress) + Send),
) -> Result<LongModel> {
    let (parts, times): (Vec<_>, Vec<_>) =
        records.files.iter().map(|file| open(records, file)).collect::<Result<Vec<_>>>()?.into_iter().unzip();
    let joined = JoinedStreams::new(parts)?;
    let time = times[0];
    if let Some((file, other)) = records.files.iter().zip(&times).find(|(_, other)| **other != time) {
        let what = format!("{} and {}", records.files[0].display(), file.display());
        return Err(Error::Method(youla::Error::SampleTimeMismatch { what, left: time.ts(), right: other.ts() }));
    }
    let mut stream = Watched { inner: joined, watch, at: ReadingProgress { pass: 0, samples: 0 } };
    let found = subspace_stream(&mut stream, time, options)?;
    let named = |chosen: &[ChannelRef]| chosen.iter().map(|c| Channel::new(c.to_string(), "")).collect();
    let (inputs, outputs) = (named(&records.inputs), named(&records.outputs));
    Ok(LongModel { found, inputs, outputs, samples: stream.at.samples, passes: stream.at.pass })
}

/// The model as an artefact, with SHA-256 of the files (which takes a pass over each) and the options as `[direct]` of run.toml has them.
///
/// # Errors
/// [`youla_io::Error::Io`]; [`youla::Error::NoConvergence`] of the poles.
pub fn long_model_file(
    model: &LongModel,
    records: &LongRecords,
    options: &SubspaceOptions,
) -> Result<ModelFile<Value>> {
    let source = |file: &PathBuf| {
        Ok(SourceFile { path: file.display().to_string(), purpose: "estimation".into(), sha256: sha256(file)? })
    };
    let provenance = Provenance {
        schema: SCHEMA,
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        seed: None,
        sources: records.files.iter().map(source).collect::<Result<_>>()?,
        options: to_value(&SubspaceTable::from(options.clone()))?,
    };
    let subspace = SubspaceDetails::from(&model.found);
    let details = to_value(&LongDetails { subspace, fit: &model.found.fit, samples: model.samples })?;
    let ports = (model.inputs.clone(), model.outputs.clone());
    Ok(ModelFile::new("subspace", &model.found.model, ports, details, provenance)?)
}

/// Reads options for the identification from a TOML file.
///
/// # Errors
/// [`youla_io::Error::MissingFile`], [`youla_io::Error::Io`], [`youla_io::Error::Settings`] with the place of what is wrong.
pub fn read_subspace_options(path: impl AsRef<std::path::Path>) -> Result<SubspaceOptions> {
    let path = path.as_ref();
    parse_subspace_options(&youla_io::read_text(path)?, path)
}

/// Parses the text of such a file; `path` is named in errors.
///
/// # Errors
/// [`youla_io::Error::Settings`] with line, column and key.
pub fn parse_subspace_options(text: &str, path: &std::path::Path) -> Result<SubspaceOptions> {
    let refused = |problem: &str| {
        let (path, problem) = (path.to_owned(), problem.to_owned());
        Error::File(youla_io::Error::Settings { path, at: None, problem })
    };
    parse_table::<SubspaceTable>(text, path, "direct")?.try_into().map_err(refused)
}

fn open(records: &LongRecords, file: &PathBuf) -> Result<(Box<dyn SampleStream>, Discrete)> {
    if is_npy(file)? {
        let Some(ts) = records.time.ts else {
            return Err(Error::File(youla_io::Error::SampleTimeMissing { what: file.display().to_string() }));
        };
        return Ok((Box::new(NpyStream::open(file, &records.inputs, &records.outputs)?), Discrete::new(ts)?));
    }
    let (u, y) = (ChannelSpec::chosen(&records.inputs), ChannelSpec::chosen(&records.outputs));
    let stream = CsvStream::open(file, &u, &y, &records.time, &records.csv)?;
    let time = stream.time();
    Ok((Box::new(stream), time))
}

/// A stream that reports how far it has been read.
struct Watched<'a, S> {
    inner: S,
    watch: &'a mut (dyn FnMut(ReadingProgress) + Send),
    at: ReadingProgress,
}

impl<S: SampleStream> SampleStream for Watched<'_, S> {
    fn inputs(&self) -> usize {
        self.inner.inputs()
    }

    fn outputs(&self) -> usize {
        self.inner.outputs()
    }

    fn rewind(&mut self) -> youla::Result<()> {
        self.at = ReadingProgress { pass: self.at.pass + 1, samples: 0 };
        self.inner.rewind()
    }

    fn read(&mut self, rows: MatMut<'_, f64>) -> youla::Result<usize> {
        let count = self.inner.read(rows)?;
        self.at.samples += count as u64;
        (self.watch)(self.at);
        Ok(count)
    }

    fn next_experiment(&mut self) -> youla::Result<bool> {
        self.inner.next_experiment()
    }
}
