//! `youla schema`: run files validate, wrong ones do not.

use crate::common::{SETTINGS, csv, demo, empty_folder, log, settings, youla};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

pub(crate) fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Printed once for all tests: two at a time would empty one folder.
fn schema() -> Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    let printed = || {
        let found = youla(&empty_folder("schema"), &["schema"]);
        assert!(found.code == Some(0) && found.stderr.is_empty(), "{}", found.stderr);
        serde_json::from_str(&found.stdout).expect("JSON")
    };
    SCHEMA.get_or_init(printed).clone()
}

/// What keeps a value from a schema, for the keywords that ours has; any other keyword ends the test.
pub(crate) fn problem(root: &Value, schema: &Value, value: &Value, at: &str) -> Option<String> {
    let keys = match schema {
        Value::Object(keys) => keys,
        Value::Bool(true) => return None,
        _ => return Some(format!("{at}: nothing may stand here")),
    };
    let fits = |schema: &Value| problem(root, schema, value, at).is_none();
    let said = |what: String| Some(format!("{at}: {what}"));
    for (key, rule) in keys {
        let list = rule.as_array().map(Vec::as_slice).unwrap_or_default();
        let found = match key.as_str() {
            "$schema" | "$defs" | "title" | "description" | "default" | "required" => None,
            "$ref" => {
                let pointer = rule.as_str().and_then(|r| r.strip_prefix('#')).expect("a reference within the schema");
                problem(root, root.pointer(pointer).expect("a definition"), value, at)
            }
            "type" => {
                let names = rule.as_str().into_iter().chain(list.iter().filter_map(Value::as_str));
                (!names.into_iter().any(|name| has_type(name, value))).then(|| format!("{at}: {value} is not {rule}"))
            }
            "const" => (value != rule).then(|| format!("{at}: {value} is not {rule}")),
            "enum" => (!list.contains(value)).then(|| format!("{at}: {value} is none of {rule}")),
            "oneOf" if list.iter().filter(|one| fits(one)).count() != 1 => {
                said(format!("{value} fits not one of {rule}"))
            }
            "allOf" => list.iter().find_map(|one| problem(root, one, value, at)),
            "anyOf" if !list.iter().any(fits) => said(format!("{value} fits none of {rule}")),
            "oneOf" | "anyOf" => None,
            "minimum" => value
                .as_f64()
                .filter(|x| *x < rule.as_f64().expect("a number"))
                .map(|x| format!("{at}: {x} is below {rule}")),
            "minItems" | "maxItems" => value.as_array().and_then(|items| {
                let bound = rule.as_u64().expect("a number") as usize;
                let fits = if key == "minItems" { items.len() >= bound } else { items.len() <= bound };
                (!fits).then(|| format!("{at}: {} items", items.len()))
            }),
            "items" => value.as_array().into_iter().flatten().find_map(|item| problem(root, rule, item, at)),
            "properties" => value.as_object().into_iter().flatten().find_map(|(key, item)| {
                rule.get(key).and_then(|rule| problem(root, rule, item, &format!("{at}.{key}")))
            }),
            "additionalProperties" => value.as_object().into_iter().flatten().find_map(|(key, item)| {
                let known = keys.get("properties").and_then(|p| p.get(key)).is_some();
                if known { None } else { problem(root, rule, item, &format!("{at}.{key}")) }
            }),
            other => panic!("the keyword {other} is not checked"),
        };
        if found.is_some() {
            return found;
        }
    }
    let required = schema["required"].as_array().into_iter().flatten();
    let object = value.as_object()?;
    required
        .filter_map(Value::as_str)
        .find(|key| !object.contains_key(*key))
        .map(|key| format!("{at}: {key} is missing"))
}

fn has_type(name: &str, value: &Value) -> bool {
    match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        other => panic!("the type {other} is not checked"),
    }
}

fn toml(text: &str) -> Value {
    let table: toml::Table = toml::from_str(text).unwrap_or_else(|e| panic!("{e} in\n{text}"));
    serde_json::to_value(table).expect("JSON")
}

#[test]
fn run_files_validate() {
    let schema = schema();
    let folder = empty_folder("schema-init");
    fs::write(folder.join("log.csv"), csv(&log())).expect("written");
    let init = ["init", "log.csv", "--input", "u", "--output", "y", "--time", "t", "--open-loop"];
    assert_eq!(youla(&folder, &init).code, Some(0));
    let mut files = vec![folder.join("run.toml"), demo().join("run.toml")];
    files.push(project().join("crates/youla-io/tests/seeds/run_toml/drive.toml"));
    let examples = fs::read_dir(project().join("examples")).expect("readable");
    let runs = examples.map(|e| e.expect("readable").path().join("run.toml")).filter(|path| path.is_file());
    files.extend(runs);
    assert!(files.len() >= 5, "{files:?}");
    let read = |path: &PathBuf| fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut texts: Vec<(String, String)> = files.iter().map(|f| (f.display().to_string(), read(f))).collect();
    texts.push(("the small loop".into(), SETTINGS.into()));
    let readme = read(&project().join("README.md"));
    texts.push(("README.md".into(), blocks(&readme).into_iter().next().expect("a run.toml").to_owned()));
    for (name, text) in texts {
        assert_eq!(problem(&schema, &schema, &toml(&text), "run.toml"), None, "{name}");
    }
}

/// The parts of settings that are in the documents.
#[test]
fn settings_in_the_documents_validate() {
    let schema = schema();
    let mut count = 0;
    let folders = ["docs", "docs/book"].map(|folder| fs::read_dir(project().join(folder)).expect("readable"));
    for path in folders.into_iter().flatten().map(|entry| entry.expect("readable").path()) {
        if path.extension().is_none_or(|e| e != "md") {
            continue;
        }
        let text = fs::read_to_string(&path).expect("readable");
        for block in blocks(&text) {
            for (key, value) in toml(block).as_object().expect("a table") {
                let Some(rule) = schema["properties"].get(key) else { continue };
                // A part may leave out what the whole needs.
                let found = problem(&schema, rule, value, key).filter(|p| !p.ends_with(" is missing"));
                assert_eq!(found, None, "{}:\n{block}", path.display());
                count += 1;
            }
        }
    }
    assert!(count > 3, "{count}");
}

fn blocks(text: &str) -> Vec<&str> {
    let after = text.split("```toml").skip(1).filter_map(|rest| rest.split_once('\n'));
    after.filter_map(|(_, rest)| rest.split("```").next()).collect()
}

#[test]
fn wrong_files_do_not_validate() {
    let schema = schema();
    let refused = [
        settings("name = \"loop\"", "nane = \"loop\""),
        settings("name = \"loop\"", "name = 3"),
        settings("horizon = 10\norder = 3", "horizon = 10\nordr = 3"),
        settings("horizon = 10", "horizon = \"10\""),
        settings("horizon = 10", "horizon = -1"),
        settings("horizon = 10", "horizon = 10.5"),
        settings("order = 3", "order = { fixd = 3 }"),
        settings("order = 3", "order = { fixed = 3, auto = { max = 4 } }"),
        settings("order = 3", "order = \"many\""),
        settings("order = 3", "order = 3\nscaling = \"rms\""),
        settings("feedback = \"negative\"", "feedback = \"minus\""),
        settings("feedback = \"negative\"\n", ""),
        settings("[nominal.transfer_function]", "[nominal.transfer]"),
        settings("unit = \"V\"", "units = \"V\""),
        settings("window = 256", "window = true"),
    ];
    assert_eq!(problem(&schema, &schema, &toml(SETTINGS), "run.toml"), None);
    for text in refused {
        assert!(problem(&schema, &schema, &toml(&text), "run.toml").is_some(), "{text}");
    }
}
