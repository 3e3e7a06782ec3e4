//! What is wrong in run.toml, as one sentence: the parser's messages in the words of the documentation.

use super::controller::ControllerSettings;
use super::models::NominalModel;
use super::places::tables_with;
use crate::Error;
use serde::de::value::{Error as ProbeError, StrDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};
use std::path::Path;
use youla::error::{nearest_name, short};
use youla_io::TextPosition;

/// The parser's refusal with line, column, table and key, and the nearest known word for a misspelt one.
pub(super) fn explain(error: &toml::de::Error, text: &str, path: &Path, at: &str) -> Error {
    let span = error.span().unwrap_or(0..0);
    let start = span.start.min(text.len());
    let message = error.message().trim().replace('\n', "; ");
    let mut place = Place::at(text, start, text.get(span).unwrap_or_default());
    if place.table.is_empty() {
        place.table = at.to_owned();
    }
    let problem = match toml::from_str::<toml::Table>(text) {
        Ok(document) => sentence(&message, &place) + &stray(&message, &document),
        Err(_) if message == "duplicate key" => format!("the key `{}` is given twice", place.found),
        Err(_) => format!("this is not TOML: {message}{}", remedy(text, start)),
    };
    problem_at(path, text, start, problem)
}

/// The table to which a key belongs that is given where one of several forms is chosen.
fn stray(message: &str, document: &toml::Table) -> String {
    let chosen = ["controller", "nominal"].into_iter().filter(|_| message.starts_with("wanted exactly 1 element"));
    let keys = chosen.filter_map(|table| document.get(table)?.as_table()).flat_map(|table| table.keys());
    let places = keys.map(|key| (short(key), tables_with(key)));
    let mut elsewhere = places.filter(|(_, of)| of.starts_with('[') && !of.contains("[controller"));
    elsewhere.next().map_or(String::new(), |(key, of)| format!("; `{key}` is a key of {of}"))
}

/// What the line shows that the parser does not name.
fn remedy(text: &str, start: usize) -> &'static str {
    let from = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line = text[from..].lines().next().unwrap_or_default();
    let value = line.split_once('=').map_or("", |(_, value)| value.trim());
    let comma =
        value.split_once(',').is_some_and(|(whole, part)| whole.parse::<i64>().is_ok() && part.parse::<u64>().is_ok());
    match line {
        _ if line.contains(['\u{201c}', '\u{201d}', '\u{201e}']) => "; these quotes are typographic, write \"",
        _ if comma => "; write a decimal point in place of the comma",
        _ if value.starts_with('"') && value.contains('\\') => "; write / in a path, or put it in single quotes",
        _ => "",
    }
}

/// An error at a position of the text, line and column counted from 1 in characters.
pub(super) fn problem_at(path: &Path, text: &str, start: usize, problem: String) -> Error {
    Error::File(youla_io::Error::Settings { path: path.to_owned(), at: Some(TextPosition::of(text, start)), problem })
}

/// Where the parser stopped.
struct Place<'a> {
    /// Path of the table, empty at the top level.
    table: String,
    /// The key whose value, or whose inline table, is meant, where one is before it on the same line.
    key: Option<&'a str>,
    /// The text that is meant.
    found: &'a str,
}

impl<'a> Place<'a> {
    fn at(text: &'a str, start: usize, found: &'a str) -> Self {
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let before = &text[line_start..start];
        let table = match header(&text[line_start..line_end]) {
            // A word of a header belongs to the table before it.
            Some(_) if !found.starts_with('[') => before.trim_start_matches(['[', ' ']).trim_end_matches('.'),
            _ => text[..line_end].lines().rev().find_map(header).unwrap_or_default(),
        };
        Place { table: table.to_owned(), key: owner(before), found }
    }

    fn table(&self) -> String {
        if self.table.is_empty() { "the top level".into() } else { format!("[{}]", self.table) }
    }

    /// The value or the inline table that is meant.
    fn subject(&self) -> String {
        let of = if self.table.is_empty() { "at the top level".into() } else { format!("in [{}]", self.table) };
        self.key.map_or_else(|| format!("a value {of}"), |key| format!("`{key}` {of}"))
    }

    /// What is given in one of several forms: the value of a key, a table, or the one that a word of a header names.
    fn form(&self) -> String {
        match (self.key, self.table.is_empty()) {
            (Some(_), _) => self.subject(),
            (None, true) => format!("[{}]", self.found),
            (None, false) => self.table(),
        }
    }

    /// The table that holds a key: an inline one, or the one of the header.
    fn holder(&self) -> String {
        if self.key.is_some() { self.subject() } else { self.table() }
    }
}

/// The key before the last open `=` of a line that is cut off: `file` in `{ file = `, `order` in `order = { fixed = 1, `.
fn owner(line: &str) -> Option<&str> {
    let mut open = Vec::new();
    let mut last = None;
    for (i, c) in line.char_indices() {
        match c {
            '=' => last = Some(i),
            '{' => open.push(last),
            '}' => last = open.pop().flatten(),
            ',' if !open.is_empty() => last = open.last().copied().flatten(),
            _ => {}
        }
    }
    let before = line[..last?].trim_end();
    before.rsplit(|c: char| !is_key(c)).next().filter(|key| !key.is_empty())
}

/// The name in a line `[name]` or `[[name]]`; not a row of a matrix.
fn header(line: &str) -> Option<&str> {
    let inner = line.trim().strip_prefix('[')?.trim_start_matches('[');
    let name = inner[..inner.find(']')?].trim();
    let named = name.starts_with(|c: char| c.is_alphabetic()) && name.chars().all(|c| is_key(c) || c == '.');
    named.then_some(name)
}

fn is_key(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '-')
}

/// What the two signs of a controller mean.
const SIGNS: &str = ": \"negative\" is u = K (r - y), \"positive\" is u = K (y - r)";

fn sentence(message: &str, place: &Place<'_>) -> String {
    let quoted = || message.split('`').skip(1).step_by(2);
    if let Some(key) = message.strip_prefix("missing field ") {
        let signs = if key == "`feedback`" { SIGNS } else { "" };
        return format!("{} lacks {key}{signs}", place.holder());
    }
    if message.starts_with("unknown ") {
        let known: Vec<&str> = quoted().skip(1).collect();
        return unknown(quoted().next().unwrap_or_default(), &known, place);
    }
    if let Some((keys, known)) =
        message.strip_prefix("unexpected keys in table: ").and_then(|rest| rest.split_once(", available keys: "))
    {
        let known: Vec<&str> = known.split(", ").collect();
        return unknown(keys.split(", ").next().unwrap_or_default(), &known, place);
    }
    if message.starts_with("wanted exactly 1 element") {
        let found = if message.contains("found 0") { "none" } else { "more than one" };
        let forms = forms_at(place);
        let key = "a key of one of them belongs into its table, such as `feedback` into [controller.pid]";
        let mend = if place.table.starts_with("controller") { format!("; {key}") } else { String::new() };
        return format!("{} must hold exactly one of {forms}, but holds {found}{mend}", place.form());
    }
    if let Some(must) = message.strip_prefix("wanted ").or_else(|| message.strip_prefix("expected ")) {
        return format!("{} is {}, but must be {}", place.subject(), shortened(place.found), expected(must, place.key));
    }
    let typed = ["invalid type: ", "invalid value: ", "invalid length "].iter().find_map(|p| message.strip_prefix(p));
    match typed.and_then(|rest| rest.rsplit_once(", expected ")) {
        Some((_, must)) => {
            format!("{} is {}, but must be {}", place.subject(), shortened(place.found), expected(must, place.key))
        }
        None => format!("{}: {message}", place.subject()),
    }
}

/// A key or a choice that does not exist, with those that do.
fn unknown(word: &str, known: &[&str], place: &Place<'_>) -> String {
    let (is, are) = if place.found.starts_with(['"', '\'']) { ("choice", "choices") } else { ("key", "keys") };
    let of = if is == "choice" { place.subject() } else { place.holder() };
    let hint = match nearest_name(word, known.iter().copied()) {
        Some(k) => format!("did you mean `{k}`? The"),
        None => "the".into(),
    };
    let tables = if is == "key" { tables_with(word) } else { String::new() };
    let word = short(word);
    let place = if tables.is_empty() { tables } else { format!("; `{word}` is a key of {tables}") };
    format!("`{word}` is not a {is} of {of}; {hint} {are} are {}{place}", known.join(", "))
}

/// The forms among which the user chooses one, asked of the types themselves.
fn forms_at(place: &Place<'_>) -> String {
    let table = place.table.split('.').next().unwrap_or_default();
    if table == "controller" || place.found == "controller" {
        return forms::<ControllerSettings>();
    }
    forms::<NominalModel>()
}

/// The names of the forms of a choice, separated by commas.
pub(super) fn forms<T: DeserializeOwned>() -> String {
    let probe: StrDeserializer<'_, ProbeError> = "".into_deserializer();
    let refusal = T::deserialize(probe).map_or_else(|e| e.to_string(), |_| String::new());
    refusal.split('`').skip(3).step_by(2).collect::<Vec<_>>().join(", ")
}

/// A kind of value as users call it, of a list under some keys with an example.
fn expected(must: &str, key: Option<&str>) -> String {
    match must {
        "a sequence" => match key {
            Some("estimation" | "verification" | "response") => "a list such as [{file = \"log.csv\"}]".into(),
            Some("inputs" | "outputs" | "input_excitation" | "reference" | "alpha") => {
                "a list such as [{name = \"u\"}]".into()
            }
            _ => "a list".into(),
        },
        "usize" | "u64" | "u32" => "a whole number, zero or positive".into(),
        "f64" => "a number".into(),
        "a string" | "a borrowed string" | "path string" => "a text in quotes".into(),
        "struct ChannelSpec" => "a table such as { name = \"u\" }".into(),
        "struct DataFile" => "a table such as { file = \"log.csv\" }".into(),
        "string or table" => "a text in quotes or a table".into(),
        _ if must.starts_with("struct ") || must == "a map" => "a table".into(),
        _ => must.to_owned(),
    }
}

/// The first line of a value, up to forty characters.
fn shortened(found: &str) -> String {
    const SHOWN: usize = 40;
    let line = found.lines().next().unwrap_or_default();
    let cut = line.len() < found.len() || line.chars().count() > SHOWN;
    line.chars().take(SHOWN).chain(if cut { " ..." } else { "" }.chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_told_from_rows_of_matrices() {
        assert_eq!(header(" [[data.estimation]] # one"), Some("data.estimation"));
        assert_eq!(header("[0.9, 0.1],"), None);
        assert_eq!(header("a = [data]"), None);
    }

    #[test]
    fn the_owner_of_a_word_is_the_key_before_it() {
        assert_eq!(owner("take = "), Some("take"));
        assert_eq!(owner("order = { auto = { "), Some("auto"));
        assert_eq!(owner("estimation = [{ file = 1, skip = 2 }, { file = 3, "), Some("estimation"));
        assert_eq!(owner("order = { fixed = "), Some("fixed"));
        assert_eq!(owner(""), None);
    }

    #[test]
    fn forms_come_from_the_types() {
        assert_eq!(
            forms::<ControllerSettings>(),
            "difference_equation, transfer_function, state_space, pid, ideal_pid, cascade, model_file, observer"
        );
    }
}
