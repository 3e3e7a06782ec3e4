//! Residual levels on seeded problems that are large enough for the blocked methods: Schur forms of random, clustered, cyclic
//! and Jordan matrices up to n = 150; linear equations up to n = 90, among them Lyapunov equations with a mode 1e-8 from the
//! boundary; Riccati equations at n = 40, among them some with such a mode almost out of reach. They are some of the classes of
//! `benches/matrix_equations.rs`, where SciPy and SLICOT solve the same problems.

use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

fn normal(rng: &mut ChaCha8Rng, rows: usize, columns: usize) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| rng.sample(StandardNormal))
}

/// Eigenvalues over the unit disc.
fn disc(rng: &mut ChaCha8Rng, n: usize) -> Mat<f64> {
    normal(rng, n, n) * Scale(1.0 / (n as f64).sqrt())
}

fn orthogonal(rng: &mut ChaCha8Rng, n: usize) -> Mat<f64> {
    normal(rng, n, n).qr().compute_thin_Q()
}

/// Schur form and reordered form: similar, orthogonal, quasi-triangular, ordered.
fn check_schur(a: &Mat<f64>) {
    let n = a.nrows();
    let schur = real_schur("A", a.as_ref()).unwrap();
    assert!(schur.residual < 3e-14, "n = {n}: {}", schur.residual);
    assert!((schur.q.transpose() * &schur.q - eye(n)).norm_l2() < 1e-14 * n as f64);
    let below = |t: &Mat<f64>| (0..n).any(|j| (j + 2..n).any(|i| t[(i, j)] != 0.0));
    assert!(!below(&schur.t));
    let ordered = schur.reorder(|p| p.re < 0.0).unwrap();
    let (q, t) = (&ordered.q, &ordered.t);
    assert!((q * t * q.transpose() - a).norm_l2() < 1e-13 * a.norm_l2());
    assert!(!below(t));
    assert!(ordered.eigenvalues().iter().enumerate().all(|(k, p)| (p.re < 0.0) == (k < ordered.dimension)));
}

#[test]
fn large_schur_forms_hold() {
    let rng = &mut ChaCha8Rng::seed_from_u64(31);
    for n in [63, 64, 100, 150] {
        check_schur(&disc(rng, n));
    }
    // Clusters: a few eigenvalues many times over, in any coordinates, and with a coupling above the diagonal.
    for coupling in [0.0, 1e-3, 1.0] {
        let upper = Mat::from_fn(120, 120, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Equal => [0.9, -0.5, 0.9 + 1e-9][i % 3],
            std::cmp::Ordering::Less => coupling * rng.sample::<f64, _>(StandardNormal) / 120.0,
            std::cmp::Ordering::Greater => 0.0,
        });
        let u = orthogonal(rng, 120);
        let a = &u * upper * u.transpose();
        let schur = real_schur("A", a.as_ref()).unwrap();
        assert!(schur.residual < 3e-14, "coupling {coupling}: {}", schur.residual);
    }
    let cyclic = Mat::from_fn(120, 120, |i, j| f64::from(u8::from(i == (j + 1) % 120)));
    let jordan = Mat::from_fn(120, 120, |i, j| if i == j || i == j + 1 { 1.0 } else { 0.0 });
    for a in [cyclic, jordan, eye(120), Mat::zeros(120, 120)] {
        assert!(real_schur("A", a.as_ref()).unwrap().residual < 3e-14);
    }
}

#[test]
fn large_linear_equations_hold() {
    let rng = &mut ChaCha8Rng::seed_from_u64(32);
    for n in [40, 90] {
        let (a, outputs) = (disc(rng, n), normal(rng, 4, n));
        let q = outputs.transpose() * &outputs;
        assert!(lyapunov((&a - 1.2 * eye(n)).as_ref(), q.as_ref()).unwrap().residual < 1e-15);
        assert!(discrete_lyapunov((0.9 * &a).as_ref(), q.as_ref()).unwrap().residual < 1e-15);
        for m in [5, 70] {
            let (b, c) = (disc(rng, m) + 3.0 * eye(m), normal(rng, n, m));
            let found = sylvester("X", a.as_ref(), b.as_ref(), c.as_ref()).unwrap();
            assert!(found.relative_residual < 1e-14, "{}", found.relative_residual);
            let found = discrete_sylvester("X", a.as_ref(), (0.2 * &b).as_ref(), c.as_ref()).unwrap();
            assert!(found.relative_residual < 1e-14, "{}", found.relative_residual);
        }
        // The rightmost eigenvalue at a distance of 1e-8 from the boundary.
        let rightmost = eigenvalues("A", a.as_ref()).unwrap().iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max);
        let near = &a - (rightmost + 1e-8) * eye(n);
        assert!(lyapunov(near.as_ref(), q.as_ref()).unwrap().residual < 1e-15);
    }
}

#[test]
fn large_riccati_equations_hold() {
    let rng = &mut ChaCha8Rng::seed_from_u64(33);
    let n = 40;
    // The size of the class, and the mode and its reach of the hard ones, continuous and discrete.
    for (class, modes, reach) in [("random", None, 1.0), ("boundary", Some([-1e-8, 1.0 - 1e-8]), 1e-4)] {
        let (mut a, mut b, outputs) = (disc(rng, n), normal(rng, n, 4), normal(rng, 4, n));
        let q = outputs.transpose() * &outputs;
        let r = eye(4);
        (0..4).for_each(|j| b[(0, j)] *= reach);
        let u = orthogonal(rng, n);
        for discrete in [false, true] {
            if let Some(modes) = modes {
                (0..n).for_each(|j| a[(0, j)] = if j == 0 { modes[usize::from(discrete)] } else { 0.0 });
            }
            let (a, b) = (&u * &a * u.transpose(), &u * &b);
            let problem = RiccatiProblem { a: a.as_ref(), b: b.as_ref(), q: q.as_ref(), r: r.as_ref(), s: None };
            let solution = if discrete { dare("X", &problem) } else { care("X", &problem) }.unwrap();
            assert!(solution.relative_residual < 1e-11, "{class}: {}", solution.relative_residual);
        }
    }
}
