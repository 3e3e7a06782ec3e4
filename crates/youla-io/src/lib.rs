//! Files of measured records and of models.
//!
//! A reader turns a file into a [`youla::signal::Record`] or refuses it: a gap in time, a cell that is not a finite number, or
//! channels of unequal length is an error that states the file, the line or byte, and the setting to change. No reader
//! repairs, resamples or guesses; channels are chosen by name or column number. [`synchronise`] fills and interpolates, on request, and says what that costs.
//!
//! | module or item | content |
//! |---|---|
//! | [`Source`], [`read`] | one description of a recorded file: path, format, time, channels |
//! | [`read_csv`], [`write_csv`] | text: comma, semicolon, tab or blanks, plain or gzip |
//! | [`read_mat`], [`write_mat`] | MATLAB version 5; version 7.3 and HDF5 with the feature `mat73` |
//! | [`read_npz`] | NumPy archives |
//! | [`read_response`] | measured responses: tables, universal files with dataset 58 |
//! | [`Variables`] | the contents of a MATLAB or NumPy file, by path |
//! | [`survey`] | the columns of a file before any is chosen |
//! | [`synchronise`] | channels with their own time stamps, on the clock of the controller |
//! | [`ModelFile`] | the JSON form of a discrete-time model |
//! | [`export`] | models, controllers and sequences for C, Python, MATLAB; import of models |
//! | [`folder`] | a folder of results that appears only when it is complete |
//! | [`toml_file`] | settings in TOML, with errors that state line, column and key |
//!
//! The feature `mat73` is off by default; without it a file of version 7.3 is refused with the name of the feature.
//!
//! ```
//! use youla_io::{ChannelSpec, CsvOptions, TimeSource, csv_from_bytes};
//! let text = b"t,u,y\n0.0,1,0.2\n0.1,-1,0.4\n0.2,1,0.3\n";
//! let channels = ["u", "y"].map(ChannelSpec::named);
//! let time = TimeSource::column("t".parse()?);
//! let record = csv_from_bytes(text, "log.csv", &channels, &time, &CsvOptions::default())?;
//! assert_eq!((record.samples(), record.time().ts()), (3, 0.1));
//! assert_eq!(record.column("y")?, [0.2, 0.4, 0.3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod choose;
mod csv;
#[cfg(not(feature = "mat73"))]
mod disabled;
mod error;
pub mod export;
pub mod folder;
#[cfg(feature = "mat73")]
mod hdf;
#[cfg(feature = "mat73")]
mod limits;
mod matfile;
mod matrices;
mod model_file;
mod npz;
mod open;
mod response;
#[cfg(test)]
pub(crate) mod scratch;
mod source;
mod survey;
mod synchronise;
mod target;
mod time;
pub mod toml_file;
mod uff;
mod values;

pub use choose::{ChannelRef, ChannelSpec};
pub use csv::{
    CsvOptions, DecimalSign, Delimiter, HeaderLine, StampedColumn, csv_from_bytes, read_csv, read_stamped_csv,
    write_csv,
};
#[cfg(not(feature = "mat73"))]
use disabled::hdf;
pub use error::{CorruptAt, Error, Result, TextPosition};
pub use matfile::{Packing, mat_from_bytes, read_mat, write_mat};
pub use matrices::{Rows, SystemMatrices};
pub use model_file::ModelFile;
pub use npz::{npz_from_bytes, read_npz};
pub use open::{open, read_bytes, read_text};
pub use response::{ReadResponse, ResponseSignals, read_response};
pub use source::{Format, Source, check_unit, read, read_parts, read_rows, sha256, sha256_of};
pub use survey::{ColumnContent, SurveyedColumn, survey};
pub use synchronise::{ChannelRole, ChannelTiming, Placement, StampedChannel, Synchronised, synchronise};
pub use target::{require_free, require_free_for_settings};
pub use time::{Gaps, TimeSource, unit_of_time};
pub use values::{Value, Variable, Variables};
