//! `youla excite`: an excitation for a machine that runs under its controller.

mod text;

use crate::output::{Failure, Form, lines_of};
use crate::run_folder::{folder_of, place};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use youla_io::export::SequenceFormat;
use youla_loop::excite::{ExcitationNotch, ExciteOptions, InputOrder, Length, Shape};
use youla_run::{ExcitationPort, RunSettings, excite_run, write_excitation};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla excite run.toml --amplitude 0.5 --band 20,400 --duration 4 --limit-output 30
  youla excite run.toml --shape prbs --amplitude 0.5 --band 20,400 --duration 4 --ramp 0.2 --notch-rpm 2500 --to csv,c,mat
  youla excite run.toml --amplitude 0.5 --band 20,400 --duration 4 --noise 0.2 --damping-deviation 0.002
                                               how well the modes will be known, and how long it takes to know them so well";

/// Arguments of `youla excite`.
#[derive(Debug, Args)]
pub(crate) struct ExciteArgs {
    /// Settings, as for `identify`; the data files need not exist where [data] states the sample time.
    #[arg(value_name = "RUN.TOML")]
    settings: PathBuf,
    /// Shape of the sequence.
    #[arg(long, value_enum, default_value = "multisine")]
    shape: ShapeName,
    /// Greatest absolute value in the unit of the input; one for all inputs, or one each, separated by commas.
    #[arg(long, value_name = "A", required = true, value_delimiter = ',', allow_negative_numbers = true)]
    amplitude: Vec<f64>,
    /// Lowest and highest frequency, Hz.
    #[arg(
        long,
        value_name = "LOW,HIGH",
        required = true,
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    band: Vec<f64>,
    /// Length in seconds.
    #[arg(
        long,
        value_name = "S",
        required_unless_present = "samples",
        conflicts_with = "samples",
        allow_negative_numbers = true
    )]
    duration: Option<f64>,
    /// Length in samples.
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Seed; the same seed gives the same sequence.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time in which the amplitude grows at the start and falls at the end, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    ramp: f64,
    /// Keep once and twice this speed free, in revolutions per minute.
    #[arg(long, value_name = "RPM", conflicts_with = "notch_hz", allow_negative_numbers = true)]
    notch_rpm: Option<f64>,
    /// Keep once and twice this speed free, in Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    notch_hz: Option<f64>,
    /// Width of each band that is kept free, Hz.
    #[arg(long, value_name = "HZ", default_value_t = 4.0, allow_negative_numbers = true)]
    notch_width: f64,
    /// Excite one input after the other; else all at a time with independent signals.
    #[arg(long)]
    one_at_a_time: bool,
    /// Periods of a multisine or PRBS within the length.
    #[arg(long, value_name = "N", default_value_t = 1)]
    periods: usize,
    /// Where it enters; by default where run.toml declares an excitation, else alpha for observer gains and input for other controllers.
    #[arg(long, value_enum)]
    port: Option<PortName>,
    /// Largest predicted magnitude of the outputs; one for all, or one each.
    #[arg(long, value_name = "Y", value_delimiter = ',', allow_negative_numbers = true)]
    limit_output: Vec<f64>,
    /// Largest predicted magnitude of the inputs; one for all, or one each.
    #[arg(long, value_name = "U", value_delimiter = ',', allow_negative_numbers = true)]
    limit_input: Vec<f64>,
    /// Scale an excitation that would pass a limit to one that just keeps it; else it is refused.
    #[arg(long)]
    scale_to_limit: bool,
    /// Relative error of the nominal model for which the prediction is repeated.
    #[arg(long, value_name = "THETA", default_value_t = 0.1, allow_negative_numbers = true)]
    model_error: f64,
    /// Standard deviation of the white noise of the outputs; one for all, or one each.
    #[arg(
        long,
        value_name = "N",
        value_delimiter = ',',
        conflicts_with = "noise_record",
        allow_negative_numbers = true
    )]
    noise: Vec<f64>,
    /// A log of the running machine without excitation, with the outputs of run.toml, to take the noise from.
    #[arg(long, value_name = "LOG")]
    noise_record: Option<PathBuf>,
    /// Standard deviation of the damping ratios that is wanted: says how long it takes. Needs --noise or --noise-record.
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    damping_deviation: Option<f64>,
    /// csv, c, mat, separated by commas.
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', default_value = "csv", value_parser = format)]
    to: Vec<SequenceFormat>,
    /// Folder for alpha.csv, alpha.h and alpha.mat; made if need be.
    #[arg(long, value_name = "DIR", default_value = "excite", value_parser = place())]
    out: PathBuf,
    /// Replace the files if there are any.
    #[arg(long)]
    force: bool,
}

/// A shape on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ShapeName {
    /// Square waves of random length.
    Square,
    /// Pseudo-random binary sequence.
    Prbs,
    /// Sum of sines with a low crest.
    Multisine,
    /// Sine of rising frequency.
    Chirp,
}

/// A port on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum PortName {
    /// u = F xh + alpha
    Alpha,
    /// u = K y + alpha
    Input,
}

fn format(name: &str) -> Result<SequenceFormat, String> {
    let found = SequenceFormat::ALL.into_iter().find(|format| format.key() == name);
    found.ok_or_else(|| "there is no such format; known are csv, c, mat".to_owned())
}

/// Makes the excitation, writes its files and says what it does.
pub(crate) fn make(form: Form, args: &ExciteArgs) -> Result<(), Failure> {
    let folder = folder_of(&args.settings);
    let settings = RunSettings::read(&args.settings)?;
    let port = args.port.map(|port| match port {
        PortName::Alpha => ExcitationPort::Alpha,
        PortName::Input => ExcitationPort::Input,
    });
    youla_io::folder::require_place(&args.out.join("alpha.csv"))?;
    let found = excite_run(&settings, &folder, &options(args)?, port, args.noise_record.as_deref())?;
    let files = write_excitation(&found, &args.to, &args.out, args.force)?;
    let about = || {
        let mut about = serde_json::json!(found.excited.summary);
        about["port"] = serde_json::json!(found.port);
        about["cautions"] = serde_json::json!(found.cautions);
        about["files"] = files.iter().map(|path| path.display().to_string()).collect();
        about
    };
    form.print(about, || format!("{}\n{}", text::of(&found), lines_of(&files)))
}

fn options(args: &ExciteArgs) -> Result<ExciteOptions, Failure> {
    let [low, high] = args.band[..] else {
        let what = "the number of frequencies of --band".into();
        return Err(youla::Error::Ports { what, expected: 2, found: args.band.len() }.into());
    };
    let speed = args.notch_hz.or(args.notch_rpm.map(|rpm| rpm / 60.0));
    Ok(ExciteOptions {
        shape: match args.shape {
            ShapeName::Square => Shape::Square,
            ShapeName::Prbs => Shape::Prbs,
            ShapeName::Multisine => Shape::Multisine,
            ShapeName::Chirp => Shape::Chirp,
        },
        amplitude: args.amplitude.clone(),
        band: [low, high],
        length: match (args.samples, args.duration) {
            (Some(samples), _) => Length::Samples(samples),
            (None, seconds) => Length::Seconds(seconds.unwrap_or(0.0)),
        },
        seed: args.seed,
        ramp: args.ramp,
        notch: speed.map(|hz| ExcitationNotch { width: args.notch_width, ..ExcitationNotch::at(hz) }),
        inputs: if args.one_at_a_time { InputOrder::OneAtATime } else { InputOrder::Together },
        periods: args.periods,
        limit_input: args.limit_input.clone(),
        limit_output: args.limit_output.clone(),
        scale_to_limit: args.scale_to_limit,
        model_error: args.model_error,
        noise: args.noise.clone(),
        damping_deviation: args.damping_deviation,
    })
}
