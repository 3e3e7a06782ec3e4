//! `[certificate]`: what a run states about the loop of its model beyond the poles of the estimate.

use serde::{Deserialize, Serialize};

/// Choices of the certificate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CertificateSettings {
    /// Whether S is identified again with a controller that is described wrongly: a delay, a gain 5 % off, u cut at 90 %.
    pub controller_errors: bool,
}
