//! A figure as SVG for print.
//!
//! | file | holds |
//! |---|---|
//! | `layout` | where the panels are |
//! | `panel` | scales and axes of one panel |
//! | `curves`, `lines` | lines and clouds of points |
//! | `boxes`, `spread` | box plots and what they show |
//! | `cells` | maps |
//! | `ground` | areas, shades and lines behind curves |
//! | `legend`, `style` | which method is which |
//! | `scale`, `ticks`, `text` | places, numbers and names |
//! | `font` | the font, its widths |
//! | `canvas`, `path` | the document |

mod boxes;
mod canvas;
mod cells;
mod curves;
mod font;
mod ground;
mod layout;
mod legend;
mod lines;
mod panel;
mod path;
mod scale;
mod spread;
mod style;
#[cfg(test)]
mod tests;
mod text;
mod ticks;

pub(crate) use style::{Marker, Styles};
pub use text::pretty_unit;

use super::data::DrawnMethod;
use super::figure::{Content, Figure, Panel};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Size of a figure on paper. Text has 9 points in every size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Print {
    /// Width, cm, 4 to 100.
    pub width_cm: f64,
    /// Height, cm, up to 200; what the panels ask for where it is absent.
    pub height_cm: Option<f64>,
    /// Whether the file holds its font; without it the reader's program takes a similar one.
    pub embed_font: bool,
}

impl Default for Print {
    fn default() -> Self {
        Print { width_cm: 17.0, height_cm: None, embed_font: true }
    }
}

/// Draws a figure as an SVG file for print: 170 mm wide, text of 9 points, white paper, with its font in it.
///
/// Colours, dashes and markers belong to the methods in the order of `methods`, as on the page; title and caption are in
/// the file, for readers and programs that list figures, but not drawn. What cannot be drawn in place is not lost:
///
/// - A line has gaps where it has no value and ends at the edge of the range. Of a line of more than 4000 points the
///   minimum and the maximum per bucket are drawn; fewer where a figure has more than eight lines.
/// - A point beyond the range of the vertical axis is a triangle, and one without a value a cross, in a strip at the edge
///   of the frame.
/// - Below a box stands how many values are NaN ("failed") or beyond the range. Quartiles are interpolated linearly
///   between the sorted values; whiskers reach to the last value within 1.5 quartile ranges.
/// - A cell of strength 1 has 70 % of the colour, so that the text on it stays legible.
///
/// The same figure gives the same bytes.
///
/// # Errors
/// [`youla::Error::Shape`] where a curve has not as many places as values or a map not as many cells as its rows and columns
/// say, [`youla::Error::OutOfRange`] where the range of an axis is not one.
///
/// ```
/// use youla_report::data::DrawnMethod;
/// use youla_report::figure::{Content, Curve, Drawn, Figure, Panel};
/// let curve = Curve {
///     method: "hansen".into(),
///     note: String::new(),
///     drawn: Drawn::Line,
///     x: vec![0.0, 0.5, 1.0],
///     y: vec![90.0, f64::NAN, 80.0],
///     ..Curve::default()
/// };
/// let panel = Panel { content: Content::Curves(vec![curve]), ..Panel::default() };
/// let figure = Figure { panels: vec![panel], ..Figure::default() };
/// let file = youla_report::svg(&figure, &[DrawnMethod::hansen()])?;
/// assert!(file.starts_with("<svg") && file.contains("Hansen G(S)"));
/// # Ok::<(), youla_report::Error>(())
/// ```
pub fn svg(figure: &Figure, methods: &[DrawnMethod]) -> Result<String> {
    svg_for(figure, methods, &Print::default())
}

/// The same in another size or without the font.
///
/// # Errors
/// Those of [`svg()`]; [`youla::Error::OutOfRange`] for a size without room for the panels and their labels.
///
/// ```
/// use youla_report::{Figure, Print, figure::Panel, svg_for};
/// let figure = Figure { panels: vec![Panel::default()], ..Figure::default() };
/// let print = Print { width_cm: 8.5, height_cm: Some(6.0), ..Print::default() };
/// assert!(svg_for(&figure, &[], &print)?.contains("height=\"60mm\""));
/// # Ok::<(), youla_report::Error>(())
/// ```
pub fn svg_for(figure: &Figure, methods: &[DrawnMethod], print: &Print) -> Result<String> {
    let size = |side: &str, value: f64, range: std::ops::RangeInclusive<f64>, must| match range.contains(&value) {
        true => Ok(()),
        false => Err(Error::Method(youla::Error::OutOfRange {
            what: format!("the {side} of the figure in cm"),
            value,
            must,
        })),
    };
    size("width", print.width_cm, 4.0..=100.0, "between 4 and 100")?;
    print.height_cm.map_or(Ok(()), |height| size("height", height, 1.0..=200.0, "between 1 and 200"))?;
    for panel in &figure.panels {
        check(panel)?;
    }
    layout::draw(figure, &style::Styles::new(methods), print)
}

fn check(panel: &Panel) -> Result<()> {
    let shape = |what: String, expected, found| {
        if expected == found { Ok(()) } else { Err(Error::Method(youla::Error::Shape { what, expected, found })) }
    };
    let part = |what: &str| format!("{what} of the panel {:?}", panel.title);
    scale::check(&panel.x, &part("horizontal axis"))?;
    scale::check(&panel.y, &part("vertical axis"))?;
    for region in &panel.regions {
        for edge in [&region.low, &region.high] {
            shape(part(&format!("an edge of the area {:?}", region.method)), (region.x.len(), 1), (edge.len(), 1))?;
        }
    }
    match &panel.content {
        Content::Curves(curves) => curves.iter().try_for_each(|curve| {
            let what = part(&format!("the values of the curve {:?}", curve.method));
            shape(what, (curve.x.len(), 1), (curve.y.len(), 1))
        }),
        Content::Boxes(_) => Ok(()),
        Content::Cells(map) => {
            let cells = map.rows.len() * map.columns.len();
            shape(part("the list of cells"), (cells, 1), (map.cells.len(), 1))
        }
    }
}
