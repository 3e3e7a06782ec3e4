//! What models and controllers alone allow: responses, modes, simulation, the loop, reduction.

use crate::failure::Failure;
use crate::matrices::{ModelIn, ModelOut, array, matrix, model_in, model_out};
use crate::options::Options;
use crate::region::{omega, response_array};
use crate::worker;
use numpy::{Complex64, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use youla::Mat;
use youla::control::{closed_loop, with_input_port};
use youla::linalg::block;
use youla::reduce::{ReductionOptions, reduce as reduced};

/// The frequency response at frequencies in Hz, `[frequency, output, input]`.
#[pyfunction]
pub(crate) fn frequency_response<'py>(
    py: Python<'py>,
    model: ModelIn<'py>,
    hz: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
    let model = model_in(&model)?;
    let hz: Vec<f64> = hz.as_array().to_vec();
    let response = youla::lti::frequency_response(&model, &omega(&hz)).map_err(Failure::from)?;
    Ok(response_array(py, &response))
}

/// Frequency in Hz, damping ratio, real and imaginary part of the pole of each mode.
#[pyfunction]
pub(crate) fn modes(model: ModelIn<'_>) -> PyResult<Vec<(f64, f64, f64, f64)>> {
    let modes = model_in(&model)?.modes().map_err(Failure::from)?;
    Ok(modes.iter().map(|m| (m.hz, m.zeta, m.pole.re, m.pole.im)).collect())
}

/// The response of a model to inputs, samples x channels, from the state `x0`.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    model: ModelIn<'py>,
    inputs: PyReadonlyArray2<'py, f64>,
    x0: Vec<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (model, inputs) = (model_in(&model)?, matrix(&inputs));
    let y = py.detach(|| youla::lti::simulate(&model, inputs.as_ref(), &x0)).map_err(Failure::from)?;
    Ok(array(py, y.as_ref()))
}

/// Inputs and measured outputs of a loop.
type LoopOut<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// `u = K (y + n - r) + d` from rest; returns u and the measured y + n.
#[pyfunction]
pub(crate) fn simulate_loop<'py>(
    py: Python<'py>,
    plant: ModelIn<'py>,
    controller: ModelIn<'py>,
    signals: [PyReadonlyArray2<'py, f64>; 3],
) -> PyResult<LoopOut<'py>> {
    let (plant, controller) = (model_in(&plant)?, model_in(&controller)?);
    let [d, r, n] = [0, 1, 2].map(|k| matrix(&signals[k]));
    let (m, p) = (plant.inputs(), plant.outputs());
    let of_loop = move || {
        let closed = closed_loop(&plant, &with_input_port(&controller)?)?;
        let seen = &n - &r;
        let outside = block(&[&[d.as_ref(), seen.as_ref()]]);
        let x0 = vec![0.0; closed.order()];
        let both = youla::lti::simulate(&closed, outside.as_ref(), &x0)?;
        let u: Mat<f64> = both.as_ref().subcols(0, m).to_owned();
        // The output of the loop is what the controller sees, y + n - r.
        let y: Mat<f64> = both.as_ref().subcols(m, p) + &r;
        Ok::<_, youla::Error>((u, y))
    };
    let (u, y) = py.detach(of_loop).map_err(Failure::from)?;
    Ok((array(py, u.as_ref()), array(py, y.as_ref())))
}

/// Distance of a pole to the unit circle that is rounding of its computation. Chosen, not measured.
const ROUNDING: f64 = 1e-9;

/// Whether the loop is stable, real and imaginary parts of its poles, and the peak of the sensitivity.
type CertificateOut = (bool, Vec<(f64, f64)>, Option<f64>);

/// Whether a controller (positive feedback) stabilises a model, and the poles of the loop, real and imaginary parts.
#[pyfunction]
pub(crate) fn certify(model: ModelIn<'_>, controller: ModelIn<'_>) -> PyResult<CertificateOut> {
    let (model, controller) = (model_in(&model)?, model_in(&controller)?);
    let found = youla::validate::certify(&model, &controller).map_err(Failure::from)?;
    // A pole within rounding of the circle is none of a stable loop: its sensitivity has no peak that can be computed.
    let radius = found.poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let peak = match found.stable.then(|| youla::control::peak_sensitivity(&model, &controller)) {
        None => None,
        Some(Err(_)) if radius > 1.0 - ROUNDING => None,
        Some(peak) => Some(peak.map_err(Failure::from)?),
    };
    Ok((peak.is_some(), found.poles.iter().map(|p| (p.re, p.im)).collect(), peak))
}

/// A model with fewer states, its Hankel singular values and its bound of the error.
type Reduced<'py> = (ModelOut<'py>, Vec<f64>, Option<f64>);

/// A model with fewer states; `output_scale` are the sizes of the outputs that matter equally.
#[pyfunction]
#[pyo3(signature = (model, chosen, output_scale))]
pub(crate) fn reduce<'py>(
    py: Python<'py>,
    model: ModelIn<'py>,
    chosen: Options,
    output_scale: Option<Vec<f64>>,
) -> PyResult<Reduced<'py>> {
    let model = model_in(&model)?;
    let found = worker::run(py, false, move |_| {
        let chosen = ReductionOptions { output_scale, ..chosen.of("reduction")? };
        Ok(reduced(&model, &chosen)?)
    })?;
    Ok((model_out(py, &found.model), found.hankel.clone(), found.error_bound))
}
