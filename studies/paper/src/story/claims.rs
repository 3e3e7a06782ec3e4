//! What the paper claims, and what comes out here.

use super::{claims_experiments, claims_study};
use crate::study::Paper;
use serde::Serialize;

/// Difference in percentage points up to which fits count as similar.
pub(super) const SIMILAR: f64 = 5.0;

/// A claim of the paper beside what was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Name in files.
    pub key: &'static str,
    /// Where the paper says so.
    pub source: &'static str,
    /// What the paper says.
    pub claim: &'static str,
    /// Whether it comes out.
    pub outcome: ClaimOutcome,
    /// What was found, with numbers.
    pub text: String,
}

/// Whether a claim comes out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClaimOutcome {
    /// As the paper says.
    Holds,
    /// In direction, or on one axis, but not in full.
    Partly,
    /// Not.
    Fails,
    /// The rows do not decide: methods or loops are missing.
    Unknown,
}

impl ClaimOutcome {
    /// As words.
    pub fn words(self) -> &'static str {
        match self {
            ClaimOutcome::Holds => "comes out",
            ClaimOutcome::Partly => "in part",
            ClaimOutcome::Fails => "does not come out",
            ClaimOutcome::Unknown => "not shown",
        }
    }

    /// All or some of several conditions.
    pub(super) fn of(conditions: &[bool]) -> Self {
        match conditions.iter().filter(|met| **met).count() {
            0 => ClaimOutcome::Fails,
            met if met == conditions.len() => ClaimOutcome::Holds,
            _ => ClaimOutcome::Partly,
        }
    }
}

/// The claims of the paper on its figures and its table, each with what comes out and one or two sentences of numbers. They
/// are computed from the rows, and depend on nothing that differs from run to run.
pub fn paper_claims(paper: &Paper) -> Vec<Claim> {
    let mut claims = claims_study::claims(paper);
    claims.extend(claims_experiments::claims(paper));
    claims
}
