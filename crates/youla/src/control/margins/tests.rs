use super::{IsoZone, Loop, Margins, margins};
use crate::Error;
use crate::control::{LqrWeights, NoiseCovariance, kalman, lqr, observer_controller, peak_sensitivity};
use crate::linalg::{block, block_diagonal, eye};
use crate::lti::{Continuous, Discrete, StateSpace, TimeDomain};
use crate::{Mat, c64};
use faer::Scale;
use faer::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn matrix<const N: usize, const M: usize>(values: [[f64; M]; N]) -> Mat<f64> {
    Mat::from_fn(N, M, |i, j| values[i][j])
}

/// `gain / (s^n + a[0] s^(n-1) + ...)` under u = -y.
fn under_unit_feedback(gain: f64, a: &[f64]) -> Margins {
    let n = a.len();
    let companion = Mat::from_fn(n, n, |i, j| if i == 0 { -a[j] } else { f64::from(u8::from(i == j + 1)) });
    let b = Mat::from_fn(n, 1, |i, _| f64::from(u8::from(i == 0)));
    let c = Mat::from_fn(1, n, |_, j| if j + 1 == n { gain } else { 0.0 });
    let plant = StateSpace::new(companion, b, c, Mat::zeros(1, 1), Continuous).unwrap();
    margins(&plant, &StateSpace::gain(matrix([[-1.0]]), Continuous).unwrap()).unwrap()
}

/// P. Seiler, A. Packard and P. Gahinet (2020), the example L = 25 / (s^3 + 10 s^2 + 10 s + 10): alpha 0.46 at 1.94 rad/s, gains 0.63
/// to 1.59; gain margin 3.6, phase margin 29.1 degrees.
#[test]
fn the_example_of_the_introduction_to_disk_margins() {
    let found = under_unit_feedback(25.0, &[10.0, 10.0, 10.0]);
    let disk = found.inputs[0].disk;
    assert!((disk.alpha - 0.46).abs() < 0.005 && (disk.frequency - 1.94).abs() < 0.02, "{disk:?}");
    assert!((disk.lowest_gain - 0.63).abs() < 0.005 && (disk.highest_gain.unwrap() - 1.59).abs() < 0.01, "{disk:?}");
    assert!((found.highest_gain().unwrap().factor - 3.6).abs() < 1e-9);
    assert!((found.phase().unwrap().degrees - 29.1).abs() < 0.05);
    assert_eq!(found.input_disks.balanced.alpha, disk.alpha);
}

/// The spinning satellite of MATLAB's documentation of `diskmargin` and of python-control's example `disk_margins.py`: each loop by
/// itself has alpha = 2, all together 0.3754 (gains 0.6839 to 1.4621, phase 21.26 degrees).
#[test]
fn loops_of_a_satellite_are_robust_one_at_a_time_only() {
    let plant = StateSpace::new(
        matrix([[0.0, 10.0], [-10.0, 0.0]]),
        eye(2),
        matrix([[1.0, 10.0], [-10.0, 1.0]]),
        Mat::zeros(2, 2),
        Continuous,
    );
    let controller = StateSpace::gain(Scale(-1.0) * matrix([[1.0, -2.0], [0.0, 1.0]]), Continuous).unwrap();
    let found = margins(&plant.unwrap(), &controller).unwrap();
    assert!(found.outputs.iter().all(|channel| (channel.disk.alpha - 2.0).abs() < 1e-6));
    let together = found.output_disks.balanced;
    assert!((together.alpha - 0.3754).abs() < 1e-3, "{together:?}");
    assert!((together.lowest_gain - 0.6839).abs() < 2e-3 && (together.highest_gain.unwrap() - 1.4621).abs() < 2e-3);
    assert!((together.phase_degrees - 21.2607).abs() < 0.05);
}

/// A stable random loop of an unstable or lightly damped plant under an LQG controller.
pub(super) fn random_loop<T: TimeDomain>(seed: u64, time: T) -> (StateSpace<T>, StateSpace<T>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |r: usize, c: usize| -> Mat<f64> { Mat::from_fn(r, c, |_, _| StandardNormal.sample(&mut rng)) };
    let a = draw(4, 4);
    let a = if time.sample_time().is_some() { Scale(0.45) * a } else { a - 1.0 * eye(4) };
    let (ports, sizes) = (1 + seed as usize % 3, [0.1, 1.0, 10.0]);
    let plant = StateSpace::new(a, draw(4, ports), draw(ports, 4), Mat::zeros(ports, ports), time).unwrap();
    let weight = Scale(sizes[seed as usize % 3]) * eye(ports);
    let f = lqr(&plant, &LqrWeights::on_outputs(&plant, eye(ports).as_ref(), weight.as_ref()).unwrap()).unwrap().f;
    let noise = NoiseCovariance::at_inputs(&plant, eye(ports).as_ref(), eye(ports).as_ref()).unwrap();
    let l = kalman(&plant, &noise).unwrap().l;
    let controller = observer_controller(&plant, f.as_ref(), l.as_ref()).unwrap();
    (plant, controller)
}

/// The worst pole of a loop whose channels have the complex factors f, from its sensitivity: the zeros of (I - F) S + F.
fn instability<T: TimeDomain>(s: &StateSpace<T>, f: &[c64]) -> f64 {
    let complex = |m: faer::MatRef<'_, f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0));
    let rest = Mat::from_fn(f.len(), f.len(), |i, j| if i == j { c64::new(1.0, 0.0) - f[i] } else { c64::ZERO });
    let direct = &rest * complex(s.d()) + Mat::from_fn(f.len(), f.len(), |i, j| if i == j { f[i] } else { c64::ZERO });
    let moved = direct.partial_piv_lu().solve(&rest * complex(s.c()));
    let poles = (complex(s.a()) - complex(s.b()) * moved).eigenvalues().unwrap();
    poles.into_iter().map(|p| s.time().instability(p)).fold(f64::NEG_INFINITY, f64::max)
}

fn factor(disk: &super::DiskMargin, delta: c64) -> c64 {
    let one = c64::new(1.0, 0.0);
    (one + delta * (0.5 * (1.0 - disk.sigma))) / (one - delta * (0.5 * (1.0 + disk.sigma)))
}

fn check_loop<T: TimeDomain>(plant: &StateSpace<T>, controller: &StateSpace<T>, rng: &mut ChaCha8Rng) {
    let found = margins(plant, controller).unwrap();
    let closed = Loop::new(plant, controller).unwrap();
    for (side, channels, together) in [
        (closed.input_sensitivity(), &found.inputs, found.input_disks),
        (closed.output_sensitivity(), &found.outputs, found.output_disks),
    ] {
        let ports = channels.len();
        let with = |i: usize, f: c64| {
            let mut all = vec![c64::new(1.0, 0.0); ports];
            all[i] = f;
            instability(&side, &all)
        };
        for (i, channel) in channels.iter().enumerate() {
            let (low, high) = (channel.lowest_gain.map(|g| g.factor), channel.highest_gain.map(|g| g.factor));
            for step in [1e-6, 0.1, 0.5, 0.9, 1.0 - 1e-6] {
                for limit in [low.unwrap_or(-1e3), high.unwrap_or(1e3)] {
                    let factor = 1.0 + step * (limit - 1.0);
                    assert!(with(i, c64::new(factor, 0.0)) < 0.0, "factor {factor} of {low:?} to {high:?}");
                }
            }
            for limit in [low, high].into_iter().flatten().filter(|limit| limit.abs() < 1e6) {
                assert!(with(i, c64::new(1.0 + (1.0 + 1e-5) * (limit - 1.0), 0.0)) > 0.0, "{limit}");
            }
            if let Some(phase) = channel.phase {
                let turned = |share: f64| {
                    let angle = share * phase.degrees.to_radians();
                    with(i, c64::new(angle.cos(), angle.sin())).max(with(i, c64::new(angle.cos(), -angle.sin())))
                };
                assert!(turned(1.0 - 1e-5) < 0.0 && turned(0.5) < 0.0 && turned(1.0 + 1e-5) > 0.0);
            }
            for disk in [channel.disk, channel.sensitivity_disk] {
                let worst = |size: f64| {
                    let angles = (0..120).map(|k| f64::from(k) * std::f64::consts::PI / 60.0);
                    let delta = |angle: f64| c64::new(angle.cos(), angle.sin()) * (size * disk.alpha);
                    angles.map(|angle| with(i, factor(&disk, delta(angle)))).fold(f64::NEG_INFINITY, f64::max)
                };
                assert!(worst(0.999) < 0.0 && worst(1.01) > 0.0, "{disk:?}");
            }
        }
        for disk in [together.balanced, together.sensitivity] {
            for _ in 0..100 {
                let delta = |angle: f64| c64::new(angle.cos(), angle.sin()) * (0.999 * disk.alpha);
                let all: Vec<c64> = (0..ports).map(|_| factor(&disk, delta(rng.random_range(0.0..6.3)))).collect();
                assert!(instability(&side, &all) < 0.0, "{disk:?}");
            }
            assert!(channels.iter().all(|c| disk.alpha <= c.disk.alpha.max(c.sensitivity_disk.alpha) * 1.001));
        }
        if ports == 2 {
            let disk = together.balanced;
            let delta = |k: i32| {
                let angle = f64::from(k) * std::f64::consts::PI / 30.0;
                factor(&disk, c64::new(angle.cos(), angle.sin()) * (1.01 * disk.alpha))
            };
            assert!((0..60).any(|j| (0..60).any(|k| instability(&side, &[delta(j), delta(k)]) > 0.0)), "{disk:?}");
        }
    }
}

#[test]
fn loops_are_stable_just_inside_and_unstable_just_outside() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for seed in 0..6 {
        let (plant, controller) = random_loop(seed, Continuous);
        check_loop(&plant, &controller, &mut rng);
        let (plant, controller) = random_loop(seed, Discrete::new(1e-2).unwrap());
        check_loop(&plant, &controller, &mut rng);
    }
    let bearing = crate::fixtures::bearing().zoh(Discrete::new(2e-4).unwrap()).unwrap();
    let weights = LqrWeights::on_outputs(&bearing, eye(2).as_ref(), (Scale(20.0) * eye(2)).as_ref()).unwrap();
    let noise = NoiseCovariance::at_inputs(&bearing, eye(2).as_ref(), (Scale(0.1) * eye(2)).as_ref()).unwrap();
    let (f, l) = (lqr(&bearing, &weights).unwrap().f, kalman(&bearing, &noise).unwrap().l);
    check_loop(&bearing, &observer_controller(&bearing, f.as_ref(), l.as_ref()).unwrap(), &mut rng);
}

/// A resonance of damping ratio 1e-5 that reaches over the critical point in a band of 1e-5 rad/s.
#[test]
fn a_narrow_resonance_is_not_missed() {
    let resonance = |residue: f64| {
        let a = block_diagonal(matrix([[0.0, 1.0], [-1.0, -2e-5]]).as_ref(), matrix([[-1.0]]).as_ref());
        let (b, c) = (matrix([[0.0], [1.0], [1.0]]), matrix([[0.0, residue, 0.1]]));
        StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous).unwrap()
    };
    let unit = StateSpace::gain(matrix([[1.0]]), Continuous).unwrap();
    // L = residue s / (s^2 + 2e-5 s + 1) + 0.1 / (s + 1), about residue / 2e-5 + 0.05 at 1 rad/s.
    let found = margins(&resonance(1e-5), &unit).unwrap();
    let limit = found.highest_gain().unwrap();
    assert!((limit.factor - 1.0 / 0.55).abs() < 0.02 && (limit.frequency - 1.0).abs() < 1e-4, "{limit:?}");
    assert!(matches!(margins(&resonance(2e-5), &unit), Err(Error::NotStabilising { .. })));
}

#[test]
fn whole_samples_of_delay_are_counted() {
    let time = Discrete::new(0.1).unwrap();
    let mut checked = 0;
    for seed in (0..60).step_by(3) {
        let (plant, controller) = random_loop(seed, time);
        let found = margins(&plant, &controller).unwrap();
        let Some(delay) = found.inputs[0].delay else { continue };
        let samples = (delay.seconds / time.ts()).floor() as usize;
        let worst = |count: usize| {
            let mut delayed = controller.clone();
            for _ in 0..count {
                let hold = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), time).unwrap();
                delayed = delayed.then(&hold).unwrap();
            }
            margins(&plant, &delayed).is_ok()
        };
        if samples < 40 && delay.seconds > 0.0 {
            assert!(worst(samples) && !worst(samples + 1), "{delay:?}");
            checked += 1;
        }
    }
    assert!(checked > 3, "{checked}");
}

#[test]
fn a_loop_of_direct_feedthrough_has_limits_too() {
    // L = 0.5: critical at a factor of 2, at every frequency; never without gain.
    let half = StateSpace::gain(matrix([[0.5]]), Continuous).unwrap();
    let found = margins(&half, &StateSpace::gain(matrix([[1.0]]), Continuous).unwrap()).unwrap();
    assert!((found.highest_gain().unwrap().factor - 2.0).abs() < 1e-12);
    assert_eq!((found.lowest_gain(), found.phase(), found.delay()), (None, None, None));
    assert!((found.output_sensitivity.value - 2.0).abs() < 1e-12);
    // No loop at all: nothing limits anything.
    let found = margins(&half, &StateSpace::gain(matrix([[0.0]]), Continuous).unwrap()).unwrap();
    assert_eq!((found.highest_gain(), found.zone()), (None, Some(IsoZone::A)));
    assert!((found.inputs[0].disk.alpha - 2.0).abs() < 1e-8 && found.inputs[0].disk.phase_degrees > 89.9);
}

#[test]
fn zones_are_those_of_the_standard() {
    for (peak, zone) in [(1.0, IsoZone::A), (2.99, IsoZone::A), (3.5, IsoZone::B), (4.2, IsoZone::C), (5.0, IsoZone::D)]
    {
        assert_eq!(IsoZone::of(peak), zone);
    }
    assert!(IsoZone::A < IsoZone::D);
    // 9.5, 12 and 14 dB.
    for (limit, decibel) in [(3.0f64, 9.5), (4.0, 12.0), (5.0, 14.0)] {
        assert!((20.0 * limit.log10() - decibel).abs() < 0.05);
    }
}

#[test]
fn the_peak_sensitivity_is_that_of_the_margins() {
    let (plant, controller) = random_loop(1, Discrete::new(1e-2).unwrap());
    let found = margins(&plant, &controller).unwrap();
    assert_eq!(peak_sensitivity(&plant, &controller).unwrap(), found.output_sensitivity.value);
    assert!(found.outputs.iter().all(|c| c.sensitivity.value <= found.output_sensitivity.upper));
    assert!(found.coprime > 0.0 && found.coprime <= 1.0 / found.output_sensitivity.value);
    let unstable = block(&[&[plant.a()]]) + Scale(3.0) * eye(4);
    let unstable = StateSpace::new(unstable, Mat::zeros(4, 2), plant.c().to_owned(), Mat::zeros(2, 2), plant.time());
    let refused = margins(&unstable.unwrap(), &controller);
    assert!(matches!(refused, Err(Error::NotStabilising { .. })), "{refused:?}");
}
