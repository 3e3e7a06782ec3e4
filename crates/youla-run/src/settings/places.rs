//! Which tables of run.toml have a key, by its schema.

use super::RunSettings;
use schemars::generate::SchemaSettings;
use serde_json::Value;

/// The tables of run.toml that have a key, as `[recommended] and [hansen]`: those of the highest level, of many the tables that hold them;
/// empty where none has it.
///
/// ```
/// assert_eq!(youla_run::tables_with("sample_time"), "[data]");
/// assert_eq!(youla_run::tables_with("feedback"), "a table in [controller]");
/// ```
pub fn tables_with(key: &str) -> String {
    let schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<RunSettings>();
    let (schema, mut found) = (Value::from(schema), Vec::new());
    search(&schema, &schema, "", key, &mut found);
    let depth = |table: &String| table.matches('.').count();
    let least = found.iter().map(depth).min();
    found.retain(|table| Some(depth(table)) == least);
    found.sort_by_key(|table| table != "[recommended]");
    if found.len() > 4 {
        found = found.iter().map(|table| format!("a table in {}]", table.split('.').next().unwrap_or(table))).collect();
        found.dedup();
    }
    found.join(" and ")
}

fn search(root: &Value, table: &Value, path: &str, key: &str, found: &mut Vec<String>) {
    for (name, child) in table["properties"].as_object().into_iter().flatten() {
        let place = if path.is_empty() { "the top level".to_owned() } else { format!("[{path}]") };
        if name == key && !found.contains(&place) {
            found.push(place);
        }
        let below = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        search(root, child, &below, key, found);
    }
    let choices = ["oneOf", "anyOf"].iter().filter_map(|of| table[of].as_array()).flatten();
    let target = table["$ref"].as_str().and_then(|name| root.pointer(name.trim_start_matches('#')));
    choices.chain(table.get("items")).chain(target).for_each(|inner| search(root, inner, path, key, found));
}
