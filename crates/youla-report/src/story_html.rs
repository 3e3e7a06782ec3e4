//! A story as a page.

use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;

use super::drawings::drawings;
use super::figure::Figure;
use super::page::{self, ALL_POINTS};
use super::story::{Block, Section, Story, Table};
use super::thin;
use crate::Result;

const TEMPLATE: &str = include_str!("../assets/story.html");

/// Renders a story as one HTML file.
///
/// The text is complete: style, code and data are inside, nothing is fetched. Each figure links to its static files
/// `figures/<key>.svg` and `figures/<key>.csv`, each table to `tables/<key>.csv`, relative to the page; without a key there
/// is no link. Keys are anchors too and must differ.
///
/// A line of more than [`super::trace::MAX_POINTS`] points is drawn by the minimum and maximum of each bucket, except
/// within the range of its horizontal axis, as far as that leaves a third of the points for the rest; a sentence below the
/// figure says so. Where the lines of a page together hold more points than a file of 5 MB takes, they are thinned further.
///
/// # Errors
/// [`crate::Error::ReportData`] and [`crate::Error::ReportTemplate`] where data or template cannot be written as text.
///
/// ```
/// use youla_report::{Story, story_html};
/// let page = story_html(&Story { title: "Gas bearing".into(), ..Story::default() })?;
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), youla_report::Error>(())
/// ```
pub fn story_html(story: &Story) -> Result<String> {
    let most = thin::most_points(figures(story), ALL_POINTS);
    let content = context! {
        title => &story.title,
        summary => &story.summary,
        program => &story.program,
        methods => Serde(&story.methods),
        sections => Serde(story.sections.iter().map(|section| shown(section, most)).collect::<Vec<_>>()),
    };
    let placed: Vec<(String, Figure)> = figures(story).map(|figure| (figure.key.clone(), figure.clone())).collect();
    page::render(TEMPLATE, content, &drawings(&story.methods, &placed))
}

/// What the template reads of a section.
#[derive(Serialize)]
struct ShownSection<'a> {
    key: &'a str,
    title: &'a str,
    short: &'a str,
    blocks: Vec<ShownBlock<'a>>,
}

/// What the template reads of a block: all but the numbers of figures.
#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum ShownBlock<'a> {
    Text(&'a str),
    List(&'a [String]),
    Table { data: &'a Table, numbers: Vec<bool> },
    Figure { key: &'a str, title: &'a str, caption: &'a str, thinned: bool },
    Listing { title: &'a str, text: &'a str },
}

fn figures(story: &Story) -> impl Iterator<Item = &Figure> {
    story.sections.iter().flat_map(|section| &section.blocks).filter_map(|block| match block {
        Block::Figure(figure) => Some(figure),
        _ => None,
    })
}

fn shown<'a>(section: &'a Section, most: usize) -> ShownSection<'a> {
    let block = |block: &'a Block| match block {
        Block::Text(text) => ShownBlock::Text(text),
        Block::List(points) => ShownBlock::List(points),
        Block::Table(data) => ShownBlock::Table { data, numbers: columns_of_numbers(data) },
        Block::Figure(figure) => ShownBlock::Figure {
            key: &figure.key,
            title: &figure.title,
            caption: &figure.caption,
            thinned: thin::is_thinned(figure, most),
        },
        Block::Listing { title, text } => ShownBlock::Listing { title, text },
    };
    ShownSection {
        key: &section.key,
        title: &section.title,
        short: &section.short,
        blocks: section.blocks.iter().map(block).collect(),
    }
}

/// Which columns are to the right: those with a number in at least half of the cells that hold something.
fn columns_of_numbers(table: &Table) -> Vec<bool> {
    let column = |k: usize| {
        let cells = table.rows.iter().filter_map(move |row| row.cells.get(k)).filter(|cell| !cell.is_empty());
        let (all, numbers) =
            cells.fold((0, 0), |(all, numbers), cell| (all + 1, numbers + usize::from(is_number(cell))));
        k > 0 && numbers > 0 && 2 * numbers >= all
    };
    (0..table.header.len()).map(column).collect()
}

/// A number, maybe with a sign before and a unit or a second number behind: `-3.1`, `< 1e-9`, `83 %`, `4.2 ± 0.1`.
fn is_number(cell: &str) -> bool {
    let number = cell.trim_start_matches(|c: char| "<>=≤≥≈+±- \u{2212}".contains(c));
    let first = number.split_whitespace().next().unwrap_or_default();
    first.trim_end_matches('%').parse::<f64>().is_ok_and(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::story::TableRow;

    #[test]
    fn columns_of_numbers_stand_to_the_right() {
        let rows = [
            ["1", "-3.1", "exact", "none", ""],
            ["2", "\u{2212}4.2 ± 0.1", "2 of 3 runs", "12 %", ""],
            ["3", "none", "inf", "< 1e-9", ""],
        ];
        let row = |cells: &[&str; 5]| TableRow { method: String::new(), cells: cells.map(String::from).into() };
        let table = Table { header: vec![String::new(); 5], rows: rows.iter().map(row).collect(), ..Table::default() };
        assert_eq!(columns_of_numbers(&table), [false, true, false, true, false]);
    }
}
