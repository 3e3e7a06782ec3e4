//! A file of settings as text: errors with line, column and key, and the nearest known name for a misspelt one.

use crate::error::TextPosition;
use crate::error::{Error, Result};
use serde::de::DeserializeOwned;
use std::path::Path;
use toml::de::{DeTable, DeValue};
use youla::error::{misspelt, short};

/// Reads the text of a settings file; `path` is named in errors.
///
/// # Errors
/// [`Error::Settings`].
pub fn parse<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T> {
    toml::from_str(text).map_err(|e| in_words(&e, text, path))
}

/// Turns the parser's error into one sentence.
fn in_words(error: &toml::de::Error, text: &str, path: &Path) -> Error {
    let offset = error.span().map_or(0, |s| s.start.min(text.len()));
    let message = error.message();
    let problem = unknown_name(message).unwrap_or_else(|| match key_at(text, offset) {
        Some(key) => format!("{key}: {message}"),
        None => message.to_owned(),
    });
    Error::Settings { path: path.to_owned(), at: Some(TextPosition::of(text, offset)), problem }
}

/// For a key or choice that is not known, the known one that is most similar.
fn unknown_name(message: &str) -> Option<String> {
    let (unknown, nearest) = misspelt(message)?;
    let hint = nearest.map(|nearest| format!("; did you mean `{nearest}`?")).unwrap_or_default();
    let listed = message.split_once("`, ").map_or(message, |(_, rest)| rest);
    Some(format!("`{}` is not known here{hint} ({listed})", short(unknown)))
}

/// The dotted key of the value at this position of the text.
fn key_at(text: &str, offset: usize) -> Option<String> {
    let document = DeTable::parse(text).ok()?;
    let keys = path_to(document.get_ref(), offset)?;
    Some(short(&keys.join(".")))
}

/// The keys that lead to the innermost value around `offset`. The span of a table under a header is its header, so that
/// every table is searched.
fn path_to<'a>(table: &'a DeTable<'_>, offset: usize) -> Option<Vec<&'a str>> {
    table.iter().find_map(|(key, value)| {
        let inner = match value.get_ref() {
            DeValue::Table(table) => path_to(table, offset),
            _ => None,
        };
        let mut keys = inner.or_else(|| value.span().contains(&offset).then(Vec::new))?;
        keys.insert(0, key.get_ref());
        Some(keys)
    })
}
