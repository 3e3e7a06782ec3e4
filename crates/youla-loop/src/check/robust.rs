//! Regressions without the rows of wrong samples.

use super::regression::{Fit, Lagged};
use crate::error::Result;
use youla::statistics::robust_deviation;

/// Passes of a robust regression.
const PASSES: usize = 4;
/// Deviations from which a residual is great, and largest share of the rows that are left out.
/// One normal residual in 5e8. Chosen, not measured.
const SPIKE: f64 = 6.0;
const MOST: f64 = 0.1;

impl Lagged {
    /// A regression and its residuals without the rows of few great residuals and those that follow them: wrong samples would
    /// change the coefficients.
    pub(super) fn robust_fit(&self, targets: &[usize], columns: Vec<usize>) -> Result<(Fit, Vec<Vec<f64>>)> {
        let residuals = |fit: &Fit| -> Vec<Vec<f64>> {
            targets.iter().enumerate().map(|(i, target)| self.residual(fit, *target, i)).collect()
        };
        let mut fit = self.fit(targets, columns.clone())?;
        let mut e = residuals(&fit);
        let mut left_out = vec![false; self.rows];
        for _ in 0..PASSES {
            let mut now = vec![false; self.rows];
            for e in &e {
                let least = SPIKE * robust_deviation(e.iter().copied());
                for k in (0..e.len()).filter(|k| e[*k].abs() > least && least > 0.0) {
                    let last = (k + self.lags).min(now.len() - 1);
                    now[k..=last].fill(true);
                }
            }
            let count = now.iter().filter(|out| **out).count();
            if now == left_out || count as f64 > MOST * self.rows as f64 {
                break;
            }
            left_out.clone_from(&now);
            fit = self.without(now).fit(targets, columns.clone())?;
            e = residuals(&fit);
        }
        Ok((fit, e))
    }
}
