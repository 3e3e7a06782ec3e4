//! Channels: a name and a unit. Inside the library all quantities are SI or carry the unit named here.

use crate::Error;
use crate::error::nearest_name;

/// One signal of a record: its name, by which it is chosen, and the unit that plots and models state.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Channel {
    /// Name, unique within a record.
    pub name: String,
    /// Unit label such as `um` or `V`; empty where none was given.
    #[cfg_attr(feature = "serde", serde(default))]
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

/// The error for a name that does not exist, with the most similar one that does.
pub fn unknown(what: &str, name: &str, known: Vec<String>) -> Error {
    let nearest = nearest_name(name, known.iter().map(String::as_str)).map(str::to_owned);
    Error::UnknownChannel { what: what.to_owned(), name: name.to_owned(), known, nearest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found() {
        let known = || ["u1".to_owned(), "displacement".to_owned()].to_vec();
        assert!(matches!(unknown("x", "u2", known()), Error::UnknownChannel { nearest: Some(n), .. } if n == "u1"));
        assert!(matches!(unknown("x", "voltage", known()), Error::UnknownChannel { nearest: None, .. }));
    }
}
