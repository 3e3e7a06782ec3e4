//! The page: template, style, scripts and the method put into one file, which makes no request.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use minijinja::{Environment, Value, context};
use youla_report::page_parts;

const TEMPLATE: &str = include_str!("../web/page.html");
const STYLE: &str = include_str!("../web/workbench.css");
const SHIM: &str = include_str!("../web/wasi-shim/wasi_shim.min.js");
const SHIM_LICENCE: &str = include_str!("../web/wasi-shim/LICENSE");
const WORKER: &str = include_str!("../web/worker.js");
/// In the order in which each uses those before it.
const SCRIPT: [&str; 11] = [
    include_str!("../web/plot.js"),
    include_str!("../web/numbers.js"),
    include_str!("../web/engine.js"),
    include_str!("../web/settings.js"),
    include_str!("../web/log.js"),
    include_str!("../web/controller.js"),
    include_str!("../web/signals.js"),
    include_str!("../web/gains.js"),
    include_str!("../web/orders.js"),
    include_str!("../web/runs.js"),
    include_str!("../web/main.js"),
];
/// This crate's program for wasm32-wasip1, packed (build.sh).
const METHOD: &[u8] = include_bytes!("../assets/youla-workbench.wasm.gz");

/// The workbench as one HTML file.
///
/// # Errors
/// [`youla_report::Error::ReportTemplate`] where the template cannot be filled.
///
/// ```
/// let page = youla_workbench::page()?;
/// assert!(page.starts_with("<!doctype html>") && page.len() < 6_000_000);
/// # Ok::<(), youla_report::Error>(())
/// ```
pub fn page() -> youla_report::Result<String> {
    let parts = page_parts();
    let safe = Value::from_safe_string;
    let page = context! {
        version => env!("CARGO_PKG_VERSION"),
        style => safe(format!("{}\n{STYLE}", parts.style)),
        worker => safe(format!("/*!\n@bjorn3/browser_wasi_shim\n{SHIM_LICENCE}*/\n{SHIM}\n{WORKER}")),
        method => safe(BASE64_STANDARD.encode(METHOD)),
        library => safe(parts.library),
        script => safe(format!("{}\n{}", parts.helpers, SCRIPT.concat())),
    };
    let mut environment = Environment::new();
    let rendered = environment
        .add_template("page.html", TEMPLATE)
        .and_then(|()| environment.get_template("page.html")?.render(page));
    rendered.map_err(|source| youla_report::Error::ReportTemplate { source })
}
