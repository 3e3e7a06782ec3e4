//! The run.toml beside a log.

use crate::{Description, Error, Result, RigChannel};
use toml::{Table, Value};

/// The settings of a run on a log of so many rows: `[data]` from the machine's description, everything else from `base`, a run.toml, or else
/// from the description. The last quarter of the log verifies.
///
/// # Errors
/// [`Error::Description`] for a `base` that is not TOML.
pub fn settings(machine: &Description, log: &str, rows: u64, base: Option<&str>) -> Result<String> {
    let refused = |problem: toml::de::Error| Error::Description(format!("the settings: {problem}"));
    let mut run = match base {
        Some(text) => text.parse::<Table>().map_err(refused)?,
        None => machine.further.clone(),
    };
    let mut data = Table::new();
    data.insert("time_column".into(), "t".into());
    data.insert("gaps".into(), "split".into());
    data.insert("inputs".into(), channels(&machine.inputs));
    data.insert("outputs".into(), channels(&machine.outputs));
    let alpha = (1..)
        .zip(&machine.inputs)
        .map(|(number, input)| RigChannel { name: format!("alpha_{number}"), unit: input.unit.clone() });
    data.insert("alpha".into(), channels(&alpha.collect::<Vec<_>>()));
    let first = i64::try_from(rows - rows / 4).unwrap_or(i64::MAX);
    data.insert("estimation".into(), part(&[("take", first)], log));
    data.insert("verification".into(), part(&[("skip", first)], log));
    let name = run.remove("name").unwrap_or_else(|| Value::String(machine.name.clone()));
    run.insert("data".into(), Value::Table(data));
    let mut text = Table::new();
    text.insert("name".into(), name);
    text.extend(run);
    toml::to_string(&text).map_err(|problem| Error::Description(problem.to_string()))
}

fn channels(all: &[RigChannel]) -> Value {
    let channel = |channel: &RigChannel| {
        let fields = [("name", &channel.name), ("unit", &channel.unit)];
        Value::Table(fields.map(|(key, text)| (key.to_owned(), Value::String(text.clone()))).into_iter().collect())
    };
    Value::Array(all.iter().map(channel).collect())
}

fn part(fields: &[(&str, i64)], log: &str) -> Value {
    let mut table = Table::new();
    table.insert("file".into(), log.into());
    table.extend(fields.iter().map(|(key, number)| ((*key).to_owned(), Value::Integer(*number))));
    Value::Array(vec![Value::Table(table)])
}
