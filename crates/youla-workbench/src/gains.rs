//! The loop that a controller would have: on the recommended plant and on plants drawn from its region.
//!
//! With `u = K (y - r)` (positive feedback) the loop maps `[w; n]` to `[u; y]` ([`closed_loop`]); `n = -r`, so that
//!
//! ```text
//! S = (I - G K)^-1 from n to y          step of r:  y - n and u for n = -1          locus:  -G K, critical at -1
//! ```

use crate::refusal::{Refusal, Result};
use faer::c64;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use youla::Mat;
use youla::control::{closed_loop, margins, with_input_port};
use youla::identify::likelihood::Region;
use youla::lti::{Discrete, FrequencyResponse, StateSpace, frequency_response, simulate};
use youla::signal::Channel;
use youla_io::{ModelFile, SystemMatrices, read_text};
use youla_run::{ControllerSettings, Summary};

/// Plants drawn from the region; a share p of unstable loops is missed with probability (1 - p)^n, 5 % for p = 3 %.
const DRAWS: usize = 100;
/// Seed of the draws: the same run shows the same plants.
const SEED: u64 = 1;
/// Lines from 2e-4 of the Nyquist frequency up to it, in equal steps of its logarithm.
const LINES: usize = 200;
/// Lines to either side of a light resonance, in half widths.
const AT_RESONANCE: [f64; 4] = [0.3, 1.0, 2.0, 5.0];
/// Draws whose steps and loci are drawn.
const SHOWN: usize = 20;
/// Longest step, in samples.
const LONGEST: usize = 1500;
/// Points of a step.
const POINTS: usize = 300;

/// What is read of a run for each answer, beside its folder.
#[derive(Serialize, Deserialize)]
struct Kept {
    ts: f64,
    inputs: Vec<String>,
    outputs: Vec<String>,
    plant: SystemMatrices,
    /// The controller that ran, positive feedback.
    running: SystemMatrices,
    /// Plants drawn from the region.
    drawn: usize,
    /// Those of them under which the controller that ran is stable: the log contradicts the others.
    draws: Vec<SystemMatrices>,
    /// Highest frequency of a band of validity, Hz; 0 where there is none.
    valid_to: f64,
}

/// `|I - S|` beyond the bands of validity from which it is said, where it is more than twice that of the controller that ran, under which the machine
/// was stable: of a response of which nothing is known there, twice as much makes the loop unstable.
const LITTLE_GAIN: f64 = 0.5;
const MORE: f64 = 2.0;

/// The highest frequency of the bands of validity that a run folder states, Hz.
fn valid_to(run: &Path) -> Result<f64> {
    let entries = Summary::read(run)?.recommended.map_or(Vec::new(), |found| found.entry_bands);
    Ok(entries.iter().flatten().flatten().map(|[_, high]| *high).fold(0.0, f64::max))
}

fn file_of(run: &Path) -> PathBuf {
    run.with_extension("loop.json")
}

/// Draws plants of the region of a run folder and keeps them beside it.
pub(crate) fn keep(run: &Path) -> Result<Value> {
    let model = |name: &str| -> Result<ModelFile> { Ok(serde_json::from_str(&read_text(&run.join(name))?)?) };
    let (recommended, controller) = (model("4-identify/recommended.json")?, model("2-factor/controller.json")?);
    let region: Region = serde_json::from_str(&read_text(&run.join("4-identify/region.json"))?)?;
    let ports = with_input_port(&controller.system()?)?;
    let possible = |plant: &StateSpace<Discrete>| {
        closed_loop(plant, &ports).and_then(|looped| looped.is_stable()).unwrap_or(false)
    };
    let drawn = region.draws(DRAWS, SEED);
    let names = |channels: Option<Vec<Channel>>| channels.into_iter().flatten().map(|c| c.name).collect();
    let kept = Kept {
        ts: recommended.ts,
        plant: recommended.matrices,
        inputs: names(recommended.inputs),
        outputs: names(recommended.outputs),
        running: controller.matrices,
        drawn: drawn.len(),
        valid_to: valid_to(run)?,
        draws: drawn.into_iter().map(|draw| draw.plant).filter(possible).map(|p| SystemMatrices::new(&p)).collect(),
    };
    let path = file_of(run);
    std::fs::write(&path, serde_json::to_string(&kept)?).map_err(|source| Refusal::at(&path, source))?;
    Ok(json!({ "file": path, "draws": kept.draws.len() }))
}

/// S, step and locus of a controller, of the one that ran where none is given, on the plant of a run and on its region.
pub(crate) fn predicted(run: &Path, controller: Option<&ControllerSettings>) -> Result<Value> {
    let kept: Kept = serde_json::from_str(&read_text(&file_of(run))?)?;
    let time = Discrete::new(kept.ts)?;
    let plant = kept.plant.system(time)?;
    let k = match controller {
        Some(settings) => settings.realise(time, None, Path::new(""))?.system().clone(),
        None => kept.running.system(time)?,
    };
    let draws = kept.draws.iter().map(|m| m.system(time)).collect::<std::result::Result<Vec<_>, _>>()?;
    let ports = with_input_port(&k)?;
    let close = |plant: &StateSpace<Discrete>| closed_loop(plant, &ports);
    let centre = close(&plant)?;
    let loops = draws.iter().map(close).collect::<youla::Result<Vec<_>>>()?;
    let mut unstable = 0;
    for looped in &loops {
        unstable += usize::from(!looped.is_stable()?);
    }
    let stable = centre.is_stable()?;
    let omega = grid(&plant, time)?;
    let (m, p) = (plant.inputs(), plant.outputs());
    let mut answer = json!({
        "stable": stable, "drawn": kept.drawn, "draws": draws.len(), "unstable": unstable, "inputs": kept.inputs, "outputs": kept.outputs,
        "worst_pole": centre.worst_pole()?.map_or(0.0, |pole| pole.norm()),
    });
    let ran = closed_loop(&plant, &with_input_port(&kept.running.system(time)?)?)?;
    if let Some([hz, gain]) = beyond([&centre, &ran], (m, p), &omega, kept.valid_to)? {
        answer["beyond"] = json!({ "valid_to": kept.valid_to, "hz": hz, "gain": gain });
    }
    answer["hz"] = json!(omega.iter().map(|w| w / TAU).collect::<Vec<_>>());
    if (plant.inputs(), plant.outputs()) == (1, 1) {
        answer["locus"] = json!(locus(&plant, &k, &omega)?);
        let others = draws.iter().take(SHOWN).map(|draw| locus(draw, &k, &omega)).collect::<Result<Vec<_>>>()?;
        answer["loci"] = json!(others);
    }
    // Of an unstable loop neither S nor a step says anything.
    if !stable || unstable > 0 {
        return Ok(answer);
    }
    let all: Vec<Vec<f64>> = std::iter::once(&centre)
        .chain(&loops)
        .map(|looped| Ok(largest(&frequency_response(&looped.part(m..m + p, m..m + p), &omega)?)))
        .collect::<Result<_>>()?;
    answer["sensitivity"] = band(&all);
    let samples = settling(&centre)?;
    let steps = std::iter::once(&centre)
        .chain(loops.iter().take(SHOWN))
        .map(|looped| step(looped, (m, p), samples))
        .collect::<Result<Vec<_>>>()?;
    let every = samples.div_ceil(POINTS);
    answer["t"] = json!((0..samples).step_by(every).map(|s| s as f64 * kept.ts).collect::<Vec<_>>());
    let curve =
        |j: usize| band(&steps.iter().map(|all| all[j].iter().step_by(every).copied().collect()).collect::<Vec<_>>());
    answer["command"] = (0..m).map(curve).collect();
    answer["step"] = (m..m + p).map(curve).collect();
    answer["margins"] = figures(&plant, &k)?;
    let peak = |s: &Vec<f64>| s.iter().fold(0.0_f64, |a, b| a.max(*b));
    answer["worst_sensitivity"] = json!(all.iter().map(peak).fold(0.0, f64::max));
    Ok(answer)
}

/// Frequency and size of the largest `|I - S|` beyond the bands of validity; `None` where it is small, or not much larger than that of the
/// controller that ran.
fn beyond(
    loops: [&StateSpace<Discrete>; 2],
    (m, p): (usize, usize),
    omega: &[f64],
    valid_to: f64,
) -> Result<Option<[f64; 2]>> {
    let above: Vec<f64> = omega.iter().copied().filter(|w| *w > TAU * valid_to).collect();
    let size = |s: faer::MatRef<'_, c64>| (s - Mat::<c64>::identity(p, p)).norm_l2();
    let of = |looped: &StateSpace<Discrete>| -> Result<Vec<f64>> {
        Ok(frequency_response(&looped.part(m..m + p, m..m + p), &above)?.iter().map(size).collect())
    };
    let (new, ran) = (of(loops[0])?, of(loops[1])?);
    let much = new.into_iter().zip(ran).zip(above).filter(|((new, ran), _)| *new > LITTLE_GAIN.max(MORE * ran));
    Ok(much.max_by(|a, b| a.0.0.total_cmp(&b.0.0)).map(|((gain, _), w)| [w / TAU, gain]))
}

/// Lines of the figures, dense at light resonances, rad/s.
fn grid(plant: &StateSpace<Discrete>, time: Discrete) -> Result<Vec<f64>> {
    let (ts, nyquist) = (time.ts(), PI / time.ts());
    let mut omega: Vec<f64> = (0..LINES).map(|k| nyquist * 2e-4f64.powf(1.0 - (k + 1) as f64 / LINES as f64)).collect();
    for pole in plant.poles()?.into_iter().filter(|pole| pole.im > 0.0) {
        let (half, at) = (pole.norm().ln().abs() / ts, pole.arg() / ts);
        omega.extend(AT_RESONANCE.iter().flat_map(|step| [at - step * half, at + step * half]).chain([at]));
    }
    omega.retain(|w| *w >= 2e-4 * nyquist && *w <= nyquist);
    omega.sort_by(f64::total_cmp);
    Ok(omega)
}

fn locus(plant: &StateSpace<Discrete>, k: &StateSpace<Discrete>, omega: &[f64]) -> Result<[Vec<f64>; 2]> {
    let open: Vec<c64> = frequency_response(&plant.then(k)?, omega)?.entry(0, 0).iter().map(|l| -l).collect();
    Ok([open.iter().map(|l| l.re).collect(), open.iter().map(|l| l.im).collect()])
}

/// Largest singular value at each line: the root of the largest eigenvalue of `S^H S`.
fn largest(response: &FrequencyResponse) -> Vec<f64> {
    let of = |s: faer::MatRef<'_, c64>| match (s.nrows(), s.ncols()) {
        (1, 1) => s[(0, 0)].norm(),
        _ => s.singular_values().map_or(f64::NAN, |values| values[0]),
    };
    response.iter().map(of).collect()
}

/// The first curve with the lowest and the highest of all.
fn band(all: &[Vec<f64>]) -> Value {
    let at = |pick: fn(f64, f64) -> f64, start: f64| -> Vec<f64> {
        (0..all[0].len()).map(|k| all.iter().map(|one| one[k]).fold(start, pick)).collect()
    };
    json!({ "centre": all[0], "low": at(f64::min, f64::INFINITY), "high": at(f64::max, f64::NEG_INFINITY) })
}

/// Samples until the slowest pole has fallen to 1 %.
fn settling(looped: &StateSpace<Discrete>) -> Result<usize> {
    let size = looped.worst_pole()?.map_or(0.0, |pole| pole.norm());
    let samples = if size > 0.0 { (0.01_f64.ln() / size.ln()).ceil() } else { 1.0 };
    Ok((1.3 * samples).clamp(40.0, LONGEST as f64) as usize)
}

/// Inputs and outputs for a step of all references at once.
fn step(looped: &StateSpace<Discrete>, (m, p): (usize, usize), samples: usize) -> Result<Vec<Vec<f64>>> {
    let n = Mat::from_fn(samples, m + p, |_, j| if j < m { 0.0 } else { -1.0 });
    let found = simulate(&looped.part(0..m + p, 0..m + p), n.as_ref(), &vec![0.0; looped.order()])?;
    let column = |j: usize| found.col(j).iter().map(|v| if j < m { *v } else { v + 1.0 }).collect();
    Ok((0..m + p).map(column).collect())
}

/// Margins of the recommended plant with the controller.
fn figures(plant: &StateSpace<Discrete>, k: &StateSpace<Discrete>) -> Result<Value> {
    let found = margins(plant, k)?;
    Ok(json!({
        "gain_up": found.highest_gain().map(|limit| limit.factor), "gain_down": found.lowest_gain().map(|limit| limit.factor),
        "phase": found.phase().map(|limit| limit.degrees), "delay": found.delay().map(|limit| limit.seconds),
        "sensitivity": found.output_sensitivity.value,
    }))
}
