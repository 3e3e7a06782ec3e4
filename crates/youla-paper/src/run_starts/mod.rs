//! `youla study starts`: how often searches converge, in one results folder, resumable.

use crate::run::configuration::{FILE, claim, not_toml};
use crate::run::results::{figure_files, folder, json, table_file};
use crate::story_starts::{Starts, starts_methods, starts_story};
use crate::study::{
    Campaign, Outcome, Search, StartCase, StartCount, StartFailure, StartRow, StartsSettings, evaluate_starts,
    start_counts, start_failures,
};
use crate::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use toml::Table;
use youla_io::folder::replace_file;
use youla_report::story::Block;
use youla_report::story_html;

/// Events of a run.
#[derive(Debug, Clone, Copy)]
pub enum StartsProgress<'a> {
    /// A case begins; the number of its items, of which some may be done already.
    Begins(StartCase, usize),
    /// Items of the case that are done.
    Done(usize),
    /// A file of an earlier call was continued: items found, and damaged or incomplete rows that are computed again.
    Continued {
        /// The file.
        path: &'a Path,
        /// Items that were complete.
        items: usize,
        /// Rows that are computed again.
        redone: usize,
    },
}

/// A finished results folder.
#[derive(Debug, Clone)]
pub struct WrittenStarts {
    /// Where it is.
    pub folder: PathBuf,
    /// What became of the items, per case and search.
    pub counts: Vec<StartCount>,
    /// The items that the searches without a start did not solve.
    pub failures: Vec<StartFailure>,
}

/// Computes the study into `target`: the items of each case as far as they are not there yet, as `<case>.csv`, then
/// `summary.json`, figures, tables and the page.
///
/// Results do not depend on threads and interruptions; `timing.json` does.
///
/// # Errors
/// [`Error::OtherSettings`] naming the difference where the folder belongs to other settings, [`youla_io::Error::OutputExists`] where it
/// holds something else; [`youla::Error::OutOfRange`]; those of an item, with what has been computed kept.
pub fn starts(
    settings: &StartsSettings,
    target: &Path,
    notify: &(dyn Fn(StartsProgress<'_>) + Sync),
) -> Result<WrittenStarts> {
    settings.check()?;
    claim(target, &configuration(settings)?, read)?;
    let mut found = Starts { settings: settings.clone(), cases: Vec::new() };
    let mut times = Vec::new();
    for case in &settings.cases {
        let outcome = items(*case, settings, target, notify)?;
        times.push(Time::of(*case, &outcome));
        found.cases.push((*case, outcome.rows));
    }
    json(&target.join("timing.json"), &times)?;
    write(found, target)
}

/// Settings with program and version.
fn configuration(settings: &StartsSettings) -> Result<Table> {
    #[derive(Serialize)]
    struct Configuration<'a> {
        program: &'static str,
        starts: &'a StartsSettings,
    }
    let program = concat!("youla ", env!("CARGO_PKG_VERSION"));
    Table::try_from(Configuration { program, starts: settings }).map_err(|e| not_toml(&e))
}

/// The configuration of a results folder.
fn read(target: &Path) -> Result<Table> {
    let path = target.join(FILE);
    let text = std::fs::read_to_string(&path)
        .map_err(|source| Error::File(youla_io::Error::Io { path: path.clone(), source }))?;
    Ok(youla_io::toml_file::parse(&text, &path)?)
}

fn items(
    case: StartCase,
    settings: &StartsSettings,
    target: &Path,
    notify: &(dyn Fn(StartsProgress<'_>) + Sync),
) -> Result<Outcome<StartRow>> {
    let campaign = Campaign {
        path: target.join(format!("{}.csv", case.key())),
        items: 0..settings.items(case),
        rows_per_item: Search::of(case).count(),
    };
    notify(StartsProgress::Begins(case, campaign.items.len()));
    let continued = |items: usize, redone: usize| {
        if items + redone > 0 {
            notify(StartsProgress::Continued { path: &campaign.path, items, redone });
        }
    };
    let evaluate = |index: usize| {
        let named = |e: Error| e.within(format!("item {index} of {}", case.key()));
        evaluate_starts(case, index, settings).map_err(named)
    };
    campaign.run(evaluate, &continued, &|done| notify(StartsProgress::Done(done)))
}

/// Mean processor milliseconds per item of this call.
#[derive(Serialize)]
struct Time {
    case: StartCase,
    items: usize,
    records_ms: f64,
    search_ms: Vec<(Search, f64)>,
}

impl Time {
    fn of(case: StartCase, outcome: &Outcome<StartRow>) -> Self {
        let seconds = |part: usize| outcome.durations.get(part).map_or(0.0, std::time::Duration::as_secs_f64);
        let mean = |part: usize| 1e3 * seconds(part) / outcome.computed.max(1) as f64;
        let search_ms = Search::of(case).enumerate().map(|(k, search)| (search, mean(k + 1))).collect();
        Time { case, items: outcome.computed, records_ms: mean(0), search_ms }
    }
}

/// Summary, figures, tables and the page.
fn write(found: Starts, target: &Path) -> Result<WrittenStarts> {
    let counts: Vec<StartCount> = found.cases.iter().flat_map(|(case, rows)| start_counts(*case, rows)).collect();
    let failures: Vec<StartFailure> = found.cases.iter().flat_map(|(case, rows)| start_failures(*case, rows)).collect();
    json(
        &target.join("summary.json"),
        &Summary { seed: found.settings.paper.seed, counts: &counts, failures: &failures },
    )?;
    let story = starts_story(&found);
    let (figures, tables, methods) = (folder(target, "figures")?, folder(target, "tables")?, starts_methods());
    for block in story.sections.iter().flat_map(|section| &section.blocks) {
        match block {
            Block::Figure(figure) => figure_files(&figures, figure, &methods)?,
            Block::Table(table) => table_file(&tables, table)?,
            Block::Text(_) | Block::List(_) | Block::Listing { .. } => {}
        }
    }
    replace_file(&target.join("report.html"), &story_html(&story)?)?;
    Ok(WrittenStarts { folder: target.to_owned(), counts, failures })
}

/// The same numbers for scripts.
#[derive(Serialize)]
struct Summary<'a> {
    seed: u64,
    counts: &'a [StartCount],
    failures: &'a [StartFailure],
}
