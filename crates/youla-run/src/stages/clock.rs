//! The stages of a run: their names, and the clock that announces and measures them.

use serde::{Deserialize, Serialize};
use std::time::Instant;

/// A stage of a run, in the order in which data flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Records are read.
    Record,
    /// Coprime factors (13)-(15).
    Factor,
    /// alpha and beta (28).
    Signals,
    /// The check of the data.
    Check,
    /// S and the direct model.
    Identify,
    /// `G_red(S)` (29).
    Reduce,
    /// Fits (26) and certificates.
    Validate,
    /// The loop under uncertainty and wrong descriptions.
    Certify,
    /// A new controller.
    Redesign,
    /// Artefacts are written.
    Write,
    /// The report is drawn.
    Report,
}

impl Stage {
    /// Number of stages.
    pub const COUNT: usize = Stage::Report as usize + 1;

    /// Name in summary.json and in reports.
    pub fn name(self) -> &'static str {
        const NAMES: [&str; Stage::COUNT] = [
            "record", "factor", "signals", "check", "identify", "reduce", "validate", "certify", "redesign", "write",
            "report",
        ];
        NAMES[self as usize]
    }
}

/// Seconds that each stage took.
pub type StageTimes = Vec<(Stage, f64)>;

/// Announces stages and measures them.
pub struct StageClock<'a> {
    announce: &'a mut dyn FnMut(Stage),
    /// Stages finished so far.
    pub seconds: StageTimes,
}

impl<'a> StageClock<'a> {
    /// A clock that calls `announce` at the start of each stage.
    pub fn new(announce: &'a mut dyn FnMut(Stage)) -> Self {
        StageClock { announce, seconds: Vec::new() }
    }

    /// Runs one stage.
    pub fn run<T>(&mut self, stage: Stage, work: impl FnOnce() -> T) -> T {
        (self.announce)(stage);
        let start = Instant::now();
        let result = work();
        self.seconds.push((stage, start.elapsed().as_secs_f64()));
        result
    }
}
