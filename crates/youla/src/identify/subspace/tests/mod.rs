mod closed_loop;
mod disturbance;
mod options;
mod orders;
mod properties;
mod recovery;
mod structure;
mod sums;

use super::*;
use crate::Mat;
use faer::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn clock() -> Discrete {
    Discrete::new(1.0).unwrap()
}

fn uniform(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| 2.0 * rng.random::<f64>() - 1.0)
}

/// A random system with complex poles of the given magnitudes (two states each), in random coordinates.
fn random_system(magnitudes: &[f64], m: usize, p: usize, feedthrough: bool, seed: u64) -> StateSpace<Discrete> {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let n = 2 * magnitudes.len();
    let mut modal = Mat::zeros(n, n);
    for (k, magnitude) in magnitudes.iter().enumerate() {
        let angle = 0.2 + 2.6 * (k as f64 + rng.random::<f64>()) / magnitudes.len() as f64;
        let (re, im) = (magnitude * angle.cos(), magnitude * angle.sin());
        for (i, j, value) in [(0, 0, re), (0, 1, im), (1, 0, -im), (1, 1, re)] {
            modal[(2 * k + i, 2 * k + j)] = value;
        }
    }
    let t = Mat::<f64>::identity(n, n) + 0.3 * uniform(n, n, rng);
    let a = t.partial_piv_lu().solve(&modal * &t);
    let d = if feedthrough { uniform(p, m, rng) } else { Mat::zeros(p, m) };
    StateSpace::new(a, uniform(n, m, rng), uniform(p, n, rng), d, clock()).unwrap()
}

/// Outputs for inputs from an initial state, with `gain` times the noise `e` driving the states and `e` on the outputs.
fn respond(system: &StateSpace<Discrete>, u: &Mat<f64>, x0: f64, noise: Option<(&Mat<f64>, &Mat<f64>)>) -> Mat<f64> {
    let mut x = Mat::from_fn(system.order(), 1, |_, _| x0);
    let mut y = Mat::zeros(u.nrows(), system.outputs());
    for k in 0..u.nrows() {
        let uk = u.as_ref().row(k).transpose();
        let mut yk = system.c() * x.col(0) + system.d() * uk;
        x = (system.a() * x.col(0) + system.b() * uk).as_mat().to_owned();
        if let Some((gain, e)) = noise {
            let ek = e.as_ref().row(k).transpose();
            yk += ek;
            x += (gain * ek).as_mat();
        }
        y.row_mut(k).copy_from(yk.transpose());
    }
    y
}

/// Frequency response at `z = exp(j omega)`.
fn response(system: &StateSpace<Discrete>, omega: f64) -> Mat<c64> {
    let z = c64::new(omega.cos(), omega.sin());
    let complex = |m: MatRef<'_, f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0));
    let mut pencil = complex(system.a());
    pencil.as_mut().col_iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v = -*v));
    (0..system.order()).for_each(|i| pencil[(i, i)] += z);
    complex(system.c()) * pencil.partial_piv_lu().solve(complex(system.b())) + complex(system.d())
}

/// Largest distance of two frequency responses on a grid, relative to the largest response.
fn distance(left: &StateSpace<Discrete>, right: &StateSpace<Discrete>) -> f64 {
    let grid = (0..200).map(|k| 0.001 + 0.0157 * k as f64);
    let (mut gap, mut size) = (0.0_f64, 0.0_f64);
    for omega in grid {
        let reference = response(right, omega);
        gap = gap.max((response(left, omega) - &reference).norm_l2());
        size = size.max(reference.norm_l2());
    }
    gap / size
}

fn one<'a>(u: &'a Mat<f64>, y: &'a Mat<f64>) -> [Experiment<'a>; 1] {
    [Experiment::new(u.as_ref(), y.as_ref())]
}

fn fixed(order: usize, horizon: usize) -> SubspaceOptions {
    SubspaceOptions { order: Order::Fixed(order), horizon, feedthrough: Feedthrough::Estimated, ..Default::default() }
}
