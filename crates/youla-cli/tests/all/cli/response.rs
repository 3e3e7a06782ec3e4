//! A measured response instead of a log: `[[data.response]]`.

use crate::common::{empty_folder, uniform, youla};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use youla::c64;

const LOOP: &str = "[nominal.transfer_function]\ndomain = \"discrete\"\nnumerator = [0.3]\ndenominator = [1.0, -0.7]\n\
    [controller.difference_equation]\nfeedback = \"negative\"\nnumerator = [1.0]\ndenominator = [1.0]\n[redesign]\n";

fn settings(data: &str) -> String {
    format!(
        "name = \"table\"\n[data]\nsample_time = 0.01\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
         input_excitation = [{{ name = \"d\" }}]\n{data}\n{LOOP}"
    )
}

/// `G = 0.2 / (z - 0.8)` under `u = d - y` at 80 frequencies, each value with an error of 1 %.
fn table(folder: &Path, of_loop: bool, decibel: bool) {
    let mut uniform = uniform(1);
    let mut random = || uniform() - 0.5;
    let endings = if decibel { ["dB", "deg"] } else { ["re", "im"] };
    let pairs = if of_loop { vec!["u/d", "y/d"] } else { vec!["y/u"] };
    let names: Vec<String> = pairs.iter().flat_map(|pair| endings.map(|e| format!("{pair} {e}"))).collect();
    let mut text = format!("hz,{}\n", names.join(","));
    for k in 0..80 {
        let hz = 0.2 * 200.0_f64.powf(f64::from(k) / 79.0);
        let g = 0.2 / (c64::cis(TAU * hz * 0.01) - 0.8);
        let values = if of_loop { vec![1.0 / (1.0 + g), g / (1.0 + g)] } else { vec![g] };
        write!(text, "{hz}").expect("a string");
        for value in values {
            let v = value * (1.0 + 0.024 * c64::new(random(), random()));
            let [a, b] = if decibel { [20.0 * v.norm().log10(), v.arg().to_degrees()] } else { [v.re, v.im] };
            write!(text, ",{a},{b}").expect("a string");
        }
        text.push('\n');
    }
    fs::write(folder.join("response.csv"), text).expect("written");
}

#[test]
fn a_table_gives_model_redesign_and_report() {
    for (of_loop, decibel) in [(true, false), (true, true), (false, false), (false, true)] {
        let folder = empty_folder(&format!("response-{of_loop}-{decibel}"));
        table(&folder, of_loop, decibel);
        fs::write(folder.join("run.toml"), settings("response = [{ file = \"response.csv\" }]")).expect("written");
        let done = youla(&folder, &["identify", "run.toml", "--out", "run", "--quiet"]);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        let text = fs::read(folder.join("run/summary.json")).expect("written");
        let summary: Value = serde_json::from_slice(&text).expect("JSON");
        let found = &summary["recommended"];
        assert_eq!((&found["trusted"], &found["order"]), (&Value::Bool(true), &Value::from(1)), "{found}");
        let pole = summary["methods"]["likelihood"]["poles"][0][0].as_f64().expect("a number");
        assert!((pole - 0.8).abs() < 0.01, "{pole}");
        assert!(summary["redesign"]["predicted"]["least_damping"].is_number(), "{summary}");
        let page = fs::read_to_string(folder.join("run/report.html")).expect("written");
        assert!(page.contains("at 80 frequencies"));
        // The stated controller is another one: the loop shows it, the plant alone does not.
        let wrong =
            settings("response = [{ file = \"response.csv\" }]").replace("numerator = [1.0]", "numerator = [0.5]");
        fs::write(folder.join("wrong.toml"), wrong).expect("written");
        let done = youla(&folder, &["identify", "wrong.toml", "--out", "wrong", "--quiet"]);
        let doubt = done.stderr.contains("the log shows another one: Part of the inputs");
        assert_eq!((done.code, doubt), if of_loop { (Some(3), true) } else { (Some(0), false) }, "{}", done.stderr);
        let page = fs::read_to_string(folder.join("wrong/summary.json")).expect("written");
        assert_eq!(page.contains("stated controller does not explain (controller) 0."), of_loop, "{page}");
        let check = youla(&folder, &["check", "run.toml"]);
        assert_eq!(check.code, Some(0), "{}", check.stderr);
    }
}

#[test]
fn a_table_that_cannot_be_used_names_what_is_missing() {
    let folder = empty_folder("response-bad");
    let says = |data: &str, csv: &str, part: &str| {
        fs::write(folder.join("response.csv"), csv).expect("written");
        fs::write(folder.join("run.toml"), data).expect("written");
        let done = youla(&folder, &["identify", "run.toml", "--out", "run", "--quiet"]);
        assert!(done.code == Some(2) && done.stderr.contains(part), "{:?} {}", done.code, done.stderr);
        assert!(!folder.join("run").exists());
    };
    let run = settings("response = [{ file = \"response.csv\" }]");
    says(&run, "f,y/u re,y/u im\n1,1,1\n", "no column is named hz or rad/s");
    says(&run, "hz,y re,y im\n1,1,1\n", "the plant has \"y/u re\" and \"y/u im\" for every output and input");
    says(
        &run,
        "hz,u/d re,u/d im,y/d re\n1,1,1,1\n",
        "no column is named \"y/d im\", but others of this response are there",
    );
    says(&run, "hz,y/u re,y/u im\n1,1,1\n64,1,1\n", "in Hz is 64, but must be at most half the sample rate");
    says(&run, "hz,y/u re,y/u im,y/u coherence\n1,1,1,1.2\n2,1,1,0.5\n", "y/u coherence at 1 Hz is 1.2");
    says(&run, "hz,y/u re,y/u im\n1,1,1\n2,nan,1\n", "response.csv");
    let both = settings("response = [{ file = \"response.csv\" }]\nestimation = [{ file = \"log.csv\" }]");
    says(&both, "hz,y/u re,y/u im\n1,1,1\n", "both estimation records and a response");
    let clock = run.replace("sample_time = 0.01", "time_column = \"t\"");
    says(&clock, "hz,y/u re,y/u im\n1,1,1\n", "no sample_time, which a response does not show");
    says(&format!("{run}[direct]\n"), "hz,y/u re,y/u im\n1,1,1\n", "[direct] needs estimation records");
}
