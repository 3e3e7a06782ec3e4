//! A figure as data: drawn on the page, as SVG and written as CSV from the same numbers.

use serde::{Deserialize, Serialize};

/// Key of the measured signal in curves; all other keys are those of [`super::data::Method`].
pub const MEASURED: &str = "measured";

/// One figure of one or more panels.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Name of its files, without ending, and its anchor on the page.
    pub key: String,
    /// Title, for example "Figure 4".
    pub title: String,
    /// What is shown, in one sentence.
    pub caption: String,
    /// How the panels stand.
    pub layout: Layout,
    /// The panels.
    pub panels: Vec<Panel>,
}

/// How the panels of a figure stand.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// Below each other, with one common horizontal axis.
    #[default]
    Stacked,
    /// Beside each other.
    Beside,
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Title, for example "horizontal".
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn.
    pub content: Content,
}

/// One axis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Quantity.
    pub label: String,
    /// Unit as in [`crate::units::Channel`], empty for a pure number.
    pub unit: String,
    /// What is shown at first; all where it is absent. Points beyond a vertical range are drawn at its edge.
    pub range: Option<[f64; 2]>,
    /// Logarithmic.
    pub log: bool,
}

/// What a panel draws.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Content {
    /// Curves and clouds of points over a number.
    Curves(Vec<Curve>),
    /// One box with its points per method.
    Boxes(Vec<Sample>),
    /// A map of cells.
    Cells(Cells),
}

impl Default for Content {
    fn default() -> Self {
        Content::Curves(Vec::new())
    }
}

/// One curve or cloud of points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Key of a method, or [`MEASURED`].
    pub method: String,
    /// Added to the label of the method, for example "median"; mostly empty.
    pub note: String,
    /// Line or points.
    pub drawn: Drawn,
    /// Where; ascending for a line.
    pub x: Vec<f64>,
    /// Values, NaN where there is none: a gap in a line; in a cloud a point of its own shape at the lower edge, as for a
    /// model that could not be identified.
    #[serde(with = "super::numbers")]
    pub y: Vec<f64>,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drawn {
    /// Joined by a line.
    Line,
    /// Points.
    Points,
}

/// The values behind one box: median, quartiles, whiskers to the last values within 1.5 quartile ranges, points beyond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// Key of a method.
    pub method: String,
    /// Added to the label of the method; mostly empty.
    pub note: String,
    /// All values, NaN where there is none.
    #[serde(with = "super::numbers")]
    pub values: Vec<f64>,
}

/// A map: one cell per row and column.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cells {
    /// Labels along the horizontal axis.
    pub columns: Vec<String>,
    /// Labels along the vertical axis, from below.
    pub rows: Vec<String>,
    /// The cells, rows from below, each from the left.
    pub cells: Vec<Cell>,
}

/// One cell of a map.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Key of the winning method, which gives the colour; empty where none wins.
    pub method: String,
    /// Strength of the colour, 0 to 1.
    pub strength: f64,
    /// What stands in it.
    pub text: String,
    /// More, shown on demand.
    pub detail: String,
}
