//! How sure: standard deviations of modes, margins with intervals, and whether the controller stabilises every plant that the record allows.
//!
//! `cargo run -p youla-cli --example 06_uncertainty`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::Result;
use youla::control::{closed_loop, margins, with_input_port};
use youla::lti::StateSpace;
use youla::validate::{BandOptions, certify_region, margin_intervals};

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let log = machine.log(20_000, 0.3, 1)?;
    let found = machine.identified(&log)?.model;

    println!("modes of the plant; the machine has {:.2?} Hz", oscillating(&machine.plant)?);
    for m in found.modes.iter().filter(|m| m.mode.pole.im > 0.0 && m.mode.zeta < 0.2) {
        let (hz, zeta) = (m.hz_deviation, m.zeta_deviation);
        println!("  {:.2} +- {hz:.2} Hz, damping ratio {:.4} +- {zeta:.4}", m.mode.hz, m.mode.zeta);
    }

    let controller = machine.factors.controller()?;
    for margin in
        margin_intervals(&margins(&found.plant, &controller)?, &found.plant, &controller, &found.region, None, 0.95)?
    {
        let [low, high] = margin.interval.bounds;
        println!("  {}: {:.3} ({low:.3} to {high:.3})", margin.name, margin.interval.value);
    }
    let ports = with_input_port(&controller)?;
    let closed = |plant: &StateSpace<_>| closed_loop(plant, &ports);
    let band = certify_region(&found.region, &BandOptions::default(), |_| Ok(true), closed)?;
    println!(
        "{} of {} models within the {:.0} % region are not stabilised; largest pole {:.5}",
        band.unstable_within,
        band.within,
        100.0 * band.level,
        band.worst_within
    );
    Ok(())
}

fn oscillating(model: &StateSpace<youla::lti::Discrete>) -> Result<Vec<f64>> {
    Ok(model.modes()?.iter().filter(|m| m.pole.im > 0.0).map(|m| m.hz).collect())
}
