//! Everything that was chosen.

use crate::story::open::choices;
use crate::study::Paper;
use serde::Serialize;
use youla_report::story::section;
use youla_report::story::{Block, Section};

/// What the paper leaves open, and both settings files.
pub(in crate::story) fn settings(paper: &Paper) -> Section {
    let text = format!(
        "The seed is {}; the same settings, rig file and seed give the same results bit by bit, whatever the number of threads. The \
         paper leaves open the following, which was chosen once for all experiments and models:",
        paper.settings.seed
    );
    let blocks = vec![
        Block::Text(text),
        Block::List(choices(paper)),
        Block::Listing { title: "Settings".into(), text: toml_text(&paper.settings) },
        Block::Listing { title: "Rig".into(), text: toml_text(&paper.rig) },
    ];
    section("settings", "Settings", "Settings", blocks)
}

/// As TOML; a value that TOML cannot hold is named instead.
fn toml_text(value: &impl Serialize) -> String {
    toml::to_string(value).unwrap_or_else(|e| e.to_string())
}
