//! What is made of a finished run folder: its report drawn again, figures for papers, models for export.

pub(crate) mod export;
pub(crate) mod plot;
pub(crate) mod redraw;
