//! How often the regions and intervals of the Hansen scheme hold the truth, on the simulated bearing.
//!
//! ```text
//! cargo run --release -p youla-cli --example coverage -- [delta|bootstrap] [a_factor] [noise/um] [samples] [order] [horizon] [runs] [method] [b_factor] [input_weight] [process_noise]
//! ```
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

#[path = "../../../tests/common/mod.rs"]
mod common;

use common::bearing_loop::{self, Coverage, Design, Loop};
use youla::identify::subspace::{SubspaceMethod, UncertaintyMethod, UncertaintyOptions};

fn main() {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: f64| given.get(k).map_or(default, |v| v.parse().expect("a number"));
    let method = match given.first().map(String::as_str) {
        Some("bootstrap") => UncertaintyMethod::Bootstrap,
        _ => UncertaintyMethod::Delta,
    };
    let subspace = match given.get(7).map(String::as_str) {
        Some("moesp") => SubspaceMethod::Moesp,
        Some("n4sid") => SubspaceMethod::N4sid,
        Some("pbsid-opt") => SubspaceMethod::PbsidOpt,
        _ => SubspaceMethod::Cva,
    };
    let bearing = Loop::new(&Design {
        a_factor: number(1, 1.0),
        b_factor: number(8, 0.7),
        input_weight: number(9, 1000.0),
        process_noise: number(10, 0.01),
    });
    let options = youla::identify::subspace::SubspaceOptions {
        method: subspace,
        horizon: (number(5, 20.0) as usize).into(),
        order: youla::identify::subspace::Order::Fixed(number(4, 8.0) as usize),
        uncertainty: UncertaintyOptions { method, ..Default::default() },
        ..bearing_loop::options()
    };
    let start = std::time::Instant::now();
    let mut coverage = Coverage::default();
    let runs = number(6, 100.0) as u64;
    for seed in 0..runs {
        coverage.add(&bearing, &bearing.record(number(3, 6000.0) as usize, number(2, 0.3), seed), &options);
    }
    let Coverage { runs: count, unstable, deviation, plant, magnitude, hz, zeta, against_nominal, .. } = &coverage;
    println!("{count} runs, {unstable} with an unstable S");
    println!("regions of S {deviation:.3}, of G(S) {plant:.3}; intervals of the magnitude {magnitude:.3}");
    println!("intervals of the modes: frequency {hz:.3}, damping {zeta:.3}; S = 0 refuted {against_nominal:.3}");
    for (k, [bias, spread]) in coverage.details.iter().enumerate() {
        let held = coverage.by_frequency[k];
        println!("{:6.0} Hz: held {held:.3}, bias/error {bias:.3}, error/claimed {spread:.3}", bearing_loop::HZ[k]);
    }
    println!("{:.1} ms per run", 1e3 * start.elapsed().as_secs_f64() / runs as f64);
}
