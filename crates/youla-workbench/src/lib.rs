//! The workbench: `youla workbench` writes one HTML file that identifies in a browser, from the disk and without a network.
//!
//! The page holds the method as WebAssembly: this crate's program, built for `wasm32-wasip1` (`build.sh`), which the page gives an
//! in-memory file system and runs once for each request. A request is JSON with a `verb`:
//!
//! | verb | takes | answers |
//! |---|---|---|
//! | `survey` | `file`, `csv` | the columns with ranges and suggested roles |
//! | `traces` | `file`, `csv`, `columns`, `sample_time` | each column thinned to its outline, its spectrum |
//! | `coherence` | `toml` | coherence of the channels of the records with what excites the loop |
//! | `table`, `toml` | a run.toml as text, or its tables as JSON | the other of the two |
//! | `check` | `toml` | findings, with the rows in which they are |
//! | `orders` | `toml` | modes of models of all orders |
//! | `identify` | `toml`, `out` | writes a run folder; summary, and the verdict in a sentence |
//! | `draw` | `run` | draws plants from the region of a run folder, for `loop` |
//! | `loop` | `run`, `controller` | S, step and locus of a controller on the region of a run |
//! | `compare` | `runs` | a page of two runs |
//! | `archive` | `run`, `file` | the run folder as one zip file |
//! | `unpack` | `file`, `out` | the run folder of a zip file |
//!
//! A refusal is `{"error": "a sentence", "exit": 2}`, with the exit codes of the program.
//!
//! | file | holds |
//! |---|---|
//! | `request`, `refusal` | requests and answers, refusals |
//! | `log` | columns and their suggested roles |
//! | `traces` | outlines, spectra, coherence |
//! | `run` | check, identification, comparison |
//! | `archive` | a run folder as one file, and back |
//! | `orders` | the stabilisation chart |
//! | `gains` | the predicted loop |
//! | `page` | the HTML file |

mod archive;
mod gains;
mod log;
mod orders;
#[cfg(not(target_family = "wasm"))]
mod page;
mod refusal;
mod request;
mod run;
mod traces;

#[cfg(not(target_family = "wasm"))]
pub use page::page;
pub use request::answer;
