//! Norms by other programs: python-control 0.10.2 (`control.norm`) and SLICOT through slycot
//! 0.7.1 (`ab13dd`, tolerance 1e-10), on the bearing of eqs (9)-(12), its zero-order-hold image at 5 kHz, and on systems with
//! entries by formula, so that they can be computed again elsewhere.

use super::{PeakOptions, h2_norm, hinf_norm};
use crate::fixtures::bearing;
use crate::lti::{Continuous, Discrete, StateSpace, TimeDomain};
use faer::{Mat, Scale};

/// n states, m inputs, p outputs; A is `scale` times a matrix of small numbers plus `shift` times the identity.
fn by_formula<T: TimeDomain>(size: [usize; 3], scale: f64, shift: f64, feedthrough: f64, time: T) -> StateSpace<T> {
    let [n, m, p] = size;
    let entry = |k: usize, modulus: usize, offset: f64, unit: f64| ((k % modulus) as f64 - offset) / unit;
    let a = Mat::from_fn(n, n, |i, j| {
        scale * entry(7 * i + 3 * j + i * j, 11, 5.0, 10.0) + if i == j { shift } else { 0.0 }
    });
    let b = Mat::from_fn(n, m, |i, j| entry(5 * i + 2 * j, 7, 3.0, 3.0));
    let c = Mat::from_fn(p, n, |i, j| entry(3 * i + 4 * j, 9, 4.0, 4.0));
    let d = Mat::from_fn(p, m, |i, j| entry(i + 2 * j, 3, 1.0, 2.0));
    StateSpace::new(a, b, c, Scale(feedthrough) * d, time).unwrap()
}

fn check(what: &str, found: f64, cited: f64) {
    assert!((found / cited - 1.0).abs() < 1e-9, "{what}: {found}, cited {cited}");
}

#[test]
fn bearing_has_the_norms_of_python_control() {
    let plant = bearing();
    let peak = hinf_norm(&plant, &PeakOptions::default()).unwrap();
    check("hinf", peak.value, 11.814528148625854);
    assert!((peak.frequency / 1351.9149121963344 - 1.0).abs() < 1e-4);
    check("h2", h2_norm(&plant).unwrap(), 161.91819144619095);
    let sampled = plant.zoh(Discrete::new(2e-4).unwrap()).unwrap();
    let peak = hinf_norm(&sampled, &PeakOptions::default()).unwrap();
    check("hinf of the sampled bearing", peak.value, 11.778561119893775);
    assert!((peak.frequency * 2e-4 / 0.2703712848818458 - 1.0).abs() < 1e-4);
    check("h2 of the sampled bearing", h2_norm(&sampled).unwrap(), 2.2842810177817006);
}

#[test]
fn continuous_systems_have_the_norms_of_slicot() {
    for (size, shift, hinf, h2) in [
        ([5, 1, 1], -2.0, 0.5, 0.9432268105639102),
        ([8, 2, 3], -3.0, 1.2723542633518594, 1.2854322735597206),
        ([12, 3, 2], -1.0, 9.660112447043891, 4.027538082840323),
    ] {
        let system = by_formula(size, 1.0, shift, 1.0, Continuous);
        check("hinf", hinf_norm(&system, &PeakOptions::default()).unwrap().value, hinf);
        assert_eq!(h2_norm(&system).unwrap(), f64::INFINITY);
        check("h2", h2_norm(&by_formula(size, 1.0, shift, 0.0, Continuous)).unwrap(), h2);
    }
}

#[test]
fn discrete_systems_have_the_norms_of_slicot() {
    for (size, scale, hinf, omega, h2) in [
        ([6, 2, 2], 0.25, 2.357135434044922, std::f64::consts::PI, 1.9933145218150785),
        ([9, 1, 3], 0.3, 3.2186163875255165, 2.7854083662108935, 2.9779605602766317),
        ([10, 2, 2], 0.6, 4.226138774766867, 0.0, 3.8922024563397772),
    ] {
        let system = by_formula(size, scale, 0.0, 1.0, Discrete::new(1.0).unwrap());
        let peak = hinf_norm(&system, &PeakOptions::default()).unwrap();
        check("hinf", peak.value, hinf);
        assert!((peak.frequency - omega).abs() < 1e-4);
        check("h2", h2_norm(&system).unwrap(), h2);
    }
}
