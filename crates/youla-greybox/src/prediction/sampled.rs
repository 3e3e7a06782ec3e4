//! The sampled model of a structure with derivatives, which those of discrete time give themselves.
//!
//! Behind a zero-order hold: with `M = [A B; 0 0] ts` and `E = dM / dtheta`, the derivative of `exp(M) = [Ad Bd; 0 I]` is its Frechet derivative in
//! the direction E, which is the upper right block of
//! ```text
//! exp([M E; 0 M]) = [exp(M) L(M, E); 0 exp(M)]
//! ```
//! (C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978), 395; A. H. Al-Mohy and N. J. Higham, SIAM J. Matrix Anal. Appl.
//! 30 (2009), 1639). It is exact; an entry of A moves all entries of Ad and Bd.

use crate::structure::{Matrix, Slope, Structure};
use crate::{Error, Result};
use faer::{Mat, Scale};
use youla::linalg::{block, check_shape, expm};
use youla::lti::{Continuous, Discrete, StateSpace, TimeDomain};

/// The coordinates in which everything is computed: balanced states `x = diag(states) z` (powers of two).
pub(crate) struct Coordinates {
    pub(crate) states: Vec<f64>,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
}

/// A structure at one parameter vector.
pub(crate) struct Sample {
    /// Before the hold; `None` of a structure of discrete time.
    pub(crate) continuous: Option<StateSpace<Continuous>>,
    pub(crate) discrete: StateSpace<Discrete>,
}

impl Coordinates {
    /// Those in which the model at `theta` is balanced.
    pub(crate) fn new(structure: &dyn Structure, theta: &[f64], time: Discrete) -> Result<Self> {
        match structure.sample_time() {
            None => Self::of(&structure.model(theta)?),
            Some(_) => Self::of(&structure.sampled(theta, time)?),
        }
    }

    fn of<T: TimeDomain>(model: &StateSpace<T>) -> Result<Self> {
        Ok(Coordinates { states: model.state_scales()?, inputs: model.inputs(), outputs: model.outputs() })
    }

    /// The model in these coordinates.
    fn apply<T: TimeDomain>(&self, model: &StateSpace<T>) -> Result<StateSpace<T>> {
        let n = self.states.len();
        check_shape("the state matrix of the structure", model.a(), (n, n))?;
        check_shape("the feedthrough of the structure", model.d(), (self.outputs, self.inputs))?;
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

/// The structure at `theta` in these coordinates.
pub(crate) fn sample(
    structure: &dyn Structure,
    theta: &[f64],
    coordinates: &Coordinates,
    time: Discrete,
) -> Result<Sample> {
    if structure.sample_time().is_some() {
        let discrete = coordinates.apply(&structure.sampled(theta, time)?)?;
        return Ok(Sample { continuous: None, discrete });
    }
    let continuous = coordinates.apply(&structure.model(theta)?)?;
    let discrete = continuous.zoh(time)?;
    Ok(Sample { continuous: Some(continuous), discrete })
}

/// Derivatives of a sampled model with respect to one parameter.
#[derive(Clone)]
pub(crate) struct SampledSlope {
    /// `[dAd dBd]`, n x (n + m).
    pub(crate) states: Mat<f64>,
    /// `[dC dD]`, p x (n + m).
    pub(crate) outputs: Mat<f64>,
}

/// Derivatives of the sampled model with respect to all parameters, at a sample in the same coordinates.
pub(crate) fn sampled_slopes(
    structure: &dyn Structure,
    theta: &[f64],
    sample: &Sample,
    coordinates: &Coordinates,
    time: Discrete,
) -> Result<Vec<SampledSlope>> {
    let of = |parameter: usize| structure.slopes(theta, parameter);
    match &sample.continuous {
        Some(model) => held_slopes((0..theta.len()).map(of), model, coordinates, time),
        None => {
            (0..theta.len()).map(|parameter| discrete_slope(of(parameter), &sample.discrete, coordinates)).collect()
        }
    }
}

/// The entries of a structure of discrete time are those of the sampled model.
fn discrete_slope(slopes: Vec<Slope>, model: &StateSpace<Discrete>, coordinates: &Coordinates) -> Result<SampledSlope> {
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let (mut states, mut outputs) = (Mat::zeros(n, n + m), Mat::zeros(p, n + m));
    for slope in slopes {
        check_entry(slope, model)?;
        let value = coordinates.slope(slope);
        match slope.matrix {
            Matrix::A => states[(slope.row, slope.column)] += value,
            Matrix::B => states[(slope.row, n + slope.column)] += value,
            Matrix::C => outputs[(slope.row, slope.column)] += value,
            Matrix::D => outputs[(slope.row, n + slope.column)] += value,
        }
    }
    Ok(SampledSlope { states, outputs })
}

/// Those of a model behind a zero-order hold.
fn held_slopes(
    slopes: impl Iterator<Item = Vec<Slope>>,
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
    slopes
        .map(|slopes| {
            let mut direction = Mat::zeros(n + m, n + m);
            let mut outputs = Mat::zeros(p, n + m);
            for slope in slopes {
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
fn check_entry<T: TimeDomain>(slope: Slope, model: &StateSpace<T>) -> Result<()> {
    let matrix = match slope.matrix {
        Matrix::A => model.a(),
        Matrix::B => model.b(),
        Matrix::C => model.c(),
        Matrix::D => model.d(),
    };
    if slope.row < matrix.nrows() && slope.column < matrix.ncols() {
        return Ok(());
    }
    Err(Error::Method(youla::Error::Shape {
        what: format!("the matrix {:?} of the structure", slope.matrix),
        expected: (slope.row + 1, slope.column + 1),
        found: (matrix.nrows(), matrix.ncols()),
    }))
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
