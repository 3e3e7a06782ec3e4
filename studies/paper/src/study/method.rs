//! The methods that are compared.

use serde::{Deserialize, Serialize};

/// A model that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
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

impl Method {
    /// All methods in the order in which they are listed.
    pub const ALL: [Method; 8] = [
        Method::Nominal,
        Method::Pem,
        Method::PemMultiStart,
        Method::Direct,
        Method::Hansen,
        Method::HansenReduced,
        Method::HansenPem,
        Method::Auto,
    ];

    /// Key in files.
    pub fn key(self) -> &'static str {
        match self {
            Method::Nominal => "nominal",
            Method::Pem => "pem",
            Method::PemMultiStart => "pem_multi_start",
            Method::Direct => "direct",
            Method::Hansen => "hansen",
            Method::HansenReduced => "hansen_reduced",
            Method::HansenPem => "hansen_pem",
            Method::Auto => "auto",
        }
    }

    /// Name in tables and figures.
    pub fn label(self) -> &'static str {
        match self {
            Method::Nominal => "nominal G(0)",
            Method::Pem => "PEM",
            Method::PemMultiStart => "PEM, several starts",
            Method::Direct => "direct N4SID",
            Method::Hansen => "Hansen G(S)",
            Method::HansenReduced => "Hansen reduced G_red(S)",
            Method::HansenPem => "PEM from Hansen",
            Method::Auto => "youla auto",
        }
    }

    /// The method with this key.
    pub fn of_key(key: &str) -> Option<Method> {
        Method::ALL.into_iter().find(|method| method.key() == key)
    }
}
