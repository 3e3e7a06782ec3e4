//! The one-step predictor of the innovation form, with a free gain.
//!
//! ```text
//! x+ = (Ad - K C) x + [Bd - K D,  K] [u; y],    yhat = C x + D u
//! ```
//! The entries are linear in (Ad, Bd, D), C and K one by one, so that the slopes follow by the product rule; those of K are
//! `dA = -e_i C_j, dB = [-e_i D_j, e_i e_j']` (L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, section 4.3).
//! A predictor that is not stable predicts nothing from old data and is refused.

use crate::Result;
use crate::prediction::sampled::SampledSlope;
use youla::linalg::{block, check_finite, check_shape};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// The gain at the start, n x p, in the states of the structure.
pub(crate) struct Predictor {
    start: Mat<f64>,
}

impl Predictor {
    /// `rows` of K, none for zero.
    pub(crate) fn new(rows: &[Vec<f64>], order: usize, outputs: usize) -> Result<Self> {
        let what = "the innovation gain at the start";
        let start =
            if rows.is_empty() { Mat::zeros(order, outputs) } else { crate::prediction::noise::matrix(what, rows)? };
        check_shape(what, start.as_ref(), (order, outputs))?;
        check_finite(what, start.as_ref())?;
        Ok(Predictor { start })
    }

    /// Number of entries of K.
    pub(crate) fn gains(&self) -> usize {
        self.start.nrows() * self.start.ncols()
    }

    /// K at the start in the states z, `x = diag(states) z`, column by column.
    pub(crate) fn start(&self, states: &[f64]) -> Vec<f64> {
        self.start.col_iter().flat_map(|column| column.iter().zip(states).map(|(k, t)| k / t)).collect()
    }

    /// K in the states of the structure.
    pub(crate) fn gain(&self, entries: &[f64], states: &[f64]) -> Mat<f64> {
        let (n, p) = (self.start.nrows(), self.start.ncols());
        Mat::from_fn(n, p, |i, j| entries[j * n + i] * states[i])
    }

    fn matrix<'a>(&self, entries: &'a [f64]) -> MatRef<'a, f64> {
        MatRef::from_column_major_slice(entries, self.start.nrows(), self.start.ncols())
    }

    /// The predictor from `[u; y]` to yhat.
    pub(crate) fn system(&self, plant: &StateSpace<Discrete>, entries: &[f64]) -> Result<StateSpace<Discrete>> {
        let k = self.matrix(entries);
        let (p, c, d) = (plant.outputs(), plant.c(), plant.d());
        let input = block(&[&[(plant.b() - k * d).as_ref(), k]]);
        let direct = block(&[&[d, Mat::zeros(p, p).as_ref()]]);
        let predictor = StateSpace::new(plant.a() - k * c, input, c.to_owned(), direct, plant.time())?;
        predictor.require_stable("the predictor A - K C")?;
        Ok(predictor)
    }

    /// Its slopes: those of the parameters of the plant, then those of K.
    pub(crate) fn slopes(
        &self,
        plant: &StateSpace<Discrete>,
        entries: &[f64],
        of_plant: Vec<SampledSlope>,
    ) -> Vec<SampledSlope> {
        let (n, m, p) = (plant.order(), plant.inputs(), plant.outputs());
        let k = self.matrix(entries);
        let wider = |slope: SampledSlope| {
            let states = &slope.states - k * &slope.outputs;
            let wide = |s: &Mat<f64>| block(&[&[s.as_ref(), Mat::zeros(s.nrows(), p).as_ref()]]);
            SampledSlope { states: wide(&states), outputs: wide(&slope.outputs) }
        };
        let of_gain = |entry: usize| {
            let (row, output) = (entry % n, entry / n);
            let mut states = Mat::zeros(n, n + m + p);
            (0..n).for_each(|j| states[(row, j)] = -plant.c()[(output, j)]);
            (0..m).for_each(|j| states[(row, n + j)] = -plant.d()[(output, j)]);
            states[(row, n + m + output)] = 1.0;
            SampledSlope { states, outputs: Mat::zeros(p, n + m + p) }
        };
        of_plant.into_iter().map(wider).chain((0..self.gains()).map(of_gain)).collect()
    }
}
