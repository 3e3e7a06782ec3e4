//! A sequence for an experiment, one column for each input: text, MATLAB file, C99 header.

use super::c::{comment, finished};
use super::text::{PROGRAM, identifier, labels, number, plain, rows};
use crate::csv::csv_to_bytes;
use crate::error::{Error, Result};
use crate::matfile::mat_to_bytes;
use crate::values::{Value, Variable};
use youla::signal::Channel;
use youla::signal::Record;

const TEMPLATE: &str = include_str!("../../assets/export/sequence.h");

/// What a sequence can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SequenceFormat {
    /// Text: comments, a line of names, `t` and the channels.
    Csv,
    /// A C99 header with the values as an array.
    C,
    /// MATLAB version 5: `t`, `values`, `ts`, names and units.
    Mat,
}

impl SequenceFormat {
    /// All formats.
    pub const ALL: [SequenceFormat; 3] = [SequenceFormat::Csv, SequenceFormat::C, SequenceFormat::Mat];

    /// Its name on the command line.
    pub fn key(self) -> &'static str {
        match self {
            SequenceFormat::Csv => "csv",
            SequenceFormat::C => "c",
            SequenceFormat::Mat => "mat",
        }
    }

    /// The ending of its files.
    pub fn extension(self) -> &'static str {
        match self {
            SequenceFormat::C => "h",
            other => other.key(),
        }
    }
}

/// A sequence as the bytes of a file; `about` is the text of the comments, one sentence per line.
///
/// The files read back to the same values, bit by bit.
///
/// # Errors
/// [`youla::Error::DuplicateChannel`] for a channel `t` in a text; [`Error::WrongVariable`] for a sequence that is too long for a MATLAB
/// file; [`youla::Error::OutOfRange`] for one that is too long for a C array.
///
/// ```
/// use youla_io::export::{SequenceFormat, export_sequence};
/// use youla::{Mat, lti::Discrete, signal::{Channel, Record}};
/// use youla_io::{ChannelSpec, CsvOptions, TimeSource, csv_from_bytes};
/// let values = Mat::from_fn(3, 1, |k, _| k as f64 / 3.0);
/// let record = Record::new("alpha", vec![Channel::new("alpha_u", "V")], values, Discrete::new(1e-3)?)?;
/// let bytes = export_sequence(&record, SequenceFormat::Csv, &["An example.".into()])?;
/// let time = TimeSource::column("t".parse().unwrap());
/// let back = csv_from_bytes(&bytes, "alpha.csv", &[ChannelSpec::named("alpha_u")], &time, &CsvOptions::default())?;
/// assert_eq!(back.data(), record.data());
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn export_sequence(record: &Record, format: SequenceFormat, about: &[String]) -> Result<Vec<u8>> {
    let mut lines: Vec<String> = about.iter().map(|line| plain(line)).collect();
    lines.push(format!("Columns: {}", labels(record.channels())));
    lines.push(format!("Written by {PROGRAM}."));
    match format {
        SequenceFormat::Csv => csv_to_bytes(record, &lines),
        SequenceFormat::C => header(record, &lines).map(String::into_bytes),
        SequenceFormat::Mat => mat(record, about),
    }
}

fn header(record: &Record, about: &[String]) -> Result<String> {
    if record.samples() > i32::MAX as usize {
        let what = "the number of samples of a C array".into();
        return Err(Error::Method(youla::Error::OutOfRange {
            what,
            value: record.samples() as f64,
            must: "at most 2^31 - 1",
        }));
    }
    let name = identifier(record.name());
    let text = TEMPLATE
        .replace("@heading@", &comment(about))
        .replace("@ts@", &number(record.time().ts()))
        .replace("@values@", &rows(record.data(), "{", "},"));
    Ok(finished(&text, &name, record.samples(), record.channels().len(), 0))
}

fn mat(record: &Record, about: &[String]) -> Result<Vec<u8>> {
    let cell = |of: fn(&Channel) -> &String| Value::Cell {
        dims: vec![1, record.channels().len()],
        items: record.channels().iter().map(|c| Value::text(of(c))).collect(),
    };
    let times: Vec<f64> = (0..record.samples()).map(|k| record.time_at(k)).collect();
    let variables = [
        ("t", Value::Real { dims: vec![times.len(), 1], data: times }),
        ("values", Value::matrix(record.data())),
        ("ts", Value::scalar(record.time().ts())),
        ("name", Value::text(record.name())),
        ("channels", cell(|c| &c.name)),
        ("units", cell(|c| &c.unit)),
        ("about", Value::text(about.join(" "))),
        ("program", Value::text(PROGRAM)),
    ];
    mat_to_bytes(&variables.map(|(name, value)| Variable { name: name.into(), value }))
}
