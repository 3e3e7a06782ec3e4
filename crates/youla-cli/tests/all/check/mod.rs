//! `youla check` on measured records: it finds what is planted in copies of them, and is silent on the records as they are apart
//! from what is known of them. The records are not part of this project: without `../shared/data` beside the workspace these
//! tests print that they are skipped.

mod clean;
mod common;
mod planted;
mod program;
