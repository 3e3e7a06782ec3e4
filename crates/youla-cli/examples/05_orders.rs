//! Which order: poles that stay when the order grows, and the fit that each order buys.
//!
//! `cargo run -p youla-cli --example 05_orders`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use youla::Result;
use youla::identify::hansen::HansenData;
use youla::identify::subspace::stabilisation::{StabilisationOptions, stabilisation};
use youla::identify::subspace::{Order, SubspaceOptions};
use youla::validate::{fit, predict_open_loop};

fn main() -> Result<()> {
    let machine = machine::bearing()?;
    let (log, fresh) = (machine.log(20_000, 0.3, 1)?, machine.log(10_000, 0.3, 2)?);
    let signals = [machine.factors.signals(log.u.as_ref(), log.y.as_ref())?];
    let of_order = |order| SubspaceOptions { horizon: 30.into(), order: Order::Fixed(order), ..Default::default() };

    let options = of_order(20);
    let data = HansenData::new(&machine.factors, &signals, &options)?;
    let orders: Vec<usize> = (1..=20).collect();
    let diagram = stabilisation(data.subspace(), &orders, &options, &StabilisationOptions::default())?;
    println!("modes of S that stay over the orders");
    for cluster in &diagram.clusters {
        println!("  {:8.2} Hz, damping ratio {:.4}, in {} of 20 orders", cluster.hz, cluster.zeta, cluster.orders);
    }

    println!("fit of G(S) on fresh data");
    for order in [2, 4, 6, 8, 12, 16] {
        let found = data.identify(&of_order(order).into())?;
        let predicted = predict_open_loop(&found.plant, fresh.u.as_ref(), fresh.y.as_ref())?;
        println!("  S of order {order:2}: {:.2?} %", fit(fresh.y.as_ref(), predicted.as_ref())?);
    }
    Ok(())
}
