//! Ctrl-C in a computation.

use crate::progress::Progress;
use std::path::Path;
use std::sync::{Arc, Mutex};
use youla_run::Stage;

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
    let _ = ctrlc::set_handler(move || end(&sentence));
}

/// The stage in which a run is; `None` once its folder is written.
pub(crate) type Reached = Arc<Mutex<Option<Stage>>>;

/// From here on Ctrl-C removes the unfinished folder of a run and ends the program with exit code 130 and one sentence, which names the stage.
pub(crate) fn without_result(unfinished: &Path) -> Reached {
    let (reached, unfinished) = (Reached::default(), unfinished.to_owned());
    let stage = Arc::clone(&reached);
    let _ = ctrlc::set_handler(move || {
        let Some(stage) = stage.lock().ok().and_then(|stage| *stage) else { end("interrupted") };
        let [at, of] = [stage as usize + 1, Stage::COUNT];
        // While files are written and take the place of an older run, all is left as it is; what is left is removed by the next run.
        if at <= Stage::Write as usize {
            let _ = std::fs::remove_dir_all(&unfinished);
        }
        let name = stage.name();
        end(&format!(
            "interrupted in stage {at} of {of}, {name}: no result is written; --time-limit SECONDS keeps the best model found by then"
        ));
    });
    reached
}

/// Notes the stage in which a run is.
pub(crate) fn note(reached: &Reached, stage: Option<Stage>) {
    if let Ok(mut reached) = reached.lock() {
        *reached = stage;
    }
}

fn end(sentence: &str) -> ! {
    Progress::new(false).say(&crate::output::sanitised(sentence));
    std::process::exit(INTERRUPTED);
}
