//! The table at the end of a run.

use std::fmt::Write;
use std::path::Path;
use youla::run::{Identification, ModelVerdict};

/// Fits, orders and loops of all models, and where everything is.
pub(crate) fn results(found: &Identification, folder: &Path) -> String {
    let mut rows = vec![header(found)];
    rows.extend(found.verdict.models.iter().map(|v| model_row(found, v)));
    let mut text = format!("{}\n\nfit (26) on verification records, percent\n", found.settings.name);
    text += &aligned(&rows);
    for (name, refusal) in [
        ("no direct model", found.direct.as_ref().and_then(|d| d.as_ref().err())),
        ("no reduced model", found.reduction.as_ref().and_then(|r| r.as_ref().err())),
    ] {
        if let Some(reason) = refusal {
            let _ = write!(text, "\n{name}: {reason}");
        }
    }
    let _ = write!(text, "\nrun folder: {}\nreport:     {}", folder.display(), folder.join("report.html").display());
    text
}

fn header(found: &Identification) -> Vec<String> {
    let mut row = vec!["model".to_owned()];
    for record in &found.records.verification {
        row.extend(found.records.outputs.iter().map(|y| format!("{} {}", record.name, y.name)));
    }
    row.extend(["order", "stable", "stabilised by K"].map(str::to_owned));
    row
}

fn model_row(found: &Identification, v: &ModelVerdict) -> Vec<String> {
    let yes = |b: bool| if b { "yes" } else { "no" }.to_owned();
    let mut row = vec![v.method.label().to_owned()];
    for record in &v.records {
        row.extend(record.fit.iter().map(|f| if f.is_finite() { format!("{f:.2}") } else { "-".into() }));
    }
    let stable = v.poles.iter().all(|p| p.norm() < 1.0);
    debug_assert_eq!(v.records.len(), found.records.verification.len());
    row.extend([v.model.order().to_string(), yes(stable), yes(v.certificate.stable)]);
    row
}

/// Columns as wide as their widest cell, the first left, the others right.
fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |j: usize| rows.iter().map(|r| r[j].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        for (j, cell) in row.iter().enumerate() {
            let _ = if j == 0 {
                write!(text, "{cell:<w$}", w = widths[j])
            } else {
                write!(text, "  {cell:>w$}", w = widths[j])
            };
        }
        text.push('\n');
    }
    text
}
