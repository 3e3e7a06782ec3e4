//! `youla rig record` and `youla rig excite`: a log in which every row is there or reported missing, and its run.toml.

use super::{ADDRESS, refused, seconds};
use crate::output::{Failure, Form};
use crate::progress::Progress;
use crate::run_folder::place;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use youla_io::require_free_for_settings;
use youla_rig::{
    Answer, CsvLog, Error, LogReport, Outcome, Phase, PlotStream, Recorder, Request, Rig, RowSink, SequenceOrigin,
    settings,
};

pub(super) const RECORD_EXAMPLE: &str = "\
Example:
  youla rig record udp://127.0.0.1:4000 --out log.csv --duration 10";

pub(super) const EXCITE_EXAMPLES: &str = "\
Example:
  youla rig excite udp://127.0.0.1:4000 --amplitude 0.5 --out log.csv --duration 10
  youla identify run.toml                      the run.toml beside the log";

/// Time between two heartbeats, and between two states of the line of figures.
const BEAT: Duration = Duration::from_millis(100);

/// Arguments of `youla rig record`.
#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    #[arg(help = ADDRESS)]
    address: String,
    /// The log, a CSV file.
    #[arg(long, value_name = "LOG", value_parser = place())]
    out: PathBuf,
    /// Seconds.
    #[arg(long, value_name = "S")]
    duration: f64,
    /// Copy all settings except [data] from this file.
    #[arg(long, value_name = "RUN.TOML")]
    settings: Option<PathBuf>,
    /// Send the rows to PlotJuggler as well, as JSON over UDP, 1000 a second at most.
    #[arg(long, value_name = "HOST:PORT")]
    plotjuggler: Option<String>,
    /// Replace an existing log and run.toml.
    #[arg(long)]
    force: bool,
}

/// Arguments of `youla rig excite`.
#[derive(Debug, Args)]
pub(crate) struct ExciteArgs {
    #[command(flatten)]
    record: RecordArgs,
    /// Amplitude at alpha of a pseudo-random binary sequence, or factor of the machine's own sequence.
    #[arg(long, value_name = "A")]
    amplitude: f32,
    /// Samples of each value of the sequence.
    #[arg(long, value_name = "N", default_value_t = 4, conflicts_with = "own")]
    hold: u16,
    /// Play the sequence that the machine holds.
    #[arg(long)]
    own: bool,
}

pub(super) fn record(form: Form, args: &RecordArgs) -> Result<(), Failure> {
    recorded(form, args, None)
}

pub(super) fn excite(form: Form, args: &ExciteArgs) -> Result<(), Failure> {
    let source = if args.own { SequenceOrigin::Own } else { SequenceOrigin::Prbs { order: 18, hold: args.hold } };
    if !(args.amplitude > 0.0 && args.amplitude.is_finite()) {
        return Err(refused(format!("--amplitude is {}, but must be positive", args.amplitude)));
    }
    recorded(form, &args.record, Some(Request::Start { source, amplitude: args.amplitude }))
}

fn recorded(form: Form, args: &RecordArgs, start: Option<Request<'_>>) -> Result<(), Failure> {
    let duration = seconds("--duration", args.duration)?;
    let run_file = args.out.with_file_name("run.toml");
    for path in [&args.out, &run_file, &CsvLog::part_path(&args.out, 2)] {
        require_free_for_settings(path, args.force, &args.settings.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
    }
    let base = args.settings.as_deref().map(youla_io::read_text).transpose()?;
    let mut rig = Rig::connect(&args.address)?;
    // Settings that cannot be read are refused before the experiment.
    settings(rig.description(), "log.csv", 1, base.as_deref())?;
    let mut recorder = recorder(args, &run_file, &rig)?;
    let begun = match &start {
        None => Ok(()),
        Some(start) => rig.ask(&Request::Arm).and_then(|_| rig.ask(start)).map(drop),
    };
    let excites = start.is_some();
    let ended = begun.map_err(Failure::from).and_then(|()| run(form, (&mut rig, excites), &mut recorder, duration));
    // Whatever happened, the excitation is stopped and the log is whole.
    let last = rig.ask(&if excites { Request::Stop } else { Request::Alive });
    // What was on its way; the rows of the machine's next frame are not sent yet.
    rig.record(&mut recorder, BEAT)?;
    let end = last.as_ref().map_or(0, |answer| recorder.end(answer.sample));
    let report = recorder.finish(end)?;
    // Identification takes the first part: what the machine kept of Q and of its excitation is lost with its life.
    let rows = report.parts.first().map_or(0, |part| part.rows);
    let log = args.out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = settings(rig.description(), &log, rows, base.as_deref())?;
    std::fs::write(&run_file, text).map_err(|e| Failure::io(&run_file, e))?;
    say_report(form, &report, &args.out, &run_file)?;
    if report.parts.len() > 1 {
        return Err(refused(in_parts(&report, &args.out)));
    }
    ended?;
    last?;
    Ok(())
}

fn in_parts(report: &LogReport, out: &Path) -> String {
    let restarts = report.parts.windows(2).filter(|pair| pair[0].life != pair[1].life).count();
    let why = if restarts > 0 { "the machine started again" } else { "the samples of the machine went back" };
    let rows = report.parts.iter().map(|part| part.rows.to_string()).collect::<Vec<_>>();
    format!(
        "{why} while it was recorded: the log has {} parts of {} rows, the first in {}, the next in {}; run.toml takes the first",
        report.parts.len(),
        rows.join(", "),
        out.display(),
        CsvLog::part_path(out, 2).display()
    )
}

fn recorder(args: &RecordArgs, run_file: &Path, rig: &Rig) -> Result<Recorder, Failure> {
    let machine = rig.description();
    if args.out.extension().is_none_or(|ending| ending != "csv") {
        return Err(refused(format!("--out {}: a log is a .csv file", args.out.display())));
    }
    let mut sinks: Vec<Box<dyn RowSink>> = Vec::new();
    if let Some(address) = &args.plotjuggler {
        let stream = PlotStream::open(address, machine)
            .map_err(|e| refused(format!("--plotjuggler {address}: {e}; give an address as 127.0.0.1:9870")))?;
        sinks.push(Box::new(stream));
    }
    // Last, because it empties an older log.
    let log = CsvLog::create(&args.out, machine).map_err(|e| Failure::io(&args.out, e))?;
    sinks.push(Box::new(log));
    // An older one would describe another log if this program were killed.
    match std::fs::remove_file(run_file) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Failure::io(run_file, e)),
        _ => {}
    }
    Ok(Recorder::with(sinks, &args.out, machine, rig.schema()))
}

/// Takes rows until the time is over, or Ctrl-C.
fn run(
    form: Form,
    (rig, excites): (&mut Rig, bool),
    recorder: &mut Recorder,
    duration: Duration,
) -> Result<(), Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let set = interrupted.clone();
    // Where no handler can be set, Ctrl-C ends the program; the guard of the machine then ends the excitation.
    let _ = ctrlc::set_handler(move || set.store(true, Ordering::Relaxed));
    let progress = Progress::new(form.is_silent());
    let begin = Instant::now();
    while let Some(left) = duration.checked_sub(begin.elapsed()).filter(|left| !left.is_zero()) {
        if interrupted.load(Ordering::Relaxed) {
            break;
        }
        rig.record(recorder, left.min(BEAT))?;
        // A heartbeat for the guard.
        let answer = match rig.ask(&Request::Alive) {
            // It has started again, and its rows go on, in a part of their own; an excitation ended with its life.
            Err(Error::Refused { outcome: Outcome::OtherLife, .. }) if !excites => continue,
            answer => answer?,
        };
        progress.show(&figures(begin.elapsed(), rig, recorder, &answer));
    }
    progress.clear();
    Ok(())
}

/// What was recorded so far, in one line.
fn figures(elapsed: Duration, rig: &Rig, recorder: &mut Recorder, answer: &Answer) -> String {
    let machine = rig.description();
    let channels = machine.outputs.iter().chain(&machine.inputs);
    let largest = channels.zip(recorder.take_largest());
    let largest = largest.map(|(channel, value)| format!("{} {value:.3} {}", channel.name, channel.unit));
    let phase = match answer.status.phase() {
        Phase::Exciting => "exciting",
        Phase::Tripped => "TRIPPED",
        Phase::Idle | Phase::Armed => "idle",
    };
    let (rows, missing) = (recorder.report().rows, recorder.report().missing);
    let largest = largest.collect::<Vec<_>>().join(", ");
    format!("{:.1} s, {rows} rows, {missing} missing, {phase}; largest {largest}", elapsed.as_secs_f64())
}

fn say_report(form: Form, report: &LogReport, log: &Path, run: &Path) -> Result<(), Failure> {
    form.print(|| as_json(report, log, run), || as_text(report, log, run))
}

fn as_json(report: &LogReport, log: &Path, run: &Path) -> Value {
    let frames = &report.frames;
    let trips: Vec<Value> = report.trips.iter().map(|(sample, trip)| trip_as_json(*sample, trip)).collect();
    let parts: Vec<Value> = report.parts.iter().map(|part| json!({ "first": part.first, "rows": part.rows })).collect();
    json!({
        "log": log, "run": run, "rows": report.rows, "missing": report.missing, "gaps": report.gaps,
        "frames": { "taken": frames.taken, "lost": frames.lost, "doubled": frames.doubled,
            "reordered": frames.reordered, "stale": frames.stale },
        "damaged": report.damaged, "foreign": report.foreign, "implausible": report.implausible, "trips": trips,
        "parts": parts,
    })
}

fn as_text(report: &LogReport, log: &Path, run: &Path) -> String {
    let LogReport { rows, missing, gaps, frames, damaged, foreign, implausible, .. } = report;
    let mut text = format!(
        "{}: {rows} rows, {missing} missing in {} gaps. Frames: {} taken, {} lost, {} duplicated, {} reordered, {} late, {damaged} damaged, \
         {foreign} of other senders, {implausible} far from the rows around them (left out).",
        log.display(),
        gaps.len(),
        frames.taken,
        frames.lost,
        frames.doubled,
        frames.reordered,
        frames.stale,
    );
    for (sample, trip) in &report.trips {
        text +=
            &format!("\nThe guard ended the excitation at sample {sample}: {} (channel {}).", trip.cause, trip.channel);
    }
    format!("{text}\nSettings: {}", run.display())
}

fn trip_as_json(sample: u64, trip: &youla_rig::Trip) -> Value {
    json!({ "sample": sample, "cause": trip.cause.to_string(), "channel": trip.channel })
}
