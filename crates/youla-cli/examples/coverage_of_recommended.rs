//! How often the 95 % intervals of the recommended model hold the truth: frequency and damping of each mode, |G| at five
//! frequencies, and the margins, in six closed loops, with nothing given but the loop. The table of docs/accuracy.md.
//!
//! ```text
//! cargo run --release -p youla-cli --example coverage_of_recommended -- [records] [first seed]
//! ```
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

#[path = "loops/mod.rs"]
mod loops;

use loops::{Loop, loops};
use rayon::prelude::*;
use youla::control::{LinearMargins, MARGIN_NAMES, margins};
use youla::identify::likelihood::{LikelihoodOptions, ModeEstimate, Recommendation};
use youla::lti::frequency_response;
use youla::validate::margin_intervals;
use youla::{Result, c64};

const QUANTILE: f64 = 1.96;
/// A margin below it is zero: a controller that integrates loses the loop of a stable plant at gain 0, whatever the plant.
const ROUNDING: f64 = 1e-9;

/// Errors over stated deviations: frequency and damping of each mode of the truth, magnitudes; none where the mode is missed.
fn errors(system: &Loop, found: &Recommendation) -> Result<[Vec<Option<f64>>; 3]> {
    let (mut hz, mut zeta) = (Vec::new(), Vec::new());
    for truth in system.plant.modes()?.iter().filter(|m| m.hz.is_finite() && m.hz > 0.0) {
        let apart = |m: &&ModeEstimate| (m.mode.pole - truth.pole).norm();
        let near = found.modes.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let near = near.filter(|m| (m.mode.hz / truth.hz).ln().abs() < 0.2);
        hz.push(near.map(|m| (m.mode.hz - truth.hz) / m.hz_deviation));
        if (truth.zeta.abs() - 1.0).abs() > 1e-9 {
            zeta.push(near.map(|m| (m.mode.zeta - truth.zeta) / m.zeta_deviation));
        }
    }
    let omega = system.hz.map(|f| std::f64::consts::TAU * f);
    let (truth, model) = (frequency_response(&system.plant, &omega)?, frequency_response(&found.plant, &omega)?);
    let mut magnitude = Vec::new();
    for (k, f) in system.hz.iter().enumerate() {
        for i in 0..system.plant.outputs() {
            for j in 0..system.plant.inputs() {
                let (g, g0): (c64, c64) = (model.at(k)[(i, j)], truth.at(k)[(i, j)]);
                let deviation = found.region.at(*f).entries().of_magnitude(g, (i, j));
                magnitude.push(Some((g.norm() - g0.norm()) / deviation));
            }
        }
    }
    Ok([hz, zeta, magnitude])
}

/// Errors of the margins over their stated deviations, in the order of their names; none where a margin is missed.
fn margin_errors(system: &Loop, found: &Recommendation) -> Result<Vec<(&'static str, Option<f64>)>> {
    let (k, exact) = (&system.controller, margins(&system.plant, &system.controller)?);
    let truth = LinearMargins::new(&exact, &system.plant, k, None)?.deviations(|_, _| 0.0)?;
    let stated = margin_intervals(&margins(&found.plant, k)?, &found.plant, k, &found.region, None, 0.95)?;
    let error = |(name, exact): (&&'static str, Option<(f64, f64)>)| {
        let (exact, _) = exact.filter(|(value, _)| value.is_finite() && value.abs() > ROUNDING)?;
        let near = stated.iter().find(|m| m.name == *name);
        Some((*name, near.map(|m| (m.interval.value - exact) / m.interval.deviation)))
    };
    Ok(MARGIN_NAMES.iter().zip(truth).filter_map(error).collect())
}

/// Share of the errors within the interval, and their root mean square in deviations.
fn summary(errors: &[Option<f64>]) -> String {
    let held = errors.iter().filter(|e| e.is_some_and(|e| e.abs() <= QUANTILE)).count();
    if errors.is_empty() {
        return "       -".into();
    }
    let known: Vec<f64> = errors.iter().copied().flatten().map(|e| e.abs().min(10.0)).collect();
    let rms = (known.iter().map(|e| e * e).sum::<f64>() / known.len().max(1) as f64).sqrt();
    format!("{:5.1} % ({} of {}, rms {rms:.2})", 100.0 * held as f64 / errors.len() as f64, held, errors.len())
}

fn main() -> Result<()> {
    let given: Vec<u64> = std::env::args().skip(1).map(|v| v.parse().expect("a number")).collect();
    let (records, first) = (given.first().copied().unwrap_or(40), given.get(1).copied().unwrap_or(1));
    for system in loops()? {
        let of = |seed: u64| {
            let found = system.recommended(&system.record(seed)?, &LikelihoodOptions::default())?;
            let margins = margin_errors(&system, &found)?;
            Ok((errors(&system, &found)?, found.order, found.trusted(), found.reasons(), margins))
        };
        let found: Vec<_> = (first..first + records).into_par_iter().map(of).collect::<Result<Vec<_>>>()?;
        let all = |k: usize| found.iter().flat_map(|f| f.0[k].clone()).collect::<Vec<_>>();
        let trusted = found.iter().filter(|f| f.2).count();
        let mut orders: Vec<usize> = found.iter().map(|f| f.1).collect();
        orders.sort_unstable();
        println!(
            "{}: {records} records, {trusted} trusted, orders {} to {}",
            system.name,
            orders[0],
            orders[orders.len() - 1]
        );
        println!(
            "  frequency {}\n  damping   {}\n  magnitude {}",
            summary(&all(0)),
            summary(&all(1)),
            summary(&all(2))
        );
        for name in MARGIN_NAMES {
            let of = |f: &[(&str, Option<f64>)]| f.iter().filter(|m| m.0 == name).map(|m| m.1).collect::<Vec<_>>();
            let errors: Vec<_> = found.iter().flat_map(|f| of(&f.4)).collect();
            if !errors.is_empty() {
                println!("  {name}: {}", summary(&errors));
            }
        }
        if let Some(reason) = found.iter().flat_map(|f| f.3.first()).next() {
            println!("  not trusted: {reason}");
        }
    }
    Ok(())
}
