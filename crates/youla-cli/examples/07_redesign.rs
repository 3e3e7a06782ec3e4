//! From the log to a better controller: identify, redesign, and try it on the machine.
//!
//! `cargo run -p youla-cli --example 07_redesign`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::validate::certify;
use youla_loop::redesign::{RedesignOptions, RedesignProblem, redesign};

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let log = machine.log(20_000, 0.3, 1)?;
    let found = machine.identified(&log)?.model;
    println!("the record supports a model of order {}", found.order);

    let rms = |m: &youla::Mat<f64>| -> Vec<f64> {
        (0..m.ncols()).map(|j| (m.col(j).iter().map(|v| v * v).sum::<f64>() / m.nrows() as f64).sqrt()).collect()
    };
    let problem = RedesignProblem {
        plant: &found.plant,
        model: &found.plant,
        factors: &machine.factors,
        region: Some(&found.region),
        input_size: &rms(&log.u),
        output_size: &rms(&log.y),
        delay: 0,
    };
    let new = redesign(&problem, &RedesignOptions::default())?;
    println!(
        "least damping of the loop: {:.3}, predicted {:.3}",
        new.present.least_damping, new.predicted.least_damping
    );

    // The machine itself, which the design has never seen.
    let tried = certify(&machine.plant, &new.controller.system)?;
    println!("the new controller stabilises the machine: {}", tried.stable);
    Ok(())
}
