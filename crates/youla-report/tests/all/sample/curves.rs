//! Records and frequency responses of a plan.

use super::{Modal, Plan};
use faer::c64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use youla::signal::Channel;
use youla_report::data::*;
use youla_report::{Timeline, Trace};

/// Inputs and noisy outputs of one record.
pub(super) fn experiment(plan: &Plan, seed: u64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = |size: f64| -> f64 {
        let value: f64 = StandardNormal.sample(&mut random);
        value * size
    };
    let u: Vec<Vec<f64>> = (0..plan.inputs.len())
        .map(|_| {
            let mut level = 1.0;
            (0..plan.samples)
                .map(|k| {
                    if k % plan.hold == 0 {
                        level = if noise(1.0) > 0.0 { 1.0 } else { -1.0 };
                    }
                    level + noise(0.02)
                })
                .collect()
        })
        .collect();
    let y = (0..plan.outputs.len())
        .map(|output| {
            let clean = plan.plant.simulate(&u, output, plan.ts);
            clean.iter().map(|y| y + noise(plan.noise)).collect()
        })
        .collect();
    (u, y)
}

pub(super) fn estimation(plan: &Plan, u: &[Vec<f64>], y: &[Vec<f64>]) -> DrawnExperiment {
    let clock = Timeline::around_largest_swing(plan.ts, &y[0]);
    let mut signals = Vec::new();
    let mut add = |kind, channel: Channel, samples: &[f64]| {
        let trace = Trace::new(&channel.name, samples, &clock).unwrap();
        signals.push(Signal { kind, channel, trace });
    };
    for (k, channel) in plan.inputs.iter().enumerate() {
        let square: Vec<f64> = u[k].iter().map(|u| u.signum() * 0.5).collect();
        add(SignalKind::Excitation, Channel::new(format!("d_{}", k + 1), &channel.unit), &square);
    }
    plan.inputs.iter().zip(u).for_each(|(channel, u)| add(SignalKind::Input, channel.clone(), u));
    plan.outputs.iter().zip(y).for_each(|(channel, y)| add(SignalKind::Output, channel.clone(), y));
    for (k, channel) in plan.inputs.iter().enumerate() {
        let alpha: Vec<f64> = u[k].iter().map(|u| u * 0.7).collect();
        add(SignalKind::Alpha, Channel::new(format!("alpha_{}", k + 1), &channel.unit), &alpha);
    }
    for (k, channel) in plan.outputs.iter().enumerate() {
        let beta: Vec<f64> = y[k].windows(2).map(|pair| pair[1] - pair[0]).chain([0.0]).collect();
        add(SignalKind::Beta, Channel::new(format!("beta_{}", k + 1), &channel.unit), &beta);
    }
    DrawnExperiment { name: "estimation".into(), clock, signals }
}

pub(super) fn frequency(plan: &Plan, models: &[(DrawnMethod, Modal)], outputs: usize, inputs: usize) -> DrawnResponses {
    let grid = |points: usize| -> Vec<f64> {
        let ratio = plan.band.1 / plan.band.0;
        (0..points).map(|k| plan.band.0 * ratio.powf(k as f64 / (points - 1) as f64)).collect()
    };
    let hz = grid(500);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut noise = move || -> f64 { StandardNormal.sample(&mut random) };
    let mut response = DrawnResponses { hz: hz.clone(), ..DrawnResponses::default() };
    for output in 0..outputs {
        for input in 0..inputs {
            for (method, model) in models {
                let values: Vec<c64> = hz.iter().map(|&f| model.response(f, output, input)).collect();
                if method.key == "hansen" {
                    response.bands.push(region(output, input, &values));
                }
                response.models.push(ModelResponse {
                    method: method.key.clone(),
                    output,
                    input,
                    magnitude_db: values.iter().map(|g| 20.0 * g.norm().log10()).collect(),
                    phase_deg: values.iter().map(|g| g.arg().to_degrees()).collect(),
                });
            }
            let points = grid(280);
            let mut indirect = Indirect {
                output,
                input,
                hz: points.clone(),
                magnitude_db: vec![],
                phase_deg: vec![],
                coherence: vec![],
            };
            for f in points {
                let g = plan.plant.response(f, output, input);
                let disturbance = 0.02 * plan.noise * (f / 50.0).sqrt();
                let coherence = g.norm() / (g.norm() + disturbance);
                let g = g + c64::new(noise(), noise()) * (disturbance * 0.7);
                indirect.magnitude_db.push(20.0 * g.norm().log10());
                indirect.phase_deg.push(g.arg().to_degrees());
                indirect.coherence.push(coherence);
            }
            response.indirect.push(indirect);
        }
    }
    if outputs.min(inputs) > 1 {
        response.singular = (0..outputs.min(inputs)).map(|place| singular(&hz, place)).collect();
    }
    response
}

/// A region of 5 % about each value.
fn region(output: usize, input: usize, values: &[c64]) -> DrawnBand {
    let db = |factor: f64| values.iter().map(|g| 20.0 * (factor * g.norm()).log10()).collect();
    let circle = |g: &c64| [(0.05 * g.norm()).powi(2), 0.0, (0.05 * g.norm()).powi(2)];
    let region = values.iter().flat_map(circle).collect();
    DrawnBand { method: "hansen".into(), output, input, level: 0.95, low_db: db(0.95), high_db: db(1.05), region }
}

/// Made up: one curve above the other.
fn singular(hz: &[f64], place: usize) -> SingularValue {
    let value_db: Vec<f64> = hz.iter().map(|f| 20.0 - 10.0 * place as f64 - 5.0 * f.log10()).collect();
    SingularValue { method: "hansen".into(), place, value_db }
}
