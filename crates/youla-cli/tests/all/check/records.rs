//! Copies of measured records, and the program run on them.

use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use youla_io::{ChannelRef, ChannelSpec, Source, TimeSource, read};

/// A record by columns.
#[derive(Clone)]
pub(crate) struct Log {
    pub(crate) names: Vec<String>,
    pub(crate) columns: Vec<Vec<f64>>,
}

impl Log {
    pub(crate) fn column(&mut self, name: &str) -> &mut Vec<f64> {
        let place = self.names.iter().position(|n| n == name).expect("a column");
        &mut self.columns[place]
    }

    pub(crate) fn deviation(&mut self, name: &str) -> f64 {
        let values = self.column(name);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt()
    }

    /// Leaves out the rows from `first` to before `last`, counted from 0.
    pub(crate) fn remove(&mut self, first: usize, last: usize) {
        self.columns.iter_mut().for_each(|c| drop(c.drain(first..last)));
    }

    pub(crate) fn csv(&self) -> String {
        let mut text = self.names.join(",") + "\n";
        for k in 0..self.columns[0].len() {
            for (j, column) in self.columns.iter().enumerate() {
                let _ = write!(text, "{}{:?}", if j > 0 { "," } else { "" }, column[k]);
            }
            text.push('\n');
        }
        text
    }
}

/// A file of the measured data.
pub(crate) fn data(file: &str) -> PathBuf {
    let path = crate::common::data().join(file);
    assert!(path.exists(), "{} is missing", path.display());
    path
}

fn columns(file: &str, channels: &[(&str, &str)], ts: f64, take: usize) -> Log {
    let place = |from: &str| from.parse::<ChannelRef>().expect("a place");
    let source = Source {
        path: data(file),
        format: Default::default(),
        time: TimeSource::ts(ts),
        channels: channels.iter().map(|(name, from)| ChannelSpec::from(*name, place(from), "")).collect(),
        csv: Default::default(),
    };
    let record = read(&source).expect("a record");
    let rows = take.min(record.samples());
    let mut names: Vec<String> = channels.iter().map(|(name, _)| (*name).to_owned()).collect();
    let mut columns: Vec<Vec<f64>> = record.columns().map(|c| c[..rows].to_vec()).collect();
    if !names.iter().any(|n| n == "t") {
        names.push("t".into());
        columns.push((0..rows).map(|k| k as f64 * ts).collect());
    }
    Log { names, columns }
}

/// 40000 samples of the flexible drive.
pub(crate) fn drive() -> Log {
    let places = ["u", "y", "d", "r"].map(|n| (n, format!("Data.signals.{n}")));
    let channels: Vec<(&str, &str)> = places.iter().map(|(n, from)| (*n, from.as_str())).collect();
    columns("flexible_drive/fs2000/cycle1.mat", &channels, 5e-4, 40_000)
}

/// One episode of the pendulum without its first second.
pub(crate) fn qube() -> Log {
    let names = ["t", "target_theta", "target_alpha", "theta", "alpha", "feedforward", "plant_input"];
    let channels: Vec<(&str, &str)> = names.iter().map(|n| (*n, *n)).collect();
    let file = "qube_pendulum/episodes/qube_20230828T150615_434_696_394.csv.gz";
    let mut log = columns(file, &channels, 2e-3, usize::MAX);
    log.remove(0, 500);
    log
}

/// A record of DaISy with m inputs and p outputs, named u1 ... and y1 ....
pub(crate) fn daisy(file: &str, m: usize, p: usize) -> Log {
    let names: Vec<String> = (1..=m).map(|j| format!("u{j}")).chain((1..=p).map(|j| format!("y{j}"))).collect();
    let places: Vec<String> = (1..=m + p).map(|j| format!("#{j}")).collect();
    let channels: Vec<(&str, &str)> = names.iter().zip(&places).map(|(n, f)| (n.as_str(), f.as_str())).collect();
    columns(file, &channels, 1.0, usize::MAX)
}

pub(crate) fn dryer() -> Log {
    daisy("hair_dryer/dryer.dat", 1, 1)
}

pub(crate) fn robot() -> Log {
    daisy("robot_arm/robot_arm.dat", 1, 1)
}

pub(crate) fn player() -> Log {
    daisy("cd_player_arm/CD_player_arm.dat", 2, 2)
}

pub(crate) fn evaporator() -> Log {
    daisy("evaporator/evaporator.dat", 3, 3)
}

/// The prismatic joint: reference, voltage and position.
pub(crate) fn joint() -> Log {
    columns("emps/DATA_EMPS.mat", &[("t", "t"), ("u", "vir"), ("y", "qm"), ("r", "qg")], 1e-3, usize::MAX)
}

/// run.toml of the drive; its file is log.csv.
pub(crate) const DRIVE: &str = r#"name = "drive"
[data]
time_column = "t"
inputs = [{ name = "u", unit = "V" }]
outputs = [{ name = "y", unit = "rad" }]
input_excitation = [{ name = "d", unit = "V" }]
reference = [{ name = "r", unit = "rad" }]
estimation = [{ file = "log.csv" }]
[nominal.transfer_function]
domain = "continuous"
numerator = [2500.0]
denominator = [1.0, 20.0, 0.0]
[controller.difference_equation]
feedback = "negative"
numerator = [5.50311, 0.27062, -5.23249]
denominator = [1.0, -1.14636, 0.41698]
[hansen]
horizon = 40
"#;

/// run.toml of the pendulum; its file is log.csv.
pub(crate) const QUBE: &str = r#"name = "qube"
[data]
time_column = "t"
inputs = [{ name = "plant_input", unit = "V" }]
outputs = [{ name = "theta", unit = "rad" }, { name = "alpha", unit = "rad" }]
input_excitation = [{ name = "feedforward", unit = "V" }]
reference = [{ name = "target_theta", unit = "rad" }, { name = "target_alpha", unit = "rad" }]
estimation = [{ file = "log.csv" }]
[nominal.state_space]
domain = "continuous"
a = [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, -149.27, -2.0886, 0.0], [0.0, 261.61, 2.0643, 0.0]]
b = [[0.0], [0.0], [49.7275], [-49.1493]]
c = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
[controller.difference_equation]
feedback = "negative"
numerator = [[[-96.6, 96.0], [-158.0, 155.0]]]
denominator = [1.1, -1.0]
[hansen]
horizon = 50
"#;

/// What the program found.
pub(crate) struct Checked {
    pub(crate) code: i32,
    pub(crate) findings: Vec<Value>,
}

impl Checked {
    /// The findings of a test, one line each for messages.
    pub(crate) fn all(&self) -> String {
        let line = |f: &Value| {
            format!("{} {} {} {}: {} | {}", f["severity"], f["test"], f["channel"], f["rows"], f["what"], f["advice"])
        };
        self.findings.iter().map(line).collect::<Vec<_>>().join("\n")
    }

    /// The finding of a test in a channel, which must be at least a caution.
    pub(crate) fn serious(&self, test: &str, channel: Option<&str>) -> &Value {
        let found = self
            .findings
            .iter()
            .find(|f| f["test"] == test && f["severity"] != "note" && channel.is_none_or(|name| f["channel"] == name));
        found.unwrap_or_else(|| panic!("no finding of {test} in {channel:?}:\n{}", self.all()))
    }

    /// Tests and channels of all findings that are more than notes.
    pub(crate) fn cautions(&self) -> Vec<(String, String)> {
        let text = |v: &Value| v.as_str().unwrap_or_default().to_owned();
        let worth = self.findings.iter().filter(|f| f["severity"] != "note");
        let mut all: Vec<_> = worth.map(|f| (text(&f["test"]), text(&f["channel"]))).collect();
        all.sort();
        all.dedup();
        all
    }
}

/// A number of a finding.
pub(crate) fn number(finding: &Value, name: &str) -> f64 {
    finding["numbers"][name].as_f64().unwrap_or_else(|| panic!("no {name} in {finding}"))
}

pub(crate) fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{found}, expected {expected}");
}

/// An empty folder of its own.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("check").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a temporary folder");
    folder
}

/// `youla check ... --json` in a folder.
pub(crate) fn check(folder: &Path, arguments: &[&str]) -> Checked {
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    let output = command.current_dir(folder).arg("check").args(arguments).arg("--json").output().expect("it starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.stderr.is_empty(), "{stderr}");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let findings = found["findings"].as_array().expect("a list").clone();
    Checked { code: output.status.code().expect("a code"), findings }
}

/// A copy of a record beside its run.toml.
pub(crate) fn check_run(name: &str, settings: &str, log: &Log) -> Checked {
    let folder = folder(name);
    fs::write(folder.join("run.toml"), settings).expect("written");
    fs::write(folder.join("log.csv"), log.csv()).expect("written");
    check(&folder, &["run.toml"])
}

/// A copy of a record of DaISy, whose columns are u1 ..., y1 ... and t.
pub(crate) fn check_file(name: &str, log: &Log) -> Checked {
    let folder = folder(name);
    fs::write(folder.join("log.csv"), log.csv()).expect("written");
    let of = |kind: char| -> String {
        let named: Vec<&str> = log.names.iter().map(String::as_str).filter(|n| n.starts_with(kind)).collect();
        named.join(",")
    };
    check(&folder, &["log.csv", "--input", &of('u'), "--output", &of('y'), "--time", "t"])
}
