//! Zero-order-hold discretisation with derivatives.
//!
//! With `M = [A B; 0 0] ts` and `E = dM / dtheta`, the derivative of `exp(M) = [Ad Bd; 0 I]` is its Frechet derivative in
//! the direction E, which is the upper right block of
//! ```text
//! exp([M E; 0 M]) = [exp(M) L(M, E); 0 exp(M)]
//! ```
//! (C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978), 395; A. H. Al-Mohy and N. J. Higham, SIAM J. Matrix Anal. Appl.
//! 30 (2009), 1639). It is exact; an entry of A moves all entries of Ad and Bd.

use super::structure::{Matrix, Slope, Structure};
use crate::linalg::{block, check_shape, expm};
use crate::lti::{Continuous, Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, Scale};

/// The coordinates in which everything is computed: balanced states `x = diag(states) z` (powers of two).
pub(super) struct Coordinates {
    pub(super) states: Vec<f64>,
}

impl Coordinates {
    /// The model in these coordinates; `outputs` is its number of outputs.
    pub(super) fn apply(&self, model: &StateSpace<Continuous>, outputs: usize) -> Result<StateSpace<Continuous>> {
        let n = self.states.len();
        check_shape("the state matrix of the structure", model.a(), (n, n))?;
        check_shape("the feedthrough of the structure", model.d(), (outputs, model.inputs()))?;
        Ok(model.with_scaled_states(&self.states))
    }

    /// A derivative in these coordinates.
    fn slope(&self, Slope { matrix, row, column, value }: Slope) -> f64 {
        match matrix {
            Matrix::A => value * self.states[column] / self.states[row],
            Matrix::B => value / self.states[row],
            Matrix::C => value * self.states[column],
            Matrix::D => value,
        }
    }
}

/// Derivatives of a sampled model with respect to one parameter.
pub(super) struct SampledSlope {
    /// `[dAd dBd]`, n x (n + m).
    pub(super) states: Mat<f64>,
    /// `[dC dD]`, p x (n + m).
    pub(super) outputs: Mat<f64>,
}

/// Derivatives of the sampled model with respect to all parameters. `model` is the continuous one in `coordinates`.
pub(super) fn sampled_slopes(
    structure: &dyn Structure,
    theta: &[f64],
    model: &StateSpace<Continuous>,
    coordinates: &Coordinates,
    time: Discrete,
) -> Result<Vec<SampledSlope>> {
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let hold = Mat::zeros(m, n + m);
    // Inputs are scaled to the size of A, which changes nothing but the norm that the exponential sees.
    let size = model.a().norm_max();
    let inputs: Vec<f64> = model.b().col_iter().map(|b| ratio_or_one(size, b.norm_max())).collect();
    let b = Mat::from_fn(n, m, |i, j| model.b()[(i, j)] * inputs[j]);
    let generator = Scale(time.ts()) * block(&[&[model.a(), b.as_ref()], &[hold.as_ref()]]);
    let zero = Mat::zeros(n + m, n + m);
    (0..theta.len())
        .map(|parameter| {
            let mut direction = Mat::zeros(n + m, n + m);
            let mut outputs = Mat::zeros(p, n + m);
            for slope in structure.slopes(theta, parameter) {
                check_entry(slope, model)?;
                let value = coordinates.slope(slope);
                match slope.matrix {
                    Matrix::A => direction[(slope.row, slope.column)] += time.ts() * value,
                    Matrix::B => direction[(slope.row, n + slope.column)] += time.ts() * value * inputs[slope.column],
                    Matrix::C => outputs[(slope.row, slope.column)] += value,
                    Matrix::D => outputs[(slope.row, n + slope.column)] += value,
                }
            }
            let derivative = frechet(&generator, direction, &zero)?;
            let states =
                Mat::from_fn(
                    n,
                    n + m,
                    |i, j| if j < n { derivative[(i, j)] } else { derivative[(i, j)] / inputs[j - n] },
                );
            Ok(SampledSlope { states, outputs })
        })
        .collect()
}

/// Refuses a slope of an entry that does not exist.
fn check_entry(slope: Slope, model: &StateSpace<Continuous>) -> Result<()> {
    let matrix = match slope.matrix {
        Matrix::A => model.a(),
        Matrix::B => model.b(),
        Matrix::C => model.c(),
        Matrix::D => model.d(),
    };
    if slope.row < matrix.nrows() && slope.column < matrix.ncols() {
        return Ok(());
    }
    Err(Error::Shape {
        what: format!("the matrix {:?} of the structure", slope.matrix),
        expected: (slope.row + 1, slope.column + 1),
        found: (matrix.nrows(), matrix.ncols()),
    })
}

/// `L(M, E)`, linear in E, which is therefore brought to the size of M first.
fn frechet(generator: &Mat<f64>, direction: Mat<f64>, zero: &Mat<f64>) -> Result<Mat<f64>> {
    let n = generator.nrows();
    let size = ratio_or_one(generator.norm_max(), direction.norm_max());
    let scaled = Scale(size) * direction;
    let joint = block(&[&[generator.as_ref(), scaled.as_ref()], &[zero.as_ref(), generator.as_ref()]]);
    let step = expm("the state matrix times the sample time", joint.as_ref())?;
    Ok(Scale(1.0 / size) * step.as_ref().submatrix(0, n, n, n))
}

/// `a / b`, 1 where that is zero or not finite.
fn ratio_or_one(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    if ratio > 0.0 && ratio.is_finite() { ratio } else { 1.0 }
}
