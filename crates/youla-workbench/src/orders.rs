//! The modes of models of all orders, for a stabilisation chart.
//!
//! The models are those of PBSIDopt, which needs no knowledge of the controller; each comes from the same triangular factor. A mode is
//! steady where the model of the order below has it too. The chart helps to choose an order; the model of that order is the likelihood's.

use crate::refusal::Result;
use serde_json::{Value, json};
use std::path::Path;
use youla::identify::subspace::{Experiment, Order, Stability, SubspaceData, SubspaceMethod, SubspaceOptions};
use youla_run::{parse_settings, read_records};

/// Orders of the chart.
const HIGHEST: usize = 24;
/// Block rows: twice the highest order for one output.
const HORIZON: usize = 48;
/// Samples of the first record that are used at most, so that the chart takes seconds.
const SAMPLES: usize = 20_000;
/// Samples that the regression takes for each of its coefficients at least.
const PER_COEFFICIENT: usize = 4;
/// A mode is steady within these parts of its frequency and of its damping (customary in modal analysis).
const STEADY: [f64; 2] = [0.02, 0.2];

/// Order, frequency in Hz, damping and steadiness of the modes of each model.
pub(crate) fn orders(toml: &str) -> Result<Value> {
    let settings = parse_settings(toml, Path::new("run.toml"))?;
    let records = read_records(&settings.data, Path::new(""))?;
    let Some(record) = records.estimation.first() else { return Ok(json!({ "modes": [] })) };
    let samples = record.samples().min(SAMPLES);
    let (m, p) = (record.inputs(), record.outputs());
    let horizon = HORIZON.min(samples / (PER_COEFFICIENT * (m + p))).max(3);
    let options = SubspaceOptions {
        method: SubspaceMethod::PbsidOpt,
        horizon,
        stability: Stability::Allow,
        ..SubspaceOptions::default()
    };
    let experiment = Experiment::new(record.u().subrows(0, samples), record.y().subrows(0, samples));
    let data = SubspaceData::new(&[experiment], records.time, &options)?;
    let mut all = Vec::new();
    let mut below: Vec<[f64; 2]> = Vec::new();
    for order in 1..=HIGHEST.min((horizon - 1) * p) {
        // An order that these records do not give has no modes.
        let found = data.identify(&SubspaceOptions { order: Order::Fixed(order), ..options.clone() });
        let modes = found.and_then(|found| found.model.modes()).unwrap_or_default();
        let oscillating = modes.into_iter().filter(|mode| mode.pole.im > 0.0);
        let of: Vec<[f64; 2]> = oscillating.map(|mode| [mode.hz, mode.zeta]).collect();
        for mode in &of {
            let near = |other: &[f64; 2]| (0..2).all(|k| (other[k] - mode[k]).abs() <= STEADY[k] * mode[k].abs());
            all.push(json!({ "order": order, "hz": mode[0], "zeta": mode[1], "steady": below.iter().any(near) }));
        }
        below = of;
    }
    Ok(json!({ "modes": all, "samples": samples, "highest": HIGHEST }))
}
