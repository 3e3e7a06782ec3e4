//! How exact results are: residuals of equations and factors, what noise-free and noisy records give back.

use crate::common::bearing_loop::{Design, Loop};
use crate::equations::{Equation, KINDS};
use crate::page::{head, table};
use crate::timing::middle;
use youla::Result;
use youla::factor::CoprimeFactors;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Order, SubspaceMethod, SubspaceOptions};
use youla::lti::{Discrete, FrequencyResponse, frequency_response};

/// The page.
pub(crate) fn page() -> Result<String> {
    let about = "How exact results are, on seeded random problems and on the simulated gas bearing. The accuracy that the tests \
                 check is documented at each function; these are measured figures.";
    Ok(head("Accuracy", about) + &equations()? + &bezout()? + &plants()?)
}

fn equations() -> Result<String> {
    let mut rows = Vec::new();
    for (kind, name) in KINDS.iter().enumerate() {
        for n in [6, 40, 100] {
            let residuals =
                (0..40).map(|seed| Equation::random(kind, n, seed).residual()).collect::<Result<Vec<_>>>()?;
            rows.push(vec![
                (*name).into(),
                n.to_string(),
                scientific(middle(residuals.clone())),
                scientific(largest(&residuals)),
            ]);
        }
    }
    let about = "Relative residuals of 40 random problems each. Every solution carries its own; nothing is returned whose residual is large. \
                 Beside SciPy and SLICOT on hard problems too: [performance](../performance.md#kernels).";
    Ok(table("Matrix equations", about, &["equation", "states", "median", "largest"], &rows))
}

/// Loops around the bearing with wrong nominal models.
fn bezout() -> Result<String> {
    let mut rows = Vec::new();
    for a_factor in [1.0, 0.9, 0.7, 0.5] {
        let design = Design { a_factor, b_factor: 1.0, input_weight: 100.0, process_noise: 0.01 };
        let factors = Loop::new(&design).factors;
        rows.push(vec![format!("A times {a_factor}"), scientific(factors.bezout_residual(&grid(&factors))?)]);
    }
    let about = "Relative residual of the Bezout identity of the factors of the bearing and its controller, largest over frequency.";
    Ok(table("Coprime factors", about, &["nominal model", "residual"], &rows))
}

/// What the scheme gives back of the plant, over the noise.
fn plants() -> Result<String> {
    let bearing = Loop::new(&Design { a_factor: 0.5, b_factor: 1.0, input_weight: 100.0, process_noise: 0.01 });
    let omega: Vec<f64> = (1..=60).map(|k| 10.0 * std::f64::consts::TAU * f64::from(k)).collect();
    let truth = frequency_response(&bearing.plant, &omega)?;
    let mut rows = Vec::new();
    for (noise, horizon, order) in
        [(0.0, 20, Order::Fixed(12)), (0.03, 30, Order::Fixed(12)), (0.3, 30, Order::Fixed(10))]
    {
        let options = SubspaceOptions { horizon, order, method: SubspaceMethod::Moesp, ..Default::default() };
        let errors = (0..5)
            .map(|seed| {
                let found = hansen(&bearing.factors, &[bearing.record(20_000, noise, seed)], &options)?;
                Ok(distance(&truth, &frequency_response(&found.plant, &omega)?))
            })
            .collect::<Result<Vec<_>>>()?;
        rows.push(vec![format!("{noise} um"), scientific(middle(errors.clone())), scientific(largest(&errors))]);
    }
    let about = "Largest error of the response of G(S) over 10 to 600 Hz, relative to the largest response, from 20 000 samples of the loop \
                 around the bearing whose nominal model has all entries of A halved; five seeds each. The outputs are about 1 um.";
    Ok(table("The plant from noisy records", about, &["output noise", "median", "largest"], &rows))
}

fn distance(truth: &FrequencyResponse, found: &FrequencyResponse) -> f64 {
    let size = truth.iter().map(|at| at.norm_l2()).fold(0.0, f64::max);
    truth.iter().zip(found.iter()).map(|(a, b)| (a - b).norm_l2()).fold(0.0, f64::max) / size
}

fn grid(factors: &CoprimeFactors<Discrete>) -> Vec<f64> {
    let nyquist = std::f64::consts::PI / factors.nominal().time().ts();
    (0..200).map(|k| nyquist * f64::from(k) / 200.0).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn scientific(value: f64) -> String {
    format!("{value:.1e}")
}
