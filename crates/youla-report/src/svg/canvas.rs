//! Where everything is drawn: one SVG document in points, y downwards, coordinates to a hundredth.

use ::svg::Document;
use ::svg::node::element::{self, Element};
use ::svg::node::{Node, Value};

use super::font;
use super::path::{Path, hundredths, number, place};

/// Ink of text and frames, and of the grid.
pub(super) const INK: &str = "#16191d";
pub(super) const SOFT: &str = "#59616b";
pub(super) const GRID: &str = "#e3e6e9";

/// Points per millimetre.
pub(super) const PER_MM: f64 = 72.0 / 25.4;

/// A rectangle on the page.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Frame {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// Which end of a text is at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// How a shape is painted; empty colours are left out.
#[derive(Debug, Clone, Default)]
pub(super) struct Paint<'a> {
    pub(super) fill: &'a str,
    pub(super) stroke: &'a str,
    pub(super) width: f64,
    pub(super) dash: &'a [f64],
    /// Of the filling, 0 to 1; without one it is opaque.
    pub(super) opacity: Option<f64>,
    /// Kept in the file, so that a curve can be found: method and kind of shape.
    pub(super) of: Option<(&'a str, &'static str)>,
}

/// The document.
pub(super) struct Canvas {
    document: Document,
}

impl Canvas {
    pub(super) fn new(title: &str, description: &str, embed_font: bool) -> Self {
        let mut document = Document::new().set("font-family", font::FACES).set("role", "img");
        document.append(element::Title::new(clean(title)));
        document.append(element::Description::new().add(::svg::node::Text::new(clean(description))));
        if embed_font {
            let mut style = Element::new("style");
            style.append(::svg::node::Text::new(font::embedded()));
            document.append(style);
        }
        document.append(Element::new("rect").painted_white());
        Canvas { document }
    }

    /// The file, `width` times `height` points.
    pub(super) fn finish(self, width: f64, height: f64) -> String {
        let millimetres = |points: f64| format!("{}mm", number(hundredths(points / PER_MM)));
        let document = self
            .document
            .set("width", millimetres(width))
            .set("height", millimetres(height))
            .set("viewBox", format!("0 0 {} {}", number(hundredths(width)), number(hundredths(height))));
        format!("{document}\n")
    }

    /// A line of text on the base line `y`.
    pub(super) fn text(&mut self, text: &str, x: f64, y: f64, size: f64, anchor: Anchor) {
        if !text.is_empty() {
            self.document.append(text_node(text, size, anchor).with("x", place(x)).with("y", place(y)));
        }
    }

    /// The same in the middle and with the paper around it, to be on lines.
    pub(super) fn text_on_lines(&mut self, text: &str, x: f64, y: f64, size: f64) {
        let node = text_node(text, size, Anchor::Middle).with("stroke", "#ffffff").with("stroke-width", "2");
        let node = node.with("paint-order", "stroke").with("stroke-linejoin", "round").with("fill", SOFT);
        self.document.append(node.with("x", place(x)).with("y", place(y)));
    }

    /// A line of text that reads upwards.
    pub(super) fn text_upwards(&mut self, text: &str, x: f64, y: f64, size: f64, anchor: Anchor) {
        let turned = format!("translate({},{}) rotate(-90)", place(x), place(y));
        self.document.append(text_node(text, size, anchor).with("transform", turned));
    }

    /// A straight line.
    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), paint: &Paint) {
        let mut path = Path::default();
        path.move_to(from);
        path.line_to(to);
        self.path(path, paint);
    }

    /// A rectangle.
    pub(super) fn rectangle(&mut self, frame: Frame, paint: &Paint) {
        let node = Element::new("rect")
            .with("x", place(frame.left))
            .with("y", place(frame.top))
            .with("width", place(frame.width))
            .with("height", place(frame.height));
        self.document.append(painted(node, paint));
    }

    /// Any shape; nothing where it is empty.
    pub(super) fn path(&mut self, path: Path, paint: &Paint) {
        if !path.data().is_empty() {
            self.document.append(painted(Element::new("path").with("d", path.data()), paint));
        }
    }
}

/// Attributes in the manner of the typed elements.
trait With {
    fn with(self, name: &str, value: impl Into<Value>) -> Self;
    fn painted_white(self) -> Self;
}

impl With for Element {
    fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.assign(name, value);
        self
    }

    fn painted_white(self) -> Self {
        self.with("width", "100%").with("height", "100%").with("fill", "#ffffff")
    }
}

/// Not the typed element, which puts the text on a line of its own: some programs draw line ends as spaces.
fn text_node(text: &str, size: f64, anchor: Anchor) -> Element {
    let mut node = Element::new("text").with("font-size", place(size)).with("fill", INK);
    node.append(::svg::node::Text::new(clean(text)));
    match anchor {
        Anchor::Start => node,
        Anchor::Middle => node.with("text-anchor", "middle"),
        Anchor::End => node.with("text-anchor", "end"),
    }
}

fn painted(mut node: Element, paint: &Paint) -> Element {
    node.assign("fill", if paint.fill.is_empty() { "none" } else { paint.fill });
    if let Some(opacity) = paint.opacity {
        node.assign("fill-opacity", place(opacity));
    }
    if !paint.stroke.is_empty() {
        node.assign("stroke", paint.stroke);
        node.assign("stroke-width", place(paint.width));
        node.assign("stroke-linejoin", "round");
    }
    if !paint.dash.is_empty() {
        node.assign("stroke-dasharray", paint.dash.iter().map(|&length| place(length)).collect::<Vec<_>>());
    }
    if let Some((method, kind)) = paint.of {
        node.assign("data-method", clean(method));
        node.assign("data-kind", kind);
    }
    node
}

/// Characters that XML cannot hold are replaced.
fn clean(text: &str) -> String {
    let allowed = |c: char| !(c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'));
    text.chars().map(|c| if allowed(c) || c == '\n' { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_that_xml_forbids_are_replaced() {
        assert_eq!(clean("a\u{0}b\u{1b}"), "a\u{fffd}b\u{fffd}");
    }
}
