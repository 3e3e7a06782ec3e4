//! What the uncertainty of the Hansen scheme claims, held against many simulated records of the bearing.
#![allow(missing_docs)]

#[path = "common/bearing_loop.rs"]
mod bearing_loop;
mod common;

use bearing_loop::{Coverage, Design, Loop, options};
use rayon::prelude::*;
use youla::c64;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Order, SubspaceOptions, Uncertainty, UncertaintyMethod, UncertaintyOptions};
use youla::lti::frequency_response;

fn with(method: UncertaintyMethod, order: usize) -> SubspaceOptions {
    let uncertainty = UncertaintyOptions { method, replicates: 60, ..Default::default() };
    SubspaceOptions { order: Order::Fixed(order), uncertainty, ..options() }
}

/// The change of G(S) with each block is `(Mt + S Ut)^-1 dS (M + U S)^-1`, the linear part of the exact identity.
#[test]
fn changes_of_the_plant_follow_from_those_of_the_deviation() {
    let bearing = Loop::new(&Design { a_factor: 0.9, ..EASY });
    let signals = bearing.record(3000, 0.1, 1);
    let found = hansen(&bearing.factors, &[signals], &with(UncertaintyMethod::Delta, 8)).unwrap();
    let (Some(Uncertainty::Delta(s)), Some(Uncertainty::Delta(plant))) =
        (&found.deviation.uncertainty, &found.uncertainty)
    else {
        panic!("no influences")
    };
    for omega in [300.0, 1300.0, 4000.0] {
        let at = |system| frequency_response(system, &[omega]).unwrap().at(0).to_owned();
        let (right, left) = (at(bearing.factors.right().system()), at(bearing.factors.left().system()));
        let response = at(&found.deviation.model);
        // right = [M U; N V], left = [Vt -Ut; -Nt Mt].
        let m = right.submatrix(0, 0, 2, 2) + right.submatrix(0, 2, 2, 2) * &response;
        let mt = left.submatrix(2, 2, 2, 2) - &response * left.submatrix(0, 2, 2, 2);
        for (ds, dg) in s.response_changes(omega).iter().zip(plant.response_changes(omega)) {
            let matrix = |d: &[c64]| youla::Mat::from_fn(2, 2, |i, j| d[2 * j + i]);
            let (ds, dg) = (matrix(ds), matrix(&dg));
            let miss = (&mt * &dg * &m - &ds).norm_l2() / ds.norm_l2();
            assert!(miss < 1e-4, "{omega}: {miss:e}");
        }
    }
}

const EASY: Design = Design { a_factor: 1.0, b_factor: 0.7, input_weight: 1000.0, process_noise: 0.01 };
