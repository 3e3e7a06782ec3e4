//! Measured records as they are: nothing beside what is known of them.

use super::records::{Checked, check, check_file, data, dryer, evaporator, folder, joint, player, robot};
use std::fs;
use std::path::Path;

fn example(name: &str) -> Checked {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name).join("run.toml");
    let settings = fs::read_to_string(path).expect("readable");
    let folder = folder(name);
    let at_data = settings.replace("../../../shared/data", &data("").display().to_string());
    fs::write(folder.join("run.toml"), at_data).expect("written");
    check(&folder, &["run.toml"])
}

fn only(found: &Checked, expected: &[(&str, &str)]) {
    let expected: Vec<_> = expected.iter().map(|(test, channel)| (test.to_string(), channel.to_string())).collect();
    assert_eq!(found.cautions(), expected, "{}", found.all());
    assert_eq!(found.code, 0, "{}", found.all());
}

/// The encoder's steps are the main noise; the direct method of the example is one for open loops, for comparison.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn flexible_drive() {
    only(&example("flexible-drive"), &[("feedback", ""), ("quantisation", "y")]);
}

/// The same of the pendulum, without its catch transient.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn rotary_pendulum() {
    only(&example("qube"), &[("feedback", ""), ("quantisation", "alpha"), ("quantisation", "theta")]);
}

/// With the catch transient, the saturation at 10 V is found in it.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn catch_of_the_pendulum() {
    let file = data("qube_pendulum/episodes/qube_20230828T150615_434_696_394.csv.gz");
    let arguments = ["--input", "plant_input", "--output", "theta,alpha", "--excitation", "feedforward", "--time", "t"];
    let found = check(&folder("catch"), &[&[file.to_str().expect("UTF-8")], &arguments[..]].concat());
    let clipped: Vec<f64> = found
        .findings
        .iter()
        .filter(|f| f["test"] == "clipping")
        .map(|f| f["numbers"]["limit"].as_f64().expect("a limit"))
        .collect();
    assert!(clipped.iter().all(|limit| limit.abs() == 10.0) && !clipped.is_empty(), "{}", found.all());
    let last = found.findings.iter().filter(|f| f["test"] == "clipping").map(|f| f["rows"][1].as_u64().expect("a row"));
    assert!(last.max().expect("a row") <= 500, "{}", found.all());
    let of_shift = found.findings.iter().any(|f| f["test"] == "delay" && f["severity"] == "defect");
    assert!(!of_shift && found.code == 0, "{}", found.all());
}

/// A loop of which only the reference is known.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn prismatic_joint() {
    let log = joint();
    let folder = folder("joint");
    fs::write(folder.join("log.csv"), log.csv()).expect("written");
    let found = check(&folder, &["log.csv", "--input", "u", "--output", "y", "--reference", "r", "--time", "t"]);
    only(&found, &[("feedback", "u")]);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn hair_dryer() {
    let log = dryer();
    only(&check_file("dryer", &log), &[]);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn robot_arm() {
    let log = robot();
    only(&check_file("robot", &log), &[]);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn four_stage_evaporator() {
    let log = evaporator();
    only(&check_file("evaporator", &log), &[]);
}

/// Measured in closed loop, as the feedback shows; the inputs fall by 90 to 107 dB towards the Nyquist frequency.
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn cd_player_arm() {
    let log = player();
    let found = check_file("player", &log);
    only(&found, &[("feedback", "u1")]);
    let condition = found.findings.iter().find_map(|f| f["numbers"]["condition"].as_f64()).expect("a condition");
    assert!((1e4..1e6).contains(&condition), "{condition:.1e}");
}
