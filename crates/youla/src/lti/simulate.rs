//! Simulation of discrete systems, `x(k+1) = A x(k) + B u(k), y(k) = C x(k) + D u(k)`.
//!
//! One sample is one product of the packed matrix `[B A; D C]` with `[u; x]`. The rows are taken in groups of eight, each
//! group stored column after column, so that eight running sums stay in registers and the compiler vectorises them for
//! every processor; the inputs come first because their terms do not wait for the state. Two vectors `[u; x; y]` take turns:
//! a step reads one and writes the other, so that no state is copied between two samples, which would cost as much as the
//! product.

use super::{Discrete, StateSpace};
use crate::linalg::{check_finite, check_shape};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use pulp::{Arch, NullaryFnOnce};
use std::mem::swap;
use std::ops::Range;

/// Rows whose sums are kept in registers at a time.
const GROUP: usize = 8;

/// A discrete system prepared for stepping: immutable, to be shared by any number of [`SimulationState`]s.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Discrete, Simulator, StateSpace}};
/// let delay = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1e-3)?)?;
/// let simulator = Simulator::new(&delay);
/// let mut state = simulator.start(&[7.0])?;
/// assert_eq!(simulator.step(&mut state, &[5.0]), [7.0]);
/// assert_eq!(simulator.step(&mut state, &[0.0]), [5.0]);
/// # Ok::<(), youla::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Simulator {
    /// Groups of eight rows of `[B A; D C]`, padded with zero rows, each group column-major.
    packed: Vec<f64>,
    states: usize,
    inputs: usize,
    outputs: usize,
}

/// The moving part of a simulation.
#[derive(Debug, Clone)]
pub struct SimulationState {
    /// `[u(k); x(k); y(k-1)]`, padded.
    now: Vec<f64>,
    /// `[u; x(k+1); y(k)]`, of which u is not set yet, padded.
    next: Vec<f64>,
    inputs: usize,
    states: usize,
}

impl SimulationState {
    /// The state x, n values.
    pub fn x(&self) -> &[f64] {
        &self.now[self.inputs..self.inputs + self.states]
    }
}

impl Simulator {
    /// Prepares a system.
    pub fn new(system: &StateSpace<Discrete>) -> Self {
        let (n, m, p) = (system.order(), system.inputs(), system.outputs());
        let mut packed = Vec::with_capacity((n + p).next_multiple_of(GROUP) * (n + m));
        for first in (0..n + p).step_by(GROUP) {
            for column in 0..m + n {
                packed.extend((first..first + GROUP).map(|row| entry(system, row, column)));
            }
        }
        Simulator { packed, states: n, inputs: m, outputs: p }
    }

    /// A simulation that starts from the state `x0`.
    ///
    /// # Errors
    /// [`Error::Shape`] unless `x0` has n values, [`Error::NotFinite`] for a bad one.
    pub fn start(&self, x0: &[f64]) -> Result<SimulationState> {
        let column = MatRef::from_column_major_slice(x0, x0.len(), 1);
        check_shape("the initial state", column, (self.states, 1))?;
        check_finite("the initial state", column)?;
        let mut now = vec![0.0; self.inputs + (self.states + self.outputs).next_multiple_of(GROUP)];
        now[self.inputs..self.inputs + self.states].copy_from_slice(x0);
        Ok(SimulationState { next: now.clone(), now, inputs: self.inputs, states: self.states })
    }

    /// The output `y(k) = C x(k) + D u` without advancing: with `u = 0` what a loop around a system without feedthrough
    /// needs before it can compute `u(k)`.
    ///
    /// # Panics
    /// If `u` has not m values or the state belongs to a system of another size.
    pub fn output<'a>(&self, state: &'a mut SimulationState, u: &[f64]) -> &'a [f64] {
        state.now[..self.inputs].copy_from_slice(u);
        self.multiply(&state.now, &mut state.next);
        &state.next[self.output_range()]
    }

    /// Advances by one sample: returns `y(k) = C x(k) + D u(k)` and leaves `x(k+1)` in the state. Allocates nothing.
    ///
    /// # Panics
    /// If `u` has not m values or the state belongs to a system of another size.
    #[inline(always)]
    pub fn step<'a>(&self, state: &'a mut SimulationState, u: &[f64]) -> &'a [f64] {
        state.now[..self.inputs].copy_from_slice(u);
        self.multiply(&state.now, &mut state.next);
        swap(&mut state.now, &mut state.next);
        &state.now[self.output_range()]
    }

    /// Where y stands in `[u; x; y]`.
    fn output_range(&self) -> Range<usize> {
        let first = self.inputs + self.states;
        first..first + self.outputs
    }

    /// `[x(k+1); y(k)] = [B A; D C] [u(k); x(k)]`.
    #[inline(always)]
    fn multiply(&self, now: &[f64], next: &mut [f64]) {
        let width = self.inputs + self.states;
        if width == 0 {
            return;
        }
        let (from, to) = (&now[..width], &mut next[self.inputs..]);
        for (group, sums) in self.packed.chunks_exact(GROUP * width).zip(to.chunks_exact_mut(GROUP)) {
            let mut total = [0.0; GROUP];
            for (column, value) in group.chunks_exact(GROUP).zip(from) {
                for (sum, coefficient) in total.iter_mut().zip(column) {
                    *sum += coefficient * value;
                }
            }
            sums.copy_from_slice(&total);
        }
    }
}

/// Entry of `[B A; D C]`, zero below its last row.
fn entry(system: &StateSpace<Discrete>, row: usize, column: usize) -> f64 {
    let (n, m, p) = (system.order(), system.inputs(), system.outputs());
    match (row < n, column < m) {
        _ if row >= n + p => 0.0,
        (true, true) => system.b()[(row, column)],
        (true, false) => system.a()[(row, column - m)],
        (false, true) => system.d()[(row - n, column)],
        (false, false) => system.c()[(row - n, column - m)],
    }
}

/// Simulates a record: `u` is samples x m, the result samples x p, row k at time k, from the state `x0` at row 0.
///
/// Equal to the recursion up to rounding (held by `simulation_is_the_recursion`).
///
/// # Errors
/// [`Error::Shape`] where `u` or `x0` do not fit; [`Error::NotFinite`] for a bad value in them; [`Error::Diverged`] with
/// the worst pole where the simulation left the range of the numbers.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace, simulate}};
/// let delay = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1e-3)?)?;
/// let u = Mat::from_fn(3, 1, |k, _| k as f64);
/// let y = simulate(&delay, u.as_ref(), &[7.0])?;
/// assert_eq!((y[(0, 0)], y[(1, 0)], y[(2, 0)]), (7.0, 0.0, 1.0));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn simulate(system: &StateSpace<Discrete>, u: MatRef<'_, f64>, x0: &[f64]) -> Result<Mat<f64>> {
    check_shape("the input record", u, (u.nrows(), system.inputs()))?;
    simulate_joined(system, &[u], x0)
}

/// The same with the inputs in several records of the same length, side by side; their columns together are the inputs.
pub(crate) fn simulate_joined(system: &StateSpace<Discrete>, u: &[MatRef<'_, f64>], x0: &[f64]) -> Result<Mat<f64>> {
    let samples = u.first().map_or(0, |u| u.nrows());
    let simulator = Simulator::new(system);
    let mut state = simulator.start(x0)?;
    let mut y = Mat::zeros(samples, system.outputs());
    Arch::new().dispatch(Run { simulator: &simulator, state: &mut state, u, y: &mut y });
    if is_finite(&state, &y) {
        return Ok(y);
    }
    u.iter().try_for_each(|u| check_finite("the input record", *u))?;
    let sample = (0..samples).find(|k| y.row(*k).iter().any(|v| !v.is_finite())).unwrap_or(samples);
    Err(Error::Diverged { what: "the simulation".into(), sample: sample + 1, pole: system.worst_pole()? })
}

/// The loop over the samples, on contiguous columns, for the widest registers of the processor.
struct Run<'a> {
    simulator: &'a Simulator,
    state: &'a mut SimulationState,
    u: &'a [MatRef<'a, f64>],
    y: &'a mut Mat<f64>,
}

impl NullaryFnOnce for Run<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Run { simulator, state, u, y } = self;
        let copies: Vec<Mat<f64>> =
            u.iter().map(|u| if u.try_as_col_major().is_none() { u.to_owned() } else { Mat::new() }).collect();
        let mut inputs: Vec<&[f64]> = Vec::new();
        for (u, copy) in u.iter().zip(&copies) {
            match u.try_as_col_major() {
                Some(u) => inputs.extend(u.col_iter().map(|c| c.as_slice())),
                None => inputs.extend((0..copy.ncols()).map(|j| copy.col_as_slice(j))),
            }
        }
        let samples = y.nrows();
        let mut outputs: Vec<&mut [f64]> =
            y.col_iter_mut().filter_map(|c| c.try_as_col_major_mut()).map(|c| c.as_slice_mut()).collect();
        // Slices change places in registers; vectors would do so in memory, at the price of a third of the step.
        let (mut now, mut next) = (&mut state.now[..], &mut state.next[..]);
        for k in 0..samples {
            for (value, column) in now.iter_mut().zip(&inputs) {
                *value = column[k];
            }
            simulator.multiply(now, next);
            for (column, value) in outputs.iter_mut().zip(&next[simulator.output_range()]) {
                column[k] = *value;
            }
            swap(&mut now, &mut next);
        }
        if samples % 2 == 1 {
            swap(&mut state.now, &mut state.next);
        }
    }
}

/// Whether the whole simulation stayed finite. A state that is not finite stays so, hence the last one tells of all.
fn is_finite(state: &SimulationState, y: &Mat<f64>) -> bool {
    let finite = |values: &[f64]| values.iter().fold(true, |all, v| all & v.is_finite());
    finite(state.x()) && (0..y.ncols()).all(|j| finite(y.col_as_slice(j)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eye;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn random(rows: usize, columns: usize, size: f64, rng: &mut ChaCha8Rng) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| {
            let x: f64 = StandardNormal.sample(rng);
            size * x
        })
    }

    fn random_system(n: usize, m: usize, p: usize, rng: &mut ChaCha8Rng) -> StateSpace<Discrete> {
        let a = random(n, n, 0.4 / (n.max(1) as f64).sqrt(), rng);
        let (b, c, d) = (random(n, m, 1.0, rng), random(p, n, 1.0, rng), random(p, m, 1.0, rng));
        StateSpace::new(a, b, c, d, Discrete::new(1.0).unwrap()).unwrap()
    }

    #[test]
    fn simulation_is_the_recursion() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (n, m, p) in [(0, 1, 1), (1, 1, 1), (6, 2, 2), (7, 3, 1), (20, 0, 4), (17, 4, 0), (0, 0, 2)] {
            let system = random_system(n, m, p, &mut rng);
            let u = random(50, m, 1.0, &mut rng);
            let mut x = random(n, 1, 1.0, &mut rng);
            let x0: Vec<f64> = x.col(0).iter().copied().collect();
            let y = simulate(&system, u.as_ref(), &x0).unwrap();
            for k in 0..50 {
                let now = u.row(k).transpose().as_mat().to_owned();
                let exact = system.c() * &x + system.d() * &now;
                for i in 0..p {
                    assert!((y[(k, i)] - exact[(i, 0)]).abs() < 1e-13 * (1.0 + exact[(i, 0)].abs()));
                }
                x = system.a() * &x + system.b() * now;
            }
        }
    }

    #[test]
    fn layout_of_the_record_does_not_matter() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let system = random_system(6, 2, 2, &mut rng);
        let u = random(40, 2, 1.0, &mut rng);
        let rows = u.transpose().to_owned();
        let x0 = [0.0; 6];
        assert_eq!(simulate(&system, u.as_ref(), &x0).unwrap(), simulate(&system, rows.transpose(), &x0).unwrap());
    }

    #[test]
    fn output_does_not_advance() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let simulator = Simulator::new(&random_system(6, 2, 2, &mut rng));
        let mut state = simulator.start(&[1.0; 6]).unwrap();
        let first = simulator.output(&mut state, &[0.5, -0.5]).to_vec();
        assert_eq!(state.x(), [1.0; 6]);
        assert_eq!(simulator.step(&mut state, &[0.5, -0.5]), first);
        assert_ne!(state.x(), [1.0; 6]);
    }

    #[test]
    fn divergence_names_the_pole() {
        let a = Mat::from_fn(2, 2, |i, j| [[0.5, 1.0], [0.0, 1.5]][i][j]);
        let system = StateSpace::new(a, eye(2), eye(2), Mat::zeros(2, 2), Discrete::new(1.0).unwrap()).unwrap();
        let u = Mat::zeros(10_000, 2);
        match simulate(&system, u.as_ref(), &[0.0, 1.0]) {
            Err(Error::Diverged { pole: Some(pole), sample, .. }) => {
                assert!((pole.re - 1.5).abs() < 1e-14);
                assert_eq!(sample, 1 + (f64::MAX.ln() / 1.5f64.ln()).ceil() as usize);
            }
            other => panic!("{:?}", other.map(|y| y.nrows())),
        }
    }

    #[test]
    fn bad_values_in_the_record_are_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let system = random_system(3, 1, 1, &mut rng);
        let mut u = random(20, 1, 1.0, &mut rng);
        u[(7, 0)] = f64::NAN;
        assert!(matches!(simulate(&system, u.as_ref(), &[0.0; 3]), Err(Error::NotFinite { row: 8, column: 1, .. })));
        assert!(matches!(simulate(&system, u.as_ref(), &[0.0; 2]), Err(Error::Shape { .. })));
    }
}
