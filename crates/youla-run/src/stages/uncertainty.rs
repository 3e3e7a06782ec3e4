//! The uncertainty of the physical structure: regions of its frequency response and intervals of its modes.

use crate::Result;
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
