//! What the script of a page reads: figures, where each of them is drawn, and the styles of all that they name.

use super::data::DrawnMethod;
use super::figure::{Content, Figure};
use super::page::ALL_POINTS;
use super::svg::{Marker, Styles};
use super::thin;
use serde::Serialize;
use std::collections::BTreeMap;

/// The data of a page.
#[derive(Serialize)]
pub(super) struct Drawings<'a> {
    styles: BTreeMap<&'a str, PageStyle<'a>>,
    /// Name of the place of each figure.
    hosts: Vec<String>,
    figures: Vec<Figure>,
}

/// Name, colour, line and marker of a method or of what else a curve is.
#[derive(Serialize)]
struct PageStyle<'a> {
    label: String,
    /// Custom property of the style sheet.
    colour: &'a str,
    width: f64,
    dash: &'a [f64],
    marker: Marker,
    order: usize,
}

/// Figures with as many points as a page takes, each with the name of its place.
pub(super) fn drawings<'a>(methods: &'a [DrawnMethod], figures: &'a [(String, Figure)]) -> Drawings<'a> {
    let most = thin::most_points(figures.iter().map(|(_, figure)| figure), ALL_POINTS);
    let styles = Styles::new(methods);
    let style = |key: &'a str| {
        let style = styles.of(key);
        let (label, order) = (styles.name(key, ""), styles.order(key).min(methods.len() + 1));
        let page = PageStyle {
            label,
            colour: style.property,
            width: style.width,
            dash: style.dash,
            marker: style.marker,
            order,
        };
        (key, page)
    };
    let keys = methods.iter().map(|method| method.key.as_str()).chain(figures.iter().flat_map(|(_, f)| named(f)));
    Drawings {
        styles: keys.map(style).collect(),
        hosts: figures.iter().map(|(host, _)| host.clone()).collect(),
        figures: figures.iter().map(|(_, figure)| thin::for_drawing(figure, most)).collect(),
    }
}

/// Methods, and what else gives a colour, in a figure.
fn named(figure: &Figure) -> impl Iterator<Item = &str> {
    figure.panels.iter().flat_map(|panel| {
        let content: Vec<&str> = match &panel.content {
            Content::Curves(curves) => curves.iter().map(|curve| curve.method.as_str()).collect(),
            Content::Boxes(samples) => samples.iter().map(|sample| sample.method.as_str()).collect(),
            Content::Cells(cells) => cells.cells.iter().map(|cell| cell.method.as_str()).collect(),
        };
        content.into_iter().chain(panel.regions.iter().map(|region| region.method.as_str()))
    })
}
