//! Systems without states or ports, and choices that a reduction cannot follow.

use super::*;

#[test]
fn systems_without_states_inputs_or_outputs_pass_every_method() {
    for (n, m, p) in [(0, 2, 3), (0, 0, 0), (3, 0, 2), (3, 2, 0)] {
        for time in [None, Some(1.0)] {
            let run = |method: ReductionMethod, boundary: Option<f64>| match time {
                None => empty(n, m, p, Continuous, method, boundary),
                Some(ts) => empty(n, m, p, Discrete::new(ts).unwrap(), method, boundary),
            };
            for method in [ReductionMethod::BalancedTruncation, ReductionMethod::SingularPerturbation] {
                run(method, None);
                run(method, Some(0.0));
            }
            run(ReductionMethod::NormalisedCoprime, None);
            run(ReductionMethod::Weighted, None);
        }
    }
}

fn empty<T: TimeDomain>(n: usize, m: usize, p: usize, time: T, method: ReductionMethod, boundary: Option<f64>) {
    let (a, b, c) = (Scale(-0.5) * eye(n), Mat::full(n, m, 1.0), Mat::full(p, n, 1.0));
    let system = StateSpace::new(a, b, c, Mat::zeros(p, m), time).unwrap();
    let options = ReductionOptions { method, stability_boundary: boundary, ..Default::default() };
    let outcome = if method == ReductionMethod::Weighted {
        reduce_weighted(&system, &FrequencyWeights { output: unit(p, time), input: unit(m, time) }, &options)
    } else {
        reduce(&system, &options)
    };
    match outcome {
        Ok(reduced) => assert!(reduced.model.order() <= n && reduced.model.inputs() == m),
        Err(error) => panic!("{n} {m} {p} {method:?}: {error}"),
    }
}

#[test]
fn choices_that_need_the_loop_are_refused_without_it() {
    let system = bearing();
    let closed = ReductionOptions { order: ReducedOrder::ClosedLoop(0.1), ..Default::default() };
    assert!(matches!(reduce(&system, &closed), Err(Error::Unsupported { .. })));
    let weighted = ReductionOptions { method: ReductionMethod::Weighted, ..Default::default() };
    assert!(matches!(reduce(&system, &weighted), Err(Error::Unsupported { .. })));
    for boundary in [0.1, f64::NAN, f64::NEG_INFINITY] {
        let options = ReductionOptions { stability_boundary: Some(boundary), ..Default::default() };
        assert!(matches!(reduce(&system, &options), Err(Error::OutOfRange { .. })), "{boundary}");
    }
}
