//! Each test of the verdict with one planted fault that fires it, beside the same loop without the fault.

use crate::control::{RunningController, closed_loop, with_input_port};
use crate::identify::likelihood::{Evidence, LikelihoodOptions, TestOutcome};
use crate::identify::{Identified, identify};
use crate::linalg::block;
use crate::lti::{Continuous, Discrete, StateSpace, frequency_response, simulate};
use crate::signal::LoopRecord;
use crate::{Mat, MatRef};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

fn time() -> Discrete {
    Discrete::new(1e-3).unwrap()
}

/// A mode of 60 Hz with 3 % damping beside a lag of 5 Hz.
fn plant(gain: f64) -> StateSpace<Discrete> {
    let (w, slow) = (377.0, 31.4);
    let entries = [[0.0, w, 0.0], [-w, -0.06 * w, 0.0], [0.0, 0.0, -slow]];
    let a = Mat::from_fn(3, 3, |i, j| entries[i][j]);
    let b = Mat::from_fn(3, 1, |i, _| [0.0, 0.3 * w, slow][i] * gain);
    let c = Mat::from_fn(1, 3, |_, j| [1.0, 0.0, 1.0][j]);
    StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous).unwrap().zoh(time()).unwrap()
}

/// `u = -0.8 y`, positive feedback.
fn controller(gain: f64) -> StateSpace<Discrete> {
    StateSpace::gain(Mat::from_fn(1, 1, |_, _| -0.8 * gain), time()).unwrap()
}

/// A loop with an excitation, noise of given size and mains; the plant takes another gain in the second half.
struct Planted {
    noise: f64,
    /// Amplitude and frequency, Hz.
    mains: [f64; 2],
    second_gain: f64,
    samples: usize,
    excitation: fn(usize, f64) -> f64,
}

const CLEAN: Planted =
    Planted { noise: 0.05, mains: [0.0, 50.0], second_gain: 1.0, samples: 6000, excitation: |_, random| random };

impl Planted {
    fn record(&self, seed: u64) -> LoopRecord {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let half = |gain: f64, first: usize, rng: &mut ChaCha8Rng| {
            let rig = closed_loop(&plant(gain), &with_input_port(&controller(1.0)).unwrap()).unwrap();
            let rows = self.samples / 2;
            let d = Mat::from_fn(rows, 1, |k, _| (self.excitation)(first + k, rng.sample(StandardNormal)));
            let [size, hz] = self.mains;
            let mains = |k: usize| size * (std::f64::consts::TAU * hz * 1e-3 * (first + k) as f64).sin();
            let n = Mat::from_fn(rows, 1, |k, _| mains(k) + self.noise * rng.sample::<f64, _>(StandardNormal));
            let log = simulate(&rig, block(&[&[d.as_ref(), n.as_ref()]]).as_ref(), &vec![0.0; rig.order()]).unwrap();
            (log.subcols(0, 1).to_owned(), log.subcols(1, 1).to_owned(), d)
        };
        let (u, y, d) = half(1.0, 0, rng);
        let (u2, y2, d2) = half(self.second_gain, self.samples / 2, rng);
        let joined = |a: MatRef<'_, f64>, b: MatRef<'_, f64>| block(&[&[a], &[b]]);
        let record = LoopRecord::new(time(), joined(u.as_ref(), u2.as_ref()), joined(y.as_ref(), y2.as_ref())).unwrap();
        record.with_input_excitation(joined(d.as_ref(), d2.as_ref())).unwrap()
    }

    fn identified(&self, stated: f64, options: &LikelihoodOptions) -> Identified {
        let running = RunningController::new(controller(stated));
        identify(&[self.record(1)], &[], &running, None, options).unwrap()
    }
}

fn outcome<'a>(found: &'a Identified, name: &str) -> &'a Evidence {
    found.model.evidence.iter().find(|e| e.question.contains(name)).unwrap()
}

#[test]
fn a_clean_loop_passes_every_test() {
    let found = CLEAN.identified(1.0, &LikelihoodOptions::default());
    assert!(found.trusted(), "{:?}", found.reasons());
    assert!(found.model.evidence.iter().all(|e| e.outcome == TestOutcome::Passed), "{:?}", found.model.evidence);
    let r = found.model.loop_ratio.as_ref().unwrap();
    assert!(r.largest < 0.1 && r.ratio.iter().all(|ratio| *ratio <= r.largest), "{}", r.largest);
    assert!(
        found.model.sentence().starts_with("Trusted for this loop: the uncertainty of the model leaves 9"),
        "{}",
        found.model.sentence()
    );
    // The squares of the parts sum to that of the whole.
    let region = &found.model.region;
    for k in 0..region.hz.len() {
        let sum: f64 = region.parts.named().iter().map(|(_, part)| part[k][(0, 0)].powi(2)).sum();
        assert!((sum.sqrt() / region.absolute[k][(0, 0)] - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_controller_of_another_gain_is_noticed_and_does_not_spoil_the_model() {
    let found = CLEAN.identified(1.4, &LikelihoodOptions::default());
    assert_eq!(outcome(&found, "(controller)").outcome, TestOutcome::Failed);
    let right = CLEAN.identified(1.0, &LikelihoodOptions::default());
    let apart = (found.model.plant.d()[(0, 0)] - right.model.plant.d()[(0, 0)]).abs();
    assert!(apart < 1e-6, "the direct path differs by {apart}");
    assert_eq!([&found, &right].map(|of| of.model.description()), [Some(false), Some(true)]);
    let sentence = found.model.sentence();
    assert!(sentence.contains("the stated controller disagrees with the log, the model passes its"), "{sentence}");
}

/// `u = -0.8 y` with an integrator beside it that its output does not show is the law of the log.
#[test]
fn a_state_that_the_controller_does_not_show_is_no_memory_of_it() {
    let of = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    let law = StateSpace::new(of(1.0), of(1.0), of(0.0), of(-0.8), time()).unwrap();
    let running = RunningController::new(law);
    let found = identify(&[CLEAN.record(1)], &[], &running, None, &LikelihoodOptions::default()).unwrap();
    assert!(outcome(&found, "(controller)").figure < 1e-6, "{}", outcome(&found, "(controller)"));
    assert!(found.trusted(), "{:?}", found.reasons());
}

#[test]
fn a_missing_mode_is_named_with_its_frequency() {
    let few = LikelihoodOptions { order: Some(1), ..Default::default() };
    let found = CLEAN.identified(1.0, &few);
    let test = outcome(&found, "(indirect response)");
    assert_eq!(test.outcome, TestOutcome::Failed);
    let [low, high] = test.hz.unwrap();
    assert!(low < 60.0 && 60.0 < high && high < 120.0, "{low} to {high} Hz, the mode is at 60 Hz");
    assert!(test.note.contains("the model is likely wrong there"), "{}", test.note);
    assert!(!found.trusted());
    // The entry has another form than the model: every band and every stated deviation is one that the excitation confirms.
    let (region, truth) = (&found.model.region, plant(1.0));
    let at = |of: &StateSpace<Discrete>, hz: f64| {
        frequency_response(of, &[std::f64::consts::TAU * hz]).unwrap().at(0)[(0, 0)]
    };
    let error = |hz: f64| (at(&found.model.plant, hz) - at(&truth, hz)).norm();
    let held = |k: &usize| error(region.hz[*k]) < 2.0 * region.absolute[*k][(0, 0)];
    assert!((0..region.hz.len()).filter(held).count() as f64 > 0.9 * region.hz.len() as f64);
    let inside = |hz: f64| found.model.bands.iter().any(|[low, high]| (*low..=*high).contains(&hz));
    let wrong: Vec<f64> =
        region.hz.iter().copied().filter(|hz| inside(*hz) && error(*hz) > 0.2 * at(&truth, *hz).norm()).collect();
    assert!(wrong.is_empty(), "{wrong:?} in {:?}", found.model.bands);
}

#[test]
fn a_machine_that_changes_is_not_repeatable() {
    let changed = Planted { second_gain: 1.8, ..CLEAN };
    let found = changed.identified(1.0, &LikelihoodOptions::default());
    assert_eq!(outcome(&found, "(repeatability)").outcome, TestOutcome::Failed, "{:?}", found.model.evidence);
    // The difference between the halves is in the region: at low frequency at least a quarter of the response.
    let region = &found.model.region;
    let k = region.hz.partition_point(|hz| *hz < 3.0);
    assert!(region.parts.variation[k][(0, 0)] > 0.25, "{}", region.parts.variation[k][(0, 0)]);
}

#[test]
fn a_fresh_record_of_another_gain_widens_the_region_by_the_difference() {
    let with_fresh = |second_gain: f64| {
        let fresh = Planted { second_gain, ..CLEAN }.record(2);
        let running = RunningController::new(controller(1.0));
        let found = identify(&[CLEAN.record(1)], &[fresh], &running, None, &LikelihoodOptions::default()).unwrap();
        let region = found.model.region;
        let k = region.hz.partition_point(|hz| *hz < 10.0);
        let g = frequency_response(&found.model.plant, &[std::f64::consts::TAU * region.hz[k]]).unwrap();
        region.parts.variation[k][(0, 0)] / g.at(0)[(0, 0)].norm()
    };
    // The gain of half of the fresh record is 20 % higher: of the whole record by 10 %.
    let (changed, same) = (with_fresh(1.2), with_fresh(1.0));
    assert!((0.07..0.14).contains(&changed) && same < 0.02, "{changed} and {same}");
}

#[test]
fn noise_that_the_feedback_brings_to_the_inputs_is_no_excitation() {
    let narrow = Planted { noise: 0.5, excitation: |k, _| 0.02 * (0.3 * k as f64).sin(), ..CLEAN };
    let found = narrow.identified(1.0, &LikelihoodOptions::default());
    assert!(!found.trusted());
    let test = outcome(&found, "(information)");
    assert_ne!(test.outcome, TestOutcome::Passed, "{test}");
}

#[test]
fn a_region_wider_than_half_of_the_margin_is_no_evidence() {
    let noisy = Planted { noise: 30.0, samples: 1200, ..CLEAN };
    let found = noisy.identified(1.0, &LikelihoodOptions { order: Some(3), ..Default::default() });
    let test = outcome(&found, "(region)");
    assert!(test.outcome == TestOutcome::Failed && test.figure > 0.5, "{test}");
}

/// With 0.06 of a period more than 300 in the record, and with whole periods, which have no ends.
#[test]
fn mains_are_taken_out_and_are_no_mode_of_the_plant() {
    for hz in [50.01, 50.0] {
        let found = Planted { mains: [2.0, hz], ..CLEAN }.identified(1.0, &LikelihoodOptions::default());
        assert!(found.trusted(), "{hz}: {:?}", found.reasons());
        let note = &outcome(&found, "(lines)").note;
        let mut taken = note.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
        assert!(taken.any(|taken| (taken - hz).abs() < 0.01), "{hz}: {note}");
        let modes: Vec<f64> = found.model.modes.iter().map(|m| m.mode.hz).collect();
        assert!(found.model.order == 3 && modes.iter().all(|hz| !(49.0..51.0).contains(hz)), "{modes:?}");
    }
    let clean = CLEAN.identified(1.0, &LikelihoodOptions::default());
    assert!(clean.model.evidence.iter().all(|e| !e.question.contains("(lines)")));
}

#[test]
fn a_model_of_neither_half_is_no_model() {
    let found = Planted { second_gain: 3.0, ..CLEAN }.identified(1.0, &LikelihoodOptions::default());
    let test = outcome(&found, "(same model)");
    assert!(test.outcome == TestOutcome::Failed && test.figure > 0.5, "{test}");
}

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

/// Friction against the sign of an output that is a velocity is named as such, with 1 to 5 % of the input.
#[test]
fn dry_friction_of_a_speed_is_named_and_widens_the_region() {
    let found = with(&Fault { drag: 0.08, noise: 0.02, ..NONE });
    let test = outcome(&found, "(nonlinearity)");
    assert!(test.note.contains("the output being a speed"), "{test}");
    assert!((0.01..0.05).contains(&test.figure) && found.trusted(), "{test} {:?}", found.reasons());
    assert!(distortion(&found) > 0.005, "{}", distortion(&found));
}

/// Without time for a second round the best start is kept, and a line says so; with time enough nothing is said and nothing changes.
#[test]
fn a_time_limit_keeps_what_is_found() {
    let [none, all, free] = [Some(0), Some(600), None]
        .map(|time_limit| CLEAN.identified(1.0, &LikelihoodOptions { time_limit, ..Default::default() }));
    assert_eq!(outcome(&none, "(time limit").outcome, TestOutcome::Failed);
    assert!(none.model.candidates.len() < free.model.candidates.len(), "{}", none.model.candidates.len());
    assert!(all.model.evidence == free.model.evidence);
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

/// `u = 0.8 (what the limit left) - 0.05 y`: the law of the file holds but for the samples after those at the limit.
#[test]
fn a_law_that_goes_on_from_the_limited_input_is_the_stated_one() {
    let law = |gain: f64| {
        let of = |value: f64| Mat::from_fn(1, 1, |_, _| value);
        StateSpace::new(of(0.8), of(-0.04 * gain), of(1.0), of(-0.05 * gain), time()).unwrap()
    };
    let (g, rng) = (plant(1.0), &mut ChaCha8Rng::seed_from_u64(3));
    let mut normal = |size: f64| Mat::from_fn(CLEAN.samples, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (d, n) = (normal(1.0), normal(0.05));
    let (mut u, mut y) = (d.clone(), n.clone());
    let (mut x, mut kept) = (Mat::<f64>::zeros(3, 1), 0.0);
    for k in 0..CLEAN.samples {
        y[(k, 0)] += (g.c() * &x)[(0, 0)];
        u[(k, 0)] += 0.8 * kept - 0.05 * y[(k, 0)];
        let acts = u[(k, 0)].clamp(-2.6, 2.6);
        kept = acts - d[(k, 0)];
        x = g.a() * &x + g.b() * acts;
    }
    let record = LoopRecord::new(time(), u, y).unwrap().with_input_excitation(d).unwrap();
    let [right, wrong] = [1.0, 3.0].map(|gain| {
        let running = RunningController::new(law(gain));
        identify(std::slice::from_ref(&record), &[], &running, None, &LikelihoodOptions::default()).unwrap()
    });
    let test = outcome(&right, "(controller)");
    assert!(test.outcome == TestOutcome::Passed && test.note.contains("logged before a limit"), "{test}");
    assert!(right.trusted(), "{:?}", right.reasons());
    assert!(!outcome(&wrong, "(controller)").note.contains("before a limit"), "{}", outcome(&wrong, "(controller)"));
}

/// Fifteen samples of the sensor are off by 3, noise is 0.02, and the controller acts on them. Where these errors are known the model is nearer
/// to the plant, about as far as their share of the noise says, sevenfold; the law of the controller is that of the log in both cases.
#[test]
fn known_errors_of_the_outputs_are_neither_noise_nor_another_law() {
    let (g, rng) = (plant(1.0), &mut ChaCha8Rng::seed_from_u64(5));
    let samples = CLEAN.samples;
    let mut normal = |size: f64| Mat::from_fn(samples, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (d, n) = (normal(1.0), normal(0.02));
    let errors = Mat::from_fn(samples, 1, |k, _| if k % 397 == 200 { 3.0 } else { 0.0 });
    let (mut u, mut y, mut x) = (d.clone(), &n + &errors, Mat::<f64>::zeros(3, 1));
    for k in 0..samples {
        y[(k, 0)] += (g.c() * &x)[(0, 0)];
        u[(k, 0)] -= 0.8 * y[(k, 0)];
        x = g.a() * &x + g.b() * u[(k, 0)];
    }
    let record = LoopRecord::new(time(), u, y).unwrap().with_input_excitation(d).unwrap();
    let known = record.clone().with_output_errors(errors).unwrap();
    let omega: Vec<f64> = [2.0, 10.0, 30.0, 55.0, 65.0, 100.0].map(|hz| std::f64::consts::TAU * hz).to_vec();
    let of_plant = frequency_response(&g, &omega).unwrap();
    let [as_noise, without] = [record, known].map(|record| {
        let running = RunningController::new(controller(1.0));
        let found = identify(&[record], &[], &running, None, &LikelihoodOptions::default()).unwrap();
        assert!(outcome(&found, "(controller)").figure < 1e-6, "{}", outcome(&found, "(controller)"));
        let own = frequency_response(&found.model.plant, &omega).unwrap();
        (0..omega.len())
            .map(|k| ((own.at(k) - of_plant.at(k))[(0, 0)] / of_plant.at(k)[(0, 0)]).norm_sqr())
            .sum::<f64>()
    });
    assert!(without < 0.1 * as_noise, "{without:.2e} {as_noise:.2e}");
}
