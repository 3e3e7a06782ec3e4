//! Output that cannot be written: the path is named, the old run stays, nothing half-written is left.

use crate::common::{loop_folder, refused_by, youla};
use std::fs;
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_youla");

#[test]
fn output_below_a_file() {
    let folder = loop_folder("below-file", &[]);
    for out in ["log.csv", "log.csv/a/b"] {
        let mut command = Command::new(PROGRAM);
        refused_by(command.args(["identify", "run.toml", "--out", out]), &folder, 2, &[out]);
        let mut command = Command::new(PROGRAM);
        refused_by(command.args(["signals", "run.toml", "--out", out]), &folder, 2, &[out]);
    }
}

/// A limit on the size of files stands for a full disk: writing fails in the middle of a file.
#[cfg(unix)]
#[test]
fn full_disk() {
    let folder = loop_folder("full-disk", &[]);
    let limited = |arguments: &str| {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("trap '' XFSZ; ulimit -f 40; exec \"$0\" {arguments}"), PROGRAM]);
        shell
    };
    refused_by(&mut limited("identify run.toml --out new/out"), &folder, 2, &["new/out/", "File too large"]);
    refused_by(&mut limited("identify run.toml"), &folder, 2, &["runs/loop-001/", "File too large"]);
    refused_by(&mut limited("signals run.toml --out new"), &folder, 2, &["new/log.csv", "File too large"]);
}

#[test]
fn folders_that_are_not_empty() {
    let folder = loop_folder("not-empty", &[]);
    fs::create_dir(folder.join("mine")).expect("made");
    fs::write(folder.join("mine/thesis.tex"), "years of work").expect("written");
    for (force, reason) in
        [(&[][..], "exists already and is not empty"), (&["--force"], "is not replaced: it has no files.txt")]
    {
        let mut command = Command::new(PROGRAM);
        let arguments = [&["identify", "run.toml", "--out", "mine"], force].concat();
        refused_by(command.args(arguments), &folder, 2, &["mine", reason]);
        assert!(folder.join("mine/thesis.tex").exists());
    }
    let run = ["identify", "run.toml", "--out", "run", "--quiet"];
    assert_eq!(youla(&folder, &run).code, Some(0));
    let first = fs::read(folder.join("run/summary.json")).expect("written");
    refused_by(Command::new(PROGRAM).args(run), &folder, 2, &["run exists already and is not empty"]);
    assert_eq!(fs::read(folder.join("run/summary.json")).expect("still there"), first);
    // A file that no run wrote is kept, and everything beside it.
    fs::write(folder.join("run/notes"), "mine").expect("written");
    let forced = [&run[..], &["--force"]].concat();
    refused_by(Command::new(PROGRAM).args(&forced), &folder, 2, &["run is not replaced: it holds notes"]);
    assert_eq!(fs::read(folder.join("run/summary.json")).expect("still there"), first);
    fs::remove_file(folder.join("run/notes")).expect("removed");
    assert_eq!(youla(&folder, &forced).code, Some(0));
    assert!(folder.join("run/report.html").is_file());
}

#[test]
fn reports_of_no_run() {
    let folder = loop_folder("no-report", &[]);
    let refuse = |evidence: &str| {
        let mut command = Command::new(PROGRAM);
        refused_by(command.args(["report", "."]), &folder, 2, &["report.json", evidence]);
    };
    refuse("no such file");
    fs::write(folder.join("report.json"), "{\"a\": 1}").expect("written");
    refuse("not the report.json of a run: unknown field `a`");
    fs::write(folder.join("report.json"), "{}").expect("written");
    refuse("not the report.json of a run: missing field `title`");
    fs::write(folder.join("report.json"), "{\"title\": ").expect("written");
    refuse("EOF");
    for (begun, run, says) in [
        (".run.partial-7/.lock", "run", "start the same `youla identify` command again"),
        ("paper/configuration.toml", "paper", "the same `youla paper` command with this --out resumes it"),
    ] {
        fs::create_dir(folder.join(begun).parent().expect("a folder")).expect("made");
        fs::write(folder.join(begun), "").expect("written");
        refused_by(Command::new(PROGRAM).args(["report", run]), &folder, 2, &[run, says]);
    }
}

/// Places are tested before anything is computed: the message names the place, also where the input is bad.
#[test]
fn the_place_is_tested_first() {
    let folder = loop_folder("place-first", &[]);
    for arguments in [
        &["check", "nowhere.csv", "--input", "u", "--output", "y", "--sample-time", "1", "--out", "log.csv/check"][..],
        &["compare", "nowhere", "nowhere-else", "--out", "log.csv/page.html"],
        &["excite", "run.toml", "--amplitude", "nan", "--band", "1,10", "--duration", "1", "--out", "log.csv/excite"],
        &["paper", "--models", "2", "--out", "log.csv/paper"],
    ] {
        refused_by(Command::new(PROGRAM).args(arguments), &folder, 2, &["log.csv/"]);
    }
}

/// Figures that the program drew into a run do not keep it from being replaced; a file of the user beside them does.
#[test]
fn a_run_with_figures_is_replaced() {
    let folder = loop_folder("with-figures", &[]);
    let run = ["identify", "run.toml", "--out", "run", "--quiet", "--force"];
    assert_eq!(youla(&folder, &run).code, Some(0));
    assert_eq!(youla(&folder, &["plot", "run", "bode", "--quiet"]).code, Some(0));
    fs::write(folder.join("run/figures/mine.txt"), "mine").expect("written");
    refused_by(Command::new(PROGRAM).args(run), &folder, 2, &["run is not replaced: it holds figures/mine.txt"]);
    fs::remove_file(folder.join("run/figures/mine.txt")).expect("removed");
    assert_eq!(youla(&folder, &run).code, Some(0));
    assert!(!folder.join("run/figures").exists());
}
