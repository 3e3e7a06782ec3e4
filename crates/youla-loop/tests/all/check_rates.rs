//! The check of the data on a few of the logs of `examples/check_rates`: clean ones stay clean, planted defects are named.

#[allow(dead_code)]
#[path = "../../examples/check_rates/defects.rs"]
mod defects;
#[allow(dead_code)]
#[path = "../../examples/check_rates/logs.rs"]
mod logs;
#[allow(dead_code)]
#[path = "../../examples/check_rates/machines.rs"]
mod machines;
#[allow(dead_code)]
#[path = "../../examples/check_rates/recipes.rs"]
mod recipes;

use logs::{PLAIN, Recipe, SHAPES, log};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use youla_loop::check::{Severity, Test};

fn recipe(kind: usize, shape: usize, seed: u64) -> Recipe {
    Recipe { kind, shape, seed, ..PLAIN }
}

/// Every shape on every plant, with and without the controller declared, noise-free too: a log of a loop whose controller is not
/// declared is told as such, and nothing else is.
#[test]
fn every_shape_of_excitation_is_clean() {
    for kind in 0..machines::KINDS {
        for shape in 0..SHAPES.len() {
            let declared = (kind + shape) % 2 == 0;
            let noise = if shape % 3 == 0 { 0.0 } else { 0.03 };
            let made = log(&Recipe { declared, noise, ..recipe(kind, shape, 40 + shape as u64) }).unwrap();
            let found = made.check().unwrap();
            let wrong =
                |f: &&youla_loop::check::Finding| f.severity > Severity::Note && (declared || f.test != Test::Feedback);
            let wrong: Vec<String> = found.iter().filter(wrong).map(|f| f.sentence()).collect();
            assert!(wrong.is_empty(), "{}, {}: {wrong:?}", machines::name(kind), SHAPES[shape]);
            let dead_time = found.iter().find(|f| f.what.contains("dead time")).map(|f| f.numbers["lag"]);
            assert!(dead_time.is_none_or(|lag| lag == made.dead_time as f64 + 1.0), "{dead_time:?}");
        }
    }
}

/// Noise-free logs of tanks and loops with dead time that start from rest, and chirps that are not logged, which begin in one channel where
/// they end in the other, and an input that is held: neither wrong samples nor lost rows.
#[test]
fn a_start_from_rest_is_no_wrong_sample() {
    for seed in [60_267, 60_316, 60_476, 60_859, 90_989] {
        let made = log(&recipes::other(seed)).unwrap();
        let found = made.check().unwrap();
        let wrong: Vec<_> = found.iter().filter(|f| f.severity == Severity::Defect).map(|f| f.sentence()).collect();
        assert!(wrong.is_empty(), "{seed}: {wrong:?}");
    }
}

/// A dead time is stated in the right samples or not at all, and for most plants under white noise it is stated.
#[test]
fn a_dead_time_is_stated_in_the_right_samples() {
    let mut stated = 0;
    for seed in 0..10 {
        let made = log(&recipe(4, 0, seed)).unwrap();
        let found = made.check().unwrap();
        let lag = found.iter().find(|f| f.what.contains("dead time")).map(|f| f.numbers["lag"]);
        assert!(lag.is_none_or(|lag| lag == made.dead_time as f64 + 1.0), "seed {seed}: {found:?}");
        stated += usize::from(lag.is_some());
    }
    assert!(stated >= 5, "{stated} of 10");
}

/// Each defect of the table in docs/check.md, on the plant and with the excitation of two seeds.
#[test]
fn planted_defects_are_named() {
    for defect in &defects::ALL {
        for seed in 0..2 {
            let made = Recipe {
                limit: (defect.name == defects::IN_THE_LOOP[0]).then_some(0.5),
                excited: defect.name != defects::IN_THE_LOOP[1],
                ..recipe(if defects::TWO_BY_TWO.contains(&defect.name) { 3 } else { seed }, 2 * seed, 7 + seed as u64)
            };
            let mut made = log(&made).unwrap();
            (defect.plant)(&mut made, &mut ChaCha8Rng::seed_from_u64(seed as u64));
            let found = made.check().unwrap();
            assert!(defect.is_named_by(&found), "{} {seed}: {found:?}", defect.name);
        }
    }
}
