//! What each verb does: read, call the library, print.

use crate::args::{Args, Command, OutputFolder, StudyCommand};
use crate::check;
use crate::compare;
use crate::excite;
use crate::export;
use crate::init;
use crate::manual;
use crate::output::{Failure, Progress, say};
use crate::paper;
use crate::plot;
use crate::starts;
use crate::subspace;
use crate::table;
use std::path::{Path, PathBuf};
use youla_io::folder::{RunFolder, unused_folder};
use youla_paper::demo;
use youla_run::{
    RunRecords, RunSettings, Stage, StageClock, factorise_run, identify, read_records, redraw, settings_reference,
    settings_schema, signal_records, write_run, write_signals,
};

/// Runs the verb that was asked for; false where a check found a defect.
pub(crate) fn run(args: &Args) -> Result<bool, Failure> {
    match &args.command {
        Command::Check(asked) => check::check(args, asked),
        command => other(args, command).map(|()| true),
    }
}

fn other(args: &Args, command: &Command) -> Result<(), Failure> {
    match command {
        Command::Check(_) => Ok(()),
        Command::Demo { seed, output } => {
            let demo = demo(*seed)?;
            identify_and_write(args, output, Path::new("."), demo.settings, |_| Ok(demo.records))
        }
        Command::Identify { settings, output } => {
            let folder = folder_of(settings);
            identify_and_write(args, output, &folder, RunSettings::read(settings)?, |s| read_records(&s.data, &folder))
        }
        Command::Completions { shell } => manual::completions(*shell),
        Command::Man => manual::man_page(),
        Command::Schema { markdown } => schema(*markdown),
        Command::Init(asked) => init::init(args, asked),
        Command::Signals { settings, out } => signals(args, settings, out),
        Command::Subspace(asked) => subspace::identify(args, asked),
        Command::Report { run } => report(args, run),
        Command::Compare(asked) => compare::run(args, asked),
        Command::Excite(asked) => excite::make(args, asked),
        Command::Export(asked) => export::export(args, asked),
        Command::Plot(asked) => plot::plot(args, asked),
        Command::Paper(asked) => paper::reproduce(args, asked),
        Command::Study(StudyCommand::Starts(asked)) => starts::count(args, asked),
        Command::Study(StudyCommand::Merge { parts, out }) => paper::merge_parts(args, parts, out.as_deref()),
    }
}

fn identify_and_write(
    args: &Args,
    output: &OutputFolder,
    folder: &Path,
    settings: RunSettings,
    read: impl FnOnce(&RunSettings) -> youla_run::Result<RunRecords>,
) -> Result<(), Failure> {
    let target = output.out.clone().unwrap_or_else(|| unused_folder(Path::new("."), &settings.name));
    RunFolder::check(&target, output.force)?;
    let progress = Progress::new(args.quiet || args.json);
    let mut announce = |stage: Stage| progress.stage(stage);
    let mut clock = StageClock::new(&mut announce);
    let records = clock.run(Stage::Record, || read(&settings))?;
    let found = identify(settings, records, folder, &mut clock)?;
    let written = write_run(&found, &target, output.force, &mut clock)?;
    progress.finish();
    if args.json {
        say(&written.summary.to_string())
    } else if args.quiet {
        Ok(())
    } else {
        say(&table::results(&found, &written.folder))
    }
}

fn signals(args: &Args, settings: &Path, out: &Path) -> Result<(), Failure> {
    let folder = folder_of(settings);
    let settings = RunSettings::read(settings)?;
    let records = read_records(&settings.data, &folder)?;
    let factorisation = factorise_run(&settings, &records, &folder)?;
    let signals = signal_records(&factorisation.factors, &records)?;
    for (record, path) in signals.iter().zip(write_signals(&signals, out)?) {
        if !args.quiet && !args.json {
            say(&format!("{} ({} samples)", path.display(), record.samples()))?;
        }
    }
    Ok(())
}

fn schema(markdown: bool) -> Result<(), Failure> {
    match markdown {
        true => say(settings_reference().trim_end()),
        false => say(&format!("{:#}", settings_schema())),
    }
}

fn report(args: &Args, run: &Path) -> Result<(), Failure> {
    let path = redraw(run)?;
    if args.quiet || args.json { Ok(()) } else { say(&path.display().to_string()) }
}

/// The folder to which the paths in a settings file are relative.
pub(crate) fn folder_of(settings: &Path) -> PathBuf {
    settings.parent().map_or_else(PathBuf::new, Path::to_owned)
}
