//! What is behind the curves of a panel: shaded parts, areas between curves, lines for orientation.

use super::canvas::{Canvas, Frame, GRID, INK, Paint, SOFT};
use super::lines::joined;
use super::path::Path;
use super::scale::{Place, Scale};
use super::style::Styles;
use super::text::{self, REMARK};
use crate::figure::{Area, Guide, GuideKind, Panel};

/// Opacity of an area.
pub(super) const REGION: f64 = 0.22;
/// Half-width of the dot of a point.
const DOT: f64 = 1.3;
const SHADE: &str = "#eef2f6";

/// All values of the areas, for the scale of the vertical axis.
pub(super) fn values(panel: &Panel) -> impl Iterator<Item = f64> {
    panel.regions.iter().flat_map(|region| region.low.iter().chain(&region.high)).copied()
}

/// Shaded parts, below the grid.
pub(super) fn draw_shades(canvas: &mut Canvas, panel: &Panel, x: &Scale, frame: Frame) {
    for ends in &panel.shades {
        let [left, right] = ends.map(|end| x.at(end).clamp(frame.left, frame.right()));
        if right > left {
            let part = Frame { left, width: right - left, ..frame };
            canvas.rectangle(part, &Paint { fill: SHADE, ..Paint::default() });
        }
    }
}

/// Areas and lines, below the curves.
pub(super) fn draw(canvas: &mut Canvas, panel: &Panel, (x, y): (&Scale, &Scale), frame: Frame, styles: &Styles) {
    for region in &panel.regions {
        let fill = styles.of(&region.method).colour;
        let paint = Paint { fill, opacity: Some(REGION), of: Some((&region.method, "region")), ..Paint::default() };
        canvas.path(area(region, x, y, frame), &paint);
    }
    for guide in &panel.guides {
        let places = guide.x.iter().zip(&guide.y).map(|(a, b)| (x.at(*a), y.at(*b)));
        canvas.path(joined(places, frame), &paint(guide.kind));
    }
}

fn paint(kind: GuideKind) -> Paint<'static> {
    let (stroke, width, dash): (_, _, &[f64]) = match kind {
        GuideKind::Grid => (GRID, 0.5, &[]),
        GuideKind::Boundary => (INK, 0.7, &[]),
        GuideKind::Level | GuideKind::Point => (SOFT, 0.6, &[3.0, 2.0]),
    };
    Paint { stroke, width, dash, ..Paint::default() }
}

/// The labels of the lines, above the curves, as far as they are within the frame and clear of each other.
pub(super) fn draw_labels(canvas: &mut Canvas, guides: &[Guide], (x, y): (&Scale, &Scale), frame: Frame) {
    let mut taken: Vec<Frame> = Vec::new();
    for guide in guides.iter().filter(|guide| !guide.label.is_empty()) {
        let (Place::Inside(across), Place::Inside(up)) = (x.place(guide.at[0]), y.place(guide.at[1])) else { continue };
        let (width, height) = (text::width(&guide.label, REMARK) + 3.0, REMARK + 1.0);
        // Beside its dot.
        let dot = (across, up);
        let is_point = guide.kind == GuideKind::Point;
        let (across, up) = if is_point { (across + width / 2.0 + 2.0, up - height / 2.0) } else { dot };
        // Beside an edge it moves inwards.
        let across = across.min(frame.right() - width / 2.0).max(frame.left + width / 2.0);
        let place = Frame { left: across - width / 2.0, top: up - height / 2.0, width, height };
        let within = place.left >= frame.left
            && place.right() <= frame.right()
            && place.top >= frame.top
            && place.bottom() <= frame.bottom();
        let clear = |other: &Frame| {
            place.right() <= other.left
                || place.left >= other.right()
                || place.bottom() <= other.top
                || place.top >= other.bottom()
        };
        if within && taken.iter().all(clear) {
            if is_point {
                let mut path = Path::default();
                path.circle(dot, DOT);
                canvas.path(path, &Paint { fill: INK, ..Paint::default() });
            }
            canvas.text_on_lines(&guide.label, across, up + 0.33 * REMARK, REMARK);
            taken.push(place);
        }
    }
}

/// The area within the frame, one polygon per piece without gaps; down to the frame where it is open below.
fn area(region: &Area, x: &Scale, y: &Scale, frame: Frame) -> Path {
    let inside = |across: f64, up: f64| {
        (x.at(across).clamp(frame.left, frame.right()), y.at(up).clamp(frame.top, frame.bottom()))
    };
    let edges: Vec<(f64, [f64; 2])> =
        region.x.iter().zip(region.low.iter().zip(&region.high)).map(|(x, (low, high))| (*x, [*low, *high])).collect();
    let known = |(across, [_, high]): &(f64, [f64; 2])| x.at(*across).is_finite() && y.at(*high).is_finite();
    let mut path = Path::default();
    for piece in edges.split(|edge| !known(edge)).filter(|piece| piece.len() > 1) {
        let upper = piece.iter().map(|(across, [_, high])| inside(*across, *high));
        let lower = piece.iter().rev().map(|(across, [low, high])| match y.at(*low).is_finite() {
            true => inside(*across, *low),
            false => (inside(*across, *high).0, frame.bottom()),
        });
        path.polygon(upper.chain(lower));
    }
    path
}
