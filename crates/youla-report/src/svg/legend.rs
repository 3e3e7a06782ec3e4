//! The one legend of a figure, centred above its panels.

use super::boxes;
use super::canvas::{Anchor, Canvas, Frame, Paint, SOFT};
use super::curves::{LARGE, POINT};
use super::ground::REGION;
use super::path::Path;
use super::style::{Marker, Styles, tint};
use super::text::{self, LABEL};
use crate::figure::{Content, Drawn, Figure};

const ROW: f64 = 13.0;
/// Widths of a line and of a shape before a name.
const LINE: f64 = 22.0;
const SHAPE: f64 = 11.0;
/// Between a swatch and its name, and from one entry to the next.
const GAP: f64 = 4.0;
const APART: f64 = 14.0;

/// Most points of one line, and of all lines of a figure: about nine bytes each keep the file below 400 kB.
const POINTS_PER_LINE: usize = 4000;
const POINTS: usize = 32_000;

/// What is before a name.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Swatch {
    line: bool,
    points: bool,
    dots: bool,
    marks: bool,
    sample: bool,
    cell: bool,
    region: bool,
}

#[derive(Debug, PartialEq)]
struct Entry<'a> {
    method: &'a str,
    note: &'a str,
    swatch: Swatch,
}

/// Entries in the order of the methods; the same method with another note is another entry.
pub(super) struct Legend<'a> {
    entries: Vec<Entry<'a>>,
    lines: usize,
    edge: Edge,
}

/// What the figure has at the edges of its frames.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Edge {
    pub(super) beyond: bool,
    pub(super) missing: bool,
}

impl<'a> Legend<'a> {
    pub(super) fn of(figure: &'a Figure, styles: &Styles, edge: Edge) -> Self {
        let mut legend = Legend { entries: Vec::new(), lines: 0, edge };
        for panel in &figure.panels {
            match &panel.content {
                Content::Curves(curves) => curves.iter().for_each(|curve| {
                    let is = |drawn| curve.drawn == drawn;
                    let (line, points, dots, marks) =
                        (is(Drawn::Line), is(Drawn::Points), is(Drawn::Dots), is(Drawn::Marks));
                    legend.lines += usize::from(line);
                    legend.add(&curve.method, &curve.note, Swatch { line, points, dots, marks, ..Swatch::default() });
                }),
                Content::Boxes(samples) => samples.iter().for_each(|sample| {
                    legend.add(&sample.method, &sample.note, Swatch { sample: true, ..Swatch::default() });
                }),
                Content::Cells(cells) => {
                    cells.cells.iter().filter(|cell| !cell.method.is_empty()).for_each(|cell| {
                        legend.add(&cell.method, "", Swatch { cell: true, ..Swatch::default() });
                    });
                }
            }
        }
        for region in figure.panels.iter().flat_map(|panel| &panel.regions) {
            legend.add(&region.method, &region.note, Swatch { region: true, ..Swatch::default() });
        }
        legend.entries.sort_by_key(|entry| (styles.order(entry.method), !entry.note.is_empty()));
        legend
    }

    fn add(&mut self, method: &'a str, note: &'a str, swatch: Swatch) {
        match self.entries.iter_mut().find(|entry| entry.method == method && entry.note == note) {
            Some(Entry { swatch: known, .. }) => {
                known.line |= swatch.line;
                known.points |= swatch.points;
                known.dots |= swatch.dots;
                known.marks |= swatch.marks;
                known.region |= swatch.region;
                known.sample |= swatch.sample;
                known.cell |= swatch.cell;
            }
            None => self.entries.push(Entry { method, note, swatch }),
        }
    }

    /// How many lines of the same method stand before the one with this note.
    pub(super) fn nth_line(&self, method: &str, note: &str) -> usize {
        let mut lines = self.entries.iter().filter(|entry| entry.method == method && entry.swatch.line);
        lines.position(|entry| entry.note == note).unwrap_or(0)
    }

    /// How many clouds of the same method stand before the one with this note.
    pub(super) fn nth_cloud(&self, method: &str, note: &str) -> usize {
        let mut clouds = self.entries.iter().filter(|entry| entry.method == method && entry.swatch.points);
        clouds.position(|entry| entry.note == note).unwrap_or(0)
    }

    /// Most points with which one line of the figure is drawn.
    pub(super) fn points_per_line(&self) -> usize {
        POINTS_PER_LINE.min(POINTS / self.lines.max(1)).max(16)
    }

    /// Draws it from the upper edge on and returns its height.
    pub(super) fn draw(&self, canvas: &mut Canvas, styles: &Styles, page: f64) -> f64 {
        let names: Vec<String> = self.names(styles);
        let widths: Vec<f64> =
            names.iter().enumerate().map(|(k, name)| self.swatch_width(k) + GAP + text::width(name, LABEL)).collect();
        let rows = rows(&widths, page);
        let mut next = 0;
        for (row, &count) in rows.iter().enumerate() {
            let places = next..next + count;
            let full = widths[places.clone()].iter().sum::<f64>() + APART * (count - 1) as f64;
            let mut left = (page - full) / 2.0;
            for k in places {
                let base = ROW * (row as f64 + 1.0) - 3.5;
                let width = self.swatch_width(k);
                self.draw_swatch(canvas, k, styles, Frame { left, top: base - 6.5, width, height: 7.0 });
                canvas.text(&names[k], left + width + GAP, base, LABEL, Anchor::Start);
                left += widths[k] + APART;
            }
            next += count;
        }
        ROW * rows.len() as f64 + if rows.is_empty() { 0.0 } else { 3.0 }
    }

    fn swatch_width(&self, k: usize) -> f64 {
        if self.entries.get(k).is_some_and(|entry| entry.swatch.line) { LINE } else { SHAPE }
    }

    fn names(&self, styles: &Styles) -> Vec<String> {
        let methods = self.entries.iter().map(|entry| styles.name(entry.method, entry.note));
        let beyond = self.edge.beyond.then(|| "beyond the range".to_owned());
        let missing = self.edge.missing.then(|| "no value".to_owned());
        methods.chain(beyond).chain(missing).collect()
    }

    fn draw_swatch(&self, canvas: &mut Canvas, k: usize, styles: &Styles, frame: Frame) {
        let middle = (frame.left + frame.width / 2.0, frame.top + frame.height / 2.0);
        let Some(Entry { method, note, swatch }) = self.entries.get(k) else {
            let beyond = self.edge.beyond && k == self.entries.len();
            let marker = if beyond { Marker::Down } else { Marker::Cross };
            return draw_marker(canvas, marker, middle, 1.8, &marker.paint(SOFT, false));
        };
        let style = styles.of(method);
        let area = Frame { left: frame.right() - SHAPE, width: SHAPE, ..frame };
        if swatch.cell {
            canvas.rectangle(area, &Paint { fill: &tint(style.colour, 1.0), ..Paint::default() });
        }
        if swatch.region {
            canvas.rectangle(area, &Paint { fill: style.colour, opacity: Some(REGION), ..Paint::default() });
        }
        if swatch.sample {
            boxes::swatch(canvas, area, style.colour);
        }
        if swatch.line {
            let dash = styles.dash(method, self.nth_line(method, note));
            let paint = Paint { stroke: style.colour, width: style.width * 1.2, dash, ..Paint::default() };
            canvas.line((frame.left, middle.1), (frame.right(), middle.1), &paint);
        }
        if swatch.points {
            let paint = style.marker.paint(style.colour, self.nth_cloud(method, note) > 0);
            draw_marker(canvas, style.marker, middle, 2.0 * POINT, &paint);
        }
        if swatch.dots || swatch.marks {
            let marker = if swatch.dots { style.marker.solid() } else { style.marker };
            draw_marker(canvas, marker, middle, LARGE, &marker.large(style.colour, swatch.dots));
        }
    }
}

fn draw_marker(canvas: &mut Canvas, marker: Marker, at: (f64, f64), size: f64, paint: &Paint) {
    let mut path = Path::default();
    marker.add(&mut path, at, size);
    canvas.path(path, paint);
}

/// Numbers of entries per row.
fn rows(widths: &[f64], page: f64) -> Vec<usize> {
    let mut rows: Vec<usize> = Vec::new();
    let mut used = f64::INFINITY;
    for width in widths {
        if used + APART + width <= page {
            used += APART + width;
            *rows.last_mut().unwrap_or(&mut 0) += 1;
        } else {
            used = *width;
            rows.push(1);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_flow_into_rows() {
        assert_eq!(rows(&[100.0, 100.0, 100.0], 240.0), [2, 1]);
        assert_eq!(rows(&[300.0, 10.0], 240.0), [1, 1]);
        assert!(rows(&[], 240.0).is_empty());
    }
}
