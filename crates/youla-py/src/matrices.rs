//! Matrices and models between NumPy and the library.

use crate::failure::{Failure, Result};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// A, B, C, D and the sample time, in seconds, from Python.
pub(crate) type ModelIn<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    f64,
);

/// The same to Python.
pub(crate) type ModelOut<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, f64);

/// A matrix as an array.
pub(crate) fn array<'py>(py: Python<'py>, m: MatRef<'_, f64>) -> Bound<'py, PyArray2<f64>> {
    Array2::from_shape_fn((m.nrows(), m.ncols()), |(i, j)| m[(i, j)]).into_pyarray(py)
}

/// An array as a matrix.
pub(crate) fn matrix(array: &PyReadonlyArray2<'_, f64>) -> Mat<f64> {
    let view = array.as_array();
    Mat::from_fn(view.nrows(), view.ncols(), |i, j| view[[i, j]])
}

/// A model as arrays.
pub(crate) fn model_out<'py>(py: Python<'py>, model: &StateSpace<Discrete>) -> ModelOut<'py> {
    let [a, b, c, d] = [model.a(), model.b(), model.c(), model.d()].map(|m| array(py, m));
    (a, b, c, d, model.time().ts())
}

/// Arrays as a model.
pub(crate) fn model_in(model: &ModelIn<'_>) -> Result<StateSpace<Discrete>> {
    let (a, b, c, d, ts) = model;
    let time = Discrete::new(*ts).map_err(Failure::from)?;
    Ok(StateSpace::new(matrix(a), matrix(b), matrix(c), matrix(d), time)?)
}
