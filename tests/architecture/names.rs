//! The names of public types.

use super::documents::identifiers;
use super::files::{members, sources};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Each crate has its own, as those of the standard library have.
const OF_EACH_CRATE: [&str; 2] = ["Error", "Result"];

/// The name of the public type that a line declares.
fn declared(line: &str) -> Option<&str> {
    let item = line.trim_start().strip_prefix("pub ")?;
    let name = ["struct ", "enum ", "trait ", "type ", "union "].iter().find_map(|kind| item.strip_prefix(kind))?;
    identifiers(name).next()
}

#[test]
fn no_public_type_has_the_name_of_another() {
    let mut places: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for file in members().iter().flat_map(|folder| sources(&folder.join("src"))) {
        let text = fs::read_to_string(&file).expect("readable");
        for name in text.lines().filter_map(declared) {
            places.entry(name.to_owned()).or_default().push(file.clone());
        }
    }
    assert!(places.len() > 300, "{}", places.len());
    let twice: Vec<_> =
        places.iter().filter(|(name, files)| files.len() > 1 && !OF_EACH_CRATE.contains(&name.as_str())).collect();
    assert!(twice.is_empty(), "{twice:#?}");
}
