//! Machines of the unit tests: the gas bearing of eqs (1)-(12) at rest, and a drive with its records in closed loop.

use crate::identify::likelihood::{
    Experiment, LikelihoodOptions, LoopKnowledge, LoopSignals, Recommendation, recommend,
};
use crate::linalg::{block, eye};
use crate::lti::{Continuous, Discrete, StateSpace, frequency_response};
use crate::{Mat, Result};
use faer::{Scale, c64};
use std::f64::consts::TAU;

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

/// A drive `0.01 / ((z - 1) (z - pole))` under `u = -8 y + 7.2 y(t-1) + d`, sampled at 1 kHz.
pub(crate) struct Drive {
    /// Its pole beside the integrator.
    pub(crate) pole: f64,
}

impl Drive {
    /// Columns u, y and d; at each sample the excitation d, a torque beside the input and what is added to the output are given.
    pub(crate) fn records(&self, samples: usize, mut given: impl FnMut(usize) -> [f64; 3]) -> [Mat<f64>; 3] {
        let (mut x, mut v, mut before) = (0.0, 0.0, 0.0);
        let mut rows = Vec::with_capacity(samples);
        for t in 0..samples {
            let [d, torque, added] = given(t);
            let y = x + added;
            let u = d - 8.0 * y + 7.2 * before;
            rows.push([u, y, d]);
            before = y;
            x += v;
            v = self.pole * v + 0.01 * (u + torque);
        }
        [0, 1, 2].map(|j| Mat::from_fn(samples, 1, |t, _| rows[t][j]))
    }

    /// Its controller, without the excitation.
    pub(crate) fn controller() -> StateSpace<Discrete> {
        let matrix = |value: f64| Mat::from_fn(1, 1, |_, _| value);
        StateSpace::new(matrix(0.0), matrix(1.0), matrix(7.2), matrix(-8.0), Discrete::new(1e-3).unwrap()).unwrap()
    }

    /// The model that two thirds of a record support, beside the last one as fresh data.
    pub(crate) fn recommended(&self, [u, y, d]: &[Mat<f64>; 3], options: &LikelihoodOptions) -> Recommendation {
        let (k, explained) = (Drive::controller(), u - d);
        let part = |from: usize, rows: usize| {
            let [u, y, d, explained] = [u, y, d, &explained].map(|x| x.subrows(from, rows));
            (Experiment::new(u, y), LoopSignals { seen: y, explained, applied: u, excitation: Some(d) })
        };
        let third = u.nrows() / 3;
        let ((estimation, first), (fresh, second)) = (part(0, 2 * third), part(2 * third, third));
        let known = LoopKnowledge::new(Some(&k), Some(&k), vec![first], vec![second]).unwrap();
        recommend(&[estimation], &[fresh], Some(&known), k.time(), options).unwrap()
    }

    /// The largest error of a response over its stated deviation, at 2 to 100 Hz.
    pub(crate) fn largest_error(&self, found: &Recommendation) -> f64 {
        let of = |hz: f64| {
            let z = c64::cis(TAU * hz * 1e-3);
            let truth = 0.01 / ((z - 1.0) * (z - self.pole));
            let response = frequency_response(&found.plant, &[TAU * hz]).unwrap().at(0)[(0, 0)];
            let [rr, _, ii] = found.region.at(hz).entries().covariance((0, 0));
            (response - truth).norm() / (rr + ii).sqrt()
        };
        [2.0, 5.0, 10.0, 20.0, 50.0, 100.0].map(of).into_iter().fold(0.0, f64::max)
    }
}
