//! The controller with its ports alpha and beta, sample by sample as firmware runs it, and as a C99 header.
//!
//! `cargo run -p youla-cli --example 08_firmware`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::control::real_time_controller;
use youla::lti::Simulator;
use youla::signal::Channel;
use youla_io::export::{ControllerExport, c_controller};
use youla_rt::State;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let machine = machine::bearing()?;
    let (f, l) = &machine.gains;
    let controller = real_time_controller::<6, 2, 2>(&machine.nominal, f.as_ref(), l.as_ref())?;

    // The interrupt of the rig: command before the measurement, observe after it, with what was really applied.
    let (mut state, plant) = (State::at_rest(), Simulator::new(&machine.plant));
    let mut x = plant.start(&[0.0; 6])?;
    let (mut worst_u, mut energy) = (0.0_f64, 0.0);
    for k in 0..5000 {
        let alpha = if (k / 25) % 2 == 0 { [0.5, 0.5] } else { [-0.5, 0.5] };
        let applied = controller.command(&state, &alpha).map(|u| u.clamp(-5.0, 5.0));
        let y = plant.step(&mut x, &applied);
        let beta = controller.observe(&mut state, &[y[0], y[1]], &applied);
        worst_u = applied.iter().fold(worst_u, |worst, u| worst.max(u.abs()));
        energy += beta.iter().map(|b| b * b).sum::<f64>();
    }
    println!("largest u {worst_u:.3} V, rms of beta {:.4} um", (energy / 10_000.0).sqrt());

    let axes = |letter: &str, unit: &str| ["h", "v"].map(|a| Channel::new(format!("{letter}_{a}"), unit)).into();
    let header = c_controller(&ControllerExport {
        name: "bearing".into(),
        measured: axes("y", "um"),
        commanded: axes("u", "V"),
        nominal: machine.nominal.clone(),
        left: machine.factors.left().system().clone(),
        q: None,
        origin: "example 08".into(),
    })?;
    println!(
        "C99 header of {} lines, relative error in single precision {:.1e}",
        header.header.lines().count(),
        header.single.relative.unwrap_or(f64::NAN)
    );
    Ok(())
}
