//! What each method makes of a noisy G(S): 16 states to 6 on the simulated bearing with half of A, in open and closed loop.

use std::path::Path;
use youla::factor::CoprimeFactors;
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla::reduce::{ReducedOrder, ReductionLoop, ReductionMethod, ReductionOptions, reduce, reduce_in_loop};
use youla::validate::certify;
use youla_run::{Identification, StageClock, identify};
use youla_twin::{DemoMachine, demo};

fn identified(seed: u64) -> Identification {
    let mut demo = demo(DemoMachine::Bearing, seed).unwrap();
    demo.settings.reduction = None;
    demo.settings.direct = None;
    identify(demo.settings, demo.records, Path::new("."), &mut StageClock::new(&mut |_| ())).unwrap()
}

/// Relative error of frequency responses in the Frobenius norm over 400 frequencies up to Nyquist.
fn relative(found: &StateSpace<Discrete>, exact: &StateSpace<Discrete>) -> f64 {
    let omega: Vec<f64> =
        (0..400).map(|k| 5000.0 * std::f64::consts::PI * 10f64.powf(-3.0 + 3.0 * f64::from(k) / 400.0)).collect();
    let (found, exact) = (frequency_response(found, &omega).unwrap(), frequency_response(exact, &omega).unwrap());
    let miss: f64 = found.iter().zip(exact.iter()).map(|(x, y)| (x - y).squared_norm_l2()).sum();
    (miss / exact.iter().map(|y| y.squared_norm_l2()).sum::<f64>()).sqrt()
}

/// Errors in open and closed loop.
fn errors(model: &ReductionLoop<Discrete>, reduced: &StateSpace<Discrete>) -> (f64, f64) {
    let response = model.response_of(reduced).unwrap();
    (relative(reduced, model.plant()), relative(&response, model.response()))
}

/// The raw right factors `[M + U S; N + V S]`, truncated.
fn raw_factors(factors: &CoprimeFactors<Discrete>, s: &StateSpace<Discrete>, order: usize) -> StateSpace<Discrete> {
    let pair = factors.right_factors_of(s).unwrap();
    let options = ReductionOptions { order: ReducedOrder::Fixed(order), ..Default::default() };
    let reduced = reduce(&pair, &options).unwrap().model;
    let (m, n) = (reduced.part(0..2, 0..2), reduced.part(2..4, 0..2));
    m.inverse().unwrap().then(&n).unwrap()
}

/// Relative errors in open and closed loop, Frobenius norm over frequency, to 5 %. Truncation is best in open loop, the weights
/// of the loop in closed loop; singular perturbation pays for its static gain in closed loop; normalised factors need scaled
/// outputs; raw factors give a model that the controller does not stabilise.
#[test]
fn methods_rank_as_expected() {
    let found = identified(1);
    let factors = &found.filtered.as_ref().unwrap().factorisation.factors;
    let s = &found.scheme().unwrap().deviation.model;
    let model = ReductionLoop::new(factors, s).unwrap();
    assert_eq!(model.plant().order(), 16);
    let scales = (Some(vec![3.3; 2]), Some(vec![1.0; 2]));
    for (method, (output_scale, input_scale), open, closed) in [
        (ReductionMethod::BalancedTruncation, (None, None), 0.0280, 0.0541),
        (ReductionMethod::SingularPerturbation, (None, None), 0.0373, 0.2349),
        (ReductionMethod::Weighted, (None, None), 0.0487, 0.0385),
        (ReductionMethod::NormalisedCoprime, (None, None), 0.0518, 0.0962),
        (ReductionMethod::NormalisedCoprime, scales, 0.0309, 0.0447),
    ] {
        let order = ReducedOrder::Fixed(6);
        let options = ReductionOptions { method, order, output_scale, input_scale, ..Default::default() };
        let reduced = reduce_in_loop(&model, &options).unwrap();
        let errors = errors(&model, &reduced.reduction.model);
        assert!((errors.0 / open - 1.0).abs() < 0.05, "{method}: {errors:?}");
        assert!((errors.1 / closed - 1.0).abs() < 0.05, "{method}: {errors:?}");
        assert!(reduced.stabilised && reduced.reduction.unstable_pole.is_none(), "{method}");
    }
    let raw = raw_factors(factors, s, 6);
    let (open, _) = errors(&model, &raw);
    assert!(open > 1.0, "{open}");
    let loop_poles = certify(&raw, found.declared.controller()).unwrap();
    assert!(!loop_poles.stable, "{:?}", loop_poles.worst_pole);
}
