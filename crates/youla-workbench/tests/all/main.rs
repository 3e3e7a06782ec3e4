//! Requests to the method, as the page makes them.
#![allow(clippy::unwrap_used, clippy::panic)]

use serde_json::{Value, json};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

fn ask(request: &Value) -> Value {
    serde_json::from_str(&youla_workbench::answer(&request.to_string(), &mut |_| {})).unwrap()
}

/// A folder that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("youla-workbench-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Folder(folder)
    }

    fn file(&self, name: &str, content: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// `y(k+1) = 0.9 y(k) + 0.1 u(k)` under `u = -2 (y + v) + d`; d switches by a shift register, v is uniform.
fn log(samples: usize) -> String {
    let (mut state, mut y, mut text) = (1_u32, 0.0, String::from("t,u,y,d\n"));
    for k in 0..samples {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let (d, v) = (if state >> 31 == 1 { 0.5 } else { -0.5 }, f64::from(state >> 8 & 0xffff) / 65536.0 - 0.5);
        let measured = y + 0.02 * v;
        let u = -2.0 * measured + d;
        writeln!(text, "{:.3},{u:.9},{measured:.9},{d}", k as f64 * 1e-3).unwrap();
        y = 0.9 * y + 0.1 * u;
    }
    text
}

fn settings(log: &Path, feedback: &str) -> String {
    format!(
        "name = \"lag\"\n[data]\ntime_column = \"t\"\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
         input_excitation = [{{ name = \"d\" }}]\nestimation = [{{ file = {log:?}, take = 2000 }}]\n\
         verification = [{{ file = {log:?}, skip = 2000 }}]\n[controller.difference_equation]\n{feedback}\
         numerator = [2.0]\ndenominator = [1.0]\n"
    )
}

#[test]
fn from_a_log_to_gains() {
    let folder = Folder::new("gains");
    let log = folder.file("log.csv", &log(3000));
    let columns = ask(&json!({ "verb": "survey", "file": log, "csv": {} }));
    let roles: Vec<&str> = columns["columns"].as_array().unwrap().iter().map(|c| c["role"].as_str().unwrap()).collect();
    assert_eq!(roles, ["time", "input", "output", "excitation"]);
    let traces = ask(&json!({ "verb": "traces", "file": log, "csv": {}, "columns": ["u", "y"], "sample_time": 1e-3 }));
    assert_eq!((&traces["samples"], traces["curves"].as_array().unwrap().len()), (&json!(3000), 2));
    let toml = settings(&log, "feedback = \"negative\"\n");
    let found = ask(&json!({ "verb": "check", "toml": toml }));
    assert_eq!(found["controller"]["severity"], "note", "{found}");
    let run = folder.0.join("run");
    let result = ask(&json!({ "verb": "identify", "toml": toml, "out": run }));
    assert!(result["sentence"].as_str().unwrap().starts_with("Trusted"), "{result}");
    assert_eq!(ask(&json!({ "verb": "draw", "run": run }))["draws"], 100);

    // The loop has its pole at 0.9 - 0.1 k: with k = 2 its step ends at 2/3, and k = 25 makes it unstable.
    let of = |k: f64| {
        let controller =
            json!({ "difference_equation": { "feedback": "negative", "numerator": [k], "denominator": [1.0] } });
        ask(&json!({ "verb": "loop", "run": run, "controller": controller }))
    };
    let running = ask(&json!({ "verb": "loop", "run": run, "controller": null }));
    let same = of(2.0);
    assert_eq!(running, same);
    let step = same["step"][0]["centre"].as_array().unwrap();
    assert!((step[step.len() - 1].as_f64().unwrap() - 2.0 / 3.0).abs() < 0.02, "{step:?}");
    assert!((same["worst_pole"].as_f64().unwrap() - 0.7).abs() < 0.02);
    let unstable = of(25.0);
    assert_eq!((&unstable["stable"], &unstable["unstable"]), (&json!(false), &json!(100)));
    assert!(unstable.get("step").is_none() && unstable.get("sensitivity").is_none());

    let packed = folder.0.join("run.zip");
    ask(&json!({ "verb": "archive", "run": run, "file": packed }));
    assert!(fs::metadata(&packed).unwrap().len() > 10_000);
    let again = folder.0.join("again");
    assert_eq!(ask(&json!({ "verb": "unpack", "file": packed, "out": again })), json!({ "run": true }));
    for name in ["report.json", "4-identify/region.json"] {
        assert_eq!(fs::read(run.join(name)).unwrap(), fs::read(again.join(name)).unwrap());
    }
    assert_eq!(ask(&json!({ "verb": "draw", "run": again }))["draws"], 100);

    // At the limit of stability, k = 19, the controller that ran stabilises a part of the region: the rest is counted.
    let file = again.join("2-factor/controller.json");
    let mut controller: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let (mut low, mut high) = (10.0, 30.0);
    let left = loop {
        let k = 0.5 * (low + high);
        controller["d"] = json!([[-k]]);
        fs::write(&file, controller.to_string()).unwrap();
        match ask(&json!({ "verb": "draw", "run": again }))["draws"].as_u64().unwrap() {
            0 => high = k,
            100 => low = k,
            left => break left,
        }
    };
    let of_part = ask(&json!({ "verb": "loop", "run": again, "controller": null }));
    assert_eq!((&of_part["drawn"], &of_part["draws"], &of_part["unstable"]), (&json!(100), &json!(left), &json!(0)));
}

/// Two resonances at 40 and 90 Hz are steady modes of all orders above theirs.
#[test]
fn modes_are_steady_over_the_order() {
    let folder = Folder::new("orders");
    let (mut state, mut u) = (1_u32, [0.0; 2]);
    let mut modes = [40.0, 90.0].map(|hz| {
        let (w, r) = (std::f64::consts::TAU * hz * 1e-3, (-0.02 * std::f64::consts::TAU * hz * 1e-3_f64).exp());
        (2.0 * r * w.cos(), -r * r, [0.0; 2])
    });
    let mut text = String::from("t,u,y\n");
    for k in 0..4000 {
        let mut y = 0.0;
        for (a, b, x) in &mut modes {
            let new = *a * x[0] + *b * x[1] + 0.1 * u[1];
            *x = [new, x[0]];
            y += new;
        }
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 16) / 65536.0 - 0.5;
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        u = [f64::from(state >> 16) / 65536.0 - 0.5, u[0]];
        writeln!(text, "{:.3},{:.9},{:.9}", k as f64 * 1e-3, u[0], y + 0.01 * noise).unwrap();
    }
    let log = folder.file("log.csv", &text);
    let toml = format!(
        "name = \"two\"\n[data]\ntime_column = \"t\"\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
         estimation = [{{ file = {log:?} }}]\n[controller.state_space]\nfeedback = \"positive\"\na = []\nb = []\nc = [[]]\nd = [[0.0]]\n"
    );
    let found = ask(&json!({ "verb": "orders", "toml": toml }));
    let modes = found["modes"].as_array().unwrap();
    for order in 8..=20 {
        for hz in [40.0, 90.0] {
            let here = |m: &&Value| m["order"] == order && (m["hz"].as_f64().unwrap() - hz).abs() < 0.5;
            assert_eq!(modes.iter().find(here).map(|m| &m["steady"]), Some(&json!(true)), "{hz} Hz at order {order}");
        }
    }
}

#[test]
fn refusals_are_sentences() {
    let folder = Folder::new("refusals");
    let log = folder.file("log.csv", &log(3000));
    let without_sign = ask(&json!({ "verb": "check", "toml": settings(&log, "") }));
    assert!(without_sign["error"].as_str().unwrap().contains("the log agrees with negative"), "{without_sign}");
    for request in [
        json!({ "verb": "survey", "file": folder.0.join("absent.csv"), "csv": {} }),
        json!({ "verb": "survey", "file": folder.file("words.csv", "a,b\nc,d\n"), "csv": {} }),
        json!({ "verb": "draw", "run": folder.0 }),
        json!({ "verb": "unpack", "file": log, "out": folder.0.join("run") }),
        json!({ "verb": "compare", "runs": [folder.0, folder.0] }),
        json!({ "verb": "unknown" }),
    ] {
        let refused = ask(&request);
        assert_eq!(refused["exit"], 2, "{refused}");
        assert!(refused["error"].as_str().unwrap().len() > 20, "{refused}");
    }
}
