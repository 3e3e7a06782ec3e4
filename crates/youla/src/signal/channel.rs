//! Channels: a name and a unit. Inside the library all quantities are SI or carry the unit named here.

use crate::Error;
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

/// The error for a name that does not exist, with the most similar one that does.
pub fn unknown(what: &str, name: &str, known: Vec<String>) -> Error {
    const LEAST: f64 = 0.5;
    let similarity = |candidate: &String| {
        // Names that differ this much in length are not compared, which would take time and memory by their product.
        let comparable = candidate.len() <= 2 * name.len() && name.len() <= 2 * candidate.len();
        let compare = || strsim::normalized_damerau_levenshtein(&candidate.to_lowercase(), &name.to_lowercase());
        if comparable { compare() } else { 0.0 }
    };
    let ranked = known.iter().map(|candidate| (similarity(candidate), candidate));
    let nearest = ranked.filter(|(s, _)| *s >= LEAST).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, n)| n.clone());
    Error::UnknownChannel { what: what.to_owned(), name: name.to_owned(), known, nearest }
}
