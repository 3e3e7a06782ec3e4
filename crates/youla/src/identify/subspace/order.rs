//! The order of the model: as given, or proposed by a rule.
//!
//! With T columns, canonical correlations `rho_1 >= rho_2 ...` (for the methods of closed loops those of SSARX), singular
//! values `sigma_k` of the chosen weight and `d(n) = n (m + 2 p)` parameters, each rule takes the least n that minimises
//! ```text
//! SVC(n) = rho_{n+1}^2 + d(n) log(T) / T    NIC(n) = sum_{k>n} rho_k^2 + d(n) log(T) / T    GAP(n) = sigma_{n+1} / sigma_n
//! ```
//! (Bauer, Automatica 37, 1561, 2001), or what `order_models.rs` finds with the models of all orders. The gap alone is
//! unusable where measured data have their largest gap after the first value, as they often do.

use super::{AutoOrder, Order, OrderRule};
use crate::error::OrderLimit;
use crate::{Error, Result};

/// What one rule proposes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OrderCandidate {
    /// The rule.
    pub rule: OrderRule,
    /// Its order.
    pub order: usize,
}

/// What a rule makes of one order.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OrderValue {
    /// The order.
    pub order: usize,
    /// The criterion, to be minimised; for cross-validation the mean simulated fit on the held-out data, percent, to be
    /// maximised. Absent where the model of this order is unstable or has no Kalman gain although the rule needs one.
    pub value: Option<f64>,
}

/// The order of the model and its alternatives.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OrderReport {
    /// Number of states.
    pub order: usize,
    /// How it was found; absent where it was given.
    pub rule: Option<OrderRule>,
    /// What each rule that needs no models proposes, and the one that was asked for, among the orders up to the largest
    /// allowed (for a fixed order: that the horizon allows).
    pub candidates: Vec<OrderCandidate>,
    /// The rule that was asked for, order by order; empty for a fixed order.
    pub values: Vec<OrderValue>,
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

/// The order by a rule that needs the models of all orders, `1..=max` in turn.
pub(super) struct ByModels {
    pub(super) order: usize,
    pub(super) values: Vec<OrderValue>,
}

/// Parameters of a model of order n in a canonical form, but for D.
pub(super) fn parameters(n: usize, inputs: usize, outputs: usize) -> f64 {
    (n * (inputs + 2 * outputs)) as f64
}

/// The order and its report; `by_models` is asked for the largest order to consider where the rule needs it.
pub(super) fn choose(
    choice: Order,
    evidence: Evidence<'_>,
    by_models: impl FnOnce(&AutoOrder, usize) -> Result<ByModels>,
) -> Result<OrderReport> {
    let largest = (evidence.horizon - 1) * evidence.outputs;
    check(match choice {
        Order::Fixed(n) => n,
        Order::Auto(auto) => auto.max,
    })?;
    let cheap = |rule, max| candidate(rule, values(rule, &evidence, max));
    let rules = [OrderRule::Svc, OrderRule::Nic, OrderRule::Gap];
    let (order, rule, max, values) = match choice {
        Order::Fixed(order) if order > largest => {
            return Err(Error::Order { order, limit: OrderLimit::Horizon { largest, horizon: evidence.horizon } });
        }
        Order::Fixed(order) => (order, None, largest, Vec::new()),
        Order::Auto(auto) if auto.rule.needs_models() => {
            let found = by_models(&auto, auto.max.min(largest))?;
            (found.order, Some(auto.rule), auto.max.min(largest), found.values)
        }
        Order::Auto(AutoOrder { max, rule, .. }) => {
            let max = max.min(largest);
            (cheap(rule, max).order, Some(rule), max, values(rule, &evidence, max))
        }
    };
    let mut candidates: Vec<OrderCandidate> = rules.map(|rule| cheap(rule, max)).to_vec();
    candidates.extend(rule.filter(|r| r.needs_models()).map(|rule| OrderCandidate { rule, order }));
    Ok(OrderReport { order, rule, candidates, values, canonical_correlations: evidence.canonical_correlations })
}

/// Refuses a model without states.
pub(super) fn check(order: usize) -> Result<()> {
    match order {
        0 => Err(Error::OutOfRange { what: "the order of the model".into(), value: 0.0, must: "at least 1" }),
        _ => Ok(()),
    }
}

fn candidate(rule: OrderRule, values: Vec<OrderValue>) -> OrderCandidate {
    OrderCandidate { rule, order: least(&values).unwrap_or(1) }
}

/// A criterion of the singular values for all orders up to `max`.
fn values(rule: OrderRule, evidence: &Evidence<'_>, max: usize) -> Vec<OrderValue> {
    let Evidence { inputs, outputs, columns, singular_values: sigma, canonical_correlations: rho, .. } = evidence;
    let penalty = |n| parameters(n, *inputs, *outputs) * (*columns as f64).ln() / *columns as f64;
    let squared = |k: usize| rho.get(k).map_or(0.0, |r| r * r);
    let value = |n: usize| match rule {
        OrderRule::Gap => sigma.get(n).map_or(0.0, |next| next / sigma[n - 1]),
        OrderRule::Nic => (n..rho.len()).map(squared).sum::<f64>() + penalty(n),
        _ => squared(n) + penalty(n),
    };
    (1..=max).map(|order| OrderValue { order, value: Some(value(order)) }).collect()
}

/// The least order that minimises a criterion.
pub(super) fn least(values: &[OrderValue]) -> Option<usize> {
    let known = values.iter().filter_map(|v| Some((v.order, v.value.filter(|x| !x.is_nan())?)));
    known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(order, _)| order)
}
