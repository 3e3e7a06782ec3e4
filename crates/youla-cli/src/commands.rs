//! What each verb does: read, call the library, print.

use crate::args::{Args, Command};
use crate::output::{Failure, Form, say};
use crate::progress::Progress;
use crate::run_folder::{OutputFolder, folder_of};
use crate::{
    check, commission, compare, excite, export, init, interrupt, paper, plot, rig, synchronise, table, workbench,
};
use std::path::{Path, PathBuf};
use youla_io::folder::RunFolder;
use youla_io::require_free;
use youla_run::{
    RunRecords, RunSettings, Stage, StageClock, factorise_run, identify, read_records, redraw, settings_schema,
    signal_records, write_into, write_signals,
};

/// Runs the verb that was asked for; false where a check found a defect or a campaign stopped.
pub(crate) fn run(args: &Args) -> Result<bool, Failure> {
    match &args.command {
        Command::Check(of_check) => check::check(args.form, of_check),
        Command::Commission(of_campaign) => commission::run(args.form, of_campaign),
        command => other(args.form, command).map(|()| true),
    }
}

fn other(form: Form, command: &Command) -> Result<(), Failure> {
    match command {
        Command::Check(_) | Command::Commission(_) => Ok(()),
        Command::Demo { seed, machine, output } => {
            let demo = youla_twin::demo((*machine).into(), *seed)?;
            identify_and_write(form, output, Path::new("."), demo.settings, |_| Ok(demo.records))
        }
        Command::Identify(args) => {
            let (settings, folder) = args.settings()?;
            if let (Some(limit), Some(order)) = (settings.recommended.time_limit, settings.recommended.order) {
                let note = format!(
                    "note: the time limit of {limit} s ends the choice of order and dead time; order = {order} is fixed in [recommended], and the \
                     search of a model of that order ends first, however long it takes"
                );
                Progress::new(form.is_silent()).say(&note);
            }
            identify_and_write(form, &args.output_folder, &folder, settings, |s| read_records(&s.data, &folder))
        }
        Command::Synchronise(args) => synchronise::synchronise(form, args),
        Command::Schema => say(&format!("{:#}", settings_schema())),
        Command::Init(args) => init::init(form, args),
        Command::Signals { settings, out } => signals(form, settings, out),
        Command::Report { run } => report(form, run),
        Command::Compare(args) => compare::run(form, args),
        Command::Excite(args) => excite::make(form, args),
        Command::Export(args) => export::export(form, args),
        Command::Plot(args) => plot::plot(form, args),
        Command::Paper(args) => paper::reproduce(form, args),
        Command::Workbench(args) => workbench::workbench(form, args),
        Command::Rig(command) => rig::run(form, command),
        Command::Study(paper::StudyCommand::Merge { parts, out }) => paper::merge_parts(form, parts, out.as_deref()),
    }
}

fn identify_and_write(
    form: Form,
    output: &OutputFolder,
    folder: &Path,
    settings: RunSettings,
    read: impl FnOnce(&RunSettings) -> youla_run::Result<RunRecords>,
) -> Result<(), Failure> {
    // Claimed before the computation, so that of two runs at once none removes the result of the other.
    let place = match &output.out {
        Some(target) => RunFolder::create(target, output.force)?,
        None => RunFolder::numbered(Path::new(""), &settings.name)?,
    };
    place.require_unread(&settings.files(folder))?;
    let progress = Progress::new(form.is_silent());
    let reached = interrupt::without_result(place.unfinished());
    let mut announce = |stage: Stage| {
        interrupt::note(&reached, Some(stage));
        progress.show(&format!("[{}/{}] {}", stage as usize + 1, Stage::COUNT, stage.name()));
    };
    let mut clock = StageClock::new(&mut announce);
    let records = clock.run(Stage::Record, || read(&settings))?;
    let found = identify(settings, records, folder, &mut clock)?;
    let written = write_into(&found, place, &mut clock)?;
    interrupt::note(&reached, None);
    progress.clear();
    form.print(|| serde_json::json!(written.summary), || table::results(&found, &written))?;
    found.redesign_reservation().map_or(Ok(()), |why| Err(Failure::Refused(why, youla::ErrorKind::Numerical)))
}

fn signals(form: Form, settings: &Path, out: &Path) -> Result<(), Failure> {
    let folder = folder_of(settings);
    let settings = RunSettings::read(settings)?;
    let records = read_records(&settings.data, &folder)?;
    let factorisation = factorise_run(&settings, &records, &folder)?;
    let signals = signal_records(&factorisation.factors, &records)?;
    let read: Vec<PathBuf> = records.sources.iter().map(|source| folder.join(&source.path)).collect();
    let read: Vec<&Path> = read.iter().map(PathBuf::as_path).collect();
    signals.iter().try_for_each(|r| require_free(&out.join(format!("{}.csv", r.name())), true, &read))?;
    let paths = write_signals(&signals, out)?;
    let written: Vec<(usize, String)> = signals
        .iter()
        .map(|record| record.samples())
        .zip(paths.iter().map(|path| path.display().to_string()))
        .collect();
    form.print(
        || written.iter().map(|(samples, file)| serde_json::json!({ "file": file, "samples": samples })).collect(),
        || written.iter().map(|(samples, file)| format!("{file} ({samples} samples)")).collect::<Vec<_>>().join("\n"),
    )
}

fn report(form: Form, run: &Path) -> Result<(), Failure> {
    let path = redraw(run)?;
    form.print(|| serde_json::json!({ "report": path.display().to_string() }), || path.display().to_string())
}
