//! The order of the model: as given, or proposed by the singular value criterion.
//!
//! With T columns, canonical correlations `rho_1 >= rho_2 ...` (for the methods of closed loops those of SSARX) and
//! `d(n) = n (m + 2 p)` parameters it takes the least n that minimises
//! ```text
//! SVC(n) = rho_{n+1}^2 + d(n) log(T) / T
//! ```
//! (Bauer, Automatica 37, 1561, 2001).

use crate::error::OrderLimit;
use crate::identify::subspace::Order;
use crate::{Error, Result};

/// The order of the model and what it was chosen by.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OrderReport {
    /// Number of states.
    pub order: usize,
    /// The criterion for an order of 1, 2, ...; empty where the order was given.
    pub criterion: Vec<f64>,
    /// Canonical correlations between past and future, descending.
    pub canonical_correlations: Vec<f64>,
}

/// What the choice of the order depends on.
pub(super) struct Evidence {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) horizon: usize,
    /// Columns of the Hankel matrices.
    pub(super) columns: usize,
    pub(super) canonical_correlations: Vec<f64>,
}

/// The order and its report.
pub(super) fn choose(choice: Order, evidence: Evidence) -> Result<OrderReport> {
    let largest = (evidence.horizon - 1) * evidence.outputs;
    let (Order::Fixed(asked) | Order::Auto(asked)) = choice;
    check(asked)?;
    let (order, criterion) = match choice {
        Order::Fixed(order) if order > largest => {
            return Err(Error::Order { order, limit: OrderLimit::Horizon { largest, horizon: evidence.horizon } });
        }
        Order::Fixed(order) => (order, Vec::new()),
        Order::Auto(max) => {
            let criterion = singular_value_criterion(&evidence, max.min(largest));
            let least = (0..criterion.len()).min_by(|a, b| criterion[*a].total_cmp(&criterion[*b]));
            (1 + least.unwrap_or(0), criterion)
        }
    };
    Ok(OrderReport { order, criterion, canonical_correlations: evidence.canonical_correlations })
}

/// Refuses a model without states.
pub(super) fn check(order: usize) -> Result<()> {
    match order {
        0 => Err(Error::OutOfRange { what: "the order of the model".into(), value: 0.0, must: "at least 1" }),
        _ => Ok(()),
    }
}

fn singular_value_criterion(evidence: &Evidence, max: usize) -> Vec<f64> {
    let Evidence { inputs, outputs, columns, canonical_correlations: rho, .. } = evidence;
    let columns = *columns as f64;
    let parameters = |n: usize| (n * (inputs + 2 * outputs)) as f64;
    let left_out = |n: usize| rho.get(n).map_or(0.0, |r| r * r);
    (1..=max).map(|n| left_out(n) + parameters(n) * columns.ln() / columns).collect()
}
