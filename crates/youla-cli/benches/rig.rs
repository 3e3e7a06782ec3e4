//! Samples per second of the digital twin at its three levels: `cargo bench -p youla-cli --bench rig`.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

use std::hint::black_box;
use std::time::Instant;
use youla_twin::rig::{BearingRig, Fidelity, RigParameters, SimulatedRig};

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

fn main() -> Result<()> {
    let parameters = RigParameters::shipped();
    for (name, fidelity, samples) in [
        ("linear", Fidelity::Linear, 2_000_000),
        ("instrumented", Fidelity::Instrumented, 100_000),
        ("rotating", Fidelity::Rotating { rpm: 2500.0 }, 100_000),
    ] {
        let rate = (0..7).map(|seed| rate(&parameters, fidelity, samples, seed)).collect::<Result<Vec<_>>>()?;
        let best = rate.into_iter().fold(0.0, f64::max);
        println!("{name:<14} {:>8.3} million samples/s", best / 1e6);
    }
    Ok(())
}

/// Samples per second under a command that depends on the measurement.
fn rate(parameters: &RigParameters, fidelity: Fidelity, samples: usize, seed: u64) -> Result<f64> {
    let mut rig = BearingRig::new(parameters, fidelity, seed)?;
    let start = Instant::now();
    for _ in 0..samples {
        let y = rig.measure();
        black_box(rig.actuate([0.01 * y[0], 0.01 * y[1]]));
    }
    Ok(samples as f64 / start.elapsed().as_secs_f64())
}
