//! Evidence for or against a model: fit, variance accounted for, loop certificate, prediction on fresh data.

mod certificate;
mod fit;
mod predict;
mod residuals;

pub use certificate::{LoopCertificate, certify};
pub use fit::{fit, vaf};
pub use predict::{LoopExcitation, predict_closed_loop, predict_open_loop};
pub use residuals::{
    CrossCorrelogram, LargestCorrelation, PREDICTION_STEPS, RESIDUAL_LAGS, ResidualCorrelations, residual_correlations,
    step_fits,
};
