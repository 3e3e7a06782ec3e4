//! The command line.

use crate::output::Form;
use crate::run_folder::{OutputFolder, place};
use crate::{check, commission, compare, excite, export, identify, init, paper, plot, rig, synchronise, workbench};
use clap::{Parser, Subcommand};
use std::path::PathBuf;

/// Identifies a machine while its controller keeps running.
#[derive(Debug, Parser)]
#[command(name = "youla", version, after_help = EXAMPLES)]
pub(crate) struct Args {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// How results are printed.
    #[command(flatten)]
    pub(crate) form: Form,
}

const EXAMPLES: &str = "\
Examples:
  youla demo                                   simulate a levitated mass under feedback and identify it
  youla init log.csv                           list the columns of a log, ask what they mean, write run.toml
  youla check run.toml                         check the data before you identify from them
  youla synchronise rates.csv motors.csv --time t --input u --output y --sample-time 0.0025
                                               a log whose channels have time stamps of their own
  youla identify run.toml                      identify a logged machine, write runs/<name>-001
  youla identify run.toml --out result --json  the same to a chosen folder, summary on standard output
  youla excite run.toml --amplitude 0.5 --band 20,400 --duration 4 --limit-output 30
                                               an excitation for the running machine that keeps its limits
  youla signals run.toml --out signals         alpha and beta as CSV, to go on in another tool
  youla report runs/demo-levitated-mass-001       draw the report of a run again from its data
  youla plot runs/demo-levitated-mass-001 bode --width 8.5
                                               figures for a paper, from the same data
  youla compare runs/before-001 runs/after-001 two runs side by side
  youla export runs/demo-levitated-mass-001 --to python
                                               the model as a script for python-control; also npz, matlab, C99
  youla paper                                  the whole paper: 500 models, three experiments, every figure

Exit codes: 0 done, 1 `check` found a defect, 2 the input cannot be used, 3 the computation is impossible on this input.";

/// The verbs.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Simulate a machine under feedback and identify it: a loop in which direct identification fails.
    ///
    /// The default machine, a levitated mass, is unstable, and most of its input is fed-back sensor noise: a direct model from
    /// input to output claims a stable plant, the Hansen scheme finds the unstable pole. With `--machine bearing`, the gas bearing
    /// of the paper with less noise, both work.
    #[command(after_help = "Example:\n  youla demo --seed 7 --out demo-run\n  youla demo --machine bearing")]
    Demo {
        /// Seed of excitation and noise; the same seed gives the same result.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// The machine to simulate.
        #[arg(long, value_enum, default_value = "levitation")]
        machine: Machine,
        #[command(flatten)]
        output: OutputFolder,
    },
    /// Write a first run.toml for a log.
    ///
    /// Lists the columns of the file, asks for what the flags do not state (on a terminal), and writes a commented run.toml. Nothing is
    /// guessed: what is not stated is left out, and `identify` names the missing line.
    #[command(after_help = init::EXAMPLES)]
    Init(init::InitArgs),
    /// Bring channels with their own time stamps to the clock of the controller.
    ///
    /// For logs whose channels are in files of their own or in rows with empty cells: stamps that scatter, dropped samples, channels that are
    /// written when they change, sensors with clocks of their own. Prints rate, scatter, gaps and delay of each channel and what was filled.
    #[command(after_help = synchronise::EXAMPLES)]
    Synchronise(synchronise::SynchroniseArgs),
    /// Check the data before you identify from them.
    ///
    /// With a run.toml all its records are checked, also against the declared controller; otherwise files with --input and
    /// --output. Nothing is changed, and nothing is written without --out.
    #[command(after_help = check::EXAMPLES)]
    Check(check::CheckArgs),
    /// Identify a machine from records of its closed loop.
    ///
    /// Channels, sample time and controller are enough: method, order, dead time and noise model are chosen by the
    /// evidence of the records. They are stated in a run.toml or, for a plain log, by flags.
    #[command(after_help = identify::EXAMPLES)]
    Identify(Box<identify::IdentifyArgs>),
    /// Draw report.html of a run again from its report.json.
    #[command(after_help = "Example:\n  youla report runs/demo-levitated-mass-001")]
    Report {
        /// A run folder.
        #[arg(value_name = "RUN")]
        run: PathBuf,
    },
    /// Draw figures of a run for papers: SVG, and the numbers as CSV.
    ///
    /// Without FIGURE, the figures of the run are listed. Sizes are those on paper; text is 9 points at every size. Every SVG
    /// file contains the same font.
    #[command(after_help = plot::EXAMPLES)]
    Plot(plot::PlotArgs),
    /// Compare finished runs on one page: models, modes, distances, fits, settings.
    #[command(after_help = compare::EXAMPLES)]
    Compare(compare::CompareArgs),
    /// Write a model, or the controller with its ports alpha and beta, for another tool: MATLAB, NumPy, python-control, C99.
    #[command(after_help = export::EXAMPLES)]
    Export(export::ExportArgs),
    /// Write alpha, beta, eta and epsilon of every estimation record as CSV.
    #[command(after_help = "Example:\n  youla signals examples/qube/run.toml --out qube-signals")]
    Signals {
        /// Settings, as for `identify`.
        #[arg(value_name = "RUN.TOML")]
        settings: PathBuf,
        /// Folder for one CSV file per record; made if need be.
        #[arg(long, value_name = "DIR", default_value = "signals", value_parser = place())]
        out: PathBuf,
    },
    /// Design an excitation for the machine under its controller and predict the response of the nominal loop.
    ///
    /// The sequence goes to the port alpha of the controller, or to the plant input. The nominal loop predicts its effect: limits of
    /// inputs and outputs are checked, and the accuracy of the modes is predicted.
    #[command(after_help = excite::EXAMPLES)]
    Excite(Box<excite::ExciteArgs>),
    /// Commission a controller on the twin of the gas bearing: excite, record, identify, redesign, switch and verify at each operating point.
    ///
    /// An interrupted campaign resumes. It ends at the first point whose model is not trusted, whose new controller is not
    /// certified or confirmed, or whose verification is worse than predicted; alpha and Q are then zero, and the exit code is 1.
    #[command(after_help = commission::EXAMPLES)]
    Commission(commission::CommissionArgs),
    /// Record a machine that speaks youla-link, read its status, load Q, or simulate such a machine.
    #[command(subcommand)]
    Rig(rig::RigCommand),
    /// Write the workbench, one HTML file that does all of this in a browser, and open it.
    ///
    /// The file needs no network and sends nothing: logs are dropped on it, the method runs in the page.
    #[command(after_help = workbench::EXAMPLES)]
    Workbench(workbench::WorkbenchArgs),
    /// Print the JSON schema of run.toml, for editors.
    #[command(
        after_help = "Example:\n  youla schema > run.schema.json\n\nand, as the first line of run.toml: #:schema run.schema.json"
    )]
    Schema,
    /// Reproduce the paper: the study of 500 models, the experiments of Table 1, every figure, one page.
    ///
    /// Results are written to the folder as they are computed. The same command continues an interrupted run.
    #[command(after_help = paper::EXAMPLES)]
    Paper(Box<paper::PaperArgs>),
    /// What is done with the parts of `youla paper --shard`.
    #[command(subcommand)]
    Study(paper::StudyCommand),
}

/// The machines that can be simulated.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub(crate) enum Machine {
    /// A levitated mass, unstable, under a PD controller with strong sensor noise
    Levitation,
    /// The gas bearing of the paper, 2 x 2, with a nominal model of half the true A
    Bearing,
}

impl From<Machine> for youla_twin::DemoMachine {
    fn from(machine: Machine) -> Self {
        match machine {
            Machine::Levitation => youla_twin::DemoMachine::Levitation,
            Machine::Bearing => youla_twin::DemoMachine::Bearing,
        }
    }
}
