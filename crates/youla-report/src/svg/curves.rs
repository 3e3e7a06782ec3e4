//! Lines and clouds of points.
//!
//! What a cloud has beyond the range of the vertical axis stands in a strip at that edge of the frame, one row per cloud:
//! triangles for values beyond, crosses at the lower edge where there is no value.

use super::canvas::{Canvas, Frame, GRID, Paint};
use super::legend::Legend;
use super::lines;
use super::path::Path;
use super::scale::{Place, Scale};
use super::style::{Marker, Styles};
use crate::figure::{Curve, Drawn};

/// Half-width of a point, and the height of a row of the strips.
pub(super) const POINT: f64 = 1.0;
const ROW: f64 = 4.2;
/// Between the range and the first row.
const GAP: f64 = 1.2;
/// Half-width of a large point.
pub(super) const LARGE: f64 = 1.9;
/// Points of more than this number are smaller.
const MANY: usize = 1000;

/// The clouds that have something at an edge, by their place among the curves.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Strips {
    below: Vec<usize>,
    above: Vec<usize>,
}

impl Strips {
    pub(super) fn of(curves: &[Curve], x: &Scale, y: &Scale) -> Self {
        let clouds = |wanted: fn(Place) -> bool| {
            let has = |curve: &Curve| points(curve, x).any(|(_, value)| wanted(y.place(value)));
            (0..curves.len()).filter(|&k| curves[k].drawn == Drawn::Points && has(&curves[k])).collect()
        };
        Strips {
            below: clouds(|place| matches!(place, Place::Below | Place::Missing)),
            above: clouds(|place| place == Place::Above),
        }
    }

    /// Heights of the strips at the lower and the upper edge.
    pub(super) fn heights(&self) -> (f64, f64) {
        let height = |rows: &[usize]| if rows.is_empty() { 0.0 } else { ROW * rows.len() as f64 + GAP };
        (height(&self.below), height(&self.above))
    }

    fn row_below(&self, cloud: usize, frame: Frame) -> f64 {
        let row = self.below.iter().position(|&k| k == cloud).unwrap_or(0);
        frame.bottom() - self.heights().0 + GAP + ROW * (row as f64 + 0.5)
    }

    fn row_above(&self, cloud: usize, frame: Frame) -> f64 {
        let row = self.above.iter().position(|&k| k == cloud).unwrap_or(0);
        frame.top + self.heights().1 - GAP - ROW * (row as f64 + 0.5)
    }
}

/// Points of a curve whose place along the horizontal axis is shown.
pub(super) fn points<'a>(curve: &'a Curve, x: &'a Scale) -> impl Iterator<Item = (f64, f64)> + 'a {
    curve.x.iter().zip(&curve.y).filter_map(|(&at, &value)| match x.place(at) {
        Place::Inside(at) => Some((at, value)),
        _ => None,
    })
}

/// Values of all curves that are drawn, along one axis.
pub(super) fn values(curves: &[Curve], of: fn(&Curve) -> &[f64]) -> impl Iterator<Item = f64> {
    curves.iter().flat_map(of).copied()
}

/// Draws clouds, then lines; `y` spans the frame less its strips.
pub(super) fn draw(
    canvas: &mut Canvas,
    curves: &[Curve],
    (x, y): (&Scale, &Scale),
    frame: Frame,
    (styles, legend): (&Styles, &Legend),
) {
    let strips = Strips::of(curves, x, y);
    draw_edges(canvas, &strips, frame);
    for (cloud, curve) in curves.iter().enumerate().filter(|(_, curve)| curve.drawn == Drawn::Points) {
        draw_cloud(canvas, cloud, curve, (x, y), frame, &strips, (styles, legend));
    }
    draw_lines(canvas, curves, (x, y), frame, &strips, (styles, legend));
    for curve in curves.iter().filter(|curve| matches!(curve.drawn, Drawn::Dots | Drawn::Marks)) {
        let style = styles.of(&curve.method);
        let marker = if curve.drawn == Drawn::Dots { style.marker.solid() } else { style.marker };
        let mut path = Path::default();
        for (at, value) in points(curve, x) {
            if let Place::Inside(height) = y.place(value) {
                marker.add(&mut path, (at, height), LARGE);
            }
        }
        let paint = marker.large(style.colour, curve.drawn == Drawn::Dots);
        canvas.path(path, &Paint { of: Some((&curve.method, "marks")), ..paint });
    }
}

fn draw_lines(
    canvas: &mut Canvas,
    curves: &[Curve],
    (x, y): (&Scale, &Scale),
    frame: Frame,
    strips: &Strips,
    (styles, legend): (&Styles, &Legend),
) {
    let (below, above) = strips.heights();
    let inner = Frame { top: frame.top + above, height: frame.height - below - above, ..frame };
    for curve in curves.iter().filter(|curve| curve.drawn == Drawn::Line) {
        let style = styles.of(&curve.method);
        let dash = styles.dash(&curve.method, legend.nth_line(&curve.method, &curve.note));
        let paint = Paint {
            stroke: style.colour,
            width: style.width,
            dash,
            of: Some((&curve.method, "line")),
            ..Paint::default()
        };
        canvas.path(lines::path(curve, x, y, inner, legend.points_per_line()), &paint);
    }
}

fn draw_edges(canvas: &mut Canvas, strips: &Strips, frame: Frame) {
    let (below, above) = strips.heights();
    let paint = Paint { stroke: GRID, width: 0.6, ..Paint::default() };
    for (height, y) in [(below, frame.bottom() - below), (above, frame.top + above)] {
        if height > 0.0 {
            canvas.line((frame.left, y), (frame.right(), y), &paint);
        }
    }
}

fn draw_cloud(
    canvas: &mut Canvas,
    cloud: usize,
    curve: &Curve,
    (x, y): (&Scale, &Scale),
    frame: Frame,
    strips: &Strips,
    (styles, legend): (&Styles, &Legend),
) {
    let style = styles.of(&curve.method);
    let [mut inside, mut beyond, mut missing] = [(); 3].map(|()| Path::default());
    let size = if curve.x.len() > MANY { 0.65 * POINT } else { POINT };
    for (at, value) in points(curve, x) {
        match y.place(value) {
            Place::Inside(height) => style.marker.add(&mut inside, (at, height), size),
            Place::Below => Marker::Down.add(&mut beyond, (at, strips.row_below(cloud, frame)), 1.4),
            Place::Above => Marker::Up.add(&mut beyond, (at, strips.row_above(cloud, frame)), 1.4),
            Place::Missing => Marker::Cross.add(&mut missing, (at, strips.row_below(cloud, frame)), 1.2),
        }
    }
    let hollow = legend.nth_cloud(&curve.method, &curve.note) > 0;
    let mut paint = style.marker.paint(style.colour, hollow);
    paint.width *= size / POINT;
    for (path, paint, kind) in [
        (inside, paint, "points"),
        (beyond, Marker::Down.paint(style.colour, hollow), "beyond"),
        (missing, Marker::Cross.paint(style.colour, false), "missing"),
    ] {
        canvas.path(path, &Paint { of: Some((&curve.method, kind)), ..paint });
    }
}
