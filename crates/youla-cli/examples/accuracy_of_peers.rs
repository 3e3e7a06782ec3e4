//! Errors of the recommended model, of PBSIDopt with the true order, and of other toolboxes on the same closed-loop records, over
//! the Cramer-Rao bound: table and figure of docs/accuracy.md.
//!
//! ```text
//! cargo run --release -p youla-cli --example accuracy_of_peers -- records FOLDER
//! python benches/peers/accuracy.py FOLDER
//! cargo run --release -p youla-cli --example accuracy_of_peers -- figure FOLDER
//! ```
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

#[path = "loops/mod.rs"]
mod loops;

use loops::{Loop, loops};
use std::fmt::Write;
use std::path::Path;
use youla::identify::likelihood::LikelihoodOptions;
use youla::identify::subspace::{Experiment, Order, Stability, SubspaceMethod, SubspaceOptions, subspace};
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla_report::data::{DrawnMethod, MethodRole};
use youla_report::figure::{Axis, Content, Curve, Drawn, Figure, Panel};
use youla_report::{figure_csv, svg};

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

const SEEDS: u64 = 10;
const FREQUENCIES: usize = 200;
/// Largest relative bound of a frequency that counts: beyond it the record says next to nothing.
const TOLD: f64 = 0.3;

/// Frequencies as shares of the sample rate.
fn shares() -> Vec<f64> {
    (0..FREQUENCIES).map(|k| 0.002 * (0.45_f64 / 0.002).powf(k as f64 / (FREQUENCIES - 1) as f64)).collect()
}

fn sizes(of: &[Vec<f64>]) -> Vec<f64> {
    of.iter().map(|entries| entries.iter().map(|v| v * v).sum::<f64>().sqrt()).collect()
}

/// Magnitudes of a response, or of the difference of two, per frequency and entry.
fn magnitudes(system: &StateSpace<Discrete>, other: Option<&StateSpace<Discrete>>) -> Result<Vec<Vec<f64>>> {
    let omega: Vec<f64> = shares().iter().map(|s| std::f64::consts::TAU * s / system.time().ts()).collect();
    let one = frequency_response(system, &omega)?;
    let two = other.map(|other| frequency_response(other, &omega)).transpose()?;
    let (p, m) = (system.outputs(), system.inputs());
    let entry = |k: usize, x: usize| {
        let g = one.at(k)[(x / m, x % m)];
        two.as_ref().map_or(g, |two| g - two.at(k)[(x / m, x % m)]).norm()
    };
    Ok((0..omega.len()).map(|k| (0..p * m).map(|x| entry(k, x)).collect()).collect())
}

/// Relative bound per frequency: the deviation that is stated where order and dead time are given as they are.
fn bound(system: &Loop, record: &[youla::Mat<f64>; 3]) -> Result<Vec<f64>> {
    let dead_time = system.dead_time;
    let options = LikelihoodOptions {
        order: Some(system.plant.order() - dead_time),
        dead_time: Some(vec![dead_time; system.plant.inputs()]),
        ..LikelihoodOptions::default()
    };
    let stated = system.recommended(record, &options)?.region;
    let (p, m) = (system.plant.outputs(), system.plant.inputs());
    let variance = |hz: f64| {
        let error = stated.at(hz).entries();
        let of = |x: usize| error.covariance((x / m, x % m));
        (0..p * m).map(|x| of(x)[0] + of(x)[2]).sum::<f64>()
    };
    let all = shares().iter().map(|s| variance(s / system.plant.time().ts()).sqrt()).collect::<Vec<_>>();
    let size = sizes(&magnitudes(&system.plant, None)?);
    Ok(all.iter().zip(size).map(|(b, g)| b / g).collect())
}

/// Root mean square over the frequencies that are told.
fn rms(relative: &[f64], bound: &[f64]) -> f64 {
    let told: Vec<f64> = relative.iter().zip(bound).filter(|(_, b)| **b < TOLD).map(|(e, _)| e * e).collect();
    (told.iter().sum::<f64>() / told.len().max(1) as f64).sqrt()
}

fn error(system: &Loop, model: &StateSpace<Discrete>, bound: &[f64]) -> Result<f64> {
    let size = sizes(&magnitudes(&system.plant, None)?);
    let error = sizes(&magnitudes(&system.plant, Some(model))?);
    Ok(rms(&error.iter().zip(size).map(|(e, g)| e / g).collect::<Vec<_>>(), bound))
}

fn write_records(folder: &Path) -> Result<()> {
    let mut rows = String::from("loop,seed,method,bound,error\n");
    for (number, system) in loops()?.iter().enumerate() {
        for seed in 1..=SEEDS {
            let record = system.record(seed)?;
            let bound = bound(system, &record)?;
            let least = rms(&bound, &bound);
            let found = system.recommended(&record, &LikelihoodOptions::default())?;
            let mut note = |method: &str, error: f64| writeln!(rows, "{number},{seed},{method},{least},{error}");
            note("youla", error(system, &found.plant, &bound)?)?;
            let [_, u, y] = &record;
            let kept = 2 * u.nrows() / 3;
            let options = SubspaceOptions {
                method: SubspaceMethod::PbsidOpt,
                order: Order::Fixed(system.plant.order()),
                stability: Stability::Allow,
                horizon: 20,
                past: Some(80),
                ..SubspaceOptions::default()
            };
            let experiment = Experiment::new(u.subrows(0, kept), y.subrows(0, kept));
            let expert = subspace(&[experiment], system.plant.time(), &options)?;
            note("expert", error(system, &expert.model, &bound)?)?;
            let own = folder.join(format!("{number}-{seed}"));
            std::fs::create_dir_all(&own)?;
            let raw = |name: &str, values: Vec<f64>| {
                std::fs::write(own.join(name), values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
            };
            for (name, of) in [("u", u), ("y", y)] {
                raw(name, (0..of.ncols()).flat_map(|j| (0..kept).map(move |t| of[(t, j)])).collect())?;
            }
            let omega: Vec<f64> =
                shares().iter().map(|s| std::f64::consts::TAU * s / system.plant.time().ts()).collect();
            let truth = frequency_response(&system.plant, &omega)?;
            let (p, m) = (system.plant.outputs(), system.plant.inputs());
            let flat = |k: usize| (0..p * m).flat_map(move |x| [(k, x, 0), (k, x, 1)]);
            let value = |(k, x, part): (usize, usize, usize)| {
                let g = truth.at(k)[(x / m, x % m)];
                if part == 0 { g.re } else { g.im }
            };
            raw("truth", (0..omega.len()).flat_map(flat).map(value).collect())?;
            raw("bound", bound)?;
            std::fs::write(own.join("shape"), format!("{m} {p} {}", system.plant.order()))?;
        }
        println!("{}", system.name);
    }
    Ok(std::fs::write(folder.join("youla.csv"), rows)?)
}

fn draw(folder: &Path) -> Result<()> {
    let text = std::fs::read_to_string(folder.join("youla.csv"))? + &std::fs::read_to_string(folder.join("peers.csv"))?;
    let rows: Vec<Vec<&str>> =
        text.lines().map(|l| l.split(',').collect::<Vec<_>>()).filter(|r| r[0] != "loop").collect();
    let methods = [
        DrawnMethod::new("youla", "youla, no key", MethodRole::Hansen),
        DrawnMethod::new("expert", "PBSIDopt, true order", MethodRole::Pem),
        DrawnMethod::new("slicot", "SLICOT N4SID, true order", MethodRole::Direct),
        DrawnMethod::new("sippy", "SIPPY N4SID, true order", MethodRole::Nominal),
    ];
    let systems = loops()?;
    let (mut curves, mut table) = (Vec::new(), String::new());
    for method in &methods {
        let own: Vec<(usize, f64, f64)> = rows
            .iter()
            .filter(|r| r[2] == method.key)
            .map(|r| Ok((r[0].parse()?, r[3].parse()?, r[4].parse()?)))
            .collect::<Result<_>>()?;
        write!(table, "| {} |", method.label)?;
        for k in 0..systems.len() {
            let mut ratios: Vec<f64> = own.iter().filter(|r| r.0 == k).map(|r| r.2 / r.1).collect();
            ratios.sort_by(f64::total_cmp);
            write!(table, " {:.2} |", ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN))?;
        }
        writeln!(table)?;
        let (x, y) = own.iter().map(|r| (r.1, r.2)).unzip();
        curves.push(Curve { method: method.key.clone(), x, y, drawn: Drawn::Points, ..Curve::default() });
    }
    println!("{table}");
    let bounds: Vec<f64> = rows.iter().map(|r| Ok(r[3].parse()?)).collect::<Result<_>>()?;
    let ends = vec![bounds.iter().copied().fold(f64::INFINITY, f64::min), bounds.iter().copied().fold(0.0, f64::max)];
    let least = DrawnMethod::new("bound", "bound", MethodRole::Other);
    curves.push(Curve { method: least.key.clone(), x: ends.clone(), y: ends, ..Curve::default() });
    let methods = [&methods[..], &[least]].concat();
    let axis = |label: &str| Axis { label: label.into(), log: true, ..Axis::default() };
    let figure = Figure {
        key: "accuracy".into(),
        title: "Error over the Cramer-Rao bound".into(),
        caption: format!("Relative error of the response of four closed loops, {SEEDS} records each."),
        panels: vec![Panel {
            x: axis("Cramer-Rao bound of the relative error"),
            y: axis("relative error"),
            content: Content::Curves(curves),
            ..Panel::default()
        }],
        ..Figure::default()
    };
    let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/images");
    std::fs::write(images.join("accuracy.svg"), svg(&figure, &methods)?)?;
    Ok(std::fs::write(images.join("accuracy.csv"), figure_csv(&figure, &methods))?)
}

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    match given.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["records", folder] => write_records(Path::new(folder)),
        ["figure", folder] => draw(Path::new(folder)),
        _ => Err("records FOLDER, or figure FOLDER".into()),
    }
}
