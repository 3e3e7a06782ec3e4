//! Properties of reductions in the loop, on random loops with unstable nominal plants.

use super::tests::{random, random_stable, random_unstable};
use super::*;
use crate::control::{LqrWeights, NoiseCovariance, kalman, lqr};
use crate::factor::CoprimeFactors;
use crate::linalg::eye;
use crate::lti::{Continuous, Discrete, hinf_norm};
use crate::{Error, Mat};
use faer::Scale;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// An unstable nominal plant with 2 inputs and 3 outputs, its observer-based controller, and a stable S of moderate size.
fn random_loop<T: TimeDomain>(n: usize, time: T, seed: u64) -> (CoprimeFactors<T>, StateSpace<T>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let nominal = random_unstable(n, time, rng);
    let f = lqr(&nominal, &LqrWeights { q: eye(n), r: eye(2), s: None }).unwrap().f;
    let noise = NoiseCovariance { process: eye(n), measurement: eye(3), cross: None };
    let l = kalman(&nominal, &noise).unwrap().l;
    let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
    let s = random_stable(4, time, rng);
    let s = StateSpace::new(
        s.a().to_owned(),
        Scale(0.2) * s.b(),
        Scale(0.2) * s.c(),
        Scale(0.05) * random(3, 2, rng),
        time,
    );
    (factors, s.unwrap())
}

fn boundary<T: TimeDomain>(time: T) -> Option<f64> {
    Some(if time.sample_time().is_some() { 1.0 } else { 0.0 })
}

/// What the sweep says of every order is what the dual Youla parametrisation says: S of the reduced model is stable exactly
/// where the controller stabilises it, and the closed-loop error is that of N + V S.
fn check_sweep<T: TimeDomain>(factors: &CoprimeFactors<T>, s: &StateSpace<T>, options: &ReductionOptions) -> usize {
    let model = ReductionLoop::new(factors, s).unwrap();
    let found = sweep(&model, options).unwrap();
    let reducer = model.reducer(options).unwrap();
    let peak = |system: &StateSpace<T>| hinf_norm(system, &PeakOptions { tolerance: 1e-6 }).unwrap().value;
    let full = model.response_of(model.plant()).unwrap();
    assert!(peak(&full.plus(&model.response().negated()).unwrap()) < 1e-8 * peak(model.response()));
    let mut refused = 0;
    for row in &found.rows {
        if row.failure.is_some() {
            continue;
        }
        let reduction = reducer.reduction(row.order).unwrap();
        assert_eq!(reduction.model.order(), row.order);
        let (stabilised, worst_pole) = (row.stabilised, row.worst_pole);
        let reduced = LoopReduction { reduction, stabilised, worst_pole, sweep: found.clone() };
        let deviation = factors.deviation_of(&reduced.reduction.model).unwrap();
        let worst = model.plant().time().instability(deviation.worst_pole().unwrap().unwrap());
        assert!(worst.abs() < 1e-6 || (worst < 0.0) == row.stabilised, "{worst} {row:?}");
        if row.stabilised {
            let response = factors.right_factors_of(&deviation).unwrap().part(2..5, 0..2);
            let miss = peak(&response.plus(&model.response().negated()).unwrap()) / peak(model.response());
            let closed = row.closed_loop.unwrap();
            assert!((closed - miss).abs() < 1e-4 * miss + 1e-8, "{closed} {miss}");
            assert!(reduced.proposed_order().is_none() && reduced.sentence().contains("stabilises the reduced model"));
        } else {
            refused += 1;
            assert!(row.closed_loop.is_none());
            let proposed = reduced.proposed_order().unwrap();
            assert!(found.row(proposed).unwrap().stabilised);
            assert!(
                proposed < row.order
                    || found.rows[..].iter().all(|r| r.order <= row.order || r.order >= proposed || !r.stabilised)
            );
            assert!(
                reduced.sentence().contains("does not stabilise") && reduced.sentence().contains(&proposed.to_string())
            );
        }
    }
    // The minimal model is the plant: nothing is lost, and K stabilises it.
    let last = found.rows.last().unwrap();
    assert!(last.stabilised && last.closed_loop.unwrap() < 1e-6, "{last:?}");
    refused
}

#[test]
fn the_sweep_agrees_with_the_youla_parametrisation() {
    let mut refused = 0;
    let (factors, s) = random_loop(4, Continuous, 1);
    let (sampled, sampled_s) = random_loop(4, Discrete::new(0.1).unwrap(), 2);
    let of = |method| ReductionOptions { method, ..Default::default() };
    let apart = |method, stability_boundary| ReductionOptions { stability_boundary, ..of(method) };
    let left = boundary(Continuous);
    refused += check_sweep(&factors, &s, &apart(ReductionMethod::BalancedTruncation, left));
    refused += check_sweep(&factors, &s, &apart(ReductionMethod::Weighted, left));
    refused += check_sweep(&factors, &s, &of(ReductionMethod::NormalisedCoprime));
    let disc = boundary(sampled.nominal().time());
    refused += check_sweep(&sampled, &sampled_s, &apart(ReductionMethod::SingularPerturbation, disc));
    refused += check_sweep(&sampled, &sampled_s, &of(ReductionMethod::NormalisedCoprime));
    assert!(refused > 0, "no case in which the controller does not stabilise the reduced model was met");
}

#[test]
fn the_order_follows_from_the_closed_loop_error() {
    let (factors, s) = random_loop(5, Discrete::new(0.1).unwrap(), 2);
    let model = ReductionLoop::new(&factors, &s).unwrap();
    let options = |order| ReductionOptions { method: ReductionMethod::NormalisedCoprime, order, ..Default::default() };
    let all = sweep(&model, &options(ReducedOrder::Minimal)).unwrap();
    for limit in [0.5, 0.1, 1e-2, 1e-3] {
        let found = reduce_in_loop(&model, &options(ReducedOrder::ClosedLoop(limit))).unwrap();
        let row = found.row().unwrap();
        assert!(found.stabilised && row.closed_loop.unwrap() <= limit);
        let fewer = all.rows.iter().filter(|r| r.order < row.order);
        assert!(fewer.into_iter().all(|r| !r.stabilised || r.closed_loop.unwrap() > limit));
        assert_eq!(found.sweep, all);
    }
    let impossible = reduce_in_loop(&model, &options(ReducedOrder::ClosedLoop(0.0)));
    assert!(matches!(impossible, Err(Error::NoReducedOrder { lowest: Some(_), .. })), "{impossible:?}");
    let stable_method = ReductionOptions::default();
    let refusal = reduce_in_loop(&model, &stable_method).unwrap_err();
    assert!(matches!(&refusal, Error::Unstable { what, .. } if what.contains("normalised-coprime")), "{refusal}");
}

/// Zero S and a nominal plant without states: nothing panics, and order 0 is a model.
#[test]
fn loops_without_states_pass() {
    let time = Discrete::new(1.0).unwrap();
    let plant = StateSpace::gain(Mat::full(3, 2, 0.1), time).unwrap();
    let factors = CoprimeFactors::observer(&plant, Mat::zeros(2, 0).as_ref(), Mat::zeros(0, 3).as_ref()).unwrap();
    let s = StateSpace::gain(Mat::zeros(3, 2), time).unwrap();
    let model = ReductionLoop::new(&factors, &s).unwrap();
    for method in [
        ReductionMethod::BalancedTruncation,
        ReductionMethod::SingularPerturbation,
        ReductionMethod::NormalisedCoprime,
        ReductionMethod::Weighted,
    ] {
        let found = reduce_in_loop(&model, &ReductionOptions { method, ..Default::default() }).unwrap();
        assert!(found.order() == 0 && found.stabilised && found.sweep.rows.is_empty() && found.row().is_none());
    }
}

/// An S that is not stable: the controller does not stabilise G(S); the sweep says so and proposes nothing.
#[test]
fn an_unstable_s_is_said() {
    let (factors, _) = random_loop(4, Continuous, 5);
    let s = random_unstable(5, Continuous, &mut ChaCha8Rng::seed_from_u64(48));
    assert!(!s.is_stable().unwrap());
    let s =
        StateSpace::new(s.a().to_owned(), s.b().to_owned(), s.c().to_owned(), Mat::zeros(3, 2), Continuous).unwrap();
    let model = ReductionLoop::new(&factors, &s).unwrap();
    let options = ReductionOptions { method: ReductionMethod::NormalisedCoprime, ..Default::default() };
    let found = reduce_in_loop(&model, &options).unwrap();
    assert!(!found.stabilised && found.sweep.response_norm.is_none());
    assert!(found.sweep.rows.iter().all(|row| row.closed_loop.is_none()));
    let weighted = ReductionOptions { method: ReductionMethod::Weighted, stability_boundary: Some(0.0), ..options };
    assert!(matches!(reduce_in_loop(&model, &weighted), Err(Error::Unstable { .. })));
}
