//! The paper as a page: what [`crate::study::Paper`] holds, in the order of the paper, as text, tables and figures.
//!
//! | file | holds |
//! |---|---|
//! | `contents` | the page: its sections in order |
//! | `sections` | one section each |
//! | `figures*`, `map` | the figures as data |
//! | `tables*`, `modes` | the tables |
//! | `claims*` | what the paper claims and what comes out |
//! | `order` | where Table 1 has another order of methods, and what bounds its fits |
//! | `open` | what the paper leaves open and what was chosen |
//! | `summary` | the same numbers for scripts |
//! | `words` | numbers and lists as text |

mod claims;
mod claims_experiments;
mod claims_study;
mod contents;
mod figures;
mod figures_experiments;
mod figures_study;
mod map;
mod modes;
mod open;
mod order;
mod sections;
mod summary;
mod tables;
mod tables_experiments;
mod tables_nominal;
mod tables_rig;
mod tables_study;
#[cfg(test)]
mod tests;
mod words;

pub use claims::{Claim, ClaimOutcome, paper_claims};
pub use contents::{paper_figures, paper_story, paper_tables, story_methods};
pub use summary::paper_summary;
