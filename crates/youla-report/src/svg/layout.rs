//! Where the panels of a figure stand.

use super::Print;
use super::canvas::{Canvas, Frame, PER_MM};
use super::legend::{Edge, Legend};
use super::panel::{Labels, Prepared};
use super::style::Styles;
use crate::figure::{Content, Figure, Layout, Panel};
use crate::{Error, Result};

/// Free at the right edge, for half of the last number.
const RIGHT: f64 = 8.0;
/// Free between panels.
const BESIDE: f64 = 12.0;
const BELOW: f64 = 4.0;
/// Most panels beside each other, and the width that each needs.
const MOST_BESIDE: f64 = 4.0;
const ROOM: f64 = 42.0 * PER_MM;
const ROOM_OF_EQUAL_AXES: f64 = 70.0 * PER_MM;
/// Least width and height of a frame.
const NARROWEST: f64 = 20.0;
const LOWEST: f64 = 30.0;
/// A page of print or a wider one is not refused for long labels.
const WIDEST_TO_REFUSE: f64 = 169.0 * PER_MM;

/// Draws a figure that was checked.
pub(super) fn draw(figure: &Figure, styles: &Styles, print: &Print) -> Result<String> {
    let mut canvas = Canvas::new(&figure.title, &figure.caption, print.embed_font);
    let mut panels = prepared(figure);
    let edge = panels.iter().map(Prepared::edge).fold(Edge::default(), |all, edge| Edge {
        beyond: all.beyond || edge.beyond,
        missing: all.missing || edge.missing,
    });
    let legend = Legend::of(figure, styles, edge);
    let page = 10.0 * print.width_cm * PER_MM;
    let top = legend.draw(&mut canvas, styles, page);
    let grid = Grid::fitted(&mut panels, figure.layout, page, print.height_cm.map(|cm| (cm, top)), styles)?;
    let mut bottom = top;
    for (members, row) in panels.chunks(grid.columns).zip(grid.rows(&panels, styles)) {
        for (panel, left) in members.iter().zip(grid.lefts()) {
            let height = panel.height(grid.usual);
            let frame = Frame { left, top: bottom + row.above, width: grid.width, height };
            let labels = Labels { left: !grid.common_y || left == grid.left[0], below: row.labels_below };
            panel.draw(&mut canvas, frame, labels, styles, &legend);
        }
        bottom += row.height();
    }
    let height = print.height_cm.map_or(bottom, |cm| 10.0 * cm * PER_MM);
    Ok(canvas.finish(page, height))
}

fn prepared(figure: &Figure) -> Vec<Prepared<'_>> {
    let all: Vec<&Panel> = figure.panels.iter().collect();
    let others = if common_x(&all, figure.layout) { &all[..] } else { &[] };
    all.iter().map(|panel| Prepared::new(panel, others)).collect()
}

/// Panels beside each other: what is above their frames, and frames with what is below them.
struct Row {
    above: f64,
    frames: f64,
    labels_below: bool,
}

impl Row {
    fn height(&self) -> f64 {
        self.above + self.frames + BELOW
    }
}

/// Columns of panels with frames of one width.
struct Grid {
    columns: usize,
    /// Room for labels left of each column.
    left: Vec<f64>,
    width: f64,
    /// Whether the labels leave too little for that width.
    crowded: bool,
    /// Height of a frame that has none of its own.
    usual: f64,
    common_x: bool,
    common_y: bool,
}

impl Grid {
    /// The grid of a page of this width and, where one is asked for, height in cm, of which the legend takes some points.
    fn fitted(
        prepared: &mut [Prepared],
        layout: Layout,
        page: f64,
        height: Option<(f64, f64)>,
        styles: &Styles,
    ) -> Result<Self> {
        let mut grid = Grid::of(prepared, layout, page, None);
        // Widths of labels depend on ranges, which depend on the frames where axes are equal, as heights do on labels.
        for _ in 0..4 {
            if let Some((cm, top)) = height {
                let total: f64 = top + grid.rows(prepared, styles).iter().map(Row::height).sum::<f64>();
                let free = 10.0 * cm * PER_MM - total;
                let shares = grid.shares(prepared);
                grid.usual = if shares > 0.0 { (grid.usual + free / shares).max(1.0) } else { grid.usual };
            }
            prepared.iter_mut().for_each(|panel| panel.fit(grid.width, panel.height(grid.usual)));
            grid = Grid::of(prepared, layout, page, Some(grid.usual));
        }
        let lowest = prepared.iter().map(|panel| panel.height(grid.usual)).fold(f64::INFINITY, f64::min);
        let refuse = |side: &str, value, must| {
            Err(Error::Method(youla::Error::OutOfRange {
                what: format!("the {side} of the figure in cm"),
                value,
                must,
            }))
        };
        match height {
            _ if grid.crowded && page < WIDEST_TO_REFUSE => {
                refuse("width", page / 10.0 / PER_MM, "enough for its panels and labels")
            }
            Some((cm, top)) => {
                let total: f64 = top + grid.rows(prepared, styles).iter().map(Row::height).sum::<f64>();
                match lowest >= LOWEST / 2.0 && total <= 10.0 * cm * PER_MM + 1.0 {
                    true => Ok(grid),
                    false => refuse("height", cm, "enough for its panels, labels and legend"),
                }
            }
            None => Ok(grid),
        }
    }

    fn of(prepared: &[Prepared], layout: Layout, page: f64, usual: Option<f64>) -> Self {
        let panels: Vec<&Panel> = prepared.iter().map(|one| one.panel).collect();
        let columns = match layout {
            Layout::Stacked => 1,
            Layout::Beside => panels.len().div_ceil(panels.len().div_ceil(most_beside(&panels, page)).max(1)).max(1),
        };
        let rows = panels.len().div_ceil(columns);
        let usual = usual.unwrap_or_else(|| usual_height(&panels, layout, (rows, columns), page));
        let common_y = columns > 1 && common_y(&panels);
        let room = |column: usize| {
            let members = prepared.iter().skip(column).step_by(columns);
            members.map(|panel| panel.width_left(panel.height(usual))).fold(0.0, f64::max)
        };
        let left: Vec<f64> =
            (0..columns).map(|column| if common_y && column > 0 { 0.0 } else { room(column) }).collect();
        let taken = left.iter().sum::<f64>() + BESIDE * (columns - 1) as f64 + RIGHT;
        let width = (page - taken) / columns as f64;
        let (crowded, width) = (width < NARROWEST, width.max(NARROWEST));
        Grid { columns, left, width, crowded, usual, common_x: common_x(&panels, layout), common_y }
    }

    fn rows(&self, panels: &[Prepared], styles: &Styles) -> Vec<Row> {
        let count = panels.len().div_ceil(self.columns);
        let row = |(row, members): (usize, &[Prepared])| {
            let labels_below = row + 1 == count || !self.common_x;
            let frame = |panel: &Prepared| {
                let below = if labels_below { panel.height_below(self.width, styles) } else { 3.0 };
                panel.height(self.usual) + below
            };
            Row {
                above: members.iter().map(|panel| panel.height_above(self.width)).fold(0.0, f64::max),
                frames: members.iter().map(frame).fold(0.0, f64::max),
                labels_below,
            }
        };
        panels.chunks(self.columns).enumerate().map(row).collect()
    }

    /// By how much the figure grows with the usual height.
    fn shares(&self, panels: &[Prepared]) -> f64 {
        panels.chunks(self.columns).map(|row| row.iter().map(Prepared::share).fold(0.0, f64::max)).sum()
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

fn most_beside(panels: &[&Panel], page: f64) -> usize {
    let room = if panels.iter().any(|panel| panel.equal) { ROOM_OF_EQUAL_AXES } else { ROOM };
    (page / room).floor().clamp(1.0, MOST_BESIDE) as usize
}

fn usual_height(panels: &[&Panel], layout: Layout, (rows, columns): (usize, usize), page: f64) -> f64 {
    let millimetres = match layout {
        Layout::Stacked => (150.0 / (rows as f64 + 1.0)).clamp(32.0, 65.0),
        Layout::Beside => [65.0, 62.0, 52.0, 46.0][columns - 1],
    };
    // Equal axes want a frame that is nearly as high as wide.
    let equal = panels.iter().any(|panel| panel.equal);
    let most = if equal {
        0.72
    } else if columns == 1 {
        0.65
    } else {
        1.1
    } * page
        / columns as f64;
    if equal { most.min(90.0 * PER_MM) } else { (PER_MM * millimetres).min(most.max(LOWEST)) }
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
