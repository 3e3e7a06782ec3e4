//! The whole method in ten lines: from a log of the closed loop to a model, compared with fresh data.
//!
//! `cargo run -p youla-cli --example 01_scheme`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::Result;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Order, SubspaceOptions};
use youla::validate::{certify, fit, predict_open_loop};

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let (log, fresh) = (machine.log(20_000, 0.3, 1)?, machine.log(10_000, 0.3, 2)?);

    let signals = machine.factors.signals(log.u.as_ref(), log.y.as_ref())?; // (28): one filter of [u; y]
    let options = SubspaceOptions { horizon: 30.into(), order: Order::Fixed(12), ..Default::default() }.into();
    let found = hansen(&machine.factors, &[signals], &options)?; // (25): S; (17): G(S)
    let certificate = certify(&found.plant, &machine.factors.controller()?)?;

    println!("S of order {}, G(S) of order {}", found.deviation.model.order(), found.plant.order());
    println!("the controller stabilises G(S): {}", certificate.stable);
    for (name, model) in [("nominal", &machine.nominal), ("G(S)", &found.plant), ("truth", &machine.plant)] {
        let predicted = predict_open_loop(model, fresh.u.as_ref(), fresh.y.as_ref())?;
        println!("{name}: fit {:.1?} %", fit(fresh.y.as_ref(), predicted.as_ref())?);
    }
    Ok(())
}
