//! `youla init`: a first run.toml from a log, asked for or by flags.

use crate::args::{Args, InitArgs};
use crate::output::{Failure, say};
use std::io::{IsTerminal, Write};
use std::path::Path;
use youla_io::{ChannelRef, SurveyedColumn, survey};
use youla_run::{Draft, DraftClock, Feedback, path_from};

/// Lists the columns of the log, asks what the flags do not say, and writes run.toml.
pub(crate) fn init(args: &Args, asked: &InitArgs) -> Result<(), Failure> {
    if asked.out.exists() && !asked.force {
        return Err(youla_io::Error::FileExists { path: asked.out.clone() }.into());
    }
    let csv = asked.dialect.options();
    let columns = survey(&asked.log, &csv)?;
    let missing = missing(asked);
    let silent = args.quiet || args.json;
    if !silent || !missing.is_empty() {
        say(&table(&columns))?;
    }
    if !missing.is_empty() && !std::io::stdin().is_terminal() {
        let problem = format!("what the columns mean is not guessed; say it with {}", missing.join(", "));
        return Err(youla_io::Error::Settings { path: asked.log.clone(), at: None, problem }.into());
    }
    let draft = answered(asked, &columns)?;
    let text = draft.toml(&columns)?;
    std::fs::write(&asked.out, text).map_err(|source| Failure::io(&asked.out, source))?;
    if silent { Ok(()) } else { say(&next(asked, &draft)) }
}

/// Flags without which a question is open.
fn missing(asked: &InitArgs) -> Vec<&'static str> {
    [
        (asked.input.is_empty(), "--input"),
        (asked.output.is_empty(), "--output"),
        (asked.time.is_none() && asked.sample_time.is_none(), "--time or --sample-time"),
        (!asked.open_loop && asked.feedback.is_none(), "--feedback or --open-loop"),
    ]
    .into_iter()
    .filter_map(|(open, flag)| open.then_some(flag))
    .collect()
}

fn answered(asked: &InitArgs, columns: &[SurveyedColumn]) -> Result<Draft, Failure> {
    let list = |given: &[ChannelRef], question: &str| match given {
        [] => ask(question, |text| Ok(names(text))),
        given => Ok(given.to_vec()),
    };
    let inputs = list(&asked.input, "Inputs of the plant, as applied, separated by commas")?;
    let outputs = list(&asked.output, "Outputs of the plant, separated by commas")?;
    let clock = match (&asked.time, asked.sample_time) {
        (Some(column), _) => DraftClock::Column(column.clone()),
        (None, Some(ts)) => DraftClock::SampleTime(ts),
        (None, None) => ask("Column with the time in seconds, or the sample time in seconds", |text| {
            Ok(match text.parse() {
                Ok(ts) => DraftClock::SampleTime(ts),
                Err(_) => DraftClock::Column(read_name(text)),
            })
        })?,
    };
    let feedback = match (asked.open_loop, asked.feedback) {
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
    let rows = columns.iter().filter_map(|c| c.content.as_ref().ok()).map(|c| c.rows).max().unwrap_or(0);
    let stem = asked.log.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let name = asked.name.clone().unwrap_or_else(|| stem.split('.').next().unwrap_or_default().to_owned());
    Ok(Draft {
        name,
        file: path_from(asked.out.parent().unwrap_or(Path::new("")), &asked.log)?,
        csv: asked.dialect.options(),
        clock,
        inputs,
        outputs,
        input_excitation: asked.excitation.clone(),
        reference: asked.reference.clone(),
        feedback,
        estimated: asked.estimate.unwrap_or(2 * rows / 3),
    })
}

/// Asks until the answer can be read.
fn ask<T>(question: &str, read: impl Fn(&str) -> Result<T, String>) -> Result<T, Failure> {
    let terminal = |source| Failure::io(Path::new("the terminal"), source);
    loop {
        print!("{question}: ");
        std::io::stdout().flush().map_err(terminal)?;
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
    text.split(',').map(|name| read_name(name.trim())).collect()
}

fn read_name(text: &str) -> ChannelRef {
    let Ok(name) = text.parse();
    name
}

/// The columns with their range.
fn table(columns: &[SurveyedColumn]) -> String {
    let width = columns.iter().map(|c| c.from.chars().count()).max().unwrap_or(0).max(6);
    let mut text = format!("{:width$}  {:>9}  {:>12}  {:>12}\n", "column", "rows", "lowest", "highest");
    for SurveyedColumn { from, content } in columns {
        match content {
            Ok(c) => {
                let clock = c.step.map_or(String::new(), |step| format!("  even steps of {step:.6e}: a clock?"));
                text += &format!("{from:width$}  {:>9}  {:>12.5e}  {:>12.5e}{clock}\n", c.rows, c.low, c.high);
            }
            Err(problem) => text += &format!("{from:width$}  no channel: {problem}\n"),
        }
    }
    text
}

/// What was chosen without being asked for, and what is to be done now.
fn next(asked: &InitArgs, draft: &Draft) -> String {
    let file = asked.out.display();
    let split = match asked.estimate {
        Some(_) => String::new(),
        None => format!(
            "Rows 1 to {} identify, the rest verifies: change that in {file}, or give --estimate ROWS.\n",
            draft.estimated
        ),
    };
    let fill = match draft.feedback {
        Some(_) => "Now fill in numerator and denominator of [nominal] and [controller], then\n",
        None => "Now\n",
    };
    format!("wrote {file}\n{split}{fill}  youla check {file}\n  youla identify {file}")
}
