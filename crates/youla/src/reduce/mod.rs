//! Model reduction of stable systems with a bound on the error, eq. (29): balanced truncation and singular perturbation
//! approximation.
//!
//! With the Gramians P and Q of a stable system, the Hankel singular values `sigma_1 >= sigma_2 >= ...` are the square
//! roots of the eigenvalues of P Q. Both methods keep the r strongest states and satisfy
//! ```text
//! max over omega of || G(omega) - G_r(omega) ||  <=  2 (sigma_(r+1) + ... + sigma_n)
//! ```
//! (D. F. Enns, 1984; K. Glover, 1984; Y. Liu and B. D. O. Anderson, Int. J. Control 50 (1989), 1379). Truncation is exact
//! at infinite frequency (continuous time), singular perturbation at frequency zero.
//!
//! Scaling. Hankel singular values compare outputs with each other and inputs with each other in their units, so express
//! channels in units in which equal numbers matter equally (for instance the largest admissible displacement and voltage)
//! before reducing. The coordinates of the state do not matter.

mod balanced;
#[cfg(test)]
mod reference;

use crate::linalg::solve;
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use balanced::HankelDecomposition;
use faer::prelude::*;
use faer::{Mat, c64};
use serde::{Deserialize, Serialize};

/// What happens to the states that are not kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReductionMethod {
    /// They are dropped (B. C. Moore, IEEE Trans. Autom. Control 26 (1981), 17).
    #[default]
    BalancedTruncation,
    /// They follow without delay, `dx/dt = 0` or `x(k+1) = x(k)`, which keeps the static gain.
    SingularPerturbation,
}

impl std::fmt::Display for ReductionMethod {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            ReductionMethod::BalancedTruncation => "balanced truncation",
            ReductionMethod::SingularPerturbation => "singular-perturbation approximation",
        })
    }
}

/// How many states are kept.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReducedOrder {
    /// All that are controllable and observable to working precision: removes exact cancellations only.
    #[default]
    Minimal,
    /// This number.
    Fixed(usize),
    /// The fewest for which the error bound does not exceed this value, in output units per input unit.
    Bound(f64),
}

/// Choices of [`reduce`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReductionOptions {
    /// Truncation or singular perturbation.
    pub method: ReductionMethod,
    /// Number of states that are kept.
    pub order: ReducedOrder,
    /// States whose Hankel singular value is below this fraction of the largest count as not minimal.
    pub minimality: f64,
}

impl Default for ReductionOptions {
    fn default() -> Self {
        ReductionOptions { method: ReductionMethod::default(), order: ReducedOrder::default(), minimality: 1e-12 }
    }
}

/// A reduced model and what its reduction cost.
#[derive(Debug, Clone)]
pub struct Reduction<T: TimeDomain> {
    /// The reduced model, of order r.
    pub model: StateSpace<T>,
    /// Hankel singular values of the given system, n values in descending order.
    pub hankel: Vec<f64>,
    /// Twice the sum of the Hankel singular values from number r + 1 on: bound of the largest singular value of the error
    /// over all frequencies.
    pub error_bound: f64,
    /// Number of Hankel singular values above the fraction `minimality` of the largest.
    pub minimal_order: usize,
    /// The method that was used.
    pub method: ReductionMethod,
}

/// Reduces a stable system (n states) to order r.
///
/// The Gramian factors come from Hammarling's method and are never squared; the projections are balancing-free (A. Varga,
/// Efficient minimal realization procedure based on balancing, 1991), so that exact cancellations do no harm. The bound
/// holds (test `error_stays_below_its_bound`); the published examples are met to their printed digits (`reference`).
///
/// # Errors
/// [`Error::Unstable`] with the pole: nothing is split off or reflected silently. [`Error::OrderAboveMinimal`] where more
/// states are asked for than the system has in minimal form. [`Error::OutOfRange`] for a bound or a fraction that is
/// negative or NaN.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace}};
/// use youla::reduce::{ReducedOrder, ReductionOptions, reduce};
/// let a = Mat::from_fn(2, 2, |i, j| if i == j { [-1.0, -100.0][i] } else { 0.0 });
/// let system = StateSpace::new(a, eye(2), eye(2), Mat::zeros(2, 2), Continuous)?;
/// let reduced = reduce(&system, &ReductionOptions { order: ReducedOrder::Fixed(1), ..Default::default() })?;
/// assert_eq!(reduced.model.order(), 1);
/// assert!((reduced.error_bound - 0.01).abs() < 1e-12);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn reduce<T: TimeDomain>(system: &StateSpace<T>, options: &ReductionOptions) -> Result<Reduction<T>> {
    check(options)?;
    system.require_stable("the system to be reduced")?;
    reduce_in_coordinates(&system.balanced()?, options)
}

/// The reduction of a stable system in the state coordinates in which it is given: the bases of the reduced model are
/// orthonormal in them, and a state that is badly scaled would cost digits.
fn reduce_in_coordinates<T: TimeDomain>(system: &StateSpace<T>, options: &ReductionOptions) -> Result<Reduction<T>> {
    let decomposition = HankelDecomposition::new(system)?;
    let hankel = &decomposition.hankel;
    let minimal_order = minimal_order(hankel, options.minimality);
    let order = choose_order(hankel, minimal_order, options.order)?;
    let model = match options.method {
        ReductionMethod::BalancedTruncation => decomposition.project(&[order])?,
        ReductionMethod::SingularPerturbation => {
            residualise(&decomposition.project(&[order, minimal_order - order])?, order)?
        }
    };
    model.require_stable("the reduced model (the order may split equal Hankel singular values)")?;
    let error_bound = 2.0 * hankel[order..].iter().sum::<f64>();
    Ok(Reduction { model, error_bound, minimal_order, method: options.method, hankel: decomposition.hankel })
}

/// Hankel singular values of a stable system, n values in descending order.
///
/// # Errors
/// [`Error::Unstable`] with the pole; [`Error::NoConvergence`].
pub fn hankel_singular_values<T: TimeDomain>(system: &StateSpace<T>) -> Result<Vec<f64>> {
    system.require_stable("the system")?;
    Ok(HankelDecomposition::new(&system.balanced()?)?.hankel)
}

fn check(options: &ReductionOptions) -> Result<()> {
    let refuse = |what: &str, value| Err(Error::OutOfRange { what: what.into(), value, must: "zero or positive" });
    match options.order {
        ReducedOrder::Bound(bound) if bound.is_nan() || bound < 0.0 => refuse("the error bound", bound),
        _ if options.minimality.is_nan() || options.minimality < 0.0 => {
            refuse("the relative size of negligible Hankel singular values", options.minimality)
        }
        _ => Ok(()),
    }
}

fn minimal_order(hankel: &[f64], fraction: f64) -> usize {
    let largest = hankel.first().copied().unwrap_or(0.0);
    hankel.iter().take_while(|s| **s > fraction * largest).count()
}

fn choose_order(hankel: &[f64], minimal: usize, choice: ReducedOrder) -> Result<usize> {
    match choice {
        ReducedOrder::Minimal => Ok(minimal),
        ReducedOrder::Fixed(order) if order > minimal => Err(Error::OrderAboveMinimal { order, minimal }),
        ReducedOrder::Fixed(order) => Ok(order),
        ReducedOrder::Bound(bound) => {
            let tail = |order: usize| 2.0 * hankel[order..].iter().sum::<f64>();
            Ok((0..minimal).find(|order| tail(*order) <= bound).unwrap_or(minimal))
        }
    }
}

/// Replaces the states from number `order` on by their equilibrium at frequency zero: with `s0 = 0` or `z0 = 1`,
/// `A_r = A11 + A12 (s0 I - A22)^-1 A21` and so on.
fn residualise<T: TimeDomain>(system: &StateSpace<T>, order: usize) -> Result<StateSpace<T>> {
    let fast = system.order() - order;
    let c64 { re: still, .. } = system.time().boundary(0.0);
    let (a, b, c, d) = (system.a(), system.b(), system.c(), system.d());
    let distance = Scale(still) * Mat::<f64>::identity(fast, fast) - a.submatrix(order, order, fast, fast);
    let solve = |rhs| solve("the fast part of the system at frequency zero", distance.as_ref(), rhs);
    let (by_state, by_input) = (solve(a.submatrix(order, 0, fast, order))?, solve(b.subrows(order, fast))?);
    let (to_state, to_output) = (a.submatrix(0, order, order, fast), c.subcols(order, fast));
    StateSpace::new(
        a.submatrix(0, 0, order, order) + to_state * &by_state,
        b.subrows(0, order) + to_state * &by_input,
        c.subcols(0, order) + to_output * &by_state,
        d + to_output * &by_input,
        system.time(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{block, block_diagonal};
    use crate::lti::{Continuous, Discrete, bearing, frequency_response};
    use faer::MatRef;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const METHODS: [ReductionMethod; 2] = [ReductionMethod::BalancedTruncation, ReductionMethod::SingularPerturbation];

    fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
    }

    fn random_stable<T: TimeDomain>(n: usize, time: T, rng: &mut ChaCha8Rng) -> StateSpace<T> {
        let a = random(n, n, rng);
        let size = a.norm_l2();
        let a = match time.sample_time() {
            Some(_) => Scale(0.95 / size) * a,
            None => a - Scale(1.05 * size) * Mat::<f64>::identity(n, n),
        };
        StateSpace::new(a, random(n, 2, rng), random(3, n, rng), random(3, 2, rng), time).unwrap()
    }

    /// Largest singular value of the difference over 200 frequencies.
    fn error<T: TimeDomain>(left: &StateSpace<T>, right: &StateSpace<T>, omega: &[f64]) -> f64 {
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
                assert!(found <= reduced.error_bound + rounding, "{method:?} {order}: {found} {}", reduced.error_bound);
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
        assert!(matches!(reduce(&system, &options), Err(Error::OrderAboveMinimal { order: 7, minimal: 6 })));
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
        assert_eq!((reduced.model.order(), reduced.error_bound), (0, 0.0));
        let zero: MatRef<'_, f64> = still.d();
        let silent = StateSpace::new(-zero, Mat::zeros(2, 2), zero.to_owned(), zero.to_owned(), Continuous).unwrap();
        assert_eq!(reduce(&silent, &ReductionOptions::default()).unwrap().minimal_order, 0);
    }

    #[test]
    fn options_read_as_they_are_written() {
        let options: ReductionOptions =
            toml::from_str("method = \"singular-perturbation\"\norder = { fixed = 6 }").unwrap();
        assert_eq!(options.order, ReducedOrder::Fixed(6));
        assert_eq!(options.method, ReductionMethod::SingularPerturbation);
        assert!(toml::from_str::<ReductionOptions>("methode = 1").is_err());
    }
}
