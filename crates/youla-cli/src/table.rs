//! The table at the end of a run.

use crate::terminal;
use std::fmt::Write;
use youla::error::short;
use youla::identify::likelihood::figure;
use youla_loop::redesign::structured::PidController;
use youla_paper::run::WrittenPaper;
use youla_paper::study::{Paper, StudyExperiment, StudyMethod};
use youla_report::numbers::fit;
use youla_run::{Identification, ModelValidation, WrittenRun, cautions, low_fit, undecided};

/// Fits, orders and loops of all models, and where everything is.
pub(crate) fn results(found: &Identification, written: &WrittenRun) -> String {
    let mut text = format!("{}\n", short(&found.settings.name));
    if let Ok(model) = &found.recommended {
        text += &format!("{}\n", model.sentence());
        model.reasons().iter().for_each(|reason| text += &format!("  {reason}\n"));
    }
    text.push('\n');
    text += &fitted(&rows(found), terminal::width().unwrap_or(usize::MAX));
    if let Some(new) = &written.summary.pid {
        text += &new_gains(&new.controllers, &written.folder.display().to_string());
    }
    for refusal in found.refusals() {
        let _ = write!(text, "\nno {}: {}", refusal.what, refusal.error);
    }
    if let Some(sentence) = low_fit(found, &written.summary) {
        let _ = write!(text, "\n{sentence}");
    }
    for caution in cautions(found, &written.summary) {
        let _ = write!(text, "\ncaution: {caution}");
    }
    let folder = &written.folder;
    let _ = write!(text, "\nrun folder: {}\nreport:     {}", folder.display(), folder.join("report.html").display());
    text
}

/// The gains of a new PID, or of one for each loop, and the command that writes them for the machine.
fn new_gains(controllers: &[PidController], folder: &str) -> String {
    let mut text = String::new();
    for (k, PidController { gains, notches, .. }) in controllers.iter().enumerate() {
        let of_loop = if controllers.len() > 1 { format!(" of loop {}", k + 1) } else { String::new() };
        let [kp, ki, kd, filter] = [gains.kp, gains.ki, gains.kd, gains.derivative_filter].map(figure);
        let _ = write!(text, "\nnew PID{of_loop}: kp {kp}, ki {ki} 1/s, kd {kd} s, derivative_filter {filter} s");
        notches.iter().for_each(|notch| text += &format!(", notch at {} Hz", figure(notch.hz)));
    }
    let of_loop = if controllers.len() > 1 { ", with --loop N," } else { "" };
    text + &format!("\n  youla export {folder} --to gains, c-pid or st{of_loop} writes it")
}

/// Table 1, what became of the paper's claims, and where everything is.
pub(crate) fn paper(paper: &Paper, written: &WrittenPaper) -> String {
    let experiments = &paper.experiments.list;
    let row = |label: &str, fits: &dyn Fn(&StudyExperiment) -> [f64; 2]| {
        let cells = experiments.iter().flat_map(fits).map(|fit| format!("{fit:.1}"));
        std::iter::once(label.to_owned()).chain(cells).collect()
    };
    let titles = experiments.iter().flat_map(|e| [e.case.title.clone(), String::new()]);
    let mut rows = vec![std::iter::once("Table 1: fit (26), percent, H and V".to_owned()).chain(titles).collect()];
    for (k, method) in experiments.first().into_iter().flat_map(|e| &e.models).map(|m| m.method).enumerate() {
        rows.push(row(method.label(), &|e| e.models[k].fit));
        let published = [StudyMethod::Nominal, StudyMethod::Pem, StudyMethod::Hansen, StudyMethod::HansenReduced];
        if let Some(place) = published.iter().position(|m| *m == method) {
            rows.push(row("  in the paper", &|e| e.case.published[place]));
        }
    }
    let mut text = aligned(&rows);
    for claim in &written.claims {
        let _ = write!(text, "\n{} ({}): {}", claim.source, claim.outcome.words(), claim.text);
    }
    let folder = written.folder.display();
    let _ = write!(text, "\nresults: {folder}\nreport:  {}", written.folder.join("report.html").display());
    text
}

/// One column per model; fits of every record and output, then order, stability and loop.
fn rows(found: &Identification) -> Vec<Vec<String>> {
    let models = &found.validation.models;
    let row = |label: &str, cells: Vec<String>| [vec![label.to_owned()], cells].concat();
    let corner = if found.records.verification.is_empty() { "model" } else { "fit on fresh data, percent" };
    let mut rows = vec![row(corner, models.iter().map(|v| v.method.label().into()).collect())];
    for (k, record) in found.records.verification.iter().enumerate() {
        for (i, output) in found.records.outputs.iter().enumerate() {
            let percent = |of: f64| if of.is_finite() { fit(of, 2) } else { "-".to_owned() };
            let fits = models.iter().map(|v| percent(v.records[k].fit[i])).collect();
            rows.push(row(&format!("{}, {}", short(record.name()), short(&output.name)), fits));
        }
    }
    let yes = |b: bool| if b { "yes" } else { "no" }.to_owned();
    // The states of dead time apart from the others.
    let dead_time = found.recommended.as_ref().map_or(0, |model| model.dead_time.iter().sum());
    let order = |v: &ModelValidation| match &found.recommended {
        Ok(model) if v.method == youla_run::Method::Likelihood && dead_time > 0 => {
            format!("{} + {dead_time}", model.order)
        }
        _ => v.model.order().to_string(),
    };
    let label = if dead_time > 0 { "order + dead time" } else { "order" };
    rows.push(row(label, models.iter().map(order).collect()));
    rows.push(row("stable", models.iter().map(|v| yes(v.poles.iter().all(|p| p.norm() < 1.0))).collect()));
    let stabilised = |v: &ModelValidation| match undecided(found, v.method) {
        true => "undecided".to_owned(),
        false => yes(v.certificate.stable),
    };
    rows.push(row("stabilised by K", models.iter().map(stabilised).collect()));
    rows
}

/// A table within a width: side by side where it fits; else in blocks of columns, each with the first column, where every block fits;
/// else one line per cell under the row's first cell.
pub(crate) fn fitted(rows: &[Vec<String>], columns: usize) -> String {
    let count = rows.first().map_or(0, Vec::len);
    let wide = |j: usize| rows.iter().map(|r| r[j].chars().count()).max().unwrap_or(0);
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let mut used = usize::MAX;
    for j in 1..count {
        let needed = wide(j) + 2;
        match blocks.last_mut().filter(|_| used.saturating_add(needed) <= columns) {
            Some(block) => block.push(j),
            None => {
                blocks.push(vec![j]);
                used = wide(0);
            }
        }
        used = used.saturating_add(needed);
        if used > columns && count > 1 {
            return listed(rows, columns);
        }
    }
    let block = |block: &Vec<usize>| {
        let cells =
            |row: &Vec<String>| std::iter::once(0).chain(block.iter().copied()).map(|j| row[j].clone()).collect();
        aligned(&rows.iter().map(cells).collect::<Vec<Vec<String>>>())
    };
    if blocks.is_empty() { aligned(rows) } else { blocks.iter().map(block).collect::<Vec<_>>().join("\n") }
}

/// A row as its first cell and one line `heading: cell` for each other one.
fn listed(rows: &[Vec<String>], columns: usize) -> String {
    let mut text = String::new();
    let Some((head, rest)) = rows.split_first() else { return text };
    for row in rest {
        let _ = writeln!(text, "{}", terminal::wrapped(&row[0], columns));
        for (heading, cell) in head.iter().zip(row).skip(1) {
            let _ = writeln!(text, "{}", terminal::wrapped(&format!("  {heading}: {cell}"), columns));
        }
    }
    text
}

/// Columns as wide as their widest cell, the first left, the others right.
pub(crate) fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |j: usize| rows.iter().map(|r| r[j].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        // Not by the width of a format, which ends at 65535.
        let blanks = |cell: &str, w: usize| " ".repeat(w - cell.chars().count());
        text += &format!("{}{}", row[0], blanks(&row[0], widths[0]));
        for (cell, w) in row.iter().zip(&widths).skip(1) {
            text += &format!("  {}{cell}", blanks(cell, *w));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(cells: &[&[&str]]) -> Vec<Vec<String>> {
        cells.iter().map(|row| row.iter().map(|cell| (*cell).to_owned()).collect()).collect()
    }

    /// A format ends in a panic there.
    #[test]
    fn names_may_be_longer_than_the_width_of_a_format() {
        let long = "x".repeat(70_000);
        let text = aligned(&table(&[&["a", "1"], &[&long, "2"]]));
        assert_eq!(text.lines().map(str::len).collect::<Vec<_>>(), [70_003; 2]);
    }

    #[test]
    fn tables_keep_the_width_they_are_given() {
        let rows = table(&[&["fit", "nominal", "direct", "hansen"], &["rest, y", "1.0", "2.0", "3.0"]]);
        assert_eq!(fitted(&rows, 80), aligned(&rows));
        let narrow = fitted(&rows, 24);
        assert!(narrow.lines().all(|line| line.chars().count() <= 24), "{narrow}");
        assert!(narrow.contains("direct") && narrow.contains("\n\nfit"), "{narrow}");
        let sentence = table(&[
            &["Run", "Verdict"],
            &["a", "It must not be trusted, for the reasons below, of which there are many"],
        ]);
        let listed = fitted(&sentence, 40);
        assert!(
            listed.starts_with("a\n  Verdict: It must") && listed.lines().all(|l| l.chars().count() <= 40),
            "{listed}"
        );
    }
}
