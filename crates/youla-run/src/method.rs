//! The models of a run by name.

use serde::{Deserialize, Serialize};

/// A model of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Maximum likelihood: the model that a run recommends.
    Likelihood,
    /// G(0).
    Nominal,
    /// Subspace identification from (u, y).
    Direct,
    /// G(S).
    Hansen,
    /// The recommended model with fewer states.
    HansenReduced,
    /// The physical structure, by the prediction-error method.
    GreyBox,
    /// The simulated plant itself; in simulations only.
    TruePlant,
}

impl Method {
    /// All models.
    pub const ALL: [Method; 7] = [
        Method::Likelihood,
        Method::Nominal,
        Method::Direct,
        Method::Hansen,
        Method::HansenReduced,
        Method::GreyBox,
        Method::TruePlant,
    ];

    /// Key in summary.json and in file names.
    pub fn key(self) -> &'static str {
        match self {
            Method::Likelihood => "likelihood",
            Method::Nominal => "nominal",
            Method::Direct => "direct",
            Method::Hansen => "hansen",
            Method::HansenReduced => "hansen_reduced",
            Method::GreyBox => "grey_box",
            Method::TruePlant => "true_plant",
        }
    }

    /// Name in tables and figures.
    pub fn label(self) -> &'static str {
        match self {
            Method::Likelihood => "recommended",
            Method::Nominal => "nominal G(0)",
            Method::Direct => "direct subspace",
            Method::Hansen => "Hansen G(S)",
            Method::HansenReduced => "reduced",
            Method::GreyBox => "grey-box PEM",
            Method::TruePlant => "true plant",
        }
    }
}
