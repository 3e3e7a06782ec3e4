//! The command line.

use crate::dialect::Dialect;
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use youla_io::ChannelRef;
use youla_paper::study::{Method, Shard, StartCase};
use youla_run::Feedback;

/// Identifies a machine while its controller keeps running.
#[derive(Debug, Parser)]
#[command(name = "youla", version, after_help = EXAMPLES)]
pub(crate) struct Args {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print nothing but errors.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Print the result as JSON (the contents of summary.json) instead of a table.
    #[arg(long, global = true, conflicts_with = "quiet")]
    pub(crate) json: bool,
}

const EXAMPLES: &str = "\
Examples:
  youla paper                                  the whole paper: 500 models, three experiments, every figure
  youla demo                                   simulate the gas bearing of the paper and identify it
  youla init log.csv                           list the columns of a log, ask what they mean, write run.toml
  youla check run.toml                         say what is wrong with the data, before anything is identified
  youla identify run.toml                      identify a logged machine, write runs/<name>-001
  youla identify run.toml --out result --json  the same to a chosen folder, summary on standard output
  youla excite run.toml --amplitude 0.5 --band 20,400 --duration 4 --limit-output 30
                                               an excitation for the running machine that keeps its limits
  youla signals run.toml --out signals         alpha and beta as CSV, to go on in another tool
  youla subspace long.npy --input '#1' --output '#2' --sample-time 1e-4
                                               a model straight from a file of any length
  youla report runs/demo-gas-bearing-001       draw the report of a run again from its data
  youla plot runs/demo-gas-bearing-001 bode --width 8.5
                                               figures for a paper, from the same data
  youla compare runs/before-001 runs/after-001 two runs side by side
  youla export runs/demo-gas-bearing-001 --to python
                                               the model as a script for python-control; also npz, matlab, C99

Exit codes: 0 done, 1 `check` found a defect, 2 the input cannot be used, 3 the computation is impossible on this input.";

/// The verbs.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Reproduce the paper: the study of 500 models, the experiments of Table 1, every figure, one page.
    ///
    /// Results stream to the folder as they are found. A run that was stopped, at whatever moment, goes on where it was when
    /// the same command is given again.
    #[command(after_help = PAPER_EXAMPLES)]
    Paper(Box<PaperArgs>),
    /// Count how often searches arrive, or put together a study of the paper that was computed in parts.
    #[command(subcommand)]
    Study(StudyCommand),
    /// Simulate the gas bearing in closed loop with a nominal model that is half wrong, and identify it.
    #[command(after_help = "Example:\n  youla demo --seed 7 --out demo-run")]
    Demo {
        /// Seed of excitation and noise; the same seed gives the same result.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        #[command(flatten)]
        output: OutputFolder,
    },
    /// Identify a machine from records of its closed loop.
    #[command(after_help = "Example:\n  youla identify examples/flexible-drive/run.toml --out drive-run")]
    Identify {
        /// Settings: records, channels, nominal model, controller, options.
        #[arg(value_name = "RUN.TOML")]
        settings: PathBuf,
        #[command(flatten)]
        output: OutputFolder,
    },
    /// Write a first run.toml for a log.
    ///
    /// Lists the columns of the file, asks what the flags do not say (on a terminal), and writes a commented run.toml. Nothing is
    /// guessed: what stays open is left out, and `identify` names the line.
    #[command(after_help = INIT_EXAMPLES)]
    Init(InitArgs),
    /// Say what is wrong with the data before anything is identified from them.
    ///
    /// With a run.toml all its records are checked, also against the declared controller; otherwise files with --input and
    /// --output. Nothing is changed, and nothing is written without --out.
    #[command(after_help = CHECK_EXAMPLES)]
    Check(CheckArgs),
    /// Write alpha, beta, eta and epsilon of every estimation record as CSV.
    #[command(after_help = "Example:\n  youla signals examples/qube/run.toml --out qube-signals")]
    Signals {
        /// Settings, as for `identify`.
        #[arg(value_name = "RUN.TOML")]
        settings: PathBuf,
        /// Folder for one CSV file per record; made if need be.
        #[arg(long, value_name = "DIR", default_value = "signals")]
        out: PathBuf,
    },
    /// Identify a model from u to y by subspace identification, straight from files of any length.
    ///
    /// The files are read in two passes, three where the data ask for QR, in memory that does not depend on their length.
    #[command(after_help = SUBSPACE_EXAMPLES)]
    Subspace(SubspaceArgs),
    /// Print the JSON schema of run.toml, for editors.
    #[command(
        after_help = "Example:\n  youla schema > run.schema.json\n\nand, as the first line of run.toml: #:schema run.schema.json"
    )]
    Schema {
        /// Print the reference of all keys in Markdown instead.
        #[arg(long)]
        markdown: bool,
    },
    /// Print the completions of a shell.
    #[command(after_help = "Example:\n  source <(youla completions bash)")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the man page.
    #[command(after_help = "Example:\n  youla man > ~/.local/share/man/man1/youla.1")]
    Man,
    /// Draw report.html of a run again from its report.json.
    #[command(after_help = "Example:\n  youla report runs/demo-gas-bearing-001")]
    Report {
        /// A run folder.
        #[arg(value_name = "RUN")]
        run: PathBuf,
    },
    /// Draw figures of a run for papers: SVG, PNG, and the numbers as CSV.
    ///
    /// Without a figure the figures that the run has are listed. Sizes are those on paper; text has 9 points in every size. SVG and PNG
    /// hold the same font on every machine.
    #[command(after_help = crate::plot::EXAMPLES)]
    Plot(crate::plot::PlotArgs),
    /// Hold finished runs against each other: models, modes, distances, fits, settings, on one page.
    #[command(after_help = crate::compare::EXAMPLES)]
    Compare(crate::compare::CompareArgs),
    /// Write a model, or the controller with its ports alpha and beta, for another tool: MATLAB, NumPy, python-control, C99.
    #[command(after_help = crate::export::EXAMPLES)]
    Export(crate::export::ExportArgs),
    /// Write an excitation for the machine under its controller, with what the nominal loop will do under it.
    ///
    /// The sequence goes to the port alpha of the controller, or to the plant input. It is held against limits of inputs and outputs by
    /// the nominal model, and says how well it will determine the modes.
    #[command(after_help = crate::excite::EXAMPLES)]
    Excite(Box<crate::excite::ExciteArgs>),
}

const SUBSPACE_EXAMPLES: &str = "\
Example:
  youla subspace log.csv.gz --input u --output x,y --time t
  youla subspace long.npy --input '#1,#2' --output '#3,#4' --sample-time 2e-4 --options options.toml --out model.json";

const CHECK_EXAMPLES: &str = "\
Example:
  youla check run.toml
  youla check log.csv --input u --output y --time t
  youla check log.csv --input u --output y --time t --delimiter semicolon --decimal comma
  youla check log.csv --input u --output y --excitation d --sample-time 1e-3 --json

Exit codes: 0 no defect, 1 a defect was found, 2 the input cannot be read, 3 a test could not be computed.";

const INIT_EXAMPLES: &str = "\
Example:
  youla init log.csv
  youla init log.csv --input u --output y --time t --reference r --feedback negative
  youla init arm.dat --input '#1' --output '#2' --sample-time 1 --open-loop --estimate 700";

/// What is known of a log.
#[derive(Debug, ClapArgs)]
pub(crate) struct InitArgs {
    /// The log: text, MATLAB, NumPy or Parquet.
    #[arg(value_name = "LOG")]
    pub(crate) log: PathBuf,
    /// Inputs of the plant, by name or as #3 for the third column, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) input: Vec<ChannelRef>,
    /// Outputs of the plant, as the inputs.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) output: Vec<ChannelRef>,
    /// Column with the time in seconds.
    #[arg(long, value_name = "NAME", conflicts_with = "sample_time")]
    pub(crate) time: Option<ChannelRef>,
    /// Sample time in seconds.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) sample_time: Option<f64>,
    /// Known excitation added at the plant input, one column per input.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) excitation: Vec<ChannelRef>,
    /// Known reference, one column per output.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) reference: Vec<ChannelRef>,
    /// Sign in which the controller that ran is written down: u = K (r - y) is negative.
    #[arg(long, value_name = "SIGN", conflicts_with = "open_loop")]
    pub(crate) feedback: Option<Sign>,
    /// No controller ran while this was logged.
    #[arg(long)]
    pub(crate) open_loop: bool,
    /// Rows to identify from, from the first on; two thirds unless stated. The rest verifies.
    #[arg(long, value_name = "ROWS")]
    pub(crate) estimate: Option<usize>,
    /// Name of the machine; the name of the file unless stated.
    #[arg(long)]
    pub(crate) name: Option<String>,
    #[command(flatten)]
    pub(crate) dialect: Dialect,
    /// File to write.
    #[arg(long, value_name = "FILE", default_value = "run.toml")]
    pub(crate) out: PathBuf,
    /// Replace it if it is there.
    #[arg(long)]
    pub(crate) force: bool,
}

/// A sign of feedback on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Sign {
    /// u = K (r - y)
    Negative,
    /// u = K (y - r)
    Positive,
}

impl From<Sign> for Feedback {
    fn from(sign: Sign) -> Self {
        match sign {
            Sign::Negative => Feedback::Negative,
            Sign::Positive => Feedback::Positive,
        }
    }
}

/// What is to be checked.
#[derive(Debug, ClapArgs)]
pub(crate) struct CheckArgs {
    /// A run.toml; or, with --input and --output, text, MATLAB, NumPy or Parquet files, one record each.
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Inputs, by name or as #3 for the third column, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "output")]
    pub(crate) input: Vec<ChannelRef>,
    /// Outputs, as the inputs.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "input")]
    pub(crate) output: Vec<ChannelRef>,
    /// Known excitation added at the plant input, one per input.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "input")]
    pub(crate) excitation: Vec<ChannelRef>,
    /// Known reference, one per output.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "input")]
    pub(crate) reference: Vec<ChannelRef>,
    /// Sample time in seconds.
    #[arg(long, value_name = "S", requires = "input", allow_negative_numbers = true)]
    pub(crate) sample_time: Option<f64>,
    /// Column with the time in seconds.
    #[arg(long, value_name = "NAME", requires = "input")]
    pub(crate) time: Option<ChannelRef>,
    #[command(flatten)]
    pub(crate) dialect: Dialect,
    /// Thresholds, as in [check] of run.toml.
    #[arg(long, value_name = "FILE", requires = "input")]
    pub(crate) options: Option<PathBuf>,
    /// Folder for check.json; it must not exist.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Files, channels and clock of `subspace`.
#[derive(Debug, ClapArgs)]
pub(crate) struct SubspaceArgs {
    /// Text (plain or gzip) or NumPy .npy (samples x channels); several files are several experiments.
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Inputs, by name or as #3 for the third column, separated by commas.
    #[arg(long, value_name = "NAME", required = true, value_delimiter = ',')]
    pub(crate) input: Vec<ChannelRef>,
    /// Outputs, as the inputs.
    #[arg(long, value_name = "NAME", required = true, value_delimiter = ',')]
    pub(crate) output: Vec<ChannelRef>,
    /// Sample time in seconds.
    #[arg(long, value_name = "S", required_unless_present = "time", allow_negative_numbers = true)]
    pub(crate) sample_time: Option<f64>,
    /// Column with the time in seconds, for text files; with --sample-time both must agree.
    #[arg(long, value_name = "NAME")]
    pub(crate) time: Option<ChannelRef>,
    #[command(flatten)]
    pub(crate) dialect: Dialect,
    /// Options of the identification, as in [direct] of run.toml.
    #[arg(long, value_name = "FILE")]
    pub(crate) options: Option<PathBuf>,
    /// File for the model as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Where a run goes.
#[derive(Debug, ClapArgs)]
pub(crate) struct OutputFolder {
    /// Run folder to write; runs/<name>-<number> by default.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Replace the run folder given by --out if it is one.
    #[arg(long, requires = "out")]
    pub(crate) force: bool,
}

const PAPER_EXAMPLES: &str = "\
Examples:
  youla paper                          runs/paper-seed-1-models-500, about half a minute
  youla paper --models 20              a first look
  youla paper --shard 1/2 --out part1  half of the loops, here; the other half elsewhere, then
  youla study merge part1 part2        exactly what one run gives";

/// What is asked of the paper.
#[derive(Debug, ClapArgs)]
pub(crate) struct PaperArgs {
    /// Settings instead of those that ship with the program.
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Option<PathBuf>,
    /// Parameters of the rig instead of those that ship with the program.
    #[arg(long, value_name = "FILE")]
    pub(crate) rig: Option<PathBuf>,
    /// Seed of everything random; the same seed gives the same results. 1 unless the settings say otherwise.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Number of nominal models of the study; fewer than 100 get a coarse map. 500 unless the settings say otherwise.
    #[arg(long, value_name = "N")]
    pub(crate) models: Option<usize>,
    /// Methods that study and map compare, separated by commas.
    #[arg(long, value_delimiter = ',', value_parser = method)]
    pub(crate) methods: Option<Vec<Method>>,
    /// Speed of the first experiment.
    #[arg(long, allow_negative_numbers = true)]
    pub(crate) rpm: Option<f64>,
    /// Only this part of the loops of study and map, for example 2/4.
    #[arg(long, value_name = "I/N")]
    pub(crate) shard: Option<Shard>,
    /// Results folder; runs/paper-seed-S-models-N by default.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Write the settings that ship with the program to standard output, to be copied and edited, and do nothing else.
    #[arg(long, conflicts_with_all = ["settings", "rig", "seed", "models", "methods", "rpm", "shard", "out"])]
    pub(crate) print_settings: bool,
    /// The same for the parameters of the rig.
    #[arg(long, conflicts_with_all = ["print_settings", "settings", "rig", "seed", "models", "methods", "rpm", "shard", "out"])]
    pub(crate) print_rig: bool,
}

/// Studies beside the paper, and what is done with parts of its study.
#[derive(Debug, Subcommand)]
pub(crate) enum StudyCommand {
    /// Count how often the prediction-error method arrives, from which start: single, several, continued, or none.
    ///
    /// Results stream to the folder as they are found, and a run that was stopped goes on where it was.
    #[command(after_help = STARTS_EXAMPLES)]
    Starts(StartsArgs),
    /// Join the results folders of all shards and finish the paper from them.
    #[command(after_help = "Example:\n  youla study merge part1 part2 --out whole")]
    Merge {
        /// The results folders of all shards, in any order.
        #[arg(value_name = "PART", required = true)]
        parts: Vec<PathBuf>,
        /// Results folder; runs/paper-seed-S-models-N by default.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

const STARTS_EXAMPLES: &str = "\
Examples:
  youla study starts                                     all cases; 500 loops at each noise, 100 items of the others
  youla study starts --cases light-damping --items 20    a first look

Cases: loop-0.2, loop-1.0, light-damping, periodic, far-start, slow-squares.";

/// What is asked of the study of starts.
#[derive(Debug, ClapArgs)]
pub(crate) struct StartsArgs {
    /// Cases, separated by commas; all by default.
    #[arg(long, value_delimiter = ',', value_parser = case)]
    pub(crate) cases: Option<Vec<StartCase>>,
    /// Items of each case.
    #[arg(long, value_name = "N")]
    pub(crate) items: Option<usize>,
    /// Seed of everything random; the same seed gives the same results.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Results folder; runs/starts-seed-S by default.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

fn case(name: &str) -> Result<StartCase, String> {
    let known: Vec<&str> = StartCase::ALL.iter().map(|case| case.key()).collect();
    StartCase::of_key(name).ok_or_else(|| format!("there is no such case; known are {}", known.join(", ")))
}

fn method(name: &str) -> Result<Method, String> {
    let known: Vec<&str> = Method::ALL.iter().map(|method| method.key()).collect();
    Method::of_key(name).ok_or_else(|| format!("there is no such method; known are {}", known.join(", ")))
}
