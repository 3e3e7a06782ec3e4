//! Channels: a name and a unit. Inside the library all quantities are SI or carry the unit named here.

use serde::{Deserialize, Serialize};

/// One signal of a record: its name, by which it is chosen, and the unit that plots and models state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Name, unique within a record.
    pub name: String,
    /// Unit label such as `um` or `V`; empty where none was given.
    #[serde(default)]
    pub unit: String,
}

impl Channel {
    /// A channel with a name and a unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Channel { name: name.into(), unit: unit.into() }
    }

    /// `name [unit]`, or the name alone where there is no unit.
    pub fn label(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) }
    }
}
