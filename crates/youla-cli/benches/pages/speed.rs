//! How long things take: equations, responses, signals, identification, and a whole run by stage.

use crate::equations::{Equation, KINDS};
use crate::page::{head, table};
use crate::timing::{median, middle};
use faer::Mat;
use std::f64::consts::PI;
use std::path::Path;
use youla::factor::CoprimeFactors;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Order, SubspaceOptions};
use youla::lti::{frequency_response, simulate};
use youla_run::{Identification, StageClock, identify, write_run};
use youla_twin::rig::{Bearing, degraded};
use youla_twin::{DemoMachine, demo};

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// Sample time of the bearing, seconds.
const TS: f64 = 2e-4;

/// The page.
pub(crate) fn page() -> Result<String> {
    let about = "Medians of as many calls as fit into half a second, on both cores where the work is independent. Ratios to other programs, \
                 measured side by side, and the memory: [performance](../performance.md).";
    Ok(head("Speed", about) + &equations()? + &steps()? + &stages()?)
}

fn equations() -> Result<String> {
    let mut rows = Vec::new();
    for (kind, name) in KINDS.iter().enumerate() {
        let times = [6, 40, 100, 200].map(|n| {
            let equation = Equation::random(kind, n, 100 + n as u64);
            milliseconds(median(|| equation.residual()))
        });
        rows.push([vec![(*name).to_owned()], times.to_vec()].concat());
    }
    let about = "Milliseconds, with the residual, by number of states.";
    Ok(table("Matrix equations", about, &["equation", "6", "40", "100", "200"], &rows))
}

/// The steps of the scheme on one record.
fn steps() -> Result<String> {
    const SAMPLES: usize = 100_000;
    let time = youla::lti::Discrete::new(TS)?;
    let plant = Bearing::default().plant()?.zoh(time)?;
    let u = Mat::from_fn(SAMPLES, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
    let y = simulate(&plant, u.as_ref(), &[0.0; 6])?;
    let nominal = degraded(&Bearing::default().plant()?, 0.9, 1.0)?.zoh(time)?;
    let f = Mat::zeros(2, 6);
    let factors = CoprimeFactors::observer(&nominal, f.as_ref(), f.transpose())?;
    let signals = [factors.signals(u.as_ref(), y.as_ref())?];
    let options = |horizon| SubspaceOptions { horizon, order: Order::Fixed(12), ..Default::default() };
    let omega: Vec<f64> = (1..=1000).map(|k| 0.999 * PI / TS * f64::from(k) / 1000.0).collect();
    hansen(&factors, &signals, &options(10))?;
    let row = |name: &str, seconds: f64| vec![name.to_owned(), milliseconds(seconds)];
    let rows = [
        row("simulation", median(|| simulate(&plant, u.as_ref(), &[0.0; 6]))),
        row("alpha and beta (28)", median(|| factors.signals(u.as_ref(), y.as_ref()))),
        row("S and G(S), horizon 10", median(|| hansen(&factors, &signals, &options(10)))),
        row("S and G(S), horizon 30", median(|| hansen(&factors, &signals, &options(30)))),
        row("frequency response, 1000 frequencies", median(|| frequency_response(&plant, &omega))),
    ];
    let about = format!("Milliseconds for {SAMPLES} samples of the bearing, 2 inputs, 2 outputs, 6 states.");
    Ok(table("Steps", &about, &["step", "time"], &rows))
}

/// `youla demo`, stage by stage: medians of five runs.
fn stages() -> Result<String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench-pages");
    let mut runs = Vec::new();
    for _ in 0..5 {
        let demo = demo(DemoMachine::Bearing, 1)?;
        let mut announce = |_| {};
        let mut clock = StageClock::new(&mut announce);
        let found: Identification = identify(demo.settings, demo.records, Path::new("."), &mut clock)?;
        write_run(&found, &folder, true, &mut clock)?;
        runs.push(clock.seconds);
    }
    let of = |k: usize| middle(runs.iter().map(|run| run[k].1).collect());
    let mut rows: Vec<Vec<String>> =
        runs[0].iter().enumerate().map(|(k, (stage, _))| vec![stage.name().to_owned(), milliseconds(of(k))]).collect();
    rows.push(vec!["**all**".into(), milliseconds(middle(runs.iter().map(|r| r.iter().map(|s| s.1).sum()).collect()))]);
    let about = "Milliseconds of `youla demo` (20 000 and 10 000 samples, 2 inputs, 2 outputs, with uncertainty, certificate, reduction, \
                 redesign and report), medians of five runs.";
    Ok(table("A whole run", about, &["stage", "time"], &rows))
}

fn milliseconds(seconds: f64) -> String {
    let value = 1e3 * seconds;
    if value >= 10.0 { format!("{value:.0}") } else { format!("{value:.2}") }
}
