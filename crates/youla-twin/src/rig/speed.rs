//! What a turning shaft does to the bearing.

use super::{Bearing, RigParameters};
use crate::{Error, Result};
use std::f64::consts::PI;

/// The bearing at a speed. With `Omega` in rad/s, `J = [0 -1; 1 0]` the quarter turn in the direction of rotation and `|K|`
/// the mean stiffness,
///
/// ```text
/// stiffness = (1 + b (Omega / Omega_max)^2) K_0 - gamma Omega D_0 J + c |K| J
/// damping   = D_0 / (1 + (Omega / Omega_half)^2) + g Omega J
/// ```
///
/// stiffness growth b, damping that falls to half at `Omega_half`, gyroscopic term g. The film turns with `gamma Omega`: its
/// damping acts on the velocity relative to it, `D_0 (l' - gamma Omega J l)`, which drives the forward whirl (D_0 is negative
/// definite). c is the cross-coupling knob. Basis of the terms: the parameter file.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for a speed outside of 0 to `rotation.max_speed`.
///
/// ```
/// use youla_twin::rig::{RigParameters, bearing_at_speed};
/// let parameters = RigParameters::shipped();
/// assert_eq!(bearing_at_speed(&parameters, 0.0)?, parameters.bearing.model());
/// assert!(bearing_at_speed(&parameters, 1e5).is_err());
/// # Ok::<(), youla_twin::Error>(())
/// ```
pub fn bearing_at_speed(parameters: &RigParameters, rpm: f64) -> Result<Bearing> {
    let rotation = &parameters.rotation;
    if !(0.0..=rotation.max_speed.value).contains(&rpm) {
        return Err(Error::Method(youla::Error::OutOfRange {
            what: "the speed in rpm".into(),
            value: rpm,
            must: "from 0 to max_speed",
        }));
    }
    let still = parameters.bearing.model();
    let omega = radians_per_second(rpm);
    let growth = 1.0 + rotation.stiffness_growth.value * (rpm / rotation.max_speed.value).powi(2);
    let fall = 1.0 + (rpm / rotation.damping_half_speed.value).powi(2);
    let whirl = rotation.whirl_ratio.value * omega;
    let mean = 0.5 * (still.stiffness[0][0] + still.stiffness[1][1]).abs();
    let skew = rotation.cross_coupling.value * mean;
    let gyroscopic = rotation.gyroscopic.value * omega;
    let entry = |f: &dyn Fn(usize, usize) -> f64| [[f(0, 0), f(0, 1)], [f(1, 0), f(1, 1)]];
    Ok(Bearing {
        stiffness: entry(&|i, j| {
            // D_0 J: the columns of D_0 exchanged, the second negated.
            let turned = if j == 0 { still.damping[i][1] } else { -still.damping[i][0] };
            growth * still.stiffness[i][j] - whirl * turned + skew * TURN[i][j]
        }),
        damping: entry(&|i, j| still.damping[i][j] / fall + gyroscopic * TURN[i][j]),
        ..still
    })
}

/// J, a quarter turn.
const TURN: [[f64; 2]; 2] = [[0.0, -1.0], [1.0, 0.0]];

/// Angular speed.
pub(super) fn radians_per_second(rpm: f64) -> f64 {
    rpm * PI / 30.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::lti::Discrete;

    fn at(rpm: f64, change: impl Fn(&mut RigParameters)) -> Bearing {
        let mut parameters = RigParameters::shipped();
        change(&mut parameters);
        bearing_at_speed(&parameters, rpm).unwrap()
    }

    fn radius(bearing: &Bearing) -> f64 {
        let sampled = bearing.plant().unwrap().zoh(Discrete::new(2e-4).unwrap()).unwrap();
        sampled.worst_pole().unwrap().unwrap().norm()
    }

    #[test]
    fn cross_coupling_drives_the_bearing_unstable() {
        // Shares of 1.8e6 1/s^2; the mean stiffness is 1.803e6, which moves the last digit.
        for (share, magnitude) in [(0.2, 1.0017), (0.25, 1.0084)] {
            let found = radius(&at(0.0, |p| p.rotation.cross_coupling.value = share * 1.8 / 1.803));
            assert!((found - magnitude).abs() < 5e-5, "{share}: {found}");
        }
    }

    #[test]
    fn whirl_at_2500_rpm_has_its_share_of_the_stiffness() {
        let turning = at(2500.0, |p| {
            p.rotation.whirl_ratio.value = 0.5;
            p.rotation.stiffness_growth.value = 0.0;
        });
        let still = Bearing::default();
        // 29.4e3 1/s^2 by the damping 225 1/s of the horizontal axis, forward: minus above the diagonal.
        assert!((turning.stiffness[0][1] - still.stiffness[0][1] + 29.4e3).abs() < 100.0);
        assert!((turning.stiffness[1][0] - still.stiffness[1][0] - 35.0e3).abs() < 100.0);
        // Gyroscopic term 26 1/s.
        assert!(
            (turning.damping[1][0] - still.damping[1][0] / (1.0 + (2500f64 / 8600.0).powi(2)) - 26.18).abs() < 0.01
        );
    }

    #[test]
    fn damping_falls_and_stiffness_grows_with_speed() {
        let turning = at(7000.0, |p| p.rotation.damping_half_speed.value = 7000.0);
        let still = Bearing::default();
        assert!((turning.damping[0][0] / still.damping[0][0] - 0.5).abs() < 1e-12);
        let growth = |p: &mut RigParameters| p.rotation.whirl_ratio.value = 0.0;
        assert!((at(7000.0, growth).stiffness[0][0] / still.stiffness[0][0] - 1.2).abs() < 1e-12);
    }

    #[test]
    fn impossible_speeds_are_refused() {
        for rpm in [-1.0, 7000.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                bearing_at_speed(&RigParameters::shipped(), rpm),
                Err(Error::Method(youla::Error::OutOfRange { .. }))
            ));
        }
    }
}
