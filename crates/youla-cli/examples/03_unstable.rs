//! An unstable plant: the scheme finds the unstable pole; a method for open loops, on the same record, is misled by the feedback.
//!
//! `cargo run -p youla-cli --example 03_unstable`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::Result;
use youla::identify::direct::direct;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Experiment, Order, Stability, SubspaceMethod, SubspaceOptions};
use youla::lti::{Discrete, StateSpace};

fn main() -> Result<()> {
    let machine = machine::maglev()?;
    let log = machine.log(60_000, 0.1, 1)?;

    let signals = machine.factors.signals(log.u.as_ref(), log.y.as_ref())?;
    let options = |order| SubspaceOptions { horizon: 80, order: Order::Fixed(order), ..Default::default() };
    let scheme = hansen(&machine.factors, &[signals], &options(4))?;
    let record = [Experiment::new(log.u.as_ref(), log.y.as_ref())];
    // An unstable estimate is refused unless it is asked for.
    let n4sid = SubspaceOptions { method: SubspaceMethod::N4sid, stability: Stability::Allow, ..options(2) };
    let open_loop = direct(&record, machine.plant.time(), &n4sid)?;

    println!("largest pole, rad/s (above 0: unstable)");
    for (name, model) in [
        ("truth", &machine.plant),
        ("nominal", &machine.nominal),
        ("G(S)", &scheme.plant),
        ("n4sid of (u, y)", &open_loop.model),
    ] {
        println!("  {name:16} {:+.2}", rate(model)?);
    }
    Ok(())
}

/// The real part of ln(z) / ts of the pole of largest magnitude.
fn rate(model: &StateSpace<Discrete>) -> Result<f64> {
    let largest = model.poles()?.iter().map(|z| z.norm()).fold(0.0, f64::max);
    Ok(largest.ln() / model.time().ts())
}
