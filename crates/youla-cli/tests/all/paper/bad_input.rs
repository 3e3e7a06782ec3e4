//! One clear sentence and exit code 2.

use super::small::{copy_of_whole, paper, settings, whole};
use crate::common::{Outcome, empty_folder, youla};
use std::fs;

fn refused(outcome: &Outcome, words: &[&str]) {
    assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
    for word in words {
        assert!(outcome.stderr.contains(word), "{word}: {}", outcome.stderr);
    }
}

#[test]
fn values_without_meaning() {
    let folder = empty_folder("paper-bad");
    refused(&paper(&folder, &["--rpm", "-3"]), &["rpm", "-3"]);
    refused(&paper(&folder, &["--rpm", "90000", "--out", "x"]), &["the speed in rpm is 90000", "from 0 to max_speed"]);
    refused(&paper(&folder, &["--methods", "pem,hansn"]), &["hansn", "known are nominal, pem"]);
    refused(&paper(&folder, &["--shard", "3/2"]), &["shard of 2 is 3"]);
    refused(&paper(&folder, &["--shard", "0/2"]), &["shard of 2 is 0"]);
    refused(&paper(&folder, &["--shard", "half"]), &["\"half\" is not a shard", "2/4"]);
    refused(&paper(&folder, &["--models", "0"]), &["study.models (from 1 to 1000000) is 0"]);
    assert!(!folder.join("x").exists() && !folder.join("runs").exists());
}

#[test]
fn settings_that_no_controller_can_stabilise() {
    let folder = empty_folder("paper-unstabilisable");
    let strict = settings().replacen("peak_sensitivity = 3.0", "peak_sensitivity = 1.0", 1);
    fs::write(folder.join("strict.toml"), strict).expect("written");
    let outcome = youla(&folder, &["paper", "--settings", "strict.toml", "--out", "x"]);
    refused(&outcome, &["model 1 (theta 0.", "none of the 15 command weights", "at most 1 (the lowest peak is 1.0"]);
}

#[test]
fn folders_of_something_else() {
    let folder = copy_of_whole("paper-other-configuration", &["study.csv"]);
    let before = fs::read(folder.join("copy/study.csv")).expect("readable");
    let words = ["holds results of other settings", "settings.seed is 1 there and 5 here"];
    refused(&paper(&folder, &["--seed", "5", "--out", "copy"]), &words);
    refused(&paper(&folder, &["--shard", "1/2", "--out", "copy"]), &["shard is \"1/1\" there and \"1/2\" here"]);
    assert_eq!(fs::read(folder.join("copy/study.csv")).expect("readable"), before);

    fs::create_dir(folder.join("mine")).expect("made");
    fs::write(folder.join("mine/thesis.txt"), "chapter 1").expect("written");
    refused(&paper(&folder, &["--out", "mine"]), &["mine exists already and is not empty"]);

    fs::write(folder.join("copy/study.csv"), "a,b\n1,2\n").expect("written");
    refused(&paper(&folder, &["--out", "copy"]), &["study.csv is not a results file"]);
    assert_eq!(fs::read_to_string(folder.join("copy/study.csv")).expect("readable"), "a,b\n1,2\n");
}

#[test]
fn a_file_that_another_process_writes() {
    let folder = copy_of_whole("paper-locked", &["study.csv"]);
    let file = fs::File::open(folder.join("copy/study.csv")).expect("open");
    file.lock().expect("locked");
    refused(&paper(&folder, &["--out", "copy"]), &["another process is writing to it"]);
    assert!(whole().exists());
}
