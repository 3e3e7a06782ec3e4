//! `youla study`: the study of starts, and parts of the study of the paper.

use crate::interrupt;
use crate::output::{Failure, Form, say_file};
use crate::paper;
use crate::progress::Progress;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use youla_paper::run_starts::{StartsProgress, WrittenStarts, starts};
use youla_paper::study::{StartCase, StartsSettings};

/// Studies beside the paper, and what is done with parts of its study.
#[derive(Debug, Subcommand)]
pub(crate) enum StudyCommand {
    /// Count how often the prediction-error method converges to the true plant, by start: single, several, continued, or none.
    ///
    /// Results are written to the folder as they are computed. The same command continues an interrupted run.
    #[command(after_help = EXAMPLES)]
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

const EXAMPLES: &str = "\
Examples:
  youla study starts                                     all cases; 500 loops at each noise, 100 items of the others
  youla study starts --cases light-damping --items 20    a first look

Cases: loop-0.2, loop-1.0, light-damping, periodic, far-start, slow-squares.";

/// Arguments of `youla study starts`.
#[derive(Debug, Args)]
pub(crate) struct StartsArgs {
    /// Cases, separated by commas; all by default.
    #[arg(long, value_delimiter = ',', value_parser = case)]
    cases: Option<Vec<StartCase>>,
    /// Items of each case.
    #[arg(long, value_name = "N")]
    items: Option<usize>,
    /// Seed of everything random; the same seed gives the same results.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Results folder; runs/starts-seed-S by default.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn case(name: &str) -> Result<StartCase, String> {
    let known: Vec<&str> = StartCase::ALL.iter().map(|case| case.key()).collect();
    StartCase::of_key(name).ok_or_else(|| format!("there is no such case; known are {}", known.join(", ")))
}

/// Runs either command.
pub(crate) fn study(form: Form, args: &StudyCommand) -> Result<(), Failure> {
    match args {
        StudyCommand::Starts(args) => count(form, args),
        StudyCommand::Merge { parts, out } => paper::merge_parts(form, parts, out.as_deref()),
    }
}

/// Counts how often searches converge.
fn count(form: Form, args: &StartsArgs) -> Result<(), Failure> {
    let cases = args.cases.clone().unwrap_or_else(|| StartCase::ALL.to_vec());
    let settings = StartsSettings::shipped(&cases, args.items, args.seed);
    let default = || Path::new("runs").join(format!("starts-seed-{}", args.seed));
    let target = args.out.clone().unwrap_or_else(default);
    let progress = Progress::new(form.is_silent());
    interrupt::resumable("items", &target);
    let written = starts(&settings, &target, &|now| match now {
        StartsProgress::Begins(case, items) => progress.begin(case.key(), items),
        StartsProgress::Done(items) => progress.done(items),
        StartsProgress::Continued { path, items, redone } => {
            paper::say_continued(&progress, path, &format!("{items} items"), redone);
        }
    })?;
    progress.clear();
    match form.json {
        true => say_file(&target.join("summary.json")),
        false => form.print(Default::default, || table(&written)),
    }
}

fn table(written: &WrittenStarts) -> String {
    let row = |c: &youla_paper::study::StartCount| {
        let without = if c.without_loop > 0 { format!(", {} without a loop", c.without_loop) } else { String::new() };
        format!("{:<14}{:<20}{:>5} of {:>4} converged{without}", c.case.key(), c.search.label(), c.converged, c.items)
    };
    let lines: Vec<String> = written.counts.iter().map(row).collect();
    format!("{}\n\n{}", lines.join("\n"), written.folder.join("report.html").display())
}
