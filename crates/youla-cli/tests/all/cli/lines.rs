//! A periodic excitation: what its lines say of the recommended model and of the plant.

use crate::common::{empty_folder, uniform, youla};
use serde_json::Value;
use std::fmt::Write;
use std::fs;

const RECORDS: usize = 3;
const PERIOD: usize = 250;

/// Three records `y+ = 0.8 y + 0.2 (u + cubic u^3) + noise`, `u = d - y`, d of 40 lines with other phases in each.
fn logs(folder: &std::path::Path, cubic: f64) {
    let mut random = uniform(1);
    for record in 0..RECORDS {
        let phases: Vec<f64> = (0..40).map(|_| random()).collect();
        let turns = |t: usize, l: usize| (l + 1) as f64 * t as f64 / PERIOD as f64 + phases[l];
        let d: Vec<f64> = (0..PERIOD)
            .map(|t| 0.2 * (0..40).map(|l| (std::f64::consts::TAU * turns(t, l)).cos()).sum::<f64>())
            .collect();
        let (mut y, mut text) = (0.0, String::from("u,y,d\n"));
        for t in 0..6 * PERIOD {
            let measured = y + 0.02 * (random() + random() + random() - 1.5);
            let u = d[t % PERIOD] - measured;
            writeln!(text, "{u},{measured},{}", d[t % PERIOD]).expect("a string");
            y = 0.8 * y + 0.2 * (u + cubic * u * u * u);
        }
        fs::write(folder.join(format!("log{record}.csv")), text).expect("written");
    }
    let settings = "name = \"lines\"\n[data]\nsample_time = 0.01\ninputs = [{ name = \"u\" }]\noutputs = [{ name = \"y\" }]\n\
        input_excitation = [{ name = \"d\" }]\nestimation = [{ file = \"log0.csv\" }, { file = \"log1.csv\" }, { file = \"log2.csv\" }]\n\
        [nominal.transfer_function]\ndomain = \"discrete\"\nnumerator = [0.3]\ndenominator = [1.0, -0.7]\n\
        [controller.difference_equation]\nfeedback = \"negative\"\nnumerator = [1.0]\ndenominator = [1.0]\n";
    fs::write(folder.join("run.toml"), settings).expect("written");
}

/// The block of response.json and the verdict.
fn found(name: &str, cubic: f64) -> (Value, String) {
    let folder = empty_folder(name);
    logs(&folder, cubic);
    let done = youla(&folder, &["identify", "run.toml", "--out", "run", "--quiet"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let json = |file: &str| -> Value {
        serde_json::from_str(&fs::read_to_string(folder.join("run").join(file)).expect("written")).expect("JSON")
    };
    let plot = youla(&folder, &["plot", "run", "levels", "--out", "figures"]);
    assert_eq!(plot.code, Some(0), "{}", plot.stderr);
    let verdict = json("report.json")["verdict"].as_array().expect("lines").iter().map(Value::to_string).collect();
    (json("response.json")["lines"][0].clone(), verdict)
}

/// `G = 0.2 / (z - 0.8)` at the lines, within 0.2 dB at each of them.
#[test]
fn lines_of_a_linear_plant_agree_with_the_model() {
    let (lines, verdict) = found("lines-linear", 0.0);
    let numbers = |key: &str| -> Vec<f64> {
        lines[key].as_array().expect("numbers").iter().map(|v| v.as_f64().unwrap_or(f64::NAN)).collect()
    };
    let (hz, response, noise) = (numbers("hz"), numbers("response_db"), numbers("noise_db"));
    assert_eq!((hz.len(), lines["period"].as_u64()), (40, Some(PERIOD as u64)));
    for (f, g) in hz.iter().zip(&response) {
        let angle = std::f64::consts::TAU * f * 0.01;
        let exact = 20.0 * (0.2 / ((angle.cos() - 0.8).powi(2) + angle.sin().powi(2)).sqrt()).log10();
        assert!((g - exact).abs() < 0.2, "{f} Hz: {g} and {exact} dB");
    }
    assert!(noise.iter().zip(&response).all(|(n, g)| n < &(g - 20.0)), "{noise:?}");
    assert!(verdict.contains("At 40 lines of the periodic excitation") && verdict.contains("agrees"), "{verdict}");
    assert!(!verdict.contains("A linear model explains"), "{verdict}");
}

#[test]
fn a_cubic_is_named_with_its_share() {
    let (lines, verdict) = found("lines-cubic", 0.05);
    assert!(lines["distortion_db"].as_array().is_some_and(|levels| !levels.is_empty()));
    assert!(
        verdict.contains("A linear model explains at most") && verdict.contains("nonlinear distortion"),
        "{verdict}"
    );
}
