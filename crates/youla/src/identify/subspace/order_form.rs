//! Orders in files: a number, or the word `"auto"`.

use super::Order;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The order of a model.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected a whole number, zero or positive, or \"auto\"")]
pub(crate) enum OrderForm {
    /// This order.
    Number(usize),
    /// The order that the records ask for.
    Word(AutoWord),
}

/// The word for a choice by the program.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum AutoWord {
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

impl From<OrderForm> for Order {
    fn from(form: OrderForm) -> Self {
        match form {
            OrderForm::Number(order) => Order::Fixed(order),
            OrderForm::Word(AutoWord::Auto) => Order::default(),
        }
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Order {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        OrderForm::schema_name()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        OrderForm::json_schema(generator)
    }
}

pub(crate) fn serialize<S: Serializer>(order: &Option<usize>, s: S) -> Result<S::Ok, S::Error> {
    order.map_or(OrderForm::Word(AutoWord::Auto), OrderForm::Number).serialize(s)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Option<usize>, D::Error> {
    Ok(match OrderForm::deserialize(d)? {
        OrderForm::Number(order) => Some(order),
        OrderForm::Word(AutoWord::Auto) => None,
    })
}
