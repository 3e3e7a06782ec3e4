//! From a log of the closed loop to a model, compared with fresh data.
//!
//! `cargo run -p youla-cli --example 01_identify`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::Result;
use youla::control::RunningController;
use youla::signal::LoopRecord;
use youla::validate::{fit, predict_open_loop};

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let (log, fresh) = (machine.log(20_000, 0.3, 1)?, machine.log(10_000, 0.3, 2)?);
    let (time, nominal, (f, l)) = (machine.plant.time(), &machine.nominal, machine.gains.clone());
    let (u, y, alpha) = (log.u, log.y, log.alpha);

    let record = LoopRecord::new(time, u, y)?.with_alpha(alpha)?; // rows are samples
    let controller = RunningController::observer(nominal, f, l)?; // or ::new(K), u = K y
    let found = youla::identify(&[record], &[], &controller, Some(nominal), &Default::default())?;
    let (plant, region) = (&found.model.plant, &found.model.region); // and modes, noise, evidence
    let s = found.deviation?.system; // stable exactly where the controller stabilises the plant

    println!("plant of order {}, stated at {} frequencies", found.model.order, region.hz.len());
    println!("the controller stabilises the plant: {}", s.is_stable()?);
    for (name, model) in [("nominal", nominal), ("identified", plant), ("truth", &machine.plant)] {
        let predicted = predict_open_loop(model, fresh.u.as_ref(), fresh.y.as_ref())?;
        println!("{name}: fit {:.1?} %", fit(fresh.y.as_ref(), predicted.as_ref())?);
    }
    Ok(())
}
