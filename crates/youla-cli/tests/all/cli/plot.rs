//! `youla plot`: files, sizes, refusals.

use crate::common::{Outcome, demo, empty_folder, listing, refused_by, youla};
use std::fs;
use std::path::Path;
use std::process::Command;

fn done(found: &Outcome) {
    assert!(found.code == Some(0) && found.stderr.is_empty(), "{:?} {}", found.code, found.stderr);
}

fn millimetres(svg: &str, side: &str) -> f64 {
    let document = roxmltree::Document::parse(svg).expect("XML");
    document.root_element().attribute(side).expect("a size").trim_end_matches("mm").parse().expect("a number")
}

#[test]
fn every_figure_of_a_run_is_written_in_every_format() {
    let folder = empty_folder("plot");
    let run = demo().to_str().expect("text");
    let listed = youla(&folder, &["plot", run]);
    done(&listed);
    let kinds: Vec<&str> = listed.stdout.lines().filter_map(|line| line.split_whitespace().next()).collect();
    let all = [
        "data",
        "signals",
        "order",
        "verification",
        "residuals",
        "bode",
        "nyquist",
        "levels",
        "singular-values",
        "poles",
        "hankel",
        "reduction",
        "redesign",
    ];
    assert!(kinds.len() >= 11 && kinds.iter().all(|kind| all.contains(kind)), "{kinds:?}");

    let options = ["--width", "8.5", "--out", "new/figures"];
    let found = youla(&folder, &[&["plot", run, "all"], &options[..]].concat());
    done(&found);
    let files = listing(&folder.join("new/figures"));
    assert_eq!(found.stdout.lines().count(), files.len());
    let of =
        |ending: &str| files.iter().filter(|path| path.extension().is_some_and(|e| e == ending)).collect::<Vec<_>>();
    for kind in &kinds {
        let named =
            |path: &&&std::path::PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(kind));
        assert!(of("svg").iter().any(|path| named(&path)), "{kind}");
    }
    assert_eq!(of("csv").len(), of("svg").len());
    for path in of("svg") {
        let svg = fs::read_to_string(path).expect("written");
        assert_eq!(millimetres(&svg, "width"), 85.0);
        assert!(svg.contains("@font-face") && svg.len() < 600_000, "{} {}", path.display(), svg.len());
        let csv = fs::read_to_string(path.with_extension("csv")).expect("written");
        assert!(csv.starts_with("panel,method,note,") && csv.lines().count() > 3, "{}", path.display());
    }
}

#[test]
fn sizes_formats_and_places_are_as_asked_for() {
    let folder = empty_folder("plot-one");
    let run = demo().to_str().expect("text");
    let names = |stdout: &str| -> Vec<String> {
        let name = |line: &str| Path::new(line).file_name().expect("a file").to_string_lossy().into_owned();
        stdout.lines().map(name).collect()
    };
    let one = ["plot", run, "bode", "--output", "y_h", "--input", "u_v", "--height", "12", "--out", "."];
    let found = youla(&folder, &one);
    done(&found);
    assert_eq!(names(&found.stdout), ["bode-y_h-from-u_v.svg", "bode-y_h-from-u_v.csv"]);
    let svg = fs::read_to_string(folder.join("bode-y_h-from-u_v.svg")).expect("written");
    assert_eq!((millimetres(&svg, "width"), millimetres(&svg, "height")), (170.0, 120.0));

    done(&youla(&folder, &one));
    assert!(fs::read_to_string(folder.join("bode-y_h-from-u_v.svg")).expect("written") == svg, "the same bytes");

    let found = youla(&folder, &["plot", run, "poles", "--csv", "--methods", "hansen,direct", "--out", "."]);
    assert_eq!(names(&found.stdout), ["poles.csv"]);
    let csv = fs::read_to_string(folder.join("poles.csv")).expect("written");
    assert!(csv.contains("Hansen G(S)") && csv.contains("direct subspace") && !csv.contains("nominal"));

    let found = youla(&folder, &["plot", run, "hankel", "--json"]);
    done(&found);
    let about: serde_json::Value = serde_json::from_str(&found.stdout).expect("JSON");
    assert_eq!(about[0]["figure"], "hankel");
    assert!(about[0]["caption"].as_str().is_some_and(|caption| caption.contains("states are kept")), "{about}");
    assert!(demo().join("figures/hankel.svg").is_file() && demo().join("figures/hankel.csv").is_file());
}

#[test]
fn what_cannot_be_drawn_is_refused_and_leaves_nothing() {
    let folder = empty_folder("plot-refused");
    let run = demo().to_str().expect("text");
    let cases: [(&[&str], &[&str]); 12] = [
        (&["plot", run, "bodee"], &["has no \"bodee\" (did you mean \"bode\"?); known: all, bode, "]),
        (&["plot", run, "bode", "--output", "y_x"], &["has no \"y_x\"", "known: y_h, y_v"]),
        (&["plot", run, "bode", "--input", "u"], &["known: u_h, u_v"]),
        (&["plot", run, "data", "--record", "third"], &["known: estimation, verification"]),
        (&["plot", run, "poles", "--methods", "hansen,pem"], &["has no \"pem\"", "hansen_reduced"]),
        (
            &["plot", run, "verification", "--record", "estimation"],
            &["nothing of the figure \"verification\" is chosen"],
        ),
        (
            &["plot", run, "poles", "--output", "y_h"],
            &["\"poles\" cannot be drawn for one output alone; its choices are: methods"],
        ),
        (&["plot", run, "hankel", "--methods", "hansen"], &["\"hankel\" cannot be drawn", "its choices are: nothing"]),
        (&["plot", run, "bode", "--width", "3"], &["the width of the figure in cm", "between 4 and 100"]),
        (&["plot", run, "bode", "--height", "-1"], &["the height of the figure in cm"]),
        (&["plot", run, "data", "--height", "4"], &["figure data", "enough for its panels, labels and legend"]),
        (&["plot", "none", "bode"], &["no such file"]),
    ];
    for (arguments, evidence) in cases {
        let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
        refused_by(command.args(arguments).args(["--out", "new/figures"]), &folder, 2, evidence);
    }
    fs::create_dir_all(folder.join("taken/hankel.csv")).expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    refused_by(command.args(["plot", run, "hankel", "--out", "taken"]), &folder, 2, &["taken/hankel.csv"]);
    fs::write(folder.join("file"), "mine").expect("writable");
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    refused_by(command.args(["plot", run, "hankel", "--out", "file/figures"]), &folder, 2, &["file/figures"]);
}
