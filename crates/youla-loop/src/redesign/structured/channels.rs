//! The controller of each channel by itself, with the states that it needs.

use crate::error::Result;
use faer::Scale;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// A direction that is this small, relative to the vector that it is left of, is rounding. Chosen, not measured.
const ROUNDING: f64 = 1e-9;

/// Whether an output of the plant acts on another of its inputs than its own.
pub(super) fn couples(k: &StateSpace<Discrete>) -> Result<bool> {
    let m = k.outputs();
    for (i, j) in (0..m * m).map(|at| (at / m, at % m)).filter(|(i, j)| i != j) {
        if !entry(k, i, j)?.is_zero() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The diagonal of a controller that couples nothing; one channel as it is.
pub(super) fn each(k: &StateSpace<Discrete>) -> Result<Vec<StateSpace<Discrete>>> {
    let all = k.outputs();
    if all == 1 { Ok(vec![k.clone()]) } else { (0..all).map(|i| entry(k, i, i)).collect() }
}

/// An entry with the states that its input reaches and its output shows (R. E. Kalman, Mathematical description of linear dynamical
/// systems, SIAM Journal on Control 1 (1963), 152): the poles of the other channels are none of its own.
fn entry(k: &StateSpace<Discrete>, i: usize, j: usize) -> Result<StateSpace<Discrete>> {
    let whole = k.part(i..i + 1, j..j + 1);
    let reached = within(&whole, &krylov(whole.a(), whole.b(), whole.b().norm_l2()))?;
    let shown = krylov(reached.a().transpose(), reached.c().transpose(), whole.c().norm_l2());
    within(&reached, &shown)
}

/// An orthonormal basis of the columns of `b, A b, A^2 b, ..` (W. E. Arnoldi, Quarterly of Applied Mathematics 9 (1951), 17), each direction
/// freed twice of those before it; `size` is that of a b which is not rounding.
fn krylov(a: MatRef<'_, f64>, b: MatRef<'_, f64>, mut size: f64) -> Mat<f64> {
    let mut basis: Mat<f64> = Mat::zeros(a.nrows(), 0);
    let mut next = b.to_owned();
    while basis.ncols() < a.nrows() {
        for _ in 0..2 {
            next = &next - &basis * (basis.transpose() * &next);
        }
        let left = next.norm_l2();
        if left <= ROUNDING * size {
            break;
        }
        next *= Scale(1.0 / left);
        basis.resize_with(a.nrows(), basis.ncols() + 1, |i, _| next[(i, 0)]);
        next = a * &next;
        size = next.norm_l2();
    }
    basis
}

/// The system in the coordinates of an orthonormal basis of states that contains all that matter.
fn within(system: &StateSpace<Discrete>, basis: &Mat<f64>) -> Result<StateSpace<Discrete>> {
    let turned = basis.transpose();
    let (a, b, c) = (turned * system.a() * basis, turned * system.b(), system.c() * basis);
    Ok(StateSpace::new(a, b, c, system.d().to_owned(), system.time())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two loops in coordinates that mix their states: each has its own poles and its own response, and a controller with a path between
    /// them couples.
    #[test]
    fn the_loops_of_a_controller_are_found_in_any_coordinates() {
        let time = Discrete::new(1e-3).unwrap();
        let of = |b: &[f64], a: &[f64]| {
            StateSpace::difference_equation(&vec![vec![b.to_vec()]], &vec![vec![a.to_vec()]], time).unwrap()
        };
        let apart = [of(&[0.8, -0.7], &[1.0, -1.0]), of(&[2.0, 0.1, 0.3], &[1.0, -1.5, 0.5])];
        let whole = super::super::pid::diagonal(&apart).unwrap();
        let mix = Mat::from_fn(3, 3, |i, j| [[1.0, 0.4, -2.0], [0.3, 1.0, 0.5], [0.9, -0.2, 1.0]][i][j]);
        let back = youla::linalg::solve("mix", mix.as_ref(), youla::linalg::eye(3).as_ref()).unwrap();
        let (a, b, c) = (&mix * whole.a() * &back, &mix * whole.b(), whole.c() * &back);
        let mixed = StateSpace::new(a, b, c, whole.d().to_owned(), time).unwrap();
        assert!(!couples(&mixed).unwrap());
        for (own, found) in apart.iter().zip(each(&mixed).unwrap()) {
            assert_eq!(found.order(), own.order());
            let omega = [3.0, 70.0, 2000.0];
            let [a, b] = [own, &found].map(|s| youla::lti::frequency_response(s, &omega).unwrap().entry(0, 0));
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).norm() < 1e-9 * a.norm()), "{a:?} {b:?}");
        }
        let crossed = StateSpace::new(
            mixed.a().to_owned(),
            mixed.b().to_owned(),
            mixed.c().to_owned(),
            Mat::from_fn(2, 2, |i, j| f64::from(i == 0 && j == 1) * 0.1),
            time,
        );
        assert!(couples(&crossed.unwrap()).unwrap());
    }
}
