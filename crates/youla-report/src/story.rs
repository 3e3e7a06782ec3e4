//! A page: sections of text, tables and figures in order.

use super::data::DrawnMethod;
use super::figure::Figure;
use serde::{Deserialize, Serialize};

/// Everything on the page.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Story {
    /// Title.
    pub title: String,
    /// What this is, in one or two sentences.
    pub summary: String,
    /// Program and version.
    pub program: String,
    /// Methods in the order in which they are listed and drawn; they decide colours and markers.
    pub methods: Vec<DrawnMethod>,
    /// The sections in order.
    pub sections: Vec<Section>,
}

/// One section.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Anchor on the page.
    pub key: String,
    /// Heading.
    pub title: String,
    /// Entry in the list of sections, short.
    pub short: String,
    /// Contents in order.
    pub blocks: Vec<Block>,
}

/// One block of a section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Block {
    /// A paragraph of plain text.
    Text(String),
    /// Points, each a sentence.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// A figure.
    Figure(Figure),
    /// Text as it is, in a fixed-width face, folded away under its title.
    Listing {
        /// What it is.
        title: String,
        /// The text.
        text: String,
    },
}

/// A table of text and numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Name of its CSV file, without ending, and its anchor.
    pub key: String,
    /// Title, for example "Table 1".
    pub title: String,
    /// What it shows.
    pub caption: String,
    /// Names of groups of columns above the header, each with its number of columns; empty where there are none. The first
    /// group starts at the first column.
    pub groups: Vec<(String, usize)>,
    /// Column headings.
    pub header: Vec<String>,
    /// The rows.
    pub rows: Vec<TableRow>,
}

/// One row of a table.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRow {
    /// Key of the method that the row is about, for its colour; empty for none.
    pub method: String,
    /// As the text of the first column, then one text per further column. Those that are numbers are to the right.
    pub cells: Vec<String>,
}

/// A section; `short` is its entry in the list of sections.
pub fn section(key: &str, title: &str, short: &str, blocks: Vec<Block>) -> Section {
    Section { key: key.into(), title: title.into(), short: short.into(), blocks }
}

/// A table without groups of columns.
pub fn plain(key: &str, title: &str, caption: impl Into<String>, header: &[&str], rows: Vec<TableRow>) -> Table {
    Table {
        key: key.into(),
        title: title.into(),
        caption: caption.into(),
        groups: Vec::new(),
        header: header.iter().map(|h| (*h).into()).collect(),
        rows,
    }
}
