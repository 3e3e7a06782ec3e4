//! Identities of the design: what is judged on the grid is what the exact code says of the same loop.

use super::margins::margins;
use super::pid::diagonal;
use super::recognise::recognise;
use super::scenarios::{Grid, Judged, Scenario};
use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use youla::Mat;
use youla::control::{closed_loop, with_input_port};
use youla::identify::likelihood::{Experiment, LikelihoodOptions, recommend};
use youla::lti::{Continuous, simulate};

fn time() -> Discrete {
    Discrete::new(1e-3).unwrap()
}

/// A motor with a resonance at 60 Hz and a dead time of one sample; unstable where it is not braked.
fn machine(brake: f64) -> StateSpace<Discrete> {
    let w = 377.0;
    let entry = |rows: [&[f64]; 4]| Mat::from_fn(4, rows[0].len(), |i, j| rows[i][j]);
    let a = entry([&[0.0, 1.0, 0.0, 0.0], &[0.0, -brake, 0.0, 0.0], &[0.0, 0.0, 0.0, w], &[0.0, 0.0, -w, -0.06 * w]]);
    let b = entry([&[0.0], &[600.0], &[0.0], &[1.0]]);
    let c = Mat::from_fn(1, 4, |_, j| [1.0, 0.0, 1.0, 0.0][j]);
    let held = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous).unwrap().zoh(time()).unwrap();
    let delay = StateSpace::difference_equation(&vec![vec![vec![0.0, 1.0]]], &vec![vec![vec![1.0]]], time()).unwrap();
    held.then(&delay).unwrap()
}

fn pid(discretisation: Discretisation, [kp, ki, kd, derivative_filter]: [f64; 4]) -> PidController {
    let gains = PidGains { discretisation, kp, ki, kd, derivative_filter };
    PidController { gains, notches: Vec::new(), delay: 0 }
}

fn running() -> PidController {
    pid(Discretisation::BackwardEuler, [0.8, 2.0, 0.02, 2e-3])
}

fn grid_of(plant: &StateSpace<Discrete>, k: &StateSpace<Discrete>) -> Grid {
    let looped = closed_loop(plant, &with_input_port(k).unwrap()).unwrap();
    Grid::new(time(), &[plant, &looped]).unwrap()
}

fn near(a: f64, b: f64) {
    assert!((a / b - 1.0).abs() < 0.03, "{a} for {b}");
}

/// Margins of controllers on the grid and the exact ones, whose stability and whose gain, phase and delay margins in each loop agree; `None` where the
/// loop is unstable or its peak is beyond 4, which is far from where a design ends. Counts the compared and the unstable ones.
fn compared(
    grid: &Grid,
    scenario: &Scenario,
    c: &[PidController],
    [stable, unstable]: [&mut usize; 2],
) -> Option<(Vec<GridMargins>, youla::control::Margins)> {
    let found = margins(grid, scenario, &c.iter().map(|c| grid.controller(c)).collect::<Vec<_>>());
    let exact = youla::control::margins(&scenario.plant, &whole(c, time()).unwrap());
    assert_eq!(found.is_some(), exact.is_ok(), "{c:?}");
    let (Some(found), Ok(exact)) = (found, exact) else {
        *unstable += 1;
        return None;
    };
    if exact.output_sensitivity.value > 4.0 {
        return None;
    }
    *stable += 1;
    for (found, channel) in found.iter().zip(&exact.outputs) {
        let lowest = channel.lowest_gain.filter(|g| g.factor > 1e-6).map_or(f64::INFINITY, |g| 1.0 / g.factor);
        near(found.gain.min(10.0), 10f64.min(channel.highest_gain.map_or(f64::INFINITY, |g| g.factor).min(lowest)));
        near(found.phase, channel.phase.unwrap().degrees);
        near(found.delay, channel.delay.unwrap().seconds);
    }
    Some((found, exact))
}

/// Stability of random controllers, and up to a peak of the sensitivity of 4 peak, gain, phase and delay margin, each within 3 % of
/// [`youla::control::margins()`].
#[test]
fn margins_equal_the_exact_ones() {
    let plant = machine(8.0);
    let k = running().system(time()).unwrap();
    let grid = grid_of(&plant, &k);
    let on = grid.each(&k).unwrap();
    let scenario = Scenario::new(&grid, plant.clone(), Judged { system: &k, on: &on }, |_| {}).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut stable, mut unstable) = (0, 0);
    for rule in [Discretisation::BackwardEuler, Discretisation::Tustin] {
        for _ in 0..60 {
            let mut factor = || 10f64.powf(rng.random_range(-1.0..1.0));
            let notches = vec![Notch { hz: 60.0 * factor().sqrt(), width: 0.3, depth: 0.2 }];
            let c = PidController {
                notches,
                ..pid(rule, [0.8 * factor(), 2.0 * factor(), 0.02 * factor(), 2e-3 * factor()])
            };
            let Some((found, exact)) = compared(&grid, &scenario, &[c], [&mut stable, &mut unstable]) else { continue };
            near(found[0].peak_sensitivity, exact.output_sensitivity.value);
        }
    }
    assert!(stable > 30 && unstable > 20, "{stable} stable, {unstable} unstable");
}

/// Two motors with resonances that act on each other.
fn pair(coupling: f64) -> StateSpace<Discrete> {
    let apart = diagonal(&[machine(8.0), machine(3.0)]).unwrap();
    let mix = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { coupling * (1.0 - 2.0 * j as f64) });
    apart.map_output(&mix)
}

/// Stability of two random controllers on machines that act on each other, and gain, phase and delay margin of each loop with the other closed,
/// within 3 % of [`youla::control::margins()`].
#[test]
fn margins_of_each_loop_equal_the_exact_ones() {
    let plant = pair(0.4);
    let k = whole(&[running(), running()], time()).unwrap();
    let grid = grid_of(&plant, &k);
    let on = grid.each(&k).unwrap();
    let scenario = Scenario::new(&grid, plant.clone(), Judged { system: &k, on: &on }, |_| {}).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut stable, mut unstable) = (0, 0);
    for _ in 0..120 {
        let mut factor = || 10f64.powf(rng.random_range(-0.8..0.8));
        let c = [0, 1].map(|_| {
            pid(Discretisation::BackwardEuler, [0.8 * factor(), 2.0 * factor(), 0.02 * factor(), 2e-3 * factor()])
        });
        let Some((found, exact)) = compared(&grid, &scenario, &c, [&mut stable, &mut unstable]) else { continue };
        assert!(found.iter().all(|of| of.peak_sensitivity < 1.01 * exact.output_sensitivity.value));
    }
    assert!(stable > 20 && unstable > 20, "{stable} stable, {unstable} unstable");
}

/// The effort is the standard deviation of u by simulation.
#[test]
fn the_effort_is_the_size_of_u_for_white_noise() {
    let plant = machine(8.0);
    let k = running().system(time()).unwrap();
    let grid = grid_of(&plant, &k);
    let on = grid.each(&k).unwrap();
    let scenario = Scenario::new(&grid, plant.clone(), Judged { system: &k, on: &on }, |_| {}).unwrap();
    let to_u = closed_loop(&plant, &with_input_port(&k).unwrap()).unwrap().part(0..1, 1..2);
    let exact = youla::lti::h2_norm(&to_u).unwrap();
    assert!((scenario.running[0].effort / exact - 1.0).abs() < 0.01, "{} for {exact}", scenario.running[0].effort);
}

#[test]
fn a_pid_is_recognised_in_any_form() {
    for (rule, filter) in [(Discretisation::BackwardEuler, 2e-3), (Discretisation::Tustin, 3e-4)] {
        let stated = pid(rule, [0.8, 2.0, 0.02, filter]);
        let k = stated.system(time()).unwrap();
        let grid = grid_of(&machine(8.0), &k);
        let found = recognise(&grid, &k, &[Discretisation::BackwardEuler, Discretisation::Tustin], 0).unwrap().unwrap();
        let pairs = [(found.gains.kp, 0.8), (found.gains.ki, 2.0), (found.gains.kd, 0.02)];
        // By either rule it is the same controller.
        let difference = found.system(time()).unwrap().plus(&k.negated()).unwrap();
        let response = youla::lti::frequency_response(&difference, &[10.0, 300.0, 3000.0]).unwrap();
        assert!(response.iter().all(|g| g[(0, 0)].norm() < 1e-6), "{found:?}");
        if found.gains.discretisation == rule {
            assert!(pairs.into_iter().all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{found:?}");
        }
    }
    let second =
        StateSpace::difference_equation(&vec![vec![vec![1.0]]], &vec![vec![vec![1.0, -1.2, 0.5]]], time()).unwrap();
    let grid = grid_of(&machine(8.0), &running().system(time()).unwrap());
    assert_eq!(recognise(&grid, &second, &[Discretisation::BackwardEuler], 0).unwrap(), None);
}

/// Identifies the machine from a seeded record under the running controller.
fn identified(brake: f64) -> youla::identify::likelihood::Recommendation {
    identified_under(&machine(brake), &running().system(time()).unwrap(), vec![1], 4)
}

fn identified_under(
    plant: &StateSpace<Discrete>,
    k: &StateSpace<Discrete>,
    dead_time: Vec<usize>,
    order: usize,
) -> youla::identify::likelihood::Recommendation {
    let (m, whole) = (plant.inputs(), closed_loop(plant, &with_input_port(k).unwrap()).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let size = |j: usize| if j < m { 0.3 } else { 0.002 };
    let drive = Mat::from_fn(6000, 2 * m, |_, j| size(j) * (rng.random::<f64>() - 0.5));
    let signals = simulate(&whole, drive.as_ref(), &vec![0.0; whole.order()]).unwrap();
    let (u, y) = (signals.subcols(0, m), signals.subcols(m, m));
    let options = LikelihoodOptions { order: Some(order), dead_time: Some(dead_time), ..Default::default() };
    recommend(&[Experiment::new(u, y)], &[], None, time(), &options).unwrap()
}

/// A trusted model of the machine that a controller of the error ran, without dead time.
fn of_model<'a>(
    model: &'a youla::identify::likelihood::Recommendation,
    running: &'a StateSpace<Discrete>,
) -> PidProblem<'a> {
    PidProblem { points: vec![(&model.plant, &model.region)], running, delay: 0, reference: None, doubts: Vec::new() }
}

/// The seeded promise: designed on a model, the limits hold on the machine itself, and the proof on fresh draws holds. The same on one thread
/// as on two.
#[test]
fn what_is_promised_holds_on_the_machine() {
    let model = identified(8.0);
    let k = running().system(time()).unwrap();
    let problem = of_model(&model, &k);
    let options = PidOptions { notches: 1, command_effort: 4.0, ..PidOptions::default() };
    let band = BandOptions { draws: 60, seed: 1 };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let new = pool(2).install(|| design_pid(&problem, &options, &band)).unwrap();
    assert_eq!(new.controllers, pool(1).install(|| design_pid(&problem, &options, &band)).unwrap().controllers);
    assert!(new.rejection() > 2.0 && new.proof.unstable == 0 && new.proof.missed <= 3, "{:?}", new.proof.misses);
    let exact = youla::control::margins(&machine(8.0), &new.system).unwrap();
    assert!(exact.output_sensitivity.value < 2.0, "{:?}", exact.output_sensitivity);
    assert!(exact.outputs[0].phase.unwrap().degrees > 28.0, "{:?}", exact.outputs[0].phase);
    assert!(new.steps.iter().all(|s| s.unstable == 0) && new.steps.len() == 3);
    // Behind the filter of the reference a step of the machine itself overshoots by little more than 10 %.
    let (last, port) = (&new.steps[2], with_input_port(&new.system).unwrap());
    assert!(last.overshoots[0] > 0.1 && last.reference_filters[0] > 0.0, "{last:?}");
    let looped = closed_loop(&machine(8.0), &port).unwrap().part(1..2, 1..2);
    let lag = last.reference_filters[0] / 1e-3;
    let r = Mat::from_fn(3000, 1, |t, _| (lag / (1.0 + lag)).powi(t as i32 + 1) - 1.0);
    let y = simulate(&looped, r.as_ref(), &vec![0.0; looped.order()]).unwrap() - &r;
    assert!((y.col(0).iter().fold(0.0, |a: f64, b| a.max(*b)) - 1.1).abs() < 0.02);
    // The last response ends at its reference.
    assert!((new.steps[2].responses[0].last().unwrap()[1] - 1.0).abs() < 0.05);
}

/// Where the reference has weight 0.7 in the proportional part and the derivative acts on y alone, the step is predicted so: on the machine itself it
/// overshoots by little more than 10 % behind the filter. A path that is no PID is not predicted.
#[test]
fn a_reference_with_weights_steps_as_promised() {
    let model = identified(8.0);
    let own = running();
    let k = own.system(time()).unwrap();
    let weighed = |of: &PidGains| PidGains { kp: 0.7 * of.kp, kd: 0.0, ..*of }.system(time()).unwrap();
    let reference = Some(weighed(&own.gains));
    let problem = PidProblem { reference, ..of_model(&model, &k) };
    let options = PidOptions { command_effort: 4.0, ..PidOptions::default() };
    let band = BandOptions { draws: 60, seed: 1 };
    let new = design_pid(&problem, &options, &band).unwrap();
    let [weights] = new.reference_weights.unwrap()[..] else { panic!() };
    assert!((weights.proportional - 0.7).abs() < 1e-6 && weights.derivative.abs() < 1e-6, "{weights:?}");
    let last = &new.steps[2];
    assert!(last.overshoots[0] > 0.1 && last.reference_filters[0] > 0.0, "{last:?}");
    let lag = last.reference_filters[0] / 1e-3;
    let r = Mat::from_fn(3000, 1, |t, _| 1.0 - (lag / (1.0 + lag)).powi(t as i32 + 1));
    let path = weighed(&new.controllers[0].gains);
    let added = simulate(&path, r.as_ref(), &vec![0.0; path.order()]).unwrap();
    let looped = closed_loop(&machine(8.0), &with_input_port(&new.system).unwrap()).unwrap().part(1..2, 0..1);
    let y = simulate(&looped, added.as_ref(), &vec![0.0; looped.order()]).unwrap();
    let most = y.col(0).iter().fold(0.0, |a: f64, b| a.max(*b));
    assert!((most - 1.1).abs() < 0.02, "{most}");

    let other = weighed(&PidGains { ki: 2.0 * own.gains.ki, ..own.gains });
    let new = design_pid(&PidProblem { reference: Some(other), ..problem }, &options, &band).unwrap();
    assert!(
        new.reference_weights.is_none() && new.steps.iter().all(|s| s.responses.is_empty() && s.overshoots.is_empty())
    );
}

/// One controller for a machine whose brake and resonance change: the limits hold at both points, which the gains for the first alone do not
/// promise, and the proof is that of the worse point.
#[test]
fn one_controller_serves_several_operating_points() {
    let (first, second) = (identified(8.0), identified(1.0));
    let k = running().system(time()).unwrap();
    let both = vec![(&first.plant, &first.region), (&second.plant, &second.region)];
    let options = PidOptions { command_effort: 4.0, ..PidOptions::default() };
    let band = BandOptions { draws: 60, seed: 1 };
    let of = |points| {
        design_pid(&PidProblem { points, running: &k, delay: 0, reference: None, doubts: Vec::new() }, &options, &band)
            .unwrap()
    };
    let new = of(both);
    assert!(new.proof.unstable == 0 && new.proof.missed <= 3, "{:?}", new.proof.misses);
    for brake in [8.0, 1.0] {
        let exact = youla::control::margins(&machine(brake), &new.system).unwrap();
        assert!(exact.output_sensitivity.value < 2.0, "{brake}: {:?}", exact.output_sensitivity);
    }
    let alone = [&first, &second].map(|model| of(vec![(&model.plant, &model.region)]).rejection());
    let least = alone[0].min(alone[1]);
    assert!(new.rejection() < 1.05 * least && new.rejection() > 0.3 * least, "{} {alone:?}", new.rejection());
}

/// A PID for each of two loops that act on each other: the limits hold in both on the machine itself; the other running controller, which
/// leads an output to both inputs, is refused.
#[test]
fn each_loop_of_a_square_machine_gets_its_pid() {
    let plant = pair(0.3);
    let k = whole(&[running(), running()], time()).unwrap();
    let model = identified_under(&plant, &k, vec![1, 1], 8);
    let problem = of_model(&model, &k);
    let options = PidOptions { command_effort: 4.0, ..PidOptions::default() };
    let band = BandOptions { draws: 60, seed: 1 };
    let new = design_pid(&problem, &options, &band).unwrap();
    assert!(new.proof.unstable == 0 && new.proof.missed <= 3, "{:?}", new.proof.misses);
    assert!(new.rejections.len() == 2 && new.rejection() > 1.5, "{:?}", new.rejections);
    let exact = youla::control::margins(&plant, &new.system).unwrap();
    for channel in &exact.outputs {
        assert!(channel.phase.unwrap().degrees > 28.0, "{channel:?}");
        assert!(channel.highest_gain.is_none_or(|g| g.factor > 1.95), "{channel:?}");
    }
    let crossed = k.map_output(&Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 0.1 }));
    let refused = design_pid(&PidProblem { running: &crossed, ..problem }, &options, &band).err().unwrap().to_string();
    assert!(refused.contains("input of another loop") && refused.contains("lqg"), "{refused}");
}

/// An unstable machine needs a gain.
#[test]
fn a_refusal_names_the_limit() {
    let model = identified(-8.0);
    let k = running().system(time()).unwrap();
    let problem = of_model(&model, &k);
    let band = BandOptions { draws: 30, seed: 1 };
    let refusal = |options: PidOptions| design_pid(&problem, &options, &band).err().unwrap().to_string();
    let late = refusal(PidOptions { delay_margin: 1.0, ..PidOptions::default() });
    assert!(late.contains("delay_margin") && late.contains("[redesign.pid]"), "{late}");
    let quiet = refusal(PidOptions { command_effort: 0.02, ..PidOptions::default() });
    assert!(quiet.contains("command_effort"), "{quiet}");
    let notches = refusal(PidOptions { notches: 5, ..PidOptions::default() });
    assert!(notches.contains("[redesign.pid] notches"), "{notches}");
}
