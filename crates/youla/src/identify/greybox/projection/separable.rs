//! A weighted linear least squares that needs no start, for structures that are linear in most parameters once their
//! equation is multiplied out.
//!
//! Take p rows r of `s X = A X + B` out of the equations of the state response X. Where what is left and the measurement
//! `C X = G - D` determine X at each frequency, the rows r are linear in the parameters that stand in them:
//! ```text
//! [ (sI - A) without r ]     [ B without r ]
//! [ C                  ] X = [ G - D       ],        s X_r = A_r(theta) X + B_r(theta)
//! ```
//! For the bearing (3)-(6) this is `s^2 l = K l + D s l + B m, m = P/(s + P)`, linear in K, D, B for given actuator poles P. An
//! error e of the rows r is one of `C (sI - A)^-1 e_r` in G: with theta of the iteration before as the weight the misfit
//! counts where it is seen (C. K. Sanathanan and J. Koerner, IEEE Trans. Autom. Control 8 (1963), 56). The parameters that
//! stand elsewhere, for the bearing P, run over a grid.
//!
//! The equation is that of continuous time, the response that of the sampled model, `G_d = sum_k h(s_k) G(s_k)` with
//! `h(s) = (1 - exp(-s ts)) / (s ts)` and `s_k = s + 2 pi j k / ts`. The aliases (k not 0) are those of the iteration before.

use super::super::structure::{Matrix, Slope, Structure};
use super::design::{Range, design};
use super::misfit::{Misfit, Point, complex};
use crate::Result;
use crate::linalg::regress;
use crate::lti::{Continuous, StateSpace, frequency_response};
use faer::linalg::solvers::Solve;
use faer::{Mat, c64};

/// Relative change of the misfit below which the weights have settled.
const SETTLED: f64 = 1e-3;
/// Smallest over largest singular value, rows of unit length, from which the state response is determined.
const DETERMINED: f64 = 1e-8;

/// How a structure comes apart.
pub(super) struct Separation {
    /// The rows r.
    rows: Vec<usize>,
    /// Parameters in these rows alone, with their slopes, which are constant.
    linear: Vec<(usize, Vec<Slope>)>,
    /// All other parameters.
    outer: Vec<usize>,
}

impl Separation {
    /// `None` where the structure is not of this kind. `probe` is any parameter vector with a model, `s` a point in the band.
    pub(super) fn of(structure: &dyn Structure, probe: &[f64], s: c64) -> Result<Option<Self>> {
        let model = structure.model(probe)?;
        let moved: Vec<f64> = probe.iter().map(|v| 1.37 * v + 0.01).collect();
        let constant = |j: usize| {
            let slopes = structure.slopes(probe, j);
            let dynamic = slopes.iter().all(|slope| matches!(slope.matrix, Matrix::A | Matrix::B));
            (dynamic && !slopes.is_empty() && slopes == structure.slopes(&moved, j)).then_some((j, slopes))
        };
        let candidates: Vec<(usize, Vec<Slope>)> = (0..probe.len()).filter_map(constant).collect();
        let Some(rows) = residual_rows(&model, &candidates, s) else { return Ok(None) };
        let inside = |slopes: &[Slope]| slopes.iter().all(|slope| rows.contains(&slope.row));
        let linear: Vec<_> = candidates.into_iter().filter(|(_, slopes)| inside(slopes)).collect();
        let outer = (0..probe.len()).filter(|j| linear.iter().all(|(k, _)| k != j)).collect();
        Ok(Some(Separation { rows, linear, outer }))
    }

    /// Parameter vectors, best first: one for each point of the design over the outer parameters.
    pub(super) fn candidates(&self, misfit: &Misfit<'_>, probe: &[f64], reweightings: usize) -> Vec<Point> {
        let band = misfit.target.band(0.02);
        let ranges: Vec<Range> = self.outer.iter().map(|j| Range::of(misfit.structure, probe, *j, band)).collect();
        let mut found: Vec<Point> = design(&ranges)
            .into_iter()
            .filter_map(|values| {
                let mut theta = probe.to_vec();
                self.outer.iter().zip(&values).for_each(|(j, value)| theta[*j] = *value);
                self.fit(misfit, theta, reweightings)
            })
            .collect();
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        found
    }

    /// The linear parameters for given outer ones, by iterative reweighting; the best of all iterations.
    pub(super) fn fit(&self, misfit: &Misfit<'_>, mut theta: Vec<f64>, reweightings: usize) -> Option<Point> {
        let mut best: Option<Point> = None;
        let mut before: Option<Point> = None;
        for _ in 0..reweightings.max(1) {
            let linear = self.solve(misfit, &theta, before.as_ref()).ok()?;
            self.linear.iter().zip(&linear).for_each(|((j, _), value)| theta[*j] = *value);
            let Ok(point) = misfit.evaluate(&theta) else { break };
            let settled = before.as_ref().is_some_and(|b| (b.cost - point.cost).abs() <= SETTLED * point.cost);
            if best.as_ref().is_none_or(|b| point.cost < b.cost) {
                best = misfit.evaluate(&theta).ok();
            }
            before = Some(point);
            if settled {
                break;
            }
        }
        best
    }

    /// One weighted linear least squares around `theta`; weights and aliases are those of `before`.
    fn solve(&self, misfit: &Misfit<'_>, theta: &[f64], before: Option<&Point>) -> Result<Vec<f64>> {
        let model = misfit.structure.model(theta)?;
        let target = misfit.target;
        let (p, m, ts) = (target.outputs(), target.inputs(), target.time().ts());
        let sampled = before.map(|point| frequency_response(&point.sampled, target.omega())).transpose()?;
        let weighing = if before.is_some() { model.clone() } else { self.without_rows(&model)? };
        let (each, columns) = (2 * p * m, self.linear.len());
        let count = each * target.omega().len();
        let mut regressors = Mat::zeros(count, columns);
        let mut targets = Mat::zeros(count, 1);
        for (k, omega) in target.omega().iter().enumerate() {
            let s = c64::new(0.0, *omega);
            let hold = (c64::new(1.0, 0.0) - (-s * ts).exp()) / (s * ts);
            let (through, continuous) = self.weigh(&weighing, s);
            let aliases = |i: usize, j: usize| match &sampled {
                Some(sampled) => sampled.at(k)[(i, j)] - hold * continuous[(i, j)],
                None => c64::new(0.0, 0.0),
            };
            let measured = target.value(k);
            let response = Mat::from_fn(p, m, |i, j| (measured[(i, j)] - aliases(i, j)) / hold - model.d()[(i, j)]);
            let states = self.state_response(&model, s, &response);
            let signal = |b: usize, j: usize, slope: &Slope| match slope.matrix {
                Matrix::A => states[(b, j)] * slope.value,
                _ => c64::new(if b == j { slope.value } else { 0.0 }, 0.0),
            };
            for j in 0..m {
                for i in 0..p {
                    let weight = hold * target.weight(k)[(i, j)];
                    let row = k * each + 2 * (i + j * p);
                    for (column, (_, slopes)) in self.linear.iter().enumerate() {
                        let sum = slopes.iter().fold(c64::new(0.0, 0.0), |sum, slope| {
                            sum + through[(i, self.place(slope.row))] * signal(slope.column, j, slope)
                        });
                        let value = weight * sum;
                        (regressors[(row, column)], regressors[(row + 1, column)]) = (value.re, value.im);
                    }
                    let left = (0..self.rows.len()).fold(c64::new(0.0, 0.0), |sum, r| {
                        sum + through[(i, r)] * self.left(&model, theta, r, s, &states, j)
                    });
                    let value = weight * left;
                    (targets[(row, 0)], targets[(row + 1, 0)]) = (value.re, value.im);
                }
            }
        }
        let x = regress("the equations of the structure", regressors.as_ref(), targets.as_ref())?;
        Ok(x.col(0).iter().copied().collect())
    }

    /// `s X_r - A_r X - B_r` for input j without the terms of the linear parameters.
    fn left(&self, model: &StateSpace<Continuous>, theta: &[f64], r: usize, s: c64, x: &Mat<c64>, j: usize) -> c64 {
        let row = self.rows[r];
        let mut sum = s * x[(row, j)] - model.b()[(row, j)];
        for b in 0..model.order() {
            sum -= x[(b, j)] * model.a()[(row, b)];
        }
        for (parameter, slopes) in &self.linear {
            for slope in slopes.iter().filter(|slope| slope.row == row) {
                let value = slope.value * theta[*parameter];
                match slope.matrix {
                    Matrix::A => sum += x[(slope.column, j)] * value,
                    _ if slope.column == j => sum += value,
                    _ => {}
                }
            }
        }
        sum
    }

    /// Place of a state among the rows r.
    fn place(&self, row: usize) -> usize {
        self.rows.iter().position(|r| *r == row).unwrap_or_default()
    }

    /// `C (sI - A)^-1` at the rows r, p x p, and `G(s)`, p x m.
    fn weigh(&self, model: &StateSpace<Continuous>, s: c64) -> (Mat<c64>, Mat<c64>) {
        let n = model.order();
        let pencil =
            Mat::from_fn(n, n, |i, j| if i == j { s - model.a()[(i, j)] } else { (-model.a()[(i, j)]).into() });
        let outputs = pencil.partial_piv_lu().solve_transpose(complex(model.c().transpose()));
        let through = Mat::from_fn(model.outputs(), self.rows.len(), |i, r| outputs[(self.rows[r], i)]);
        let value = outputs.transpose() * complex(model.b()) + complex(model.d());
        (through, value)
    }

    /// The model with the rows r of A empty, for weights before anything is known: the chain of integrators.
    fn without_rows(&self, model: &StateSpace<Continuous>) -> Result<StateSpace<Continuous>> {
        let n = model.order();
        let a = Mat::from_fn(n, n, |i, j| if self.rows.contains(&i) { 0.0 } else { model.a()[(i, j)] });
        StateSpace::new(a, model.b().to_owned(), model.c().to_owned(), model.d().to_owned(), Continuous)
    }

    /// X, n x m, from the response of the outputs and the equations without the rows r.
    fn state_response(&self, model: &StateSpace<Continuous>, s: c64, response: &Mat<c64>) -> Mat<c64> {
        let kept: Vec<usize> = (0..model.order()).filter(|row| !self.rows.contains(row)).collect();
        let equations = equations(model, &kept, s);
        let right = Mat::from_fn(model.order(), model.inputs(), |i, j| match kept.get(i) {
            Some(row) => c64::new(model.b()[(*row, j)], 0.0),
            None => response[(i - kept.len(), j)],
        });
        equations.partial_piv_lu().solve(right)
    }
}

/// `[(sI - A) of the kept rows; C]`.
fn equations(model: &StateSpace<Continuous>, kept: &[usize], s: c64) -> Mat<c64> {
    Mat::from_fn(kept.len() + model.outputs(), model.order(), |i, j| match kept.get(i) {
        Some(row) => (if *row == j { s } else { c64::new(0.0, 0.0) }) - model.a()[(*row, j)],
        None => c64::new(model.c()[(i - kept.len(), j)], 0.0),
    })
}

/// The p rows with the most parameters without which the states still follow from the outputs.
fn residual_rows(model: &StateSpace<Continuous>, candidates: &[(usize, Vec<Slope>)], s: c64) -> Option<Vec<usize>> {
    let held = |row: usize| candidates.iter().filter(|(_, slopes)| slopes.iter().any(|slope| slope.row == row)).count();
    let mut order: Vec<usize> = (0..model.order()).filter(|row| held(*row) > 0).collect();
    order.sort_by_key(|row| std::cmp::Reverse(held(*row)));
    let scales = model.state_scales().ok()?;
    let scaled = model.with_scaled_states(&scales);
    let mut rows: Vec<usize> = Vec::new();
    for row in order {
        let kept: Vec<usize> = (0..model.order()).filter(|r| *r != row && !rows.contains(r)).collect();
        if rows.len() < model.outputs() && determined(&equations(&scaled, &kept, s)) {
            rows.push(row);
        }
    }
    (rows.len() == model.outputs()).then_some(rows)
}

/// Whether the columns are independent, rows of unit length.
fn determined(equations: &Mat<c64>) -> bool {
    let length: Vec<f64> = equations.row_iter().map(|row| row.norm_l2()).collect();
    let unit = Mat::from_fn(equations.nrows(), equations.ncols(), |i, j| {
        if length[i] > 0.0 { equations[(i, j)] / length[i] } else { c64::new(0.0, 0.0) }
    });
    match unit.singular_values() {
        Ok(sigma) => sigma.len() == unit.ncols() && sigma[sigma.len() - 1] > DETERMINED * sigma[0],
        Err(_) => false,
    }
}
