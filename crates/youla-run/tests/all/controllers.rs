//! Controllers in the forms in which they are written down, against difference equations by hand.

use crate::common::Folder;
use std::path::Path;
use youla::Mat;
use youla::lti::{Discrete, StateSpace, simulate};
use youla_run::{ControllerSettings, RunSettings};

const TS: f64 = 1e-3;

/// A chirp, so that every coefficient counts.
fn error() -> Vec<f64> {
    (0..400).map(|k| (2e-4 * f64::from(k * k)).sin() + 0.3).collect()
}

/// `u` of the controller `text` in positive feedback, from rest.
fn response(text: &str) -> Vec<f64> {
    let settings: ControllerSettings = toml::from_str(text).unwrap();
    let nominal = StateSpace::gain(Mat::zeros(1, 1), Discrete::new(TS).unwrap()).unwrap();
    let running = settings.realise(nominal.time(), Some(&nominal), Path::new("/")).unwrap();
    let k = running.system();
    let e = error();
    let input = Mat::from_fn(e.len(), 1, |i, _| e[i]);
    simulate(k, input.as_ref(), &vec![0.0; k.order()]).unwrap().col(0).iter().copied().collect()
}

fn assert_close(text: &str, expected: &[f64]) {
    let found = response(text);
    let size = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let miss = found.iter().zip(expected).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size;
    assert!(miss < 1e-12, "{text}: {miss:.1e}");
}

/// A PID as firmware computes it: `[kp, ki, kd, filter]`, sample by sample.
fn by_hand([kp, ki, kd, filter]: [f64; 4], tustin: bool, delay: usize) -> Vec<f64> {
    let (mut i, mut d, mut before) = (0.0, 0.0, 0.0);
    let mut u = vec![0.0; delay];
    for e in error() {
        if tustin {
            i += 0.5 * ki * TS * (e + before);
            d = ((2.0 * filter - TS) * d + 2.0 * kd * (e - before)) / (2.0 * filter + TS);
        } else {
            i += ki * TS * e;
            d = (filter * d + kd * (e - before)) / (filter + TS);
        }
        u.push(kp * e + i + d);
        before = e;
    }
    u.truncate(error().len());
    u
}

#[test]
fn a_pid_is_the_difference_equation_that_firmware_computes() {
    for (rule, tustin) in [("backward-euler", false), ("tustin", true)] {
        let head = format!("feedback = \"positive\", discretisation = \"{rule}\"");
        let text = |keys: &str| format!("pid = {{ {head}, {keys} }}");
        let filtered = "kp = 2.0, ki = 30.0, kd = 0.05, derivative_filter = 4e-3";
        assert_close(&text(filtered), &by_hand([2.0, 30.0, 0.05, 4e-3], tustin, 0));
        assert_close(&text("kp = 2.0, ki = 30.0, delay = 3"), &by_hand([2.0, 30.0, 0.0, 1.0], tustin, 3));
        let ideal = format!("ideal_pid = {{ {head}, kp = 2.0, ti = 0.1, td = 0.02, derivative_filter = 4e-3 }}");
        assert_close(&ideal, &by_hand([2.0, 20.0, 0.04, 4e-3], tustin, 0));
    }
    let unfiltered = "pid = { feedback = \"positive\", discretisation = \"backward-euler\", kp = 1.0, kd = 0.05 }";
    assert_close(unfiltered, &by_hand([1.0, 0.0, 0.05, 0.0], false, 0));
}

/// Matrices without states are a gain: B, which has no rows, has the columns of D.
#[test]
fn a_gain_needs_no_states() {
    let expected: Vec<f64> = error().iter().map(|e| 2.0 * e).collect();
    assert_close("state_space = { feedback = \"positive\", a = [], b = [], c = [[]], d = [[2.0]] }", &expected);
}

/// The lead `(s + 20)/(s + 300)`: by Tustin's rule with `w = 2/ts`, and held, whose step response is exact at the samples.
#[test]
fn a_controller_in_s_is_discretised_as_stated() {
    let (zero, pole, w, e) = (20.0, 300.0, 2.0 / TS, error());
    let run = |b0: f64, b1: f64, a1: f64| {
        let mut u: Vec<f64> = Vec::new();
        for k in 0..e.len() {
            let (past_e, past_u) = if k == 0 { (0.0, 0.0) } else { (e[k - 1], u[k - 1]) };
            u.push(b0 * e[k] + b1 * past_e - a1 * past_u);
        }
        u
    };
    let tustin = run((w + zero) / (w + pole), (zero - w) / (w + pole), (pole - w) / (w + pole));
    let decay = f64::exp(-pole * TS);
    let held = run(1.0, (zero - pole) / pole * (1.0 - decay) - decay, -decay);
    for (hold, expected) in [("tustin", tustin), ("zoh", held)] {
        let keys = format!("feedback = \"positive\", domain = \"continuous\", hold = \"{hold}\"");
        let transfer = format!("transfer_function = {{ {keys}, numerator = [1.0, 20.0], denominator = [1.0, 300.0] }}");
        assert_close(&transfer, &expected);
        let states = "a = [[-300.0]], b = [[1.0]], c = [[-280.0]], d = [[1.0]]";
        assert_close(&format!("state_space = {{ {keys}, {states} }}"), &expected);
    }
}

/// One controller in z by three forms, with the sign and the dead time of its table.
#[test]
fn forms_signs_and_dead_times_agree() {
    let expected: Vec<f64> = {
        let e = error();
        let mut u = vec![0.0; 2];
        (0..e.len()).for_each(|k| u.push(-0.8 * e[k] + if k == 0 { 0.0 } else { 0.75 * e[k - 1] }));
        u.truncate(e.len());
        u
    };
    for text in [
        "difference_equation = { feedback = \"negative\", numerator = [0.8, -0.75], denominator = [1.0], delay = 2 }",
        "difference_equation = { feedback = \"negative\", numerator = [0.0, 0.0, 0.8, -0.75], denominator = [1.0] }",
        "transfer_function = { feedback = \"negative\", domain = \"discrete\", numerator = [0.8, -0.75], \
         denominator = [1.0, 0.0], delay = 2 }",
        "state_space = { feedback = \"negative\", a = [[0.0]], b = [[1.0]], c = [[-0.75]], d = [[0.8]], delay = 2 }",
    ] {
        assert_close(text, &expected);
    }
}

/// The same table as JSON, as `--controller` reads it; a model is none.
#[test]
fn a_controller_is_read_from_json() {
    let folder = Folder::new("controllers");
    let read = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        ControllerSettings::from_json(&path)
    };
    let pid = r#"{"pid": {"feedback": "negative", "discretisation": "tustin", "kp": 2.0, "ki": 10.0}}"#;
    let of_toml: ControllerSettings =
        toml::from_str("pid = { feedback = \"negative\", discretisation = \"tustin\", kp = 2.0, ki = 10.0 }").unwrap();
    assert_eq!(read("pid.json", pid).unwrap(), Some(of_toml));
    assert_eq!(read("model.json", r#"{"ts": 1.0, "a": [], "b": [], "c": [[]], "d": [[1.0]]}"#).unwrap(), None);
    let error = read("bad.json", &pid.replace("\"ki\"", "\"kI\"")).unwrap_err().to_string();
    assert!(error.contains("bad.json") && error.contains("`kI`"), "{error}");
    for (name, text, words) in [
        ("flat.json", r#"{"kp": 2.0, "ki": 10.0}"#, "a form of controller by its name, such as {\"pid\""),
        ("quotes.json", "{'pid': {}}", "this is no JSON"),
        ("list.json", "[1.0, 2.0]", "holds no table"),
    ] {
        let error = read(name, text).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(words), "{error}");
    }
}

/// What no controller is, is said with the key that mends it.
#[test]
fn what_a_controller_lacks_is_named() {
    let run = |controller: &str| {
        let text = format!(
            "name = \"x\"\n[data]\nsample_time = 1e-3\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
             estimation = [{{ file = \"log.csv\" }}]\n[nominal.transfer_function]\ndomain = \"continuous\"\n\
             numerator = [1.0]\ndenominator = [1.0, 1.0]\n{controller}\n"
        );
        RunSettings::parse(&text, Path::new("run.toml")).unwrap_err().to_string()
    };
    for (controller, says) in [
        (
            "[controller.transfer_function]\nfeedback = \"negative\"\ndomain = \"continuous\"\nnumerator = [1.0]\ndenominator = [1.0]",
            "hold = \"tustin\"",
        ),
        (
            "[controller.transfer_function]\nfeedback = \"negative\"\ndomain = \"discrete\"\nhold = \"zoh\"\nnumerator = \
             [1.0]\ndenominator = [1.0]",
            "leave `hold` out",
        ),
        (
            "[controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"tustin\"\nkp = 1.0\nkd = 1.0",
            "state derivative_filter",
        ),
        ("[controller.pid]\nfeedback = \"negative\"\nkp = 1.0", "lacks `discretisation`"),
        (
            "[controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"tustin\"\nkp = 1.0\nti = 1.0",
            "`ti` is not a key of [controller.pid]",
        ),
        (
            "[controller.ideal_pid]\nfeedback = \"negative\"\ndiscretisation = \"tustin\"\nkp = 1.0\nti = 0.0",
            "leave it out where there is no integral part",
        ),
    ] {
        let error = run(controller);
        assert!(error.contains(says), "{controller}\n{error}");
    }
}

/// A gain has no states, and empty lists for them.
#[test]
fn a_gain_in_state_space_has_empty_lists() {
    let expected: Vec<f64> = error().iter().map(|e| -0.5 * e).collect();
    for c in ["[]", "[[]]"] {
        assert_close(
            &format!("[state_space]\nfeedback = \"positive\"\na = []\nb = []\nc = {c}\nd = [[-0.5]]\n"),
            &expected,
        );
    }
}
