//! `youla rig`: a machine that speaks youla-link, over UDP or a serial line.

mod load;
mod record;
mod twin;

use crate::output::{Failure, Form};
use clap::Subcommand;
use load::{LoadArgs, load};
use record::{ExciteArgs, RecordArgs, excite, record};
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;
use twin::{TwinArgs, twin};
use youla::ErrorKind;
use youla_rig::{Answer, Phase, Request, Rig, write_key};

const ADDRESS: &str = "Address of the machine, udp://HOST:PORT or serial:DEVICE[@BAUD], with ,key=FILE behind it for a machine with a key.";

const KEY_EXAMPLES: &str = "\
Examples:
  youla rig key rig.key
  youla rig twin --key rig.key
  youla rig status udp://127.0.0.1:4000,key=rig.key";

/// The verbs of a rig.
#[derive(Debug, Subcommand)]
pub(crate) enum RigCommand {
    /// Simulate a machine over UDP: a rotor at 20 kHz, or the loop of a file around the gas bearing or an identified model.
    #[command(after_help = twin::EXAMPLES)]
    Twin(TwinArgs),
    /// Record a log without an excitation, and write the run.toml beside it.
    ///
    /// Each row is in the log or reported missing.
    #[command(after_help = record::RECORD_EXAMPLE)]
    Record(RecordArgs),
    /// Excite the machine, record the log, and write the run.toml beside it.
    ///
    /// Each row is in the log or reported missing. The guard of the machine ends the excitation where a limit is exceeded; the recording continues.
    #[command(after_help = record::EXCITE_EXAMPLES)]
    Excite(ExciteArgs),
    /// Print name, phase and guard of a machine.
    #[command(after_help = "Example:\n  youla rig status udp://127.0.0.1:4000")]
    Status {
        #[arg(help = ADDRESS)]
        address: String,
    },
    /// Load a Q, and switch to it with --switch.
    #[command(after_help = load::EXAMPLES)]
    Load(LoadArgs),
    /// Stop the excitation, and with --release go back to Q = 0.
    #[command(after_help = "Example:\n  youla rig stop udp://127.0.0.1:4000 --release")]
    Stop {
        #[arg(help = ADDRESS)]
        address: String,
        /// Q = 0.
        #[arg(long)]
        release: bool,
    },
    /// Make the file of a key that a machine and its hosts share.
    #[command(after_help = KEY_EXAMPLES)]
    Key {
        /// The new file: 64 hexadecimal digits, readable by its owner.
        file: PathBuf,
    },
}

impl From<youla_rig::Error> for Failure {
    fn from(error: youla_rig::Error) -> Self {
        refused(error.to_string())
    }
}

fn refused(sentence: String) -> Failure {
    Failure::Refused(sentence, ErrorKind::BadInput)
}

pub(crate) fn run(form: Form, command: &RigCommand) -> Result<(), Failure> {
    match command {
        RigCommand::Twin(args) => twin(form, args),
        RigCommand::Record(args) => record(form, args),
        RigCommand::Excite(args) => excite(form, args),
        RigCommand::Status { address } => {
            let mut rig = Rig::connect(address)?;
            let answer = rig.ask(&Request::Alive)?;
            say_status(form, &rig, &answer)
        }
        RigCommand::Load(args) => load(form, args),
        RigCommand::Stop { address, release } => {
            let (mut rig, mut answer) = Rig::stop(address)?;
            if *release {
                answer = rig.ask(&Request::ReleaseQ)?;
            }
            say_status(form, &rig, &answer)
        }
        RigCommand::Key { file } => {
            write_key(file)?;
            form.print(
                || json!({ "key": file }),
                || {
                    format!(
                        "{}: a new key. Give it to the machine, and to its hosts as ,key={}",
                        file.display(),
                        file.display()
                    )
                },
            )
        }
    }
}

fn seconds(name: &str, value: f64) -> Result<Duration, Failure> {
    let duration = Duration::try_from_secs_f64(value).ok().filter(|duration| !duration.is_zero());
    duration.ok_or_else(|| refused(format!("{name} {value}: give a time above 0 in seconds")))
}

fn say_status(form: Form, rig: &Rig, answer: &Answer) -> Result<(), Failure> {
    let status = answer.status;
    let phase = match status.phase() {
        Phase::Idle => "idle",
        Phase::Armed => "armed",
        Phase::Exciting => "exciting",
        Phase::Tripped => "tripped",
    };
    let machine = rig.description();
    let json = || {
        let trip = status.trip().map(|trip| json!({ "cause": trip.cause.to_string(), "channel": trip.channel }));
        json!({
            "name": machine.name, "sample_time": machine.sample_time, "sample": answer.sample,
            "phase": phase, "trip": trip, "bank": status.bank(),
        })
    };
    let text = || {
        let trip = status.trip().map_or(String::new(), |trip| format!(": {} (channel {})", trip.cause, trip.channel));
        let q = if status.bank() == 0 { "Q = 0".to_owned() } else { format!("Q of bank {}", status.bank()) };
        format!("{}: sample {}, {phase}{trip}, {q}", machine.name, answer.sample)
    };
    form.print(json, text)
}
