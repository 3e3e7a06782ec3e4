//! The branch on which a phase is drawn.
//!
//! A phase is known up to multiples of 360 deg. Curves of models are made continuous and moved as a whole, measured points
//! are moved one by one, each to the branch nearest to one reference curve, so that curves that agree are drawn together.

use super::data::{DrawnResponses, MethodRole};

/// Chooses the branches of all phases, for each pair of output and input by itself.
pub(super) fn align(response: &mut DrawnResponses, role_of: impl Fn(&str) -> MethodRole) {
    for curve in &mut response.models {
        unwrap(&mut curve.phase_deg);
    }
    let mut models = response.models.clone();
    models.sort_by_key(|curve| match role_of(&curve.method) {
        MethodRole::Recommended | MethodRole::Hansen => 0,
        MethodRole::HansenReduced => 1,
        MethodRole::Nominal => 3,
        _ => 2,
    });
    for curve in &mut response.models {
        let reference = models.iter().find(|model| (model.output, model.input) == (curve.output, curve.input));
        if let Some(reference) = reference {
            let turns = median_turns(&reference.phase_deg, &curve.phase_deg);
            curve.phase_deg.iter_mut().for_each(|phase| *phase += 360.0 * turns);
        }
    }
    for measured in &mut response.indirect {
        let reference = models.iter().find(|model| (model.output, model.input) == (measured.output, measured.input));
        if let Some(reference) = reference {
            for (phase, &hz) in measured.phase_deg.iter_mut().zip(&measured.hz) {
                *phase += 360.0 * turns_between(at(&response.hz, &reference.phase_deg, hz), *phase);
            }
        }
    }
}

fn unwrap(phase: &mut [f64]) {
    for k in 1..phase.len() {
        phase[k] += 360.0 * turns_between(phase[k - 1], phase[k]);
    }
}

/// Whole turns that bring `phase` nearest to `reference`; 0 where one of them is not finite.
fn turns_between(reference: f64, phase: f64) -> f64 {
    let turns = ((reference - phase) / 360.0).round();
    if turns.is_finite() { turns } else { 0.0 }
}

fn median_turns(reference: &[f64], phase: &[f64]) -> f64 {
    let mut turns: Vec<f64> = reference.iter().zip(phase).map(|(&a, &b)| turns_between(a, b)).collect();
    turns.sort_by(f64::total_cmp);
    turns.get(turns.len() / 2).copied().unwrap_or(0.0)
}

/// The value of the curve at the grid point at or above `hz`, or at its end.
fn at(grid: &[f64], curve: &[f64], hz: f64) -> f64 {
    let k = grid.partition_point(|&f| f < hz).min(curve.len().saturating_sub(1));
    curve.get(k).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::super::data::{Indirect, ModelResponse};
    use super::*;

    #[test]
    fn curves_that_agree_are_drawn_together() {
        let hz: Vec<f64> = (1..=100).map(f64::from).collect();
        let smooth: Vec<f64> = hz.iter().map(|f| -5.0 * f).collect();
        let wrapped: Vec<f64> = smooth.iter().map(|p| (p + 180.0).rem_euclid(360.0) - 180.0).collect();
        let model = |method: &str, phase_deg: &[f64]| ModelResponse {
            method: method.into(),
            output: 0,
            input: 0,
            magnitude_db: vec![0.0; 100],
            phase_deg: phase_deg.to_vec(),
        };
        let shifted: Vec<f64> = smooth.iter().map(|p| p + 720.0).collect();
        let measured = Indirect {
            output: 0,
            input: 0,
            hz: hz.clone(),
            magnitude_db: vec![0.0; 100],
            phase_deg: wrapped.clone(),
            coherence: vec![1.0; 100],
        };
        let models = vec![model("direct", &shifted), model("hansen", &wrapped)];
        let mut response = DrawnResponses { hz, models, indirect: vec![measured], ..DrawnResponses::default() };
        align(&mut response, |key| if key == "hansen" { MethodRole::Hansen } else { MethodRole::Direct });
        for phase in [&response.models[0].phase_deg, &response.models[1].phase_deg, &response.indirect[0].phase_deg] {
            assert!(phase.iter().zip(&smooth).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
