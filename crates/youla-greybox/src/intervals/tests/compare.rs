//! The likelihood ratio has the distribution that its probability says.

use super::super::{compare, likelihood_ratio};
use super::*;
use crate::{GreyBoxModel, GreyBoxOptions, Problem, greybox};
use rayon::prelude::*;
use youla::identify::subspace::InitialState;

const NOISE: f64 = 2e-5;

/// The damping known, `factor` times the true one.
fn with_known_damping(factor: f64) -> DeclaredStructure {
    let mut declared = Template::MassSpringDamper.declaration().unwrap();
    let damping = declared.parameters.get_mut("damping").unwrap();
    damping.fixed = Some(true);
    damping.initial = damping.initial.map(|v| factor * v);
    DeclaredStructure::new(&declared).unwrap()
}

fn estimate(structure: &DeclaredStructure, log: &Log) -> GreyBoxModel {
    let options = GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() };
    greybox(&Problem::new(structure, &[log.experiment()], time()), &structure.start(), &options).unwrap()
}

/// Over 1000 records the probability is uniform where the smaller structure is true, and small where it is not.
#[test]
fn probability_is_uniform_under_the_smaller_structure() {
    let p_values = |factor: f64| -> Vec<f64> {
        let smaller = with_known_damping(factor);
        let p_value = |seed: u64| {
            let log = open_loop(200, NOISE, 0.0, 7000 + seed);
            likelihood_ratio(&estimate(&smaller, &log), &estimate(&oscillator(), &log)).unwrap().p_value
        };
        (0..1000).into_par_iter().map(p_value).collect()
    };
    let below = |values: &[f64], bound: f64| values.iter().filter(|p| **p < bound).count() as f64 / values.len() as f64;
    let of_truth = p_values(1.0);
    // Three standard errors.
    for (bound, margin) in [(0.05, 0.021), (0.5, 0.048), (0.9, 0.029)] {
        let share = below(&of_truth, bound);
        assert!((share - bound).abs() < margin, "{share} below {bound}");
    }
    let power = below(&p_values(1.3), 0.05);
    assert!(power > 0.9, "{power}");
}

#[test]
fn structures_are_ranked() {
    let log = open_loop(400, NOISE, 0.0, 1);
    let (larger, right, wrong) = (
        estimate(&oscillator(), &log),
        estimate(&with_known_damping(1.0), &log),
        estimate(&with_known_damping(2.0), &log),
    );
    let ranked = compare(&[("larger", &larger), ("right", &right), ("wrong", &wrong)]).unwrap();
    assert_eq!(ranked.iter().map(|s| s.unknowns).collect::<Vec<_>>(), [3, 2, 2]);
    assert_eq!(ranked[1].bic, 0.0);
    assert!(ranked[2].aic > 50.0 && ranked[2].bic > 50.0, "{ranked:?}");
    let (n, ratio) = (400.0f64, (right.cost / larger.cost).ln());
    assert!((ranked[0].bic - ranked[1].bic - (n.ln() - n * ratio)).abs() < 1e-9);
    let refused = likelihood_ratio(&right, &wrong).unwrap_err().to_string();
    assert!(refused.contains("more than that of the smaller one"), "{refused}");
    let other = estimate(&oscillator(), &open_loop(401, NOISE, 0.0, 1));
    assert!(compare(&[("one", &larger), ("other", &other)]).is_err());
}
