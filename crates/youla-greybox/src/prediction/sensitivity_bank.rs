//! The recursion of all sensitivities, eight columns at a time.
//!
//! ```text
//! X+ = Ad X + [dAd dBd] v,    Y = C X + [dC dD] v
//! ```
//! with a column of X (n x 8) for each sensitivity of a group and a coefficient of v for each of them. Four rows are summed side
//! by side, so that no sum waits for another; terms that are zero for all four rows and eight columns are left out beforehand.
//! The instructions are those of the widest registers of the processor.

use crate::prediction::sampled::SampledSlope;
use faer::MatRef;
use pulp::Simd;
use youla::lti::{Discrete, StateSpace};

/// Columns that are advanced together.
const LANES: usize = 8;
/// Rows that are summed side by side.
const ROWS: usize = 4;
/// Sensitivities below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;

type Lanes = [f64; LANES];

/// How a simulation begins.
pub(crate) struct InitialCondition<'a> {
    /// The initial state.
    pub(crate) x0: &'a [f64],
    /// x_theta(0), n x q; zero where `None`.
    pub(crate) slopes: Option<MatRef<'a, f64>>,
    /// n where the sensitivity to the initial state is wanted, else 0.
    pub(crate) estimated: usize,
}

/// All sensitivities, in groups of eight columns.
pub(crate) struct Bank {
    groups: Vec<Group>,
    columns: usize,
    outputs: usize,
}

/// Eight columns: their states and what moves them. States are padded to whole blocks.
struct Group {
    states: Vec<Lanes>,
    next: Vec<Lanes>,
    outputs: Vec<Lanes>,
    state_blocks: Vec<Block>,
    output_blocks: Vec<Block>,
}

/// Four rows of the recursion, without their zeros.
struct Block {
    /// State and its coefficients.
    states: Vec<(usize, [f64; ROWS])>,
    /// Signal of v and its coefficients for each column.
    signals: Vec<(usize, [Lanes; ROWS])>,
}

impl Bank {
    /// Sensitivities to the initial states that are estimated, then to the parameters of `slopes`.
    pub(crate) fn new(system: &StateSpace<Discrete>, slopes: &[SampledSlope], begin: &InitialCondition<'_>) -> Self {
        let (n, p, initial) = (system.order(), system.outputs(), begin.estimated);
        let columns = initial + slopes.len();
        let group = |first: usize| {
            let lanes = |value: &dyn Fn(usize) -> f64| std::array::from_fn(|lane| value(first + lane));
            let slope_of = |column: usize| column.checked_sub(initial).and_then(|theta| slopes.get(theta));
            let state_slope =
                |i: usize, b: usize| lanes(&|column| slope_of(column).map_or(0.0, |slope| slope.states[(i, b)]));
            let output_slope =
                |i: usize, b: usize| lanes(&|column| slope_of(column).map_or(0.0, |slope| slope.outputs[(i, b)]));
            let begun = |column: usize, i: usize| match (column.checked_sub(initial), begin.slopes) {
                (Some(theta), Some(moved)) if theta < moved.ncols() && i < n => moved[(i, theta)],
                (None, _) if column == i => 1.0,
                _ => 0.0,
            };
            let states: Vec<Lanes> = (0..n.next_multiple_of(ROWS)).map(|i| lanes(&|column| begun(column, i))).collect();
            Group {
                next: states.clone(),
                states,
                outputs: vec![[0.0; LANES]; p.next_multiple_of(ROWS)],
                state_blocks: blocks(system.a(), n + system.inputs(), state_slope),
                output_blocks: blocks(system.c(), n + system.inputs(), output_slope),
            }
        };
        Bank { groups: (0..columns).step_by(LANES).map(group).collect(), columns, outputs: p }
    }

    /// Hands out the sensitivities of the outputs, `write(output, column, value)`, and advances by one sample.
    #[inline(always)]
    pub(crate) fn step<S: Simd>(&mut self, simd: S, signals: &[f64], mut write: impl FnMut(usize, usize, f64)) {
        for (g, group) in self.groups.iter_mut().enumerate() {
            let columns = LANES.min(self.columns - g * LANES);
            apply(simd, &group.output_blocks, &group.states, signals, &mut group.outputs);
            for (i, values) in group.outputs.iter().enumerate().take(self.outputs) {
                values[..columns].iter().enumerate().for_each(|(lane, value)| write(i, g * LANES + lane, *value));
            }
            apply(simd, &group.state_blocks, &group.states, signals, &mut group.next);
            std::mem::swap(&mut group.states, &mut group.next);
        }
    }

    pub(crate) fn flush_subnormals(&mut self) {
        let values = self.groups.iter_mut().flat_map(|group| group.states.iter_mut().flatten());
        values.filter(|v| v.abs() < VANISHED).for_each(|v| *v = 0.0);
    }
}

/// The rows of `from` and of the slopes of v, in fours; rows beyond the last are zero.
fn blocks(from: MatRef<'_, f64>, signals: usize, slope: impl Fn(usize, usize) -> Lanes) -> Vec<Block> {
    let rows = from.nrows();
    let block = |first: usize| {
        let states = (0..from.ncols())
            .map(|j| (j, std::array::from_fn(|r| if first + r < rows { from[(first + r, j)] } else { 0.0 })));
        let signals = (0..signals)
            .map(|b| (b, std::array::from_fn(|r| if first + r < rows { slope(first + r, b) } else { [0.0; LANES] })));
        Block {
            states: states.filter(|(_, a): &(usize, [f64; ROWS])| a.iter().any(|a| *a != 0.0)).collect(),
            signals: signals.filter(|(_, s): &(usize, [Lanes; ROWS])| s.iter().flatten().any(|s| *s != 0.0)).collect(),
        }
    };
    (0..rows).step_by(ROWS).map(block).collect()
}

/// Sums the rows of all blocks into `results`.
#[inline(always)]
fn apply<S: Simd>(simd: S, blocks: &[Block], states: &[Lanes], signals: &[f64], results: &mut [Lanes]) {
    for (block, results) in blocks.iter().zip(results.chunks_exact_mut(ROWS)) {
        for part in 0..LANES / S::F64_LANES {
            let vector = |lanes: &Lanes| S::as_simd_f64s(lanes).0[part];
            let mut sums = [simd.splat_f64s(0.0); ROWS];
            for (j, coefficients) in &block.states {
                let state = vector(&states[*j]);
                for (sum, coefficient) in sums.iter_mut().zip(coefficients) {
                    *sum = simd.mul_add_e_f64s(simd.splat_f64s(*coefficient), state, *sum);
                }
            }
            for (b, coefficients) in &block.signals {
                let signal = simd.splat_f64s(signals[*b]);
                for (sum, coefficients) in sums.iter_mut().zip(coefficients) {
                    *sum = simd.mul_add_e_f64s(vector(coefficients), signal, *sum);
                }
            }
            for (result, sum) in results.iter_mut().zip(sums) {
                S::as_mut_simd_f64s(result).0[part] = sum;
            }
        }
    }
}
