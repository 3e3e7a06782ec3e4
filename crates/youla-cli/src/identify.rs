//! `youla identify`: from a run.toml, or straight from a log with flags.

use crate::log_flags::{LogFlags, Sign, specs};
use crate::output::Failure;
use crate::run_folder::{OutputFolder, folder_of};
use clap::Args;
use std::path::{Path, PathBuf};
use youla_run::{
    ControllerSettings, DataFile, DataSettings, Feedback, NominalModel, RunSettings, agreement, check_run,
    read_settings,
};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla identify examples/flexible-drive/run.toml --out drive-run
  youla identify log.csv --input u --output y --excitation d --sample-time 5e-4 --controller K.json --feedback positive

A model file is JSON with ts, a, b, c and d by rows; a MATLAB or NumPy file with the same names; or a model that `youla` wrote.
The controller may also be JSON as [controller] of run.toml:
  {\"pid\": {\"feedback\": \"negative\", \"discretisation\": \"tustin\", \"kp\": 2.0, \"ki\": 10.0}}";

/// What is to be identified.
#[derive(Debug, Args)]
pub(crate) struct IdentifyArgs {
    /// A run.toml; or, with --input and --output, text, MATLAB or NumPy files, one estimation record each.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    log: LogFlags,
    /// File with a nominal model, in discrete time, for comparison; the result does not rest on it.
    #[arg(long, value_name = "FILE", requires = "input")]
    nominal: Option<PathBuf>,
    /// File with the controller that ran: a model in discrete time, or JSON with what [controller] of run.toml holds.
    #[arg(long, value_name = "FILE", requires = "input", conflicts_with = "open_loop")]
    controller: Option<PathBuf>,
    /// Sign in which the model of the controller is written down; `youla` writes controllers as positive.
    #[arg(long, value_name = "SIGN", requires = "controller")]
    feedback: Option<Sign>,
    /// No controller ran.
    #[arg(long, requires = "input")]
    open_loop: bool,
    /// Time for the search of the model; then the best one found is kept, and the result says that the search was ended.
    #[arg(long, value_name = "SECONDS")]
    time_limit: Option<u32>,
    #[command(flatten)]
    pub(crate) output_folder: OutputFolder,
}

impl IdentifyArgs {
    /// The settings, and the folder to which their paths are relative.
    pub(crate) fn settings(&self) -> Result<(RunSettings, PathBuf), Failure> {
        let (mut settings, folder) = self.stated()?;
        settings.recommended.time_limit = self.time_limit.or(settings.recommended.time_limit);
        Ok((settings, folder))
    }

    fn stated(&self) -> Result<(RunSettings, PathBuf), Failure> {
        if !self.log.input.is_empty() {
            return Ok((self.of_log()?, PathBuf::new()));
        }
        let [settings] = &self.files[..] else {
            let what = "the number of run.toml files (give --input and --output for a log)".into();
            return Err(youla::Error::Ports { what, expected: 1, found: self.files.len() }.into());
        };
        Ok((read_settings(settings)?, folder_of(settings)))
    }

    fn of_log(&self) -> Result<RunSettings, Failure> {
        let file =
            |path: &PathBuf| DataFile { file: path.clone(), skip: 0, take: None, segments: Vec::new(), name: None };
        let log = &self.log;
        let data = DataSettings {
            sample_time: log.sample_time,
            time_column: log.time.clone(),
            input_excitation: specs(&log.excitation),
            reference: specs(&log.reference),
            csv: log.dialect.options(),
            ..DataSettings::new(specs(&log.input), specs(&log.output), self.files.iter().map(file).collect())
        };
        let zeros = |rows: usize, columns: usize| vec![vec![0.0; columns]; rows];
        let (m, p) = (data.inputs.len(), data.outputs.len());
        let name = self.files[0].file_stem().map_or_else(|| "log".to_owned(), |n| n.to_string_lossy().into_owned());
        let nominal = self.nominal.clone().map(|file| NominalModel::ModelFile { file, domain: None });
        let with = |controller| RunSettings {
            nominal: nominal.clone(),
            ..RunSettings::new(name.clone(), data.clone(), controller)
        };
        let controller = match &self.controller {
            Some(file) => self.controller_of(file, with)?,
            None if self.open_loop => ControllerSettings::StateSpace {
                feedback: Feedback::Positive,
                domain: None,
                hold: None,
                a: Vec::new(),
                b: Vec::new(),
                c: zeros(m, 0),
                d: zeros(m, p),
                delay: 0,
            },
            None => return Err(self.missing("--controller FILE, the controller that ran, or --open-loop")),
        };
        Ok(with(controller).checked()?)
    }

    /// A file with what `[controller]` of run.toml holds states its sign itself; a model needs the flag.
    fn controller_of(
        &self,
        file: &Path,
        with: impl Fn(ControllerSettings) -> RunSettings,
    ) -> Result<ControllerSettings, Failure> {
        let model = |feedback| ControllerSettings::ModelFile { feedback, file: file.to_owned() };
        let refuse = |problem| Err(youla_io::Error::Settings { path: file.to_owned(), at: None, problem }.into());
        match (ControllerSettings::from_json(file)?, self.feedback) {
            (None, Some(sign)) => Ok(model(sign.into())),
            (None, None) => {
                let agrees = agreement(|sign| check_run(&with(model(sign)), Path::new("")).ok());
                refuse(format!(
                    "the sign of this controller is not stated: add --feedback negative for u = K (r - y), or --feedback positive for \
                     u = K (y - r){agrees}"
                ))
            }
            (Some(controller), None) => Ok(controller),
            (Some(_), Some(_)) => refuse("this file states its `feedback` itself; leave --feedback out".into()),
        }
    }

    fn missing(&self, flag: &str) -> Failure {
        let path = self.files.first().map_or(Path::new(""), PathBuf::as_path).to_owned();
        youla_io::Error::Settings { path, at: None, problem: format!("a log needs {flag}") }.into()
    }
}
