//! Refusals, and alternatives that must be asked for by name.

use super::*;
use crate::Error;
use crate::error::OrderLimit;

fn records(system: &StateSpace<Discrete>, samples: usize, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let u = uniform(samples, system.inputs(), rng);
    let e = 1e-4 * uniform(samples, system.outputs(), rng);
    let gain = Mat::zeros(system.order(), system.outputs());
    let y = respond(system, &u, 0.0, Some((&gain, &e)));
    (u, y)
}

#[test]
fn unstable_estimate_is_refused_or_reflected_by_name() {
    let system = random_system(&[1.01, 0.9], 1, 1, false, 1);
    let (u, y) = records(&system, 300, 2);
    let refused = subspace(&one(&u, &y), clock(), &fixed(4, 8));
    assert!(matches!(refused, Err(Error::Unstable { pole, .. }) if (pole.norm() - 1.01).abs() < 1e-3));
    let options = SubspaceOptions { stability: Stability::Constrain, ..fixed(4, 8) };
    let found = subspace(&one(&u, &y), clock(), &options).unwrap();
    assert_eq!(found.stability.moved.len(), 2);
    for moved in &found.stability.moved {
        assert!((moved.from.norm() * moved.to.norm() - 1.0).abs() < 1e-9);
        assert!((moved.from.arg() - moved.to.arg()).abs() < 1e-12);
    }
    assert!(found.model.is_stable().unwrap());
    let stays = |z: &&c64| (z.norm() - 0.9).abs() < 1e-3;
    assert_eq!(found.poles().iter().filter(stays).count(), 2);
}

#[test]
fn lightly_damped_estimate_is_never_touched() {
    let system = random_system(&[0.9995, 0.99], 1, 1, false, 3);
    let (u, y) = records(&system, 4000, 4);
    let results = [Stability::Require, Stability::Allow, Stability::Constrain].map(|stability| {
        let options = SubspaceOptions { stability, ..fixed(4, 20) };
        subspace(&one(&u, &y), clock(), &options).unwrap()
    });
    assert!(results.iter().all(|r| r.stability.moved.is_empty() && r.model == results[0].model));
    assert!((results[0].stability.worst.norm() - 0.9995).abs() < 1e-5);
}

#[test]
fn poor_excitation_names_the_rank() {
    let system = random_system(&[0.9], 1, 1, false, 5);
    let square = Mat::from_fn(2000, 1, |k, _| if k % 12 < 6 { 1.0 } else { -1.0 });
    let y = respond(&system, &square, 0.0, None);
    let refused = subspace(&one(&square, &y), clock(), &fixed(2, 10));
    // A square wave of 12 samples obeys u(k+6) = -u(k).
    assert!(matches!(refused, Err(Error::InsufficientExcitation { rank: 6, needed: 20, .. })), "{refused:?}");
}

#[test]
fn unfit_records_are_refused() {
    let system = random_system(&[0.9], 2, 1, false, 6);
    let (u, y) = records(&system, 200, 7);
    let run = |u: &Mat<f64>, y: &Mat<f64>, options: &SubspaceOptions| subspace(&one(u, y), clock(), options).err();
    let rows = |m: &Mat<f64>, k: usize| m.as_ref().subrows(0, k).to_owned();
    assert!(matches!(run(&rows(&u, 30), &rows(&y, 30), &fixed(2, 20)), Some(Error::TooFewSamples { needed: 40, .. })));
    // 2 s (m + p) = 60 columns are needed, and n = 60 + 2 s - 1 samples for them.
    assert!(matches!(run(&rows(&u, 78), &rows(&y, 78), &fixed(2, 10)), Some(Error::TooFewSamples { needed: 79, .. })));
    assert!(run(&rows(&u, 79), &rows(&y, 79), &fixed(2, 10)).is_none());
    assert!(matches!(run(&rows(&u, 150), &y, &fixed(2, 10)), Some(Error::Shape { .. })));
    assert!(matches!(
        run(&u, &y, &fixed(10, 10)),
        Some(Error::Order { limit: OrderLimit::Horizon { largest: 9, .. }, .. })
    ));
    assert!(matches!(run(&u, &y, &fixed(0, 10)), Some(Error::OutOfRange { .. })));
    assert!(matches!(run(&u, &y, &fixed(1, 1)), Some(Error::OutOfRange { .. })));
    let mut bad = y.clone();
    bad[(17, 0)] = f64::NAN;
    assert!(matches!(run(&u, &bad, &fixed(2, 10)), Some(Error::NotFinite { row: 18, column: 1, .. })));
    let mut still = u.clone();
    still.col_mut(1).fill(0.25);
    assert!(
        matches!(run(&still, &y, &fixed(2, 10)), Some(Error::ConstantChannel { what, .. }) if what == "input channel 2")
    );
    assert!(matches!(subspace(&[], clock(), &fixed(2, 10)), Err(Error::OutOfRange { .. })));
}

#[test]
fn zero_initial_state_is_used_where_said() {
    let system = random_system(&[0.95, 0.8], 1, 2, true, 8);
    let u = uniform(300, 1, &mut ChaCha8Rng::seed_from_u64(9));
    let options = SubspaceOptions { initial_state: InitialState::Zero, ..fixed(4, 8) };
    let run = |x0| {
        let y = respond(&system, &u, x0, None);
        subspace(&one(&u, &y), clock(), &options).unwrap()
    };
    let (rest, moving) = (run(0.0), run(5.0));
    assert_eq!(rest.initial_states, [[0.0; 4]]);
    assert!(distance(&rest.model, &system) < 1e-8);
    assert!(distance(&moving.model, &system) > 1e-3);
}

#[test]
fn options_read_from_a_table_and_refuse_unknown_names() {
    let text = "method = 'cva'\nhorizon = 30\norder = 8\nfeedthrough = 'none'\nstability = 'allow'\n";
    let options: SubspaceOptions = toml::from_str(text).unwrap();
    let expected = SubspaceOptions {
        method: SubspaceMethod::Cva,
        horizon: 30,
        order: Order::Fixed(8),
        stability: Stability::Allow,
        ..Default::default()
    };
    assert_eq!(options, expected);
    assert_eq!(toml::from_str::<SubspaceOptions>("order = 'auto'").unwrap().order, Order::default());
    assert!(toml::from_str::<SubspaceOptions>("wieght = 'cva'").is_err());
    assert!(toml::from_str::<SubspaceOptions>("method = 'cav'").is_err());
}
