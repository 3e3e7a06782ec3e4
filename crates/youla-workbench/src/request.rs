//! Requests and their answers.

use crate::refusal::{Refusal, Result};
use crate::{archive, gains, log, orders, run, traces};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::PathBuf;
use youla_io::CsvOptions;
use youla_run::ControllerSettings;

/// What the page asks for.
#[derive(Debug, Deserialize)]
#[serde(tag = "verb", rename_all = "snake_case", deny_unknown_fields)]
enum Request {
    Survey { file: PathBuf, csv: CsvOptions },
    Traces(traces::Wanted),
    Coherence { toml: String },
    Table { toml: String },
    Toml { table: Value },
    Check { toml: String },
    Identify { toml: String, out: PathBuf },
    Orders { toml: String },
    Draw { run: PathBuf },
    Loop { run: PathBuf, controller: Option<ControllerSettings> },
    Compare { runs: [PathBuf; 2] },
    Archive { run: PathBuf, file: PathBuf },
    Unpack { file: PathBuf, out: PathBuf },
}

/// Answers a request as JSON; `announce` is called with the name of each stage of a run as it begins.
///
/// ```
/// let answer = youla_workbench::answer(r#"{"verb": "table", "toml": "name = \"axis\""}"#, &mut |_| {});
/// assert_eq!(answer, r#"{"name":"axis"}"#);
/// let refused = youla_workbench::answer(r#"{"verb": "table", "toml": "name = "}"#, &mut |_| {});
/// assert!(refused.contains("\"exit\":2"));
/// ```
pub fn answer(request: &str, announce: &mut dyn FnMut(&str)) -> String {
    let answered = serde_json::from_str(request).map_err(Refusal::from).and_then(|request| of(request, announce));
    let value = answered.unwrap_or_else(|why| json!({ "error": why.to_string(), "exit": why.exit() }));
    value.to_string()
}

fn of(request: Request, announce: &mut dyn FnMut(&str)) -> Result<Value> {
    match request {
        Request::Survey { file, csv } => log::survey(&file, &csv),
        Request::Traces(wanted) => traces::traces(&wanted),
        Request::Coherence { toml } => traces::coherence(&toml),
        Request::Table { toml } => toml::from_str(&toml).map_err(|e| Refusal::Text(e.to_string())),
        Request::Toml { table } => {
            let text = toml::to_string(&table).map_err(|e| Refusal::Text(e.to_string()))?;
            Ok(json!({ "toml": text }))
        }
        Request::Check { toml } => run::check(&toml),
        Request::Identify { toml, out } => run::identify(&toml, &out, announce),
        Request::Orders { toml } => orders::orders(&toml),
        Request::Draw { run } => gains::keep(&run),
        Request::Loop { run, controller } => gains::predicted(&run, controller.as_ref()),
        Request::Compare { runs } => run::compare(&runs),
        Request::Archive { run, file } => archive::archive(&run, &file),
        Request::Unpack { file, out } => archive::unpack(&file, &out),
    }
}
