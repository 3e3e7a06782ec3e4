//! The table at the end of a run.

use std::fmt::Write;
use std::path::Path;
use youla::identify::subspace::{Factorisation, InputFit};
use youla_paper::run::WrittenPaper;
use youla_paper::study::{Method, Paper, StudyExperiment};
use youla_run::{Identification, LongModel, cautions};

/// Fits, orders and loops of all models, and where everything is.
pub(crate) fn results(found: &Identification, folder: &Path) -> String {
    let mut text = format!("{}\n\n", found.settings.name);
    text += &aligned(&rows(found));
    text += &modes(found);
    for refusal in found.refusals() {
        let _ = write!(text, "\nno {}: {}", refusal.what, refusal.error);
    }
    for caution in cautions(found) {
        let _ = write!(text, "\ncaution: {caution}");
    }
    let _ = write!(text, "\nrun folder: {}\nreport:     {}", folder.display(), folder.join("report.html").display());
    text
}

/// Modes of G(S) with their standard deviations, where these were asked for.
fn modes(found: &Identification) -> String {
    let mut text = String::new();
    let Some(plant) = found.uncertainty(youla_run::Method::Hansen) else { return text };
    for band in plant.modes.iter().filter(|band| band.mode.pole.im > 0.0) {
        let (mode, hz, zeta) = (band.mode, band.hz_deviation, band.zeta_deviation);
        let _ =
            write!(text, "\nmode of G(S): {:.2} +- {hz:.2} Hz, damping ratio {:.4} +- {zeta:.4}", mode.hz, mode.zeta);
    }
    text
}

/// Order, modes, fit and how the data were factored.
pub(crate) fn subspace(model: &LongModel, peak_memory: Option<f64>) -> youla_run::Result<String> {
    let found = &model.found;
    let factor = match (found.factor.by, found.factor.condition) {
        (Factorisation::Qr, None) => "QR".to_owned(),
        (Factorisation::Qr, Some(condition)) => format!("QR (condition {condition:.1e})"),
        (_, condition) => format!("Gram matrix (condition {:.1e})", condition.unwrap_or(f64::NAN)),
    };
    let mut text = format!("{} samples, {} passes\n", model.samples, model.passes);
    let _ = write!(text, "order {}, data factored by {factor}\n\n", found.order.order);
    let mut rows = vec![["mode", "Hz", "damping"].map(str::to_owned).to_vec()];
    for (k, mode) in found.model.modes()?.iter().enumerate() {
        rows.push(vec![(k + 1).to_string(), format!("{:.4}", mode.hz), format!("{:.5}", mode.zeta)]);
    }
    text += &aligned(&rows);
    let by = match found.fit.by {
        InputFit::Simulation => "simulated",
        InputFit::Prediction | InputFit::Observer => "predicted one step ahead",
    };
    let mut rows = vec![vec![format!("fit, {by}"), "percent".to_owned()]];
    let outputs = model.outputs.iter().zip(&found.fit.percent);
    rows.extend(outputs.map(|(channel, percent)| vec![channel.name.clone(), format!("{percent:.2}")]));
    let _ = write!(text, "\n{}", aligned(&rows).trim_end());
    if let Some(peak) = peak_memory {
        let _ = write!(text, "\n\npeak memory {:.0} MB", peak / 1e6);
    }
    Ok(text)
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
        let published = [Method::Nominal, Method::Pem, Method::Hansen, Method::HansenReduced];
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
    let models = &found.verdict.models;
    let row = |label: &str, cells: Vec<String>| [vec![label.to_owned()], cells].concat();
    let corner = if found.records.verification.is_empty() { "model" } else { "fit (26), percent" };
    let mut rows = vec![row(corner, models.iter().map(|v| v.method.label().into()).collect())];
    for (k, record) in found.records.verification.iter().enumerate() {
        for (i, output) in found.records.outputs.iter().enumerate() {
            // A model that nearly diverges has a fit that no column holds.
            let percent = |fit: f64| match fit {
                _ if !fit.is_finite() => "-".to_owned(),
                _ if fit < -9999.0 => format!("{fit:.1e}"),
                _ => format!("{fit:.2}"),
            };
            let fits = models.iter().map(|v| percent(v.records[k].fit[i])).collect();
            rows.push(row(&format!("{}, {}", record.name, output.name), fits));
        }
    }
    let yes = |b: bool| if b { "yes" } else { "no" }.to_owned();
    rows.push(row("order", models.iter().map(|v| v.model.order().to_string()).collect()));
    rows.push(row("stable", models.iter().map(|v| yes(v.poles.iter().all(|p| p.norm() < 1.0))).collect()));
    rows.push(row("stabilised by K", models.iter().map(|v| yes(v.certificate.stable)).collect()));
    rows
}

/// Columns as wide as their widest cell, the first left, the others right.
pub(crate) fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |j: usize| rows.iter().map(|r| r[j].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let _ = write!(text, "{:<w$}", row[0], w = widths[0]);
        for (cell, w) in row.iter().zip(&widths).skip(1) {
            let _ = write!(text, "  {cell:>w$}");
        }
        text.push('\n');
    }
    text
}
