//! Box plots: one box per sample, what is not drawn is counted below it.

use super::canvas::{Anchor, Canvas, Frame, Paint};
use super::curves::POINT;
use super::path::Path;
use super::scale::{Place, Scale};
use super::spread::Spread;
use super::style::{Marker, Styles, tint};
use super::text::{self, LEADING, REMARK, TICK};
use crate::figure::Sample;

const WIDEST: f64 = 32.0;
/// Height of the strip at an edge beyond which values lie.
const STRIP: f64 = 5.0;
/// Lines of a name below a box; a longer one is left to the legend.
const NAME_LINES: usize = 2;

/// A line of text below a box and its size.
type Line = (String, f64);
/// Empty space before a remark.
const APART: Line = (String::new(), 2.0);

/// Heights of the strips at the lower and the upper edge.
pub(super) fn strips(samples: &[Sample], y: &Scale) -> (f64, f64) {
    let height = |wanted| {
        let any = samples.iter().any(|sample| count(sample, y, wanted) > 0);
        if any { STRIP } else { 0.0 }
    };
    (height(Place::Below), height(Place::Above))
}

/// All values of all samples.
pub(super) fn values(samples: &[Sample]) -> impl Iterator<Item = f64> {
    samples.iter().flat_map(|sample| &sample.values).copied()
}

/// Height of the text below the boxes of a frame of this width.
pub(super) fn height_below(samples: &[Sample], y: &Scale, width: f64, styles: &Styles) -> f64 {
    let texts = texts_below(samples, y, width, styles);
    texts.iter().map(|lines| lines.iter().map(|line| line.1 * LEADING).sum()).fold(0.0, f64::max)
}

/// Draws the boxes; `y` spans the frame less its strips.
pub(super) fn draw(canvas: &mut Canvas, samples: &[Sample], y: &Scale, frame: Frame, styles: &Styles) {
    let slot = frame.width / samples.len() as f64;
    let texts = texts_below(samples, y, frame.width, styles);
    for (k, (sample, lines)) in samples.iter().zip(texts).enumerate() {
        let centre = frame.left + (k as f64 + 0.5) * slot;
        if let Some(spread) = Spread::of(&sample.values) {
            let half = (0.25 * slot).min(WIDEST / 2.0);
            draw_box(canvas, &spread, y, (centre, half), (styles.of(&sample.method).colour, &sample.method));
        }
        draw_beyond(canvas, sample, y, centre, frame, styles);
        let mut base = frame.bottom() + 3.0;
        for (line, size) in lines {
            base += size * LEADING;
            canvas.text(&line, centre, base - 0.2 * size, size, Anchor::Middle);
        }
    }
}

fn draw_box(canvas: &mut Canvas, spread: &Spread, y: &Scale, (x, half): (f64, f64), (colour, of): (&str, &str)) {
    let at = |value: f64| y.at(value.clamp(y.low, y.high));
    let inside = |value: f64| matches!(y.place(value), Place::Inside(_));
    let line = Paint { stroke: colour, width: 0.7, of: Some((of, "whisker")), ..Paint::default() };
    for (quartile, whisker) in spread.quartiles.into_iter().zip(spread.whiskers) {
        if at(quartile) != at(whisker) {
            canvas.line((x, at(quartile)), (x, at(whisker)), &line);
        }
        if inside(whisker) {
            canvas.line((x - half / 2.0, at(whisker)), (x + half / 2.0, at(whisker)), &line);
        }
    }
    let [low, high] = spread.quartiles.map(at);
    if low != high || spread.quartiles.into_iter().any(inside) {
        let frame = Frame { left: x - half, top: high, width: 2.0 * half, height: low - high };
        let fill = tint(colour, 0.35);
        canvas.rectangle(frame, &Paint { fill: &fill, of: Some((of, "box")), ..line.clone() });
    }
    if inside(spread.median) {
        let paint = Paint { width: 1.5, of: Some((of, "median")), ..line.clone() };
        canvas.line((x - half, at(spread.median)), (x + half, at(spread.median)), &paint);
    }
    let mut outliers = Path::default();
    for value in spread.beyond.iter().filter(|value| inside(**value)) {
        Marker::Circle.add(&mut outliers, (x, at(*value)), POINT);
    }
    canvas.path(outliers, &Paint { width: 0.5, of: Some((of, "outliers")), ..line });
}

/// One triangle at each edge beyond which values lie; their number is in the text below.
fn draw_beyond(canvas: &mut Canvas, sample: &Sample, y: &Scale, x: f64, frame: Frame, styles: &Styles) {
    let colour = styles.of(&sample.method).colour;
    let paint = Paint { of: Some((&sample.method, "beyond")), ..Marker::Down.paint(colour, false) };
    for (place, marker, at) in [
        (Place::Below, Marker::Down, frame.bottom() - STRIP / 2.0),
        (Place::Above, Marker::Up, frame.top + STRIP / 2.0),
    ] {
        if count(sample, y, place) > 0 {
            let mut path = Path::default();
            marker.add(&mut path, (x, at), 1.8);
            canvas.path(path, &paint);
        }
    }
}

fn count(sample: &Sample, y: &Scale, wanted: Place) -> usize {
    sample.values.iter().filter(|value| y.place(**value) == wanted).count()
}

fn texts_below(samples: &[Sample], y: &Scale, width: f64, styles: &Styles) -> Vec<Vec<Line>> {
    let room = width / samples.len().max(1) as f64 - 3.0;
    let names = names(samples, room, styles);
    names
        .into_iter()
        .zip(samples)
        .map(|(name, sample)| name.into_iter().chain(remarks(sample, y, room)).collect())
        .collect()
}

/// Names of the boxes, all of as many lines; only their notes where there is no room for all.
fn names(samples: &[Sample], room: f64, styles: &Styles) -> Vec<Vec<Line>> {
    let full = |sample: &Sample| text::wrapped(&styles.name(&sample.method, &sample.note), TICK, room);
    let fits =
        |lines: Vec<String>| lines.len() <= NAME_LINES && lines.iter().all(|line| text::width(line, TICK) <= room);
    let all_fit = samples.iter().all(|sample| fits(full(sample)));
    let names = samples.iter().map(|sample| match all_fit {
        true => full(sample).into_iter().map(|line| (line, TICK)).collect(),
        false => fitted(&sample.note, room),
    });
    let mut names: Vec<Vec<Line>> = names.collect();
    let most = names.iter().map(Vec::len).max().unwrap_or(0);
    names.iter_mut().for_each(|lines| lines.resize(most, (String::new(), TICK)));
    names
}

fn fitted(text: &str, room: f64) -> Vec<Line> {
    let size = text::fitting(text, REMARK, room);
    text::wrapped(text, size, room).into_iter().map(|line| (line, size)).collect()
}

/// What the box does not show: values that are NaN or beyond the range.
fn remarks(sample: &Sample, y: &Scale, room: f64) -> Vec<Line> {
    let (all, number) = (sample.values.len(), |value: f64| text::minus(&format!("{value}")));
    [
        (Place::Missing, format!("of {all} failed")),
        (Place::Below, format!("below {}", number(y.low))),
        (Place::Above, format!("above {}", number(y.high))),
    ]
    .into_iter()
    .filter_map(|(place, what)| match count(sample, y, place) {
        0 => None,
        count => Some(format!("{count} {what}")),
    })
    .flat_map(|remark| std::iter::once(APART).chain(fitted(&remark, room)))
    .collect()
}

/// The small box of the legend.
pub(super) fn swatch(canvas: &mut Canvas, frame: Frame, colour: &str) {
    let fill = tint(colour, 0.35);
    canvas.rectangle(frame, &Paint { fill: &fill, stroke: colour, width: 0.7, ..Paint::default() });
    let middle = frame.top + frame.height / 2.0;
    let paint = Paint { stroke: colour, width: 1.5, ..Paint::default() };
    canvas.line((frame.left, middle), (frame.right(), middle), &paint);
}
