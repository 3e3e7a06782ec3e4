//! An excitation for the machine of a run.toml: its loop, the sequence, the files.

use crate::Result;
use crate::records::{RunRecords, channels_of, read_records};
use crate::settings::RunSettings;
use crate::stages::factors::{DeclaredLoop, factorise};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use youla::control::{RunningController, with_input_port};
use youla::identify::likelihood::figure;
use youla::lti::{Discrete, Partitioned};
use youla::signal::Channel;
use youla::signal::{Detrend, LoopRecord, Record};
use youla_io::export::{SequenceFormat, export_sequence};
use youla_io::folder::replace_files;
use youla_io::{Format, Gaps, Source, TimeSource, read, require_free};
use youla_loop::excite::{ExciteOptions, Excited, LoopToExcite, PredictedPeak, excite, output_noise};

/// Where the excitation enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExcitationPort {
    /// The port alpha of Fig. 3, `u = F xh + alpha`: the observer of the controller knows of it.
    Alpha,
    /// The plant input, `u = K y + alpha`: the controller does not know of it.
    Input,
}

impl ExcitationPort {
    /// In words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            ExcitationPort::Alpha => "port alpha of the controller (u = F xh + alpha)",
            ExcitationPort::Input => "plant input (u = K y + alpha)",
        }
    }
}

/// An excitation for the machine of a run.
#[derive(Debug, Clone)]
pub struct RunExcitation {
    /// Name of the machine.
    pub name: String,
    /// Where it enters.
    pub port: ExcitationPort,
    /// Names and units of the columns: those that run.toml declares for this port, else `alpha_<input>`.
    pub columns: Vec<Channel>,
    /// The inputs of the plant.
    pub inputs: Vec<Channel>,
    /// Its outputs.
    pub outputs: Vec<Channel>,
    /// The excitation.
    pub excited: Excited,
    /// Channels that it is predicted to move far beyond what the records show of them, where these were read.
    pub cautions: Vec<String>,
}

/// A predicted magnitude above so many times that in the records is most likely a wrong unit. Chosen, not measured.
const BEYOND: f64 = 10.0;

/// Makes an excitation for the machine that `settings` describe, in the loop of its nominal model; paths are relative to `folder`.
///
/// Without a `port`, it enters where run.toml declares an excitation (`input_excitation`, `alpha`); where it declares none, at the port
/// alpha of a controller that is given by its observer gains, else at the plant input. The data files are read only where they hold
/// what is needed: the sample time if `[data] sample_time` does not state it, and the weights of the factors of a controller that is not
/// given by its gains, for its port alpha. With `quiet`, a record without excitation, the noise is taken from that
/// ([`output_noise`]).
///
/// # Errors
/// As [`excite`]; whatever is wrong with nominal model, controller and the files that are read.
pub fn excite_run(
    settings: &RunSettings,
    folder: &Path,
    options: &ExciteOptions,
    port: Option<ExcitationPort>,
    quiet: Option<&Path>,
) -> Result<RunExcitation> {
    let (time, records) = sample_time(settings, folder)?;
    let declared = DeclaredLoop::new(settings, folder, time)?;
    let port = port.unwrap_or_else(|| usual_port(settings, &declared.running));
    let (inputs, outputs) = (channels_of(&settings.data.inputs), channels_of(&settings.data.outputs));
    let ported = ported(settings, folder, &declared, port)?;
    let on =
        LoopToExcite { nominal: declared.required_nominal()?, controller: &ported, inputs: &inputs, outputs: &outputs };
    let mut options = options.clone();
    if let Some(file) = quiet {
        options.noise = noise_of(settings, &on, file).map_err(|e| e.within(file.display().to_string()))?;
    }
    let excited = excite(&on, &options)?;
    let channels = match port {
        ExcitationPort::Alpha => &settings.data.alpha,
        ExcitationPort::Input => &settings.data.input_excitation,
    };
    let columns = match &channels[..] {
        [] => inputs.iter().map(|c| Channel::new(format!("alpha_{}", c.name), &c.unit)).collect(),
        channels => channels_of(channels),
    };
    let cautions = records.map_or(Vec::new(), |records| beyond(&excited, &records.estimation));
    Ok(RunExcitation { name: settings.name.clone(), port, columns, inputs, outputs, excited, cautions })
}

/// The predicted magnitudes that are far above those of the records.
fn beyond(excited: &Excited, records: &[LoopRecord]) -> Vec<String> {
    let logged = |j: usize, of: &LoopRecord| {
        let (u, y) = (of.u(), of.y());
        if j < u.ncols() { u.col(j).norm_max() } else { y.col(j - u.ncols()).norm_max() }
    };
    let of = |(j, predicted): (usize, &PredictedPeak)| {
        let most = records.iter().map(|of| logged(j, of)).fold(0.0, f64::max);
        let (peak, label) = (figure(predicted.peak), predicted.channel.label());
        let caution = || {
            format!(
                "{label} is predicted to reach {peak}, in the log it reaches {}: check --amplitude and its unit",
                figure(most)
            )
        };
        (most > 0.0 && predicted.peak > BEYOND * most).then(caution)
    };
    excited.summary.predicted.iter().enumerate().filter_map(of).collect()
}

/// The sample time, and the records where they were read for it.
fn sample_time(settings: &RunSettings, folder: &Path) -> Result<(Discrete, Option<RunRecords>)> {
    match settings.data.sample_time {
        Some(ts) => Ok((Discrete::new(ts)?, None)),
        None => {
            let part = "[data] states no sample_time, and the records, which would show it, cannot be read";
            read_records(&settings.data, folder)
                .map(|records| (records.time, Some(records)))
                .map_err(|e| e.within(part))
        }
    }
}

fn usual_port(settings: &RunSettings, controller: &RunningController) -> ExcitationPort {
    match (settings.data.input_excitation.is_empty(), settings.data.alpha.is_empty(), controller.gains().is_some()) {
        (false, ..) | (true, true, false) => ExcitationPort::Input,
        (true, false, _) | (true, true, true) => ExcitationPort::Alpha,
    }
}

/// The controller with the port, `(y, alpha)` to `(u, ..)`.
fn ported(
    settings: &RunSettings,
    folder: &Path,
    declared: &DeclaredLoop,
    port: ExcitationPort,
) -> Result<Partitioned<Discrete>> {
    if port == ExcitationPort::Input {
        return Ok(with_input_port(declared.controller())?);
    }
    let nominal = declared.required_nominal()?;
    let sizes = match declared.running.gains() {
        // The factors of observer gains do not depend on them.
        Some(_) => (vec![1.0; nominal.inputs()], vec![1.0; nominal.outputs()]),
        None => {
            let part = "the port alpha of a controller without observer gains rests on the estimation records (or take the port input)";
            read_records(&settings.data, folder).map_err(|e| e.within(part))?.sizes()
        }
    };
    Ok(factorise((nominal, &declared.running), sizes, &settings.factors)?.factors.j_k()?)
}

fn noise_of(settings: &RunSettings, on: &LoopToExcite, file: &Path) -> Result<Vec<f64>> {
    let data = &settings.data;
    let source = Source {
        path: file.to_owned(),
        format: Format::Detect,
        time: TimeSource { gaps: Gaps::default(), ..data.clock() },
        channels: data.outputs.clone(),
        csv: data.csv.clone(),
    };
    let record = read(&source)?.detrend(Detrend::Mean)?.record;
    Ok(output_noise(on, record.data())?)
}

impl RunExcitation {
    /// The sequence as a record named `alpha`.
    ///
    /// # Errors
    /// [`youla::Error::DuplicateChannel`] where two columns have one name.
    pub fn record(&self) -> Result<Record> {
        Ok(Record::new("alpha", self.columns.clone(), self.excited.alpha.clone(), self.excited.time)?)
    }

    /// What the comments of the files say.
    pub fn about(&self) -> Vec<String> {
        let s = &self.excited.summary;
        let [low, high] = s.band;
        let mut lines = vec![
            format!("Excitation of {}, at the {}.", self.name, self.port.words()),
            format!("{}, {low} to {high} Hz, {}, seed {}.", s.shape, s.independence, s.seed),
            format!("{} samples of {:?} s, {:.4} s.", s.samples, s.sample_time, s.duration),
        ];
        lines.extend(s.filter.iter().map(|how| {
            let bands: Vec<String> =
                s.notches.iter().map(|n| format!("{:.2} to {:.2} Hz", n.band[0], n.band[1])).collect();
            format!("Kept free: {} ({how}).", bands.join(", "))
        }));
        lines
    }
}

/// Writes `alpha` in the formats asked for to `folder`, which is made if need be.
///
/// # Errors
/// [`youla_io::Error::FileExists`] for a file that is there, unless `replace` is set; then nothing is written. [`youla_io::Error::Io`],
/// and those of [`export_sequence`].
pub fn write_excitation(
    found: &RunExcitation,
    formats: &[SequenceFormat],
    folder: &Path,
    replace: bool,
) -> Result<Vec<PathBuf>> {
    let record = found.record()?;
    let about = found.about();
    let mut files = Vec::new();
    for format in formats {
        files.push((format!("alpha.{}", format.extension()), export_sequence(&record, *format, &about)?));
    }
    files.iter().try_for_each(|(name, _)| require_free(&folder.join(name), replace, &[]))?;
    Ok(replace_files(folder, &files)?)
}
