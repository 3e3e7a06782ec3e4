//! A weighted linear least squares that needs no start, for structures that are linear in most parameters once their
//! equation is multiplied out.
//!
//! Take p rows r of `s X = A X + B` out of the equations of the state response X. Where what is left and the measurement
//! `C X = Y - D U` determine X at each frequency, the rows r are linear in the parameters that are in them:
//! ```text
//! [ (sI - A) without r ]     [ (B without r) U ]
//! [ C                  ] X = [ Y - D U         ],        s X_r = A_r(theta) X + B_r(theta) U
//! ```
//! For the bearing (3)-(6) this is `s^2 l = K l + D s l + B m, m = P/(s + P)`, linear in K, D, B for given actuator poles P. An
//! error e of the rows r is one of `C (sI - A)^-1 e_r` in G: with theta of the iteration before as the weight the misfit
//! counts where it is seen; before the first, A without its rows r and `s + shift`, the shift in the middle of the band, so that low
//! frequencies do not count alone (C. K. Sanathanan and J. Koerner, IEEE Trans. Autom. Control 8 (1963), 56). The parameters that
//! are elsewhere, for the bearing P, run over a grid.
//!
//! The equation is that of continuous time, the response that of the sampled model, `G_d = sum_k h(s_k) G(s_k)` with
//! `h(s) = (1 - exp(-s ts)) / (s ts)` and `s_k = s + 2 pi j k / ts`. The aliases (k not 0) are those of the iteration before.

use super::design::{Range, design};
use super::misfit::{Misfit, Point};
use crate::structure::{Matrix, Slope, Structure};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};
use youla::linalg::regress;
use youla::lti::{Continuous, StateSpace};

/// Relative change of the misfit below which the weights have converged.
const CONVERGED: f64 = 1e-3;
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
        let shift = (band[0] * band[1]).sqrt();
        let mut found: Vec<Point> = design(&ranges)
            .into_iter()
            .filter_map(|values| {
                let mut theta = probe.to_vec();
                self.outer.iter().zip(&values).for_each(|(j, value)| theta[*j] = *value);
                self.fit(misfit, theta, reweightings, shift)
            })
            .collect();
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        found
    }

    /// The linear parameters for given outer ones, by iterative reweighting; the best of all iterations.
    pub(super) fn fit(
        &self,
        misfit: &Misfit<'_>,
        mut theta: Vec<f64>,
        reweightings: usize,
        shift: f64,
    ) -> Option<Point> {
        let mut found: Vec<Point> = Vec::new();
        for _ in 0..reweightings.max(1) {
            let linear = self.solve(misfit, &theta, found.last(), shift).ok()?;
            self.linear.iter().zip(&linear).for_each(|((j, _), value)| theta[*j] = *value);
            let Ok(point) = misfit.evaluate(&theta) else { break };
            let converged = found.last().is_some_and(|b| (b.cost - point.cost).abs() <= CONVERGED * point.cost);
            found.push(point);
            if converged {
                break;
            }
        }
        found.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// One weighted linear least squares around `theta`; weights and aliases are those of `before`.
    fn solve(&self, misfit: &Misfit<'_>, theta: &[f64], before: Option<&Point>, shift: f64) -> Result<Vec<f64>> {
        let model = misfit.structure.model(theta)?;
        let base = self.without_linear(&model, theta)?;
        let target = misfit.target;
        let (p, r, ts) = (target.outputs(), target.columns(), target.time().ts());
        let weighing = if before.is_some() { model.clone() } else { self.without_rows(&model)? };
        let (each, columns) = (2 * p * r, self.linear.len());
        let count = each * target.omega().len();
        let mut regressors = Mat::zeros(count, columns);
        let mut targets = Mat::zeros(count, 1);
        for k in 0..target.omega().len() {
            let s = target.s(k);
            let hold = (c64::new(1.0, 0.0) - (-s * ts).exp()) / (s * ts);
            let (excited, weights) = (target.excited(k), target.weight(k));
            let (through, continuous) = self.weigh(&weighing, if before.is_some() { s } else { s + shift });
            let mut response = target.value(k).to_owned();
            if let Some(before) = before {
                let sampled = before.response.at(k);
                let aliases = Mat::from_fn(p, excited.nrows(), |i, l| sampled[(i, l)] - hold * continuous[(i, l)]);
                response -= aliases * excited;
            }
            let response = Mat::from_fn(p, r, |i, j| response[(i, j)] / hold);
            let signals = self.signals(&model, s, &response, excited);
            let sums = |row: MatRef<'_, f64>, offset: usize, j: usize| {
                let terms = row.row(0).iter().enumerate().filter(|(_, value)| **value != 0.0);
                terms.fold(c64::new(0.0, 0.0), |sum, (l, value)| sum + signals[(offset + l, j)] * *value)
            };
            let n = model.order();
            for j in 0..r {
                let left: Vec<c64> = self
                    .rows
                    .iter()
                    .map(|row| {
                        let known = sums(base.a().subrows(*row, 1), 0, j) + sums(base.b().subrows(*row, 1), n, j);
                        s * signals[(*row, j)] - known
                    })
                    .collect();
                for i in 0..p {
                    let weight = hold * weights[(i, j)];
                    let row = k * each + 2 * (i + j * p);
                    for (column, (_, slopes)) in self.linear.iter().enumerate() {
                        let value = slopes.iter().fold(c64::new(0.0, 0.0), |sum, slope| {
                            let offset = if slope.matrix == Matrix::A { 0 } else { n };
                            let signal = signals[(offset + slope.column, j)] * slope.value;
                            sum + through[(i, self.place(slope.row))] * signal
                        });
                        let value = weight * value;
                        (regressors[(row, column)], regressors[(row + 1, column)]) = (value.re, value.im);
                    }
                    let sum = left.iter().enumerate().fold(c64::new(0.0, 0.0), |sum, (e, x)| sum + through[(i, e)] * x);
                    let value = weight * sum;
                    (targets[(row, 0)], targets[(row + 1, 0)]) = (value.re, value.im);
                }
            }
        }
        let x = regress("the equations of the structure", regressors.as_ref(), targets.as_ref())?;
        Ok(x.col(0).iter().copied().collect())
    }

    /// The model without the terms of the linear parameters.
    fn without_linear(&self, model: &StateSpace<Continuous>, theta: &[f64]) -> Result<StateSpace<Continuous>> {
        let (mut a, mut b) = (model.a().to_owned(), model.b().to_owned());
        for (parameter, slopes) in &self.linear {
            for slope in slopes {
                let entry = if slope.matrix == Matrix::A { &mut a } else { &mut b };
                entry[(slope.row, slope.column)] -= slope.value * theta[*parameter];
            }
        }
        StateSpace::new(a, b, model.c().to_owned(), model.d().to_owned(), Continuous).map_err(Error::from)
    }

    /// Place of a state among the rows r.
    fn place(&self, row: usize) -> usize {
        self.rows.iter().position(|r| *r == row).unwrap_or_default()
    }

    /// `C (sI - A)^-1` at the rows r, p x p, and `G(s)`, p x m.
    fn weigh(&self, model: &StateSpace<Continuous>, s: c64) -> (Mat<c64>, Mat<c64>) {
        let (n, m, p) = (model.order(), model.inputs(), model.outputs());
        let width = n + p;
        let mut work = vec![c64::new(0.0, 0.0); n * width];
        for (i, row) in work.chunks_exact_mut(width).enumerate() {
            (0..n).for_each(|j| row[j] = (-model.a()[(j, i)]).into());
            row[i] += s;
            (0..p).for_each(|j| row[n + j] = model.c()[(j, i)].into());
        }
        solve_in_place(&mut work, n, width);
        let outputs = |i: usize, state: usize| work[state * width + n + i];
        let through = Mat::from_fn(p, self.rows.len(), |i, r| outputs(i, self.rows[r]));
        let value = Mat::from_fn(p, m, |i, j| {
            (0..n).fold(c64::new(model.d()[(i, j)], 0.0), |sum, l| sum + outputs(i, l) * model.b()[(l, j)])
        });
        (through, value)
    }

    /// The model with the rows r of A empty, for weights before anything is known: a chain of integrators, which is taken at
    /// `s + shift` with a shift in the middle of the band, so that low frequencies do not count alone.
    fn without_rows(&self, model: &StateSpace<Continuous>) -> Result<StateSpace<Continuous>> {
        let n = model.order();
        let a = Mat::from_fn(n, n, |i, j| if self.rows.contains(&i) { 0.0 } else { model.a()[(i, j)] });
        StateSpace::new(a, model.b().to_owned(), model.c().to_owned(), model.d().to_owned(), Continuous)
            .map_err(Error::from)
    }

    /// `[X; U]`, (n + m) x r, X from the response of the outputs and the equations without the rows r.
    fn signals(
        &self,
        model: &StateSpace<Continuous>,
        s: c64,
        response: &Mat<c64>,
        excited: MatRef<'_, c64>,
    ) -> Mat<c64> {
        let (n, m, r) = (model.order(), model.inputs(), excited.ncols());
        let width = n + r;
        let kept: Vec<usize> = (0..n).filter(|row| !self.rows.contains(row)).collect();
        let left = equations(model, &kept, s);
        let through = |gain: MatRef<'_, f64>, i: usize, j: usize| {
            (0..m).fold(c64::new(0.0, 0.0), |sum, l| sum + excited[(l, j)] * gain[(i, l)])
        };
        let mut work = vec![c64::new(0.0, 0.0); n * width];
        for (i, row) in work.chunks_exact_mut(width).enumerate() {
            (0..n).for_each(|j| row[j] = left[(i, j)]);
            (0..r).for_each(|j| {
                row[n + j] = match kept.get(i) {
                    Some(state) => through(model.b(), *state, j),
                    None => response[(i - kept.len(), j)] - through(model.d(), i - kept.len(), j),
                }
            });
        }
        solve_in_place(&mut work, n, width);
        Mat::from_fn(n + m, r, |i, j| if i < n { work[i * width + n + j] } else { excited[(i - n, j)] })
    }
}

/// Solves `[M, B]` (row after row, n rows) for `M^-1 B` by elimination with partial pivoting. A singular M gives values that are
/// not finite.
fn solve_in_place(work: &mut [c64], n: usize, width: usize) {
    for k in 0..n {
        let size = |row: usize| work[row * width + k].norm_sqr();
        let pivot = (k..n).fold(k, |best, row| if size(row) > size(best) { row } else { best });
        let (upper, lower) = work.split_at_mut((k + 1) * width);
        let top = &mut upper[k * width..];
        if pivot > k {
            top.swap_with_slice(&mut lower[(pivot - k - 1) * width..][..width]);
        }
        for row in lower.chunks_exact_mut(width) {
            let factor = row[k] / top[k];
            row[k..].iter_mut().zip(&top[k..]).for_each(|(value, top)| *value -= factor * top);
        }
    }
    for k in (0..n).rev() {
        let (above, row) = work.split_at_mut(k * width);
        let pivot = row[k];
        row[n..width].iter_mut().for_each(|value| *value /= pivot);
        for other in above.chunks_exact_mut(width) {
            let factor = other[k];
            other[n..].iter_mut().zip(&row[n..width]).for_each(|(value, x)| *value -= factor * x);
        }
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
