//! `youla rig`: a machine that speaks youla-link, over UDP.

use crate::output::{Failure, Form, say, say_wrapped};
use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Value, json};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use youla::ErrorKind;
use youla_io::export::ExportedController;
use youla_rig::{Answer, LogReport, Pace, Phase, Recorder, Request, Rig, Source, rotor, serve, settings};

const EXAMPLES: &str = "\
Example:
  youla rig record udp://127.0.0.1:4000 --out log.csv --duration 10 --excite 0.5
  youla identify run.toml                      the run.toml beside the log";

/// The verbs of a rig.
#[derive(Debug, Subcommand)]
pub(crate) enum RigCommand {
    /// Play a machine: two lightly damped modes under a controller, sampled at 20 kHz.
    #[command(after_help = "Example:\n  youla rig twin --port 4000")]
    Twin(TwinArgs),
    /// Record a log and write the run.toml beside it, with or without an excitation.
    ///
    /// Each row is in the log or reported missing. The guard of the machine ends the excitation where a limit is exceeded; the log goes on.
    #[command(after_help = EXAMPLES)]
    Record(RecordArgs),
    /// Print name, phase and guard of a machine.
    #[command(after_help = "Example:\n  youla rig status udp://127.0.0.1:4000")]
    Status {
        /// Address of the machine, udp://HOST:PORT.
        address: String,
    },
    /// Load Q of a redesign, and switch to it with --switch.
    #[command(
        after_help = "Example:\n  youla rig load udp://127.0.0.1:4000 runs/rotor-001/8-redesign/controller.json --switch"
    )]
    Load {
        /// Address of the machine, udp://HOST:PORT.
        address: String,
        /// `8-redesign/controller.json` of a redesign by Q.
        controller: PathBuf,
        /// Switch to it at once.
        #[arg(long)]
        switch: bool,
    },
    /// Stop the excitation, and with --release go back to Q = 0.
    #[command(after_help = "Example:\n  youla rig stop udp://127.0.0.1:4000 --release")]
    Stop {
        /// Address of the machine, udp://HOST:PORT.
        address: String,
        /// Q = 0.
        #[arg(long)]
        release: bool,
    },
}

/// Arguments of `youla rig twin`.
#[derive(Debug, Args)]
pub(crate) struct TwinArgs {
    /// UDP port on this machine; 0 takes a free one.
    #[arg(long, default_value_t = 4000)]
    port: u16,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How it takes its time.
    #[arg(long, value_enum, default_value = "real-time")]
    pace: PaceName,
    /// End after so many seconds.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
}

/// How a twin takes its time.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum PaceName {
    /// 20 000 samples each second
    RealTime,
    /// 20 samples for each request
    LockStep,
}

/// Arguments of `youla rig record`.
#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    /// Address of the machine, udp://HOST:PORT.
    address: String,
    /// The log, CSV.
    #[arg(long, value_name = "LOG.CSV")]
    out: PathBuf,
    /// Seconds.
    #[arg(long, value_name = "S")]
    duration: f64,
    /// Excite with a pseudo-random binary sequence of this amplitude at alpha.
    #[arg(long, value_name = "A")]
    excite: Option<f32>,
    /// Samples of each value of the sequence.
    #[arg(long, value_name = "N", default_value_t = 4, requires = "excite")]
    hold: u16,
    /// Take everything but [data] of the run.toml beside the log from this one.
    #[arg(long, value_name = "RUN.TOML")]
    settings: Option<PathBuf>,
    /// Replace an existing log and run.toml.
    #[arg(long)]
    force: bool,
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
        RigCommand::Status { address } => {
            let mut rig = Rig::connect(address)?;
            let answer = rig.ask(&Request::Alive)?;
            say_status(form, &rig, &answer)
        }
        RigCommand::Load { address, controller, switch } => load(form, address, controller, *switch),
        RigCommand::Stop { address, release } => {
            let mut rig = Rig::connect(address)?;
            let mut answer = rig.ask(&Request::Stop)?;
            if *release {
                answer = rig.ask(&Request::ReleaseQ)?;
            }
            say_status(form, &rig, &answer)
        }
    }
}

fn seconds(name: &str, value: f64) -> Result<Duration, Failure> {
    let duration = Duration::try_from_secs_f64(value).ok().filter(|duration| !duration.is_zero());
    duration.ok_or_else(|| refused(format!("{name} {value}: give a time above 0 in seconds")))
}

fn twin(form: Form, args: &TwinArgs) -> Result<(), Failure> {
    let until = args.duration.map(|value| seconds("--duration", value)).transpose()?;
    let mut machine = rotor(args.seed)?;
    let socket = UdpSocket::bind(("127.0.0.1", args.port))
        .map_err(|e| refused(format!("--port {}: {e}; choose another port", args.port)))?;
    let place = socket.local_addr().map_err(|e| refused(e.to_string()))?;
    if !form.quiet {
        say(&format!("udp://{place}"))?;
    }
    let pace = match args.pace {
        PaceName::RealTime => Pace::RealTime(Duration::from_micros(50)),
        PaceName::LockStep => Pace::LockStep,
    };
    let begin = Instant::now();
    Ok(serve(&socket, &mut machine, pace, || until.is_some_and(|until| begin.elapsed() >= until))?)
}

fn record(form: Form, args: &RecordArgs) -> Result<(), Failure> {
    let duration = seconds("--duration", args.duration)?;
    let run_file = args.out.with_file_name("run.toml");
    for path in [&args.out, &run_file] {
        if path.exists() && !args.force {
            return Err(refused(format!("{} exists already; choose another --out or add --force", path.display())));
        }
    }
    let read = |path: &PathBuf| std::fs::read_to_string(path).map_err(|e| Failure::io(path, e));
    let base = args.settings.as_ref().map(read).transpose()?;
    let mut rig = Rig::connect(&args.address)?;
    let mut recorder = Recorder::create(&args.out, rig.description(), rig.schema())?;
    // Settings that cannot be read are refused before the experiment.
    settings(rig.description(), "log.csv", 1, base.as_deref())?;
    if let Some(amplitude) = args.excite {
        rig.ask(&Request::Arm)?;
        rig.ask(&Request::Start { source: Source::Prbs { order: 18, hold: args.hold }, amplitude })?;
    }
    let begin = Instant::now();
    while let Some(left) = duration.checked_sub(begin.elapsed()).filter(|left| !left.is_zero()) {
        rig.record(&mut recorder, left.min(Duration::from_millis(100)))?;
        // A sign of life for the guard.
        rig.ask(&Request::Alive)?;
    }
    let last = rig.ask(&if args.excite.is_some() { Request::Stop } else { Request::Alive })?;
    // What was on its way; the rows of the machine's next frame are not sent yet.
    rig.record(&mut recorder, Duration::from_millis(100))?;
    let end = recorder.end(last.sample);
    let report = recorder.finish(end)?;
    let log = args.out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = settings(rig.description(), &log, report.rows, base.as_deref())?;
    std::fs::write(&run_file, text).map_err(|e| Failure::io(&run_file, e))?;
    say_report(form, &report, &args.out, &run_file)
}

fn say_report(form: Form, report: &LogReport, log: &Path, run: &Path) -> Result<(), Failure> {
    let frames = &report.frames;
    if form.json {
        let trips: Vec<Value> = report.trips.iter().map(|(sample, trip)| trip_as_json(*sample, trip)).collect();
        return say(&json!({
            "log": log, "run": run, "rows": report.rows, "missing": report.missing, "gaps": report.gaps,
            "frames": { "taken": frames.taken, "lost": frames.lost, "doubled": frames.doubled,
                "reordered": frames.reordered, "stale": frames.stale },
            "damaged": report.damaged, "foreign": report.foreign, "trips": trips,
        })
        .to_string());
    }
    if form.quiet {
        return Ok(());
    }
    let mut text = format!(
        "{}: {} rows, {} missing in {} gaps. Frames: {} taken, {} lost, {} doubled, {} reordered, {} stale, {} damaged, {} foreign.",
        log.display(),
        report.rows,
        report.missing,
        report.gaps.len(),
        frames.taken,
        frames.lost,
        frames.doubled,
        frames.reordered,
        frames.stale,
        report.damaged,
        report.foreign
    );
    for (sample, trip) in &report.trips {
        text +=
            &format!("\nThe guard ended the excitation at sample {sample}: {} (channel {}).", trip.cause, trip.channel);
    }
    say_wrapped(&format!("{text}\nSettings: {}", run.display()))
}

fn trip_as_json(sample: u64, trip: &youla_rig::Trip) -> Value {
    json!({ "sample": sample, "cause": trip.cause.to_string(), "channel": trip.channel })
}

fn say_status(form: Form, rig: &Rig, answer: &Answer) -> Result<(), Failure> {
    let status = answer.status;
    let phase = match status.phase() {
        Phase::Idle => "idle",
        Phase::Armed => "armed",
        Phase::Exciting => "exciting",
        Phase::Tripped => "tripped",
    };
    if form.json {
        let trip = status.trip().map(|trip| json!({ "cause": trip.cause.to_string(), "channel": trip.channel }));
        return say(&json!({
            "name": rig.description().name, "sample_time": rig.description().sample_time, "sample": answer.sample,
            "phase": phase, "trip": trip, "bank": status.bank(),
        })
        .to_string());
    }
    if form.quiet {
        return Ok(());
    }
    let trip = status.trip().map_or(String::new(), |trip| format!(": {} (channel {})", trip.cause, trip.channel));
    let q = if status.bank() == 0 { "Q = 0".to_owned() } else { format!("Q of bank {}", status.bank()) };
    say_wrapped(&format!("{}: sample {}, {phase}{trip}, {q}", rig.description().name, answer.sample))
}

fn load(form: Form, address: &str, path: &Path, switch: bool) -> Result<(), Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| Failure::io(path, e))?;
    let exported: ExportedController =
        serde_json::from_str(&text).map_err(|e| refused(format!("{}: {e}", path.display())))?;
    let mut rig = Rig::connect(address)?;
    let coefficients = coefficients(&exported, &rig).map_err(|why| refused(format!("{}: {why}", path.display())))?;
    let mut answer = rig.load_q(&coefficients)?;
    if switch {
        answer = rig.ask(&Request::SwitchQ)?;
    }
    say_status(form, &rig, &answer)
}

/// A, B and C of Q by rows, filled up with zeros to the order of the machine's banks.
fn coefficients(exported: &ExportedController, rig: &Rig) -> Result<Vec<f32>, String> {
    let machine = rig.description();
    let q = exported.q.as_ref().ok_or("it holds no Q; redesign with method = \"youla\"")?;
    let order = machine.q_order.ok_or("the machine states no q_order: it takes no Q")?;
    let (inputs, outputs) = (machine.inputs.len(), machine.outputs.len());
    let width = |rows: &[Vec<f64>], columns: usize| rows.iter().all(|row| row.len() == columns);
    let of_machine = q.c.len() == inputs && width(&q.b, outputs) && q.b.len() == q.a.len();
    if q.a.len() > order || !of_machine {
        return Err(format!(
            "Q has {} states, {} outputs; the machine takes {order} states at most, {inputs} outputs and {outputs} inputs",
            q.a.len(),
            q.c.len()
        ));
    }
    if q.d.iter().flatten().any(|d| *d != 0.0) {
        return Err("Q has a feedthrough, which needs the measurement before the command".into());
    }
    if (exported.ts / machine.sample_time - 1.0).abs() > 1e-6 {
        return Err(format!("Q is for {} s, the machine samples each {} s", exported.ts, machine.sample_time));
    }
    let padded = |rows: &[Vec<f64>], height: usize, columns: usize| -> Vec<f32> {
        let entry = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).map_or(0.0, |value| *value as f32);
        (0..height * columns).map(|k| entry(k / columns, k % columns)).collect()
    };
    Ok([padded(&q.a, order, order), padded(&q.b, order, outputs), padded(&q.c, inputs, order)].concat())
}
