//! A new PID on the page.

use super::decibels::decibel;
use super::redesign::loops;
use youla::identify::likelihood::figure as digits;
use youla_io::export::weighted_error;
use youla_loop::redesign::structured::{Band, FigureBand, PidController, PidRedesign, PlannedStep, ReferenceWeights};
use youla_report::data::{self, DrawnMethod, EvidenceTable, LineStatus, MethodRole, ReportPart, Verdict};
use youla_report::figure::{Area, Axis, Content, Curve, Figure, Layout, Panel};

/// The section of the page.
pub(super) fn drawn(new: &PidRedesign) -> data::DrawnRedesign {
    data::DrawnRedesign { loops: steps(), figure: figure(new), tables: tables(new) }
}

/// What the new controller promises.
pub(super) fn line(new: &PidRedesign) -> Verdict {
    let good = new.reservations().is_empty() && new.rejection() >= 1.0;
    let status = if good { LineStatus::Good } else { LineStatus::Caution };
    Verdict { status, text: sentence(new), evidence: ReportPart::Redesign }
}

fn sentence(new: &PidRedesign) -> String {
    let proof = &new.proof;
    let kept = match new.reservations()[..] {
        [] => format!(
            "All limits hold at {} of {} fresh models of the region and none is unstable: the probability that they do not hold is at most \
             {:.1} %",
            proof.models - proof.missed,
            proof.models,
            100.0 * proof.at_most
        ),
        _ => format!("Do not take it as it is: {}", new.reservations().join("; ")),
    };
    let who = match new.controllers.len() {
        1 => "The new PID rejects".to_owned(),
        loops => format!("The new PIDs of {loops} loops reject"),
    };
    let slow_loads = match new.rejection() {
        better if better >= 1.0 => format!("{who} slow loads {} times as well as the running controller", times(new)),
        _ => format!(
            "{who} slow loads worse than the running controller, {} times as well, which is the price of the limits",
            times(new)
        ),
    };
    format!(
        "{slow_loads}. The running controller misses a limit at {} of {} models. {kept}. This is a prediction: the controller has not run yet.",
        proof.running_missed, proof.models
    )
}

/// How many times as well slow loads are rejected, loop by loop.
fn times(new: &PidRedesign) -> String {
    new.rejections.iter().map(|times| format!("{times:.2}")).collect::<Vec<_>>().join(" and ")
}

/// The three steps as the figure names them.
pub(crate) fn steps() -> Vec<DrawnMethod> {
    let [running, new] = loops();
    vec![running, DrawnMethod::new("half", "half way", MethodRole::Direct), new]
}

fn key(step: &PlannedStep) -> &'static str {
    if step.name == "running" { "present" } else { step.name }
}

fn tables(new: &PidRedesign) -> Vec<EvidenceTable> {
    let band = |[low, middle, high]: Band| match [shown(low), shown(high)] {
        [from, to] if from == to => shown(middle),
        [from, to] => format!("{} ({from} to {to})", shown(middle)),
    };
    let several = new.controllers.len() > 1;
    let row = |f: &FigureBand| {
        let of = if several { format!("loop {}: ", f.channel + 1) } else { String::new() };
        let unit = if f.unit.is_empty() { String::new() } else { format!(", {}", f.unit) };
        let name = format!("{of}{}{unit}", f.name.replace('_', " "));
        vec![name, f.limit.map_or("–".into(), digits), band(f.running), band(f.new)]
    };
    let step = |s: &PlannedStep| {
        let gains = s.controllers.as_ref().map_or("no PID".into(), |of| all_gains(of));
        let each = |of: Vec<String>| of.join(", ");
        let mut overshoots = each(s.overshoots.iter().map(|share| digits(100.0 * share)).collect());
        if overshoots.is_empty() {
            overshoots = "not predicted".into();
        }
        let none = |time: &f64| if *time > 0.0 { digits(*time) } else { "none".into() };
        let filters = each(s.reference_filters.iter().map(none).collect());
        vec![
            s.name.into(),
            gains,
            band(s.peak_sensitivity),
            band(s.phase_margin),
            band(s.bandwidth),
            overshoots,
            filters,
        ]
    };
    vec![
        EvidenceTable {
            text: sentence(new),
            caption: format!(
                "Medians with 95 % bands over {} models that the search has not seen{}. The command effort is the rms of u per rms of white \
                 noise of the sensor; its limit is that at the median.",
                new.proof.models,
                if several { "; each loop while the others are closed" } else { "" }
            ),
            ..EvidenceTable::new(
                "Limits, running and new",
                &["Figure", "Limit", "Running", "New"],
                new.proof.figures.iter().map(row).collect(),
            )
        },
        EvidenceTable {
            caption: format!(
                "Change the gains in these steps, each stable at all models; revert.json holds the running controller. Gains in parallel form, \
                 negative feedback. {}",
                of_reference(new.reference_weights.as_deref())
            ),
            ..EvidenceTable::new(
                "The way to the new controller",
                &[
                    "Step",
                    "Gains",
                    "Peak sensitivity",
                    "Phase margin",
                    "Bandwidth, Hz",
                    "Overshoot, %",
                    "Reference filter T, s",
                ],
                new.steps.iter().map(step).collect(),
            )
        },
    ]
}

/// What the columns of the step of the reference say.
fn of_reference(weights: Option<&[ReferenceWeights]>) -> String {
    let Some(weights) = weights else {
        return "The path from the reference is no PID with weights of the reference: its step is not predicted."
            .into();
    };
    let filter = "Overshoot after a step of the reference, upper end of the band; a filter of the reference with the time constant in the last \
                  column, w += ts / (ts + T) (r - w), keeps it to 10 % and changes nothing in the loop.";
    let weight = |w: &ReferenceWeights| {
        format!("kp takes {} and kd {}", weighted_error(w.proportional), weighted_error(w.derivative))
    };
    match weights.iter().all(|w| *w == ReferenceWeights::ERROR) {
        true => filter.into(),
        false => format!(
            "{filter} The reference enters as in the running controller: {}.",
            weights.iter().map(weight).collect::<Vec<_>>().join("; ")
        ),
    }
}

fn shown(value: f64) -> String {
    if value == f64::INFINITY { "∞".into() } else { digits(value) }
}

/// The gains of all loops in one line.
fn all_gains(of: &[PidController]) -> String {
    match of {
        [one] => gains(one),
        _ => of.iter().enumerate().map(|(k, c)| format!("loop {}: {}", k + 1, gains(c))).collect::<Vec<_>>().join("; "),
    }
}

/// The gains in one line.
fn gains(c: &PidController) -> String {
    let g = &c.gains;
    let parts = [("kp", g.kp, ""), ("ki", g.ki, " /s"), ("kd", g.kd, " s"), ("filter", g.derivative_filter, " s")];
    let there = parts.into_iter().filter(|(_, value, _)| *value != 0.0);
    let mut text: Vec<String> = there.map(|(name, value, unit)| format!("{name} {}{unit}", gain(value))).collect();
    let notch = |n: &youla_loop::redesign::structured::Notch| {
        format!("notch at {} Hz, width {}, depth {}", digits(n.hz), digits(n.width), digits(n.depth))
    };
    text.extend(c.notches.iter().map(notch));
    text.join(", ")
}

/// Five significant digits, as one types them in.
fn gain(value: f64) -> String {
    let place = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&place) {
        return format!("{value:.4e}");
    }
    let text = format!("{value:.*}", (4.0 - place).max(0.0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Sensitivities, step responses and commands with their bands.
pub(crate) fn figure(new: &PidRedesign) -> Figure {
    let axis = |label: &str, unit: &str, log| Axis { label: label.into(), unit: unit.into(), log, ..Axis::default() };
    let decibels = |bands: &[Band]| bands.iter().map(|b| b.map(decibel)).collect::<Vec<Band>>();
    let hz = &new.proof.hz;
    let of = |key: &str, bands: &[Band]| (key.to_owned(), hz.clone(), decibels(bands));
    let several = new.controllers.len() > 1;
    let title = |what: &str, i: usize| if several { format!("{what}, loop {}", i + 1) } else { what.to_owned() };
    let loops = new.proof.sensitivities.iter().enumerate();
    let sensitivity = |(i, [before, after]): (usize, &[Vec<Band>; 2])| {
        let axes = (axis("Frequency", "Hz", true), axis("Magnitude", "dB", false));
        panel(&title("Sensitivity", i), axes, vec![of("present", before), of("new", after)])
    };
    let over_time = |what: &str, i: usize, y: &str, pick: &dyn Fn(&PlannedStep) -> &Vec<Band>| {
        let curves = new.steps.iter().map(|s| (key(s).to_owned(), s.seconds.clone(), pick(s).clone())).collect();
        panel(&title(what, i), (axis("Time", "s", false), axis(y, "", false)), curves)
    };
    let step = |i: usize| over_time("Step of the reference", i, "y per step", &|s| &s.responses[i]);
    let command = |i: usize| over_time("Command after the step", i, "u per step", &|s| &s.commands[i]);
    let all = 0..new.reference_weights.as_ref().map_or(0, Vec::len);
    let panels = loops.map(sensitivity).chain(all.clone().map(step)).chain(all.map(command)).collect();
    Figure {
        key: "response".into(),
        title: "The loop, running and new".into(),
        caption: "Medians and 95 % bands over models of the region that the search has not seen.".into(),
        layout: Layout::Beside,
        panels,
        ..Figure::default()
    }
}

fn panel(title: &str, (x, y): (Axis, Axis), of: Vec<(String, Vec<f64>, Vec<Band>)>) -> Panel {
    let at = |bands: &[Band], k: usize| bands.iter().map(|b| b[k]).collect::<Vec<f64>>();
    let regions = of.iter().map(|(method, x, bands)| Area {
        method: method.clone(),
        note: "95 %".into(),
        x: x.clone(),
        low: at(bands, 0),
        high: at(bands, 2),
    });
    let regions = regions.collect();
    let curve =
        |(method, x, bands): (String, Vec<f64>, Vec<Band>)| Curve { method, y: at(&bands, 1), x, ..Curve::default() };
    let content = Content::Curves(of.into_iter().map(curve).collect());
    Panel { title: title.into(), x, y, content, regions, ..Panel::default() }
}
