//! The uncertainty of the physical structure: regions of its frequency response and intervals of its modes.

use crate::Result;
use crate::stages::responses::ports;
use crate::summary::entries::ModeEntry;
use serde::Serialize;
use std::f64::consts::TAU;
use youla_greybox::{GreyBoxIntervals, ModeBand, ResponseBand};

/// The uncertainty of one system.
#[derive(Debug, Clone)]
pub struct SystemUncertainty {
    /// Confidence level.
    pub level: f64,
    /// Frequency response with its regions.
    pub response: ResponseBand,
    /// Modes with their intervals, in the order of the modes of the system.
    pub modes: Vec<ModeBand>,
}

/// That of the physical structure.
///
/// # Errors
/// Those of the frequency response and eigenvalues.
pub(crate) fn structure_uncertainty(known: &GreyBoxIntervals, hz: &[f64]) -> Result<SystemUncertainty> {
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    Ok(SystemUncertainty { level: known.level, response: known.response(&omega)?, modes: known.modes()? })
}

impl SystemUncertainty {
    /// As `uncertainty.json` holds it: per output and input the response, the bounds of its magnitude and the covariance of its
    /// parts.
    pub(crate) fn file<'a>(&self, hz: &'a [f64]) -> UncertaintyFile<'a> {
        let first = self.response.response.at(0);
        let entry = |(output, input): (usize, usize)| {
            let values = self.response.response.entry(output, input);
            let places = || (0..hz.len()).map(|k| self.response.place(k, output, input));
            ResponseEntry {
                output,
                input,
                real: values.iter().map(|v| v.re).collect(),
                imaginary: values.iter().map(|v| v.im).collect(),
                magnitude: places().map(|k| self.response.magnitude[k]).collect(),
                covariance: places().map(|k| self.response.covariance[k]).collect(),
            }
        };
        UncertaintyFile {
            level: self.level,
            hz,
            ellipse: self.response.ellipse,
            entries: ports(first.nrows(), first.ncols()).map(entry).collect(),
            modes: self.modes.iter().map(ModeEntry::from).collect(),
        }
    }
}

/// `uncertainty.json`.
#[derive(Serialize)]
pub(crate) struct UncertaintyFile<'a> {
    level: f64,
    hz: &'a [f64],
    ellipse: f64,
    entries: Vec<ResponseEntry>,
    modes: Vec<ModeEntry>,
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
