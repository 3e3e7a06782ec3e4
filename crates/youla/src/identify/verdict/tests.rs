//! Each test of the verdict with one planted fault that fires it, beside the same loop without the fault.

use crate::control::{RunningController, closed_loop, with_input_port};
use crate::identify::likelihood::{Evidence, Experiment, LikelihoodOptions, TestOutcome, recommend};
use crate::identify::{Identified, identify};
use crate::linalg::block;
use crate::lti::{Continuous, Discrete, StateSpace, frequency_response, simulate};
use crate::signal::LoopRecord;
use crate::{Mat, MatRef};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

mod axis;
mod faults;

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

/// Frequencies in a range, Hz, each with the error of the response of the first entry and its stated deviation.
fn errors(found: &Identified, truth: &StateSpace<Discrete>, range: std::ops::Range<f64>) -> Vec<[f64; 3]> {
    let region = &found.model.region;
    let hz: Vec<usize> = (0..region.hz.len()).filter(|k| range.contains(&region.hz[*k])).collect();
    let omega: Vec<f64> = hz.iter().map(|k| std::f64::consts::TAU * region.hz[*k]).collect();
    let [g, model] = [truth, &found.model.plant].map(|g| frequency_response(g, &omega).unwrap());
    let error = |i: usize| (g.at(i)[(0, 0)] - model.at(i)[(0, 0)]).norm();
    hz.iter().enumerate().map(|(i, k)| [region.hz[*k], error(i), region.absolute[*k][(0, 0)]]).collect()
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

/// Without time for a second round the best start is kept, and a line says so; with time enough nothing is said and nothing changes.
#[test]
fn a_time_limit_keeps_what_is_found() {
    let [none, all, free] = [Some(0), Some(600), None]
        .map(|time_limit| CLEAN.identified(1.0, &LikelihoodOptions { time_limit, ..Default::default() }));
    assert_eq!(outcome(&none, "(time limit").outcome, TestOutcome::Failed);
    assert!(none.model.candidates.len() < free.model.candidates.len(), "{}", none.model.candidates.len());
    assert!(all.model.evidence == free.model.evidence);
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

/// A gain that puts the pole of the loop outside of the circle by less than its deviation, and so that it hardly grows in the records, is not shown
/// to be unstable; one with which it grows by e^40 is.
#[test]
fn a_pole_of_the_loop_at_the_circle_is_not_shown_to_be_outside() {
    let (rng, time) = (&mut ChaCha8Rng::seed_from_u64(3), Discrete::new(1.0).unwrap());
    let mut normal = |size: f64| Mat::from_fn(4000, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
    let (u, e) = (normal(1.0), normal(0.5));
    let one = |x: f64| Mat::from_fn(1, 1, |_, _| x);
    let plant = StateSpace::new(one(0.9), one(1.0), one(1.0), one(0.0), time).unwrap();
    let y = simulate(&plant, u.as_ref(), &[0.0]).unwrap() + e;
    let records = [Experiment::new(u.as_ref(), y.as_ref())];
    let found = recommend(&records, &[], None, time, &LikelihoodOptions::default()).unwrap();
    let gain = (found.plant.b() * found.plant.c())[(0, 0)];
    let asked = |pole: f64| {
        let k = StateSpace::gain(one((pole - found.plant.a()[(0, 0)]) / gain), time).unwrap();
        super::stability((&found.plant, &found.region), &k, 4000).unwrap().unwrap().outcome
    };
    assert_eq!((found.order, found.dead_time[0]), (1, 0));
    let outcomes = [0.999, 1.0 + 1e-7, 1.0 + 1e-4, 1.01].map(asked);
    let expected = [TestOutcome::Passed, TestOutcome::Passed, TestOutcome::Passed, TestOutcome::Failed];
    assert_eq!(outcomes, expected);
}
