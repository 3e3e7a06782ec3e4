//! `youla study starts`: settings from the arguments, progress, the counts at the end.

use crate::args::{Args, StartsArgs};
use crate::output::{Failure, say};
use crate::paper::Bar;
use std::path::Path;
use youla_paper::run_starts::{StartsProgress, WrittenStarts, starts};
use youla_paper::study::{StartCase, StartsSettings};

/// Counts how often searches arrive.
pub(crate) fn count(args: &Args, asked: &StartsArgs) -> Result<(), Failure> {
    let cases = asked.cases.clone().unwrap_or_else(|| StartCase::ALL.to_vec());
    let settings = StartsSettings::shipped(&cases, asked.items, asked.seed);
    let default = || Path::new("runs").join(format!("starts-seed-{}", asked.seed));
    let target = asked.out.clone().unwrap_or_else(default);
    let bar = Bar::new(args.quiet || args.json);
    let written = starts(&settings, &target, &|progress| match progress {
        StartsProgress::Begins(case, items) => bar.begin(case.key(), items),
        StartsProgress::Done(items) => bar.bar.set_position(items as u64),
        StartsProgress::Continued { path, items, redone } => bar.continued(path, &format!("{items} items"), redone),
    })?;
    bar.bar.finish_and_clear();
    if args.quiet {
        return Ok(());
    }
    if args.json {
        let path = target.join("summary.json");
        return say(std::fs::read_to_string(&path).map_err(|e| Failure::io(&path, e))?.trim_end());
    }
    say(&table(&written))
}

fn table(written: &WrittenStarts) -> String {
    let row = |c: &youla_paper::study::StartCount| {
        let without = if c.without_loop > 0 { format!(", {} without a loop", c.without_loop) } else { String::new() };
        format!("{:<14}{:<20}{:>5} of {:>4} arrived{without}", c.case.key(), c.search.label(), c.arrived, c.items)
    };
    let lines: Vec<String> = written.counts.iter().map(row).collect();
    format!("{}\n\n{}", lines.join("\n"), written.folder.join("report.html").display())
}
