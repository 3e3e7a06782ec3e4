//! The gas bearing of eqs (1)-(12): a disc on a flexible shaft, moved by two piezo-controlled air jets.

use faer::{Mat, Scale};
use serde::{Deserialize, Serialize};
use youla::linalg::{block, eye};
use youla::lti::{Continuous, StateSpace};
use youla::{Error, Result};

/// Parameters of the mass-spring-damper model (1) with first-order actuators (7), per unit mass:
///
/// ```text
/// l'' = damping l' + stiffness l + actuator_gain m
/// m' = actuator_pole (u - m)
/// ```
///
/// with displacement l in um, command u and actuator state m in V; index 0 is horizontal, 1 vertical. The matrices carry
/// their sign (stiffness and damping are negative definite). The paper prints units that are wrong by 1e6; these fit its
/// numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bearing {
    /// K of (10), 1/s^2.
    pub stiffness: [[f64; 2]; 2],
    /// D of (9), 1/s.
    pub damping: [[f64; 2]; 2],
    /// B of (11), um/(s^2 V).
    pub actuator_gain: [[f64; 2]; 2],
    /// Diagonal of P of (12), 1/s.
    pub actuator_pole: [f64; 2],
}

impl Default for Bearing {
    /// The values identified in the paper at 0 rpm, eqs (9)-(12).
    fn default() -> Self {
        Bearing {
            damping: [[-224.9, 3.97], [9.12, -267.7]],
            stiffness: [[-1.869e6, -8577.0], [-9510.0, -1.737e6]],
            actuator_gain: [[-6.126e6, 3.154e5], [-1.571e5, -4.516e6]],
            actuator_pole: [989.0, 942.5],
        }
    }
}

impl Bearing {
    /// The plant (3)-(6), (8): states `[l; l'; m]` in um, um/s, V; input u in V, output l in um.
    ///
    /// # Errors
    /// [`youla::Error::NotFinite`] for parameters that are not numbers.
    ///
    /// ```
    /// let modes = youla_twin::rig::Bearing::default().plant()?;
    /// assert_eq!((modes.order(), modes.inputs(), modes.outputs()), (6, 2, 2));
    /// # Ok::<(), youla_twin::Error>(())
    /// ```
    pub fn plant(&self) -> Result<StateSpace<Continuous>> {
        let square = |x: &[[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| x[i][j]);
        let (k, d, b) = (square(&self.stiffness), square(&self.damping), square(&self.actuator_gain));
        let p = Mat::from_fn(2, 2, |i, j| if i == j { self.actuator_pole[i] } else { 0.0 });
        let (zero, one) = (Mat::<f64>::zeros(2, 2), eye(2));
        let (zero, one) = (zero.as_ref(), one.as_ref());
        let minus_p = Scale(-1.0) * &p;
        let a = block(&[&[zero, one, zero], &[k.as_ref(), d.as_ref(), b.as_ref()], &[zero, zero, minus_p.as_ref()]]);
        let input = block(&[&[zero], &[zero], &[p.as_ref()]]);
        StateSpace::new(a, input, block(&[&[one, zero, zero]]), Mat::zeros(2, 2), Continuous)
    }

    /// The bearing with the transfer function of [`degraded`]: with `c = a_factor` its stiffness is `c^2 K`, its damping
    /// `c D`, its actuators `c b_factor B` and `c P`. Its states are scaled, so the factor on A does not show in them.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] unless both factors are positive.
    pub fn degraded(&self, a_factor: f64, b_factor: f64) -> Result<Bearing> {
        positive_factors(a_factor, b_factor)?;
        let times = |x: &[[f64; 2]; 2], factor: f64| x.map(|row| row.map(|v| factor * v));
        Ok(Bearing {
            stiffness: times(&self.stiffness, a_factor * a_factor),
            damping: times(&self.damping, a_factor),
            actuator_gain: times(&self.actuator_gain, a_factor * b_factor),
            actuator_pole: self.actuator_pole.map(|p| a_factor * p),
        })
    }
}

/// A nominal model with inferior knowledge: every entry of A times `a_factor` and of B times `b_factor`, before any
/// discretisation; (27) with `a_factor = 1 - theta`.
///
/// # Errors
/// [`youla::Error::OutOfRange`] unless both factors are positive.
pub fn degraded(plant: &StateSpace<Continuous>, a_factor: f64, b_factor: f64) -> Result<StateSpace<Continuous>> {
    positive_factors(a_factor, b_factor)?;
    let a = Scale(a_factor) * plant.a();
    StateSpace::new(a, Scale(b_factor) * plant.b(), plant.c().to_owned(), plant.d().to_owned(), Continuous)
}

fn positive_factors(a_factor: f64, b_factor: f64) -> Result<()> {
    for (what, value) in [("the factor on A", a_factor), ("the factor on B", b_factor)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::OutOfRange { what: what.into(), value, must: "a positive number" });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::lti::frequency_response;

    #[test]
    fn degraded_bearing_is_the_degraded_plant() {
        let bearing = Bearing::default();
        let (a_factor, b_factor) = (0.4, 0.7);
        let model = degraded(&bearing.plant().unwrap(), a_factor, b_factor).unwrap();
        let same = bearing.degraded(a_factor, b_factor).unwrap().plant().unwrap();
        let omega = [0.0, 300.0, 547.0, 900.0];
        let (one, other) = (frequency_response(&model, &omega).unwrap(), frequency_response(&same, &omega).unwrap());
        for (one, other) in one.iter().zip(other.iter()) {
            assert!((&one.to_owned() - other).norm_max() < 1e-11 * one.norm_max());
        }
        assert!(matches!(bearing.degraded(0.0, 1.0), Err(Error::OutOfRange { .. })));
    }
}
