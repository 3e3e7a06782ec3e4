//! Evidence for or against a model: fit, variance accounted for, certificates of the loop (exact, and over the region of
//! an uncertain model), prediction on fresh data.

mod band;
mod certificate;
mod exact;
mod fit;
mod k_step_fits;
mod margin_intervals;
mod predict;
mod residuals;

pub use band::{BandCertificate, BandOptions, certify_region};
pub use certificate::{LoopCertificate, certify};
pub use exact::{ExactCertificate, certify_deviation};
pub use fit::{fit, vaf};
pub use k_step_fits::{PREDICTION_STEPS, k_step_fits, k_step_fits_by_noise};
pub use margin_intervals::{MarginInterval, margin_intervals};
pub use predict::{LoopExcitation, predict_closed_loop, predict_open_loop};
pub use residuals::{CrossCorrelogram, LargestCorrelation, RESIDUAL_LAGS, ResidualCorrelations, residual_correlations};
