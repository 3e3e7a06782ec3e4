//! Settings built in code are checked as those of a file, keys of version 0.1 are refused by their new name, and the shortest
//! run.toml is enough for a run.

use crate::common::Folder;
use std::fmt::Write;
use std::path::Path;
use youla_run::{Method, RunSettings, StageClock, Summary, check_run, identify, parse_table, read_records, write_run};

const MINIMAL: &str = r#"name = "drive"

[data]
sample_time = 1e-2
inputs = [{ name = "u" }]
outputs = [{ name = "y" }]
estimation = [{ file = "log.csv" }]

[controller.difference_equation]
feedback = "negative"
numerator = [1.0]
denominator = [1.0]
"#;

const NOMINAL: &str = r#"
[nominal.transfer_function]
domain = "discrete"
numerator = [0.1]
denominator = [1.0, -0.8]
"#;

fn parse(text: &str) -> youla_run::Result<RunSettings> {
    RunSettings::parse(text, Path::new("run.toml"))
}

#[test]
fn settings_without_a_record_are_refused_not_run() {
    let mut settings = parse(MINIMAL).unwrap();
    let whole = settings.clone();
    settings.data.estimation.clear();
    let message = "[data] names no estimation record";
    let refused = |outcome: Result<(), youla_run::Error>| assert!(outcome.unwrap_err().to_string().contains(message));
    refused(settings.clone().checked().map(|_| ()));
    refused(read_records(&settings.data, Path::new(".")).map(|_| ()));
    refused(check_run(&settings, Path::new(".")).map(|_| ()));
    assert_eq!(whole.clone().checked().unwrap(), whole);
    let mut points = whole;
    points.frequency_response.window = Some(1);
    assert!(points.checked().unwrap_err().to_string().contains("[frequency_response] window is 1"));
}

/// Every form of an order, in run.toml and in the options of the Python `subspace`; what is written reads back.
#[test]
fn orders_are_numbers_words_or_rules() {
    use youla::identify::subspace::{Order, SubspaceOptions};
    use youla::reduce::ReducedOrder;
    for (text, order) in [("8", Order::Fixed(8)), ("\"auto\"", Order::default())] {
        let settings = parse(&format!("{MINIMAL}{NOMINAL}\n[hansen]\norder = {text}\n")).unwrap();
        assert_eq!(settings.hansen.as_ref().unwrap().order, order);
        assert_eq!(parse(&settings.to_toml().unwrap()).unwrap(), settings);
        let direct: SubspaceOptions = parse_table(&format!("order = {text}"), Path::new("o.toml"), "direct").unwrap();
        assert_eq!(direct.order, order);
    }
    for (text, order) in [("4", Some(4)), ("\"auto\"", None)] {
        let settings = parse(&format!("{MINIMAL}\n[recommended]\norder = {text}\n")).unwrap();
        assert_eq!(settings.recommended.order, order);
        assert_eq!(parse(&settings.to_toml().unwrap()).unwrap(), settings);
    }
    for (text, order) in [
        ("6", ReducedOrder::Fixed(6)),
        ("\"minimal\"", ReducedOrder::Minimal),
        ("\"auto\"", ReducedOrder::ClosedLoop(0.05)),
        ("{ bound = 0.1 }", ReducedOrder::Bound(0.1)),
        ("{ closed-loop = 0.1 }", ReducedOrder::ClosedLoop(0.1)),
    ] {
        let settings = parse(&format!("{MINIMAL}\n[reduction]\norder = {text}\n")).unwrap();
        assert_eq!(settings.reduction.as_ref().unwrap().order, order);
        assert_eq!(parse(&settings.to_toml().unwrap()).unwrap(), settings);
    }
}

/// A first-order plant with a pole at 0.9 under u = d - y; d and the noise of the measured y are uniform.
fn log() -> String {
    let mut text = String::from("u,y\n");
    let (mut seed, mut y) = (1u64, 0.0);
    let mut uniform = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
    };
    for _ in 0..3000 {
        let measured = y + 0.01 * uniform();
        let u = uniform() - measured;
        writeln!(text, "{u},{measured}").unwrap();
        y = 0.9 * y + 0.1 * u;
    }
    text
}

/// What needs a nominal model says so; nothing else does.
#[test]
fn a_nominal_model_is_asked_for_where_it_is_needed() {
    let refused = |text: String, says: &str| {
        let error = parse(&text).unwrap_err().to_string();
        assert!(error.contains(says) && error.contains("add [nominal]"), "{error}");
    };
    refused(format!("{MINIMAL}\n[hansen]\norder = 2\n"), "[hansen] identifies the deviation from a nominal model");
    let alpha = MINIMAL.replace("estimation =", "alpha = [{ name = \"a\" }]\nestimation =");
    refused(alpha, "[data] alpha is a port of the factors of a nominal model");
    let gains = "[controller.observer]\nfeedback = \"negative\"\nstate_feedback = [[1.0]]\nobserver_gain = [[1.0]]\n";
    let observer = MINIMAL.split("[controller").next().unwrap().to_owned() + gains;
    refused(observer, "[controller.observer] has the states of a nominal model");
}

/// With and without a nominal model the recommended model and what rests on it are the same, and without `[hansen]` there is no scheme.
#[test]
fn the_recommended_model_does_not_rest_on_a_nominal_one() {
    let folder = Folder::new("nominal");
    std::fs::write(folder.path().join("log.csv"), log()).unwrap();
    let [alone, beside] = [String::new(), NOMINAL.to_owned()].map(|nominal| {
        let settings = parse(&format!("{MINIMAL}{nominal}\n[redesign]\n[reduction]\norder = 1\n")).unwrap();
        let records = read_records(&settings.data, folder.path()).unwrap();
        identify(settings, records, folder.path(), &mut StageClock::new(&mut |_| ())).unwrap()
    });
    for run in [&alone, &beside] {
        assert!(run.refusals().is_empty() && run.scheme().is_none());
        assert!(run.certified().unwrap().exact.stable);
    }
    let plants = [&alone, &beside].map(|run| &run.recommended.as_ref().unwrap().plant);
    assert_eq!(plants[0], plants[1]);
    let margins = [&alone, &beside].map(|run| run.certified().unwrap().margins.clone());
    assert_eq!(margins[0], margins[1]);
    assert!(alone.deviation().unwrap().is_none() && beside.deviation().unwrap().is_some());
    assert!(alone.redesign.unwrap().is_ok() && beside.redesign.unwrap().is_ok());
}

#[test]
fn the_shortest_run_toml_runs_to_its_end() {
    let folder = Folder::new("minimal");
    std::fs::write(folder.path().join("log.csv"), log()).unwrap();
    let settings = parse(MINIMAL).unwrap();
    let records = read_records(&settings.data, folder.path()).unwrap();
    let mut silent = |_| ();
    let mut clock = StageClock::new(&mut silent);
    let run = identify(settings, records, folder.path(), &mut clock).unwrap();
    let plant = &run.validation.of(Method::Likelihood).unwrap().model;
    assert!(plant.poles().unwrap().iter().any(|p| (p.re - 0.9).abs() < 0.01), "{:?}", plant.poles());
    let written = write_run(&run, &folder.path().join("out"), false, &mut clock).unwrap();
    let read = Summary::read(&written.folder).unwrap();
    assert_eq!(read, written.summary);
    assert_eq!(read.schema, 4);
    let responses: serde_json::Value =
        serde_json::from_slice(&std::fs::read(written.folder.join("response.json")).unwrap()).unwrap();
    assert!(responses["models"].as_array().unwrap().iter().any(|m| m["method"] == "likelihood"));
}
