//! A and C, which every estimate of B, D and the noise starts from.

use faer::Mat;

/// The matrices through which the states are seen.
#[derive(Clone)]
pub(crate) struct OutputPair {
    /// State matrix, n x n.
    pub(crate) a: Mat<f64>,
    /// Output matrix, p x n.
    pub(crate) c: Mat<f64>,
}
