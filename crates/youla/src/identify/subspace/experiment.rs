//! The records of one experiment.

use faer::MatRef;

/// Records of one experiment: row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// Inputs, N x m.
    pub u: MatRef<'a, f64>,
    /// Outputs, N x p.
    pub y: MatRef<'a, f64>,
}
