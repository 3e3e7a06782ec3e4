//! Parts of the paper, joined.

use super::small::{LOOPS, assert_same, paper};
use crate::common::{empty_folder, youla};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Three parts, computed once.
fn parts() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = empty_folder("paper-shards");
        for k in 1..=3 {
            let done = paper(&folder, &["--shard", &format!("{k}/3"), "--out", &format!("part{k}")]);
            assert_eq!(done.code, Some(0), "{}", done.stderr);
            assert!(done.stdout.contains("youla study merge"), "{}", done.stdout);
            assert!(!folder.join(format!("part{k}/report.html")).exists());
        }
        folder
    })
}

#[test]
fn joined_parts_are_the_whole() {
    let merged = youla(parts(), &["study", "merge", "part2", "part3", "part1", "--out", "joined", "--quiet"]);
    assert_eq!((merged.code, merged.stderr.as_str()), (Some(0), ""));
    for file in LOOPS.into_iter().chain(["summary.json", "tables/table-1.csv", "configuration.toml"]) {
        assert_same(file, &parts().join("joined"));
    }
    assert!(parts().join("joined/report.html").exists());
}

#[test]
fn parts_that_make_no_whole_are_refused() {
    let refused = |arguments: &[&str]| {
        let outcome = youla(parts(), &[&["study", "merge"], arguments, &["--out", "refused"]].concat());
        assert_eq!(outcome.code, Some(2), "{arguments:?}: {}", outcome.stderr);
        assert!(!parts().join("refused").exists(), "{arguments:?}");
        outcome.stderr
    };
    assert!(refused(&["part1", "part3"]).contains("shard 2/3 is missing"));
    assert!(refused(&["part1", "part2", "part2"]).contains("part2: shard 2/3 is given twice"));
    assert!(refused(&["part1", "part2", "nowhere"]).contains("nowhere"));
    let other = paper(parts(), &["--shard", "2/3", "--seed", "9", "--out", "other2"]);
    assert_eq!(other.code, Some(0), "{}", other.stderr);
    let message = refused(&["part1", "other2", "part3"]);
    assert!(message.contains("settings.seed is 1 there and 9 here"), "{message}");
}
