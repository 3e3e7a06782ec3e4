//! Where the panels of a figure stand.

use super::canvas::{Canvas, Frame, PER_MM};
use super::legend::{Edge, Legend};
use super::panel::{Labels, Prepared};
use super::style::Styles;
use crate::report::figure::{Content, Figure, Layout, Panel};

/// Width of a page of print.
const WIDTH: f64 = 170.0 * PER_MM;
/// Free at the right edge, for half of the last number.
const RIGHT: f64 = 8.0;
/// Free between panels.
const BESIDE: f64 = 12.0;
const BELOW: f64 = 4.0;
/// Most panels beside each other.
const MOST_BESIDE: usize = 4;

/// Draws a figure that was checked.
pub(super) fn draw(figure: &Figure, styles: &Styles) -> String {
    let mut canvas = Canvas::new(&figure.title, &figure.caption);
    let panels = prepared(figure);
    let edge = panels.iter().map(Prepared::edge).fold(Edge::default(), |all, edge| Edge {
        beyond: all.beyond || edge.beyond,
        missing: all.missing || edge.missing,
    });
    let legend = Legend::of(figure, styles, edge);
    let mut bottom = legend.draw(&mut canvas, styles, WIDTH);
    let grid = Grid::of(&panels, figure.layout);
    for (row, members) in panels.chunks(grid.columns).enumerate() {
        let above = members.iter().map(|panel| panel.height_above(grid.width)).fold(0.0, f64::max);
        let last = row + 1 == panels.len().div_ceil(grid.columns);
        let labels_below = last || !grid.common_x;
        for (panel, left) in members.iter().zip(grid.lefts()) {
            let height = panel.height(grid.usual);
            let frame = Frame { left, top: bottom + above, width: grid.width, height };
            let labels = Labels { left: !grid.common_y || left == grid.left[0], below: labels_below };
            panel.draw(&mut canvas, frame, labels, styles, &legend);
        }
        let height = |panel: &Prepared| {
            panel.height(grid.usual) + if labels_below { panel.height_below(grid.width, styles) } else { 3.0 }
        };
        bottom += above + members.iter().map(height).fold(0.0, f64::max) + BELOW;
    }
    canvas.finish(WIDTH, bottom)
}

fn prepared(figure: &Figure) -> Vec<Prepared<'_>> {
    let all: Vec<&Panel> = figure.panels.iter().collect();
    let others = if common_x(&all, figure.layout) { &all[..] } else { &[] };
    all.iter().map(|panel| Prepared::new(panel, others)).collect()
}

/// Columns of panels with frames of one width.
struct Grid {
    columns: usize,
    /// Room for labels left of each column.
    left: Vec<f64>,
    width: f64,
    /// Height of a frame that has none of its own.
    usual: f64,
    common_x: bool,
    common_y: bool,
}

impl Grid {
    fn of(prepared: &[Prepared], layout: Layout) -> Self {
        let panels: Vec<&Panel> = prepared.iter().map(|one| one.panel).collect();
        let columns = match layout {
            Layout::Stacked => 1,
            Layout::Beside => panels.len().div_ceil(panels.len().div_ceil(MOST_BESIDE).max(1)).max(1),
        };
        let rows = panels.len().div_ceil(columns);
        let usual = PER_MM
            * match layout {
                Layout::Stacked => (150.0 / (rows as f64 + 1.0)).clamp(32.0, 65.0),
                Layout::Beside => [65.0, 62.0, 52.0, 46.0][columns - 1],
            };
        let common_y = columns > 1 && common_y(&panels);
        let room = |column: usize| {
            let members = prepared.iter().skip(column).step_by(columns);
            members.map(|panel| panel.width_left(panel.height(usual))).fold(0.0, f64::max)
        };
        let left: Vec<f64> =
            (0..columns).map(|column| if common_y && column > 0 { 0.0 } else { room(column) }).collect();
        let taken = left.iter().sum::<f64>() + BESIDE * (columns - 1) as f64 + RIGHT;
        let width = ((WIDTH - taken) / columns as f64).max(20.0);
        Grid { columns, left, width, usual, common_x: common_x(&panels, layout), common_y }
    }

    /// Left edges of the frames.
    fn lefts(&self) -> impl Iterator<Item = f64> {
        self.left.iter().scan(0.0, |right, left| {
            let at = *right + left;
            *right = at + self.width + BESIDE;
            Some(at)
        })
    }
}

/// Whether panels below each other have one horizontal axis.
fn common_x(panels: &[&Panel], layout: Layout) -> bool {
    let curves = |panel: &&Panel| matches!(panel.content, Content::Curves(_));
    layout == Layout::Stacked && panels.iter().all(curves) && panels.windows(2).all(|pair| pair[0].x == pair[1].x)
}

/// Whether panels beside each other have one vertical axis.
fn common_y(panels: &[&Panel]) -> bool {
    panels.windows(2).all(|pair| {
        let same = match (&pair[0].content, &pair[1].content) {
            (Content::Cells(one), Content::Cells(other)) => one.rows == other.rows,
            (Content::Cells(_), _) | (_, Content::Cells(_)) => false,
            _ => pair[0].y.range.is_some(),
        };
        same && pair[0].y == pair[1].y
    })
}
