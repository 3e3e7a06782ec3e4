//! What is neither linear nor constant: dry friction, play, drift of the gain, limits.

use super::*;

/// What is neither linear nor constant in the clean loop.
struct Fault {
    /// Dry friction at the input of the plant, over the standard deviation of the excitation.
    friction: f64,
    /// The same of an output that is a velocity.
    drag: f64,
    /// Play at the output, whose size is about 0.5.
    play: f64,
    /// Change of the gain from the first sample to the last.
    drift: f64,
    /// Limit and dead zone of what acts, whose size is about 1; the log holds the command.
    limit: f64,
    dead: f64,
    noise: f64,
}

const NONE: Fault =
    Fault { friction: 0.0, drag: 0.0, play: 0.0, drift: 0.0, limit: f64::INFINITY, dead: 0.0, noise: 0.05 };

fn with_friction(friction: f64) -> Identified {
    with(&Fault { friction, ..NONE })
}

fn with(fault: &Fault) -> Identified {
    of(&[recorded(fault)])
}

fn of(records: &[LoopRecord]) -> Identified {
    identify(records, &[], &RunningController::new(controller(1.0)), None, &LikelihoodOptions::default()).unwrap()
}

fn recorded(fault: &Fault) -> LoopRecord {
    let (g, rng) = (plant(1.0), &mut ChaCha8Rng::seed_from_u64(2));
    let rows = CLEAN.samples;
    let mut normal = |size: f64| Mat::from_fn(rows, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (d, n) = (normal(1.0), normal(fault.noise));
    let (mut u, mut y) = (Mat::<f64>::zeros(rows, 1), Mat::<f64>::zeros(rows, 1));
    let (mut x, mut before, mut gap) = (Mat::<f64>::zeros(3, 1), 0.0, 0.0_f64);
    for k in 0..rows {
        let moved = (g.c() * &x)[(0, 0)];
        gap = gap.clamp(moved - 0.5 * fault.play, moved + 0.5 * fault.play);
        y[(k, 0)] = gap + n[(k, 0)];
        u[(k, 0)] = -0.8 * y[(k, 0)] + d[(k, 0)];
        let gain = 1.0 + fault.drift * (k as f64 / rows as f64 - 0.5);
        let command = u[(k, 0)].clamp(-fault.limit, fault.limit);
        let acts = gain * (command - command.clamp(-fault.dead, fault.dead))
            - fault.friction * ((moved - before) / 0.005).tanh()
            - fault.drag * (moved / 0.05).tanh();
        x = g.a() * &x + g.b() * acts;
        before = moved;
    }
    LoopRecord::new(time(), u, y).unwrap().with_input_excitation(d).unwrap()
}

/// The part of the region at 10 Hz that is distortion.
fn distortion(found: &Identified) -> f64 {
    let region = &found.model.region;
    let k = region.hz.partition_point(|hz| *hz < 10.0);
    region.parts.distortion[k][(0, 0)]
}

#[test]
fn dry_friction_widens_the_region_and_half_of_the_torque_is_refused() {
    let [none, little, much] = [0.0, 0.08, 0.5].map(with_friction);
    assert!(none.trusted() && little.trusted(), "{:?} {:?}", none.reasons(), little.reasons());
    let [of_none, of_little] = [&none, &little].map(distortion);
    assert!(of_none == 0.0 && of_little > 0.005, "{of_none} {of_little}");
    assert_eq!(outcome(&much, "(nonlinearity)").outcome, TestOutcome::Failed);
}

/// The model holds what friction does linearly at this amplitude; the stated deviation is that from the plant without it, and the metric of the loop,
/// which ran with it, does not count that.
#[test]
fn the_stated_deviation_holds_the_plant_without_friction() {
    let found = with(&Fault { friction: 0.08, noise: 0.005, ..NONE });
    let all = errors(&found, &plant(1.0), 2.0..50.0);
    let errors = all.iter().map(|[hz, error, deviation]| {
        let [re, _, im] = found.model.region.at(*hz).entries().covariance((0, 0));
        [error / deviation, error / (re + im).sqrt()]
    });
    let squares = errors.fold([0.0; 2], |sum, e| [sum[0] + e[0] * e[0], sum[1] + e[1] * e[1]]);
    let [stated, in_loop] = squares.map(|sum| (sum / all.len() as f64).sqrt());
    assert!((0.4..1.4).contains(&stated) && in_loop > 1.5 * stated, "{stated} {in_loop}");
}

/// Friction against the sign of an output that is a velocity is named as such, with 1 to 5 % of the input.
#[test]
fn dry_friction_of_a_speed_is_named_and_widens_the_region() {
    let found = with(&Fault { drag: 0.08, noise: 0.02, ..NONE });
    let test = outcome(&found, "(nonlinearity)");
    assert!(test.note.contains("the output being a speed"), "{test}");
    assert!((0.01..0.05).contains(&test.figure) && found.trusted(), "{test} {:?}", found.reasons());
    assert!(distortion(&found) > 0.005, "{}", distortion(&found));
}

/// Play of 0.02 at an output of size 0.5 is named with its size and is not dry friction; the clean loop has none.
#[test]
fn play_at_the_output_is_named() {
    let [clean, loose] = [0.0, 0.02].map(|play| with(&Fault { play, noise: 0.005, ..NONE }));
    let play = |found: &Identified| outcome(found, "(backlash)").clone();
    assert!(play(&clean).note.is_empty() && play(&clean).figure < 0.002, "{}", play(&clean));
    assert!(play(&loose).note.contains("beyond chance") && play(&loose).figure > 0.02, "{}", play(&loose));
    assert!(!play(&loose).required && loose.trusted(), "{:?}", loose.reasons());
    let friction = outcome(&loose, "(nonlinearity)");
    assert!(friction.figure < 0.01, "{friction}");
    assert!(distortion(&clean) == 0.0 && distortion(&loose) > 0.001, "{} {}", distortion(&clean), distortion(&loose));
}

/// A gain that rises by 6 % is named within a tenth of its size; that of the clean loop is chance.
#[test]
fn a_gain_that_drifts_is_named_with_its_size() {
    let [clean, drifts] =
        [0.0, 0.06].map(|drift| outcome(&with(&Fault { drift, ..NONE }), "(drift of the gain)").clone());
    assert!(clean.significance.unwrap() < 3.0 && clean.outcome == TestOutcome::Passed, "{clean}");
    assert!(drifts.outcome == TestOutcome::Failed && !drifts.required, "{drifts}");
    assert!((drifts.figure / 0.06 - 1.0).abs() < 0.1, "{drifts}");
}

/// One sample in a hundred is cut: the model holds and the limit is named. One in four: what acts is not the log.
#[test]
fn a_command_logged_before_its_limit_is_judged_by_what_the_limit_takes() {
    let [rare, often, dead] = [(2.9, 0.0), (1.1, 0.0), (f64::INFINITY, 0.07)]
        .map(|(limit, dead)| with(&Fault { limit, dead, noise: 0.005, ..NONE }));
    for (found, name) in [(&rare, "saturation at 2"), (&often, "saturation at 1 "), (&dead, "a dead zone of 0.0")] {
        let test = outcome(found, "(nonlinearity)");
        assert!(test.note.contains(name), "{test}");
        assert_eq!(outcome(found, "(saturation)").outcome, TestOutcome::Passed, "{}", outcome(found, "(saturation)"));
    }
    assert!(rare.trusted() && dead.trusted(), "{:?} {:?}", rare.reasons(), dead.reasons());
    assert_eq!(outcome(&often, "(nonlinearity)").outcome, TestOutcome::Failed);
    // Beside three records without a limit it is judged alone.
    let one_of_four = of(&[9.0, 1.1, 9.0, 9.0].map(|limit| recorded(&Fault { limit, noise: 0.005, ..NONE })));
    let test = outcome(&one_of_four, "(nonlinearity)");
    assert!(test.outcome == TestOutcome::Failed && test.note.contains("in record 2 of 4"), "{test}");
}

/// A press: steps of the reference every few seconds beside a binary excitation, a load that changes slowly on a plant that integrates. The lowest
/// lines hold most of the reference and of the load; whose power there is not that of the lines above them.
#[test]
fn a_slow_load_below_few_steps_of_the_reference_is_no_variation() {
    let held = |den: [f64; 2], gain: f64| {
        StateSpace::difference_equation(&vec![vec![vec![0.0, gain]]], &vec![vec![den.to_vec()]], time()).unwrap()
    };
    let press = held([1.0, -0.9993], 8.4e-3).then(&held([1.0, -0.8], 0.2)).unwrap();
    let pi = StateSpace::difference_equation(&vec![vec![vec![-4.0, 3.988]]], &vec![vec![vec![1.0, -1.0]]], time());
    let pi = pi.unwrap();
    let rig = closed_loop(&press, &with_input_port(&pi).unwrap()).unwrap();
    let trusted = |seed: u64| {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let (mut load, mut level, mut reference) = (0.0, 0.0, 0.0);
        let mut record = |rows: usize| {
            let of = |k: usize| {
                if k.is_multiple_of(800) {
                    level = 15.0 * rng.random_range(-1.0..1.0);
                }
                reference += 0.02 * (level - reference);
                load = 0.995 * load + 0.08 * rng.sample::<f64, _>(StandardNormal);
                let excitation = if (k / 6) % 2 == usize::from(rng.random_bool(0.5)) { 3.0 } else { -3.0 };
                [excitation, load, reference, 0.01 * rng.sample::<f64, _>(StandardNormal)]
            };
            let rows: Vec<[f64; 4]> = (0..rows).map(of).collect();
            let column = |of: &dyn Fn(&[f64; 4]) -> f64| Mat::from_fn(rows.len(), 1, |k, _| of(&rows[k]));
            let (at_input, at_output) = (column(&|r| r[0] + r[1]), column(&|r| r[3] - r[2]));
            let log =
                simulate(&rig, block(&[&[at_input.as_ref(), at_output.as_ref()]]).as_ref(), &vec![0.0; rig.order()]);
            let log = log.unwrap();
            // Behind y - r is the loop: the load is in the applied input and not in the command.
            let u = log.subcols(0, 1) - column(&|r| r[1]);
            let y = log.subcols(1, 1) + column(&|r| r[2]);
            let record = LoopRecord::new(time(), u, y).unwrap();
            record.with_input_excitation(column(&|r| r[0])).unwrap().with_reference(column(&|r| r[2])).unwrap()
        };
        let (estimation, fresh) = (record(16_000), record(8_000));
        let found =
            identify(&[estimation], &[fresh], &RunningController::new(pi.clone()), None, &LikelihoodOptions::default());
        let found = found.unwrap();
        (found.trusted(), outcome(&found, "(region)").figure)
    };
    for seed in 1..=3 {
        let (trusted, figure) = trusted(seed);
        assert!(trusted && figure < 0.1, "seed {seed}: {figure}");
    }
}
