//! Frequency responses with their confidence regions as arrays.

use crate::failure::Result;
use numpy::ndarray::{Array3, Array4};
use numpy::{Complex64, IntoPyArray, PyArray3, PyArray4, PyReadonlyArray2};
use pyo3::prelude::*;
use std::f64::consts::TAU;
use youla::identify::likelihood::Region as Stated;
use youla::lti::{Discrete, FrequencyResponse, StateSpace, frequency_response};
use youla::{Mat, c64};
use youla_greybox::ResponseBand;

/// 95 % quantile of chi-square with two degrees of freedom, and of the normal distribution.
const ELLIPSE: f64 = 5.991_464_547_107_979;
const NORMAL: f64 = 1.959_963_984_540_054;

/// A response, the covariance of its parts, the bounds of its magnitude and the size of its ellipses, `[frequency, output, input, ..]`.
pub(crate) type RegionOut<'py> =
    (Bound<'py, PyArray3<Complex64>>, Option<(Bound<'py, PyArray4<f64>>, Bound<'py, PyArray4<f64>>, f64)>);

/// A response and its region.
pub(crate) struct Region {
    response: FrequencyResponse,
    known: Option<Known>,
}

struct Known {
    covariance: Array4<f64>,
    magnitude: Array4<f64>,
    ellipse: f64,
}

/// Angular frequencies of frequencies in Hz.
pub(crate) fn omega(hz: &[f64]) -> Vec<f64> {
    hz.iter().map(|f| TAU * f).collect()
}

impl Region {
    /// The response of a model of which no uncertainty is known.
    pub(crate) fn none(model: &StateSpace<Discrete>, hz: &[f64]) -> Result<Self> {
        Ok(Region { response: frequency_response(model, &omega(hz))?, known: None })
    }

    /// That of the recommended model.
    pub(crate) fn recommended(plant: &StateSpace<Discrete>, region: &Stated, hz: &[f64]) -> Result<Self> {
        let response = frequency_response(plant, &omega(hz))?;
        let (p, m) = (plant.outputs(), plant.inputs());
        let errors = region.entry_errors(hz);
        let covariance =
            Array4::from_shape_fn((hz.len(), p, m, 3), |(k, i, j, part)| errors[k].covariance((i, j))[part]);
        let magnitude = Array4::from_shape_fn((hz.len(), p, m, 2), |(k, i, j, side)| {
            let g = response.at(k)[(i, j)];
            let half = NORMAL * errors[k].of_magnitude(g, (i, j));
            if side == 0 { (g.norm() - half).max(0.0) } else { g.norm() + half }
        });
        Ok(Region { response, known: Some(Known { covariance, magnitude, ellipse: ELLIPSE }) })
    }

    /// That of a model with a band.
    pub(crate) fn band(band: ResponseBand) -> Self {
        let first = band.response.at(0);
        let shape = (band.response.omega.len(), first.nrows(), first.ncols());
        let covariance = Array4::from_shape_fn((shape.0, shape.1, shape.2, 3), |(k, i, j, c)| {
            band.covariance[band.place(k, i, j)][c]
        });
        let magnitude = Array4::from_shape_fn((shape.0, shape.1, shape.2, 2), |(k, i, j, c)| {
            band.magnitude[band.place(k, i, j)][c]
        });
        let known = Known { covariance, magnitude, ellipse: band.ellipse };
        Region { response: band.response, known: Some(known) }
    }

    /// As arrays.
    pub(crate) fn out<'py>(self, py: Python<'py>) -> RegionOut<'py> {
        let known = |k: Known| (k.covariance.into_pyarray(py), k.magnitude.into_pyarray(py), k.ellipse);
        (response_array(py, &self.response), self.known.map(known))
    }
}

/// A response, `[frequency, output, input]`.
pub(crate) fn response_array<'py>(py: Python<'py>, response: &FrequencyResponse) -> Bound<'py, PyArray3<Complex64>> {
    let (p, m) = match response.omega.is_empty() {
        true => (0, 0),
        false => (response.at(0).nrows(), response.at(0).ncols()),
    };
    let value = |(k, i, j)| {
        let g = response.at(k)[(i, j)];
        Complex64::new(g.re, g.im)
    };
    Array3::from_shape_fn((response.omega.len(), p, m), value).into_pyarray(py)
}

/// Standard deviation of a figure with these slopes in the entries of the response at a frequency.
pub(crate) fn along(region: &Stated, hz: f64, slopes: &PyReadonlyArray2<'_, Complex64>) -> f64 {
    let view = slopes.as_array();
    let (p, m) = view.dim();
    let slopes = Mat::from_fn(p, m, |i, j| c64::new(view[[i, j]].re, view[[i, j]].im));
    region.at(hz).along(slopes.as_ref())
}
