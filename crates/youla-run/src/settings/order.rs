//! Orders in run.toml: a number, a word, or a table with one key.

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Error, IgnoredAny, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;
use youla::identify::subspace::Order;
use youla::reduce::ReducedOrder;

/// An order as run.toml writes it.
pub(in crate::settings) trait Written: Sized {
    /// What is written for it.
    type Form: Serialize + From<Self>;
    /// The keys of its table.
    type Keys: DeserializeOwned;
    /// What a value must be, for messages.
    const MUST: &'static str;
    /// `None` for an unknown word, and unless exactly one key of a table is given.
    fn read(value: Value<'_, Self::Keys>) -> Option<Self>;
}

/// What may stand for an order.
pub(in crate::settings) enum Value<'a, K> {
    Number(usize),
    Word(&'a str),
    Table(K),
}

impl<T: Written> OrderVisitor<T> {
    fn read<E: Error>(self, value: Value<'_, T::Keys>, unexpected: Unexpected<'_>) -> Result<T, E> {
        T::read(value).ok_or_else(|| E::invalid_value(unexpected, &self))
    }
}

pub(in crate::settings) fn serialize<T: Written + Copy, S: Serializer>(order: &T, s: S) -> Result<S::Ok, S::Error> {
    T::Form::from(*order).serialize(s)
}

pub(in crate::settings) fn deserialize<'de, T: Written, D: Deserializer<'de>>(d: D) -> Result<T, D::Error> {
    d.deserialize_any(OrderVisitor(PhantomData))
}

struct OrderVisitor<T>(PhantomData<T>);

impl<'de, T: Written> Visitor<'de> for OrderVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::MUST)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<T, E> {
        let order = usize::try_from(value).map_err(|_| E::invalid_value(Unexpected::Signed(value), &self))?;
        self.read(Value::Number(order), Unexpected::Signed(value))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<T, E> {
        let order = usize::try_from(value).map_err(|_| E::invalid_value(Unexpected::Unsigned(value), &self))?;
        self.read(Value::Number(order), Unexpected::Unsigned(value))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<T, E> {
        self.read(Value::Word(value), Unexpected::Str(value))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        let keys = T::Keys::deserialize(MapAccessDeserializer::new(map))?;
        self.read(Value::Table(keys), Unexpected::Map)
    }
}

/// The order of a model.
#[derive(Serialize, schemars::JsonSchema)]
#[serde(untagged)]
#[schemars(deny_unknown_fields)]
pub(in crate::settings) enum OrderForm {
    /// This order.
    Number(usize),
    /// What the singular value criterion proposes, at most 12.
    Word(AutoWord),
}

/// The word for a choice by the program.
#[derive(Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(in crate::settings) enum AutoWord {
    /// The program chooses.
    Auto,
}

impl From<Order> for OrderForm {
    fn from(order: Order) -> Self {
        match order {
            Order::Fixed(order) => OrderForm::Number(order),
            Order::Auto(_) => OrderForm::Word(AutoWord::Auto),
        }
    }
}

impl Written for Order {
    type Form = OrderForm;
    type Keys = IgnoredAny;
    const MUST: &'static str = "a whole number or \"auto\"";

    fn read(value: Value<'_, IgnoredAny>) -> Option<Self> {
        match value {
            Value::Number(order) => Some(Order::Fixed(order)),
            Value::Word("auto") => Some(Order::default()),
            _ => None,
        }
    }
}

/// The order of a reduced model.
#[derive(Serialize, schemars::JsonSchema)]
#[serde(untagged)]
#[schemars(deny_unknown_fields)]
pub(in crate::settings) enum ReducedForm {
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
#[derive(Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(in crate::settings) enum ReducedWord {
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

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(in crate::settings) struct ReducedKeys {
    fixed: Option<usize>,
    bound: Option<f64>,
    closed_loop: Option<f64>,
}

impl Written for ReducedOrder {
    type Form = ReducedForm;
    type Keys = ReducedKeys;
    const MUST: &'static str = "a whole number, \"minimal\", \"auto\", or a table with the key bound or closed-loop";

    fn read(value: Value<'_, ReducedKeys>) -> Option<Self> {
        let keys = match value {
            Value::Number(order) => return Some(ReducedOrder::Fixed(order)),
            Value::Word("minimal") => return Some(ReducedOrder::Minimal),
            Value::Word("auto") => return Some(ReducedOrder::ClosedLoop(AUTO_ERROR)),
            Value::Word(_) => return None,
            Value::Table(keys) => (keys.fixed, keys.bound, keys.closed_loop),
        };
        match keys {
            (Some(order), None, None) => Some(ReducedOrder::Fixed(order)),
            (None, Some(bound), None) => Some(ReducedOrder::Bound(bound)),
            (None, None, Some(error)) => Some(ReducedOrder::ClosedLoop(error)),
            _ => None,
        }
    }
}
