//! The methods that are compared.

use serde::{Deserialize, Serialize};

/// A model that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StudyMethod {
    /// The nominal model G(0) itself.
    Nominal,
    /// Grey-box prediction error, started at the nominal model.
    Pem,
    /// Grey-box prediction error, the best of several starts.
    PemMultiStart,
    /// Subspace identification of the plant from u and y.
    Direct,
    /// Modified Hansen scheme, G(S).
    Hansen,
    /// `G_red(S)` of eq. (29).
    HansenReduced,
    /// Grey-box prediction error, started at the projection of G(S).
    HansenPem,
    /// Maximum likelihood from u and y with order and dead time by evidence: what `youla identify` recommends without a key.
    Auto,
}

impl StudyMethod {
    /// All methods in the order in which they are listed.
    pub const ALL: [StudyMethod; 8] = [
        StudyMethod::Nominal,
        StudyMethod::Pem,
        StudyMethod::PemMultiStart,
        StudyMethod::Direct,
        StudyMethod::Hansen,
        StudyMethod::HansenReduced,
        StudyMethod::HansenPem,
        StudyMethod::Auto,
    ];

    /// Key in files.
    pub fn key(self) -> &'static str {
        match self {
            StudyMethod::Nominal => "nominal",
            StudyMethod::Pem => "pem",
            StudyMethod::PemMultiStart => "pem_multi_start",
            StudyMethod::Direct => "direct",
            StudyMethod::Hansen => "hansen",
            StudyMethod::HansenReduced => "hansen_reduced",
            StudyMethod::HansenPem => "hansen_pem",
            StudyMethod::Auto => "auto",
        }
    }

    /// Name in tables and figures.
    pub fn label(self) -> &'static str {
        match self {
            StudyMethod::Nominal => "nominal G(0)",
            StudyMethod::Pem => "PEM",
            StudyMethod::PemMultiStart => "PEM, several starts",
            StudyMethod::Direct => "direct N4SID",
            StudyMethod::Hansen => "Hansen G(S)",
            StudyMethod::HansenReduced => "Hansen reduced G_red(S)",
            StudyMethod::HansenPem => "PEM from Hansen",
            StudyMethod::Auto => "youla auto",
        }
    }

    /// The method with this key.
    pub fn of_key(key: &str) -> Option<StudyMethod> {
        StudyMethod::ALL.into_iter().find(|method| method.key() == key)
    }
}
