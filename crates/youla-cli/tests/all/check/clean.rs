//! Measured records as they are: nothing beside what is known of them.

use crate::common::{Checked, check, check_file, data, dryer, evaporator, folder, joint, player, robot};
use std::fs;
use std::path::Path;

fn example(name: &str) -> Checked {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    check(&root, &[&format!("examples/{name}/run.toml")])
}

fn only(found: &Checked, expected: &[(&str, &str)]) {
    let expected: Vec<_> = expected.iter().map(|(test, channel)| (test.to_string(), channel.to_string())).collect();
    assert_eq!(found.cautions(), expected, "{}", found.all());
    assert_eq!(found.code, 0, "{}", found.all());
}

/// The encoder's steps are the main noise; the direct method of the example is one for open loops, for comparison.
#[test]
fn flexible_drive() {
    if data("flexible_drive").is_some() {
        only(&example("flexible-drive"), &[("feedback", ""), ("quantisation", "y")]);
    }
}

/// The same of the pendulum, without its catch transient.
#[test]
fn rotary_pendulum() {
    if data("qube_pendulum").is_some() {
        only(&example("qube"), &[("feedback", ""), ("quantisation", "alpha"), ("quantisation", "theta")]);
    }
}

/// With the catch transient, the saturation at 10 V is found in it.
#[test]
fn catch_of_the_pendulum() {
    let Some(file) = data("qube_pendulum/episodes/qube_20230828T150615_434_696_394.csv.gz") else { return };
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
fn prismatic_joint() {
    let Some(log) = joint() else { return };
    let folder = folder("joint");
    fs::write(folder.join("log.csv"), log.csv()).expect("written");
    let found = check(&folder, &["log.csv", "--input", "u", "--output", "y", "--reference", "r", "--time", "t"]);
    only(&found, &[("feedback", "u")]);
}

#[test]
fn hair_dryer() {
    if let Some(log) = dryer() {
        only(&check_file("dryer", &log), &[]);
    }
}

#[test]
fn robot_arm() {
    if let Some(log) = robot() {
        only(&check_file("robot", &log), &[]);
    }
}

#[test]
fn four_stage_evaporator() {
    if let Some(log) = evaporator() {
        only(&check_file("evaporator", &log), &[]);
    }
}

/// Measured in closed loop, as the feedback shows; the inputs fall by 90 to 107 dB towards the Nyquist frequency.
#[test]
fn cd_player_arm() {
    if let Some(log) = player() {
        let found = check_file("player", &log);
        only(&found, &[("feedback", "u1")]);
        let condition = found.findings.iter().find_map(|f| f["numbers"]["condition"].as_f64()).expect("a condition");
        assert!((1e4..1e6).contains(&condition), "{condition:.1e}");
    }
}
