//! A run that was stopped goes on where it was, and ends with the same bytes.

use super::small::{LOOPS, assert_same, command, copy_of_whole, paper, whole};
use crate::common::empty_folder;
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Runs the small paper again on a copy whose study.csv was changed, and reads what it says of it.
fn finished_after(name: &str, told: &str, change: impl Fn(&mut Vec<u8>)) {
    let folder = copy_of_whole(name, &LOOPS);
    let path = folder.join("copy/study.csv");
    let mut bytes = fs::read(&path).expect("readable");
    change(&mut bytes);
    fs::write(&path, bytes).expect("written");
    let done = paper(&folder, &["--out", "copy"]);
    assert_eq!(done.code, Some(0), "{name}: {}", done.stderr);
    assert!(done.stderr.contains(told), "{name}: {}", done.stderr);
    LOOPS.iter().for_each(|file| assert_same(file, &folder.join("copy")));
}

#[test]
fn a_file_cut_off_anywhere_is_completed() {
    let length = fs::read(whole().join("study.csv")).expect("readable").len();
    for (k, keep) in [0, 20, length / 2, length - 1].into_iter().enumerate() {
        let told = if keep > 100 { "computed again" } else { "crossover.csv: 4 loops are there already" };
        finished_after(&format!("paper-cut-{k}"), told, |bytes| bytes.truncate(keep));
    }
}

#[test]
fn a_damaged_last_row_is_computed_again() {
    let told = "study.csv: 4 loops are there already, 5 damaged or incomplete rows are computed again";
    finished_after("paper-damaged", told, |bytes| {
        // A digit of the last row, some characters before its check.
        let at = bytes.len() - 40;
        bytes[at] = if bytes[at] == b'1' { b'2' } else { b'1' };
    });
}

#[test]
fn a_killed_process_leaves_what_the_next_one_completes() {
    let folder = empty_folder("paper-killed");
    let rows = || fs::read_to_string(folder.join("killed/study.csv")).map_or(0, |text| text.lines().count());
    let mut running = command(&folder, &["--out", "killed"]).stdout(Stdio::null()).spawn().expect("started");
    while rows() < 6 && running.try_wait().expect("known").is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    // SIGKILL: nothing is cleaned up.
    running.kill().expect("killed or finished");
    running.wait().expect("reaped");
    let done = paper(&folder, &["--out", "killed", "--quiet"]);
    assert_eq!((done.code, done.stderr.as_str()), (Some(0), ""));
    LOOPS.iter().for_each(|file| assert_same(file, &folder.join("killed")));
}

/// A run that ends before the signal would exit with 0; the loops of this one take longer than its first row.
#[cfg(unix)]
#[test]
fn an_interrupt_says_how_to_continue_and_exits_with_130() {
    let folder = empty_folder("paper-interrupted");
    let rows = || fs::read_to_string(folder.join("cut/study.csv")).map_or(0, |text| text.lines().count());
    let many = ["--models", "2000", "--out", "cut"];
    let mut running = Command::new(env!("CARGO_BIN_EXE_youla"));
    running.arg("paper").args(many).current_dir(&folder).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut running = running.spawn().expect("started");
    while rows() < 6 && running.try_wait().expect("known").is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let signal = Command::new("kill").args(["-INT", &running.id().to_string()]).status().expect("kill");
    assert!(signal.success());
    let found = running.wait_with_output().expect("reaped");
    let text = String::from_utf8_lossy(&found.stderr);
    assert_eq!(found.status.code(), Some(130), "{text}");
    assert!(text.contains("interrupted: the finished loops are kept in cut"), "{text}");
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let folder = empty_folder("paper-one-thread");
    let done = command(&folder, &["--out", "one", "--quiet"]).env("RAYON_NUM_THREADS", "1").status().expect("run");
    assert!(done.success());
    let figures = fs::read_dir(whole().join("figures")).expect("figures");
    let figures = figures.map(|f| format!("figures/{}", f.expect("entry").file_name().to_string_lossy()));
    let files: Vec<String> = LOOPS.map(str::to_owned).into_iter().chain(figures).collect();
    assert!(files.len() > 10, "{files:?}");
    for file in files.iter().map(String::as_str).chain(["summary.json", "tables/table-1.csv"]) {
        assert_same(file, &folder.join("one"));
    }
}
