//! From how many outputs on a search takes them one at a time.

/// Outputs from which their innovations count as independent and their normal equations are made one output at a time. Chosen: below, dense
/// normal equations with the whole covariance cost seconds.
const MANY_OUTPUTS: usize = 8;

/// Whether the outputs are taken one at a time.
pub(crate) fn separable(outputs: usize) -> bool {
    outputs >= MANY_OUTPUTS
}
