//! One panel: its scales, the room it needs around its frame, its axes.

use super::canvas::{Anchor, Canvas, Frame, GRID, Paint, SOFT};
use super::curves::{self, Strips};
use super::legend::{Edge, Legend};
use super::scale::{Place, Scale};
use super::style::Styles;
use super::text::{self, LABEL, LEADING, TICK};
use super::ticks::{Tick, ticks};
use super::{boxes, cells, ground};
use crate::figure::{Axis, Content, Curve, Drawn, OtherUnit, Panel};

/// Length of a tick, and from it to its label.
const TICK_LENGTH: f64 = 2.5;
const TO_LABEL: f64 = 2.0;
/// Least distances of labels along the axes.
const APART_X: f64 = 14.0;
const APART_Y: f64 = 17.0;
/// Free at each end of the data, as a share.
const MARGIN: f64 = 0.04;

/// Which labels are drawn; panels with an axis in common leave them to one of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Labels {
    pub(super) left: bool,
    pub(super) below: bool,
}

/// A panel and its scales, of which only the values are known yet.
pub(super) struct Prepared<'a> {
    pub(super) panel: &'a Panel,
    /// Widened where both axes are equal.
    x: Scale,
    y: Scale,
    /// As the data or the axes say.
    own: (Scale, Scale),
    /// Heights of the strips at the lower and the upper edge.
    strips: (f64, f64),
}

impl<'a> Prepared<'a> {
    /// `others` have the horizontal axis in common.
    pub(super) fn new(panel: &'a Panel, others: &[&Panel]) -> Self {
        let everything =
            std::iter::once(panel).chain(others.iter().copied()).filter_map(|panel| match &panel.content {
                Content::Curves(curves) => Some(curves.as_slice()),
                _ => None,
            });
        let margin = if everything.clone().flatten().any(|curve| curve.drawn != Drawn::Line) { 0.02 } else { 0.0 };
        let across = panel.regions.iter().flat_map(|region| region.x.iter().copied());
        let across = everything.flat_map(|curves| curves::values(curves, |curve| &curve.x)).chain(across);
        let x = Scale::new(&panel.x, across, margin);
        let (y, strips) = match &panel.content {
            Content::Curves(curves) => {
                let up = curves::values(curves, |curve| &curve.y).chain(ground::values(panel));
                let y = Scale::new(&panel.y, up, MARGIN);
                (y, Strips::of(curves, &x, &y).heights())
            }
            Content::Boxes(samples) => {
                let y = Scale::new(&panel.y, boxes::values(samples), MARGIN);
                (y, boxes::strips(samples, &y))
            }
            Content::Cells(_) => (Scale::new(&panel.y, std::iter::empty(), 0.0), (0.0, 0.0)),
        };
        Prepared { panel, x, y, own: (x, y), strips }
    }

    /// Widens one of the ranges where a unit is to be as long on both axes of a frame of this size.
    pub(super) fn fit(&mut self, width: f64, height: f64) {
        let ((x, y), height) = (self.own, height - self.strips.0 - self.strips.1);
        if self.panel.equal && !x.log && !y.log && width > 0.0 && height > 0.0 {
            let ratio = (x.high - x.low) / width / ((y.high - y.low) / height);
            (self.x, self.y) = if ratio < 1.0 { (x.widened(1.0 / ratio), y) } else { (x, y.widened(ratio)) };
        }
    }

    /// What is at the edges of its frame.
    pub(super) fn edge(&self) -> Edge {
        let beyond = match &self.panel.content {
            Content::Boxes(_) => self.strips != (0.0, 0.0),
            Content::Curves(curves) => self.any(curves, |place| matches!(place, Place::Below | Place::Above)),
            Content::Cells(_) => false,
        };
        let missing = match &self.panel.content {
            Content::Curves(curves) => self.any(curves, |place| place == Place::Missing),
            _ => false,
        };
        Edge { beyond, missing }
    }

    fn any(&self, curves: &[Curve], wanted: fn(Place) -> bool) -> bool {
        let clouds = curves.iter().filter(|curve| curve.drawn == Drawn::Points);
        clouds.flat_map(|curve| curves::points(curve, &self.x)).any(|(_, value)| wanted(self.y.place(value)))
    }

    /// Height of its frame, where others are `usual`.
    pub(super) fn height(&self, usual: f64) -> f64 {
        match &self.panel.content {
            Content::Cells(cells) => cells::ROW * cells.rows.len() as f64,
            _ => usual * self.share(),
        }
    }

    /// Its height over the usual one; 0 where it has one of its own.
    pub(super) fn share(&self) -> f64 {
        match &self.panel.content {
            Content::Cells(_) => 0.0,
            _ => self.panel.height.filter(|share| *share > 0.0 && share.is_finite()).unwrap_or(1.0),
        }
    }

    /// Width left of a frame of this height.
    pub(super) fn width_left(&self, height: f64) -> f64 {
        let marks = self.marks_left(Frame { height, ..Frame::default() });
        let widest = marks.iter().map(|(_, label)| text::width(label, TICK)).fold(0.0, f64::max);
        let lines = self.y_label(height).len();
        widest + TICK_LENGTH + TO_LABEL + if lines > 0 { lines as f64 * LABEL * LEADING + 3.0 } else { 1.0 }
    }

    /// Height above a frame of this width.
    pub(super) fn height_above(&self, width: f64) -> f64 {
        let title = match text::wrapped(&self.panel.title, LABEL, width * 0.92).len() {
            0 => 4.0,
            lines => lines as f64 * LABEL * LEADING + 4.0,
        };
        title + self.height_of_other_unit()
    }

    /// Height of the labels of a second unit above the frame.
    fn height_of_other_unit(&self) -> f64 {
        if self.panel.x.also.is_some() { TICK_LENGTH + TO_LABEL + TICK * LEADING + LABEL * LEADING } else { 0.0 }
    }

    /// Height below a frame of this width.
    pub(super) fn height_below(&self, width: f64, styles: &Styles) -> f64 {
        let lines = self.x_label(width).len();
        self.height_of_marks_below(width, styles) + if lines > 0 { 1.0 + lines as f64 * LABEL * LEADING } else { 0.0 }
    }

    fn height_of_marks_below(&self, width: f64, styles: &Styles) -> f64 {
        3.0 + match &self.panel.content {
            Content::Curves(_) => TICK_LENGTH + TICK * LEADING,
            Content::Boxes(samples) => boxes::height_below(samples, &self.y, width, styles),
            Content::Cells(cells) => cells::height_below(cells, width),
        }
    }

    fn x_label(&self, width: f64) -> Vec<String> {
        text::wrapped(&text::axis_label(&self.panel.x), LABEL, width)
    }

    fn y_label(&self, height: f64) -> Vec<String> {
        text::wrapped(&text::axis_label(&self.panel.y), LABEL, height)
    }

    fn y_in(&self, frame: Frame) -> Scale {
        self.y.over(frame.bottom() - self.strips.0, frame.top + self.strips.1)
    }

    /// Draws everything.
    pub(super) fn draw(&self, canvas: &mut Canvas, frame: Frame, labels: Labels, styles: &Styles, legend: &Legend) {
        let (x, y) = (self.x.over(frame.left, frame.right()), self.y_in(frame));
        match &self.panel.content {
            Content::Curves(curves) => {
                let below = ticks_along(&x);
                ground::draw_shades(canvas, self.panel, &x, frame);
                self.draw_grid(canvas, frame, &ticks_up(&y), &below);
                let inner = Frame { top: y.end, height: y.length(), ..frame };
                ground::draw(canvas, self.panel, (&x, &y), inner, styles);
                curves::draw(canvas, curves, (&x, &y), frame, (styles, legend));
                ground::draw_labels(canvas, &self.panel.guides, (&x, &y), inner);
                draw_ticks_below(canvas, frame, &x, &below, labels.below);
                if let Some(other) = &self.panel.x.also {
                    draw_other_unit(canvas, frame, &x, other);
                }
            }
            Content::Boxes(samples) => {
                self.draw_grid(canvas, frame, &ticks_up(&y), &[]);
                boxes::draw(canvas, samples, &y, frame, styles);
            }
            Content::Cells(cells) => cells::draw(canvas, cells, frame, styles),
        }
        canvas.rectangle(frame, &Paint { stroke: SOFT, width: 0.6, ..Paint::default() });
        self.draw_titles(canvas, frame, labels, styles);
    }

    fn draw_grid(&self, canvas: &mut Canvas, frame: Frame, left: &[Tick], below: &[Tick]) {
        let (x, y) = (self.x.over(frame.left, frame.right()), self.y_in(frame));
        let grid = Paint { stroke: GRID, width: 0.4, ..Paint::default() };
        let tick = Paint { stroke: SOFT, width: 0.6, ..Paint::default() };
        for Tick { value, label } in left {
            let at = y.at(*value);
            let length = if label.is_empty() { TICK_LENGTH * 0.6 } else { TICK_LENGTH };
            canvas.line((frame.left - length, at), (frame.left, at), &tick);
            if !label.is_empty() {
                canvas.line((frame.left, at), (frame.right(), at), &grid);
            }
        }
        for Tick { value, .. } in below.iter().filter(|tick| !tick.label.is_empty()) {
            canvas.line((x.at(*value), frame.top), (x.at(*value), frame.bottom()), &grid);
        }
    }

    fn draw_titles(&self, canvas: &mut Canvas, frame: Frame, labels: Labels, styles: &Styles) {
        let title = text::wrapped(&self.panel.title, LABEL, frame.width * 0.92);
        for (k, line) in title.iter().rev().enumerate() {
            canvas.text(
                line,
                frame.left,
                frame.top - 4.0 - self.height_of_other_unit() - k as f64 * LABEL * LEADING,
                LABEL,
                Anchor::Start,
            );
        }
        if labels.below {
            let first = frame.bottom() + self.height_of_marks_below(frame.width, styles) + LABEL;
            for (k, line) in self.x_label(frame.width).iter().enumerate() {
                let base = first + k as f64 * LABEL * LEADING;
                canvas.text(line, frame.left + frame.width / 2.0, base, LABEL, Anchor::Middle);
            }
        }
        if labels.left {
            for (at, label) in self.marks_left(frame) {
                let right = frame.left - TICK_LENGTH - TO_LABEL;
                canvas.text(&label, right, at + 0.35 * TICK, TICK, Anchor::End);
            }
            let first = frame.left - self.width_left(frame.height) + LABEL;
            for (k, line) in self.y_label(frame.height).iter().enumerate() {
                let x = first + k as f64 * LABEL * LEADING;
                canvas.text_upwards(line, x, frame.top + frame.height / 2.0, LABEL, Anchor::Middle);
            }
        }
    }

    /// Places and texts at the left edge.
    fn marks_left(&self, frame: Frame) -> Vec<(f64, String)> {
        match &self.panel.content {
            Content::Cells(cells) => cells::rows(cells)
                .map(|(share, label)| (frame.bottom() - share * frame.height, label.to_owned()))
                .collect(),
            _ => {
                let y = self.y_in(frame);
                let written = ticks_up(&y).into_iter().filter(|tick| !tick.label.is_empty());
                written.map(|tick| (y.at(tick.value), tick.label)).collect()
            }
        }
    }
}

fn ticks_up(y: &Scale) -> Vec<Tick> {
    ticks(y, (y.length() / APART_Y) as usize)
}

/// As many ticks as have room for their labels.
fn ticks_along(x: &Scale) -> Vec<Tick> {
    let fits = |found: &[Tick]| {
        let mut written: Vec<&Tick> = found.iter().filter(|tick| !tick.label.is_empty()).collect();
        written.sort_by(|a, b| a.value.total_cmp(&b.value));
        written.windows(2).all(|pair| {
            let room = (text::width(&pair[0].label, TICK) + text::width(&pair[1].label, TICK)) / 2.0;
            x.at(pair[1].value) - x.at(pair[0].value) >= room + APART_X
        })
    };
    (3..=8).rev().map(|most| ticks(x, most)).find(|found| fits(found)).unwrap_or_else(|| ticks(x, 2))
}

/// Ticks and label of a second unit above the frame.
fn draw_other_unit(canvas: &mut Canvas, frame: Frame, x: &Scale, other: &OtherUnit) {
    let paint = Paint { stroke: SOFT, width: 0.6, ..Paint::default() };
    let scale = Scale { low: x.low * other.factor, high: x.high * other.factor, ..*x };
    for Tick { value, label } in ticks_along(&scale) {
        let at = scale.at(value);
        let length = if label.is_empty() { TICK_LENGTH * 0.6 } else { TICK_LENGTH };
        canvas.line((at, frame.top), (at, frame.top - length), &paint);
        if !label.is_empty() {
            canvas.text(&label, at, frame.top - TICK_LENGTH - TO_LABEL, TICK, Anchor::Middle);
        }
    }
    let axis = Axis { label: other.label.clone(), unit: other.unit.clone(), ..Axis::default() };
    let base = frame.top - TICK_LENGTH - TO_LABEL - TICK * LEADING;
    canvas.text(&text::axis_label(&axis), frame.left + frame.width / 2.0, base, LABEL, Anchor::Middle);
}

fn draw_ticks_below(canvas: &mut Canvas, frame: Frame, x: &Scale, below: &[Tick], labels: bool) {
    let paint = Paint { stroke: SOFT, width: 0.6, ..Paint::default() };
    for Tick { value, label } in below {
        let at = x.at(*value);
        let length = if label.is_empty() { TICK_LENGTH * 0.6 } else { TICK_LENGTH };
        canvas.line((at, frame.bottom()), (at, frame.bottom() + length), &paint);
        if labels && !label.is_empty() {
            let base = frame.bottom() + TICK_LENGTH + TO_LABEL + 0.85 * TICK;
            canvas.text(label, at, base, TICK, Anchor::Middle);
        }
    }
}
