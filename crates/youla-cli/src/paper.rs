//! `youla paper` and `youla study merge`: settings from the arguments, progress with the remaining time, Table 1 at the end.

use crate::interrupt;
use crate::output::{Failure, Form, say, say_file};
use crate::progress::Progress;
use crate::run_folder::place;
use crate::table;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use youla_paper::run::{Configuration, PaperProgress, WrittenPaper, merge, paper};
use youla_paper::study::{PaperSettings, Shard, StudyMethod};
use youla_twin::rig::RigParameters;

pub(crate) const EXAMPLES: &str = "\
Examples:
  youla paper                          runs/paper-seed-1-models-500, about half a minute
  youla paper --models 20              a first look
  youla paper --shard 1/2 --out part1  half of the loops, here; the other half elsewhere, then
  youla study merge part1 part2        exactly what one run gives";

/// Arguments of `youla paper`.
#[derive(Debug, Args)]
pub(crate) struct PaperArgs {
    /// Settings instead of those that ship with the program.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Parameters of the rig instead of those that ship with the program.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Seed of everything random; the same seed gives the same results. 1 unless the settings say otherwise.
    #[arg(long)]
    seed: Option<u64>,
    /// Number of nominal models of the study; fewer than 100 get a coarse map. 500 unless the settings say otherwise.
    #[arg(long, value_name = "N")]
    models: Option<usize>,
    /// Methods that study and map compare, separated by commas.
    #[arg(long, value_delimiter = ',', value_parser = method)]
    methods: Option<Vec<StudyMethod>>,
    /// Speed of the first experiment.
    #[arg(long, allow_negative_numbers = true)]
    rpm: Option<f64>,
    /// Only this part of the loops of study and map, for example 2/4.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Results folder; runs/paper-seed-S-models-N by default.
    #[arg(long, value_name = "DIR", value_parser = place())]
    out: Option<PathBuf>,
    /// Write the settings that ship with the program to standard output, to be copied and edited, and do nothing else.
    #[arg(long, conflicts_with_all = ["settings", "rig", "seed", "models", "methods", "rpm", "shard", "out"])]
    print_settings: bool,
    /// The same for the parameters of the rig.
    #[arg(long, conflicts_with_all = ["print_settings", "settings", "rig", "seed", "models", "methods", "rpm", "shard", "out"])]
    print_rig: bool,
}

/// What is done with parts of the study.
#[derive(Debug, Subcommand)]
pub(crate) enum StudyCommand {
    /// Join the results folders of all shards and finish the paper from them.
    #[command(after_help = "Example:\n  youla study merge part1 part2 --out whole")]
    Merge {
        /// The results folders of all shards, in any order.
        #[arg(value_name = "PART", required = true)]
        parts: Vec<PathBuf>,
        /// Results folder; runs/paper-seed-S-models-N by default.
        #[arg(long, value_name = "DIR", value_parser = place())]
        out: Option<PathBuf>,
    },
}

fn method(name: &str) -> Result<StudyMethod, String> {
    let known: Vec<&str> = StudyMethod::ALL.iter().map(|method| method.key()).collect();
    StudyMethod::of_key(name).ok_or_else(|| format!("there is no such method; known are {}", known.join(", ")))
}

/// Reproduces the paper, or its part.
pub(crate) fn reproduce(form: Form, args: &PaperArgs) -> Result<(), Failure> {
    if args.print_settings {
        return say(PaperSettings::TOML.trim_end());
    }
    if args.print_rig {
        return say(RigParameters::TOML.trim_end());
    }
    let configuration = configuration(args)?;
    let target = args.out.clone().unwrap_or_else(|| default_folder(&configuration));
    finish(form, &configuration, &target)
}

/// Joins parts and draws the whole.
pub(crate) fn merge_parts(form: Form, parts: &[PathBuf], out: Option<&Path>) -> Result<(), Failure> {
    let target = match (out, parts.first()) {
        (Some(out), _) => out.to_owned(),
        (None, Some(part)) => {
            let part = Configuration::read(part)?;
            default_folder(&Configuration { shard: Shard::WHOLE, ..part })
        }
        (None, None) => PathBuf::new(),
    };
    let configuration = merge(parts, &target)?;
    finish(form, &configuration, &target)
}

fn configuration(args: &PaperArgs) -> Result<Configuration, Failure> {
    let mut settings = args.settings.as_deref().map_or_else(|| Ok(PaperSettings::shipped()), PaperSettings::read)?;
    let rig = args.rig.as_deref().map_or_else(|| Ok(RigParameters::shipped()), RigParameters::read)?;
    settings.seed = args.seed.unwrap_or(settings.seed);
    settings.methods = args.methods.clone().unwrap_or(settings.methods);
    settings.experiments.rpm = args.rpm.unwrap_or(settings.experiments.rpm);
    if let Some(models) = args.models {
        settings = settings.with_models(models);
    }
    Ok(Configuration::new(settings, rig, args.shard.unwrap_or(Shard::WHOLE)))
}

fn default_folder(configuration: &Configuration) -> PathBuf {
    let (seed, models, shard) = (configuration.settings.seed, configuration.settings.study.models, configuration.shard);
    let part = if shard.is_whole() { String::new() } else { format!("-shard-{}-of-{}", shard.index(), shard.count()) };
    Path::new("runs").join(format!("paper-seed-{seed}-models-{models}{part}"))
}

fn finish(form: Form, configuration: &Configuration, target: &Path) -> Result<(), Failure> {
    let progress = Progress::new(form.is_silent());
    interrupt::resumable(target);
    let written = paper(configuration, target, &|now| match now {
        PaperProgress::Begins(stage, loops) => progress.begin(stage.name(), loops),
        PaperProgress::Done(loops) => progress.done(loops),
        PaperProgress::Continued { path, loops, redone } => say_continued(&progress, path, loops, redone),
    })?;
    progress.clear();
    let summary = target.join("summary.json");
    match &written.paper {
        Some(_) if form.json => say_file(&summary),
        Some(paper) => form.print(Default::default, || table::paper(paper, &written)),
        None => {
            let (folder, shard) = (written.folder.display().to_string(), configuration.shard.to_string());
            form.print(
                || serde_json::json!({ "folder": folder, "shard": shard }),
                || part_of(configuration.shard, &written),
            )
        }
    }
}

fn part_of(shard: Shard, written: &WrittenPaper) -> String {
    let folder = written.folder.display();
    format!("shard {shard} is complete: {folder}\nwhen all parts are: youla study merge PART... --out DIR")
}

/// A file of an earlier call.
fn say_continued(progress: &Progress, path: &Path, loops: usize, redone: usize) {
    let damaged = match redone {
        0 => String::new(),
        _ => format!(", {redone} damaged or incomplete rows are computed again"),
    };
    progress.say(&format!("{}: {loops} loops are there already{damaged}", path.display()));
}
