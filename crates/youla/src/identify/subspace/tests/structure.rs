//! What is known beforehand: entries of D that are zero, and delays of inputs.

use super::*;
use crate::lti::simulate;

const WEIGHTS: [SubspaceMethod; 5] = [
    SubspaceMethod::Moesp,
    SubspaceMethod::N4sid,
    SubspaceMethod::Cva,
    SubspaceMethod::PbsidOpt,
    SubspaceMethod::Ssarx,
];

fn marks() -> Vec<Vec<bool>> {
    vec![vec![true, false], vec![false, false], vec![true, true]]
}

/// Two inputs, three outputs, D zero where it is not marked.
fn partly_direct(seed: u64) -> StateSpace<Discrete> {
    let full = random_system(&[0.9, 0.7], 2, 3, true, seed);
    let d = Mat::from_fn(3, 2, |i, j| if marks()[i][j] { full.d()[(i, j)] } else { 0.0 });
    StateSpace::new(full.a().to_owned(), full.b().to_owned(), full.c().to_owned(), d, clock()).unwrap()
}

#[test]
fn marked_entries_of_d_are_found_and_the_others_stay_zero() {
    let system = partly_direct(12);
    let rng = &mut ChaCha8Rng::seed_from_u64(13);
    let u = uniform(1500, 2, rng);
    let e = uniform(1500, 3, rng);
    for noise in [0.0, 0.2] {
        let y = respond(&system, &u, 0.3, None) + noise * &e;
        for method in WEIGHTS {
            let feedthrough = Feedthrough::Entries(marks());
            let options = SubspaceOptions { method, horizon: 6, past: Some(9), feedthrough, ..fixed(4, 6) };
            let found = subspace(&one(&u, &y), clock(), &options).unwrap().model;
            let error = distance(&found, &system);
            let limit = if noise > 0.0 { 0.1 } else { 1e-8 };
            assert!(error < limit, "{method:?}, noise {noise}: {error:.1e}");
            for (i, j) in (0..3).flat_map(|i| (0..2).map(move |j| (i, j))) {
                assert_eq!(found.d()[(i, j)] == 0.0, !marks()[i][j], "{method:?}: {:?}", found.d());
            }
        }
    }
}

#[test]
fn all_entries_or_none_are_the_other_choices() {
    let system = partly_direct(14);
    let rng = &mut ChaCha8Rng::seed_from_u64(15);
    let u = uniform(700, 2, rng);
    let y = respond(&system, &u, 0.3, None) + 0.1 * uniform(700, 3, rng);
    let with = |method, feedthrough| {
        let options = SubspaceOptions { method, horizon: 6, past: Some(9), feedthrough, ..fixed(4, 6) };
        subspace(&one(&u, &y), clock(), &options).map(|found| found.model)
    };
    for method in WEIGHTS {
        for (mark, same) in [(true, Feedthrough::Estimated), (false, Feedthrough::None)] {
            let entries = Feedthrough::Entries(vec![vec![mark; 2]; 3]);
            assert_eq!(with(method, entries).unwrap(), with(method, same).unwrap());
        }
    }
    let refused = with(SubspaceMethod::Moesp, Feedthrough::Entries(vec![vec![true; 3]; 3])).unwrap_err().to_string();
    assert!(refused.contains("(feedthrough) is 3 x 3, but must be 3 x 2"), "{refused}");
}

#[test]
fn spellings_of_feedthrough_and_delays() {
    let read = |text: &str| toml::from_str::<SubspaceOptions>(text).unwrap();
    assert_eq!(read("feedthrough = \"none\"").feedthrough, Feedthrough::None);
    assert_eq!(read("feedthrough = \"estimated\"").feedthrough, Feedthrough::Estimated);
    let options = read("feedthrough = { entries = [[true, false], [false, false]] }\ndelays = [2, 0]");
    assert_eq!(options.feedthrough, Feedthrough::Entries(vec![vec![true, false], vec![false, false]]));
    assert_eq!(options.delays, [2, 0]);
    assert_eq!(read(&toml::to_string(&options).unwrap()), options);
}

#[test]
fn delays_are_states_of_the_model() {
    for (case, method) in WEIGHTS.into_iter().enumerate() {
        let system = random_system(&[0.95, 0.7], 2, 2, case % 2 == 0, 20 + case as u64);
        let rng = &mut ChaCha8Rng::seed_from_u64(30);
        let u = uniform(900, 2, rng);
        let delayed = Mat::from_fn(900, 2, |k, j| if j == 0 && k >= 3 { u[(k - 3, 0)] } else { u[(k, 1)] * j as f64 });
        let y = respond(&system, &delayed, 0.3, None);
        let options = SubspaceOptions { method, horizon: 6, past: Some(9), delays: vec![3, 0], ..fixed(4, 6) };
        let found = subspace(&one(&u, &y), clock(), &options).unwrap();
        assert_eq!((found.order.order, found.model.order(), found.delays.clone()), (4, 7, vec![3, 0]));
        assert_eq!((found.columns, found.poles().len()), (900 - 3 - 14, 7));
        assert!(found.poles()[4..].iter().all(|z| z.norm() == 0.0));
        // From the inputs as measured, on from the first sample that all delayed inputs reach.
        let simulated = simulate(&found.model, u.as_ref().subrows(3, 897), &found.initial_states[0]).unwrap();
        let error = (simulated - y.as_ref().subrows(3, 897)).norm_max() / y.norm_max();
        assert!(error < 1e-7, "{method:?}: {error:.1e}");
    }
}

#[test]
fn unfit_delays_are_refused() {
    let system = random_system(&[0.9], 2, 1, false, 6);
    let u = uniform(40, 2, &mut ChaCha8Rng::seed_from_u64(1));
    let y = respond(&system, &u, 0.0, None);
    let with = |delays: Vec<usize>| {
        let options = SubspaceOptions { delays, ..fixed(2, 5) };
        subspace(&one(&u, &y), clock(), &options).unwrap_err().to_string()
    };
    assert!(with(vec![1]).contains("one per input"));
    assert!(with(vec![0, 33]).contains("after a delay of 33 samples: 40 samples are too few, at least 43"));
    let data = SubspaceData::new(&one(&u, &y), clock(), &fixed(2, 5)).unwrap();
    let other = SubspaceOptions { delays: vec![1, 0], ..fixed(2, 5) };
    assert!(matches!(data.identify(&other), Err(Error::Unsupported { .. })));
}

/// Plant and nominal model with a delay of two samples: S has it too, and G(S) from a delayed S is the plant.
#[test]
fn the_deviation_system_may_be_delayed() {
    let delayed = |seed| {
        let plain = random_system(&[0.8], 1, 1, false, seed);
        Delays::new(&[2], 1).unwrap().put_before(plain).unwrap()
    };
    let (plant, nominal) = (delayed(31), delayed(32));
    let f = Mat::from_fn(1, 4, |_, j| [0.05, -0.04, 0.1, 0.05][j]);
    let l = Mat::from_fn(4, 1, |i, _| [-0.05, 0.06, 0.1, -0.1][i]);
    let factors = crate::factor::CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
    let closed = crate::control::closed_loop(&plant, &factors.j_k().unwrap()).unwrap();
    let alpha = uniform(2000, 1, &mut ChaCha8Rng::seed_from_u64(33));
    let driving = crate::linalg::block(&[&[alpha.as_ref(), Mat::zeros(2000, 1).as_ref()]]);
    let z = simulate(&closed, driving.as_ref(), &vec![0.0; closed.order()]).unwrap();
    let signals = factors.signals(z.as_ref().subcols(0, 1), z.as_ref().subcols(1, 1)).unwrap();
    let feedthrough = Feedthrough::None;
    let options = SubspaceOptions { delays: vec![2], feedthrough, stability: Stability::Allow, ..fixed(8, 14) };
    let found = crate::identify::hansen::hansen(&factors, &[signals], &options).unwrap();
    assert_eq!(found.deviation.model.order(), 10);
    let error = distance(&found.plant, &plant);
    assert!(error < 1e-5, "{error:.1e}");
}
