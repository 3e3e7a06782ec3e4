//! A curve as a line: thinned, with gaps, clipped at its frame.

use super::canvas::Frame;
use super::path::Path;
use super::scale::Scale;
use crate::decimate;
use crate::figure::Curve;

type Point = (f64, f64);

/// The line of a curve within `frame`, of at most about `points` points.
///
/// A value without neighbours is a dot.
pub(super) fn path(curve: &Curve, x: &Scale, y: &Scale, frame: Frame, points: usize) -> Path {
    let kept = thinned(&curve.y, points);
    joined(kept.iter().map(|&(row, value)| (x.at(curve.x[row]), y.at(value))), frame)
}

/// Places joined by a line within `frame`, with a gap where one is not finite.
pub(super) fn joined(places: impl Iterator<Item = Point>, frame: Frame) -> Path {
    let mut path = Path::default();
    let places: Vec<Point> = places.collect();
    for piece in places.split(|(x, y)| !(x.is_finite() && y.is_finite())) {
        add(&mut path, piece, frame);
    }
    path
}

fn thinned(values: &[f64], points: usize) -> Vec<(usize, f64)> {
    // An infinite value is beyond any frame, and a gap.
    let rows = values.iter().map(|value| if value.is_finite() { *value } else { f64::NAN }).enumerate();
    decimate::min_max(rows, values.len(), &(0..0), decimate::width_for(values.len(), 0, points))
}

fn add(path: &mut Path, piece: &[Point], frame: Frame) {
    if let [(x, y)] = *piece {
        const DOT: f64 = 0.25;
        if let Some((from, to)) = clipped((x - DOT, y), (x + DOT, y), frame) {
            path.move_to(from);
            path.line_to(to);
        }
    }
    let mut pen = None;
    for pair in piece.windows(2) {
        let Some((from, to)) = clipped(pair[0], pair[1], frame) else { continue };
        if pen != Some(from) {
            path.move_to(from);
        }
        path.line_to(to);
        pen = Some(to);
    }
}

/// The part of a straight line within a frame (Liang and Barsky 1984).
fn clipped(from: Point, to: Point, frame: Frame) -> Option<(Point, Point)> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for (step, room) in [
        (-dx, from.0 - frame.left),
        (dx, frame.right() - from.0),
        (-dy, from.1 - frame.top),
        (dy, frame.bottom() - from.1),
    ] {
        if step == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if step < 0.0 {
            enters = enters.max(room / step);
        } else {
            leaves = leaves.min(room / step);
        }
    }
    let at = |t: f64| (from.0 + t * dx, from.1 + t * dy);
    let start = if enters == 0.0 { from } else { at(enters) };
    let end = if leaves == 1.0 { to } else { at(leaves) };
    (enters <= leaves).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { left: 0.0, top: 0.0, width: 10.0, height: 10.0 };

    #[test]
    fn a_line_ends_where_it_leaves_its_frame() {
        assert_eq!(clipped((1.0, 1.0), (2.0, 3.0), FRAME), Some(((1.0, 1.0), (2.0, 3.0))));
        assert_eq!(clipped((5.0, 5.0), (5.0, 20.0), FRAME), Some(((5.0, 5.0), (5.0, 10.0))));
        assert_eq!(clipped((-5.0, 5.0), (15.0, 5.0), FRAME), Some(((0.0, 5.0), (10.0, 5.0))));
        assert_eq!(clipped((0.0, 11.0), (10.0, 11.0), FRAME), None);
        assert_eq!(clipped((-2.0, 9.0), (2.0, 13.0), FRAME), None);
    }

    #[test]
    fn thinning_keeps_extremes_and_gaps() {
        let mut values: Vec<f64> = (0..100_000).map(|k| (k as f64 * 1e-3).sin()).collect();
        values[54_321] = 9.0;
        values[70_000..80_000].fill(f64::INFINITY);
        let kept = thinned(&values, 1000);
        assert!(kept.len() <= 1000 && kept.contains(&(54_321, 9.0)));
        assert!(kept.iter().any(|point| point.1.is_nan()) && kept.iter().all(|point| !point.1.is_infinite()));
    }
}
