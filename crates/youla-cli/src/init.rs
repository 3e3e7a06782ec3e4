//! `youla init`: a first run.toml from a log, by questions or flags.

use crate::log_flags::{Dialect, Sign, places};
use crate::output::{Failure, Form, ask_line, say};
use crate::run_folder::place;
use clap::Args;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use youla::error::short;
use youla::lti::Discrete;
use youla_io::{ChannelRef, SurveyedColumn, require_free_for_settings, survey};
use youla_run::{Draft, DraftClock, Feedback, path_from};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla init log.csv
  youla init log.csv --input u --output y --time t --reference r --feedback negative
  youla init arm.dat --input '#1' --output '#2' --sample-time 1 --open-loop --estimate 700";

/// What is known of a log.
#[derive(Debug, Args)]
pub(crate) struct InitArgs {
    /// The log: text, MATLAB or NumPy.
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// Inputs of the plant, by name or as #3 for the third column, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    input: Vec<ChannelRef>,
    /// Outputs of the plant, as the inputs.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    output: Vec<ChannelRef>,
    /// Column with the time in seconds.
    #[arg(long, value_name = "NAME", conflicts_with = "sample_time")]
    time: Option<ChannelRef>,
    /// Sample time in seconds.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    sample_time: Option<f64>,
    /// Known excitation added at the plant input, one column per input.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    excitation: Vec<ChannelRef>,
    /// Known reference, one column per output.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    reference: Vec<ChannelRef>,
    /// Sign in which the controller that ran is written down: u = K (r - y) is negative.
    #[arg(long, value_name = "SIGN", conflicts_with = "open_loop")]
    feedback: Option<Sign>,
    /// No controller ran while this was logged.
    #[arg(long)]
    open_loop: bool,
    /// Rows to identify from, from the first on; two thirds unless stated. The rest verifies.
    #[arg(long, value_name = "ROWS")]
    estimate: Option<usize>,
    /// Name of the machine; the name of the file unless stated.
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    dialect: Dialect,
    /// File to write.
    #[arg(long, value_name = "FILE", default_value = "run.toml", value_parser = place())]
    out: PathBuf,
    /// Replace it if it is there.
    #[arg(long)]
    force: bool,
}

/// Lists the columns of the log, asks what the flags do not say, and writes run.toml.
pub(crate) fn init(form: Form, args: &InitArgs) -> Result<(), Failure> {
    require_free_for_settings(&args.out, args.force, &[&args.log])?;
    let csv = args.dialect.options();
    let columns = survey(&args.log, &csv)?;
    let missing = missing(args);
    if !form.is_silent() || (!missing.is_empty() && !form.json) {
        say(&table(&columns))?;
    }
    if !missing.is_empty() && !std::io::stdin().is_terminal() {
        let problem = format!("what the columns mean is not guessed; say it with {}", missing.join(", "));
        return Err(youla_io::Error::Settings { path: args.log.clone(), at: None, problem }.into());
    }
    let draft = answered(args, &columns)?;
    let text = draft.toml(&columns)?;
    std::fs::write(&args.out, text).map_err(|source| Failure::io(&args.out, source))?;
    form.print(|| about(args, &draft, &columns), || next(args, &draft))
}

/// What was written, and the columns of the log.
fn about(args: &InitArgs, draft: &Draft, columns: &[SurveyedColumn]) -> serde_json::Value {
    let column = |c: &SurveyedColumn| match &c.content {
        Ok(found) => serde_json::json!({
            "name": c.from, "rows": found.rows, "lowest": found.low, "highest": found.high, "step": found.step,
        }),
        Err(problem) => serde_json::json!({ "name": c.from, "problem": problem.to_string() }),
    };
    let columns: Vec<_> = columns.iter().map(column).collect();
    serde_json::json!({ "file": args.out.display().to_string(), "estimated_rows": draft.estimated, "columns": columns })
}

/// Flags without which a question is open.
fn missing(args: &InitArgs) -> Vec<&'static str> {
    [
        (args.input.is_empty(), "--input"),
        (args.output.is_empty(), "--output"),
        (args.time.is_none() && args.sample_time.is_none(), "--time or --sample-time"),
        (!args.open_loop && args.feedback.is_none(), "--feedback or --open-loop"),
    ]
    .into_iter()
    .filter_map(|(open, flag)| open.then_some(flag))
    .collect()
}

fn answered(args: &InitArgs, columns: &[SurveyedColumn]) -> Result<Draft, Failure> {
    let list = |given: &[ChannelRef], question: &str| match given {
        [] => ask(question, |text| Ok(names(text))),
        given => Ok(places(given)),
    };
    let inputs = list(&args.input, "Inputs of the plant, as applied, separated by commas")?;
    let outputs = list(&args.output, "Outputs of the plant, separated by commas")?;
    let clock = match (&args.time, args.sample_time) {
        (Some(column), _) => {
            require_clock(args, columns, column)?;
            DraftClock::Column(column.clone())
        }
        (None, Some(ts)) => DraftClock::SampleTime(Discrete::new(ts)?.ts()),
        (None, None) => ask("Column with the time in seconds, or the sample time in seconds", |text| {
            Ok(match text.parse() {
                Ok(ts) => DraftClock::SampleTime(ts),
                Err(_) => DraftClock::Column(read_name(text)),
            })
        })?,
    };
    let feedback = match (args.open_loop, args.feedback) {
        (true, _) => None,
        (false, Some(feedback)) => Some(feedback.into()),
        (false, None) => ask(
            "Controller that ran: negative for u = K (r - y), positive for u = K (y - r), none",
            |text| match text {
                "negative" => Ok(Some(Feedback::Negative)),
                "positive" => Ok(Some(Feedback::Positive)),
                "none" => Ok(None),
                _ => Err("please answer negative, positive or none".into()),
            },
        )?,
    };
    // Who is asked anything is asked for these too; flags alone are taken as complete.
    let asked = !missing(args).is_empty();
    let known = |given: &[ChannelRef], question: &str| match given {
        [] if asked => ask(question, |text| Ok(if text == "none" { Vec::new() } else { names(text) })),
        given => Ok(places(given)),
    };
    let input_excitation =
        known(&args.excitation, "Known excitation added at the plant input, one for each input, or none")?;
    let reference = match feedback {
        Some(_) => known(&args.reference, "Known reference of the controller, one for each output, or none")?,
        None => places(&args.reference),
    };
    let rows = columns.iter().filter_map(|c| c.content.as_ref().ok()).map(|c| c.rows).max().unwrap_or(0);
    let stem = args.log.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let name = args.name.clone().unwrap_or_else(|| stem.split('.').next().unwrap_or_default().to_owned());
    Ok(Draft {
        name,
        file: path_from(args.out.parent().unwrap_or(Path::new("")), &args.log)?,
        csv: args.dialect.options(),
        clock,
        inputs,
        outputs,
        input_excitation,
        reference,
        feedback,
        estimated: args.estimate.unwrap_or(2 * rows / 3),
    })
}

/// Refuses a time column of which the log says that it does not rise.
fn require_clock(args: &InitArgs, columns: &[SurveyedColumn], chosen: &ChannelRef) -> Result<(), Failure> {
    let falls = |c: &&SurveyedColumn| c.content.as_ref().is_ok_and(|found| !found.rises);
    let Some(wrong) = columns.iter().find(|c| c.from == chosen.to_string()).filter(falls) else { return Ok(()) };
    let even = |c: &&SurveyedColumn| c.content.as_ref().is_ok_and(|found| found.step.is_some_and(|step| step > 0.0));
    let clock = columns.iter().find(even).map_or(String::new(), |c| format!("; is it {}?", c.from));
    let problem = format!("the column {} does not rise from row to row, so it is no time{clock}", wrong.from);
    Err(youla_io::Error::Settings { path: args.log.clone(), at: None, problem }.into())
}

/// Asks until the answer can be read.
fn ask<T>(question: &str, read: impl Fn(&str) -> Result<T, String>) -> Result<T, Failure> {
    let terminal = |source| Failure::io(Path::new("the terminal"), source);
    loop {
        ask_line(question)?;
        let mut line = String::new();
        if std::io::stdin().read_line(&mut line).map_err(terminal)? == 0 {
            return Err(terminal(std::io::ErrorKind::UnexpectedEof.into()));
        }
        match line.trim() {
            "" => continue,
            text => match read(text) {
                Ok(answer) => return Ok(answer),
                Err(problem) => say(&problem)?,
            },
        }
    }
}

fn names(text: &str) -> Vec<ChannelRef> {
    places(&text.split(',').map(|name| read_name(name.trim())).collect::<Vec<_>>())
}

fn read_name(text: &str) -> ChannelRef {
    let Ok(name) = text.parse();
    name
}

/// Columns that are listed at most.
const MOST: usize = 100;

/// The columns with their range.
fn table(columns: &[SurveyedColumn]) -> String {
    let names: Vec<String> = columns.iter().take(MOST).map(|c| short(&c.from)).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(6);
    let mut text = format!("{:width$}  {:>9}  {:>12}  {:>12}\n", "column", "rows", "lowest", "highest");
    for (from, SurveyedColumn { content, .. }) in names.iter().zip(columns) {
        match content {
            Ok(c) => {
                let clock =
                    c.step.map_or(String::new(), |step| format!("  even steps of {step:.6e}: a clock or a ramp"));
                text += &format!("{from:width$}  {:>9}  {:>12.5e}  {:>12.5e}{clock}\n", c.rows, c.low, c.high);
            }
            Err(problem) => text += &format!("{from:width$}  no channel: {problem}\n"),
        }
    }
    if columns.len() > MOST {
        text += &format!("and {} more columns\n", columns.len() - MOST);
    }
    text
}

/// What was chosen without being asked for, and what is to be done now.
fn next(args: &InitArgs, draft: &Draft) -> String {
    let file = args.out.display();
    let split = match args.estimate {
        Some(_) => String::new(),
        None => format!(
            "Rows 1 to {} identify, the rest verifies: change that in {file}, or give --estimate ROWS.\n",
            draft.estimated
        ),
    };
    let fill = match draft.feedback {
        Some(_) => "Now fill in the controller, in the form that you have it, then\n",
        None => "Now\n",
    };
    format!("wrote {file}\n{split}{fill}  youla check {file}\n  youla identify {file}")
}
