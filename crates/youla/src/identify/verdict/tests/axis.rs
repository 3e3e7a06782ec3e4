//! A velocity loop of two masses, with dry friction at both.

use super::*;

/// Steps of the simulation in a sample.
const STEPS: usize = 16;
/// Motor and load, kg m^2, with a belt of 38 Hz and 3 % damping.
const INERTIA: [f64; 2] = [4e-4, 7e-4];
/// Dry friction of motor and load, N m, beside an excitation of 0.25 N m.
const FRICTION: [f64; 2] = [0.0084, 0.0036];
/// Gain of the velocity loop, N m s.
const GAIN: f64 = 0.05;

/// From the torques at both masses to their velocities, without dry friction.
fn axis(step: f64) -> StateSpace<Discrete> {
    let [motor, load] = INERTIA;
    let mass = motor * load / (motor + load);
    let w = std::f64::consts::TAU * 38.0;
    let (stiff, damped, viscous) = (mass * w * w, 0.06 * w * mass, 1e-3);
    let a = [
        [-(damped + viscous) / motor, damped / motor, -stiff / motor],
        [damped / load, -(damped + viscous) / load, stiff / load],
        [1.0, -1.0, 0.0],
    ];
    let a = Mat::from_fn(3, 3, |i, j| a[i][j]);
    let b = Mat::from_fn(3, 2, |i, j| if i == j { 1.0 / INERTIA[i] } else { 0.0 });
    let c = Mat::from_fn(2, 3, |i, j| if i == j { 1.0 } else { 0.0 });
    let time = Discrete::new(step).unwrap();
    StateSpace::new(a, b, c, Mat::zeros(2, 2), Continuous).unwrap().zoh(time).unwrap()
}

fn recorded(rows: usize) -> LoopRecord {
    let (g, rng) = (axis(1e-3 / STEPS as f64), &mut ChaCha8Rng::seed_from_u64(4));
    let mut normal = |size: f64| Mat::from_fn(rows, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (d, n) = (normal(0.25), normal(1e-3));
    let (mut u, mut y, mut x) = (Mat::<f64>::zeros(rows, 1), Mat::<f64>::zeros(rows, 1), Mat::<f64>::zeros(3, 1));
    for k in 0..rows {
        y[(k, 0)] = x[(0, 0)] + n[(k, 0)];
        u[(k, 0)] = d[(k, 0)] - GAIN * y[(k, 0)];
        for _ in 0..STEPS {
            let drive = [u[(k, 0)], 0.0];
            let torque = Mat::from_fn(2, 1, |i, _| drive[i] - FRICTION[i] * (x[(i, 0)] / 0.05).tanh());
            x = g.a() * &x + g.b() * torque;
        }
    }
    LoopRecord::new(time(), u, y).unwrap().with_input_excitation(d).unwrap()
}

/// At the antiresonance the motor stands still, and the friction of the load is nearly all that moves the response: within two stated deviations of
/// the axis without friction lie nine tenths of all frequencies, and each of the antiresonance.
#[test]
fn friction_of_the_load_is_in_the_deviation_at_the_antiresonance() {
    let controller = StateSpace::gain(Mat::from_fn(1, 1, |_, _| -GAIN), time()).unwrap();
    let running = RunningController::new(controller);
    let found = identify(&[recorded(20_000)], &[], &running, None, &LikelihoodOptions::default()).unwrap();
    let errors = errors(&found, &axis(1e-3), 2.0..200.0);
    // sqrt(k / J_load) = 38 Hz * sqrt(J_motor / (J_motor + J_load)) = 22.9 Hz
    let of = |within: &dyn Fn(f64) -> bool| {
        let of: Vec<bool> =
            errors.iter().filter(|[hz, ..]| within(*hz)).map(|[_, error, d]| *error < 2.0 * d).collect();
        of.iter().filter(|held| **held).count() as f64 / of.len() as f64
    };
    let [all, antiresonance] = [of(&|_| true), of(&|hz| (21.0..25.0).contains(&hz))];
    assert!(all >= 0.9 && antiresonance == 1.0, "{all} {antiresonance} {errors:.2?}");
    assert!(found.trusted(), "{:?}", found.reasons());
}
