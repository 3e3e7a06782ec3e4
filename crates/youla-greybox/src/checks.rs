//! Checks of what belongs to the data and the structure.

use crate::structure::Structure;
use crate::{Error, Result};
use youla::MatRef;
use youla::identify::subspace::Experiment;
use youla::linalg::{check_finite, check_shape};
use youla::lti::Discrete;

/// A structure of discrete time serves data of its own sample time.
pub(super) fn check_time(structure: &dyn Structure, time: Discrete) -> Result<()> {
    match structure.sample_time() {
        Some(own) if (own.ts() / time.ts() - 1.0).abs() > 1e-6 => {
            let what = "the structure and the data".into();
            Err(Error::Method(youla::Error::SampleTimeMismatch { what, left: own.ts(), right: time.ts() }))
        }
        _ => Ok(()),
    }
}

/// One finite number for each parameter.
pub(super) fn check_start(start: &[f64], parameters: usize) -> Result<()> {
    let theta = MatRef::from_column_major_slice(start, start.len(), 1);
    check_shape("the start vector of the parameters", theta, (parameters, 1))?;
    check_finite("the start vector of the parameters", theta).map_err(Error::from)
}

/// Records of this many inputs and outputs with more values than unknowns; returns how many values.
pub(super) fn check_records(
    experiments: &[Experiment<'_>],
    (inputs, outputs): (usize, usize),
    unknowns: usize,
) -> Result<usize> {
    let mut rows = 0;
    for (k, Experiment { u, y, disturbance }) in experiments.iter().enumerate() {
        if disturbance.is_some() {
            let (what, instead) = ("a known disturbance in a grey-box estimate", "subtract it from the outputs first");
            return Err(Error::Method(youla::Error::Unsupported { what, instead }));
        }
        let named = |what: &str| format!("the {what} record of experiment {}", k + 1);
        check_shape(&named("input"), *u, (u.nrows(), inputs))?;
        check_shape(&named("output"), *y, (u.nrows(), outputs))?;
        check_finite(&named("input"), *u)?;
        check_finite(&named("output"), *y)?;
        rows += y.nrows() * y.ncols();
    }
    if rows > unknowns {
        return Ok(rows);
    }
    let what = format!("the output records ({unknowns} unknowns)");
    Err(Error::Method(youla::Error::TooFewSamples { what, found: rows, needed: unknowns + 1 }))
}

/// One positive size for each parameter.
pub(super) fn checked_scales(scales: Vec<f64>, parameters: usize) -> Result<Vec<f64>> {
    if scales.len() != parameters {
        let what = "the number of typical sizes of the structure".into();
        return Err(Error::Method(youla::Error::Ports { what, expected: parameters, found: scales.len() }));
    }
    match scales.iter().find(|size| !(**size > 0.0 && size.is_finite())) {
        Some(bad) => {
            let what = "a typical size of a parameter".into();
            Err(Error::Method(youla::Error::OutOfRange { what, value: *bad, must: "a positive number" }))
        }
        None => Ok(scales),
    }
}

/// One deviation for each output, 1 where none are given.
pub(super) fn checked_deviations(deviations: &[f64], outputs: usize) -> Result<Vec<f64>> {
    if deviations.is_empty() {
        return Ok(vec![1.0; outputs]);
    }
    if deviations.len() != outputs {
        let what = "the number of output deviations".into();
        return Err(Error::Method(youla::Error::Ports { what, expected: outputs, found: deviations.len() }));
    }
    match deviations.iter().find(|d| !(**d > 0.0 && d.is_finite())) {
        Some(bad) => Err(Error::Method(youla::Error::OutOfRange {
            what: "an output deviation".into(),
            value: *bad,
            must: "a positive number",
        })),
        None => Ok(deviations.to_vec()),
    }
}
