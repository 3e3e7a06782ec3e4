//! The pages in headless Chromium: console, missing parts, zoom, legend, keys, dark, print; at the width of a desktop, of a
//! laptop and of a phone. The tests themselves are JavaScript beside this file, run by Node.
//!
//! Needs `npm`, `node` and Chromium (Debian: `apt-get install npm chromium`). On a continuous integration machine (`CI=true`)
//! Chromium is installed from Debian's packages if that is possible.

use serde_json::{Value, json};
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const FILES: [&str; 4] = ["package.json", "package-lock.json", "browser.mjs", "workbench.mjs"];
const TESTS: [&str; 5] =
    ["pages.test.mjs", "report.test.mjs", "workbench.test.mjs", "gains.test.mjs", "results.test.mjs"];

#[test]
#[ignore = "needs npm, node 20 or later and Chromium"]
fn pages_work_in_chromium() {
    let status = prepared().unwrap_or_else(|missing| panic!("{missing}")).status().expect("node starts");
    assert!(status.success());
}

/// The test runner with pages, browser and packages in place, or what is missing.
fn prepared() -> Result<Command, String> {
    node()?;
    let chromium = chromium()?;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser");
    install(&folder)?;
    let pages = pages(&folder.join("pages"));
    let mut command = Command::new("node");
    command
        .args(["--test", "--test-concurrency=2", "--test-timeout=120000", "--test-reporter=spec"])
        .args(TESTS)
        .current_dir(&folder);
    let workbench = json!({
        "workbench": folder.join("pages/workbench.html").display().to_string(), "program": env!("CARGO_BIN_EXE_youla"),
        "scripts": Path::new(env!("CARGO_MANIFEST_DIR")).join("../youla-workbench/web").display().to_string(),
    });
    command.env("YOULA_CHROMIUM", chromium).env("YOULA_PAGES", pages.to_string());
    command.env("YOULA_WORKBENCH", workbench.to_string());
    Ok(command)
}

/// Oldest version of Node whose test runner and packages serve.
const NODE: u32 = 20;

fn node() -> Result<(), String> {
    let run = Command::new("node").arg("--version").output().map_err(|_| "node is not installed".to_owned())?;
    let version = String::from_utf8_lossy(&run.stdout).trim().to_owned();
    let major = version.trim_start_matches('v').split('.').next().and_then(|n| n.parse::<u32>().ok());
    match major {
        Some(major) if major >= NODE => Ok(()),
        _ => Err(format!("node is {version:?}, and {NODE} or later is needed")),
    }
}

/// `CHROMIUM`, or the first on the path; installed where this is asked for.
fn chromium() -> Result<PathBuf, String> {
    if let Some(path) = env::var_os("CHROMIUM") {
        return Ok(path.into());
    }
    let found = || ["chromium", "chromium-browser", "google-chrome"].iter().find_map(|name| on_path(name));
    if found().is_none() && env::var("CI").is_ok_and(|v| v == "true") && on_path("apt-get").is_some() {
        for arguments in [&["update", "-q"][..], &["install", "-yq", "--no-install-recommends", "chromium"]] {
            // Where it fails, the browser is missing, and that is said.
            let _ = Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive").status();
        }
    }
    found().ok_or_else(|| "Chromium is not installed (Debian: apt-get install chromium; or set CHROMIUM)".into())
}

fn on_path(name: &str) -> Option<PathBuf> {
    env::split_paths(&env::var_os("PATH")?).map(|folder| folder.join(name)).find(|path| path.is_file())
}

/// The tests and the packages that they need, as the lock file says.
fn install(folder: &Path) -> Result<(), String> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/browser");
    fs::create_dir_all(folder).expect("a temporary folder");
    let lock = fs::read(source.join("package-lock.json")).expect("part of the project");
    let there = fs::read(folder.join("installed.json")).is_ok_and(|installed| installed == lock);
    for file in FILES.iter().chain(&TESTS) {
        fs::copy(source.join(file), folder.join(file)).expect("the temporary folder can be written");
    }
    if there {
        return Ok(());
    }
    let Some(npm) = on_path("npm") else {
        return Err("npm is not installed (Debian: apt-get install npm)".into());
    };
    let done =
        Command::new(npm).args(["ci", "--no-audit", "--no-fund", "--loglevel=error"]).current_dir(folder).output();
    match done {
        Ok(done) if done.status.success() => {
            fs::write(folder.join("installed.json"), lock).expect("the temporary folder can be written");
            Ok(())
        }
        Ok(done) => Err(format!("npm ci failed: {}", String::from_utf8_lossy(&done.stderr).trim())),
        Err(error) => Err(format!("npm cannot be run: {error}")),
    }
}

/// Pages of a whole run, of one that lacks most of its parts, of an empty one, and of a comparison.
fn pages(folder: &Path) -> Value {
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).expect("a temporary folder");
    youla(folder, &["demo", "--machine", "bearing", "--out", "demo"]);
    youla(folder, &["demo", "--machine", "bearing", "--seed", "2", "--out", "other"]);
    youla(folder, &["compare", "demo", "other"]);
    let whole: Value =
        serde_json::from_slice(&fs::read(folder.join("demo/report.json")).expect("written")).expect("JSON");
    redrawn(folder, "partial", without_most(whole));
    let empty = youla_report::ReportData::default();
    youla(folder, &["workbench", "--no-open"]);
    redrawn(folder, "empty", serde_json::to_value(empty).expect("plain data"));
    let path = |name: &str| folder.join(name).display().to_string();
    json!({
        "demo": path("demo/report.html"), "partial": path("partial/report.html"), "empty": path("empty/report.html"),
        "comparison": path("comparison.html"),
    })
}

/// As a run without excitation, reduction, bands and residual tests whose first model diverged.
fn without_most(mut report: Value) -> Value {
    for key in ["residuals", "reduction", "redesign", "bezout_residual"] {
        report[key] = Value::Null;
    }
    for key in ["margins", "findings", "loop_tables", "orders", "further"] {
        report[key] = json!([]);
    }
    for key in ["indirect", "bands", "singular"] {
        report["frequency"][key] = json!([]);
    }
    report["fits"][0]["fit"] = Value::Null;
    let diverged = &mut report["verification"][0]["outputs"][0]["predictions"][0];
    for trace in ["predicted", "residual"] {
        for value in diverged[trace]["values"].as_array_mut().expect("values").iter_mut().skip(100) {
            *value = Value::Null;
        }
    }
    report
}

fn redrawn(folder: &Path, name: &str, report: Value) {
    fs::create_dir_all(folder.join(name)).expect("a temporary folder");
    fs::write(folder.join(name).join("report.json"), report.to_string()).expect("written");
    youla(folder, &["report", name]);
}

fn youla(folder: &Path, arguments: &[&str]) {
    let run = Command::new(env!("CARGO_BIN_EXE_youla")).current_dir(folder).args(arguments).arg("--quiet").output();
    let run = run.expect("the program starts");
    assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
}
