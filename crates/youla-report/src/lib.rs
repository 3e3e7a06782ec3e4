//! A run as one self-contained HTML file.
//!
//! Results come in as plain data, [`ReportData`], which holds what is drawn and nothing else, and go out as one file that
//! opens without a network: tables are written by a template. A figure is described once, as a [`Figure`]: print draws it as SVG ([`svg()`]), the page embeds it as JSON and
//! draws it by one script for all figures, on uPlot. Long records are reduced to their minimum and maximum per bucket ([`Trace`]) before they enter.
//!
//! | file | holds |
//! |---|---|
//! | `data` | the structs of the report |
//! | `trace` | one drawn curve over time and the clock it refers to |
//! | `decimate` | minimum and maximum per bucket |
//! | `phase` | the branch on which a phase is drawn |
//! | `figure` | a figure as data |
//! | `run_figures` | the figures of a run for print |
//! | `drawings` | figures, their places and styles, for the script of the page |
//! | `svg` | a figure for print |
//! | `csv` | the numbers behind figures and tables |
//! | `story` | a page of text, tables and figures as data |
//! | `tables` | fits by record and output, modes by frequency |
//! | `same_mode` | which modes of two models are the same one |
//! | `page` | template, style, code, data and library put into one file |
//! | `html` | a run as a page |
//! | `thin` | figures with as many points as a page takes |
//! | `story_html` | a story as a page |

mod csv;
pub mod data;
mod decimate;
mod drawings;
mod error;
pub mod figure;
mod html;
pub mod numbers;
mod page;
mod phase;
mod run_figures;
mod same_mode;
pub mod story;
mod story_html;
mod svg;
mod tables;
mod thin;
pub mod trace;

pub use csv::{figure_csv, table_csv};
pub use data::ReportData;
pub use error::{Error, Result};
pub use figure::Figure;
pub use html::html;
pub use page::{PageParts, page_parts, with_minus};
pub use run_figures::{FigureChoice, RunDrawing, RunFigure, run_drawings, run_figures};
pub use same_mode::match_modes;
pub use story::Story;
pub use story_html::story_html;
pub use svg::pretty_unit;
pub use svg::{Print, svg, svg_for};
pub use trace::{Timeline, Trace};
