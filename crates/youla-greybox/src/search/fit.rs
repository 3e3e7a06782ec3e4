//! How well outputs are reproduced over several records.

use youla::{Mat, MatRef};

/// One output over all records.
pub(crate) struct Reproduction {
    /// `100 (1 - |y - yhat| / |y - mean y|)`, eq. (26), percent.
    pub(crate) fit: f64,
    /// Root mean square of `y - yhat`.
    pub(crate) residual: f64,
}

/// Per output, from the measured records and the errors `y - yhat` of each.
pub(crate) fn reproduction(measured: &[MatRef<'_, f64>], errors: &[Mat<f64>]) -> Vec<Reproduction> {
    let samples = errors.iter().map(|e| e.nrows()).sum::<usize>() as f64;
    let output = |i: usize| {
        let values = || measured.iter().flat_map(|y| y.col(i).iter());
        let mean = values().sum::<f64>() / samples;
        let spread = values().map(|y| (y - mean).powi(2)).sum::<f64>().sqrt();
        let error = errors.iter().map(|e| e.col(i).norm_l2()).fold(0.0, f64::hypot);
        Reproduction { fit: 100.0 * (1.0 - error / spread), residual: error / samples.sqrt() }
    };
    (0..measured.first().map_or(0, |y| y.ncols())).map(output).collect()
}
