//! The order of the model: as given, or proposed from the canonical correlations.
//!
//! With T columns, canonical correlations `rho_1 >= rho_2 ...` (for the methods of closed loops those of SSARX) and
//! `d(n) = n (m + 2 p)` parameters,
//! ```text
//! SVC(n) = rho_{n+1}^2 + d(n) log(T) / T          NIC(n) = sum_{k>n} rho_k^2 + d(n) log(T) / T
//! ```
//! (Bauer, Automatica 37, 1561, 2001). The proposal is the least n that minimises SVC. The largest gap of the logarithmic
//! singular values is reported beside it; alone it is unusable, since measured data often have their largest gap after the
//! first value.

use super::Order;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// How an order was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderRule {
    /// Given by the caller.
    Fixed,
    /// Singular value criterion on the canonical correlations.
    Svc,
    /// As SVC, with the sum of all discarded values.
    Nic,
    /// Largest ratio of neighbouring singular values of the chosen weight.
    Gap,
}

/// What one rule proposes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct OrderCandidate {
    /// The rule.
    pub rule: OrderRule,
    /// Its order.
    pub order: usize,
}

/// The order of the model and its alternatives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderReport {
    /// Number of states.
    pub order: usize,
    /// How it was found.
    pub rule: OrderRule,
    /// What each rule proposes, among the orders up to the largest allowed (for a fixed order: that the horizon allows).
    pub candidates: Vec<OrderCandidate>,
    /// Canonical correlations between past and future, descending.
    pub canonical_correlations: Vec<f64>,
}

/// What the choice of the order depends on.
pub(super) struct Evidence<'a> {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) horizon: usize,
    /// Columns of the Hankel matrices.
    pub(super) columns: usize,
    /// Of the chosen weight, descending.
    pub(super) singular_values: &'a [f64],
    pub(super) canonical_correlations: Vec<f64>,
}

/// The order and its report.
pub(super) fn choose(choice: Order, evidence: Evidence<'_>) -> Result<OrderReport> {
    let Evidence { inputs, outputs, horizon, columns, singular_values: sigma, canonical_correlations } = evidence;
    let largest = (horizon - 1) * outputs;
    let (asked, rule) = match choice {
        Order::Fixed(n) => (n, OrderRule::Fixed),
        Order::Auto { max } => (max, OrderRule::Svc),
    };
    if asked == 0 {
        return Err(Error::OutOfRange { what: "the order of the model".into(), value: 0.0, must: "at least 1" });
    }
    if rule == OrderRule::Fixed && asked > largest {
        return Err(Error::OrderBeyondHorizon { order: asked, largest, horizon });
    }
    let max = if rule == OrderRule::Fixed { largest } else { asked.min(largest) };
    let penalty = (inputs + 2 * outputs) as f64 * (columns as f64).ln() / columns as f64;
    let at = |k: usize| canonical_correlations.get(k).map_or(0.0, |r| r * r);
    let svc = least(max, |n| at(n) + n as f64 * penalty);
    let nic = least(max, |n| (n..canonical_correlations.len()).map(at).sum::<f64>() + n as f64 * penalty);
    let gap = least(max, |n| sigma.get(n).map_or(0.0, |next| next / sigma[n - 1]));
    let candidates = [(OrderRule::Svc, svc), (OrderRule::Nic, nic), (OrderRule::Gap, gap)];
    Ok(OrderReport {
        order: if rule == OrderRule::Fixed { asked } else { svc },
        rule,
        candidates: candidates.map(|(rule, order)| OrderCandidate { rule, order }).to_vec(),
        canonical_correlations,
    })
}

/// The least n in 1..=max that minimises a criterion.
fn least(max: usize, criterion: impl Fn(usize) -> f64) -> usize {
    (1..=max).min_by(|a, b| criterion(*a).total_cmp(&criterion(*b))).unwrap_or(1)
}
