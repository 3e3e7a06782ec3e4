//! Reports with data like that of real runs: sums of modes with square-wave excitation and noise.

mod curves;
mod modal;

use curves::{estimation, experiment, frequency};
use modal::Modal;
use youla::control::IsoZone;
use youla::signal::Channel;
use youla_report::data::*;
use youla_report::{ReportData, Timeline, Trace};

struct Plan {
    plant: Modal,
    ts: f64,
    samples: usize,
    records: Vec<&'static str>,
    band: (f64, f64),
    outputs: Vec<Channel>,
    inputs: Vec<Channel>,
    hold: usize,
    noise: f64,
}

/// Two inputs and two outputs, like the gas bearing.
pub(crate) fn bearing() -> ReportData {
    let plant = Modal {
        modes: vec![
            (112.0, 0.028, vec![vec![6.0, 0.9], vec![0.7, 2.1]]),
            (141.0, 0.051, vec![vec![1.1, -1.6], vec![-1.3, 5.2]]),
        ],
    };
    let channel = |name: &str, unit: &str| Channel::new(name, unit);
    let mut data = report(&Plan {
        plant,
        ts: 2e-4,
        samples: 20_000,
        records: vec!["verification"],
        band: (5.0, 1500.0),
        outputs: vec![channel("y_x", "um"), channel("y_y", "um")],
        inputs: vec![channel("u_x", "V"), channel("u_y", "V")],
        hold: 37,
        noise: 0.6,
    });
    data.title = "Gas bearing, closed-loop identification".into();
    data.run = "demo-2026-11-21-01".into();
    data
}

/// One input and one output, 240 000 samples, two verification records.
pub(crate) fn flexible_drive() -> ReportData {
    let plant = Modal { modes: vec![(0.8, 0.3, vec![vec![2.0]]), (54.6, 0.012, vec![vec![-0.03]])] };
    let mut data = report(&Plan {
        plant,
        ts: 5e-4,
        samples: 240_000,
        records: vec!["cycle2", "cycle3"],
        band: (1.0, 900.0),
        outputs: vec![Channel::new("y", "rad")],
        inputs: vec![Channel::new("u", "V")],
        hold: 400,
        noise: 0.02,
    });
    data.title = "Flexible drive, fs2000".into();
    data.run = "flexible-drive".into();
    data
}

/// Three inputs and three outputs with two verification records.
pub(crate) fn three_by_three() -> ReportData {
    let gain = |k: usize, i: usize, j: usize| if i == j { 3.0 } else { 0.4 * (k + i) as f64 - 0.5 };
    let gains = |k: usize| -> Vec<Vec<f64>> { (0..3).map(|i| (0..3).map(|j| gain(k, i, j)).collect()).collect() };
    let modes = [(31.0, 0.02), (52.0, 0.05), (90.0, 0.01)];
    let channels = |name: &str, unit: &str| (1..=3).map(|k| Channel::new(format!("{name}{k}"), unit)).collect();
    let mut data = report(&Plan {
        plant: Modal { modes: modes.iter().enumerate().map(|(k, (hz, zeta))| (*hz, *zeta, gains(k))).collect() },
        ts: 1e-3,
        samples: 60_000,
        records: vec!["run7", "run8"],
        band: (2.0, 480.0),
        outputs: channels("y", "mm"),
        inputs: channels("u", "N"),
        hold: 23,
        noise: 0.3,
    });
    data.title = "Three by three".into();
    data
}

fn report(plan: &Plan) -> ReportData {
    let (ts, outputs, inputs) = (plan.ts, plan.outputs.len(), plan.inputs.len());
    let models = [
        (DrawnMethod::nominal(), plan.plant.with(0.86, 2.4, 0.8)),
        (DrawnMethod::direct(), plan.plant.with(1.03, 1.5, 0.95)),
        (DrawnMethod::hansen(), plan.plant.with(1.001, 1.02, 1.0)),
        (DrawnMethod::hansen_reduced(), plan.plant.with(1.0015, 1.05, 0.997)),
    ];
    let mut data = ReportData {
        summary: "Identified in closed loop by the Hansen scheme and by direct N4SID; compared on records that were not used.".into(),
        program: "youla 0.2.0".into(),
        settings: "[data]\nestimation = [\"record.csv\"]\nsample_time = 2e-4\n\n[controller]\nfeedback = \"negative\"\n\n[identify]\norder = 8\nfeedthrough = \"none\"\nstability = \"require\"\n".into(),
        sources: vec![SourceFile {
            path: "record.csv".into(),
            purpose: "estimation and verification".into(),
            sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".into(),
        }],
        inputs: plan.inputs.clone(),
        outputs: plan.outputs.clone(),
        sample_time: Some(ts),
        methods: models.iter().map(|(method, _)| method.clone()).collect(),
        verdict: verdict(),
        further: vec![Verdict {
            status: LineStatus::Bad,
            text: "The peak sensitivity of the loop is 7.46.".into(),
            evidence: ReportPart::Margins,
        }],
        notes: vec![
            Note { status: LineStatus::Caution, text: "Input u was saturated in 0.3 % of the samples; the measured input was used.".into() },
            Note { status: LineStatus::Info, text: "The first 500 samples of each record were skipped.".into() },
        ],
        bezout_residual: Some(3.1e-14),
        stages: [("read", 0.412), ("factor", 0.003), ("signals", 0.061), ("identify", 0.743), ("validate", 0.218)]
            .map(|(name, seconds)| StageTime { name: name.into(), seconds })
            .into(),
        parameters: ["stiffness", "damping"]
            .map(|name| PhysicalParameter {
                name: name.into(),
                unit: "1/s".into(),
                value: 1.7e6,
                deviation: (name == "damping").then_some(2e3),
                interval: (name == "damping").then_some([1.696e6, 1.704e6]),
                at_bound: (name == "stiffness").then_some(1.7e6),
                derived: false,
            })
            .into(),
        physical: Some(PhysicalEstimate {
            level: Some(0.95),
            verdict: "The residuals are white.".into(),
            names: vec!["stiffness".into(), "damping".into()],
            correlations: vec![vec![1.0, -0.25], vec![-0.25, 1.0]],
            structures: vec![
                PhysicalStructure { name: "[grey_box.structure]".into(), unknowns: Some(2), fit: vec![91.2], aic: Some(0.0), bic: Some(0.0), ..Default::default() },
                PhysicalStructure { name: "with a lag".into(), failure: Some("no start".into()), ..Default::default() },
            ],
        }),
        reduction: Some(DrawnReduction {
            label: "G(S) of order 12 by balanced truncation".into(),
            hankel: vec![31.0, 29.5, 12.1, 11.4, 0.21, 0.12, 0.03, 0.01, 2e-3, 1e-3, 3e-4, 1e-6],
            chosen: 4,
            bound: Some(0.75),
            plant_norm: Some(60.0),
            orders: (1..=6).map(reduced_to).collect(),
            sentence: "The controller stabilises the reduced model of order 4.".into(),
            ..DrawnReduction::default()
        }),
        ..ReportData::default()
    };
    let (u, y) = experiment(plan, 1);
    data.experiments.push(estimation(plan, &u, &y));
    for (k, record) in plan.records.iter().enumerate() {
        let (u, y) = experiment(plan, 10 + k as u64);
        let clock = Timeline::around_largest_swing(ts, &y[0]);
        let trace = |samples: &[f64]| Trace::new("sample", samples, &clock).unwrap();
        let mut compared = Vec::new();
        for output in 0..outputs {
            let mut predictions = Vec::new();
            for (method, model) in &models {
                let predicted = model.simulate(&u, output, ts);
                let residual: Vec<f64> = y[output].iter().zip(&predicted).map(|(a, b)| a - b).collect();
                data.fits.push(Fit {
                    record: (*record).into(),
                    output,
                    method: method.key.clone(),
                    fit: Some(fit(&y[output], &residual)),
                });
                predictions.push(DrawnPrediction {
                    method: method.key.clone(),
                    predicted: trace(&predicted),
                    residual: trace(&residual),
                });
            }
            compared.push(VerifiedOutput { output, measured: trace(&y[output]), predictions });
        }
        data.verification.push(Verification {
            record: (*record).into(),
            prediction: "simulated from the measured input".into(),
            clock,
            outputs: compared,
        });
    }
    data.frequency = Some(frequency(plan, &models, outputs, inputs));
    for (place, (method, model)) in models.iter().enumerate() {
        let mut poles = Vec::new();
        for (hz, zeta, _) in &model.modes {
            let z = Modal::pole(*hz, *zeta, ts);
            poles.extend([[z.re, z.im], [z.re, -z.im]]);
            data.modes.push(DrawnMode {
                method: method.key.clone(),
                hz: *hz,
                zeta: *zeta,
                deviation: None,
                residue: Vec::new(),
            });
        }
        if place == 2 {
            poles.extend([[0.62, 0.31], [0.62, -0.31], [-0.35, 0.0], [0.81, 0.0]]);
        }
        data.certificates.push(Certificate {
            method: method.key.clone(),
            order: poles.len(),
            stabilised_by_controller: Some(place != 1),
            worst_closed_loop_pole: Some(if place == 1 { [0.9989, 0.0613] } else { [0.9812, 0.1023] }),
        });
        let stable = place != 1;
        let disk = DrawnDiskMargin {
            alpha: Some(0.6),
            lowest_gain: Some(0.54),
            highest_gain: Some(1.86),
            phase_deg: Some(33.4),
        };
        let figures = Robustness {
            peak_sensitivity: Some(2.314),
            iso_14839_zone: Some(IsoZone::A),
            lowest_gain: Some(-0.25),
            phase_margin_deg: Some(41.25),
            delay_margin_s: Some(7.5e-4),
            input_disk_margin: Some(disk.clone()),
            output_disk_margin: Some(disk),
            coprime_margin: Some(0.31),
            ..Robustness::default()
        };
        let unstable = Robustness {
            refused: Some("the loop is unstable, with the pole 1.002000".into()),
            coprime_margin: Some(0.0),
            ..Robustness::default()
        };
        let robustness = Robustness {
            nu_gap_to_nominal: Some(0.0),
            nu_gap_to_recommended: Some(1.0),
            ..if stable { figures } else { unstable }
        };
        data.margins.push(LoopMargins { method: method.key.clone(), robustness });
        let zeros = if outputs == inputs { vec![[0.9, 0.1], [0.9, -0.1], [-2.5, 0.0]] } else { Vec::new() };
        data.poles.push(Poles { method: method.key.clone(), poles, zeros });
    }
    for (method, label) in [("hansen", "S from alpha to beta"), ("direct", "G from u to y")] {
        let values = (0..24).map(|k| if k < 8 { 40.0 * 0.55f64.powi(k) } else { 0.04 * 0.96f64.powi(k) }).collect();
        data.orders.push(OrderChoice { method: method.into(), label: label.into(), values, chosen: 8 });
    }
    data
}

fn verdict() -> Vec<Verdict> {
    [
        (LineStatus::Good, "The Hansen model predicts unused data with fits of 83.1 to 91.4 %, against 21.5 % at best for the nominal model.", ReportPart::Fits),
        (LineStatus::Good, "S is stable and the logged controller stabilises G(S): worst closed-loop pole at |z| = 0.9865.", ReportPart::Certificate),
        (LineStatus::Good, "It follows the model-free indirect response to 0.8 dB rms over 20 to 400 Hz.", ReportPart::Frequency),
        (LineStatus::Caution, "Directly identified, the model is not stabilised by the controller under which the data were taken.", ReportPart::Poles),
        (LineStatus::Good, "Four states suffice: the reduced model loses 0.4 points of fit.", ReportPart::Reduction),
    ]
    .map(|(status, text, evidence)| Verdict { status, text: text.into(), evidence })
    .into()
}

/// An order of the reduction; the first two are not stabilised, and the last has no model.
fn reduced_to(order: usize) -> ReductionOrder {
    let error = 3.0 * 10f64.powi(-(order as i32));
    ReductionOrder {
        order,
        error_bound: Some(120.0 * error),
        open_loop_error: Some(60.0 * error),
        open_loop_relative: Some(error),
        closed_loop_relative: (order > 2).then_some(0.5 * error),
        stabilised_by_controller: order > 2,
        worst_closed_loop_pole: Some([0.99, 0.01]),
        failure: (order == 6).then(|| "the reduced model must be stable".into()),
    }
}

fn fit(measured: &[f64], residual: &[f64]) -> f64 {
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let spread = measured.iter().map(|y| (y - mean).powi(2)).sum::<f64>().sqrt();
    100.0 * (1.0 - residual.iter().map(|e| e * e).sum::<f64>().sqrt() / spread)
}
