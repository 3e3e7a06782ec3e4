//! Subspace identification beside SLICOT (ctrlsys, Octave) and SIPPY: `cargo bench -p youla-cli --bench subspace [-- SAMPLES]`.
//!
//! Every program gets the same records as raw numbers and measures the whole call by itself, in a process of its own; the
//! programs take turns, three rounds. `PYTHON` names an interpreter with numpy, ctrlsys and sippy_unipi, `OCTAVE` one of Octave
//! with the control package (default: `python3`, `octave-cli`); what is not there is left out. Ratios: the peer's time over the
//! smaller one of ours.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use std::{env, fs};
use youla::identify::subspace::{Experiment, Order, SubspaceMethod, SubspaceOptions, subspace};
use youla::lti::{Discrete, StateSpace, simulate};
use youla::signal::{Excitation, SquareWaves};
use youla::{Mat, Result};
use youla_twin::rig::Bearing;

const TS: f64 = 2e-4;
const ROUNDS: usize = 3;
const VERIFICATION: usize = 5000;

/// A record to identify.
#[derive(Clone, Copy)]
struct Case {
    samples: usize,
    horizon: usize,
    /// 4 x 4, order 20, instead of the bearing.
    large: bool,
}

const CASES: [Case; 12] = [
    Case { samples: 5_000, horizon: 10, large: false },
    Case { samples: 5_000, horizon: 20, large: false },
    Case { samples: 5_000, horizon: 40, large: false },
    Case { samples: 100_000, horizon: 10, large: false },
    Case { samples: 100_000, horizon: 20, large: false },
    Case { samples: 100_000, horizon: 40, large: false },
    Case { samples: 100_000, horizon: 10, large: true },
    Case { samples: 100_000, horizon: 20, large: true },
    Case { samples: 100_000, horizon: 40, large: true },
    Case { samples: 1_000_000, horizon: 10, large: false },
    Case { samples: 1_000_000, horizon: 20, large: false },
    Case { samples: 1_000_000, horizon: 40, large: false },
];

/// Seconds, fit in percent, memory in MB.
type Figures = [f64; 3];
/// Name, rounds, and words of the command, among them variables of the environment as (value, name).
type Program = (String, usize, Vec<(String, String)>);

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [flag, folder, horizon, order] = &arguments[..]
        && flag == "--one"
    {
        return one(Path::new(folder), number(horizon), number(order));
    }
    let only: Option<usize> = arguments.first().map(|a| number(a));
    println!("{:<34}{:>12}{:>10}{:>10}{:>10}", "", "ms", "ratio", "fit/%", "MB");
    for case in CASES.into_iter().filter(|case| only.is_none_or(|samples| samples == case.samples)) {
        beside_each_other(case)?;
    }
    Ok(())
}

fn number(text: &str) -> usize {
    text.parse().expect("a number")
}

fn beside_each_other(case: Case) -> Result<()> {
    let folder = env::temp_dir().join(format!("youla-peers-{}-{}", case.samples, case.large));
    let order = write(case, &folder)?;
    println!("\n{} samples, horizon {}, order {order}", case.samples, case.horizon);
    let programs = programs(case, &folder, order);
    let mut found: Vec<Vec<Figures>> = vec![Vec::new(); programs.len()];
    for round in 0..ROUNDS {
        for ((_, rounds, command), found) in programs.iter().zip(&mut found) {
            if round < *rounds {
                found.extend(run(command));
            }
        }
    }
    let median = |all: &[Figures], k: usize| {
        let mut values: Vec<f64> = all.iter().map(|f| f[k]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let ours = found[..2].iter().filter_map(|all| median(all, 0)).fold(f64::INFINITY, f64::min);
    for ((name, _, _), all) in programs.iter().zip(&found) {
        match median(all, 0) {
            None => println!("  {name:<32}{:>12}", "absent or failed"),
            Some(seconds) => {
                let [fit, memory] = [1, 2].map(|k| median(all, k).unwrap_or(f64::NAN));
                println!("  {name:<32}{:>12.2}{:>10.2}{fit:>10.3}{memory:>10.1}", 1e3 * seconds, seconds / ours);
            }
        }
    }
    // Best effort: these are temporary files.
    let _ = fs::remove_dir_all(folder);
    Ok(())
}

fn programs(case: Case, folder: &Path, order: usize) -> Vec<Program> {
    let peers = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers");
    let variable = |name: &str, default: &str| env::var(name).unwrap_or_else(|_| default.into());
    let (python, octave) = (variable("PYTHON", "python3"), variable("OCTAVE", "octave-cli"));
    let ours = env::current_exe().map(|path| path.display().to_string()).unwrap_or_default();
    let folder = folder.display();
    let (s, short) = (case.horizon, case.samples <= 5000);
    // The slow ones have one turn.
    let rounds = if short { ROUNDS } else { 1 };
    let words = |line: String| line.split(' ').map(|word| (word.to_owned(), String::new())).collect::<Vec<_>>();
    let with = |name: &str, value: &str, mut command: Vec<(String, String)>| {
        command.push((value.to_owned(), name.to_owned()));
        command
    };
    let mut all = Vec::new();
    for threads in ["1", "2"] {
        let command = with("RAYON_NUM_THREADS", threads, words(format!("{ours} --one {folder} {s} {order}")));
        all.push((format!("youla, threads: {threads}"), ROUNDS, command));
    }
    for threads in ["1", "2"] {
        for algorithm in ["C", "F"] {
            let command = words(format!("{python} {peers}/slicot.py {folder} {s} {order} {algorithm}"));
            let command = with("OPENBLAS_NUM_THREADS", threads, command);
            all.push((format!("SLICOT, ctrlsys {algorithm}, threads: {threads}"), ROUNDS, command));
        }
    }
    let command =
        with("OPENBLAS_NUM_THREADS", "2", words(format!("{python} {peers}/slicot.py {folder} {s} {order} Q")));
    all.push(("SLICOT, ctrlsys QR, threads: 2".into(), rounds, command));
    for (algorithm, name) in
        [("C", "Octave, Cholesky, threads: 2"), ("F", "Octave, fast QR, threads: 2"), ("Q", "Octave, QR, threads: 2")]
    {
        let mut command = words(format!("{octave} {peers}/octave.m"));
        let settings = [("FOLDER", folder.to_string()), ("HORIZON", s.to_string()), ("ORDER", order.to_string())];
        for (key, value) in settings {
            command = with(key, &value, command);
        }
        command = with("OPENBLAS_NUM_THREADS", "2", with("ALGORITHM", algorithm, command));
        all.push((name.into(), if algorithm == "Q" { rounds } else { ROUNDS }, command));
    }
    if short || case.horizon == 20 && !case.large && case.samples == 100_000 {
        let command = words(format!("{python} {peers}/sippy.py {folder} {s} {order}"));
        all.push(("SIPPY, threads: 2".into(), rounds, command));
    }
    all
}

fn run(command: &[(String, String)]) -> Option<Figures> {
    let mut words = command.iter().filter(|(_, name)| name.is_empty()).map(|(word, _)| word);
    let mut process = Command::new(words.next()?);
    process.args(words).envs(command.iter().filter(|(_, name)| !name.is_empty()).map(|(value, name)| (name, value)));
    let output = process.output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let figures: Vec<f64> = text.lines().last()?.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    figures.try_into().ok()
}

/// One program's turn: ours.
fn one(folder: &Path, horizon: usize, order: usize) -> Result<()> {
    let channels: usize = number(&fs::read_to_string(folder.join("channels")).expect("written before"));
    let read = |name: &str| {
        let bytes = fs::read(folder.join(name)).expect("written before");
        let rows = bytes.len() / 8 / channels;
        let value = |place: usize| f64::from_le_bytes(bytes[8 * place..8 * place + 8].try_into().expect("eight bytes"));
        Mat::from_fn(rows, channels, |k, j| value(j * rows + k))
    };
    let [u, y, uv, yv] = ["u", "y", "uv", "yv"].map(read);
    let options = SubspaceOptions {
        method: SubspaceMethod::N4sid,
        horizon,
        order: Order::Fixed(order),
        ..SubspaceOptions::default()
    };
    let identify = |samples: usize| {
        let experiment = Experiment::new(u.subrows(0, samples), y.subrows(0, samples));
        subspace(&[experiment], Discrete::new(TS)?, &options).map(|found| found.model)
    };
    let mut model = identify(2000)?;
    let (before, mut times) = (memory("VmRSS"), Vec::new());
    while times.is_empty() || times.iter().sum::<f64>() < 1.0 && times.len() < 15 {
        let start = Instant::now();
        model = identify(u.nrows())?;
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let used = (memory("VmHWM") - before).max(0.0);
    println!("{} {} {used}", times[times.len() / 2], fit(&model, &uv, &yv)?);
    Ok(())
}

/// A line of /proc/self/status in MB.
fn memory(key: &str) -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with(key)).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kb| kb.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}

/// The smallest fit over the outputs, percent.
fn fit(model: &StateSpace<Discrete>, u: &Mat<f64>, y: &Mat<f64>) -> Result<f64> {
    let simulated = simulate(model, u.as_ref(), &vec![0.0; model.order()])?;
    let of = |j: usize| {
        let mean = y.col(j).iter().sum::<f64>() / y.nrows() as f64;
        let spread = y.col(j).iter().map(|v| (v - mean).powi(2)).sum::<f64>().sqrt();
        100.0 * (1.0 - (y.col(j) - simulated.col(j)).norm_l2() / spread)
    };
    Ok((0..y.ncols()).map(of).fold(f64::INFINITY, f64::min))
}

/// Random square waves of +-1 held for 5 to 20 samples, white output noise of a tenth of the output; a verification record
/// without noise. Returns the order.
fn write(case: Case, folder: &PathBuf) -> Result<usize> {
    let time = Discrete::new(TS)?;
    let plant = if case.large { large()? } else { Bearing::default().plant()?.zoh(time)? };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let waves = Excitation::SquareWaves(SquareWaves { amplitude: 1.0, hold_min: 5, hold_max: 20 });
    let rest = vec![0.0; plant.order()];
    let u = waves.generate(case.samples, plant.inputs(), time, &mut rng)?;
    let mut y = simulate(&plant, u.as_ref(), &rest)?;
    for j in 0..y.ncols() {
        let noise = 0.1 * y.col(j).norm_l2() / (case.samples as f64).sqrt();
        y.col_mut(j).iter_mut().for_each(|v| *v += noise * rng.sample::<f64, _>(StandardNormal));
    }
    let uv = waves.generate(VERIFICATION, plant.inputs(), time, &mut rng)?;
    let yv = simulate(&plant, uv.as_ref(), &rest)?;
    fs::create_dir_all(folder).expect("a temporary folder can be made");
    for (name, m) in [("u", &u), ("y", &y), ("uv", &uv), ("yv", &yv)] {
        let bytes: Vec<u8> = m.col_iter().flat_map(|c| c.iter().flat_map(|v| v.to_le_bytes())).collect();
        fs::write(folder.join(name), bytes).expect("a temporary file can be written");
    }
    fs::write(folder.join("channels"), plant.inputs().to_string()).expect("a temporary file can be written");
    Ok(plant.order())
}

/// Ten modes with radii from 0.85 to 0.985, mixed by random inputs and outputs.
fn large() -> Result<StateSpace<Discrete>> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut a = Mat::zeros(20, 20);
    for k in (0..20).step_by(2) {
        let (radius, angle) = (rng.random_range(0.85..0.985), rng.random_range(0.01..0.4) * TAU);
        (a[(k, k)], a[(k + 1, k + 1)]) = (radius * f64::cos(angle), radius * f64::cos(angle));
        (a[(k, k + 1)], a[(k + 1, k)]) = (radius * f64::sin(angle), -radius * f64::sin(angle));
    }
    let mut random = |rows, columns| Mat::from_fn(rows, columns, |_, _| rng.sample::<f64, _>(StandardNormal));
    StateSpace::new(a, random(20, 4), random(4, 20), Mat::zeros(4, 4), Discrete::new(TS)?)
}
