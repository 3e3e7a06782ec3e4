//! `grey_box_uncertainty.json`.

use crate::stages::responses::ports;
use crate::stages::uncertainty::SystemUncertainty;
use crate::summary::entries::{ModeEntry, RealPoleEntry, apart};
use serde::Serialize;

/// Per output and input the response, the bounds of its magnitude and the covariance of its parts; then modes and real poles.
#[derive(Serialize)]
pub(super) struct UncertaintyFile<'a> {
    level: f64,
    hz: &'a [f64],
    ellipse: f64,
    entries: Vec<ResponseEntry>,
    modes: Vec<ModeEntry>,
    real_poles: Vec<RealPoleEntry>,
}

#[derive(Serialize)]
struct ResponseEntry {
    output: usize,
    input: usize,
    real: Vec<f64>,
    imaginary: Vec<f64>,
    magnitude: Vec<[f64; 2]>,
    covariance: Vec<[f64; 3]>,
}

impl<'a> UncertaintyFile<'a> {
    pub(super) fn new(known: &SystemUncertainty, hz: &'a [f64]) -> Self {
        let first = known.response.response.at(0);
        let entry = |(output, input): (usize, usize)| {
            let values = known.response.response.entry(output, input);
            let places = || (0..hz.len()).map(|k| known.response.place(k, output, input));
            ResponseEntry {
                output,
                input,
                real: values.iter().map(|v| v.re).collect(),
                imaginary: values.iter().map(|v| v.im).collect(),
                magnitude: places().map(|k| known.response.magnitude[k]).collect(),
                covariance: places().map(|k| known.response.covariance[k]).collect(),
            }
        };
        let (modes, real_poles) = apart(known.modes.iter().map(|band| (band.mode.pole, ModeEntry::from(band))));
        UncertaintyFile {
            level: known.level,
            hz,
            ellipse: known.response.ellipse,
            entries: ports(first.nrows(), first.ncols()).map(entry).collect(),
            modes,
            real_poles,
        }
    }
}
