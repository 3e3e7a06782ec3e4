//! Error of the frequency response over the length of the record, under strong feedback and noise: the figure of
//! docs/closed-loop.md. `cargo run --release -p youla-cli --example closed_loop_bias` writes docs/images/closed-loop-bias.svg and
//! .csv in a few seconds.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

#[path = "../../../tests/common/mod.rs"]
mod common;

use common::feedback::Loop;
use rayon::prelude::*;
use std::path::Path;
use youla::Mat;
use youla::identify::subspace::SubspaceMethod;
use youla_report::data::{DrawnMethod, MethodRole};
use youla_report::figure::{Axis, Content, Curve, Figure, Panel};
use youla_report::{figure_csv, svg};

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// Standard deviation of the white output noise, um; the output is 1.1 um in all.
const NOISE: f64 = 1.0;
const SAMPLES: [usize; 7] = [2_000, 4_000, 8_000, 16_000, 32_000, 64_000, 128_000];
const SEEDS: u64 = 9;

fn main() -> Result<()> {
    let methods = [
        DrawnMethod::new("n4sid", "N4SID direct", MethodRole::Direct),
        DrawnMethod::new("pbsid-opt", "PBSIDopt, p = 100", MethodRole::HansenReduced),
        DrawnMethod::new("ssarx", "SSARX, p = 100", MethodRole::Pem),
        DrawnMethod::new("hansen", "Hansen G(S)", MethodRole::Hansen),
        DrawnMethod::new("rate", "1/sqrt(N)", MethodRole::Nominal),
    ];
    let bearing = Loop::new(0.0);
    let estimate = |method: &str, (u, y): &(Mat<f64>, Mat<f64>)| match method {
        "n4sid" => bearing.identify(SubspaceMethod::N4sid, u, y),
        "pbsid-opt" => bearing.identify(SubspaceMethod::PbsidOpt, u, y),
        "ssarx" => bearing.identify(SubspaceMethod::Ssarx, u, y),
        _ => bearing.hansen(u, y),
    };
    let estimated = &methods[..4];
    let mut errors = vec![Vec::new(); estimated.len()];
    for samples in SAMPLES {
        let by_seed: Vec<Vec<f64>> = (1..=SEEDS)
            .into_par_iter()
            .map(|seed| {
                let record = bearing.record(samples, NOISE, seed);
                estimated.iter().map(|method| bearing.error(&estimate(&method.key, &record))).collect()
            })
            .collect();
        for (k, errors) in errors.iter_mut().enumerate() {
            let mut values: Vec<f64> = by_seed.iter().map(|of_seed| of_seed[k]).collect();
            values.sort_by(f64::total_cmp);
            errors.push(values[values.len() / 2]);
        }
        let row: Vec<String> = errors.iter().map(|errors| format!("{:.4}", errors[errors.len() - 1])).collect();
        println!("{samples:7} {}", row.join(" "));
    }
    let x = SAMPLES.map(|samples| samples as f64).to_vec();
    let curve =
        |method: &DrawnMethod, y: Vec<f64>| Curve { method: method.key.clone(), x: x.clone(), y, ..Curve::default() };
    let mut curves: Vec<Curve> = estimated.iter().zip(errors).map(|(method, errors)| curve(method, errors)).collect();
    curves.push(curve(&methods[4], x.iter().map(|n| 0.15 * (16_000.0 / n).sqrt()).collect()));
    let axis = |label: &str| Axis { label: label.into(), log: true, ..Axis::default() };
    let figure = Figure {
        key: "closed-loop-bias".into(),
        title: "Closed-loop bias".into(),
        caption: format!(
            "Relative error of the frequency response, 20 to 600 Hz, medians of {SEEDS} records, under strong feedback and \
             white output noise of {NOISE} um."
        ),
        panels: vec![Panel {
            x: axis("samples N"),
            y: axis("relative error"),
            content: Content::Curves(curves),
            ..Panel::default()
        }],
        ..Figure::default()
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/images");
    let write = |name: &str, text: String| -> Result<()> {
        let path = folder.join(name);
        Ok(std::fs::write(path, text)?)
    };
    write("closed-loop-bias.svg", svg(&figure, &methods)?)?;
    write("closed-loop-bias.csv", figure_csv(&figure, &methods))
}
