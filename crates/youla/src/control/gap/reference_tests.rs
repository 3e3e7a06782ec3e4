//! Published gaps and margins.

use super::{ChannelScales, coprime_margin, nu_gap};
use crate::Mat;
use crate::control::{LqrWeights, NoiseCovariance, kalman, lqr, observer_controller};
use crate::fixtures::{bearing, degraded};
use crate::linalg::eye;
use crate::lti::{Continuous, Discrete, StateSpace};
use faer::Scale;

fn first_order(gain: f64, pole: f64) -> StateSpace<Continuous> {
    StateSpace::new(Scale(pole) * eye(1), eye(1), Scale(gain) * eye(1), Mat::zeros(1, 1), Continuous).unwrap()
}

fn gain(value: f64) -> StateSpace<Continuous> {
    StateSpace::gain(Scale(value) * eye(1), Continuous).unwrap()
}

/// MATLAB's documentation of `gapmetric`: 1/(s - 0.001) and 1/(s + 0.001), nugap 0.0020. Of `ncfmargin`: 4/(s - 0.001) under
/// negative feedback of 1 and 10, margins 0.7069 and 0.0995.
#[test]
fn examples_of_the_robust_control_toolbox() {
    let gap = nu_gap(&first_order(1.0, 0.001), &first_order(1.0, -0.001)).unwrap();
    assert!((gap.value - 0.0020).abs() < 5e-5);
    let plant = first_order(4.0, 0.001);
    for (feedback, margin) in [(1.0, 0.7069), (10.0, 0.0995)] {
        let found = coprime_margin(&plant, &gain(-feedback)).unwrap();
        assert!((found - margin).abs() < 5e-5, "{found}");
    }
}

/// K. J. Astrom and R. M. Murray, Feedback Systems, on the Vinnicombe metric: 100/(s + 1) and 100/(s - 1), 0.02; 100/(s + 1) and
/// 100/((s + 1)(0.025 s + 1)^2), 0.89.
#[test]
fn examples_of_feedback_systems() {
    let gap = nu_gap(&first_order(100.0, -1.0), &first_order(100.0, 1.0)).unwrap();
    assert!((gap.value - 0.02).abs() < 5e-3);
    let lag = first_order(40.0, -40.0);
    let slow = first_order(100.0, -1.0);
    let gap = nu_gap(&slow, &slow.then(&lag).unwrap().then(&lag).unwrap()).unwrap();
    assert!((gap.value - 0.89).abs() < 5e-3, "{gap:?}");
}

/// The sweep over theta of (27) on the bearing, sampled at 5 kHz, displacements divided by 3.3 um: 0.117, 0.391, 0.699, 0.886, 0.997 on a
/// grid of frequencies. Grids miss peaks of lightly damped modes by some thousandths; the gaps are never below these values.
#[test]
fn gaps_of_the_degraded_bearing() {
    let scales = ChannelScales::new(vec![1.0; 2], vec![3.3; 2]).unwrap();
    let model = |theta: f64| {
        let plant = degraded(&bearing(), 1.0 - theta, 1.0).unwrap();
        plant.zoh(Discrete::new(2e-4).unwrap()).unwrap().balanced().unwrap()
    };
    // b(G_nom, K) of an LQG design falls from 0.37 to 0.28: outputs weighted by 1 per um^2, commands by 100 per V^2, 1 V^2 of noise at
    // the inputs and 0.1 um^2 at the outputs.
    let design = |plant: &StateSpace<Discrete>| {
        let weights = LqrWeights::on_outputs(plant, eye(2).as_ref(), (Scale(100.0) * eye(2)).as_ref()).unwrap();
        let noise = NoiseCovariance::at_inputs(plant, eye(2).as_ref(), (Scale(0.1) * eye(2)).as_ref()).unwrap();
        let (f, l) = (lqr(plant, &weights).unwrap().f, kalman(plant, &noise).unwrap().l);
        scales.controller(&observer_controller(plant, f.as_ref(), l.as_ref()).unwrap()).unwrap()
    };
    let truth = scales.plant(&model(0.0)).unwrap();
    for (theta, on_grid, exact) in [
        (0.03, 0.117, 0.12034),
        (0.1, 0.391, 0.39108),
        (0.2, 0.699, 0.70359),
        (0.3, 0.886, 0.89157),
        (0.5, 0.997, 0.99746),
    ] {
        let (nominal, controller) = (model(theta), design(&model(theta)));
        let nominal = scales.plant(&nominal).unwrap();
        let gap = nu_gap(&nominal, &truth).unwrap().value;
        let margin = coprime_margin(&nominal, &controller).unwrap();
        assert!((0.26..0.39).contains(&margin), "{theta}: {margin}");
        assert!((gap - exact).abs() < 1e-5 && gap > on_grid - 5e-4 && gap < on_grid + 6e-3, "{theta}: {gap}");
    }
}
