//! The gas bearing of eqs (1)-(12) at rest, for the unit tests.

use crate::linalg::{block, eye};
use crate::lti::{Continuous, StateSpace};
use crate::{Mat, Result};
use faer::Scale;

/// Eqs (3)-(6), (8) with the published matrices (9)-(12): states `[l; l'; m]` in um, um/s, V; input in V, output in um.
pub(crate) fn bearing() -> StateSpace<Continuous> {
    let square = |x: [[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| x[i][j]);
    let damping = square([[-224.9, 3.97], [9.12, -267.7]]);
    let stiffness = square([[-1.869e6, -8577.0], [-9510.0, -1.737e6]]);
    let actuator_gain = square([[-6.126e6, 3.154e5], [-1.571e5, -4.516e6]]);
    let actuator_pole = square([[989.0, 0.0], [0.0, 942.5]]);
    let (zero, one, decay) = (Mat::<f64>::zeros(2, 2), eye(2), Scale(-1.0) * &actuator_pole);
    let (zero, one) = (zero.as_ref(), one.as_ref());
    let moved = [stiffness.as_ref(), damping.as_ref(), actuator_gain.as_ref()];
    let a = block(&[&[zero, one, zero], &moved, &[zero, zero, decay.as_ref()]]);
    let b = block(&[&[zero], &[zero], &[actuator_pole.as_ref()]]);
    StateSpace::new(a, b, block(&[&[one, zero, zero]]), Mat::zeros(2, 2), Continuous).unwrap()
}

/// (27): every entry of A times `a_factor` and of B times `b_factor`.
pub(crate) fn degraded(plant: &StateSpace<Continuous>, a_factor: f64, b_factor: f64) -> Result<StateSpace<Continuous>> {
    let (a, b) = (Scale(a_factor) * plant.a(), Scale(b_factor) * plant.b());
    StateSpace::new(a, b, plant.c().to_owned(), plant.d().to_owned(), Continuous)
}
