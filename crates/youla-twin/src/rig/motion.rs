//! How the rotor moves between samples: the linear part exactly, what is not linear at substeps.
//!
//! With the valve state m, its hysteresis h and an acceleration a from unbalance, the force per unit mass is
//! `B h(m) + a = B (m + r) + a`. The linear part, driven by u, `r = h(m) - m` and a, is discretised exactly with its inputs held
//! over a substep; u is constant between samples, r is taken as the mean of its ends and a at its middle, both in error by
//! the square of the substep. Without hysteresis and unbalance the motion is exact.

use super::parameters::{FlexibleMode, LowPass, RigParameters};
use super::piezo::Piezo;
use super::{Bearing, speed::radians_per_second};
use crate::Result;
use faer::Scale;
use std::f64::consts::PI;
use youla::Mat;
use youla::linalg::{block, eye};
use youla::lti::{Continuous, Discrete, SimulationState, Simulator, StateSpace};

/// Inputs of the linear part: u, r and a, for both axes.
const INPUTS: usize = 6;

/// The linear part: u, r, a to the displacement that the converter sees.
///
/// # Errors
/// [`youla::Error::NotFinite`] for parameters that are not numbers.
pub(super) fn linear_part(
    bearing: &Bearing,
    flexible: Option<&FlexibleMode>,
    low_pass: Option<&LowPass>,
) -> Result<StateSpace<Continuous>> {
    let square = |x: &[[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| x[i][j]);
    let pole = Mat::from_fn(2, 2, |i, j| if i == j { bearing.actuator_pole[i] } else { 0.0 });
    let valve = StateSpace::new(Scale(-1.0) * &pole, pole, eye(2), Mat::zeros(2, 2), Continuous)?;
    let gain = square(&bearing.actuator_gain);
    let forces = block(&[&[gain.as_ref(), gain.as_ref(), eye(2).as_ref()]]);
    let valves = valve.append(&StateSpace::gain(eye(INPUTS - 2), Continuous)?)?.map_output(&forces);
    let mut rotor = oscillators(&square(&bearing.stiffness), &square(&bearing.damping), 1.0)?;
    if let Some(mode) = flexible {
        let (stiffness, damping) = second_order(mode.frequency.value, mode.damping.value);
        rotor = rotor.plus(&oscillators(&stiffness, &damping, mode.residue.value)?)?;
    }
    let moved = valves.then(&rotor)?;
    let Some(filter) = low_pass else { return Ok(moved) };
    let (stiffness, damping) = second_order(filter.frequency.value, filter.damping.value);
    Ok(moved.then(&oscillators(&stiffness, &damping, -stiffness[(0, 0)])?)?)
}

/// `l'' = stiffness l + damping l' + gain input`.
fn oscillators(stiffness: &Mat<f64>, damping: &Mat<f64>, gain: f64) -> Result<StateSpace<Continuous>> {
    let (zero, one) = (Mat::<f64>::zeros(2, 2), eye(2));
    let a = block(&[&[zero.as_ref(), one.as_ref()], &[stiffness.as_ref(), damping.as_ref()]]);
    let b = block(&[&[zero.as_ref()], &[(Scale(gain) * &one).as_ref()]]);
    Ok(StateSpace::new(a, b, block(&[&[one.as_ref(), zero.as_ref()]]), zero.clone(), Continuous)?)
}

/// `-w^2` and `-2 zeta w`, alike in both axes.
fn second_order(hertz: f64, zeta: f64) -> (Mat<f64>, Mat<f64>) {
    let w = 2.0 * PI * hertz;
    (Scale(-w * w) * eye(2), Scale(-2.0 * zeta * w) * eye(2))
}

/// A system without feedthrough whose output is one sample ahead, `C x(k+1) = C A x(k) + C B u(k)`: a step returns what
/// the next measurement will see.
fn one_ahead(system: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let (a, b, c) = (system.a(), system.b(), system.c());
    Ok(StateSpace::new(a.to_owned(), b.to_owned(), c * a, c * b, system.time())?)
}

/// Motion of the linear model, one exact step per sample.
#[derive(Debug, Clone)]
pub(super) struct LinearMotion {
    simulator: Simulator,
    state: SimulationState,
}

impl LinearMotion {
    pub(super) fn new(plant: &StateSpace<Continuous>, time: Discrete) -> Result<Self> {
        let simulator = Simulator::new(&one_ahead(&plant.zoh(time)?)?);
        let state = simulator.start(&vec![0.0; plant.order()])?;
        Ok(LinearMotion { simulator, state })
    }

    /// One sample under the command u; the displacement at its end.
    #[inline]
    pub(super) fn advance(&mut self, u: [f64; 2]) -> [f64; 2] {
        let y = self.simulator.step(&mut self.state, &u);
        [y[0], y[1]]
    }
}

/// Motion with hysteresis and unbalance, in substeps.
#[derive(Debug, Clone)]
pub(super) struct FineMotion {
    linear: LinearMotion,
    valves: [Valve; 2],
    substeps: u64,
    /// Angle of the shaft in one substep.
    turn: f64,
    /// Amplitude of a, um/s^2.
    unbalance: f64,
    steps: u64,
}

impl FineMotion {
    pub(super) fn new(parameters: &RigParameters, linear: &StateSpace<Continuous>, rpm: f64) -> Result<Self> {
        let substeps = parameters.timing.substeps.value;
        let step = parameters.timing.sample_time.value / substeps as f64;
        let omega = radians_per_second(rpm);
        Ok(FineMotion {
            linear: LinearMotion::new(linear, Discrete::new(step)?)?,
            valves: [0, 1].map(|axis| Valve::new(parameters, axis, step)),
            substeps: substeps as u64,
            turn: omega * step,
            unbalance: parameters.rotation.eccentricity.value * omega * omega,
            steps: 0,
        })
    }

    /// One sample under the command u; the displacement at its end.
    pub(super) fn advance(&mut self, u: [f64; 2]) -> [f64; 2] {
        let mut y = [0.0; 2];
        for _ in 0..self.substeps {
            let residual = [self.valves[0].advance(u[0]), self.valves[1].advance(u[1])];
            let (sin, cos) = ((self.steps as f64 + 0.5) * self.turn).sin_cos();
            let input = [u[0], u[1], residual[0], residual[1], self.unbalance * cos, self.unbalance * sin];
            let ahead = self.linear.simulator.step(&mut self.linear.state, &input);
            y = [ahead[0], ahead[1]];
            self.steps += 1;
        }
        y
    }

    /// Angle of the shaft, rad.
    pub(super) fn angle(&self) -> f64 {
        self.steps as f64 * self.turn
    }
}

/// One valve: `m' = pole (u - m)`, and the hysteresis of its piezo.
#[derive(Debug, Clone)]
struct Valve {
    m: f64,
    decay: f64,
    piezo: Option<Piezo>,
    residual: f64,
}

impl Valve {
    fn new(parameters: &RigParameters, axis: usize, step: f64) -> Self {
        let a = &parameters.actuator;
        let stroke = 0.5 * (a.command_max.value - a.command_min.value);
        let piezo = a.hysteresis.as_ref().map(|h| Piezo::new(h, stroke));
        Valve { m: 0.0, decay: (-parameters.bearing.actuator_pole.value[axis] * step).exp(), piezo, residual: 0.0 }
    }

    /// One substep: the mean of `r = h(m) - m` at its ends.
    #[inline]
    fn advance(&mut self, u: f64) -> f64 {
        let Some(piezo) = &mut self.piezo else { return 0.0 };
        self.m = u + self.decay * (self.m - u);
        let before = std::mem::replace(&mut self.residual, piezo.output(self.m) - self.m);
        0.5 * (before + self.residual)
    }
}
