//! `youla synchronise`: channels with their own time stamps, on the clock of the controller.

use crate::log_flags::{Dialect, places};
use crate::output::{Failure, Form, lines_of};
use crate::run_folder::place;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use youla::lti::Discrete;
use youla::signal::Channel;
use youla_io::folder::require_place;
use youla_io::{ChannelRef, ChannelRole, Placement, StampedChannel, StampedColumn, Synchronised, require_free};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla synchronise log.csv --time t --input u --output y --reference r --changes-only r --sample-time 0.01
  youla synchronise vehicle_angular_velocity_0.csv actuator_motors_0.csv --time timestamp --time-unit us \\
      --input 'control[0]' --output 'xyz[0]' --sample-time 0.0025 --out rate-loop.csv

An empty cell, or nan, means that the channel has no sample at the time of its row. A name that is in several files is written with the name
of its file: vehicle_angular_velocity_0:xyz[0].";

/// What is to be brought to one clock.
#[derive(Debug, Args)]
pub(crate) struct SynchroniseArgs {
    /// Text files, each with a column of the time.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Column of the time, of every file.
    #[arg(long, value_name = "NAME")]
    time: ChannelRef,
    /// Unit of the time.
    #[arg(long, value_enum, default_value = "s")]
    time_unit: TimeUnit,
    /// Sample time of the controller, seconds.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    sample_time: f64,
    /// Inputs, by name, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', required = true)]
    input: Vec<ChannelRef>,
    /// Outputs, as the inputs.
    #[arg(long, value_name = "NAME", value_delimiter = ',', required = true)]
    output: Vec<ChannelRef>,
    /// Known excitation.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    excitation: Vec<ChannelRef>,
    /// Known references.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    reference: Vec<ChannelRef>,
    /// Those of these channels of which a value is written only when it changes.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    changes_only: Vec<ChannelRef>,
    #[command(flatten)]
    dialect: Dialect,
    /// Text file for the rows; `-1`, `-2` and so on are added where gaps cut the log.
    #[arg(long, value_name = "FILE", default_value = "synchronised.csv", value_parser = place())]
    out: PathBuf,
    /// Replace files that exist.
    #[arg(long)]
    force: bool,
}

/// Units of a time column.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum TimeUnit {
    S,
    Ms,
    Us,
    Ns,
}

impl TimeUnit {
    fn per_second(self) -> f64 {
        match self {
            TimeUnit::S => 1.0,
            TimeUnit::Ms => 1e3,
            TimeUnit::Us => 1e6,
            TimeUnit::Ns => 1e9,
        }
    }
}

/// Reads the files, writes a text file for each record, and prints the timing of the channels.
pub(crate) fn synchronise(form: Form, args: &SynchroniseArgs) -> Result<(), Failure> {
    require_place(&args.out)?;
    let time = Discrete::new(args.sample_time)?;
    let columns = read(args)?;
    let chosen = [
        (ChannelRole::Input, &args.input),
        (ChannelRole::Output, &args.output),
        (ChannelRole::External, &args.excitation),
        (ChannelRole::External, &args.reference),
    ];
    let mut channels = Vec::new();
    for (role, names) in chosen {
        for name in places(names) {
            channels.push(channel(&name.to_string(), role, &columns, args)?);
        }
    }
    for name in places(&args.changes_only) {
        let chosen = channels.iter_mut().find(|c| c.channel.name == name.to_string());
        let unknown =
            || refused(format!("--changes-only names {name}, which is no input, output, excitation or reference"));
        chosen.ok_or_else(unknown)?.changes_only = true;
    }
    let what = args.files[0].display().to_string();
    let found = youla_io::synchronise(&what, &channels, time)?;
    let targets: Vec<PathBuf> = (1..=found.records.len()).map(|k| target(&args.out, k, found.records.len())).collect();
    let read: Vec<&Path> = args.files.iter().map(PathBuf::as_path).collect();
    targets.iter().try_for_each(|path| require_free(path, args.force, &read))?;
    for (record, path) in found.records.iter().zip(&targets) {
        youla_io::write_csv(record, path)?;
    }
    form.print(|| json(&found, &targets), || text(&found, &targets))
}

fn refused(sentence: String) -> Failure {
    Failure::Refused(sentence, youla::ErrorKind::BadInput)
}

/// The columns of all files by their names, with that of the file before it.
fn read(args: &SynchroniseArgs) -> Result<Vec<(String, StampedColumn)>, Failure> {
    let mut columns = Vec::new();
    for path in &args.files {
        let file = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for column in youla_io::read_stamped_csv(path, &args.time, &args.dialect.options())? {
            columns.push((file.clone(), column));
        }
    }
    Ok(columns)
}

fn channel(
    name: &str,
    role: ChannelRole,
    columns: &[(String, StampedColumn)],
    args: &SynchroniseArgs,
) -> Result<StampedChannel, Failure> {
    let is = |(file, (column, ..)): &&(String, StampedColumn)| {
        column == name || name.strip_prefix(file.as_str()).and_then(|rest| rest.strip_prefix(':')) == Some(column)
    };
    let found: Vec<_> = columns.iter().filter(is).collect();
    let (_, (_, times, values)) = match found[..] {
        [one] => one,
        [] => {
            let known = columns.iter().map(|(_, (column, ..))| column.clone()).collect();
            return Err(youla::signal::unknown("the log", name, known).into());
        }
        _ => {
            let names: Vec<String> = found.iter().map(|(file, (column, ..))| format!("{file}:{column}")).collect();
            return Err(refused(format!("{name} is in several files; write {}", names.join(" or "))));
        }
    };
    let times = times.iter().map(|t| t / args.time_unit.per_second()).collect();
    let channel = Channel::new(name, "");
    Ok(StampedChannel { channel, role, changes_only: false, times, values: values.clone() })
}

/// The file of record `k`, counted from 1, of `count`.
fn target(out: &Path, k: usize, count: usize) -> PathBuf {
    if count == 1 {
        return out.to_owned();
    }
    let part = |x: Option<&std::ffi::OsStr>| x.unwrap_or_default().to_string_lossy().into_owned();
    let extension = part(out.extension());
    let dot = if extension.is_empty() { "" } else { "." };
    out.with_file_name(format!("{}-{k}{dot}{extension}", part(out.file_stem())))
}

fn json(found: &Synchronised, targets: &[PathBuf]) -> serde_json::Value {
    serde_json::json!({
        "files": targets, "rows": found.records.iter().map(youla::signal::Record::samples).collect::<Vec<_>>(),
        "channels": found.timing, "drift": found.drift, "left_out": found.left_out,
    })
}

fn text(found: &Synchronised, targets: &[PathBuf]) -> String {
    let width = found.timing.iter().map(|t| t.name.len()).max().unwrap_or(0).max(7);
    let mut text = format!(
        "{:<width$} {:>9} {:>12} {:>12} {:>12} {:>12}  {:<12} {:>7} {:>7}\n",
        "channel", "samples", "step, ms", "longest, ms", "scatter, ms", "delay, ms", "rows are", "filled", "error"
    );
    for t in &found.timing {
        let delay = t.delay.map_or("-".into(), |delay| format!("{:.3}", 1e3 * delay));
        text += &format!(
            "{:<width$} {:>9} {:>12.3} {:>12.3} {:>12.3} {delay:>12}  {:<12} {:>7} {:>5.1} %\n",
            t.name,
            t.samples,
            1e3 * t.step,
            1e3 * t.longest_step,
            1e3 * t.jitter,
            t.placement.name(),
            t.filled,
            100.0 * t.error
        );
    }
    let rows: Vec<String> = found.records.iter().map(|r| r.samples().to_string()).collect();
    text += &format!(
        "\n{} rows of {} s, {} left out; the controller's clock differs from that of the stamps by {:+.1} ppm\n",
        rows.join(" + "),
        found.records[0].time().ts(),
        found.left_out,
        1e6 * found.drift
    );
    for t in found.timing.iter().filter(|t| t.placement == Placement::Interpolated) {
        let step = format!("{:.6e}", t.step).parse().unwrap_or(t.step);
        text += &format!("state in run.toml: outputs = [{{ name = \"{}\", sampled_every = {step} }}]\n", t.name);
    }
    text + &lines_of(targets)
}
