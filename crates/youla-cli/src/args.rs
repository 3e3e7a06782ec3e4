//! The command line.

use clap::{Args as ClapArgs, Parser, Subcommand};
use std::path::PathBuf;

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
  youla demo                                   simulate the gas bearing of the paper and identify it
  youla identify run.toml                      identify a logged machine, write runs/<name>-001
  youla identify run.toml --out result --json  the same to a chosen folder, summary on standard output
  youla signals run.toml --out signals         alpha and beta as CSV, to go on in another tool
  youla report runs/demo-gas-bearing-001       draw the report of a run again from its data

Exit codes: 0 done, 2 the input cannot be used, 3 the computation is impossible on this input.";

/// The verbs.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
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
    /// Draw report.html of a run again from its report.json.
    #[command(after_help = "Example:\n  youla report runs/demo-gas-bearing-001")]
    Report {
        /// A run folder.
        #[arg(value_name = "RUN")]
        run: PathBuf,
    },
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
