//! The reference of run.toml as a page of text, from its schema: `docs/book/reference.md`.

use crate::schema::project;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::fs;
use youla_run::settings_schema;

const HEAD: &str = "\
# All keys of run.toml

<!-- Written by the tests with YOULA_BLESS=1; do not edit. The texts are the doc comments of the settings. -->

Every key with its type, its default and its meaning; [run.toml](../run-toml.md) explains which keys belong together. Alternatives are
separated by commas. A table written in braces may also have a heading of its own. `youla schema` prints the same as a JSON schema, with
which editors complete and check a run.toml:

    youla schema > run.schema.json

and, as the first line of run.toml, `#:schema run.schema.json` (taplo, Even Better TOML).
";

/// The reference, in Markdown: the only list of all keys, from the documentation of the structs that read them.
fn settings_reference() -> String {
    let schema = settings_schema();
    let none = Map::new();
    let defs = schema["$defs"].as_object().unwrap_or(&none);
    let mut page = Page { defs, parts: Default::default(), at: 0, written: HashMap::new() };
    page.section("", "", &schema);
    let [common, further, check] = page.parts;
    format!(
        "{HEAD}\n# Common keys\n{common}\n# Further keys\n{further}\n# Thresholds of the check of the data\n{check}"
    )
}

/// Tables that most run files need; all others but `[check]` are further ones.
const COMMON: [&str; 9] = [
    "",
    "[data]",
    "[[data.inputs]]",
    "[[data.estimation]]",
    "[nominal]",
    "[controller]",
    "[direct]",
    "[hansen]",
    "[verification]",
];

/// The part of the page in which a table is described.
fn part_of(path: &str) -> usize {
    match path {
        path if COMMON.contains(&path) => 0,
        "[check]" => 2,
        _ => 1,
    }
}

struct Page<'a> {
    defs: &'a Map<String, Value>,
    /// Common tables, further ones, `[check]`.
    parts: [String; 3],
    /// The part that is written to.
    at: usize,
    /// Heading under which a definition was written.
    written: HashMap<String, String>,
}

/// The name of the definition that a schema refers to.
fn name_of(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

fn text_of(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

impl<'a> Page<'a> {
    fn part(&mut self) -> &mut String {
        &mut self.parts[self.at]
    }

    fn resolve(&self, schema: &'a Value) -> &'a Value {
        name_of(schema).and_then(|name| self.defs.get(name)).unwrap_or(schema)
    }

    /// A table with its keys, or a choice of forms; then what is below it.
    fn section(&mut self, path: &str, about: &str, schema: &'a Value) {
        self.at = part_of(path);
        let heading = if path.is_empty() { "The top level".to_owned() } else { format!("`{path}`") };
        *self.part() += &format!("\n## {heading}\n");
        if !about.is_empty() {
            *self.part() += &format!("\n{about}\n");
        }
        if let Some(name) = name_of(schema) {
            if let Some(first) = self.written.get(name).cloned() {
                *self.part() += &format!("\nThe keys are those of `{first}`.\n");
                return;
            }
            self.written.insert(name.to_owned(), path.to_owned());
        }
        let own = self.resolve(schema);
        // What is said of the key and of its type may be the same.
        if !path.is_empty() {
            // "Choices of `reduce`." is for those who call it from Rust.
            let new = |p: &&str| {
                !p.is_empty()
                    && (about.is_empty() || !p.starts_with(about.trim_end_matches('.')))
                    && !p.starts_with("Choices of ")
                    && !p.starts_with("Options of ")
            };
            for paragraph in text_of(own).split("\n\n").filter(new) {
                *self.part() += &format!("\n{paragraph}\n");
            }
        }
        let below = match own["properties"].as_object() {
            Some(keys) => self.keys(path, keys, &own["required"]),
            None => self.forms(path, own),
        };
        for (path, about, schema) in below {
            self.section(&path, &about, schema);
        }
    }

    fn keys(&mut self, path: &str, keys: &'a Map<String, Value>, required: &Value) -> Vec<(String, String, &'a Value)> {
        let needed = |key: &str| required.as_array().is_some_and(|all| all.iter().any(|name| name == key));
        let mut below = Vec::new();
        *self.part() += "\n| key | type | default | meaning |\n|---|---|---|---|\n";
        let (first, rest): (Vec<_>, Vec<_>) = keys.iter().partition(|(key, _)| needed(key));
        for (key, schema) in
            first.into_iter().chain(rest).filter(|(key, _)| !is_named_by_a(key, keys.contains_key("a")))
        {
            let default = match &schema["default"] {
                _ if needed(key) => "required".to_owned(),
                Value::Null => String::new(),
                value if value.as_object().is_some_and(Map::is_empty) => String::new(),
                value if value.is_object() && self.resolve(schema)["properties"].is_object() => String::new(),
                value => format!("`{}`", toml_of(value)),
            };
            let (kind, choices) = match self.only_tables(schema) {
                true => ("table".to_owned(), String::new()),
                false => (self.kind(schema), self.choices(schema)),
            };
            let named = |name: &str| keys.get(name).map_or("", text_of);
            let cells = [label(key), kind, default, about_key(key, schema, named) + &choices];
            *self.part() += &row(cells);
            let bare = path.trim_matches(['[', ']']);
            let place = if bare.is_empty() { key.clone() } else { format!("{bare}.{key}") };
            if let Some((brackets, table)) = self.table(schema) {
                let heading = match brackets {
                    Brackets::One => format!("[{place}]"),
                    Brackets::Two => format!("[[{place}]]"),
                    Brackets::Named => format!("[{place}.<name>]"),
                };
                below.push((heading, text_of(schema).to_owned(), table));
            }
        }
        below
    }

    /// The forms of a choice of which some are tables with one key. Where all are, each form with its keys, then every key once;
    /// else the tables as sections of their own.
    fn forms(&mut self, path: &str, own: &'a Value) -> Vec<(String, String, &'a Value)> {
        let bare = path.trim_matches(['[', ']']);
        let (mut below, mut forms, mut all) = (Vec::new(), String::new(), Vec::<(&String, &Value)>::new());
        for form in alternatives(own) {
            for (name, schema) in form["properties"].as_object().into_iter().flatten() {
                let table = self.resolve(schema);
                let Some(keys) = table["properties"].as_object() else { continue };
                below.push((format!("[{bare}.{name}]"), text_of(form).to_owned(), schema));
                let needed = |key: &str| table["required"].as_array().is_some_and(|all| all.iter().any(|n| n == key));
                let named = |key: &String| format!("`{key}`{}", if needed(key) { "" } else { " (optional)" });
                let names: Vec<String> = keys.keys().map(named).collect();
                forms += &format!("| `[{bare}.{name}]` | {} | {} |\n", names.join(", "), text_of(form));
                all.extend(
                    keys.iter().filter(|(key, _)| all.iter().all(|(known, _)| known != key)).collect::<Vec<_>>(),
                );
            }
        }
        if !self.only_tables(own) {
            return below;
        }
        *self.part() +=
            &format!("\nExactly one of these tables:\n\n| table | keys | meaning |\n|---|---|---|\n{forms}");
        *self.part() += "\n| key | type | meaning |\n|---|---|---|\n";
        let matrices = all.iter().any(|(key, _)| *key == "a");
        let named = |name: &str| all.iter().find(|(key, _)| *key == name).map_or("", |(_, schema)| text_of(schema));
        for (key, schema) in all.iter().filter(|(key, _)| !is_named_by_a(key, matrices)) {
            let cells = [label(key), self.kind(schema), about_key(key, schema, named) + &self.choices(schema)];
            *self.part() += &row(cells);
        }
        Vec::new()
    }

    /// The table behind a key, where it has keys of its own, and how its heading is written.
    fn table(&self, schema: &'a Value) -> Option<(Brackets, &'a Value)> {
        let (brackets, inner) = match self.resolve(schema) {
            list if list["type"] == "array" => (Brackets::Two, &list["items"]),
            named if named["additionalProperties"].is_object() => (Brackets::Named, &named["additionalProperties"]),
            _ => (Brackets::One, schema),
        };
        let own = self.resolve(inner);
        let keys = |form: &'a Value| form["properties"].as_object().into_iter().flatten();
        let nested = alternatives(own).flat_map(keys).any(|(_, schema)| self.resolve(schema)["properties"].is_object());
        (own["properties"].is_object() || nested).then_some((brackets, inner))
    }

    /// A choice of forms that all have keys of their own: each has its heading.
    fn only_tables(&self, schema: &'a Value) -> bool {
        let forms = self.resolve(schema)["oneOf"].as_array();
        forms.is_some_and(|forms| {
            forms.iter().all(|form| {
                let inner = form["properties"].as_object().and_then(|keys| keys.values().next());
                inner.is_some_and(|inner| self.resolve(inner)["properties"].is_object())
            })
        })
    }

    /// What may be behind a key.
    fn kind(&self, schema: &'a Value) -> String {
        let own = self.resolve(schema);
        if let Some(choices) = own["oneOf"].as_array().or(own["anyOf"].as_array()) {
            let mut kinds: Vec<String> = choices.iter().map(|choice| self.form(choice)).collect();
            kinds.dedup();
            return kinds.join(", ");
        }
        self.form(own)
    }

    fn form(&self, schema: &'a Value) -> String {
        if !schema["const"].is_null() {
            return format!("`{}`", schema["const"]);
        }
        if let Some(values) = schema["enum"].as_array() {
            return values.iter().map(|v| format!("`{v}`")).collect::<Vec<_>>().join(", ");
        }
        match schema["type"].as_str() {
            Some("string") => "text".into(),
            Some("array") => match (&schema["minItems"], &schema["maxItems"]) {
                (Value::Number(least), Value::Number(most)) if least == most => match self.kind(&schema["items"]) {
                    of if of.starts_with(char::is_numeric) => format!("{least} x {of}"),
                    of => format!("{least} {of}s"),
                },
                _ => match self.kind(&schema["items"]) {
                    of if of == "number" => "list of numbers".into(),
                    of if of == "list of numbers" => "matrix".into(),
                    of if of == "matrix" => "matrix of lists of numbers".into(),
                    of => format!("list of {of}"),
                },
            },
            Some("object") => match (schema["properties"].as_object(), &schema["required"]) {
                // A form of a choice.
                (Some(keys), Value::Array(_)) if keys.len() == 1 => {
                    let key = |(key, inner): (&String, &'a Value)| {
                        format!("`{{ {key} = {} }}`", self.kind(inner).replace('`', ""))
                    };
                    keys.iter().map(key).collect()
                }
                (None, _) if schema["additionalProperties"].is_object() => {
                    format!("table by name of {}", self.kind(&schema["additionalProperties"]))
                }
                _ => "table".into(),
            },
            Some(other) => other.into(),
            None if name_of(schema).is_some() => self.kind(schema),
            None => "any".into(),
        }
    }

    /// What each choice means.
    fn choices(&self, schema: &'a Value) -> String {
        let mut own = self.resolve(schema);
        if own["type"] == "array" {
            own = self.resolve(&own["items"]);
        }
        let choices = own["oneOf"].as_array().or(own["anyOf"].as_array());
        let one = |choice: &'a Value| {
            let text = text_of(choice);
            if text.is_empty() { String::new() } else { format!("<br>{}: {text}", self.form(choice)) }
        };
        choices.into_iter().flatten().map(one).collect()
    }
}

/// Whether a key is one of the matrices of a model, which are described in one line with A.
fn is_named_by_a(key: &str, with_a: bool) -> bool {
    with_a && matches!(key, "b" | "c" | "d")
}

fn label(key: &str) -> String {
    if key == "a" { "`a`, `b`, `c`, `d`".into() } else { format!("`{key}`") }
}

fn about_key<'a>(key: &str, schema: &'a Value, named: impl Fn(&str) -> &'a str) -> String {
    if key == "a" { ["a", "b", "c", "d"].map(named).join(" ") } else { text_of(schema).to_owned() }
}

/// The forms among which a value is chosen.
fn alternatives(schema: &Value) -> impl Iterator<Item = &Value> {
    schema["oneOf"].as_array().or(schema["anyOf"].as_array()).into_iter().flatten()
}

/// A line of a table.
fn row<const N: usize>(cells: [String; N]) -> String {
    let cells = cells.map(|cell| cell.replace('|', "\\|").replace("\n\n", "<br>"));
    format!("| {} |\n", cells.join(" | "))
}

/// How the heading of a table is written.
enum Brackets {
    One,
    Two,
    Named,
}

/// A default as it would be in the file.
fn toml_of(value: &Value) -> String {
    match value {
        Value::Object(keys) => {
            let all: Vec<String> = keys.iter().map(|(key, value)| format!("{key} = {}", toml_of(value))).collect();
            format!("{{ {} }}", all.join(", "))
        }
        Value::Array(values) => format!("[{}]", values.iter().map(toml_of).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// Keys of a user and thresholds of the check are apart, and the former are few: 80, ten with which controllers in s and PIDs are
/// written down, which no run needs that has other forms, five for the limits of a PID that is designed, three for feedforward and filter
/// of a cascade, and one for the clock of an output that was interpolated.
#[test]
fn keys_are_few() {
    let page = settings_reference();
    let (of_user, check) = page.split_once("\n# Thresholds of the check of the data\n").unwrap();
    let tables = |line: &&str| line.contains("` | table |") || line.contains("` | list of table |");
    let keys: Vec<&str> = of_user.lines().filter(|line| line.starts_with("| `") && !line.starts_with("| `[")).collect();
    let count = keys.iter().filter(|line| !tables(line)).count();
    assert!((40..=99).contains(&count), "{count} keys:\n{}", keys.join("\n"));
    assert!(!of_user.contains("## `[check]`") && check.contains("## `[check]`"));
}

/// `YOULA_BLESS=1` writes it.
#[test]
fn the_reference_is_that_of_the_settings() {
    let (path, now) = (project().join("docs/book/reference.md"), format!("{}\n", settings_reference().trim_end()));
    if std::env::var_os("YOULA_BLESS").is_some() {
        fs::write(&path, &now).expect("written");
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == now,
        "docs/book/reference.md is stale: `YOULA_BLESS=1 cargo test -p youla-cli --test all reference`"
    );
}
