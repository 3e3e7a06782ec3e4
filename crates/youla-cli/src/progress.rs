//! Progress as one line on standard error that is written anew, on a terminal only.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The shortest time between two states of the line that only differ in their numbers.
const BEAT: Duration = Duration::from_millis(100);
/// To the start of the line, and erase it (ECMA-48).
const ERASE: &str = "\r\u{1b}[2K";

/// The line, and what is counted in it.
pub(crate) struct Progress {
    visible: bool,
    quiet: bool,
    started: Instant,
    counted: Mutex<Counted>,
}

/// Items of a stage, and from where on they are of this call.
#[derive(Default)]
struct Counted {
    stage: String,
    items: usize,
    /// When the stage began, with how many items.
    from: Option<(Instant, usize)>,
    written: Option<Instant>,
}

impl Progress {
    pub(crate) fn new(quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal();
        Progress { visible, quiet, started: Instant::now(), counted: Mutex::default() }
    }

    /// Writes the line anew.
    pub(crate) fn show(&self, text: &str) {
        self.write(&format!("{ERASE}{text} ({} s)", self.started.elapsed().as_secs()));
    }

    /// Begins a stage of so many items, of none where they are not counted.
    pub(crate) fn begin(&self, stage: &str, items: usize) {
        self.show(stage);
        if let Ok(mut counted) = self.counted.lock() {
            *counted = Counted { stage: stage.to_owned(), items, ..Counted::default() };
        }
    }

    /// So many items of the stage are done; the remaining time is that of the items of this call.
    pub(crate) fn done(&self, items: usize) {
        let Ok(mut counted) = self.counted.lock() else { return };
        let now = Instant::now();
        let (begun, first) = *counted.from.get_or_insert((now, items));
        if counted.written.is_some_and(|written| now - written < BEAT) {
            return;
        }
        counted.written = Some(now);
        let rate = items.saturating_sub(first) as f64 / (now - begun).as_secs_f64();
        let left = counted.items.saturating_sub(items) as f64 / rate;
        let left = if left.is_finite() { format!(", {left:.0} s left") } else { String::new() };
        self.show(&format!("{} {items}/{}{left}", counted.stage, counted.items));
    }

    /// A sentence above the line, or on standard error where the line is not to be seen.
    pub(crate) fn say(&self, text: &str) {
        if !self.quiet {
            let erase = if self.visible { ERASE } else { "" };
            // Without standard error nothing is shown.
            let _ = writeln!(std::io::stderr(), "{erase}{text}");
        }
    }

    /// Takes the line away.
    pub(crate) fn clear(&self) {
        self.write(ERASE);
    }

    fn write(&self, text: &str) {
        if self.visible {
            let mut out = std::io::stderr().lock();
            // Without standard error nothing is shown.
            let _ = write!(out, "{text}").and_then(|()| out.flush());
        }
    }
}
