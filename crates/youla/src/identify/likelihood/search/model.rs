//! A model in block-diagonal form, A = diag(A_1, ..., A_k): one block per real pole or pair, larger ones for poles too close
//! to be distinguished.
//!
//! The blocks make responses and sensitivities cheap: a block touches the entries of its own A, B and C only.

use super::balancing::balanced;
use super::block::Block;
use super::grouping::{Grouped, grouped};
use super::separable::separable;
use crate::linalg::real_schur;
use faer::prelude::*;
use faer::{Mat, MatRef, c64};

/// Distance from an integrator from which a pole is outside. Beside a pole at 1 itself the free response of an integrator is a constant, which no line has.
const LEAST_EXCESS: f64 = 1e-6;
/// The pole of an integrator, as a search begins with it.
const INTEGRATOR: f64 = 1.0 - 0.1 * LEAST_EXCESS;
/// Distance from 1 up to which a real pole is slow. Of fourteen loops with a pole outside in the place of an integrator the farthest had 0.035.
const SLOW: f64 = 0.05;

/// `y = sum of C_i (z I - A_i)^-1 B_i u + D u`.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Model {
    /// Inputs m.
    pub(crate) inputs: usize,
    /// Outputs p.
    pub(crate) outputs: usize,
    /// The blocks.
    pub(crate) blocks: Vec<Block>,
    /// D, p x m, row by row.
    pub(crate) d: Vec<f64>,
}

impl Model {
    /// The blocks of A, B, C; `None` where A has no Schur form.
    pub(crate) fn of(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>, d: Vec<f64>) -> Option<Self> {
        Model::formed([a, b, c], d, true)
    }

    /// A and C with a block for each pole or pair, as far as they can be distinguished; B and D are zero.
    pub(crate) fn without_inputs(a: MatRef<'_, f64>, c: MatRef<'_, f64>, inputs: usize) -> Option<Self> {
        let b = Mat::zeros(a.nrows(), inputs);
        Model::formed([a, b.as_ref(), c], vec![0.0; c.nrows() * inputs], false)
    }

    /// The same with a block for each pole or pair, as far as they can be distinguished: what may be left out of a model.
    pub(crate) fn separated(&self) -> Option<Self> {
        let (a, b, c) = self.matrices();
        Model::formed([a.as_ref(), b.as_ref(), c.as_ref()], self.d.clone(), false)
    }

    fn formed([a, b, c]: [MatRef<'_, f64>; 3], d: Vec<f64>, merge: bool) -> Option<Self> {
        let (n, m, p) = (a.nrows(), b.ncols(), c.nrows());
        if n == 0 {
            return Some(Model { inputs: m, outputs: p, blocks: Vec::new(), d });
        }
        let [a, b, c] = balanced(a, b, c);
        let Grouped { groups, basis } = grouped(a.as_ref(), merge)?;
        let lu = basis.partial_piv_lu();
        let (at, bt, ct) = (lu.solve(&a * &basis), lu.solve(&b), &c * &basis);
        let row_by_row = |part: MatRef<'_, f64>| {
            let (rows, columns) = (part.nrows(), part.ncols());
            (0..rows * columns).map(|x| part[(x / columns, x % columns)]).collect::<Vec<f64>>()
        };
        let mut blocks = Vec::with_capacity(groups.len());
        let mut start = 0;
        for s in groups.iter().map(Vec::len) {
            let block = Block {
                states: s,
                a: row_by_row(cleaned(at.submatrix(start, start, s, s)).as_ref()),
                b: row_by_row(bt.subrows(start, s)),
                c: row_by_row(ct.subcols(start, s)),
            };
            let block = block.levelled();
            // Responses of triangular blocks cost less.
            let triangular = if separable(p) { block.triangular(&[]) } else { None };
            blocks.push(triangular.map_or(block, |(block, _)| block));
            start += s;
        }
        Some(Model { inputs: m, outputs: p, blocks, d })
    }

    /// Number of states.
    pub(crate) fn order(&self) -> usize {
        self.blocks.iter().map(|b| b.states).sum()
    }

    /// Numbers that describe both ends of a record: t, and the drift of each output.
    pub(crate) fn end_count(&self) -> usize {
        self.order() + self.outputs
    }

    /// A, B and C.
    pub(crate) fn matrices(&self) -> (Mat<f64>, Mat<f64>, Mat<f64>) {
        let (n, m, p) = (self.order(), self.inputs, self.outputs);
        let (mut a, mut b, mut c) = (Mat::zeros(n, n), Mat::zeros(n, m), Mat::zeros(p, n));
        let mut at = 0;
        for block in &self.blocks {
            let s = block.states;
            (0..s * s).for_each(|x| a[(at + x / s, at + x % s)] = block.a[x]);
            (0..s * m).for_each(|x| b[(at + x / m, x % m)] = block.b[x]);
            (0..p * s).for_each(|x| c[(x / s, at + x % s)] = block.c[x]);
            at += s;
        }
        (a, b, c)
    }

    /// All poles.
    pub(crate) fn poles(&self) -> Vec<c64> {
        self.blocks.iter().flat_map(Block::poles).collect()
    }

    /// Draws blocks with poles outside of the unit circle inside, for a start.
    pub(crate) fn draw_inside(&mut self) {
        for block in &mut self.blocks {
            let radius = block.poles().iter().map(|p| p.norm()).fold(0.0, f64::max);
            if radius >= 1.0 {
                block.a.iter_mut().for_each(|a| *a *= 0.999 / radius);
            }
        }
    }

    /// The same with an integrator for the slowest of its real poles outside of the unit circle, and the slowest one inside of it moved by as much the
    /// other way; `None` where no such pole is slow.
    pub(crate) fn with_integrator(&self) -> Option<Self> {
        let (a, b, c) = self.matrices();
        let schur = real_schur("the model", a.as_ref()).ok()?;
        let (mut t, n) = (schur.t.clone(), schur.t.nrows());
        let alone = |k: &usize| (*k == 0 || t[(*k, k - 1)] == 0.0) && (k + 1 == n || t[(k + 1, *k)] == 0.0);
        let slow = |k: &usize| (t[(*k, *k)] - 1.0).abs() < SLOW;
        let real: Vec<usize> = (0..n).filter(alone).filter(slow).collect();
        let nearest = |outside: bool| {
            let of_side = real.iter().copied().filter(|k| (t[(*k, *k)] > 1.0) == outside && t[(*k, *k)] != 1.0);
            of_side.min_by(|i, j| (t[(*i, *i)] - 1.0).abs().total_cmp(&(t[(*j, *j)] - 1.0).abs()))
        };
        let (outside, inside) = (nearest(true)?, nearest(false));
        let excess = t[(outside, outside)] - INTEGRATOR;
        if excess < LEAST_EXCESS {
            return None;
        }
        t[(outside, outside)] = INTEGRATOR;
        inside.into_iter().for_each(|k| t[(k, k)] += excess.min(0.9 * (1.0 - t[(k, k)])));
        let a = &schur.q * t * schur.q.transpose();
        Model::of(a.as_ref(), b.as_ref(), c.as_ref(), self.d.clone())
    }

    /// The same with an integrator beside the slowest of its real poles outside of the unit circle, on the same outputs; `None` where no such pole
    /// is slow.
    pub(crate) fn with_integrator_beside(&self) -> Option<Self> {
        let mut parts = self.separated()?;
        let outside = |block: &&Block| block.states == 1 && (LEAST_EXCESS..SLOW).contains(&(block.a[0] - 1.0));
        let slowest = parts.blocks.iter().filter(outside).min_by(|x, y| x.a[0].total_cmp(&y.a[0]))?;
        let integrator = Block { a: vec![INTEGRATOR], ..slowest.clone() };
        parts.blocks.push(integrator);
        Some(parts)
    }

    /// The same with a lag of unit gain and of each given pole, one after the other, before an input.
    pub(crate) fn with_lags(&self, input: usize, poles: &[f64]) -> Option<Self> {
        let ((mut a, mut b, mut c), mut d) = (self.matrices(), self.d.clone());
        for pole in poles {
            let (n, m) = (a.nrows(), self.inputs);
            let states = |i: usize, j: usize| match (i < n, j < n) {
                (true, true) => a[(i, j)],
                (true, false) => b[(i, input)],
                (false, true) => 0.0,
                (false, false) => *pole,
            };
            let inputs = |i: usize, j: usize| match (i < n, j == input) {
                (true, false) => b[(i, j)],
                (false, true) => 1.0 - pole,
                _ => 0.0,
            };
            let outputs = |i: usize, j: usize| if j < n { c[(i, j)] } else { d[i * m + input] };
            let wider = (Mat::from_fn(n + 1, n + 1, states), Mat::from_fn(n + 1, m, inputs));
            c = Mat::from_fn(self.outputs, n + 1, outputs);
            (0..self.outputs).for_each(|i| d[i * m + input] = 0.0);
            (a, b) = wider;
        }
        Model::of(a.as_ref(), b.as_ref(), c.as_ref(), d)
    }

    /// Mean square of the response in the upper half of the band.
    pub(crate) fn fast_gain(&self) -> f64 {
        let points = 32;
        let of = |k: usize| {
            let z = c64::cis(std::f64::consts::PI * (0.5 + 0.5 * (k as f64 + 0.5) / points as f64));
            self.response(z).iter().map(|g| g.norm_sqr()).sum::<f64>()
        };
        (0..points).map(of).sum::<f64>() / points as f64
    }

    /// The same without the blocks at some places.
    pub(crate) fn without(&self, places: &[usize]) -> Self {
        let kept = |k: &usize| !places.contains(k);
        let blocks = (0..self.blocks.len()).filter(kept).map(|k| self.blocks[k].clone()).collect();
        Model { blocks, ..self.clone() }
    }

    /// Magnitudes of the entries of G(z) where its parts have one phase, p x m row by row: that of D with the real poles, and that of each block with
    /// a pair.
    pub(crate) fn sum_of_modes(&self, z: c64) -> Vec<f64> {
        let oscillates = |k: &usize| self.blocks[*k].poles().iter().any(|p| p.im != 0.0);
        let pairs: Vec<usize> = (0..self.blocks.len()).filter(oscillates).collect();
        let alone = |k: &usize| Model { blocks: vec![self.blocks[*k].clone()], d: vec![0.0; self.d.len()], ..*self };
        let mut sum = vec![0.0; self.d.len()];
        for part in std::iter::once(self.without(&pairs)).chain(pairs.iter().map(alone)) {
            sum.iter_mut().zip(part.response(z)).for_each(|(sum, g)| *sum += g.norm());
        }
        sum
    }

    /// G(z), p x m row by row.
    pub(crate) fn response(&self, z: c64) -> Vec<c64> {
        let (m, p) = (self.inputs, self.outputs);
        let mut g: Vec<c64> = self.d.iter().map(|d| c64::new(*d, 0.0)).collect();
        for block in &self.blocks {
            let s = block.states;
            let mut inverse = vec![c64::ZERO; s * s];
            block.resolvent(z, &mut inverse);
            for j in 0..m {
                for i in 0..s {
                    let mut x = c64::ZERO;
                    for l in 0..s {
                        x += inverse[i * s + l] * block.b[l * m + j];
                    }
                    for o in 0..p {
                        g[o * m + j] += x * block.c[o * s + i];
                    }
                }
            }
        }
        g
    }

    /// `dG = C R dA R B + C R dB + dC R B + dD` with `R = (z I - A)^-1`, p x m row by row, for a change of the entries.
    pub(crate) fn response_change(&self, change: &Model, z: c64) -> Vec<c64> {
        let (m, p) = (self.inputs, self.outputs);
        let mut out: Vec<c64> = change.d.iter().map(|d| c64::new(*d, 0.0)).collect();
        for (block, by) in self.blocks.iter().zip(&change.blocks) {
            let (s, (x, left)) = (block.states, block.sides(z));
            let complex = |values: &[f64], columns: usize| {
                let rows = values.len() / columns.max(1);
                Mat::from_fn(rows, columns, |i, j| c64::new(values[i * columns + j], 0.0))
            };
            let g = left * (complex(&by.a, s) * &x + complex(&by.b, m)) + complex(&by.c, s) * &x;
            (0..p * m).for_each(|row| out[row] += g[(row / m, row % m)]);
        }
        out
    }
}

/// Share of the norm of a block below which an entry under its diagonal is rounding: the bases of the invariant subspaces come from
/// Schur forms, which are zero there.
const ROUNDING: f64 = 1e-12;

fn cleaned(block: MatRef<'_, f64>) -> Mat<f64> {
    let least = ROUNDING * block.norm_l2();
    let rounding = |i: usize, j: usize| i > j && block[(i, j)].abs() < least;
    Mat::from_fn(block.nrows(), block.ncols(), |i, j| if rounding(i, j) { 0.0 } else { block[(i, j)] })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Poles 1.004 and 0.99 beside a pair: an integrator and their sum less one, the pair as it was; none without a pole outside.
    #[test]
    fn an_integrator_takes_the_place_of_a_pole_outside() {
        let with = |outside: f64| {
            let rows = [[outside, 0.3, 0.0, 0.1], [0.0, 0.99, 0.2, 0.0], [0.0, 0.0, 0.6, 0.7], [0.0, 0.0, -0.7, 0.6]];
            let (a, b) = (Mat::from_fn(4, 4, |i, j| rows[i][j]), Mat::from_fn(4, 1, |_, _| 1.0));
            let c = Mat::from_fn(1, 4, |_, j| 1.0 + j as f64);
            Model::of(a.as_ref(), b.as_ref(), c.as_ref(), vec![0.0]).unwrap().with_integrator()
        };
        let poles = with(1.004).unwrap().poles();
        for expected in [c64::new(1.0, 0.0), c64::new(0.994, 0.0), c64::new(0.6, 0.7), c64::new(0.6, -0.7)] {
            assert!(poles.iter().any(|pole| (pole - expected).norm() < 1e-6), "{expected} in {poles:?}");
        }
        assert!(with(0.9995).is_none() && with(1.2).is_none());
    }

    /// The poles stay, and one at 1 has the outputs of the pole outside.
    #[test]
    fn an_integrator_is_added_beside_a_pole_outside() {
        let with = |outside: f64| {
            let lag = |a: f64, c: [f64; 2]| Block { states: 1, a: vec![a], b: vec![1.0], c: c.to_vec() };
            let blocks = vec![lag(outside, [2.0, -1.0]), lag(0.9, [1.0, 3.0])];
            Model { inputs: 1, outputs: 2, blocks, d: vec![0.0; 2] }.with_integrator_beside()
        };
        let wider = with(1.01).unwrap();
        let slowest = |a: &&Block| (a.a[0] - 1.0).abs() < 1e-6;
        let integrator = wider.blocks.iter().find(slowest).unwrap();
        assert!(wider.order() == 3 && (integrator.c[0] / integrator.c[1] + 2.0).abs() < 1e-9, "{:?}", wider.blocks);
        assert!(with(0.99).is_none() && with(1.2).is_none());
    }

    /// Lags in series before the second input, also on its direct path.
    #[test]
    fn lags_are_factors_of_one_input() {
        let (a, b) = (
            Mat::from_fn(2, 2, |i, j| [[0.9, 0.2], [0.0, 0.5]][i][j]),
            Mat::from_fn(2, 2, |i, j| (1 + 2 * i + j) as f64),
        );
        let c = Mat::from_fn(2, 2, |i, j| 1.0 - (i + 3 * j) as f64);
        let model = Model::of(a.as_ref(), b.as_ref(), c.as_ref(), vec![0.0, 0.4, 0.3, -1.0]).unwrap();
        let wider = model.with_lags(1, &[0.7, 0.2]).unwrap();
        assert_eq!(wider.order(), 4);
        let z = c64::cis(0.4);
        let lags = (0.3 / (z - 0.7)) * (0.8 / (z - 0.2));
        for (k, (g, before)) in wider.response(z).into_iter().zip(model.response(z)).enumerate() {
            let expected = if k % 2 == 1 { before * lags } else { before };
            assert!((g - expected).norm() < 1e-12 * before.norm(), "{k}: {g} {expected}");
        }
    }
}
