//! What the integration tests share: the bearing, random loops and distances between systems.
#![allow(dead_code)]

pub(crate) mod bearing_loop;
pub(crate) mod feedback;
#[path = "../../crates/youla/tests/all/common.rs"]
mod systems;

pub(crate) use systems::*;
use youla::control::{closed_loop, with_input_port};
use youla::factor::CoprimeFactors;
use youla::lti::{Continuous, Discrete, StateSpace, TimeDomain, frequency_response};
use youla::{Mat, MatRef, c64};
use youla_twin::rig::Bearing;

/// The bearing at 0 rpm, states balanced; `cross_coupling` adds a skew share of the stiffness (0.25 makes it unstable).
pub(crate) fn bearing(cross_coupling: f64) -> StateSpace<Continuous> {
    let mut b = Bearing::default();
    let k = cross_coupling * 1.8e6;
    b.stiffness[0][1] += k;
    b.stiffness[1][0] -= k;
    b.plant().unwrap().balanced().unwrap()
}

/// Angular frequencies over four decades around the given centre.
pub(crate) fn grid(centre: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| centre * 10f64.powf(-2.0 + 4.0 * k as f64 / (count - 1) as f64)).collect()
}

/// A frequency grid that suits the time domain: around 200 Hz for the bearing, up to Nyquist for discrete systems.
pub(crate) fn grid_of<T: TimeDomain>(time: T, centre: f64) -> Vec<f64> {
    match time.sample_time() {
        None => grid(centre, 60),
        Some(ts) => (1..60).map(|k| std::f64::consts::PI / ts * 10f64.powf(-3.0 + 3.0 * k as f64 / 60.0)).collect(),
    }
}

/// Largest distance of a value in `x` to the nearest unused one in `y`, relative to the larger of 1 and its magnitude.
pub(crate) fn spectrum_distance(mut x: Vec<c64>, mut y: Vec<c64>) -> f64 {
    assert_eq!(x.len(), y.len(), "the spectra differ in size");
    let mut worst = 0.0f64;
    while let Some(p) = x.pop() {
        let (index, d) =
            y.iter().enumerate().map(|(i, q)| (i, (p - q).norm())).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        worst = worst.max(d / p.norm().max(1.0));
        y.swap_remove(index);
    }
    worst
}

pub(crate) fn relative(x: MatRef<'_, f64>, y: MatRef<'_, f64>) -> f64 {
    (x - y).norm_l2() / y.norm_l2().max(1.0)
}

/// Factors of the nominal plant whose controller also stabilises the true plant.
pub(crate) fn stabilising_factors(
    plant: &StateSpace<Discrete>,
    nominal: &StateSpace<Discrete>,
) -> CoprimeFactors<Discrete> {
    let factors = observer_factors(nominal);
    let controller = with_input_port(&factors.controller().unwrap()).unwrap();
    assert!(closed_loop(plant, &controller).unwrap().is_stable().unwrap(), "the test loop is unstable");
    factors
}

pub(crate) fn beside(x: &Mat<f64>, y: &Mat<f64>) -> Mat<f64> {
    youla::linalg::block(&[&[x.as_ref(), y.as_ref()]])
}

/// (24): `J_G * J_K = [0 I; I 0]` from (epsilon, alpha) to (eta, beta), and the modes that this hides are those of the
/// factors. Rounding is relative to the product of the norms of `J_G` and `J_K` at each frequency.
pub(crate) fn check_star_product<T: TimeDomain>(
    name: &str,
    factors: &CoprimeFactors<T>,
    omega: &[f64],
    tolerance: f64,
) {
    let (j_g, j_k) = (factors.j_g().unwrap(), factors.j_k().unwrap());
    let star = j_g.star(&j_k).unwrap();
    let (m, p) = (factors.inputs(), factors.outputs());
    let swap = Mat::from_fn(m + p, m + p, |i, j| c64::new(f64::from(j == (i + p) % (m + p)), 0.0));
    let response = |s: &StateSpace<T>| frequency_response(s, omega).unwrap();
    let [found, j_g, j_k] = [star.system(), j_g.system(), j_k.system()].map(response);
    let relative = |k: usize| (found.at(k) - &swap).norm_l2() / (j_g.at(k).norm_l2() * j_k.at(k).norm_l2()).max(1.0);
    let error = (0..omega.len()).map(relative).fold(0.0, f64::max);
    assert!(error <= tolerance, "{name}: (24) J_G * J_K = [0 I; I 0] misses by {error:.1e}");
    let (right, left) = (factors.right().system().poles().unwrap(), factors.left().system().poles().unwrap());
    // Eigenvalues of a random matrix of order 40 are only as well conditioned as its eigenvectors.
    let error = spectrum_distance(star.system().poles().unwrap(), [right, left].concat());
    assert!(error <= 1e-6, "{name}: hidden modes of the star product miss by {error:.1e}");
}

/// A file or folder of the measured data: below `YOULA_DATA`, else below `../shared/data` beside the repository.
pub(crate) fn data(name: &str) -> std::path::PathBuf {
    let beside = || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let path = std::env::var_os("YOULA_DATA").map_or_else(beside, Into::into).join(name);
    assert!(path.exists(), "{} does not exist; set YOULA_DATA to the folder of the measured data", path.display());
    path
}
