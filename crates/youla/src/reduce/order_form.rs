//! The order of a reduced model in files: a number, a word, or a table with one key.

use super::ReducedOrder;
use serde::{Deserialize, Serialize};

/// The order of a reduced model.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "expected a whole number, \"minimal\", \"auto\", or a table with the key bound or closed-loop"
)]
pub(super) enum ReducedForm {
    /// This number of states, with those of the poles that are kept apart.
    Number(usize),
    /// A choice that needs no number.
    Word(ReducedWord),
    /// The fewest states for which the error bound does not exceed this value, in output units per input unit or in the gap metric.
    Bound {
        /// The error bound.
        bound: f64,
    },
    /// The fewest states that the controller stabilises with a relative error of the closed loop from alpha to y of at most this.
    #[serde(rename_all = "kebab-case")]
    ClosedLoop {
        /// The relative error of the closed loop.
        closed_loop: f64,
    },
}

/// A reduced order that needs no number.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub(super) enum ReducedWord {
    /// All states that are controllable and observable to working precision: only exact cancellations are removed.
    Minimal,
    /// `{ closed-loop = 0.05 }`: the fewest states that change the closed loop by at most 5 %.
    Auto,
}

/// Relative error of the closed loop that `order = "auto"` allows: chosen, not measured. It keeps 9 of the 16 states of G(S) of
/// `youla demo --machine bearing`.
const AUTO_ERROR: f64 = 0.05;

impl From<ReducedOrder> for ReducedForm {
    fn from(order: ReducedOrder) -> Self {
        match order {
            ReducedOrder::Minimal => ReducedForm::Word(ReducedWord::Minimal),
            ReducedOrder::Fixed(order) => ReducedForm::Number(order),
            ReducedOrder::Bound(bound) => ReducedForm::Bound { bound },
            ReducedOrder::ClosedLoop(AUTO_ERROR) => ReducedForm::Word(ReducedWord::Auto),
            ReducedOrder::ClosedLoop(closed_loop) => ReducedForm::ClosedLoop { closed_loop },
        }
    }
}

impl From<ReducedForm> for ReducedOrder {
    fn from(form: ReducedForm) -> Self {
        match form {
            ReducedForm::Number(order) => ReducedOrder::Fixed(order),
            ReducedForm::Word(ReducedWord::Minimal) => ReducedOrder::Minimal,
            ReducedForm::Word(ReducedWord::Auto) => ReducedOrder::ClosedLoop(AUTO_ERROR),
            ReducedForm::Bound { bound } => ReducedOrder::Bound(bound),
            ReducedForm::ClosedLoop { closed_loop } => ReducedOrder::ClosedLoop(closed_loop),
        }
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for ReducedOrder {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        ReducedForm::schema_name()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        ReducedForm::json_schema(generator)
    }
}
