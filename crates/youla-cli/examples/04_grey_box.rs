//! Physical parameters with intervals: stiffness and damping of the bearing, started 30 % off.
//!
//! `cargo run -p youla-cli --example 04_grey_box`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::identify::subspace::Experiment;
use youla_greybox::{GreyBoxOptions, IntervalOptions, LoopOutput, Problem, greybox, greybox_intervals};
use youla_twin::BearingStructure;
use youla_twin::rig::Bearing;

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let (log, time) = (machine.log(20_000, 0.3, 1)?, machine.plant.time());
    let truth = BearingStructure::parameters(&Bearing::default());
    let start: Vec<f64> = truth.iter().map(|v| 0.7 * v).collect();

    // Through the loop, from alpha: consistent whatever the noise, because alpha does not depend on it.
    let (controller, options) = (machine.factors.j_k()?, GreyBoxOptions::default());
    let data = [Experiment::new(log.alpha.as_ref(), log.y.as_ref())];
    let found = greybox(
        &Problem::new(&BearingStructure, &data, time).in_loop(&controller, LoopOutput::Plant),
        &start,
        &options,
    )?;
    let known = greybox_intervals(
        &Problem::new(&BearingStructure, &data, time).in_loop(&controller, LoopOutput::Plant),
        &found,
        &options,
        &IntervalOptions::default(),
    )?;

    println!("{} steps, {:?}; {:.0} % intervals", found.iterations, found.stop, 100.0 * known.level);
    for (parameter, truth) in known.parameters.iter().zip(&truth) {
        let [low, high] = parameter.interval;
        let holds = if (low..=high).contains(truth) { "holds" } else { "misses" };
        println!("{:24} {low:12.5e} to {high:12.5e}  {holds} {truth:.5e}", parameter.name);
    }
    Ok(())
}
