//! What the numbers of a stated controller may mean where the log contradicts it.

use crate::common::Folder;
use std::fmt::Write;
use youla_loop::check::{Finding, Severity, Test};
use youla_run::{RunSettings, check_run};

/// Sample time of the log.
const TS: f64 = 0.01;

/// `G = 0.02 / (z - 0.98)` under `kp = 2, ki = 5, kd = 0.05` behind a filter of 0.02 s, backward Euler, excited at the input, against a slow load of a given
/// size.
fn log(folder: &Folder, load: f64) {
    let mut text = "u,y,d\n".to_owned();
    let (mut x, mut i, mut lag, mut before) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..1500u32 {
        let d = 2.0 * (f64::from(k * k) * 2f64.sqrt()).fract() - 1.0;
        let y = x + 0.02 * (f64::from(k * k) * 3f64.sqrt()).fract();
        let e: f64 = -y;
        i += 5.0 * TS * e;
        lag = (0.02 * lag + 0.05 * (e - before)) / (0.02 + TS);
        before = e;
        let u = d + 2.0 * e + i + lag;
        x = 0.98 * x + 0.02 * (u - load * (0.002 * f64::from(k)).sin());
        writeln!(text, "{u},{y},{d}").unwrap();
    }
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
}

/// The finding on a controller that is stated so.
fn finding(folder: &Folder, ts: f64, role: &str, controller: &str) -> Finding {
    let text = format!(
        "name = \"tank\"\n[data]\nsample_time = {ts:?}\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
         {role} = [{{ name = \"d\" }}]\nestimation = [{{ file = \"log.csv\" }}]\n[controller.{controller}"
    );
    let settings = RunSettings::parse(&text, &folder.path().join("run.toml")).unwrap();
    let all = check_run(&settings, folder.path()).unwrap().findings;
    all.into_iter().find(|f| f.test == Test::Controller).unwrap()
}

#[test]
fn the_reading_that_explains_the_log_is_named() {
    let folder = Folder::new("readings");
    log(&folder, 0.0);
    let pid = |form: &str, rule: &str, [ki, kd]: [&str; 2]| {
        format!(
            "{form}]\nfeedback = \"negative\"\ndiscretisation = \"{rule}\"\nkp = 2.0\n{ki} = 5.0\n{kd} = 0.05\nderivative_filter = 0.02\n"
        )
    };
    let stated = pid("pid", "backward-euler", ["ki", "kd"]);
    let (excitation, reference) = ("input_excitation", "reference");
    let right = finding(&folder, TS, excitation, &stated);
    assert!(right.severity == Severity::Note && right.what.contains("agrees with the log"), "{right:?}");
    // Over the common denominator (1 - q) (0.03 - 0.02 q), both from the highest power of q down.
    let turned = "difference_equation]\nfeedback = \"negative\"\nnumerator = [0.09, -0.201, 0.1115]\n\
                  denominator = [0.02, -0.05, 0.03]\n";
    let cases = [
        (TS, excitation, pid("pid", "tustin", ["ki", "kd"]), "discretisation = \"backward-euler\""),
        (TS, excitation, pid("ideal_pid", "backward-euler", ["ti", "td"]), "[controller.pid], ti as ki and td as kd"),
        (1e3 * TS, excitation, stated.clone(), "a sample time of 0.01 s: the time of the log is in milliseconds"),
        (TS.recip(), excitation, stated.clone(), "the sample rate was stated as the sample time"),
        (TS, reference, stated, "declare it as input_excitation"),
        (TS, excitation, turned.to_owned(), "the coefficients in the opposite order, that of z^-1 ascending"),
    ];
    for (ts, role, controller, words) in cases {
        let found = finding(&folder, ts, role, &controller);
        assert!(found.severity != Severity::Note && found.advice.contains(words), "{words}: {found:?}");
    }
}

/// A wrong delay leaves less than 1 % of an input that a slow load makes: the law is not the one that ran all the same.
#[test]
fn a_wrong_delay_is_named_beside_a_large_slow_load() {
    let folder = Folder::new("readings-load");
    log(&folder, 200.0);
    let stated = "pid]\nfeedback = \"negative\"\ndiscretisation = \"backward-euler\"\nkp = 2.0\nki = 5.0\nkd = 0.05\n\
                  derivative_filter = 0.02\n";
    let right = finding(&folder, TS, "input_excitation", stated);
    assert!(right.severity == Severity::Note && right.what.contains("agrees with the log"), "{right:?}");
    for (delay, words) in [(1, "or `delay` one sample smaller"), (2, "or `delay` 2 samples smaller")] {
        let found = finding(&folder, TS, "input_excitation", &format!("{stated}delay = {delay}\n"));
        let left = found.numbers["residual"];
        assert!(left < 0.01 && found.severity == Severity::Caution, "{found:?}");
        assert!(found.advice.contains(words), "{found:?}");
    }
}
