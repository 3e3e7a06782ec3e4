//! What the paper says of its gas bearing, by equation, and where its print is not to be taken literally.
//!
//! Identities hold to 1e-12 relative (states balanced; continuous, or at 5 kHz). Numbers that the paper does not print
//! follow from its eqs (9)-(12).

use crate::common::*;
use youla::control::closed_loop;
use youla::lti::{Continuous, Mode, StateSpace, TimeDomain, frequency_response};
use youla::validate::fit;
use youla::{Mat, MatRef, c64};
use youla_twin::rig::degraded;

const EXACT: f64 = 1e-12;

/// `y(omega = 0)` for a unit input, um/V.
fn static_gain<T: TimeDomain>(plant: &StateSpace<T>) -> Mat<f64> {
    let response = frequency_response(plant, &[0.0]).unwrap();
    Mat::from_fn(2, 2, |i, j| response.at(0)[(i, j)].re)
}

fn assert_close(what: &str, x: MatRef<'_, f64>, y: MatRef<'_, f64>, tolerance: f64) {
    let error = relative(x, y);
    assert!(error <= tolerance, "{what} misses by {error:.1e}");
}

/// (9)-(12): actuator poles 150.0 and 157.4 Hz, modes 209.7 Hz (zeta 0.102) and 217.6 Hz (zeta 0.082).
#[test]
fn modes_of_the_bearing() {
    let check = |modes: Vec<Mode>| {
        assert_eq!(modes.len(), 4);
        for (mode, (hz, zeta)) in modes.iter().zip([(150.0, 1.0), (157.4, 1.0), (209.7, 0.102), (217.6, 0.082)]) {
            assert!((mode.hz - hz).abs() < 0.05, "{mode:?}");
            assert!((mode.zeta - zeta).abs() < 5e-4, "{mode:?}");
        }
    };
    let plant = bearing(0.0);
    check(plant.modes().unwrap());
    check(sampled(&plant).modes().unwrap());
}

/// (9)-(12): -3.28 and -2.60 um/V, and 0.18 and -0.07 um/V from one axis to the other.
#[test]
fn static_gain_of_the_bearing() {
    let published = [[-3.28, 0.18], [-0.07, -2.60]];
    for found in [static_gain(&bearing(0.0)), static_gain(&sampled(&bearing(0.0)))] {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (found, expected) = (found[(i, j)], published[i][j]);
            assert!((found - expected).abs() <= 0.005, "entry {i} {j}: {found:.4} against {expected}");
        }
    }
}

/// (24) is printed as an identity matrix. As systems `J_G * J_K = [0 I; I 0]` from (epsilon, alpha) to (eta, beta), which
/// is at distance 2 from the print.
#[test]
fn star_product_24() {
    fn check<T: TimeDomain>(name: &str, plant: &StateSpace<T>) {
        let (factors, omega) = (observer_factors(plant), grid_of(plant.time(), 1300.0));
        check_star_product(name, &factors, &omega, EXACT);
        let star = factors.j_g().unwrap().star(&factors.j_k().unwrap()).unwrap();
        let response = frequency_response(star.system(), &[1300.0]).unwrap();
        let literal = (response.at(0) - Mat::<c64>::identity(4, 4)).singular_values().unwrap()[0];
        assert!((literal - 2.0).abs() < 1e-9, "{name}: the print of (24) misses by {literal}, not by 2");
    }
    for (cross_coupling, name) in [(0.0, "stable bearing"), (0.25, "unstable bearing")] {
        check(name, &bearing(cross_coupling));
        check(name, &sampled(&bearing(cross_coupling)));
    }
}

/// (20), (24), (25) and (28) in the time domain, with known noise n on the output of a plant that is not the nominal one:
///
/// ```text
/// alpha = Vt u - Ut y,  beta = Mt y - Nt u          (28)
/// beta - S alpha - (Mt + S Ut) n = 0                 (25)
/// eta = alpha + Ut n,  epsilon = beta - Mt n         (24) with noise
/// epsilon = S eta                                    (20)
/// ```
///
/// Negative controls: without the noise term (25) misses, and with noise (24) is no equality of signals.
#[test]
fn signals_24_25_28_with_known_noise() {
    for (true_plant, a_factor, b_factor) in
        [(bearing(0.0), 0.5, 1.0), (bearing(0.25), 0.97, 1.0), (bearing(0.0), 1.0, 0.7)]
    {
        let nominal = sampled(&degraded(&true_plant, a_factor, b_factor).unwrap());
        let plant = sampled(&true_plant);
        let factors = stabilising_factors(&plant, &nominal);
        let mut rng = rng(7);
        let (alpha, n) = (normal(&mut rng, 4000, 2), normal(&mut rng, 4000, 2));
        let closed = closed_loop(&plant, &factors.j_k().unwrap()).unwrap();
        let z = run(&closed, beside(&alpha, &n).as_ref());
        let (u, y, beta) = (z.subcols(0, 2), z.subcols(2, 2), z.subcols(4, 2));

        let measured = factors.signals(u, y).unwrap();
        assert_close("(28) alpha", measured.alpha(), alpha.as_ref(), EXACT);
        assert_close("(28) beta", measured.beta(), beta, EXACT);

        let s = factors.deviation_of(&plant).unwrap();
        let residual = factors.residual_filter(&s).unwrap();
        let without_noise = beta - run(&s, alpha.as_ref());
        let filtered = run(&residual.part(0..2, 2..4), n.as_ref());
        assert_close("(25)", without_noise.as_ref(), filtered.as_ref(), EXACT);
        assert_close("(25) of the residual filter", run(&residual, z.subcols(0, 4)).as_ref(), filtered.as_ref(), EXACT);
        assert!(without_noise.norm_l2() > 0.1 * beta.norm_l2(), "(25) without noise");

        let clean = factors.signals(u, (y - &n).as_ref()).unwrap();
        let (eta, epsilon) = (clean.alpha(), clean.beta());
        let (to_eta, to_epsilon) = (run(&factors.u_t(), n.as_ref()), run(&factors.m_t(), n.as_ref()));
        assert_close("(24) eta", (&alpha + &to_eta).as_ref(), eta.as_ref(), EXACT);
        assert_close("(24) epsilon", (beta - to_epsilon).as_ref(), epsilon.as_ref(), EXACT);
        assert_close("(20)", run(&s, eta.as_ref()).as_ref(), epsilon.as_ref(), EXACT);
        assert!(relative(eta.as_ref(), alpha.as_ref()) > 0.01, "(24) with noise is no equality");
    }
}

/// (27) before any discretisation: every eigenvalue is multiplied by 1 - theta and the static gain divided by it.
#[test]
fn inferior_knowledge_27() {
    let plant = bearing(0.0);
    let times = |poles: Vec<c64>, c: f64| -> Vec<c64> { poles.into_iter().map(|p| p * c).collect() };
    for theta in [0.03, 0.5, 0.9] {
        let c = 1.0 - theta;
        let nominal = degraded(&plant, c, 1.0).unwrap();
        let error = spectrum_distance(nominal.poles().unwrap(), times(plant.poles().unwrap(), c));
        assert!(error < EXACT, "theta {theta}: eigenvalues miss by {error:.1e}");
        let expected = static_gain(&plant) * faer::Scale(1.0 / c);
        for gain in [static_gain(&nominal), static_gain(&sampled(&nominal))] {
            assert_close("static gain", gain.as_ref(), expected.as_ref(), 1e-11);
        }
    }
}

/// Negative control of (27): the same factor on the sampled A is another model. At theta = 0.03 it moves every pole by
/// `ln(0.97) / ts` = -152 1/s, which more than doubles the damping, and the static gain falls by 15 % where (27) raises it
/// by 3 %.
#[test]
fn inferior_knowledge_27_after_sampling_is_another_model() {
    let (c, plant) = (0.97, sampled(&bearing(0.0)));
    let a = plant.a() * faer::Scale(c);
    let after = StateSpace::new(a, plant.b().to_owned(), plant.c().to_owned(), plant.d().to_owned(), plant.time());
    let after = after.unwrap();
    for (mode, found) in plant.modes().unwrap().iter().zip(after.modes().unwrap()) {
        let s = |mode: &Mode| plant.time().continuous_pole(mode.pole);
        let moved = s(&found) - s(mode);
        assert!((moved - c64::new(c.ln() / TS, 0.0)).norm() < 1e-6, "{moved}");
    }
    let damping: Vec<f64> = after.modes().unwrap().iter().map(|mode| mode.zeta).filter(|zeta| *zeta < 0.9).collect();
    for (i, (gain, zeta)) in [(0.854, 0.214), (0.843, 0.190)].into_iter().enumerate() {
        let ratio = static_gain(&after)[(i, i)] / static_gain(&plant)[(i, i)];
        assert!((ratio - gain).abs() < 1e-3 && (damping[i] - zeta).abs() < 1e-3, "{ratio}, {}", damping[i]);
    }
}

/// The bearing and a degraded model of it without noise, in open loop from rest, both axes driven by one square wave of
/// 0.5 V: fits (26) after the first `skip` of `samples`.
fn nominal_fit((a_factor, b_factor): (f64, f64), period: usize, samples: usize, skip: usize) -> Vec<f64> {
    let plant = bearing(0.0);
    let u = Mat::from_fn(samples, 2, |k, _| if (k / (period / 2)).is_multiple_of(2) { 0.5 } else { -0.5 });
    let output =
        |plant: &StateSpace<Continuous>| run(&sampled(plant), u.as_ref()).subrows(skip, samples - skip).to_owned();
    let (y, predicted) = (output(&plant), output(&degraded(&plant, a_factor, b_factor).unwrap()));
    fit(y.as_ref(), predicted.as_ref()).unwrap()
}

/// (26) of a nominal model with 0.7 B is 70.0 %: to 1e-9 over whole periods of a settled symmetric record, whose mean is
/// zero, and to 0.05 points from rest.
#[test]
fn weak_actuators_fit_70_percent() {
    for (skip, tolerance) in [(10_000, 1e-9), (0, 0.05)] {
        for percent in nominal_fit((1.0, 0.7), 500, 20_000, skip) {
            assert!((percent - 70.0).abs() < tolerance, "{percent} after {skip} samples");
        }
    }
}

/// The mean of the verification record enters (26): whatever the input, the fit of 0.7 B is
/// `100 (1 - 0.3 ||y|| / ||y - mean(y)||)`.
#[test]
fn weak_actuators_fit_by_the_mean_of_the_record() {
    let plant = bearing(0.0);
    let u = Mat::from_fn(3000, 2, |k, j| if (k / (40 + 13 * j)).is_multiple_of(2) { 0.5 } else { -0.1 });
    let (y, predicted) =
        (run(&sampled(&plant), u.as_ref()), run(&sampled(&degraded(&plant, 1.0, 0.7).unwrap()), u.as_ref()));
    for (j, percent) in fit(y.as_ref(), predicted.as_ref()).unwrap().into_iter().enumerate() {
        let mean = y.col(j).iter().sum::<f64>() / 3000.0;
        let spread = (y.col(j).squared_norm_l2() - 3000.0 * mean * mean).sqrt();
        let exact = 100.0 * (1.0 - 0.3 * y.col(j).norm_l2() / spread);
        assert!((percent - exact).abs() < 1e-9 && percent < 69.0, "{percent} against {exact}");
    }
}

/// Table 1 without noise: the nominal model 0.97 A fits 88 to 96 % (the paper: 83.21 and 76.12 % with noise) and 0.5 A
/// -64 to -7.5 % (3.19 and 3 %) for square waves with periods from 250 to 1300 samples.
#[test]
fn nominal_fit_of_table_1_without_noise() {
    for period in (250..=1300).step_by(50) {
        for (slightly, half) in
            nominal_fit((0.97, 1.0), period, 20_000, 0).into_iter().zip(nominal_fit((0.5, 1.0), period, 20_000, 0))
        {
            assert!((88.0..=96.0).contains(&slightly), "0.97 A, period {period}: {slightly}");
            assert!((-64.0..=-7.5).contains(&half), "0.5 A, period {period}: {half}");
        }
    }
}

/// Shorter periods leave these ranges where an odd harmonic meets a resonance: the third of 140 samples is at 107 Hz,
/// where 0.5 A has its modes, and the fifth of 120 samples at 208 Hz, where the bearing has its own.
#[test]
fn nominal_fit_falls_where_a_harmonic_meets_a_resonance() {
    let on_resonance = nominal_fit((0.5, 1.0), 140, 20_000, 0);
    assert!(on_resonance.iter().all(|percent| *percent < -100.0), "{on_resonance:?}");
    let on_resonance = nominal_fit((0.97, 1.0), 120, 20_000, 0);
    assert!(on_resonance.iter().all(|percent| *percent < 86.0), "{on_resonance:?}");
}

/// For ever slower waves the prediction of 0.5 A tends to 2 y and its fit to 0 % from below; it never reaches the 3 % of
/// Table 1 without noise.
#[test]
fn nominal_fit_of_half_a_tends_to_zero() {
    let mut before = f64::NEG_INFINITY;
    for period in [2_500, 5_000, 10_000, 20_000] {
        let worst = nominal_fit((0.5, 1.0), period, 40_000, 0).into_iter().fold(0.0, f64::min);
        assert!(before < worst && worst < 0.0, "period {period}: {worst}");
        before = worst;
    }
    assert!(before > -1.0, "{before}");
}
