//! Ctrl-C in a computation that writes its results as it goes.

use crate::progress::Progress;
use std::path::Path;

/// The exit code of a program that SIGINT ended, as shells count it: 128 + 2.
const INTERRUPTED: i32 = 130;

/// From here on Ctrl-C ends the program with exit code 130 and one sentence: where the finished items are and how to go on. An item is
/// written by one call of the system, so that at most the last one is incomplete; the next call computes it again.
pub(crate) fn resumable(folder: &Path) {
    let sentence = format!(
        "interrupted: the finished loops are kept in {}; run the same command again to continue from them",
        folder.display()
    );
    // Where no handler can be set, Ctrl-C ends the program without the sentence; the finished items are kept all the same.
    let _ = ctrlc::set_handler(move || {
        Progress::new(false).say(&crate::output::sanitised(&sentence));
        std::process::exit(INTERRUPTED);
    });
}
