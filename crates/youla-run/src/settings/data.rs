//! `[data]`: files, channels, clock, and what is taken out of the records.

use super::disturbance::DisturbanceSettings;
use crate::Result;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use youla::error::short;
use youla::signal::Detrend;
use youla_io::{ChannelRef, ChannelSpec, CsvOptions, Gaps, TimeSource};

/// Records and the meaning of their channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSettings {
    /// Sample time in seconds; this or `time_column` must be given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_time: Option<f64>,
    /// Column with the time in seconds; with `sample_time` both must agree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_column: Option<ChannelRef>,
    /// What to do with a file whose time column has gaps.
    #[serde(default)]
    pub gaps: Gaps,
    /// Plant inputs u as applied, after saturation.
    pub inputs: Vec<ChannelSpec>,
    /// Measured plant outputs y.
    pub outputs: Vec<ChannelSpec>,
    /// Known excitation added at the plant input, one channel per input.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub input_excitation: Vec<ChannelSpec>,
    /// Known reference r, one channel per output.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reference: Vec<ChannelSpec>,
    /// Known excitation alpha of Fig. 3, one channel per input; not together with `input_excitation`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alpha: Vec<ChannelSpec>,
    /// Channels computed row by row, `name = "expression"` of columns and of each other; used by their names wherever a column is.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub computed: BTreeMap<String, String>,
    /// How text files are read.
    #[serde(default)]
    pub csv: CsvOptions,
    /// What is removed from every channel before identification and verification.
    #[serde(default)]
    pub detrend: Detrend,
    /// Lines of known frequency in the outputs, as of unbalance; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disturbance: Option<DisturbanceSettings>,
    /// Records to identify from; several files are several experiments.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimation: Vec<DataFile>,
    /// A measured response instead of estimation records: a table with the columns `hz` and, for each output y and excitation d,
    /// `y/d re` and `y/d im` (or `abs` or `dB` with `deg`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub response: Vec<DataFile>,
    /// Records to verify on: no model is fitted to them. Where they differ from the model its region is wider, and they may decide between two models.
    #[serde(default)]
    pub verification: Vec<DataFile>,
}

impl DataSettings {
    /// Channels and estimation records, everything else by default.
    pub fn new(inputs: Vec<ChannelSpec>, outputs: Vec<ChannelSpec>, estimation: Vec<DataFile>) -> Self {
        DataSettings {
            sample_time: None,
            time_column: None,
            gaps: Gaps::default(),
            inputs,
            outputs,
            input_excitation: Vec::new(),
            reference: Vec::new(),
            alpha: Vec::new(),
            computed: BTreeMap::new(),
            csv: CsvOptions::default(),
            detrend: Detrend::default(),
            disturbance: None,
            estimation,
            response: Vec::new(),
            verification: Vec::new(),
        }
    }
}

/// One file, or a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataFile {
    /// Path, relative to run.toml.
    pub file: PathBuf,
    /// Samples skipped at the start.
    #[serde(default)]
    pub skip: usize,
    /// Samples used after that; all when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub take: Option<usize>,
    /// First and last row (counted from 1) of each stretch to use, as records of their own; instead of `skip` and `take`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<[usize; 2]>,
    /// Name in reports; the file's name when absent. Several records of one file are numbered: `name-1`, `name-2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

impl DataFile {
    /// The first contradiction in its segments, in words.
    fn problem(&self) -> Option<String> {
        let name = self.file.display();
        if !self.segments.is_empty() && (self.skip > 0 || self.take.is_some()) {
            return Some(format!("{name} has both segments and skip or take; give one of them"));
        }
        let mut last = 0;
        for [from, to] in &self.segments {
            if *from <= last || to < from {
                return Some(format!(
                    "{name}: segments must be pairs [first, last] of rows counted from 1, in order and without overlap, but \
                     [{from}, {to}] is not"
                ));
            }
            last = *to;
        }
        None
    }

    fn stem(&self) -> String {
        let name = self.file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        name.split('.').next().unwrap_or_default().to_owned()
    }
}

/// Files with their names in reports.
fn labelled<'a>(files: &[&'a DataFile]) -> Vec<(String, &'a DataFile)> {
    let unnamed = |stem: &str| files.iter().filter(|f| f.name.is_none() && f.stem() == stem).count();
    let mut counted: HashMap<String, usize> = HashMap::new();
    let mut label = |file: &DataFile| {
        let stem = match &file.name {
            Some(name) => return name.clone(),
            None => file.stem(),
        };
        let number = counted.entry(stem.clone()).or_default();
        *number += 1;
        if unnamed(&stem) > 1 { format!("{stem}-{number}") } else { stem }
    };
    files.iter().map(|file| (label(file), *file)).collect()
}

impl DataSettings {
    /// The estimation files, then the verification files, with their names in reports and in summary.json: the declared one, else that
    /// of the file. Entries of one file without declared names are numbered.
    pub(crate) fn labelled(&self) -> Vec<(String, &DataFile)> {
        labelled(&self.estimation.iter().chain(&self.verification).collect::<Vec<_>>())
    }

    /// Inputs, outputs, input excitation, reference and alpha.
    pub(crate) fn groups(&self) -> [&Vec<ChannelSpec>; 5] {
        [&self.inputs, &self.outputs, &self.input_excitation, &self.reference, &self.alpha]
    }

    /// The clock of the files.
    pub(crate) fn clock(&self) -> TimeSource {
        TimeSource { column: self.time_column.clone(), ts: self.sample_time, gaps: self.gaps, ..TimeSource::default() }
    }

    /// Whether an excitation or a reference is known.
    pub(crate) fn excitation_is_known(&self) -> bool {
        !(self.alpha.is_empty() && self.input_excitation.is_empty() && self.reference.is_empty())
    }

    /// Checks what the types do not: that there are records with names of their own, a clock, and channels of matching numbers.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`].
    pub fn check(&self) -> Result<()> {
        super::refuse(self.problem(), Path::new("run.toml"))
    }

    pub(super) fn problem(&self) -> Option<String> {
        self.record_problem()
            .or_else(|| self.channel_problem())
            .or_else(|| crate::settings::computed::problem(self))
            .or_else(|| self.clock_problem())
    }

    fn clock_problem(&self) -> Option<String> {
        let ts = self.sample_time.unwrap_or(1.0);
        let fits = ts > 0.0 && ts.is_finite();
        let interpolated = |c: &&ChannelSpec| c.sampled_every.is_some_and(|step| !(step > 0.0 && step.is_finite()));
        let others = [&self.inputs, &self.input_excitation, &self.reference, &self.alpha];
        let other = others.into_iter().flatten().find(|c| c.sampled_every.is_some());
        (!fits)
            .then(|| format!("[data] sample_time is {ts}, but must be a positive number of seconds"))
            .or_else(|| {
                let c = self.outputs.iter().find(interpolated)?;
                Some(format!("[data] sampled_every of {:?} must be a positive number of seconds", short(&c.name)))
            })
            .or_else(|| {
                let name = short(&other?.name);
                Some(format!("[data] sampled_every of {name:?} has no meaning: outputs alone are interpolated"))
            })
    }

    fn record_problem(&self) -> Option<String> {
        let d = self;
        if d.sample_time.is_none() && d.time_column.is_none() {
            return Some("[data] has neither sample_time nor time_column; the sample time is never guessed".into());
        }
        if let Some(problem) = self.response_problem() {
            return Some(problem);
        }
        if d.estimation.is_empty() && d.response.is_empty() {
            let text = "[data] names no estimation record; add [[data.estimation]] with a file, or [[data.response]] with a table";
            return Some(text.into());
        }
        if d.gaps == Gaps::Split && d.time_column.is_none() {
            return Some("[data] gaps = \"split\" needs a time_column, which shows the gaps".into());
        }
        if let Some(problem) = d.estimation.iter().chain(&d.verification).find_map(DataFile::problem) {
            return Some(problem);
        }
        let mut labels = HashSet::new();
        for (label, _) in d.labelled() {
            if label.is_empty() || label.contains(['/', '\\']) || label.contains(char::is_control) {
                return Some(format!("the record name {label:?} cannot be a file name; give another `name`"));
            }
            if !labels.insert(label.clone()) {
                return Some(format!("two records are named {label:?}; give one of them another `name`"));
            }
        }
        None
    }

    fn response_problem(&self) -> Option<String> {
        let file = self.response.first()?;
        if !self.estimation.is_empty() {
            return Some("[data] has both estimation records and a response; give one of them".into());
        }
        if self.response.len() > 1 {
            return Some("[data] has more than one response; join their columns or rows in one table".into());
        }
        if self.sample_time.is_none() {
            let text = "[data] has no sample_time, which a response does not show: that of the controller that samples the plant";
            return Some(text.into());
        }
        if file.skip > 0 || file.take.is_some() || !file.segments.is_empty() {
            let file = file.file.display();
            return Some(format!(
                "[[data.response]] {file} has skip, take or segments, which count samples; leave out rows of the table"
            ));
        }
        None
    }

    fn channel_problem(&self) -> Option<String> {
        let d = self;
        let mut names = HashSet::new();
        if let Some(twice) = d.groups().into_iter().flatten().find(|c| !names.insert(&c.name)) {
            return Some(format!("[data] has more than one channel named {:?}", twice.name));
        }
        for (key, channels) in [("inputs", &d.inputs), ("outputs", &d.outputs)] {
            if channels.is_empty() {
                return Some(format!("[data] {key} is empty, but must list at least one channel"));
            }
        }
        if let Some(problem) = self.role_problem() {
            return Some(problem);
        }
        if !d.alpha.is_empty() && !d.input_excitation.is_empty() {
            return Some("[data] has both alpha and input_excitation; give the one that was injected".into());
        }
        for (key, channels, of, wanted) in [
            ("input_excitation", &d.input_excitation, "inputs", d.inputs.len()),
            ("alpha", &d.alpha, "inputs", d.inputs.len()),
            ("reference", &d.reference, "outputs", d.outputs.len()),
        ] {
            if !channels.is_empty() && channels.len() != wanted {
                let found = channels.len();
                return Some(format!("[data] {key} must list as many channels as {of} ({wanted}), but lists {found}"));
            }
        }
        if let Some(problem) = d.disturbance.as_ref().and_then(DisturbanceSettings::problem) {
            return Some(problem.into());
        }
        None
    }
    /// A column with two roles. Signals from outside may share one, as a reference that is fed forward does; u and y are signals of their own.
    /// Of several inputs one may be its own excitation: no controller drives it.
    fn role_problem(&self) -> Option<String> {
        let mut plant = HashSet::new();
        let groups = ["inputs", "outputs", "input_excitation", "reference", "alpha"].into_iter().zip(self.groups());
        for (key, channels) in groups {
            let of_plant = key == "inputs" || key == "outputs";
            let may_be_own = key == "input_excitation" && self.inputs.len() > 1;
            for (k, channel) in channels.iter().enumerate() {
                let own = may_be_own && self.inputs.get(k).is_some_and(|input| input.source() == channel.source());
                if plant.contains(&channel.source()) && !own {
                    let (name, column) = (short(&channel.name), short(&channel.source().to_string()));
                    return Some(format!(
                        "[data] {key} takes {name:?} from the column {column:?}, which is an input or output already; choose the column of its \
                         own signal, or leave {key} out"
                    ));
                }
                if of_plant {
                    plant.insert(channel.source());
                }
            }
        }
        None
    }
}
