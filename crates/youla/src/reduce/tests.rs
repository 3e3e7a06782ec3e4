//! Properties of the reductions on seeded random systems; see `loop_tests` for those in the loop.

mod limits;

use super::*;
use crate::control::normalised_right_factors;
use crate::error::OrderLimit;
use crate::fixtures::bearing;
use crate::linalg::{block, block_diagonal, eye};
use crate::lti::{Continuous, Discrete, frequency_response};
use crate::{Error, Mat, MatRef};
use faer::Scale;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const METHODS: [ReductionMethod; 2] = [ReductionMethod::BalancedTruncation, ReductionMethod::SingularPerturbation];

/// Reduces with given weights, without a loop that they come from.
pub(super) fn reduce_weighted<T: TimeDomain>(
    system: &StateSpace<T>,
    weights: &FrequencyWeights<T>,
    options: &ReductionOptions,
) -> Result<Reduction<T>> {
    let options = ReductionOptions { method: ReductionMethod::Weighted, ..options.clone() };
    let reducer = Reducer::new(system, Some(weights), &options)?;
    reducer.reduction(reducer.choose(options.order)?)
}

pub(super) fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
}

pub(super) fn random_stable<T: TimeDomain>(n: usize, time: T, rng: &mut ChaCha8Rng) -> StateSpace<T> {
    let a = random(n, n, rng);
    let size = a.norm_l2();
    let a = match time.sample_time() {
        Some(_) => Scale(0.95 / size) * a,
        None => a - Scale(1.05 * size) * Mat::<f64>::identity(n, n),
    };
    StateSpace::new(a, random(n, 2, rng), random(3, n, rng), random(3, 2, rng), time).unwrap()
}

/// Largest singular value of the difference over 200 frequencies.
pub(super) fn error<T: TimeDomain>(left: &StateSpace<T>, right: &StateSpace<T>, omega: &[f64]) -> f64 {
    let (left, right) = (frequency_response(left, omega).unwrap(), frequency_response(right, omega).unwrap());
    left.iter().zip(right.iter()).map(|(l, r)| (l - r).singular_values().unwrap()[0]).fold(0.0, f64::max)
}

fn check_bound<T: TimeDomain>(system: &StateSpace<T>, omega: &[f64]) {
    for method in METHODS {
        for order in 0..=system.order() {
            let options = ReductionOptions { method, order: ReducedOrder::Fixed(order), ..Default::default() };
            let reduced = reduce(system, &options).unwrap();
            let found = error(system, &reduced.model, omega);
            let rounding = 1e-11 * reduced.hankel[0];
            let bound = reduced.error_bound.unwrap();
            let measured = reduced.measured_error().unwrap();
            assert!(found <= measured.upper * (1.0 + 1e-9) + rounding, "{method:?} {order}: {found} {measured:?}");
            assert!(measured.value <= bound + rounding, "{method:?} {order}: {measured:?} {bound}");
            // The error is at least the first Hankel singular value that is left out.
            let omitted = reduced.hankel.get(order).copied().unwrap_or(0.0);
            assert!(found >= 0.3 * omitted, "{method:?} {order}: {found} {omitted}");
        }
    }
}

#[test]
fn error_stays_below_its_bound() {
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let logarithmic: Vec<f64> = (0..200).map(|k| 10f64.powf(0.04 * f64::from(k) - 3.0)).collect();
    let linear: Vec<f64> = (0..200).map(|k| std::f64::consts::PI * f64::from(k) / 199.0).collect();
    for n in [1, 4, 9] {
        check_bound(&random_stable(n, Continuous, &mut rng), &logarithmic);
        check_bound(&random_stable(n, Discrete::new(1.0).unwrap(), &mut rng), &linear);
    }
}

#[test]
fn singular_perturbation_keeps_the_static_gain() {
    let plant = bearing();
    for order in 0..6 {
        let options = ReductionOptions {
            method: ReductionMethod::SingularPerturbation,
            order: ReducedOrder::Fixed(order),
            ..Default::default()
        };
        assert!(error(&plant, &reduce(&plant, &options).unwrap().model, &[0.0]) < 1e-10);
        let sampled = plant.zoh(Discrete::new(2e-4).unwrap()).unwrap();
        assert!(error(&sampled, &reduce(&sampled, &options).unwrap().model, &[0.0]) < 1e-10);
    }
}

/// `G + (G_true - G)`: 18 states of which 12 cancel.
fn redundant() -> StateSpace<Discrete> {
    let time = Discrete::new(2e-4).unwrap();
    let plant = bearing();
    let scaled = |factor: f64| {
        let [a, b, c, d] = [plant.a(), plant.b(), plant.c(), plant.d()].map(|m| Scale(factor) * m);
        let c = Scale(1.0 / factor) * c;
        StateSpace::new(a, b, c, d, Continuous).unwrap().zoh(time).unwrap()
    };
    let (nominal, truth) = (scaled(0.5), scaled(1.0));
    let a = block_diagonal(nominal.a(), block_diagonal(truth.a(), nominal.a()).as_ref());
    let b = block(&[&[nominal.b()], &[truth.b()], &[nominal.b()]]);
    let minus = Scale(-1.0) * nominal.c();
    let c = block(&[&[nominal.c(), truth.c(), minus.as_ref()]]);
    StateSpace::new(a, b, c, Mat::zeros(2, 2), time).unwrap()
}

#[test]
fn exact_cancellations_are_found_and_removed() {
    let system = redundant();
    let truth = bearing().zoh(system.time()).unwrap();
    let omega: Vec<f64> = (0..200).map(|k| 75.0 * f64::from(k)).collect();
    for method in METHODS {
        let reduced = reduce(&system, &ReductionOptions { method, ..Default::default() }).unwrap();
        assert_eq!(reduced.minimal_order, 6, "{:?}", reduced.hankel);
        assert!(error(&reduced.model, &truth, &omega) < 1e-10 * reduced.hankel[0]);
    }
    let options = ReductionOptions { order: ReducedOrder::Fixed(7), ..Default::default() };
    assert!(matches!(reduce(&system, &options), Err(Error::Order { order: 7, limit: OrderLimit::Minimal(6) })));
}

#[test]
fn order_follows_from_the_bound() {
    let system = random_stable(8, Continuous, &mut ChaCha8Rng::seed_from_u64(42));
    let hankel = hankel_singular_values(&system).unwrap();
    for order in 0..8 {
        let bound = 2.0 * hankel[order..].iter().sum::<f64>();
        let choice = |bound| ReductionOptions { order: ReducedOrder::Bound(bound), ..Default::default() };
        assert_eq!(reduce(&system, &choice(1.0001 * bound)).unwrap().model.order(), order);
        assert_eq!(reduce(&system, &choice(0.9999 * bound)).unwrap().model.order(), order + 1);
    }
    let choice = ReductionOptions { order: ReducedOrder::Bound(f64::NAN), ..Default::default() };
    assert!(matches!(reduce(&system, &choice), Err(Error::OutOfRange { .. })));
}

#[test]
fn unstable_systems_are_refused_with_their_pole() {
    let a = Mat::from_fn(2, 2, |i, j| if i == j { [-1.0, 0.25][i] } else { 0.0 });
    let b = Mat::from_fn(2, 1, |_, _| 1.0);
    let system = StateSpace::new(a, b.clone(), b.transpose().to_owned(), Mat::zeros(1, 1), Continuous).unwrap();
    assert!(
        matches!(reduce(&system, &ReductionOptions::default()), Err(Error::Unstable { pole, .. }) if pole.re == 0.25)
    );
}

#[test]
fn systems_without_states_or_without_effect_reduce_to_their_gain() {
    let still: StateSpace<Continuous> = StateSpace::gain(Mat::identity(2, 2), Continuous).unwrap();
    let reduced = reduce(&still, &ReductionOptions::default()).unwrap();
    assert_eq!((reduced.model.order(), reduced.error_bound), (0, Some(0.0)));
    let zero: MatRef<'_, f64> = still.d();
    let silent = StateSpace::new(-zero, Mat::zeros(2, 2), zero.to_owned(), zero.to_owned(), Continuous).unwrap();
    assert_eq!(reduce(&silent, &ReductionOptions::default()).unwrap().minimal_order, 0);
}

#[test]
fn options_read_as_they_are_written() {
    let options: ReductionOptions = toml::from_str("method = \"singular-perturbation\"\norder = 6").unwrap();
    assert_eq!(options.order, ReducedOrder::Fixed(6));
    assert_eq!(options.method, ReductionMethod::SingularPerturbation);
    assert!(toml::from_str::<ReductionOptions>("methode = 1").is_err());
    let options: ReductionOptions =
        toml::from_str("method = \"normalised-coprime\"\norder = { closed-loop = 0.05 }\nstability_boundary = 0.99")
            .unwrap();
    assert_eq!(options.order, ReducedOrder::ClosedLoop(0.05));
    assert_eq!((options.method, options.stability_boundary), (ReductionMethod::NormalisedCoprime, Some(0.99)));
}

const LOGARITHMIC: fn() -> Vec<f64> = || (0..200).map(|k| 10f64.powf(0.04 * f64::from(k) - 3.0)).collect();
const LINEAR: fn() -> Vec<f64> = || (1..200).map(|k| std::f64::consts::PI * f64::from(k) / 200.0).collect();

fn fixed(method: ReductionMethod, order: usize) -> ReductionOptions {
    ReductionOptions { method, order: ReducedOrder::Fixed(order), ..Default::default() }
}

/// A random system of n states, about a quarter of its poles unstable.
pub(super) fn random_unstable<T: TimeDomain>(n: usize, time: T, rng: &mut ChaCha8Rng) -> StateSpace<T> {
    let scale = 1.0 / (n as f64).sqrt();
    let a = match time.sample_time() {
        Some(_) => Scale(1.15 * scale) * random(n, n, rng),
        None => Scale(scale) * random(n, n, rng) - Scale(0.4) * eye(n),
    };
    StateSpace::new(a, random(n, 2, rng), random(3, n, rng), random(3, 2, rng), time).unwrap()
}

fn check_split<T: TimeDomain>(system: &StateSpace<T>, boundary: f64, omega: &[f64]) {
    let parts = split(system, boundary).unwrap();
    let is_beyond = |p: &c64| match system.time().sample_time() {
        None => p.re >= boundary,
        Some(_) => p.norm() >= boundary,
    };
    assert!(parts.relative_residual < 1e-12);
    assert_eq!(parts.beyond.order() + parts.within.order(), system.order());
    assert!(parts.beyond.poles().unwrap().iter().all(is_beyond));
    assert!(!parts.within.poles().unwrap().iter().any(is_beyond));
    let sum = parts.beyond.plus(&parts.within).unwrap();
    let size = error(system, &StateSpace::gain(Mat::zeros(3, 2), system.time()).unwrap(), omega);
    assert!(error(&sum, system, omega) < 1e-10 * size);
    let options = ReductionOptions { stability_boundary: Some(boundary), ..Default::default() };
    let minimal = reduce(system, &options).unwrap();
    for order in minimal.kept.len()..=minimal.minimal_order {
        let reduced =
            reduce(system, &ReductionOptions { order: ReducedOrder::Fixed(order), ..options.clone() }).unwrap();
        let poles = reduced.model.poles().unwrap();
        let nearest = |p: &c64| poles.iter().map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min);
        // The poles of the given system that are kept stand in the reduced one.
        let given = system.poles().unwrap();
        assert!(given.iter().filter(|p| is_beyond(p)).all(|p| nearest(p) < 1e-10 * (1.0 + p.norm())));
        let rounding = 1e-10 * (size + reduced.hankel.first().copied().unwrap_or(0.0));
        assert!(error(&reduced.model, system, omega) <= reduced.error_bound.unwrap() + rounding);
        assert!(reduced.measured_error().unwrap().value <= reduced.error_bound.unwrap() + rounding);
    }
    if !minimal.kept.is_empty() {
        let below = ReductionOptions { order: ReducedOrder::Fixed(minimal.kept.len() - 1), ..options };
        assert!(matches!(reduce(system, &below), Err(Error::Order { limit: OrderLimit::Kept(_), .. })));
    }
}

#[test]
fn a_split_is_exact() {
    let mut rng = ChaCha8Rng::seed_from_u64(43);
    for n in [1, 2, 5, 9] {
        for boundary in [0.0, -0.4] {
            check_split(&random_unstable(n, Continuous, &mut rng), boundary, &LOGARITHMIC());
        }
        for boundary in [1.0, 0.7, 0.0] {
            check_split(&random_unstable(n, Discrete::new(1.0).unwrap(), &mut rng), boundary, &LINEAR());
        }
    }
}

#[test]
fn lightly_damped_modes_are_kept_untouched() {
    let plant = bearing().zoh(Discrete::new(2e-4).unwrap()).unwrap();
    let options =
        ReductionOptions { stability_boundary: Some(0.9), order: ReducedOrder::Fixed(4), ..Default::default() };
    let reduced = reduce(&plant, &options).unwrap();
    assert_eq!(reduced.kept.len(), 4, "{:?}", plant.poles());
    let (found, exact) = (reduced.model.poles().unwrap(), plant.poles().unwrap());
    for pole in found {
        assert!(exact.iter().any(|p| (p - pole).norm() < 1e-10), "{pole}");
    }
}

fn check_normalised<T: TimeDomain>(system: &StateSpace<T>) {
    let n = system.order();
    let full =
        reduce(system, &ReductionOptions { method: ReductionMethod::NormalisedCoprime, ..Default::default() }).unwrap();
    assert!(full.hankel.iter().all(|sigma| *sigma < 1.0), "{:?}", full.hankel);
    for order in 0..=full.minimal_order.min(n) {
        let reduced = reduce(system, &fixed(ReductionMethod::NormalisedCoprime, order)).unwrap();
        assert_eq!(reduced.model.order(), order);
        let (measured, bound) = (reduced.measured_factor_error().unwrap().unwrap(), reduced.error_bound.unwrap());
        assert!(measured.value <= bound + 1e-10, "{order}: {measured:?} {bound}");
        // Both figures are at least the directed gap at any frequency: a least-squares distance of the two graphs.
        let gap = pointwise_gap(system, &reduced.model);
        assert!(gap <= measured.upper + 1e-9, "{order}: {gap} {measured:?}");
    }
}

/// Largest distance of the graphs of two systems over frequency, of each point of the one graph to the other.
fn pointwise_gap<T: TimeDomain>(x: &StateSpace<T>, y: &StateSpace<T>) -> f64 {
    let omega = if x.time().sample_time().is_some() { LINEAR() } else { LOGARITHMIC() };
    let graph = |s: &StateSpace<T>| frequency_response(&normalised_right_factors(s).unwrap(), &omega).unwrap();
    let (x, y) = (graph(x), graph(y));
    x.iter().zip(y.iter()).map(|(x, y)| (x - y * (y.adjoint() * x)).singular_values().unwrap()[0]).fold(0.0, f64::max)
}

#[test]
fn normalised_factors_stay_within_their_bound() {
    let mut rng = ChaCha8Rng::seed_from_u64(44);
    for n in [1, 3, 6] {
        check_normalised(&random_unstable(n, Continuous, &mut rng));
        check_normalised(&random_unstable(n, Discrete::new(1.0).unwrap(), &mut rng));
    }
    // An integrator beside a stable part.
    let a = Mat::from_fn(3, 3, |i, j| if i == j { [0.0, -1.0, -30.0][i] } else { 0.0 });
    let b = Mat::from_fn(3, 2, |i, j| [[1.0, 0.5], [1.0, -1.0], [3.0, 1.0]][i][j]);
    let integrating = StateSpace::new(a, b.clone(), b.transpose().to_owned(), Mat::zeros(2, 2), Continuous).unwrap();
    check_normalised(&integrating);
    check_normalised(&integrating.zoh(Discrete::new(0.1).unwrap()).unwrap());
    // The integrator by a split: it stays, the rest is reduced.
    let options =
        ReductionOptions { stability_boundary: Some(0.0), order: ReducedOrder::Fixed(2), ..Default::default() };
    let reduced = reduce(&integrating, &options).unwrap();
    assert_eq!(reduced.kept, [c64::new(0.0, 0.0)]);
    assert!(reduced.measured_error().unwrap().value <= reduced.error_bound.unwrap() * (1.0 + 1e-9));
    let refused = ReductionOptions { method: ReductionMethod::NormalisedCoprime, ..options };
    assert!(matches!(reduce(&integrating, &refused), Err(Error::OutOfRange { .. })));
}

fn unit<T: TimeDomain>(size: usize, time: T) -> StateSpace<T> {
    StateSpace::gain(eye(size), time).unwrap()
}

fn check_unit_weights<T: TimeDomain>(system: &StateSpace<T>, omega: &[f64]) {
    let weights = FrequencyWeights { output: unit(3, system.time()), input: unit(2, system.time()) };
    for order in 0..=system.order() {
        let plain = reduce(system, &fixed(ReductionMethod::BalancedTruncation, order)).unwrap();
        let weighted = reduce_weighted(system, &weights, &fixed(ReductionMethod::Weighted, order)).unwrap();
        assert!((weighted.error_bound.is_none(), weighted.unstable_pole) == (true, None));
        for (x, y) in plain.hankel.iter().zip(&weighted.hankel) {
            assert!((x - y).abs() < 1e-10 * plain.hankel[0], "{x} {y}");
        }
        assert!(error(&plain.model, &weighted.model, omega) < 1e-9 * plain.hankel[0]);
    }
}

#[test]
fn unit_weights_change_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(45);
    check_unit_weights(&random_stable(6, Continuous, &mut rng), &LOGARITHMIC());
    check_unit_weights(&random_stable(6, Discrete::new(1.0).unwrap(), &mut rng), &LINEAR());
}

/// A weight that passes one frequency band only: the weighted error of the weighted reduction is smaller there.
#[test]
fn weights_lower_the_error_where_they_count() {
    let system = bearing();
    let (zero, one) = (Mat::zeros(1, 1), eye(1));
    let slow = StateSpace::new(Scale(-60.0) * &one, one.clone(), Scale(60.0) * &one, zero, Continuous).unwrap();
    let output = slow.append(&slow).unwrap();
    let weights = FrequencyWeights { output: output.clone(), input: unit(2, Continuous) };
    let plain = reduce(&system, &fixed(ReductionMethod::BalancedTruncation, 3)).unwrap();
    let weighted = reduce_weighted(&system, &weights, &fixed(ReductionMethod::Weighted, 3)).unwrap();
    let of = |model: &StateSpace<Continuous>| {
        let difference = system.plus(&model.negated()).unwrap().then(&output).unwrap();
        linf_norm(&difference, &PeakOptions::default()).unwrap().value
    };
    assert!(of(&weighted.model) < 0.7 * of(&plain.model), "{} {}", of(&weighted.model), of(&plain.model));
    let bound = ReductionOptions { order: ReducedOrder::Bound(0.1), ..Default::default() };
    assert!(matches!(reduce_weighted(&system, &weights, &bound), Err(Error::Unsupported { .. })));
    let unstable = FrequencyWeights {
        output: weights.output,
        input: random_unstable(9, Continuous, &mut ChaCha8Rng::seed_from_u64(46)),
    };
    let refusal = reduce_weighted(&system, &unstable, &ReductionOptions::default());
    assert!(matches!(refusal, Err(Error::Unstable { .. })), "{refusal:?}");
}

#[test]
fn scales_are_units() {
    let mut rng = ChaCha8Rng::seed_from_u64(47);
    let system = random_unstable(6, Continuous, &mut rng);
    let (outputs, inputs) = ([3.0, 0.2, 10.0], [0.5, 7.0]);
    let diagonal = |v: &[f64]| Mat::from_fn(v.len(), v.len(), |i, j| if i == j { v[i] } else { 0.0 });
    let scaled = system.map_output(&diagonal(&outputs.map(|s| 1.0 / s))).map_input(&diagonal(&inputs));
    for method in [ReductionMethod::BalancedTruncation, ReductionMethod::NormalisedCoprime] {
        let boundary = (method == ReductionMethod::BalancedTruncation).then_some(0.0);
        let plain = ReductionOptions { stability_boundary: boundary, ..fixed(method, 5) };
        let given = ReductionOptions {
            output_scale: Some(outputs.to_vec()),
            input_scale: Some(inputs.to_vec()),
            ..plain.clone()
        };
        let (found, exact) = (reduce(&system, &given).unwrap(), reduce(&scaled, &plain).unwrap());
        assert!(found.hankel.iter().zip(&exact.hankel).all(|(x, y)| (x - y).abs() < 1e-10 * exact.hankel[0]));
        let back = exact.model.map_output(&diagonal(&outputs)).map_input(&diagonal(&inputs.map(|s| 1.0 / s)));
        let size = error(&back, &StateSpace::gain(Mat::zeros(3, 2), Continuous).unwrap(), &LOGARITHMIC());
        assert!(error(&found.model, &back, &LOGARITHMIC()) < 1e-9 * size);
    }
    let short = ReductionOptions { output_scale: Some(vec![1.0]), ..Default::default() };
    assert!(matches!(reduce(&system, &short), Err(Error::Ports { expected: 3, found: 1, .. })));
    let zero = ReductionOptions { input_scale: Some(vec![1.0, 0.0]), ..Default::default() };
    assert!(matches!(reduce(&system, &zero), Err(Error::OutOfRange { .. })));
}
