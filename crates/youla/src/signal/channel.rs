//! Channels: a name and a unit. Inside the library all quantities are SI or carry the unit named here.

use crate::Error;

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
    // At least half of the letters agree, in their order.
    const LEAST: f64 = 0.5;
    let ranked = known.iter().map(|candidate| (similarity(candidate, name), candidate));
    let nearest = ranked.filter(|(s, _)| *s >= LEAST).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, n)| n.clone());
    Error::UnknownChannel { what: what.to_owned(), name: name.to_owned(), known, nearest }
}

/// 1 less the edit distance over the length of the longer name, without regard to capitals; insertions, deletions,
/// substitutions and exchanges of neighbours cost one each (optimal string alignment).
fn similarity(one: &str, other: &str) -> f64 {
    // Names that differ this much in length are not compared, which would take time and memory by their product.
    if one.len() > 2 * other.len() || other.len() > 2 * one.len() {
        return 0.0;
    }
    let [one, other] = [one, other].map(|name| name.to_lowercase().chars().collect::<Vec<_>>());
    let mut before = vec![0; other.len() + 1];
    let mut last: Vec<usize> = (0..=other.len()).collect();
    for i in 1..=one.len() {
        let mut row = vec![i; other.len() + 1];
        for j in 1..=other.len() {
            let substituted = last[j - 1] + usize::from(one[i - 1] != other[j - 1]);
            row[j] = substituted.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && one[i - 1] == other[j - 2] && one[i - 2] == other[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        (before, last) = (last, row);
    }
    1.0 - last[other.len()] as f64 / one.len().max(other.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found() {
        for (one, other, edits, length) in
            [("alpha", "Alpha", 0, 5), ("apha", "alpha", 1, 5), ("ahlpa", "alpha", 2, 5), ("hroizon", "horizon", 1, 7)]
        {
            assert_eq!(similarity(one, other), 1.0 - f64::from(edits) / f64::from(length), "{one} {other}");
        }
        let known = || ["u1".to_owned(), "displacement".to_owned()].to_vec();
        assert!(matches!(unknown("x", "u2", known()), Error::UnknownChannel { nearest: Some(n), .. } if n == "u1"));
        assert!(matches!(unknown("x", "voltage", known()), Error::UnknownChannel { nearest: None, .. }));
    }
}
