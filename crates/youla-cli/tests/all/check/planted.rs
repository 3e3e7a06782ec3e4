//! One test for each defect: named by the right test, in the right channel, with the right size.

use super::records::{
    DRIVE, QUBE, check, check_file, check_run, drive, dryer, evaporator, folder, joint, near, number, player, qube,
    robot,
};
use std::fs;

/// A number between -1 and 1 for each k.
fn scatter(k: usize) -> f64 {
    ((k * k * 31 + 7 * k) % 8191) as f64 / 4095.0 - 1.0
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn irregular_sample_time() {
    let mut log = qube();
    log.column("t").iter_mut().enumerate().skip(2000).take(400).for_each(|(k, t)| *t += 2e-4 * scatter(k));
    let found = check_run("irregular", QUBE, &log);
    assert_eq!(found.code, 1);
    let finding = found.serious("timing", None);
    // 401 steps change; a few change by less than the tolerance.
    assert!((395.0..=401.0).contains(&number(finding, "irregular")), "{finding}");
    // The difference of two numbers of variance 1/3, a tenth of the sample time each, over all 9499 steps.
    near(number(finding, "jitter"), 0.1 * (2.0f64 / 3.0 * 400.0 / 9499.0).sqrt(), 0.1);
    assert!(finding["rows"][0].as_u64().expect("a row").abs_diff(2001) < 3, "{finding}");
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn missing_rows() {
    let mut log = qube();
    log.remove(3000, 3010);
    log.remove(6000, 6001);
    let found = check_run("gap", QUBE, &log);
    let finding = found.serious("timing", None);
    assert_eq!((number(finding, "missing"), number(finding, "gaps")), (11.0, 2.0), "{}", found.all());
    assert_eq!(finding["rows"], serde_json::json!([3001, 6001]));
    assert_eq!(found.code, 1);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn repeated_time_stamps() {
    let mut log = joint();
    for k in 0..20 {
        let row = 2000 + 500 * k;
        log.columns.iter_mut().for_each(|c| c.insert(row + 1, c[row]));
    }
    let folder = folder("repeated");
    fs::write(folder.join("log.csv"), log.csv()).expect("written");
    let found = check(&folder, &["log.csv", "--input", "u", "--output", "y", "--reference", "r", "--time", "t"]);
    let finding = found.serious("timing", None);
    assert_eq!(number(finding, "repeated"), 20.0, "{}", found.all());
    assert_eq!(finding["rows"], serde_json::json!([2002, 11502]));
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn clipped_output() {
    let mut log = player();
    let limit = 1.5 * log.deviation("y1");
    log.column("y1").iter_mut().for_each(|y| *y = y.min(limit));
    let clipped = log.column("y1").iter().filter(|y| **y == limit).count();
    let found = check_file("clipped", &log);
    let finding = found.serious("clipping", Some("y1"));
    assert_eq!((number(finding, "limit"), number(finding, "samples")), (limit, clipped as f64), "{}", found.all());
    assert_eq!(finding["severity"], "defect");
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn saturated_input() {
    let mut log = qube();
    log.column("plant_input").iter_mut().for_each(|u| *u = u.clamp(-2.0, 2.0));
    let held = log.column("plant_input").iter().filter(|u| **u == 2.0).count();
    let found = check_run("saturated", QUBE, &log);
    let finding = found.serious("clipping", Some("plant_input"));
    assert_eq!(number(finding, "limit").abs(), 2.0);
    let samples: Vec<f64> =
        found.findings.iter().filter(|f| f["test"] == "clipping").map(|f| number(f, "samples")).collect();
    assert!(samples.contains(&(held as f64)), "{held}: {}", found.all());
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn coarse_steps() {
    let mut log = robot();
    let step = 0.4 * log.deviation("y1");
    log.column("y1").iter_mut().for_each(|y| *y = (*y / step).round() * step);
    let found = check_file("coarse", &log);
    let finding = found.serious("quantisation", Some("y1"));
    near(number(finding, "step"), step, 1e-6);
    near(number(finding, "deviation_in_steps"), 2.5, 0.05);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn drift() {
    let mut log = dryer();
    let size = 8.0 * log.deviation("y1");
    let rows = log.columns[0].len() as f64;
    log.column("y1").iter_mut().enumerate().for_each(|(k, y)| *y += size * k as f64 / rows);
    let found = check_file("drift", &log);
    near(number(found.serious("drift", Some("y1")), "size"), size, 0.15);
    assert_eq!(found.cautions(), [("drift".to_owned(), "y1".to_owned())], "{}", found.all());
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn single_outliers() {
    let mut log = evaporator();
    let size = 4.0 * log.deviation("y1");
    for k in 0..8 {
        log.column("y1")[500 + 700 * k] += if k % 2 == 0 { size } else { -size };
    }
    let found = check_file("outliers", &log);
    let finding = found.serious("outliers", Some("y1"));
    assert_eq!(number(finding, "count"), 8.0, "{}", found.all());
    assert_eq!(finding["rows"], serde_json::json!([501, 5401]));
    near(number(finding, "largest"), size, 0.15);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn stuck_sensor() {
    let mut log = player();
    let value = log.column("y2")[699];
    log.column("y2")[700..740].fill(value);
    let found = check_file("stuck", &log);
    let finding = found.serious("stuck", Some("y2"));
    assert_eq!(finding["rows"], serde_json::json!([700, 740]), "{}", found.all());
    assert_eq!(number(finding, "samples"), 41.0);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn dropout_under_friction() {
    // Steps and friction make stretches of up to 47 samples in this record.
    let mut log = drive();
    log.column("y")[20_000..20_300].fill(0.0);
    let found = check_run("dropout", DRIVE, &log);
    let finding = found.serious("stuck", Some("y"));
    assert_eq!(finding["rows"], serde_json::json!([20_001, 20_300]), "{}", found.all());
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn input_one_sample_late() {
    let mut log = drive();
    log.column("u").rotate_right(1);
    let found = check_run("shift", DRIVE, &log);
    let controller = found.serious("controller", None);
    assert_eq!(number(controller, "input_shift"), 1.0, "{}", found.all());
    assert!(number(controller, "residual_after") < 1e-3, "{controller}");
    assert_eq!(number(found.serious("delay", Some("u")), "lag"), 1.0);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn sign_of_the_controller() {
    let log = drive();
    let found = check_run("sign", &DRIVE.replace("\"negative\"", "\"positive\""), &log);
    let finding = found.serious("controller", None);
    near(number(finding, "residual"), 2.0, 1e-3);
    assert!(number(finding, "sign") == -1.0 && number(finding, "residual_after") < 1e-5, "{}", found.all());
    assert!(finding["advice"].as_str().is_some_and(|a| a.contains("`feedback`")), "{finding}");
    assert_eq!(found.code, 1);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn gain_of_the_controller() {
    let log = qube();
    let settings = QUBE.replace("[[[-96.6, 96.0], [-158.0, 155.0]]]", "[[[-115.92, 115.2], [-189.6, 186.0]]]");
    let found = check_run("gain", &settings, &log);
    let finding = found.serious("controller", None);
    near(number(finding, "gain"), 1.0 / 1.2, 1e-3);
    near(number(finding, "residual"), 0.2, 1e-2);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn exchanged_channels() {
    let log = qube();
    let settings = QUBE.replace(
        "{ name = \"theta\", unit = \"rad\" }, { name = \"alpha\", unit = \"rad\" }",
        "{ name = \"theta\", from = \"alpha\" }, { name = \"alpha\", from = \"theta\" }",
    );
    let found = check_run("exchanged", &settings, &log);
    let finding = found.serious("controller", None);
    assert_eq!(number(finding, "exchanged"), 1.0, "{}", found.all());
    assert!(finding["advice"].as_str().is_some_and(|a| a.contains("theta and alpha exchanged")), "{finding}");
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn degrees_for_radians() {
    let mut log = qube();
    log.column("alpha").iter_mut().for_each(|y| *y = y.to_degrees());
    let found = check_run("degrees", QUBE, &log);
    let finding = found.serious("controller", None);
    near(number(finding, "channel_gain"), 1f64.to_radians(), 1e-2);
    let advice = finding["advice"].as_str().expect("advice");
    assert!(advice.contains("alpha") && advice.contains("degrees"), "{advice}");
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn excitation_that_rests() {
    let mut log = drive();
    log.column("d").fill(0.0);
    let found = check_run("rests", DRIVE, &log);
    assert!(found.serious("excitation", Some("d"))["what"].as_str().is_some_and(|w| w.contains("is constant")));
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn register_that_is_too_short() {
    let mut log = dryer();
    // A maximum-length sequence of four stages: period 15.
    let mut register = 1u32;
    for u in log.column("u1").iter_mut() {
        let new = (register ^ (register >> 1)) & 1;
        register = (register >> 1) | (new << 3);
        *u = f64::from(register & 1);
    }
    let found = check_file("register", &log);
    let finding = found.serious("excitation", Some("u1"));
    assert!((14.0..=15.0).contains(&number(finding, "order")), "{finding}");
    assert_eq!(number(finding, "needed"), 40.0);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn lines_of_a_rotor() {
    let mut log = drive();
    let size = 0.2 * log.deviation("y");
    for (k, y) in log.column("y").iter_mut().enumerate() {
        let turn = std::f64::consts::TAU * 71.3 * 5e-4 * k as f64;
        *y += size * turn.sin() + 0.5 * size * (2.0 * turn).cos();
    }
    let found = check_run("rotor", DRIVE, &log);
    let finding = found.serious("lines", Some("y"));
    assert_eq!(number(finding, "count"), 2.0, "{}", found.all());
    near(number(finding, "lowest_hz"), 71.3, 2e-4);
    near(number(finding, "amplitude"), size, 0.1);
    assert!(finding["what"].as_str().is_some_and(|w| w.contains("2x of the first")), "{finding}");
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn time_in_milliseconds() {
    let mut log = qube();
    log.column("t").iter_mut().for_each(|t| *t *= 1e3);
    let settings = QUBE.replace("time_column = \"t\"", "time_column = \"t\"\nsample_time = 2e-3");
    let found = check_run("milliseconds", &settings, &log);
    let finding = found.serious("timing", None);
    near(number(finding, "ratio"), 1e-3, 1e-6);
    assert!(finding["what"].as_str().is_some_and(|w| w.contains("milliseconds")), "{finding}");
}
