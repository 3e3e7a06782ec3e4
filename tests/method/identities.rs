//! The identities of the doubly coprime factors and of the Youla parametrisation, eqs (13)-(24), each as a number. What the
//! paper says of its bearing in particular is in `paper.rs`.
//!
//! Tolerances: 1e-12 relative for the bearing (continuous and at 5 kHz, states balanced), 1e-9 for random non-square and
//! unstable plants. Where a random plant is so close to one that nothing stabilises (an unstable pole beside a zero) that
//! its factors have a condition number k = ||right|| ||left|| above 1e4, the tolerance is 1e-13 k. Negative controls show
//! that a wrong sign cannot pass.

use crate::common::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use youla::Mat;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr, observer_controller, with_input_port};
use youla::factor::CoprimeFactors;
use youla::lti::{Continuous, Discrete, Partitioned, StateSpace, TimeDomain};

const BEARING: f64 = 1e-12;
const RANDOM: f64 = 1e-9;

/// One nominal plant with its observer-based factors, and how exactly they must hold.
struct Loop<T: TimeDomain> {
    name: String,
    nominal: StateSpace<T>,
    f: Mat<f64>,
    l: Mat<f64>,
    factors: CoprimeFactors<T>,
    omega: Vec<f64>,
    tolerance: f64,
}

impl<T: TimeDomain> Loop<T> {
    fn new(name: impl Into<String>, nominal: StateSpace<T>, centre: f64, tolerance: f64) -> Self {
        let (f, l) = gains(&nominal);
        let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
        let omega = grid_of(nominal.time(), centre);
        Loop { name: name.into(), nominal, f, l, factors, omega, tolerance }
    }

    fn random(seed: u64, time: T) -> Self {
        let mut rng = rng(seed);
        let shape = (rng.random_range(1..=20), rng.random_range(1..=3), rng.random_range(1..=3));
        let instability = rng.random_range(-0.2..0.2);
        let nominal = random_system(&mut rng, shape, instability, time);
        let drawn = Self::new(format!("random {shape:?}, {time:?}, seed {seed}"), nominal, 1.0, RANDOM);
        let condition = largest(drawn.factors.right().system(), &drawn.omega)
            * largest(drawn.factors.left().system(), &drawn.omega);
        Loop { tolerance: RANDOM * (1e-4 * condition).max(1.0), ..drawn }
    }

    fn holds(&self, what: &str, error: f64) {
        assert!(error <= self.tolerance, "{}: {what} misses by {error:.1e}", self.name);
    }

    fn same(&self, what: &str, x: &StateSpace<T>, y: &StateSpace<T>) {
        self.holds(what, distance(x, y, &self.omega));
    }

    /// A random stable S with feedthrough, small enough that the loop with S stays well posed.
    fn deviation(&self, rng: &mut ChaCha8Rng, order: usize) -> StateSpace<T> {
        random_stable(rng, (order, self.nominal.inputs(), self.nominal.outputs()), self.nominal.time())
    }
}

/// Runs a check on the bearing (stable and unstable, continuous and sampled).
fn on_bearing(check: impl Fn(&Loop<Continuous>), check_sampled: impl Fn(&Loop<Discrete>)) {
    for (cross_coupling, label) in [(0.0, "stable bearing"), (0.25, "unstable bearing")] {
        let plant = bearing(cross_coupling);
        check_sampled(&Loop::new(format!("{label}, 5 kHz"), sampled(&plant), 1300.0, BEARING));
        check(&Loop::new(label, plant, 1300.0, BEARING));
    }
}

fn factor_identities<T: TimeDomain>(l: &Loop<T>) {
    l.holds("(15) Bezout in both orders", l.factors.bezout_residual(&l.omega).unwrap());
    let k = observer_controller(&l.nominal, l.f.as_ref(), l.l.as_ref()).unwrap();
    l.same("K of J_K against the observer-based controller", &k, &l.factors.controller().unwrap());
    let u_over_v = stack(&l.factors.v(), &l.factors.u());
    l.same("(14) K = U V^-1", &k, &right_quotient(&u_over_v, l.nominal.outputs()));
    let n_over_m = stack(&l.factors.m(), &l.factors.n());
    l.same("(13) G = N M^-1", &l.nominal, &right_quotient(&n_over_m, l.nominal.inputs()));
    let product = l.nominal.then(&l.factors.m_t()).unwrap();
    l.same("(13) Mt G = Nt", &product, &l.factors.n_t());
    let product = k.then(&l.factors.v_t()).unwrap();
    l.same("(14) Vt K = Ut", &product, &l.factors.u_t());
}

fn deviation_identities<T: TimeDomain>(l: &Loop<T>, rng: &mut ChaCha8Rng) {
    for order in [0, 1, 5] {
        let s = l.deviation(rng, order);
        let g = l.factors.plant_of(&s).unwrap();
        assert_eq!(g.order(), l.nominal.order() + order, "G(S) is one LFT of order n + n_S");
        l.same("(16) against (18)", &g, &l.factors.plant_of_right(&s).unwrap());
        l.same("(17) against (18)", &g, &l.factors.plant_of_left(&s).unwrap());
        let back = l.factors.deviation_of(&g).unwrap();
        l.same("S(G(S)) = S", &s, &back);
        l.same("G(S(G)) = G", &g, &l.factors.plant_of(&back).unwrap());
    }
}

fn arbitrary_controller<T: TimeDomain>(l: &Loop<T>, rng: &mut ChaCha8Rng) {
    // K(Q) for a random stable Q is a controller that is not observer-based for these F and L.
    let q = random_stable(rng, (3, l.nominal.outputs(), l.nominal.inputs()), l.nominal.time());
    let k = l.factors.controller_of(&q).unwrap();
    let shifted = l.factors.shifted_to(&k).unwrap();
    l.holds("(15) of shifted factors", shifted.bezout_residual(&l.omega).unwrap());
    l.same("K of shifted factors", &k, &shifted.controller().unwrap());
    let unit = |n: usize| Mat::<f64>::identity(n, n);
    let weights = youla::control::LqrWeights { q: unit(k.order()), r: unit(k.inputs()), s: None };
    let fk = youla::control::lqr(&k, &weights).unwrap().f;
    let stacked = CoprimeFactors::stacked(&l.nominal, &k, l.f.as_ref(), fk.as_ref()).unwrap();
    l.holds("(15) of stacked factors", stacked.bezout_residual(&l.omega).unwrap());
    l.same("K of stacked factors", &k, &stacked.controller().unwrap());
    let s = l.deviation(rng, 4);
    for factors in [&shifted, &stacked] {
        let g = factors.plant_of(&s).unwrap();
        l.same("(16) against (18), arbitrary K", &g, &factors.plant_of_right(&s).unwrap());
        l.same("(17) against (18), arbitrary K", &g, &factors.plant_of_left(&s).unwrap());
        l.same("S(G(S)) = S, arbitrary K", &s, &factors.deviation_of(&g).unwrap());
        assert!(
            closed_loop(&g, &with_input_port(&k).unwrap()).unwrap().is_stable().unwrap(),
            "K stabilises every G(S)"
        );
    }
}

fn primal_and_dual<T: TimeDomain>(l: &Loop<T>, rng: &mut ChaCha8Rng) {
    let (m, p) = (l.nominal.inputs(), l.nominal.outputs());
    let s = l.deviation(rng, 3);
    let q = random_stable(rng, (2, p, m), l.nominal.time());
    let (g, k) = (l.factors.plant_of(&s).unwrap(), l.factors.controller_of(&q).unwrap());
    let outer = closed_loop(&g, &with_input_port(&k).unwrap()).unwrap().poles().unwrap();
    let inner = closed_loop(&s, &with_input_port(&q).unwrap()).unwrap().poles().unwrap();
    let (right, left) = (l.factors.right().system().poles().unwrap(), l.factors.left().system().poles().unwrap());
    let scale = outer.iter().map(|p| p.norm()).fold(1.0, f64::max);
    let error = spectrum_distance(outer, [inner, right, left].concat()) / scale.min(1e4);
    assert!(error <= 1e-6, "{}: eig(G(S), K(Q)) misses by {error:.1e}", l.name);
}

#[test]
fn factors_of_the_bearing() {
    on_bearing(factor_identities, factor_identities);
}

#[test]
fn deviation_system_of_the_bearing() {
    on_bearing(|l| deviation_identities(l, &mut rng(1)), |l| deviation_identities(l, &mut rng(2)));
}

#[test]
fn any_controller_of_the_bearing() {
    on_bearing(|l| arbitrary_controller(l, &mut rng(3)), |l| arbitrary_controller(l, &mut rng(4)));
}

#[test]
fn primal_and_dual_parametrisation_of_the_bearing() {
    on_bearing(|l| primal_and_dual(l, &mut rng(5)), |l| primal_and_dual(l, &mut rng(6)));
}

/// 1000 random loops in both tests together: orders to 20, 1 to 3 inputs and outputs, D != 0, half of them about unstable.
#[test]
fn every_identity_on_500_random_continuous_loops() {
    (0..500).for_each(|seed| every_identity(seed, Continuous));
}

#[test]
fn every_identity_on_500_random_discrete_loops() {
    let time = Discrete::new(0.1).unwrap();
    (0..500).for_each(|seed| every_identity(seed, time));
}

fn every_identity<T: TimeDomain>(seed: u64, time: T) {
    let (l, mut rng) = (Loop::random(seed, time), rng(seed + 10_000));
    factor_identities(&l);
    check_star_product(&l.name, &l.factors, &l.omega, l.tolerance);
    deviation_identities(&l, &mut rng);
    arbitrary_controller(&l, &mut rng);
    primal_and_dual(&l, &mut rng);
}

/// An excitation v1 at the plant input and v2 at the output give alpha = Vt v1 + Ut v2, free of noise.
#[test]
fn external_excitation_reaches_alpha() {
    let plant = sampled(&bearing(0.0));
    let nominal = sampled(&youla_twin::rig::degraded(&bearing(0.0), 0.5, 1.0).unwrap());
    let factors = stabilising_factors(&plant, &nominal);
    let mut rng = rng(8);
    let (v1, v2, noise) = (normal(&mut rng, 3000, 2), normal(&mut rng, 3000, 2), normal(&mut rng, 3000, 2));
    let controller = with_input_port(&factors.controller().unwrap()).unwrap();
    let closed = closed_loop(&plant, &controller).unwrap();
    let at_output = &v2 + &noise;
    let z = run(&closed, beside(&v1, &at_output).as_ref());
    let measured = z.subcols(2, 2) - &v2;
    let alpha = factors.signals(z.subcols(0, 2), measured.as_ref()).unwrap().alpha().to_owned();
    let expected = factors.alpha_of_excitation(v1.as_ref(), v2.as_ref()).unwrap();
    let error = relative(alpha.as_ref(), expected.as_ref());
    assert!(error <= BEARING, "alpha of the excitation misses by {error:.1e}");
}

/// Negative controls on the bearing at 5 kHz (velocities in 1340 um/s, LQR weights diag(1, 1, 10, 10, 0, 0) and 1, unit
/// process noise, output noise 0.01): the sign of negative feedback in Ut makes (15) fail by 2 ||[M; N] Ut||, about 16.
#[test]
fn a_wrong_sign_fails_loudly() {
    let nominal = youla_twin::rig::Bearing::default().plant().unwrap();
    let nominal = sampled(&nominal.with_scaled_states(&[1.0, 1.0, 1340.0, 1340.0, 1.0, 1.0]));
    let (m, p) = (nominal.inputs(), nominal.outputs());
    let one = |k: usize| Mat::<f64>::identity(k, k);
    let q = Mat::from_fn(6, 6, |i, j| if i == j { [1.0, 1.0, 10.0, 10.0, 0.0, 0.0][i] } else { 0.0 });
    let f = lqr(&nominal, &LqrWeights { q, r: one(m), s: None }).unwrap().f;
    let noise = NoiseCovariance { process: one(6), measurement: one(p) * faer::Scale(0.01), cross: None };
    let l = kalman(&nominal, &noise).unwrap().l;
    let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
    let omega = grid_of(nominal.time(), 1300.0);
    let identity = StateSpace::gain(one(m + p), nominal.time()).unwrap();
    let (v_t, u_t, n_t, m_t) = (factors.v_t(), factors.u_t(), factors.n_t(), factors.m_t());
    let product = |u_t: &StateSpace<Discrete>| {
        let left = stack(&beside_systems(&v_t, u_t), &beside_systems(&n_t.negated(), &m_t));
        left.system().then(factors.right().system()).unwrap()
    };
    assert!(distance(&identity, &product(&u_t.negated()), &omega) < BEARING);
    let flipped = distance(&identity, &product(&u_t), &omega) * f64::from(4u8).sqrt();
    assert!(
        (12.0..20.0).contains(&flipped),
        "a flipped sign of the feedback misses (15) by {flipped}, not by about 16"
    );
}

/// A controller that does not stabilise the nominal plant is refused with the closed-loop pole, by both constructions.
#[test]
fn destabilising_controller_is_refused() {
    let l = Loop::new("bearing", sampled(&bearing(0.25)), 1300.0, BEARING);
    let zero = StateSpace::gain(Mat::zeros(2, 2), l.nominal.time()).unwrap();
    let none = Mat::zeros(2, 0);
    let stacked = CoprimeFactors::stacked(&l.nominal, &zero, l.f.as_ref(), none.as_ref());
    for refused in [stacked, l.factors.shifted_to(&zero)] {
        match refused {
            Err(youla::Error::NotStabilising { pole, .. }) => assert!((pole.norm() - 1.0084).abs() < 5e-4, "{pole}"),
            other => panic!("expected a refusal, got {other:?}"),
        }
    }
}

/// Largest Frobenius norm of a frequency response.
fn largest<T: TimeDomain>(s: &StateSpace<T>, omega: &[f64]) -> f64 {
    let response = youla::lti::frequency_response(s, omega).unwrap();
    (0..omega.len()).map(|k| response.at(k).norm_l2()).fold(0.0, f64::max)
}

/// `[x, y]` of two systems that share states and output matrix.
fn beside_systems<T: TimeDomain>(x: &StateSpace<T>, y: &StateSpace<T>) -> StateSpace<T> {
    let both = x.append(y).unwrap();
    both.map_output(&Mat::from_fn(x.outputs(), 2 * x.outputs(), |i, j| f64::from(j % x.outputs() == i)))
}

/// `[x; y]` of two systems with the same input.
fn stack<T: TimeDomain>(x: &StateSpace<T>, y: &StateSpace<T>) -> Partitioned<T> {
    let m = x.inputs();
    let system = x.append(y).unwrap().map_input(&Mat::from_fn(2 * m, m, |i, j| f64::from(i % m == j)));
    Partitioned::new(system, x.outputs(), m).unwrap()
}

/// Y X^-1 of `[X; Y]`.
fn right_quotient<T: TimeDomain>(stacked: &Partitioned<T>, inputs: usize) -> StateSpace<T> {
    assert_eq!(stacked.part(0, 0).inputs(), inputs);
    stacked.exchange_first().unwrap().part(1, 0)
}
