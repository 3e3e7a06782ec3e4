//! What the report of a run shows: plain data, drawn by [`youla_report`].

pub(crate) mod choices;
pub(crate) mod further;
pub(crate) mod margins;
pub(crate) mod notes;
pub(crate) mod residuals;
pub(crate) mod verdict;

mod frequency;

use crate::Result;
use crate::method::Method;
use crate::page::further::further_lines;
use crate::page::margins as robustness;
use crate::page::notes::notes;
use crate::page::residuals::drawn as drawn_residuals;
use crate::page::verdict::verdict_lines;
use crate::records::{LoopRecord, channels_of};
use crate::result::Identification;
use crate::settings::Prediction;
use crate::stages::clock::StageTimes;
use crate::stages::grey_box::GreyBoxRun;
use crate::stages::redesign;
use crate::stages::stabilisation::drawn;
use crate::stages::validate::ModelVerdict;
use crate::summary::entries::pairs;
use crate::summary::recommended;
use youla::MatRef;
use youla::identify::likelihood::ModeEstimate;
use youla::identify::subspace::SubspaceModel;
use youla::signal::Channel;
use youla_loop::check::{Finding, Severity};
use youla_report::data::{self as draw, ReportData, Role, SignalKind};
use youla_report::{Timeline, Trace};

/// Collects what the report of a run shows; `run` names the run folder.
///
/// # Errors
/// Those of the frequency responses, and settings that TOML cannot hold.
pub fn page(found: &Identification, seconds: &StageTimes, run: &str) -> Result<ReportData> {
    Ok(ReportData {
        title: found.settings.name.clone(),
        summary: summary_sentence(found),
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        run: run.to_owned(),
        settings: found.settings.to_toml()?,
        sources: sources(found),
        inputs: found.records.inputs.clone(),
        outputs: found.records.outputs.clone(),
        sample_time: Some(found.records.time.ts()),
        methods: found.verdict.models.iter().map(|v| method(v.method)).collect(),
        overview: Vec::new(),
        verdict: verdict_lines(found),
        further: further_lines(found),
        notes: notes(found),
        fits: fits(found),
        findings: findings(found),
        experiments: experiments(found)?,
        orders: orders(found),
        stabilisation: diagrams(found),
        verification: found
            .records
            .verification
            .iter()
            .enumerate()
            .map(|(k, r)| verification(found, k, r))
            .collect::<Result<_>>()?,
        residuals: drawn_residuals(found),
        frequency: Some(frequency::drawn(found)?),
        poles: found.verdict.models.iter().map(poles).collect::<Result<_>>()?,
        modes: found.verdict.models.iter().flat_map(|v| modes(found, v)).collect(),
        unlisted: found.verdict.models.iter().filter_map(unlisted).collect(),
        parameters: structure(found).map_or_else(|| Ok(Vec::new()), GreyBoxRun::rows)?,
        physical: structure(found).map(GreyBoxRun::shown),
        reduction: reduction(found),
        certificates: found.verdict.models.iter().map(|v| certificate(found, v)).collect(),
        loop_tables: found.scheme().map_or_else(Vec::new, |s| s.certificate.tables()),
        recommended: recommended::tables(found),
        redesign: redesign(found)?,
        margins: found.verdict.models.iter().map(robustness::row).collect(),
        margins_caption: robustness::caption(found),
        bezout_residual: found.filtered.as_ref().ok().map(|f| f.factorisation.bezout_residual),
        stages: seconds.iter().map(|(s, t)| draw::Stage { name: s.name().into(), seconds: *t }).collect(),
    })
}

fn summary_sentence(found: &Identification) -> String {
    let records = &found.records;
    let samples: usize = records.estimation.iter().map(LoopRecord::samples).sum();
    let how = match found.declared.controller.is_zero() {
        true => "in open loop",
        false => "in closed loop",
    };
    if let Some(measured) = &records.measured {
        let (of, lines) = (if measured.of_loop { "loop" } else { "plant" }, measured.table.omega.len());
        return format!(
            "Identified {how} from the response of the {of} at {lines} frequencies (sample time {} s, {} input{}, {} output{}).",
            records.time.ts(),
            records.inputs.len(),
            plural(records.inputs.len()),
            records.outputs.len(),
            plural(records.outputs.len()),
        );
    }
    format!(
        "Identified {how} from {} record{} ({samples} samples at {} s, {} input{}, {} output{}).",
        records.estimation.len(),
        plural(records.estimation.len()),
        records.time.ts(),
        records.inputs.len(),
        plural(records.inputs.len()),
        records.outputs.len(),
        plural(records.outputs.len()),
    )
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn sources(found: &Identification) -> Vec<draw::Source> {
    let source = |s: &crate::records::SourceFile| draw::Source {
        path: s.path.clone(),
        purpose: s.purpose.clone(),
        sha256: s.sha256.clone(),
    };
    found.records.sources.iter().map(source).collect()
}

fn method(method: Method) -> draw::Method {
    let role = match method {
        Method::Likelihood => Role::Recommended,
        Method::Nominal => Role::Nominal,
        Method::Direct => Role::Direct,
        Method::Hansen => Role::Hansen,
        Method::HansenReduced => Role::HansenReduced,
        Method::GreyBox => Role::HansenPem,
        Method::TruePlant => Role::Other,
    };
    draw::Method::new(method.key(), method.label(), role)
}

fn fits(found: &Identification) -> Vec<draw::Fit> {
    let mut all = Vec::new();
    for v in &found.verdict.models {
        for r in &v.records {
            for (output, fit) in r.fit.iter().enumerate() {
                all.push(draw::Fit {
                    record: r.record.clone(),
                    output,
                    method: v.method.key().into(),
                    fit: fit.is_finite().then_some(*fit),
                });
            }
        }
    }
    all
}

/// What the check of the data found, the most serious first.
fn findings(found: &Identification) -> Vec<draw::DataFinding> {
    let status = |severity: Severity| match severity {
        Severity::Note => draw::Status::Info,
        Severity::Caution => draw::Status::Caution,
        Severity::Defect => draw::Status::Bad,
    };
    let one = |(f, more): (&Finding, usize)| draw::DataFinding {
        status: status(f.severity),
        test: f.test.key().into(),
        record: f.record.clone(),
        channel: f.channel.clone(),
        rows: f.rows,
        what: f.what.clone(),
        advice: f.advice.clone(),
        further: more,
    };
    found.data.grouped().into_iter().map(one).collect()
}

fn experiments(found: &Identification) -> Result<Vec<draw::DrawnExperiment>> {
    found.records.estimation.iter().enumerate().map(|(k, r)| experiment(found, k, r)).collect()
}

fn experiment(found: &Identification, k: usize, record: &LoopRecord) -> Result<draw::DrawnExperiment> {
    let clock = Timeline::around_largest_swing(record.time.ts(), record.y.col_as_slice(0));
    let (u, y) = (&found.records.inputs, &found.records.outputs);
    let named = |prefix: &str, channels: &[Channel]| -> Vec<Channel> {
        channels.iter().map(|c| Channel::new(format!("{prefix} {}", c.name), &c.unit)).collect()
    };
    let mut drawn = Vec::new();
    let mut add = |kind: SignalKind, channels: &[Channel], data: MatRef<'_, f64>| -> Result<()> {
        let dropped = record.samples() - data.nrows();
        for (j, channel) in channels.iter().enumerate() {
            // Samples dropped at the start are a gap, so that all signals share one clock.
            let mut values = vec![f64::NAN; dropped];
            values.extend(data.col(j).iter());
            let trace = Trace::new(&channel.name, &values, &clock)?;
            drawn.push(draw::Signal { kind, channel: channel.clone(), trace });
        }
        Ok(())
    };
    let data = &found.settings.data;
    for (specs, excitation) in [
        (&data.input_excitation, &record.input_excitation),
        (&data.reference, &record.reference),
        (&data.alpha, &record.alpha),
    ] {
        if let Some(excitation) = excitation {
            add(SignalKind::Excitation, &channels_of(specs), excitation.as_ref())?;
        }
    }
    add(SignalKind::Input, u, record.u.as_ref())?;
    add(SignalKind::Output, y, record.y.as_ref())?;
    if let Ok(filtered) = &found.filtered {
        let signals = &filtered.signals.experiments[k];
        add(SignalKind::Alpha, &named("alpha", u), signals.alpha())?;
        add(SignalKind::Beta, &named("beta", y), signals.beta())?;
    }
    Ok(draw::DrawnExperiment { name: record.name.clone(), clock, signals: drawn })
}

fn orders(found: &Identification) -> Vec<draw::OrderChoice> {
    let choice = |method: Method, label: &str, s: &SubspaceModel| draw::OrderChoice {
        method: method.key().into(),
        label: label.into(),
        values: s.singular_values.clone(),
        chosen: s.order.order,
    };
    let mut all = Vec::new();
    if let Some(direct) = found.direct() {
        all.push(choice(Method::Direct, "plant from u to y", direct));
    }
    all.extend(found.scheme().map(|s| choice(Method::Hansen, "S from alpha to beta", &s.hansen.deviation)));
    all
}

fn diagrams(found: &Identification) -> Vec<draw::Stabilisation> {
    let scheme = found.scheme().and_then(|s| Some((s.diagram.as_ref().ok()?, s.hansen.deviation.order.order)));
    let mut all = Vec::new();
    let direct = found.direct_diagram.as_ref().and_then(|d| d.as_ref().ok()).zip(found.direct().map(|d| d.order.order));
    all.extend(direct.map(|(d, order)| drawn(d, Method::Direct.key(), "plant from u to y", order)));
    all.extend(scheme.map(|(d, order)| drawn(d, Method::Hansen.key(), "S from alpha to beta", order)));
    all
}

fn verification(found: &Identification, k: usize, record: &LoopRecord) -> Result<draw::Verification> {
    let clock = Timeline::around_largest_swing(record.time.ts(), record.y.col_as_slice(0));
    let prediction = match found.verdict.prediction {
        Prediction::OpenLoop => "simulated from the measured input, initial state estimated",
        Prediction::ClosedLoop => "simulated under the controller from the known excitations, initial state estimated",
    };
    let outputs = (0..record.y.ncols())
        .map(|output| {
            let name = &found.records.outputs[output].name;
            let measured = record.y.col_as_slice(output);
            let mut predictions = Vec::new();
            for v in &found.verdict.models {
                let Ok(predicted) = &v.records[k].predicted else { continue };
                let values = predicted.col_as_slice(output);
                let residual: Vec<f64> = measured.iter().zip(values).map(|(y, yp)| y - yp).collect();
                predictions.push(draw::Prediction {
                    method: v.method.key().into(),
                    predicted: Trace::new(name, values, &clock)?,
                    residual: Trace::new(name, &residual, &clock)?,
                });
            }
            Ok(draw::VerifiedOutput { output, measured: Trace::new(name, measured, &clock)?, predictions })
        })
        .collect::<Result<_>>()?;
    Ok(draw::Verification { record: record.name.clone(), prediction: prediction.into(), clock, outputs })
}

fn poles(v: &ModelVerdict) -> Result<draw::Poles> {
    let square = v.model.inputs() == v.model.outputs();
    let zeros = if square { pairs(&v.model.zeros()?) } else { Vec::new() };
    Ok(draw::Poles { method: v.method.key().into(), poles: pairs(&v.poles), zeros })
}

/// The modes that the response of the model shows.
fn modes(found: &Identification, v: &ModelVerdict) -> Vec<draw::Mode> {
    let bands = found.uncertainty(v.method).map_or(&[][..], |known| &known.modes);
    let estimates = match (v.method, &found.recommended) {
        (Method::Likelihood, Ok(model)) => &model.modes[..],
        _ => &[],
    };
    let mode = |(k, m): (usize, &youla::lti::Mode)| {
        let nearest = |a: &&ModeEstimate, b: &&ModeEstimate| {
            (a.mode.pole - m.pole).norm().total_cmp(&(b.mode.pole - m.pole).norm())
        };
        let estimate = estimates.iter().min_by(nearest).map(|e| [e.hz_deviation, e.zeta_deviation]);
        Some(draw::Mode {
            method: v.method.key().into(),
            hz: m.hz,
            zeta: m.zeta,
            deviation: estimate.or(bands.get(k).map(|b| [b.hz_deviation, b.zeta_deviation])),
            residue: pairs(v.visible_residue(m.pole)?),
        })
    };
    // A pole at z = 0 is a sample of delay, and no mode.
    v.modes.iter().enumerate().filter(|(_, m)| m.hz.is_finite()).filter_map(mode).collect()
}

/// How many modes of a model are left out, and why.
fn unlisted(v: &ModelVerdict) -> Option<draw::UnlistedModes> {
    let visible = v.visible.as_ref().filter(|visible| visible.cancelled + visible.above_nyquist > 0)?;
    let (cancelled, above_nyquist) = (visible.cancelled, visible.above_nyquist);
    Some(draw::UnlistedModes { method: v.method.key().into(), cancelled, above_nyquist })
}

/// The present and the predicted loop.
fn redesign(found: &Identification) -> Result<Option<draw::Redesign>> {
    let Some(new) = found.new_controller() else { return Ok(None) };
    let (loops, figure) = (redesign::loops().to_vec(), redesign::figure(new)?);
    Ok(Some(draw::Redesign { loops, figure, tables: redesign::tables(new) }))
}

/// The physical structure, where one was estimated.
fn structure(found: &Identification) -> Option<&GreyBoxRun> {
    found.structure()
}

fn reduction(found: &Identification) -> Option<draw::Reduction> {
    Some(found.reduced()?.drawn())
}

fn certificate(found: &Identification, v: &ModelVerdict) -> draw::Certificate {
    let from_s = matches!(v.method, Method::Hansen | Method::HansenReduced).then(|| found.scheme()).flatten();
    let deviation = from_s.map(|s| &s.hansen.deviation);
    draw::Certificate {
        method: v.method.key().into(),
        order: v.model.order(),
        s_order: deviation.map(|s| s.model.order()),
        s_stable: deviation.map(|s| s.stability.stable),
        stabilised_by_controller: Some(v.certificate.stable),
        worst_closed_loop_pole: v.certificate.worst_pole.map(|p| [p.re, p.im]),
    }
}
