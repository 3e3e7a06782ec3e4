//! How sure: standard deviations of modes, and whether the controller stabilises every model that the data allow.
//!
//! `cargo run -p youla-cli --example 06_uncertainty`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::Result;
use youla::control::closed_loop;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Order, SubspaceOptions, UncertaintyMethod, UncertaintyOptions};
use youla::lti::StateSpace;
use youla::validate::{BandOptions, certify_band};

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let log = machine.log(20_000, 0.3, 1)?;
    let signals = machine.factors.signals(log.u.as_ref(), log.y.as_ref())?;
    let uncertainty = UncertaintyOptions { method: UncertaintyMethod::Delta, ..Default::default() };
    let options =
        SubspaceOptions { horizon: 30.into(), order: Order::Fixed(10), uncertainty, ..Default::default() }.into();
    let found = hansen(&machine.factors, &[signals], &options)?;

    let Some(known) = &found.uncertainty else { return Ok(()) };
    println!("modes of G(S); the machine has {:.2?} Hz", oscillating(&machine.plant)?);
    for band in known.modes()?.iter().filter(|b| b.mode.pole.im > 0.0 && b.mode.zeta < 0.2) {
        let (hz, zeta) = (band.hz_deviation, band.zeta_deviation);
        println!("  {:.2} +- {hz:.2} Hz, damping ratio {:.4} +- {zeta:.4}", band.mode.hz, band.mode.zeta);
    }

    let controller = machine.factors.j_k()?;
    let closed = |g: &StateSpace<_>| closed_loop(g, &controller);
    if let Some(band) = certify_band(known, &BandOptions::default(), |_| Ok(true), closed)? {
        println!(
            "{} of {} models within the {:.0} % region are not stabilised; largest pole {:.5}",
            band.unstable_within,
            band.within,
            100.0 * band.level,
            band.worst_within
        );
    }
    Ok(())
}

fn oscillating(model: &StateSpace<youla::lti::Discrete>) -> Result<Vec<f64>> {
    Ok(model.modes()?.iter().filter(|m| m.pole.im > 0.0).map(|m| m.hz).collect())
}
