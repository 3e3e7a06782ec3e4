//! Maps of cells: colour says which method wins, its strength how clearly.

use super::canvas::{Anchor, Canvas, Frame, GRID, Paint};
use super::style::{Styles, tint};
use super::text::{self, LEADING, TICK};
use crate::figure::Cells;

/// Height of a row of cells.
pub(super) const ROW: f64 = 21.0;

/// Middle of each row above the lower edge, as a share of the height, and its label.
pub(super) fn rows(cells: &Cells) -> impl Iterator<Item = (f64, &str)> {
    let count = cells.rows.len() as f64;
    cells.rows.iter().enumerate().map(move |(k, label)| ((k as f64 + 0.5) / count, label.as_str()))
}

/// Height of the labels of the columns.
pub(super) fn height_below(cells: &Cells, width: f64) -> f64 {
    if upright(cells, width) {
        TICK * LEADING + 2.0
    } else {
        cells.columns.iter().map(|label| text::width(label, TICK)).fold(0.0, f64::max) + 3.0
    }
}

fn upright(cells: &Cells, width: f64) -> bool {
    let room = width / cells.columns.len().max(1) as f64 - 3.0;
    cells.columns.iter().all(|label| text::width(label, TICK) <= room)
}

/// Draws cells and labels of columns.
pub(super) fn draw(canvas: &mut Canvas, cells: &Cells, frame: Frame, styles: &Styles) {
    let (columns, rows) = (cells.columns.len(), cells.rows.len());
    let (width, height) = (frame.width / columns as f64, frame.height / rows as f64);
    for (k, cell) in cells.cells.iter().enumerate() {
        let place = Frame {
            left: frame.left + (k % columns) as f64 * width,
            top: frame.bottom() - (k / columns + 1) as f64 * height,
            width,
            height,
        };
        let fill = if cell.method.is_empty() {
            "#ffffff".to_owned()
        } else {
            tint(styles.of(&cell.method).colour, cell.strength)
        };
        canvas.rectangle(
            place,
            &Paint { fill: &fill, stroke: GRID, width: 0.5, of: Some((&cell.method, "cell")), ..Paint::default() },
        );
        let size = TICK.min(TICK * (width - 2.0) / text::width(&cell.text, TICK).max(1e-9));
        let middle = (place.left + width / 2.0, place.top + height / 2.0 + 0.35 * size);
        canvas.text(&text::signed(&cell.text), middle.0, middle.1, size, Anchor::Middle);
    }
    let upright = upright(cells, frame.width);
    for (k, label) in cells.columns.iter().enumerate() {
        let x = frame.left + (k as f64 + 0.5) * width;
        if upright {
            canvas.text(label, x, frame.bottom() + 3.0 + TICK, TICK, Anchor::Middle);
        } else {
            canvas.text_upwards(label, x + 0.35 * TICK, frame.bottom() + 3.0, TICK, Anchor::End);
        }
    }
}
