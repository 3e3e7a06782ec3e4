//! `[certificate]`: what a run states about the loop of its model beyond the poles of the estimate.

use serde::{Deserialize, Serialize};
use youla::validate::BandOptions;

/// Choices of the certificate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CertificateSettings {
    /// Models that are drawn from the region of S, where its uncertainty was asked for.
    pub band: BandOptions,
    /// Whether S is identified again with a controller that is described wrongly.
    pub controller_errors: bool,
    /// Relative error of the gain of the controller that is tried, both ways.
    pub gain_error: f64,
    /// Limit of u that is tried, as a part of the largest |u| of each record and channel.
    pub saturation: f64,
}

impl Default for CertificateSettings {
    fn default() -> Self {
        CertificateSettings {
            band: BandOptions::default(),
            controller_errors: false,
            gain_error: 0.05,
            saturation: 0.9,
        }
    }
}

impl CertificateSettings {
    /// What is wrong with the numbers.
    pub(in crate::settings) fn problem(&self) -> Option<String> {
        let part = |x: f64| x > 0.0 && x < 1.0;
        match self {
            _ if self.band.draws < 20 => {
                Some(format!("[certificate] band.draws is {}, but must be at least 20", self.band.draws))
            }
            _ if !part(self.gain_error) => {
                Some(format!("[certificate] gain_error is {}, but must be above 0 and below 1", self.gain_error))
            }
            _ if !part(self.saturation) => {
                Some(format!("[certificate] saturation is {}, but must be above 0 and below 1", self.saturation))
            }
            _ => None,
        }
    }
}
