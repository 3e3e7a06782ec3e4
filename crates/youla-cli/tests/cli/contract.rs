//! What programs may rely on: summary.json, artefacts, signals, and the same result for the same seed.

use crate::common::{demo, empty_folder, outcome, youla};
use crate::schema::problem;
use serde_json::{Map, Value};
use std::fs;
use std::path::Path;
use std::process::Command;
use youla_io::export::ExportedController;
use youla_io::{ChannelSpec, CsvOptions, TimeSource, read_csv, read_mat};
use youla_run::{ModelFile, Summary, summary_schema};

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("readable")).expect("JSON")
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[test]
fn summary_has_the_documented_structure() {
    let summary = json(&demo().join("summary.json"));
    let mut expected =
        ["schema", "name", "nominal", "methods", "refused", "frequency_response", "bezout_residual"].to_vec();
    expected.extend([
        "certificate",
        "channel_scales",
        "controller_mismatch",
        "data",
        "recommended",
        "redesign",
        "reduction",
        "seconds",
        "true_plant",
        "uncertainty",
    ]);
    expected.sort_unstable();
    assert_eq!(keys(&summary), expected);
    assert_eq!(summary["schema"], 2);
    assert_eq!(summary["refused"], Value::Object(Map::new()));
    for fit in [&summary["nominal"]["fit"], &summary["true_plant"]["fit"]] {
        assert_eq!(keys(fit), ["verification"]);
        assert_eq!(numbers(&fit["verification"]).len(), 2);
    }
    assert!(summary["bezout_residual"].as_f64().expect("a number") < 1e-12);
    assert!(summary["controller_mismatch"].as_f64().expect("a number") < 1e-9);
    assert_eq!(keys(&summary["uncertainty"]), ["blocks", "evidence", "level", "method"]);
    assert_eq!(summary["uncertainty"]["evidence"]["against_nominal"], true);
    let stages =
        ["certify", "factor", "identify", "record", "redesign", "reduce", "report", "signals", "validate", "write"];
    assert_eq!(keys(&summary["seconds"]), stages);
    assert!(stages.iter().all(|s| summary["seconds"][s].as_f64().is_some_and(|t| t >= 0.0)));
}

/// The contract on the recommended model; its file is a model, and its deviations have one number per frequency, output and input.
#[test]
fn summary_recommends_one_model() {
    let recommended = &json(&demo().join("summary.json"))["recommended"];
    let expected =
        ["dead_time", "evidence", "file", "method", "modes", "order", "reasons", "response_deviation", "trusted"];
    assert_eq!(keys(recommended), expected);
    assert!(recommended["method"] == "likelihood" && recommended["trusted"] == true, "{:?}", recommended["reasons"]);
    let model = json(&demo().join(recommended["file"].as_str().expect("a path")));
    for matrix in ["a", "b", "c", "d", "ts"] {
        assert!(!model[matrix].is_null(), "{matrix}");
    }
    let deviation = &recommended["response_deviation"];
    let hz = numbers(&deviation["hz"]);
    let absolute = deviation["absolute"].as_array().expect("an array");
    assert!(hz.windows(2).all(|w| w[0] < w[1]) && absolute.len() == hz.len());
    let positive = |row: &Value| numbers(row).len() == 2 && numbers(row).iter().all(|s| *s > 0.0);
    assert!(absolute.iter().all(|at| at.as_array().is_some_and(|rows| rows.len() == 2 && rows.iter().all(positive))));
    for e in recommended["evidence"].as_array().expect("an array") {
        assert!(e["question"].as_str().is_some_and(|q| q.ends_with('?')) && e["limit"].is_number(), "{e}");
    }
}

/// The file fits the schema that `summary_schema` states, and the type reads it back.
#[test]
fn summary_fits_its_schema() {
    let summary = json(&demo().join("summary.json"));
    let schema = summary_schema();
    assert_eq!(problem(&schema, &schema, &summary, "summary.json"), None);
    let mut wrong = summary.clone();
    wrong["methods"]["hansen"]["order"] = "sixteen".into();
    assert!(problem(&schema, &schema, &wrong, "summary.json").is_some());
    let read = Summary::read(demo()).expect("a summary");
    assert_eq!(serde_json::to_value(&read).expect("JSON"), summary);
}

#[test]
fn summary_describes_every_method() {
    let summary = json(&demo().join("summary.json"));
    assert_eq!(keys(&summary["methods"]), ["direct", "hansen", "hansen_reduced", "likelihood"]);
    let common = ["fit", "modes", "order", "poles", "residuals", "robustness", "stabilised_by_controller"];
    let hansen = [
        "fit",
        "modes",
        "order",
        "poles",
        "residuals",
        "robustness",
        "s_order",
        "s_stable",
        "stabilised_by_controller",
    ];
    for (name, expected, order) in [
        ("direct", &common[..], 6),
        ("hansen", &hansen[..], 16),
        ("hansen_reduced", &hansen[..], 6),
        ("likelihood", &common[..], 6),
    ] {
        let method = &summary["methods"][name];
        assert_eq!(keys(method), expected, "{name}");
        assert_eq!(method["order"], order, "{name}");
        assert!(method["stabilised_by_controller"].is_boolean());
        assert!(numbers(&method["fit"]["verification"]).iter().all(|f| (20.0..100.0).contains(f)), "{name}");
        let poles = method["poles"].as_array().expect("an array");
        assert_eq!(poles.len(), order);
        assert!(poles.iter().all(|p| numbers(p).len() == 2));
        let modes = method["modes"].as_array().expect("an array");
        let with_deviations = ["hz", "hz_deviation", "hz_interval", "zeta", "zeta_deviation", "zeta_interval"];
        let of_mode = if ["hansen", "likelihood"].contains(&name) { &with_deviations[..] } else { &["hz", "zeta"] };
        assert!(!modes.is_empty() && modes.iter().all(|m| keys(m) == of_mode), "{name}");
    }
    assert_eq!(summary["methods"]["hansen"]["s_order"], 10);
    assert_eq!(summary["methods"]["hansen"]["s_stable"], true);
}

#[test]
fn the_reduction_is_measured_at_every_order() {
    let reduction = &json(&demo().join("summary.json"))["reduction"];
    let figures = ["closed_loop_relative", "error_bound", "kept", "method", "minimal_order", "open_loop_error"];
    let others = ["open_loop_relative", "order", "proposed_order", "stabilised_by_controller"];
    assert_eq!(keys(reduction), [&figures[..], &others[..]].concat());
    assert_eq!((&reduction["order"], &reduction["minimal_order"]), (&Value::from(6), &Value::from(16)));
    assert_eq!(
        (&reduction["stabilised_by_controller"], &reduction["proposed_order"]),
        (&Value::Bool(true), &Value::Null)
    );
    assert!(reduction["open_loop_error"].as_f64() <= reduction["error_bound"].as_f64());
    let sweep = json(&demo().join("6-reduce/sweep.json"));
    let orders = sweep["orders"].as_array().expect("an array");
    assert_eq!(orders.len(), 16);
    assert_eq!(orders[5]["closed_loop_relative"], reduction["closed_loop_relative"]);
    assert_eq!(sweep["provenance"]["seed"], 1);
    let table = fs::read_to_string(demo().join("6-reduce/sweep.csv")).expect("readable");
    let header = "order,error_bound,open_loop_error,open_loop_relative,closed_loop_relative,stabilised_by_controller";
    assert!(table.starts_with(&format!("{header},worst_pole_re,worst_pole_im\n")), "{table}");
    assert_eq!(table.lines().count(), 17);
    let page = fs::read_to_string(demo().join("report.html")).expect("readable");
    assert!(page.contains("The controller stabilises the reduced model of order 6"));
}

/// The demonstration's controller stabilises the bearing with hardly any damping; the region of S is small.
#[test]
fn the_certificate_covers_the_region_of_s_and_wrong_controllers() {
    let certificate = &json(&demo().join("summary.json"))["certificate"];
    let expected = ["band", "controller_errors", "deviation_poles", "identity_residual", "margins", "stable"];
    assert_eq!(keys(certificate), expected);
    assert_eq!((&certificate["stable"], &certificate["band"]["holds"]), (&Value::Bool(true), &Value::Bool(true)));
    assert!(certificate["identity_residual"].as_f64().expect("a number") < 1e-9);
    let band = &certificate["band"];
    assert_eq!((band["models"].as_u64(), band["within"].as_u64()), (Some(500), Some(475)));
    let [low, high] = [0, 1].map(|k| numbers(&band["radius"]["bounds"])[k]);
    let estimate = band["radius"]["value"].as_f64().expect("a number");
    assert!(low < estimate && estimate < high && high < 1.0);
    let errors = certificate["controller_errors"].as_array().expect("an array");
    let names: Vec<&str> = errors.iter().filter_map(|e| e["error"].as_str()).collect();
    assert_eq!(names, ["none", "delay", "gain_high", "gain_low", "saturation", "initial_state"]);
    // With a delay left out S comes out unstable; 5 % of gain move the modes of the machine by less than 1 %.
    assert!(errors[1]["deviation_radius"].as_f64() > Some(1.0));
    let machine = |error: &Value| {
        let modes = error["modes"].as_array().expect("an array").clone();
        modes.into_iter().filter(|m| m["without"]["hz"].as_f64() > Some(190.0)).collect::<Vec<_>>()
    };
    for error in &errors[2..4] {
        assert_eq!(machine(error).len(), 2);
        for mode in machine(error) {
            let ratio = mode["hz"].as_f64().unwrap() / mode["without"]["hz"].as_f64().unwrap();
            assert!((ratio - 1.0).abs() < 0.01, "{mode}");
        }
    }
    let file = json(&demo().join("7-validate/certificate.json"));
    assert_eq!(file["band"], certificate["band"]);
}

#[test]
fn the_new_controller_is_exported_with_its_promise() {
    let redesign = &json(&demo().join("summary.json"))["redesign"];
    let damping = |of: &str| redesign[of]["least_damping"].as_f64().expect("a number");
    assert!(damping("predicted") > 5.0 * damping("present"), "{redesign}");
    assert_eq!(redesign["band"]["holds"], true);
    let text = fs::read_to_string(demo().join("8-redesign/controller.json")).expect("readable");
    let data: ExportedController = serde_json::from_str(&text).expect("the documented form");
    let model: ModelFile =
        serde_json::from_str(&fs::read_to_string(demo().join("8-redesign/new_controller.json")).expect("readable"))
            .expect("a model");
    assert_eq!((&data.controller.a, &data.controller.c), (&model.matrices.a, &model.matrices.c));
    let observer = data.observer.expect("LQG has an observer form");
    assert_eq!((observer.model.a.len(), observer.f.len(), observer.l[0].len()), (6, 2, 2));
    let source = fs::read_to_string(demo().join("8-redesign/controller.rs")).expect("readable");
    assert!(source.contains("pub const OBSERVER: Matrices<f64, 6, 2, 2> = Matrices {"), "{source}");
    assert!(source.contains(&format!("{:?}", observer.f[0][0])), "{source}");
}

#[test]
fn summary_says_what_each_loop_can_bear() {
    let summary = json(&demo().join("summary.json"));
    let scales = &summary["channel_scales"];
    assert_eq!(keys(scales), ["basis", "inputs", "outputs"]);
    assert!(["inputs", "outputs"].iter().all(|s| numbers(&scales[s]).iter().all(|x| *x > 0.0)));
    let expected = [
        "coprime_margin",
        "delay_margin_s",
        "highest_gain",
        "input_disk_margin",
        "iso_14839_zone",
        "lowest_gain",
        "nu_gap_to_hansen",
        "nu_gap_to_nominal",
        "output_disk_margin",
        "output_peak_sensitivities",
        "peak_complementary_sensitivity",
        "peak_input_sensitivity",
        "peak_sensitivity",
        "phase_margin_deg",
        "refused",
    ];
    for model in ["/nominal", "/true_plant", "/methods/direct", "/methods/hansen", "/methods/hansen_reduced"] {
        let entry = summary.pointer(model).expect("there");
        let robustness = &entry["robustness"];
        assert_eq!(keys(robustness), expected, "{model}");
        let number = |key: &str| robustness[key].as_f64().expect("a number");
        for key in ["coprime_margin", "nu_gap_to_hansen", "nu_gap_to_nominal"] {
            assert!((0.0..=1.0).contains(&number(key)), "{model}: {key}");
        }
        if entry["stabilised_by_controller"] == false {
            assert!(robustness["refused"].as_str().expect("a reason").contains("unstable"));
            assert_eq!((number("coprime_margin"), &robustness["peak_sensitivity"]), (0.0, &Value::Null));
            continue;
        }
        assert_eq!(robustness["refused"], Value::Null, "{model}");
        let peaks = numbers(&robustness["output_peak_sensitivities"]);
        assert!(peaks.len() == 2 && peaks.iter().all(|p| *p <= number("peak_sensitivity") * (1.0 + 1e-6)), "{model}");
        assert!(["A", "B", "C", "D"].contains(&robustness["iso_14839_zone"].as_str().expect("a zone")));
        assert!(number("lowest_gain") < 1.0 && number("highest_gain") > 1.0);
        assert!(number("phase_margin_deg") > 0.0 && number("delay_margin_s") > 0.0);
        for disk in ["input_disk_margin", "output_disk_margin"] {
            assert_eq!(keys(&robustness[disk]), ["alpha", "highest_gain", "lowest_gain", "phase_deg"]);
            assert!(robustness[disk]["alpha"].as_f64().expect("a number") > 0.0);
        }
    }
    let gap = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).expect("a number");
    assert!(gap("/nominal/robustness/nu_gap_to_nominal") < 1e-6);
    assert!(gap("/methods/hansen/robustness/nu_gap_to_hansen") < 1e-6);
    let there = gap("/methods/hansen/robustness/nu_gap_to_nominal");
    assert!((there - gap("/nominal/robustness/nu_gap_to_hansen")).abs() < 1e-6);
}

#[test]
fn frequency_responses_share_one_grid() {
    let response = &json(&demo().join("summary.json"))["frequency_response"];
    let all = [
        "coherence",
        "direct_db",
        "hansen_db",
        "hansen_reduced_db",
        "hz",
        "indirect_db",
        "likelihood_db",
        "nominal_db",
        "true_plant_db",
    ];
    assert_eq!(keys(response), all);
    let hz = numbers(&response["hz"]);
    assert!(hz.len() > 100 && hz.windows(2).all(|w| w[0] < w[1]));
    // Two inputs and two outputs: [output][input][frequency], coherence [output][frequency].
    let array = |value: &Value| value.as_array().expect("an array").clone();
    for key in all.iter().filter(|key| key.ends_with("_db")) {
        let outputs = array(&response[key]);
        assert_eq!(outputs.len(), 2, "{key}");
        for curves in outputs.iter().map(array) {
            assert!(curves.len() == 2 && curves.iter().all(|curve| numbers(curve).len() == hz.len()), "{key}");
        }
    }
    let coherence = array(&response["coherence"]);
    assert_eq!(coherence.len(), 2);
    assert!(coherence.iter().all(|c| numbers(c).len() == hz.len()));
    assert!(coherence.iter().flat_map(numbers).all(|c| (0.0..=1.0 + 1e-12).contains(&c)));
}

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
    for threads in ["1", "2"] {
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
            "4-identify/stabilisation_deviation.json",
            "4-identify/stabilisation_deviation.csv",
            "4-identify/stabilisation_direct.json",
            "4-identify/stabilisation_direct.csv",
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
        let model: ModelFile = serde_json::from_str(&text).expect("a model");
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
