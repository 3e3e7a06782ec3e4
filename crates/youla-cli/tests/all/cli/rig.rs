//! `youla rig`: a twin over the loopback, from the record to the model.

use crate::common::{empty_folder, youla};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A twin on a free port; ends with the test.
struct Twin {
    process: Child,
    address: String,
}

impl Twin {
    fn start(more: &[&str]) -> Self {
        Self::at("0", more)
    }

    fn at(port: &str, more: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
        command.args(["rig", "twin", "--port", port, "--duration", "300"]).args(more).stdout(Stdio::piped());
        let mut process = command.spawn().expect("the program starts");
        let mut address = String::new();
        BufReader::new(process.stdout.as_mut().expect("piped")).read_line(&mut address).expect("a line");
        Twin { process, address: address.trim().to_owned() }
    }
}

impl Drop for Twin {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn identify_takes_the_record_as_it_is() {
    let folder = empty_folder("rig");
    let twin = Twin::start(&[]);
    let record =
        ["rig", "excite", &twin.address, "--amplitude", "0.5", "--out", "log.csv", "--duration", "1", "--json"];
    // Another host meanwhile takes nothing from the log.
    let address = twin.address.clone();
    let asked = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(600));
        youla(&empty_folder("rig-status"), &["rig", "status", &address]).stdout
    });
    let recorded = youla(&folder, &record);
    let status = asked.join().expect("asked");
    assert!(status.contains("exciting") || status.contains("idle"), "{status}");
    assert_eq!((recorded.code, recorded.stderr.as_str()), (Some(0), ""));
    let report: serde_json::Value = serde_json::from_str(&recorded.stdout).expect("JSON");
    let number = |key: &str| report[key].as_u64().expect("a number");
    assert!(number("rows") + number("missing") >= 20_000 && number("rows") > 10_000, "{report}");
    assert_eq!((number("damaged"), report["trips"].as_array().map(Vec::len)), (0, Some(0)));

    let again = youla(&folder, &record);
    assert!(again.code == Some(2) && again.stderr.contains("log.csv exists already"), "{}", again.stderr);
    let identified = youla(&folder, &["identify", "run.toml", "--out", "run", "--json"]);
    assert_eq!(identified.code, Some(0), "{}", identified.stderr);

    let status = youla(&folder, &["rig", "status", &twin.address]);
    assert!(status.stdout.contains("rotor: sample") && status.stdout.contains("idle, Q = 0"), "{}", status.stdout);
    let q = r#"{"method": "youla", "ts": 5e-5, "measured": [], "commanded": [],
        "controller": {"a": [], "b": [], "c": [], "d": []},
        "q": {"a": [[0.5]], "b": [[0.1, 0.0]], "c": [[0.0], [-0.2]], "d": [[0.0, 0.0], [0.0, 0.0]]}}"#;
    std::fs::write(folder.join("q.json"), q).expect("written");
    let loaded = youla(&folder, &["rig", "load", &twin.address, "q.json", "--switch"]);
    assert!(loaded.code == Some(0) && loaded.stdout.contains("Q of bank 1"), "{} {}", loaded.stdout, loaded.stderr);
    std::fs::write(folder.join("d.json"), q.replace("[[0.0, 0.0], [0", "[[0.5, 0.0], [0")).expect("written");
    let refused = youla(&folder, &["rig", "load", &twin.address, "d.json"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("feedthrough"), "{}", refused.stderr);
    let stopped = youla(&folder, &["rig", "stop", &twin.address, "--release"]);
    assert!(stopped.stdout.contains("Q = 0"), "{}", stopped.stdout);
    let nobody = youla(&folder, &["rig", "status", "udp://127.0.0.1:1"]);
    assert!(nobody.code == Some(2) && nobody.stderr.contains("does not answer"), "{}", nobody.stderr);
}

/// From the key to the log of a machine that takes nothing else; a stop without the key.
#[test]
fn a_machine_with_a_key() {
    let folder = empty_folder("rig-key");
    let key = folder.join("rig.key").display().to_string();
    assert!(youla(&folder, &["rig", "key", "rig.key"]).stdout.contains(",key=rig.key"));
    let again = youla(&folder, &["rig", "key", "rig.key"]);
    assert!(again.code == Some(2) && again.stderr.contains("rig.key: "), "{}", again.stderr);
    let twin = Twin::start(&["--key", &key]);
    let keyed = format!("{},key=rig.key", twin.address);
    let record = |address: &str| {
        youla(
            &folder,
            &["rig", "excite", address, "--amplitude", "0.5", "--out", "log.csv", "--duration", "0.5", "--json"],
        )
    };
    let refused = record(&twin.address);
    assert!(refused.code == Some(2) && refused.stderr.contains("put \",key=FILE\""), "{}", refused.stderr);
    assert!(!folder.join("log.csv").exists());
    let recorded = record(&keyed);
    assert_eq!((recorded.code, recorded.stderr.as_str()), (Some(0), ""));
    assert!(recorded.stdout.contains("\"foreign\":0"), "{}", recorded.stdout);
    let stopped = youla(&folder, &["rig", "stop", &twin.address]);
    assert!(stopped.code == Some(0) && stopped.stdout.contains("idle"), "{} {}", stopped.stdout, stopped.stderr);
    let missing = youla(&folder, &["rig", "status", &format!("{},key=none.key", twin.address)]);
    assert!(missing.code == Some(2) && missing.stderr.contains("none.key: "), "{}", missing.stderr);
}

/// A machine that starts again while it is recorded: two files, and the program says so.
#[test]
fn a_restart_parts_the_record() {
    let folder = empty_folder("rig-restart");
    let twin = Twin::start(&["--seed", "1"]);
    let (address, to) = (twin.address.clone(), folder.clone());
    let recorded = std::thread::spawn(move || {
        youla(&to, &["rig", "record", &address, "--out", "log.csv", "--duration", "4", "--json"])
    });
    while !folder.join("log.csv").exists() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    let port = twin.address.rsplit(':').next().expect("a port").to_owned();
    drop(twin);
    let _again = Twin::at(&port, &["--seed", "2"]);
    let recorded = recorded.join().expect("recorded");
    assert_eq!(recorded.code, Some(2), "{} {}", recorded.stdout, recorded.stderr);
    assert!(recorded.stderr.contains("the machine started again while it was recorded: the log has 2 parts"));
    let report: serde_json::Value = serde_json::from_str(&recorded.stdout).expect("JSON");
    for (part, name) in ["log.csv", "log-part-2.csv"].iter().enumerate() {
        let lines = std::fs::read_to_string(folder.join(name)).expect("a file").lines().count() as u64;
        assert_eq!(report["parts"][part]["rows"].as_u64(), Some(lines - 1), "{report}");
    }
}

/// The gas bearing in the time of the requests, then the identified model as a twin under the same loop.
#[test]
fn a_model_of_a_twin_is_a_twin() {
    let folder = empty_folder("rig-twins");
    let file = format!("{}/../../examples/commission/weak.toml", env!("CARGO_MANIFEST_DIR"));
    let bearing = Twin::start(&[&file, "--bearing", "instrumented"]);
    let excite = |address: &str, log: &str| {
        let words =
            ["rig", "excite", address, "--amplitude", "0.5", "--hold", "8", "--duration", "4", "--settings", &file];
        let recorded = youla(&folder, &[&words[..], &["--out", log, "--force", "--json"]].concat());
        assert_eq!((recorded.code, recorded.stderr.as_str()), (Some(0), ""));
        serde_json::from_str::<serde_json::Value>(&recorded.stdout).expect("JSON")
    };
    let report = excite(&bearing.address, "log.csv");
    assert!(report["rows"].as_u64() > Some(15_000), "{report}");
    let identified = youla(&folder, &["identify", "run.toml", "--out", "run", "--json"]);
    assert_eq!(identified.code, Some(0), "{}", identified.stderr);
    let resonances = |text: &str| -> Vec<f64> {
        let summary: serde_json::Value = serde_json::from_str(text).expect("JSON");
        let modes = summary["recommended"]["modes"].as_array().expect("modes");
        let light = modes.iter().filter(|mode| mode["zeta"].as_f64().is_some_and(|zeta| zeta < 0.2));
        light.map(|mode| mode["hz"].as_f64().expect("a number")).collect()
    };
    let of_bearing = resonances(&identified.stdout);
    assert_eq!(of_bearing.len(), 2, "{of_bearing:?}");

    let model = Twin::start(&[&file, "--model", &folder.join("run").display().to_string()]);
    excite(&model.address, "again.csv");
    let identified = youla(&folder, &["identify", "run.toml", "--out", "again", "--json"]);
    assert_eq!(identified.code, Some(0), "{}", identified.stderr);
    let of_model = resonances(&identified.stdout);
    let near = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < 5e-3;
    assert!(of_model.len() == 2 && of_model.iter().zip(&of_bearing).all(near), "{of_model:?} {of_bearing:?}");
}

#[test]
fn a_twin_that_cannot_be_is_refused() {
    let folder = empty_folder("rig-refused");
    let file = format!("{}/../../examples/commission/weak.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::write(
        folder.join("one.json"),
        r#"{"name": "g", "inputs": [{"name": "u", "unit": "V"}],
        "outputs": [{"name": "y", "unit": "um"}], "ts": 1e-3, "a": [[0.5]], "b": [[1]], "c": [[1]], "d": [[0]]}"#,
    )
    .expect("written");
    for (words, sentence) in [
        (&["--model", "one.json"][..], "its plant has 1 inputs and 1 outputs"),
        (&["--model", "none.json"], "none.json"),
        (&["--bearing", "rotating", "--rpm=-5"], "speed"),
    ] {
        let refused = youla(&folder, &[&["rig", "twin", &file, "--port", "0"][..], words].concat());
        assert!(refused.code == Some(2) && refused.stderr.contains(sentence), "{}", refused.stderr);
    }
    let twin = Twin::start(&[]);
    let log = youla(&folder, &["rig", "record", &twin.address, "--out", "log.txt", "--duration", "1"]);
    assert!(log.code == Some(2) && log.stderr.contains("a log is a .csv file"), "{}", log.stderr);
    std::fs::write(
        folder.join("table.json"),
        r#"{"ts": 5e-5, "points": [
        {"name": "a", "rpm": 0, "q": {"a": [[0.5]], "b": [[0.1, 0]], "c": [[0], [0.2]], "d": [[0, 0], [0, 0]]}},
        {"name": "b", "rpm": 1000, "q": {"a": [[0.5]], "b": [[0.1, 0]], "c": [[0], [-0.2]], "d": [[0, 0], [0, 0]]}}],
        "between": [{"gain": 0.1, "room": 1, "change": 0.1, "region": 0.1, "q_room": 0.5, "q_error": 0}]}"#,
    )
    .expect("written");
    let load = |words: &[&str]| youla(&folder, &[&["rig", "load", &twin.address, "table.json"][..], words].concat());
    let (without, beyond, within) = (load(&[]), load(&["--speed", "1001"]), load(&["--speed", "250", "--switch"]));
    assert!(without.code == Some(2) && without.stderr.contains("add --speed RPM"), "{}", without.stderr);
    assert!(beyond.stderr.contains("the table holds 0 to 1000 rpm, not 1001 rpm"), "{}", beyond.stderr);
    assert!(within.code == Some(0) && within.stdout.contains("Q of bank 1"), "{} {}", within.stdout, within.stderr);
}
