//! The contents of a MATLAB or NumPy file, and records from them.

mod path;

use crate::assemble::{assemble, only};
use crate::choose::{ChannelRef, ChannelSpec};
use crate::error::{Error, Result};
use crate::time::TimeSource;
use std::path::{Path, PathBuf};
use youla::signal::Channel;
use youla::signal::Record;

/// The variables of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Variables {
    path: PathBuf,
    variables: Vec<Variable>,
}

/// A named value.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name, without the path to it.
    pub name: String,
    /// Value.
    pub value: Value,
}

/// A value. Arrays are stored by column, `dims` has two entries or more.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Value {
    /// Real numbers of any class, and logicals as 0 and 1; 64-bit integers beyond 2^53 are rounded.
    Real {
        /// Size in each direction.
        dims: Vec<usize>,
        /// Values by column.
        data: Vec<f64>,
    },
    /// Complex numbers.
    Complex {
        /// Size in each direction.
        dims: Vec<usize>,
        /// Real parts by column.
        re: Vec<f64>,
        /// Imaginary parts by column.
        im: Vec<f64>,
    },
    /// The rows of a character array.
    Text(Vec<String>),
    /// A cell array.
    Cell {
        /// Size in each direction.
        dims: Vec<usize>,
        /// Values by column.
        items: Vec<Value>,
    },
    /// A struct or an array of structs with the same fields.
    Struct {
        /// Size in each direction.
        dims: Vec<usize>,
        /// Names of the fields.
        fields: Vec<String>,
        /// All fields of the first element, then all of the second, and so on.
        items: Vec<Value>,
    },
    /// A value of a class that is not read: sparse, object, function handle and others.
    Unsupported {
        /// What MATLAB calls it.
        class: String,
    },
}

impl Variables {
    pub(super) fn new(path: &Path, variables: Vec<Variable>) -> Self {
        Variables { path: path.to_owned(), variables }
    }

    /// The variables in their order.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// A record whose channels are vectors of the file, chosen by paths such as `Data.signals.u`.
    ///
    /// # Errors
    /// Those of [`Variables::column`], also where `channels` is empty, to list what there is;
    /// [`Error::UnequalLength`], and those of the sample time: [`Error::SampleTimeMissing`],
    /// [`Error::NonUniformTime`], [`youla::Error::SampleTimeMismatch`].
    ///
    /// ```no_run
    /// use youla_io::{ChannelRef, ChannelSpec, TimeSource, read_mat};
    /// let channels = ["u", "y"].map(|n| ChannelSpec::from(n, ChannelRef::Name(format!("Data.signals.{n}")), ""));
    /// let record = read_mat("cycle1.mat")?.record(&channels, &TimeSource::ts(5e-4))?;
    /// # Ok::<(), youla_io::Error>(())
    /// ```
    pub fn record(&self, channels: &[ChannelSpec], time: &TimeSource) -> Result<Record> {
        only(self.record_parts(channels, time)?)
    }

    /// The same, with a record for each part without gaps.
    pub(super) fn record_parts(&self, channels: &[ChannelSpec], time: &TimeSource) -> Result<Vec<Record>> {
        if channels.is_empty() {
            return Err(self.unknown(""));
        }
        let read = |reference: &ChannelRef| self.column(&reference.to_string());
        let columns = channels.iter().map(|spec| read(&spec.source())).collect::<Result<Vec<_>>>()?;
        let times = time.column.as_ref().map(read).transpose()?;
        let what = self.path.display().to_string();
        if let Some(times) = times.as_ref().filter(|times| times.len() != columns[0].len()) {
            let (found, expected) = (times.len(), columns[0].len());
            return Err(Error::UnequalLength { what, channel: "the time".into(), found, expected });
        }
        let clock = time.resolve(&what, times.as_deref())?;
        let channels = channels.iter().map(|spec| Channel::new(&spec.name, &spec.unit)).collect();
        assemble(&what, channels, &columns, clock)
    }
}

impl Value {
    /// A real number.
    pub fn scalar(value: f64) -> Value {
        Value::Real { dims: vec![1, 1], data: vec![value] }
    }

    /// A real matrix.
    pub fn matrix(matrix: faer::MatRef<'_, f64>) -> Value {
        let mut data = Vec::with_capacity(matrix.nrows() * matrix.ncols());
        matrix.col_iter().for_each(|column| data.extend(column.iter()));
        Value::Real { dims: vec![matrix.nrows(), matrix.ncols()], data }
    }

    /// A line of text.
    pub fn text(text: impl Into<String>) -> Value {
        Value::Text(vec![text.into()])
    }

    /// A struct of named values.
    pub fn structure(fields: impl IntoIterator<Item = (impl Into<String>, Value)>) -> Value {
        let (fields, items) = fields.into_iter().map(|(name, value)| (name.into(), value)).unzip();
        Value::Struct { dims: vec![1, 1], fields, items }
    }

    /// What it is, in words: `240000 x 1 real`, `text`, `function handle (not read)`.
    pub(crate) fn description(&self) -> String {
        let sized = |dims: &[usize], what: &str| {
            let dims: Vec<_> = dims.iter().map(usize::to_string).collect();
            format!("{} {what}", dims.join(" x "))
        };
        match self {
            Value::Real { dims, .. } => sized(dims, "real"),
            Value::Complex { dims, .. } => sized(dims, "complex"),
            Value::Text(_) => "text".to_owned(),
            Value::Cell { dims, .. } => sized(dims, "cell"),
            Value::Struct { dims, .. } => sized(dims, "struct"),
            Value::Unsupported { class } => format!("{class} (not read)"),
        }
    }
}
