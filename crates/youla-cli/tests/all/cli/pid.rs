//! `structure = "pid"` in `[redesign]`: what a run writes, and its exports.

use crate::common::{empty_folder, uniform, youla};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Uniform on -0.5 to 0.5.
fn noise() -> impl FnMut() -> f64 {
    let mut random = uniform(7);
    move || random() - 0.5
}

/// `G = 0.02 / (z - pole)` under a PI, u = d + 2 e + 0.05 i.
fn log(folder: &Path, pole: f64) {
    let mut random = noise();
    let (mut x, mut i) = (0.0, 0.0);
    let mut text = "u,y,d\n".to_owned();
    for _ in 0..6000 {
        let (y, d) = (x + 0.02 * random(), 2.0 * random());
        i -= 0.05 * y;
        let u = d - 2.0 * y + i;
        x = pole * x + 0.02 * u;
        writeln!(text, "{u},{y},{d}").expect("a string");
    }
    fs::write(folder.join("log.csv"), text).expect("written");
}

fn run(name: &str, pole: f64, redesign: &str) -> (PathBuf, Option<i32>, String) {
    let folder = empty_folder(name);
    log(&folder, pole);
    let settings = format!(
        "name = \"tank\"\n[data]\nsample_time = 0.01\ninputs = [{{ name = \"u\", unit = \"V\" }}]\noutputs = [{{ name = \"y\" }}]\n\
         input_excitation = [{{ name = \"d\" }}]\nestimation = [{{ file = \"log.csv\", take = 4000 }}]\n\
         verification = [{{ file = \"log.csv\", skip = 4000, name = \"rest\" }}]\n\
         [nominal.transfer_function]\ndomain = \"discrete\"\nnumerator = [0.03]\ndenominator = [1.0, -{pole}]\n\
         [controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"backward-euler\"\nkp = 2.0\nki = 5.0\n{redesign}"
    );
    fs::write(folder.join("run.toml"), settings).expect("written");
    let done = youla(&folder, &["identify", "run.toml", "--out", "run", "--quiet"]);
    (folder, done.code, done.stderr)
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("written")).expect("JSON")
}

#[test]
fn a_pid_comes_with_its_proof_and_a_way_back() {
    let (folder, code, stderr) = run("pid", 0.98, "[redesign]\nstructure = \"pid\"\n[redesign.pid]\nterms = \"pi\"\n");
    assert_eq!(code, Some(0), "{stderr}");
    let pid = &json(&folder.join("run/summary.json"))["pid"];
    assert_eq!((&pid["proof"]["holds"], &pid["proof"]["unstable"]), (&Value::Bool(true), &Value::from(0)), "{pid}");
    assert!((pid["running"][0]["ki"].as_f64().expect("recognised") - 5.0).abs() < 1e-6, "{pid}");
    assert!(pid["rejections"][0].as_f64().expect("a number") > 1.5, "{pid}");
    let revert = json(&folder.join("run/8-redesign/revert.json"));
    assert_eq!(revert["method"], "running");
    let page = fs::read_to_string(folder.join("run/report.html")).expect("written");
    assert!(page.contains("The way to the new controller"));
    // Structured text and C are the same statements.
    for form in ["c-pid", "st", "gains"] {
        let done = youla(&folder, &["export", "run", "--to", form, "--out", form]);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
    }
    let said = youla(&folder, &["identify", "run.toml", "--out", "said"]).stdout;
    assert!(said.contains("new PID: kp ") && said.contains("youla export said --to gains"), "{said}");
    let read = |form: &str| fs::read_to_string(folder.join(form)).expect("written");
    let of_c: Vec<String> = read("c-pid").lines().map(|l| l.trim().replace("s->", "")).collect();
    let of_st: Vec<String> = read("st").lines().map(|l| l.replacen(" := ", " = ", 1)).collect();
    for statement in of_st.iter().filter(|l| l.contains(" * ")) {
        assert!(of_c.contains(statement), "{statement}");
    }
    // The head states the filter of the reference that the plan asks for.
    let filter = pid["steps"][2]["reference_filters"][0].as_f64().expect("a number");
    let by = format!("w = w + {} (r - w)", 0.01 / (0.01 + filter));
    assert!(filter > 0.0 && read("c-pid").contains(&by) && read("gains").contains(&by), "{by}: {}", read("gains"));
    // The statements, evaluated, are the controller of new_controller.json.
    let number = |name: &str| pid["controllers"][0][name].as_f64().expect("a number");
    let k = json(&folder.join("run/8-redesign/new_controller.json"));
    let matrix = |name: &str| k[name][0][0].as_f64().expect("a number");
    let (mut i, mut x) = (0.0, 0.0);
    for t in 0..50 {
        let y = (0.3 * f64::from(t)).sin();
        i += number("ki") * 0.01 * -y;
        let u = matrix("c") * x + matrix("d") * y;
        x = matrix("a") * x + matrix("b") * y;
        assert!((number("kp") * -y + i - u).abs() < 1e-9 * u.abs().max(1.0), "{t}");
    }
    assert!(read("gains").contains("'IFormula', 'BackwardEuler'"), "{}", read("gains"));
    // Parameters of firmware are the gains by its scale factors.
    let (kp, ki) = (number("kp"), number("ki"));
    for (form, lines) in [
        ("px4", [format!("MC_ROLLRATE_P {kp}"), format!("MC_ROLLRATE_I {ki}")]),
        ("ardupilot", [format!("ATC_RAT_RLL_P,{kp}"), format!("ATC_RAT_RLL_I,{ki}")]),
        ("odrive", [format!("vel_gain = {kp}"), format!("vel_integrator_gain = {ki}")]),
        ("betaflight", [kp / 0.032029, ki / 0.244381].map(|gain| format!("_roll = {}", gain.round()))),
    ] {
        let done = youla(&folder, &["export", "run", "--to", form, "--out", form]);
        if form == "betaflight" && (kp / 0.032029).max(ki / 0.244381) > 250.0 {
            assert!(done.code == Some(2) && done.stderr.contains("at most 250"), "{}", done.stderr);
            continue;
        }
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        assert!(lines.iter().all(|line| read(form).contains(line)), "{}", read(form));
    }
}

/// Two tanks, a third of whose flows cross, each under a PI whose gains stand in lists: each loop gets its own gains, figures and files.
#[test]
fn each_loop_of_a_machine_gets_a_pid() {
    let folder = empty_folder("pid-loops");
    two_tanks(&folder);
    let settings = "name = \"tanks\"\n[data]\nsample_time = 0.01\ninputs = [{ name = \"u1\" }, { name = \"u2\" }]\noutputs = [{ name = \"y1\" }, { name = \"y2\" }]\n\
         input_excitation = [{ name = \"d1\" }, { name = \"d2\" }]\nestimation = [{ file = \"log.csv\", take = 4000 }]\n\
         verification = [{ file = \"log.csv\", skip = 4000, name = \"rest\" }]\n\
         [controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"backward-euler\"\nkp = 2.0\nki = [5.0, 3.0]\n\
         [redesign]\nstructure = \"pid\"\n[redesign.pid]\nterms = \"pi\"\n";
    fs::write(folder.join("run.toml"), settings).expect("written");
    let done = youla(&folder, &["identify", "run.toml", "--out", "run", "--quiet"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let pid = &json(&folder.join("run/summary.json"))["pid"];
    assert_eq!((&pid["proof"]["holds"], &pid["proof"]["unstable"]), (&Value::Bool(true), &Value::from(0)), "{pid}");
    for (k, ki) in [5.0, 3.0].into_iter().enumerate() {
        assert!((pid["running"][k]["ki"].as_f64().expect("recognised") - ki).abs() < 1e-6, "{pid}");
        assert!(pid["rejections"][k].as_f64().expect("a number") > 1.5, "{pid}");
    }
    let of: Vec<_> = pid["figures"].as_array().expect("a list").iter().map(|f| f["loop"].as_u64()).collect();
    assert_eq!((of.len(), of[0], of[of.len() - 1]), (12, Some(1), Some(2)));
    let page = fs::read_to_string(folder.join("run/report.html")).expect("written");
    assert!(page.contains("loop 2: phase margin") && page.contains("Step of the reference, loop 2"));
    let export = |more: &[&str]| youla(&folder, &[&["export", "run", "--to", "c-pid"], more].concat());
    let unnamed = export(&[]);
    assert!(unnamed.code == Some(2) && unnamed.stderr.contains("add --loop 1 to 2"), "{}", unnamed.stderr);
    assert!(export(&["--loop", "3"]).stderr.contains("--loop is 3, but must be from 1 to 2"));
    assert_eq!(export(&["--loop", "2"]).code, Some(0));
    let header = fs::read_to_string(folder.join("pid_2.h")).expect("written");
    for (gains, says) in [
        ("kp = [2.0]\nki = [5.0, 3.0]", "the list kp has another length (1) than ki (2); give each gain a number"),
        ("kp = 2.0\nki = 5.0", "PID of 1 loop, but [data] has 2 inputs and 2 outputs; give each gain a list"),
        ("kp = [2.0, 1.0, 1.0]", "PIDs of 3 loops, but [data] has 2 inputs and 2 outputs"),
    ] {
        fs::write(folder.join("run.toml"), settings.replace("kp = 2.0\nki = [5.0, 3.0]", gains)).expect("written");
        let refused = youla(&folder, &["identify", "run.toml", "--out", "refused", "--quiet"]);
        assert!(refused.code == Some(2) && refused.stderr.contains(says), "{}", refused.stderr);
    }
    assert!(header.contains("PID from y2 to u2") && header.contains("pid_2_step(pid_2_state *s"), "{header}");
}

fn two_tanks(folder: &Path) {
    let mut random = noise();
    let (mut x, mut i) = ([0.0; 2], [0.0; 2]);
    let mut text = "u1,u2,y1,y2,d1,d2\n".to_owned();
    for _ in 0..6000 {
        let y = [0, 1].map(|k| x[k] + 0.02 * random());
        let d = [0, 1].map(|_| 2.0 * random());
        let u = [0, 1].map(|k| {
            i[k] -= [0.05, 0.03][k] * y[k];
            d[k] - 2.0 * y[k] + i[k]
        });
        x = [0, 1].map(|k| [0.98, 0.95][k] * x[k] + [0.02, 0.04][k] * (u[k] + 0.3 * u[1 - k]));
        writeln!(text, "{},{},{},{},{},{}", u[0], u[1], y[0], y[1], d[0], d[1]).expect("a string");
    }
    fs::write(folder.join("log.csv"), text).expect("written");
}

#[test]
fn what_is_not_met_is_written_and_ends_with_3() {
    // An unstable plant needs a gain, and with it u answers the noise.
    let limit = "[redesign]\nstructure = \"pid\"\n[redesign.pid]\ncommand_effort = 0.05\n";
    let (folder, code, stderr) = run("pid-not-met", 1.01, limit);
    assert_eq!(code, Some(3), "{stderr}");
    assert!(stderr.contains("command_effort"), "{stderr}");
    assert!(folder.join("run/summary.json").is_file());
}

/// A peak of the sensitivity of 1.001 allows no feedback.
#[test]
fn an_lqg_that_no_weight_gives_ends_with_3_behind_its_results() {
    let (folder, code, stderr) = run("lqg-not-met", 0.98, "[redesign]\npeak_sensitivity = 1.001\n");
    assert!(code == Some(3) && stderr.contains("no weight gives a new controller"), "{code:?} {stderr}");
    let refused = &json(&folder.join("run/summary.json"))["refused"];
    assert!(refused["redesign"].as_str().is_some_and(|why| why.contains("peak of the sensitivity")), "{refused}");
}

#[test]
fn what_no_run_can_do_is_refused_before_it() {
    for (name, redesign, key) in [
        ("pid-unused", "[redesign.pid]\nterms = \"pi\"\n", "structure = \"pid\""),
        ("pid-range", "[redesign]\nstructure = \"pid\"\n[redesign.pid]\nnotches = 9\n", "[redesign.pid] notches"),
        ("pid-word", "[redesign]\nstructure = \"pdi\"\n", "pid"),
    ] {
        let (_, code, stderr) = run(name, 0.98, redesign);
        assert_eq!(code, Some(2));
        assert!(stderr.contains(key), "{stderr}");
    }
}

/// Certificate and redesign rest on the factors, not on alpha and beta of the records.
#[test]
fn records_shorter_than_the_transient_of_the_filter_keep_certificate_and_redesign() {
    let (folder, code, stderr) = run("transient", 0.98, "[redesign]\n[factors]\nsettle = 5000\n");
    // LQG gives up stiffness for damping, and says so.
    assert!(code == Some(3) && stderr.contains("a slow load moves y 8.23 times as far"), "{code:?} {stderr}");
    let summary = json(&folder.join("run/summary.json"));
    let refused = &summary["refused"];
    assert!(refused["signals"].as_str().expect("the reason").contains("`settle` in [factors]"), "{refused}");
    assert!(refused.get("factors").is_none() && refused.get("redesign").is_none(), "{refused}");
    assert_eq!(
        (&summary["certificate"]["stable"], &summary["recommended"]["trusted"]),
        (&Value::Bool(true), &Value::Bool(true))
    );
    assert!(summary["redesign"]["predicted"]["least_damping"].is_f64(), "{}", summary["redesign"]);
    assert!(!folder.join("run/3-signals").exists() && folder.join("run/2-factor/right.json").exists());
}
