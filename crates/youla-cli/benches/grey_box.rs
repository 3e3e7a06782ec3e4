//! The prediction-error method beside what a user writes today: `cargo bench -p youla-cli --bench grey_box [-- control]`.
//!
//! The bearing with 16 parameters (the actuator poles as a full matrix), 20 000 samples, started at 0.8 and 0.5 of the true values.
//! The peers are SciPy's least squares with difference quotients around the simulation of SLICOT (`ctrlsys`) and, with the
//! argument `control` because it takes minutes, of python-control. Every program is a process of its own that measures its
//! search; the programs take turns, three rounds. `PYTHON` names an interpreter with numpy, scipy, ctrlsys, control (default:
//! `python3`). Ratios: the peer's time over the smaller one of ours. All must end at the same criterion.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use std::{env, fs};
use youla::Mat;
use youla::identify::subspace::{Experiment, InitialState};
use youla::lti::{Discrete, StateSpace, simulate};
use youla::signal::{Excitation, SquareWaves};
use youla::validate::fit;
use youla_greybox::{Declaration, DeclaredStructure, GreyBoxOptions, Problem, Structure, greybox};
use youla_twin::rig::Bearing;

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

const TS: f64 = 2e-4;
const SAMPLES: usize = 20_000;
const VERIFICATION: usize = 5000;
const ROUNDS: usize = 3;

/// What is amended in the template of the bearing.
const FULL_POLES: &str = r#"
template = "bearing"
a = [
    [0, 0, 1, 0, 0, 0],
    [0, 0, 0, 1, 0, 0],
    ["stiffness_hh", "stiffness_hv", "damping_hh", "damping_hv", "actuator_gain_hh", "actuator_gain_hv"],
    ["stiffness_vh", "stiffness_vv", "damping_vh", "damping_vv", "actuator_gain_vh", "actuator_gain_vv"],
    [0, 0, 0, 0, "-actuator_pole_h", "-actuator_pole_hv"],
    [0, 0, 0, 0, "-actuator_pole_vh", "-actuator_pole_v"],
]
b = [
    [0, 0],
    [0, 0],
    [0, 0],
    [0, 0],
    ["actuator_pole_h", "actuator_pole_hv"],
    ["actuator_pole_vh", "actuator_pole_v"],
]
[parameters.actuator_pole_hv]
initial = 0.0
scale = 1000.0
[parameters.actuator_pole_vh]
initial = 0.0
scale = 1000.0
"#;

/// Seconds, fit in percent, half the sum of squares.
type Figures = [f64; 3];

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [flag, folder, factor] = &arguments[..]
        && flag == "--one"
    {
        return one(Path::new(folder), factor.parse().expect("a number"));
    }
    let folder = env::temp_dir().join(format!("youla-grey-box-{}", std::process::id()));
    write(&folder)?;
    println!("{:<34}{:>12}{:>10}{:>10}{:>16}", "", "ms", "ratio", "fit/%", "criterion");
    for factor in ["0.8", "0.5"] {
        println!("\n{SAMPLES} samples, start {factor}");
        beside_each_other(&folder, factor, arguments.iter().any(|a| a == "control"));
    }
    // Best effort: these are temporary files.
    let _ = fs::remove_dir_all(folder);
    Ok(())
}

fn beside_each_other(folder: &Path, factor: &str, control: bool) {
    let peer = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/grey_box.py");
    let python = env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let ours = env::current_exe().map(|path| path.display().to_string()).unwrap_or_default();
    let folder = folder.display().to_string();
    let words = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
    let mut programs = vec![
        ("youla, threads: 1", ROUNDS, words(&[&ours, "--one", &folder, factor])),
        ("SciPy and SLICOT", ROUNDS, words(&[&python, peer, &folder, factor, "slicot"])),
    ];
    if control {
        programs.push(("SciPy and python-control", 1, words(&[&python, peer, &folder, factor, "control"])));
    }
    let mut found: Vec<Vec<Figures>> = vec![Vec::new(); programs.len()];
    for round in 0..ROUNDS {
        for ((_, rounds, command), found) in programs.iter().zip(&mut found) {
            if round < *rounds {
                found.extend(run(command));
            }
        }
    }
    let median = |all: &[Figures]| {
        let mut sorted = all.to_vec();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        sorted.get(sorted.len() / 2).copied()
    };
    let reference = median(&found[0]).map_or(f64::NAN, |f| f[0]);
    for ((name, _, _), all) in programs.iter().zip(&found) {
        match median(all) {
            None => println!("  {name:<32}{:>12}", "absent or failed"),
            Some([seconds, fit, criterion]) => {
                println!(
                    "  {name:<32}{:>12.1}{:>10.1}{fit:>10.3}{criterion:>16.6}",
                    1e3 * seconds,
                    seconds / reference
                );
            }
        }
    }
}

fn run(command: &[String]) -> Option<Figures> {
    let output = Command::new(&command[0])
        .args(&command[1..])
        .envs(["RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|name| (name, "1")))
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let figures: Vec<f64> = text.lines().last()?.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    figures.try_into().ok()
}

/// One program's turn: ours.
fn one(folder: &Path, factor: f64) -> Result<()> {
    let read = |name: &str| {
        let bytes = fs::read(folder.join(name)).expect("written before");
        let rows = bytes.len() / 16;
        let value = |place: usize| f64::from_le_bytes(bytes[8 * place..8 * place + 8].try_into().expect("eight bytes"));
        Mat::from_fn(rows, 2, |k, j| value(j * rows + k))
    };
    let [u, y, uv, yv] = ["u", "y", "uv", "yv"].map(read);
    let structure = DeclaredStructure::new(&Declaration::parse(FULL_POLES)?)?;
    let start: Vec<f64> = structure.start().iter().map(|value| factor * value).collect();
    assert_eq!(structure.names().len(), 16);
    let options = GreyBoxOptions { initial_state: InitialState::Zero, ..GreyBoxOptions::default() };
    let experiment = [Experiment::new(u.as_ref(), y.as_ref())];
    let begun = Instant::now();
    let found = greybox(&Problem::new(&structure, &experiment, Discrete::new(TS)?), &start, &options)?;
    let seconds = begun.elapsed().as_secs_f64();
    let predicted = simulate(&found.model, uv.as_ref(), &[0.0; 6])?;
    let fit = fit(yv.as_ref(), predicted.as_ref())?;
    println!("{seconds} {} {}", fit.iter().copied().fold(f64::INFINITY, f64::min), found.cost);
    Ok(())
}

/// Random square waves of +-1 held for 5 to 20 samples, white output noise of a tenth of the output; a verification record
/// without noise.
fn write(folder: &Path) -> Result<()> {
    let plant: StateSpace<Discrete> = Bearing::default().plant()?.zoh(Discrete::new(TS)?)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let waves = Excitation::SquareWaves(SquareWaves { amplitude: 1.0, hold_min: 5, hold_max: 20 });
    let u = waves.generate(SAMPLES, 2, plant.time(), &mut rng)?;
    let mut y = simulate(&plant, u.as_ref(), &[0.0; 6])?;
    for j in 0..2 {
        let noise = 0.1 * y.col(j).norm_l2() / (SAMPLES as f64).sqrt();
        y.col_mut(j).iter_mut().for_each(|v| *v += noise * rng.sample::<f64, _>(StandardNormal));
    }
    let uv = waves.generate(VERIFICATION, 2, plant.time(), &mut rng)?;
    let yv = simulate(&plant, uv.as_ref(), &[0.0; 6])?;
    fs::create_dir_all(folder).expect("a temporary folder can be made");
    for (name, m) in [("u", &u), ("y", &y), ("uv", &uv), ("yv", &yv)] {
        let bytes: Vec<u8> = m.col_iter().flat_map(|c| c.iter().flat_map(|v| v.to_le_bytes())).collect();
        fs::write(folder.join(name), bytes).expect("a temporary file can be written");
    }
    fs::write(folder.join("channels"), "2").expect("a temporary file can be written");
    Ok(())
}
