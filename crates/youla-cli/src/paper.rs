//! `youla paper` and `youla study merge`: settings from the arguments, progress with the remaining time, Table 1 at the end.

use crate::args::{Args, PaperArgs};
use crate::output::{Failure, say};
use crate::table;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;
use youla_paper::rig::RigParameters;
use youla_paper::run::{Configuration, PaperProgress, WrittenPaper, merge, paper};
use youla_paper::study::{PaperSettings, Shard};

/// Reproduces the paper, or its part.
pub(crate) fn reproduce(args: &Args, asked: &PaperArgs) -> Result<(), Failure> {
    if asked.print_settings {
        return say(PaperSettings::TOML.trim_end());
    }
    if asked.print_rig {
        return say(RigParameters::TOML.trim_end());
    }
    let configuration = configuration(asked)?;
    let target = asked.out.clone().unwrap_or_else(|| default_folder(&configuration));
    finish(args, &configuration, &target)
}

/// Joins parts and draws the whole.
pub(crate) fn merge_parts(args: &Args, parts: &[PathBuf], out: Option<&Path>) -> Result<(), Failure> {
    let target = match (out, parts.first()) {
        (Some(out), _) => out.to_owned(),
        (None, Some(part)) => {
            let part = Configuration::read(part)?;
            default_folder(&Configuration { shard: Shard::WHOLE, ..part })
        }
        (None, None) => PathBuf::new(),
    };
    let configuration = merge(parts, &target)?;
    finish(args, &configuration, &target)
}

fn configuration(asked: &PaperArgs) -> Result<Configuration, Failure> {
    let mut settings = asked.settings.as_deref().map_or_else(|| Ok(PaperSettings::shipped()), PaperSettings::read)?;
    let rig = asked.rig.as_deref().map_or_else(|| Ok(RigParameters::shipped()), RigParameters::read)?;
    settings.seed = asked.seed.unwrap_or(settings.seed);
    settings.methods = asked.methods.clone().unwrap_or(settings.methods);
    settings.experiments.rpm = asked.rpm.unwrap_or(settings.experiments.rpm);
    if let Some(models) = asked.models {
        settings = settings.with_models(models);
    }
    Ok(Configuration::new(settings, rig, asked.shard.unwrap_or(Shard::WHOLE)))
}

fn default_folder(configuration: &Configuration) -> PathBuf {
    let (seed, models, shard) = (configuration.settings.seed, configuration.settings.study.models, configuration.shard);
    let part = if shard.is_whole() { String::new() } else { format!("-shard-{}-of-{}", shard.index(), shard.count()) };
    Path::new("runs").join(format!("paper-seed-{seed}-models-{models}{part}"))
}

fn finish(args: &Args, configuration: &Configuration, target: &Path) -> Result<(), Failure> {
    let bar = Bar::new(args.quiet || args.json);
    let written = paper(configuration, target, &|progress| bar.tell(progress))?;
    bar.bar.finish_and_clear();
    match &written.paper {
        _ if args.quiet => Ok(()),
        Some(_) if args.json => {
            let path = target.join("summary.json");
            say(std::fs::read_to_string(&path).map_err(|e| Failure::io(&path, e))?.trim_end())
        }
        Some(paper) => say(&table::paper(paper, &written)),
        None => say(&part_of(configuration.shard, &written)),
    }
}

fn part_of(shard: Shard, written: &WrittenPaper) -> String {
    let folder = written.folder.display();
    format!("shard {shard} is complete: {folder}\nwhen all parts are: youla study merge PART... --out DIR")
}

/// One bar per stage, on a terminal only.
pub(crate) struct Bar {
    pub(crate) bar: ProgressBar,
    quiet: bool,
}

impl Bar {
    pub(crate) fn new(hidden: bool) -> Self {
        let bar = if hidden { ProgressBar::hidden() } else { ProgressBar::new(0) };
        bar.enable_steady_tick(Duration::from_millis(100));
        Bar { bar, quiet: hidden }
    }

    fn tell(&self, progress: PaperProgress<'_>) {
        match progress {
            PaperProgress::Begins(stage, loops) => self.begin(stage.name(), loops),
            PaperProgress::Done(loops) => self.bar.set_position(loops as u64),
            PaperProgress::Continued { path, loops, redone } => self.continued(path, &format!("{loops} loops"), redone),
        }
    }

    /// A file of an earlier call.
    pub(crate) fn continued(&self, path: &Path, found: &str, redone: usize) {
        let path = path.display();
        let damaged = if redone > 0 {
            format!(", {redone} damaged or incomplete rows are computed again")
        } else {
            String::new()
        };
        self.say(&format!("{path}: {found} are there already{damaged}"));
        // The remaining time is that of the loops of this call.
        self.bar.reset_eta();
    }

    /// Above the bar, or on standard error where there is none to be seen.
    fn say(&self, text: &str) {
        if !self.quiet && self.bar.is_hidden() {
            // Without standard error there is nobody to tell.
            let _ = writeln!(std::io::stderr(), "{text}");
        } else {
            self.bar.println(text);
        }
    }

    pub(crate) fn begin(&self, stage: &'static str, loops: usize) {
        let template = if loops > 0 {
            "{spinner} {msg} {wide_bar} {pos}/{len}, {elapsed} gone, {eta} left"
        } else {
            "{spinner} {msg} ({elapsed})"
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style);
        }
        self.bar.reset();
        self.bar.set_length(loops as u64);
        self.bar.set_message(stage);
    }
}
