//! The examples of SLICOT's SB08CD, SB08DD (left and right, inner denominator), SB08ED and SB08FD (left and right, prescribed
//! degree of stability -1): one plant of 7 states, 2 inputs and 3 outputs; examples/data and examples/results of
//! SLICOT-Reference (BSD-3), SB08CD from doc/SB08CD.html. Four decimals are printed. State coordinates are free but for an
//! orthogonal transformation, so that what does not depend on it is compared.

use super::*;
use crate::linalg::block;
use crate::lti::{Continuous, frequency_response};
use faer::MatRef;

pub(crate) fn example() -> StateSpace<Continuous> {
    let a = [
        [-0.04165, 0.0, 4.92, 0.492, 0.0, 0.0, 0.0],
        [-5.21, -12.5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 3.33, -3.33, 0.0, 0.0, 0.0, 0.0],
        [0.545, 0.0, 0.0, 0.0, 0.0545, 0.0, 0.0],
        [0.0, 0.0, 0.0, -0.492, 0.004165, 0.0, 4.92],
        [0.0, 0.0, 0.0, 0.0, 0.521, -12.5, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 3.33, -3.33],
    ];
    let b = Mat::from_fn(7, 2, |i, j| if i == [1, 5][j] { 12.5 } else { 0.0 });
    let c = Mat::from_fn(3, 7, |i, j| if j == [0, 3, 4][i] { 1.0 } else { 0.0 });
    StateSpace::new(Mat::from_fn(7, 7, |i, j| a[i][j]), b, c, Mat::zeros(3, 2), Continuous).unwrap()
}

/// What is printed of one example: the denominator, and B and C of the numerator.
struct Printed {
    ar: Vec<Vec<f64>>,
    br: Vec<Vec<f64>>,
    cr: Vec<Vec<f64>>,
    bq: [[f64; 2]; 7],
    cq: [[f64; 7]; 3],
}

fn sb08cd() -> Printed {
    Printed {
        ar: vec![vec![-0.1605, 0.0523], vec![-0.4489, -0.1605]],
        br: vec![vec![-0.0158, -0.0692, -0.1688], vec![0.0306, 0.1281, -0.4984]],
        cr: vec![vec![0.1975, -0.1063], vec![0.8541, -0.4513], vec![0.4668, 0.8826]],
        bq: [
            [-1.0157, 0.2554],
            [0.5523, 0.4443],
            [0.0056, -11.6989],
            [0.0490, 4.3728],
            [11.7198, -0.0038],
            [-2.8173, 0.0308],
            [3.1018, -0.0009],
        ],
        cq: [
            [0.1975, -0.1063, -0.0006, -0.0083, 0.1279, 0.8797, 0.3994],
            [0.8541, -0.4513, -0.0007, -0.0041, 0.0305, -0.2562, 0.0122],
            [0.4668, 0.8826, 0.0248, -0.0506, 0.0, 0.0022, -0.0017],
        ],
    }
}

fn sb08dd() -> Printed {
    Printed {
        ar: vec![vec![-0.1605, -0.0772], vec![0.3040, -0.1605]],
        br: vec![vec![1.1050, 0.3215], vec![0.0066, -2.5822]],
        cr: vec![vec![-0.2288, -0.0259], vec![-0.0070, 0.1497]],
        bq: [
            [5.0302, -0.0063],
            [0.7078, -0.0409],
            [-11.3663, 0.0051],
            [0.1760, 0.5879],
            [-0.0265, 12.2119],
            [1.1050, 0.3215],
            [0.0066, -2.5822],
        ],
        cq: [
            [-0.8659, 0.2787, -0.3432, 0.0020, 0.0, 0.2325, 0.0265],
            [0.0797, -0.3951, 0.0976, -0.0292, 0.0062, 0.8985, 0.1406],
            [-0.0165, -0.0645, 0.0097, 0.8032, -0.1602, 0.0874, -0.5630],
        ],
    }
}

fn sb08ed() -> Printed {
    Printed {
        ar: vec![vec![-1.0, 0.0526], vec![-0.4463, -1.0]],
        br: vec![vec![-0.2623, -1.1297, 0.0764], vec![-0.0155, -0.0752, -1.1676]],
        cr: vec![vec![0.2238, 0.0132], vec![0.9639, 0.0643], vec![-0.0660, 0.9962]],
        bq: [
            [-1.1544, -0.0159],
            [-0.0631, 0.5122],
            [0.0056, -11.6989],
            [0.0490, 4.3728],
            [11.7198, -0.0038],
            [-2.8173, 0.0308],
            [3.1018, -0.0009],
        ],
        cq: [
            [0.2238, 0.0132, -0.0006, -0.0083, 0.1279, 0.8797, 0.3994],
            [0.9639, 0.0643, -0.0007, -0.0041, 0.0305, -0.2562, 0.0122],
            [-0.0660, 0.9962, 0.0248, -0.0506, 0.0, 0.0022, -0.0017],
        ],
    }
}

fn sb08fd() -> Printed {
    Printed {
        ar: vec![vec![-1.0, -0.0135], vec![1.7393, -1.0]],
        br: vec![vec![1.0104, 1.3262], vec![0.4474, -2.2388]],
        cr: vec![vec![-0.1091, -0.4653], vec![-0.7055, 0.4766]],
        bq: [
            [5.0302, -0.0063],
            [0.7078, -0.0409],
            [-11.3663, 0.0051],
            [0.1760, 0.5879],
            [-0.0265, 12.2119],
            [1.0104, 1.3262],
            [0.4474, -2.2388],
        ],
        cq: [
            [-0.8659, 0.2787, -0.3432, 0.0020, 0.0, 0.2026, 0.1172],
            [0.0797, -0.3951, 0.0976, -0.0292, 0.0062, 0.7676, 0.4879],
            [-0.0165, -0.0645, 0.0097, 0.8032, -0.1602, 0.3050, -0.4812],
        ],
    }
}

fn matrix(rows: &[Vec<f64>]) -> Mat<f64> {
    Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// `B'B`, `C C'`, `C B` and `C A B`, which an orthogonal transformation of the state does not change.
fn invariants(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> [Mat<f64>; 4] {
    [b.transpose() * b, c * c.transpose(), c * b, c * a * b]
}

/// Each entry of a product of two printed matrices carries the rounding of both: 5e-5 times the size of the other.
fn close(found: &Mat<f64>, printed: &Mat<f64>, size: f64, what: &str) {
    let miss = (found - printed).norm_max();
    assert!(miss < 1.5e-4 * size, "{what}: {miss} of {size}");
}

#[test]
fn slicot_examples_are_met_to_their_printed_digits() {
    let plant = example();
    for (name, left, denominator, printed) in [
        ("SB08CD", true, Denominator::Inner, sb08cd()),
        ("SB08DD", false, Denominator::Inner, sb08dd()),
        ("SB08ED", true, Denominator::Degree(-1.0), sb08ed()),
        ("SB08FD", false, Denominator::Degree(-1.0), sb08fd()),
    ] {
        let factors =
            if left { left_coprime(&plant, denominator) } else { right_coprime(&plant, denominator) }.unwrap();
        assert_eq!(factors.moved.len(), 2, "{name}");
        let small = factors.minimal_denominator().unwrap();
        assert!((small.d() - eye(small.inputs())).norm_l2() < 1e-14, "{name}");
        let [ar, br, cr] = [&printed.ar, &printed.br, &printed.cr].map(|rows| matrix(rows));
        let found = invariants(small.a(), small.b(), small.c());
        let exact = invariants(ar.as_ref(), br.as_ref(), cr.as_ref());
        let sizes = [br.norm_l2(), cr.norm_l2(), br.norm_l2() + cr.norm_l2(), 2.0 * (br.norm_l2() + cr.norm_l2())];
        for ((found, exact), size) in found.iter().zip(&exact).zip(sizes) {
            close(found, exact, size.max(1.0), name);
        }
        let poles = real_schur("AR", ar.as_ref()).unwrap().eigenvalues();
        let mirrored = small.poles().unwrap().into_iter().find(|p| p.im > 0.0).unwrap();
        assert!((mirrored - poles[0]).norm() < 2e-4, "{name}: {mirrored} {}", poles[0]);
        let bq = Mat::from_fn(7, 2, |i, j| printed.bq[i][j]);
        let cq = Mat::from_fn(3, 7, |i, j| printed.cq[i][j]);
        let n = &factors.numerator;
        close(&(n.b().transpose() * n.b()), &(bq.transpose() * &bq), bq.norm_l2(), name);
        close(&(n.c() * n.c().transpose()), &(&cq * cq.transpose()), cq.norm_l2(), name);
        close(&(n.c() * n.b()), &(&cq * &bq), bq.norm_l2(), name);
    }
}

/// AB09FD: left factors with inner denominator, `[Nt Mt]` reduced by balanced truncation to 5 states; Hankel singular values and
/// the response of the recovered model (doc/AB09FD.html).
#[test]
fn the_extended_system_of_ab09fd_has_its_printed_hankel_values() {
    let factors = left_coprime(&example(), Denominator::Inner).unwrap();
    let (n, m) = (&factors.numerator, &factors.denominator);
    let b = block(&[&[n.b(), m.b()]]);
    let d = block(&[&[n.d(), m.d()]]);
    let extended = StateSpace::new(n.a().to_owned(), b, n.c().to_owned(), d, Continuous).unwrap();
    let reachable = crate::linalg::gramian_factor(extended.a(), extended.b()).unwrap().l;
    let observable = crate::linalg::gramian_factor(extended.a().transpose(), extended.c().transpose()).unwrap().l;
    let hankel = (observable.transpose() * reachable).singular_values().unwrap();
    for (found, exact) in hankel.iter().zip([13.6047, 9.4106, 1.7684, 0.7456, 0.6891, 0.0241, 0.0230]) {
        assert!((found - exact).abs() < 5.1e-5, "{found} {exact}");
    }
    // The numerator is the denominator times the plant.
    let omega = [0.1, 1.0, 10.0];
    let [g, n, m] = [&example(), n, m].map(|s| frequency_response(s, &omega).unwrap());
    for k in 0..3 {
        assert!((m.at(k) * g.at(k) - n.at(k)).norm_l2() < 1e-12 * g.at(k).norm_l2());
    }
}
