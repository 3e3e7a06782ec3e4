//! How a channel is chosen: by name or by column number, never by guessing.

use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;
use youla::signal::unknown;

/// A column of a file.
///
/// In text `#3` is the third column (counted from 1) and everything else is a name; in TOML and JSON an integer is a
/// column number too.
///
/// ```
/// use youla_io::ChannelRef;
/// assert_eq!("#3".parse(), Ok(ChannelRef::Column(3)));
/// assert_eq!("3".parse(), Ok(ChannelRef::Name("3".into())));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub enum ChannelRef {
    /// By name: the header of a text file, the path of a MATLAB variable, the name of a NumPy array.
    Name(String),
    /// By the number of its column, counted from 1.
    Column(usize),
}

/// A channel of the record and its column in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelSpec {
    /// Name in the record.
    pub name: String,
    /// Its column in the file; by default the column of the same name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<ChannelRef>,
    /// Unit label such as `um` or `V`.
    #[serde(default)]
    pub unit: String,
    /// Of an output that was interpolated: step of the samples of its own clock, seconds (`youla synchronise` prints it); the error of the
    /// interpolation is in the region.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampled_every: Option<f64>,
}

impl ChannelSpec {
    /// A channel that has the same name in file and record, without a unit.
    pub fn named(name: impl Into<String>) -> Self {
        ChannelSpec { name: name.into(), from: None, unit: String::new(), sampled_every: None }
    }

    /// A channel from another place in the file.
    pub fn from(name: impl Into<String>, from: ChannelRef, unit: impl Into<String>) -> Self {
        ChannelSpec { name: name.into(), from: Some(from), unit: unit.into(), sampled_every: None }
    }

    /// Channels under the names or numbers by which they are chosen, without units.
    pub fn chosen(columns: &[ChannelRef]) -> Vec<Self> {
        columns.iter().map(|c| ChannelSpec::from(c.to_string(), c.clone(), "")).collect()
    }

    /// The column of the channel in the file.
    pub fn source(&self) -> ChannelRef {
        self.from.clone().unwrap_or_else(|| ChannelRef::Name(self.name.clone()))
    }
}

impl ChannelRef {
    /// Index, counted from 0, among the columns of a file.
    ///
    /// # Errors
    /// [`youla::Error::UnknownChannel`] with the known names, or the known numbers where there are no names.
    pub(super) fn index(&self, what: &str, names: &[String]) -> Result<usize> {
        let found = match self {
            ChannelRef::Name(name) => names.iter().position(|n| n == name),
            ChannelRef::Column(number) => number.checked_sub(1).filter(|&j| j < names.len()),
        };
        found.ok_or_else(|| unknown(what, &self.to_string(), names.to_vec()).into())
    }
}

impl FromStr for ChannelRef {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let number = text.strip_prefix('#').and_then(|digits| digits.parse().ok());
        Ok(number.map_or_else(|| ChannelRef::Name(text.to_owned()), ChannelRef::Column))
    }
}

impl fmt::Display for ChannelRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ChannelRef::Name(name) => f.write_str(name),
            ChannelRef::Column(number) => write!(f, "#{number}"),
        }
    }
}

/// The form in configuration files.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "expected a name, or the number of a column")]
enum Written {
    /// Number of a column, counted from 1.
    Column(usize),
    /// Name of a column or variable; `#3` is the third column.
    Text(String),
}

impl schemars::JsonSchema for ChannelRef {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "ChannelRef".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Written::json_schema(generator)
    }
}

impl From<Written> for ChannelRef {
    fn from(written: Written) -> Self {
        match written {
            Written::Column(number) => ChannelRef::Column(number),
            Written::Text(text) => match text.parse() {
                Ok(reference) => reference,
                Err(never) => match never {},
            },
        }
    }
}

impl From<ChannelRef> for Written {
    fn from(reference: ChannelRef) -> Self {
        match reference {
            ChannelRef::Column(number) => Written::Column(number),
            ChannelRef::Name(name) => Written::Text(name),
        }
    }
}
