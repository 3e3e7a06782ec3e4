//! A figure as data: drawn on the page, as SVG and written as CSV from the same numbers.

use serde::{Deserialize, Serialize};

/// Key of the measured signal in curves; all other keys are those of [`super::data::DrawnMethod`], or say themselves what they are.
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
    /// Arrangement of the panels.
    pub layout: Layout,
    /// The panels.
    pub panels: Vec<Panel>,
    /// Where a page shows one of several figures at a time: names and values of the choices that lead to this one, for
    /// example `("Output", "y_1")`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choice: Vec<(String, String)>,
}

/// Arrangement of the panels of a figure.
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
    /// Areas behind the curves; they are data as the curves are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<Area>,
    /// Lines for orientation, which are no data.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub guides: Vec<Guide>,
    /// Parts of the horizontal axis that are shaded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shades: Vec<[f64; 2]>,
    /// Whether a unit is as long on one axis as on the other; one range is then widened.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub equal: bool,
    /// Quantity of [`Curve::along`]; without a label where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Axis>,
    /// Height over that of a usual panel of the figure; 1 where it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
}

/// The area between two curves.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// Key of a method, which gives the colour.
    pub method: String,
    /// Added to the label of the method, for example "95 %"; mostly not empty, which distinguishes it from the curve.
    pub note: String,
    /// Where; ascending.
    pub x: Vec<f64>,
    /// Lower edge, NaN where the area is open below.
    #[serde(deserialize_with = "super::numbers::many")]
    pub low: Vec<f64>,
    /// Upper edge, NaN where there is no area.
    #[serde(deserialize_with = "super::numbers::many")]
    pub high: Vec<f64>,
}

/// A line for orientation: a circle, a level, a line of a grid.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Guide {
    /// What it is.
    pub kind: GuideKind,
    /// Where.
    pub x: Vec<f64>,
    /// Where.
    pub y: Vec<f64>,
    /// What it says; may be empty. It is left out where there is no room.
    pub label: String,
    /// Middle of the label, in the values of both axes; the place of a point.
    pub at: [f64; 2],
}

/// How a line for orientation is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GuideKind {
    /// As the grid.
    #[default]
    Grid,
    /// A boundary, for example of stability.
    Boundary,
    /// A level or place, dashed.
    Level,
    /// A dot with its label beside it; it has no line.
    Point,
}

/// One axis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Quantity.
    pub label: String,
    /// Unit as in [`youla::signal::Channel`], empty for a pure number.
    pub unit: String,
    /// What is shown at first; all where it is absent. Points beyond a vertical range are drawn at its edge.
    pub range: Option<[f64; 2]>,
    /// Logarithmic.
    pub log: bool,
    /// The same quantity in another unit, written at the opposite edge; a horizontal axis only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub also: Option<OtherUnit>,
}

/// A second unit of an axis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherUnit {
    /// Quantity.
    pub label: String,
    /// Unit.
    pub unit: String,
    /// Value in this unit over that in the unit of the axis.
    pub factor: f64,
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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    #[serde(deserialize_with = "super::numbers::many")]
    pub y: Vec<f64>,
    /// What else belongs to each point and is written beside it, for example the frequency along a locus; mostly empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub along: Vec<f64>,
    /// What the page says of each point in place of its values; mostly empty. Lines of text are separated by `\n`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub details: Vec<String>,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drawn {
    /// Joined by a line.
    #[default]
    Line,
    /// Points; what is beyond the range or has no value stands at the edge.
    Points,
    /// Few large filled points; none beyond the range.
    Dots,
    /// Few large outlined points; none beyond the range.
    Marks,
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
    #[serde(deserialize_with = "super::numbers::many")]
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
    /// What is in it.
    pub text: String,
    /// More, shown on demand.
    pub detail: String,
}
