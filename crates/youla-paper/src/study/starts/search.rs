//! What is compared.

use super::case::StartCase;
use serde::{Deserialize, Serialize};

/// A way to the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// Prediction error from the true parameters: the yardstick.
    Truth,
    /// Prediction error from the start.
    Pem,
    /// The same from several starts around it.
    PemMultiStart,
    /// Prediction error from the projection of G(S), in closed loop. The start is not used.
    HansenPem,
    /// Prediction error from the projection of a subspace model, in open loop. The start is not used.
    SubspacePem,
}

impl Search {
    /// All searches in the order in which they are listed.
    pub const ALL: [Search; 5] =
        [Search::Truth, Search::Pem, Search::PemMultiStart, Search::HansenPem, Search::SubspacePem];

    /// Those of a case, in order.
    pub fn of(case: StartCase) -> impl Iterator<Item = Search> {
        let left_out = if case.in_loop() { Search::SubspacePem } else { Search::HansenPem };
        Search::ALL.into_iter().filter(move |search| *search != left_out)
    }

    /// Key in files.
    pub fn key(self) -> &'static str {
        match self {
            Search::Truth => "truth",
            Search::Pem => "pem",
            Search::PemMultiStart => "pem_multi_start",
            Search::HansenPem => "hansen_pem",
            Search::SubspacePem => "subspace_pem",
        }
    }

    /// Name in tables and figures.
    pub fn label(self) -> &'static str {
        match self {
            Search::Truth => "PEM from the truth",
            Search::Pem => "PEM",
            Search::PemMultiStart => "PEM, several starts",
            Search::HansenPem => "PEM from Hansen",
            Search::SubspacePem => "PEM from subspace",
        }
    }

    /// The search with this key.
    pub fn of_key(key: &str) -> Option<Search> {
        Search::ALL.into_iter().find(|search| search.key() == key)
    }

    /// Whether it needs no start.
    pub fn without_start(self) -> bool {
        matches!(self, Search::HansenPem | Search::SubspacePem)
    }
}
