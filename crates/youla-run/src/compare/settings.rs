//! In which settings the runs differ.

use super::run::FinishedRun;
use crate::Result;
use hmac_sha256::Hash;
use std::collections::BTreeMap;
use youla_io::toml_file;
use youla_report::data::EvidenceTable;

/// Key, as a path through the tables of run.toml, and value.
type Flat = BTreeMap<String, String>;

/// A table of the settings that are not the same in all runs.
///
/// # Errors
/// [`youla_io::Error::Settings`] for settings in a report that are not TOML.
pub(super) fn differences(runs: &[FinishedRun]) -> Result<EvidenceTable> {
    let all: Vec<Flat> = runs.iter().map(flat).collect::<Result<_>>()?;
    let keys: std::collections::BTreeSet<&String> = all.iter().flat_map(Flat::keys).collect();
    let differs = |key: &&&String| all.iter().any(|f| f.get(**key) != all[0].get(**key));
    let row = |key: &String| -> Vec<String> {
        let value = |f: &Flat| f.get(key).cloned().unwrap_or_else(|| "\u{2013}".into());
        std::iter::once(key.clone()).chain(all.iter().map(value)).collect()
    };
    let rows: Vec<Vec<String>> = keys.iter().filter(differs).map(|key| row(key)).collect();
    let text = if rows.is_empty() { "None: all runs have the same settings.".into() } else { String::new() };
    let columns: Vec<&str> = std::iter::once("Setting").chain(runs.iter().map(|r| r.name.as_str())).collect();
    Ok(EvidenceTable { text, ..EvidenceTable::new("Settings that differ", &columns, rows) })
}

fn flat(run: &FinishedRun) -> Result<Flat> {
    let table: toml::Table = toml_file::parse(&run.report.settings, format!("{}/run.toml", run.name).as_ref())?;
    let mut all = Flat::new();
    add(&mut all, "", &toml::Value::Table(table));
    Ok(all)
}

fn add(all: &mut Flat, path: &str, value: &toml::Value) {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        toml::Value::Table(table) => table.iter().for_each(|(key, value)| add(all, &below(key), value)),
        // Matrices and lists of numbers are compared whole; lists of tables (files, channels) one by one.
        toml::Value::Array(items) if items.iter().any(toml::Value::is_table) => {
            items.iter().enumerate().for_each(|(k, value)| add(all, &format!("{path}[{}]", k + 1), value));
        }
        other => {
            all.insert(path.to_owned(), shortened(&other.to_string()));
        }
    }
}

/// Longest value that a table shows.
const LONGEST: usize = 60;

/// Of a long value the beginning and a digest, so that two that differ beyond it are still distinguished.
fn shortened(text: &str) -> String {
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    let digest: String = Hash::hash(text.as_bytes()).iter().take(4).map(|byte| format!("{byte:02x}")).collect();
    format!("{}\u{2026} (SHA-256 {digest})", text.chars().take(LONGEST - 20).collect::<String>())
}
