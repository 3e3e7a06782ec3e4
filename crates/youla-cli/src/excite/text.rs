//! An excitation in words and tables.

use crate::table::aligned;
use std::fmt::Write;
use youla::identify::likelihood::figure;
use youla_run::RunExcitation;

/// What the excitation is, what the loop will do under it and how well the modes will be known.
pub(super) fn of(found: &RunExcitation) -> String {
    let s = &found.excited.summary;
    let mut text = found.about().join("\n");
    text += "\n\n";
    let mut rows = vec![["input", "peak", "rms", "crest", "energy in the band"].map(str::to_owned).to_vec()];
    for input in &s.inputs {
        let crest = input.crest.map_or("-".to_owned(), |c| format!("{c:.2}"));
        let share = format!("{:.1} %", 100.0 * input.in_band);
        rows.push(vec![input.channel.label(), format!("{:.4}", input.peak), format!("{:.4}", input.rms), crest, share]);
    }
    text += &aligned(&rows);
    if let Some(factor) = s.scaled_by {
        let _ = writeln!(text, "\nscaled by {factor:.4} to keep the limits");
    }
    for notch in &s.notches {
        let share = notch.share.iter().fold(0.0_f64, |most, x| most.max(*x));
        let level = notch.decibels.iter().flatten().fold(f64::NEG_INFINITY, |most, x| most.max(*x));
        let [low, high] = notch.band;
        let _ = write!(text, "\nleft from {low:.2} to {high:.2} Hz: {:.1e} of the energy", share);
        if level.is_finite() {
            let _ = write!(text, ", {level:.0} dB against the band");
        }
    }
    text += if s.notches.is_empty() { "\n" } else { "\n\n" };
    text += &predicted(found);
    text += &accuracy(found);
    text
}

fn predicted(found: &RunExcitation) -> String {
    let s = &found.excited.summary;
    let wrong = &s.model_error;
    let theta = 100.0 * wrong.theta;
    let mut rows = vec![vec![
        "predicted, nominal loop".to_owned(),
        "largest".to_owned(),
        "limit".to_owned(),
        format!("with a model off by {theta} %"),
    ]];
    for p in &s.predicted {
        let limit = p.limit.map_or("-".to_owned(), |l| l.to_string());
        rows.push(vec![p.channel.label(), format!("{:.4}", p.peak), limit, format!("{:.4}", p.with_model_error)]);
    }
    let mut text = aligned(&rows);
    text += "The excitation alone: noise, unbalance and the point of operation come on top of it.\n";
    if !wrong.a_varied {
        text += "Only B was varied: the model has no matrix A in continuous time.\n";
    }
    if !wrong.unstable.is_empty() {
        let _ = writeln!(text, "caution: the loop is not stable with {}", wrong.unstable.join(", "));
    }
    found.cautions.iter().for_each(|told| text += &format!("caution: {told}\n"));
    text
}

fn accuracy(found: &RunExcitation) -> String {
    let s = &found.excited.summary;
    if s.noise.is_empty() {
        return String::new();
    }
    let mut header = ["mode of the nominal model", "Hz", "+-", "damping", "+-"].map(str::to_owned).to_vec();
    header.extend(s.damping_deviation.map(|wanted| format!("length for +- {wanted}")));
    let mut rows = vec![header];
    for (k, mode) in s.modes.iter().enumerate() {
        let digits = |x: Option<f64>| x.map_or("not determined".to_owned(), |x| format!("{x:.2e}"));
        let mut row = vec![(k + 1).to_string(), figure(mode.hz), digits(mode.hz_deviation)];
        row.extend([figure(mode.zeta), digits(mode.zeta_deviation)]);
        if s.damping_deviation.is_some() {
            row.push(mode.needed.map_or("-".to_owned(), |needed| format!("{} s", figure(needed))));
        }
        rows.push(row);
    }
    let noise: Vec<String> = s.noise.iter().map(|n| figure(*n)).collect();
    let mut text = format!("\n{}", aligned(&rows));
    let _ = writeln!(text, "The best that an unbiased estimate can reach with output noise of {}.", noise.join(", "));
    text
}
