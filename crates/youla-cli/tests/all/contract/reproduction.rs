//! The same result for the same seed, and files that read back.

use super::{json, numbers};
use crate::common::{demo, empty_folder, outcome, youla};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use youla_io::{ChannelSpec, CsvOptions, TimeSource, read_csv, read_mat};
use youla_run::RunModelFile;

#[test]
fn run_toml_of_the_demonstration_reproduces_its_fits() {
    let again = demo().with_file_name("again");
    let _ = fs::remove_dir_all(&again);
    let out = again.to_str().expect("UTF-8");
    let found = youla(
        &empty_folder("elsewhere"),
        &["identify", demo().join("run.toml").to_str().expect("UTF-8"), "--out", out, "--json"],
    );
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    let printed: Value = serde_json::from_str(&found.stdout).expect("JSON only");
    assert_eq!(printed, json(&again.join("summary.json")), "--json prints summary.json");
    let first = json(&demo().join("summary.json"));
    for pointer in ["/nominal/fit", "/methods/hansen/fit", "/methods/hansen_reduced/fit", "/methods/direct/fit"] {
        let fits = |summary: &Value| numbers(&summary.pointer(pointer).expect("there")["verification"]);
        for (a, b) in fits(&first).into_iter().zip(fits(&printed)) {
            assert!((a - b).abs() < 1e-6, "{pointer}: {a} and {b}");
        }
    }
}

#[test]
fn same_seed_same_artefacts_on_any_number_of_threads() {
    for threads in ["1", "2", "7"] {
        let folder = empty_folder(&format!("threads-{threads}"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
        command.current_dir(&folder).env("RAYON_NUM_THREADS", threads).args([
            "demo",
            "--machine",
            "bearing",
            "--out",
            "run",
            "--quiet",
        ]);
        assert_eq!(outcome(&mut command).code, Some(0));
        for name in [
            "run.toml",
            "1-record/estimation-estimation.mat",
            "2-factor/right.json",
            "4-identify/deviation.json",
            "4-identify/direct.json",
            "4-identify/recommended.json",
            "5-recombine/hansen.json",
            "6-reduce/hansen_reduced.json",
            "6-reduce/sweep.json",
            "6-reduce/sweep.csv",
            "7-validate/verdict.json",
        ] {
            let bytes = |run: &Path| fs::read(run.join(name)).expect("readable");
            assert!(bytes(&folder.join("run")) == bytes(demo()), "{name} differs on {threads} threads");
        }
        let timeless = |run: &Path| {
            let mut summary = json(&run.join("summary.json"));
            summary.as_object_mut().expect("an object").remove("seconds");
            summary
        };
        assert_eq!(timeless(&folder.join("run")), timeless(demo()));
    }
    let folder = empty_folder("other-seed");
    assert_eq!(
        youla(&folder, &["demo", "--machine", "bearing", "--seed", "2", "--out", "run", "--quiet"]).code,
        Some(0)
    );
    let bytes = |run: &Path| fs::read(run.join("5-recombine/hansen.json")).expect("readable");
    assert!(bytes(&folder.join("run")) != bytes(demo()));
}

#[test]
fn matlab_models_equal_the_json_ones() {
    for name in [
        "2-factor/nominal",
        "2-factor/controller",
        "2-factor/right",
        "2-factor/left",
        "4-identify/deviation",
        "4-identify/direct",
        "5-recombine/hansen",
        "6-reduce/hansen_reduced",
    ] {
        let path = demo().join(name);
        let text = fs::read_to_string(path.with_extension("json")).expect("readable");
        let model: RunModelFile = serde_json::from_str(&text).expect("a model");
        let system = model.system().expect("shapes that fit");
        let variables = read_mat(path.with_extension("mat")).expect("a MATLAB file");
        for (variable, matrix) in [("a", system.a()), ("b", system.b()), ("c", system.c()), ("d", system.d())] {
            assert_eq!(variables.matrix(variable).expect("there").as_ref(), matrix, "{name}: {variable}");
        }
        assert_eq!(variables.scalar("ts").expect("there"), system.time().ts());
        assert_eq!(model.provenance.seed, Some(1));
    }
}

#[test]
fn report_needs_no_network() {
    let page = fs::read_to_string(demo().join("report.html")).expect("readable");
    for loading in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(loading), "{loading}");
    }
    let known = ["http://www.w3.org/", "https://github.com/leeoniya/uPlot"];
    let addresses = page.match_indices("http").map(|(at, _)| &page[at..]);
    for address in addresses.filter(|a| a.starts_with("http://") || a.starts_with("https://")) {
        let shown: String = address.chars().take(60).collect();
        assert!(known.iter().any(|k| address.starts_with(k)), "{shown}");
    }
}

#[test]
fn signals_read_back() {
    let folder = empty_folder("signals");
    let toml = demo().join("run.toml");
    let found = youla(&folder, &["signals", toml.to_str().expect("UTF-8"), "--out", "deep/csv"]);
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    assert!(found.stdout.contains("estimation.csv (20000 samples)"), "{}", found.stdout);
    let path = folder.join("deep/csv/estimation.csv");
    let header = fs::read_to_string(&path).expect("readable").lines().next().map(str::to_owned).expect("a header");
    let names = ["alpha_u_h", "alpha_u_v", "beta_y_h", "beta_y_v", "eta_u_h", "eta_u_v"];
    assert_eq!(header, format!("t,{}", names.join(",")));
    let time = TimeSource::column("t".parse().expect("a name"));
    let record = read_csv(&path, &names.map(ChannelSpec::named), &time, &CsvOptions::default()).expect("a record");
    assert_eq!((record.samples(), record.time().ts()), (20_000, 2e-4));
    // Nothing but alpha drives the simulated loop, and all samples are there from rest on.
    let (alpha, eta) = (record.column("alpha_u_h").expect("there"), record.column("eta_u_h").expect("there"));
    assert!(alpha.iter().zip(eta).all(|(a, e)| (a - e).abs() < 1e-6));
}
