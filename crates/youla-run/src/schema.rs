//! The JSON schema of run.toml (draft 2020-12), from the structs that read it: doc comments are its descriptions, `Default` its
//! defaults, `deny_unknown_fields` its `additionalProperties = false`.

use crate::settings::RunSettings;
use crate::summary::Summary;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

/// The schema, for editors and other programs.
///
/// Ranges of numbers and what must be given together stand in the descriptions only; `RunSettings::parse` holds all of it.
///
/// ```
/// let schema = youla_run::settings_schema();
/// assert_eq!(schema["additionalProperties"], false);
/// assert!(schema["required"].as_array().is_some_and(|keys| keys.contains(&"controller".into())));
/// ```
pub fn settings_schema() -> Value {
    let schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<RunSettings>();
    let mut schema = Value::from(schema);
    tidy(&mut schema);
    schema["title"] = "run.toml of youla".into();
    schema
}

/// The schema of summary.json, for programs that read it.
///
/// ```
/// let schema = youla_run::summary_schema();
/// assert!(schema["required"].as_array().is_some_and(|keys| keys.contains(&"methods".into())));
/// ```
pub fn summary_schema() -> Value {
    let mut schema = Value::from(SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<Summary>());
    plain(&mut schema);
    schema["title"] = "summary.json of youla".into();
    schema
}

/// Doc comments as text, without formats of numbers; everywhere below.
fn plain(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            map.remove("format");
            if let Some(Value::String(text)) = map.get_mut("description") {
                *text = words(text);
            }
            map.values_mut().for_each(plain);
        }
        Value::Array(items) => items.iter_mut().for_each(plain),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// Takes out what TOML does not have (null) and what belongs to Rust (formats of numbers, links between items), everywhere below.
fn tidy(schema: &mut Value) {
    let Value::Object(map) = schema else { return };
    map.remove("format");
    if let Some(Value::String(text)) = map.get_mut("description") {
        *text = words(text);
    }
    if map.get("default") == Some(&Value::Null) {
        map.remove("default");
    }
    without_null(map);
    for (key, value) in map.iter_mut() {
        match (key.as_str(), value) {
            ("properties" | "$defs", Value::Object(children)) => children.values_mut().for_each(tidy),
            ("oneOf" | "anyOf" | "allOf", Value::Array(children)) => children.iter_mut().for_each(tidy),
            ("items" | "additionalProperties", child) => tidy(child),
            _ => {}
        }
    }
}

fn without_null(map: &mut Map<String, Value>) {
    if let Some(Value::Array(types)) = map.get_mut("type") {
        types.retain(|name| name != "null");
        if let [only] = &types[..] {
            let only = only.clone();
            map.insert("type".into(), only);
        }
    }
    if let Some(Value::Array(mut choices)) = map.remove("anyOf") {
        choices.retain(|choice| choice["type"] != "null");
        match &choices[..] {
            // What is beside the choice, as the description of its key, is nearer than what it says of itself.
            [Value::Object(only)] => only.iter().for_each(|(key, value)| {
                map.entry(key).or_insert_with(|| value.clone());
            }),
            _ => {
                map.insert("anyOf".into(), choices.into());
            }
        }
    }
}

/// A doc comment as text: paragraphs of one line, without examples and links to items.
fn words(text: &str) -> String {
    let mut prose = String::new();
    // Every second piece stands between fences: formulas stay, examples go.
    for (k, piece) in text.split("```").enumerate() {
        match piece.strip_prefix("text\n").filter(|_| k % 2 == 1) {
            Some(formulas) => {
                let lines: Vec<String> = formulas.lines().filter(|l| !l.trim().is_empty()).map(code).collect();
                prose += &lines.join(", ");
            }
            None if k % 2 == 0 => prose += piece,
            None => {}
        }
    }
    let paragraphs = prose.split("\n\n").map(|p| p.split_whitespace().collect::<Vec<_>>().join(" "));
    let paragraphs: Vec<String> = paragraphs.filter(|p| !p.is_empty()).map(|p| without_links(&p)).collect();
    paragraphs.join("\n\n")
}

/// One formula without its alignment.
fn code(line: &str) -> String {
    format!("`{}`", line.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// ``[`a::B`](c)`` and ``[`a::B`]`` as `` `B` ``.
fn without_links(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, link)) = rest.split_once("[`") {
        let Some((name, after)) = link.split_once("`]") else { break };
        let name = name.rsplit("::").next().unwrap_or(name);
        out += &format!("{before}`{name}`");
        rest = match after.strip_prefix('(').and_then(|target| target.split_once(')')) {
            Some((_, after)) => after,
            None => after,
        };
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doc_comments_become_text() {
        let text = "One\ntwo [`a::B`](x) and [`Self::c`].\n\n```\ncode\n```\nEnd:\n\n```text\nx   = 1\ny = 2\n```";
        assert_eq!(words(text), "One two `B` and `c`.\n\nEnd:\n\n`x = 1`, `y = 2`");
    }

    /// Every key of every table says what it is.
    #[test]
    fn every_key_has_a_description() {
        let schema = settings_schema();
        let defs = schema["$defs"].as_object().unwrap();
        let mut tables: Vec<(&str, &Value)> = defs.iter().map(|(name, table)| (name.as_str(), table)).collect();
        tables.push(("the top level", &schema));
        for (name, table) in tables {
            for (key, child) in table["properties"].as_object().into_iter().flatten() {
                assert!(child["description"].as_str().is_some_and(|d| d.len() > 5), "{key} of {name}");
            }
            for choice in table["oneOf"].as_array().into_iter().flatten() {
                assert!(choice["description"].is_string(), "{choice} of {name}");
            }
        }
        assert!(!schema.to_string().contains("\"null\""));
    }
}
