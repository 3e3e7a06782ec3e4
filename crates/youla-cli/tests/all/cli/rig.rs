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
    fn start() -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
        command.args(["rig", "twin", "--port", "0", "--duration", "300"]).stdout(Stdio::piped());
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
    let twin = Twin::start();
    let record = ["rig", "record", &twin.address, "--out", "log.csv", "--duration", "1", "--excite", "0.5", "--json"];
    let recorded = youla(&folder, &record);
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
