//! The numbers behind a figure or a table, for other programs.

use super::data::DrawnMethod;
use super::figure::{Area, Cell, Cells, Content, Curve, Figure, Panel, Sample};
use super::story::Table;

/// All columns that a figure may have; a file holds those of the kinds of panel that the figure has.
const COLUMNS: [&str; 15] = [
    "panel", "method", "note", "x", "y", "along", "low", "high", "value", "row", "column", "winner", "strength",
    "text", "detail",
];

/// One line of a file: names of columns and what stands in them.
type Line = Vec<(&'static str, String)>;

/// The numbers of a figure as CSV.
///
/// One line per point of a curve (`panel,method,note,x,y`, and `along` where a curve of the file has it), place of an area
/// (`panel,method,note,x,low,high`), value of a box (`panel,method,note,value`) or cell of a map
/// (`panel,row,column,winner,strength,text,detail`); a figure with several kinds of panel has the columns of all of them,
/// empty where they do not apply. All values are there, none is thinned. Methods appear by their labels, panels by their
/// titles or, where these do not distinguish them, by their numbers from 1. Numbers are the shortest that read back as they
/// were; NaN is an empty field.
///
/// ```
/// use youla_report::data::DrawnMethod;
/// use youla_report::figure::{Content, Figure, Panel, Sample};
/// let sample = Sample { method: "direct".into(), note: String::new(), values: vec![0.1, f64::NAN] };
/// let panel = Panel { title: "fit".into(), content: Content::Boxes(vec![sample]), ..Panel::default() };
/// let file = youla_report::figure_csv(&Figure { panels: vec![panel], ..Figure::default() }, &[DrawnMethod::direct()]);
/// assert_eq!(file, "panel,method,note,value\nfit,direct N4SID,,0.1\nfit,direct N4SID,,\n");
/// ```
pub fn figure_csv(figure: &Figure, methods: &[DrawnMethod]) -> String {
    let label = |key: &str| match methods.iter().find(|method| method.key == key) {
        Some(method) => method.label.clone(),
        None => key.to_owned(),
    };
    let names = panel_names(&figure.panels);
    let panels = figure.panels.iter().zip(&names);
    let lines: Vec<Line> = panels.flat_map(|(panel, name)| lines(panel, name, &label)).collect();
    let has = |column: &&str| lines.iter().flatten().any(|(name, _)| name == column);
    let kept: Vec<&str> = COLUMNS.into_iter().filter(has).collect();
    let header = kept.iter().map(|column| (*column).to_owned()).collect();
    let field = |line: &Line, column: &str| line.iter().find(|(name, _)| *name == column).map(|(_, text)| text.clone());
    let row = |line: &Line| kept.iter().map(|column| field(line, column).unwrap_or_default()).collect();
    written(std::iter::once(header).chain(lines.iter().map(row)))
}

/// A table as CSV; a heading below a group is written `group: heading`.
///
/// ```
/// use youla_report::story::{TableRow, Table};
/// let row = TableRow { method: String::new(), cells: vec!["direct".into(), "\u{2212}12.5".into()] };
/// let table = Table {
///     groups: vec![(String::new(), 1), ("horizontal".into(), 1)],
///     header: vec!["method".into(), "fit".into()],
///     rows: vec![row],
///     ..Table::default()
/// };
/// assert_eq!(youla_report::table_csv(&table), "method,horizontal: fit\ndirect,-12.5\n");
/// ```
pub fn table_csv(table: &Table) -> String {
    let groups = table.groups.iter().flat_map(|(name, count)| std::iter::repeat_n(name.as_str(), *count));
    let heading = |(heading, group): (&String, &str)| match (heading.as_str(), group) {
        (heading, "") => heading.to_owned(),
        ("", group) => group.to_owned(),
        (heading, group) => format!("{group}: {heading}"),
    };
    let header = table.header.iter().zip(groups.chain(std::iter::repeat(""))).map(heading).collect();
    let rows = table.rows.iter().map(|row| row.cells.iter().map(|cell| plain(cell)).collect());
    written(std::iter::once(header).chain(rows))
}

/// A number as programs write it: the minus sign of print is not read by them.
fn plain(cell: &str) -> String {
    let number = cell.replace('\u{2212}', "-");
    if number.parse::<f64>().is_ok() { number } else { cell.to_owned() }
}

fn panel_names(panels: &[Panel]) -> Vec<String> {
    let unique = |title: &str| !title.is_empty() && panels.iter().filter(|panel| panel.title == title).count() == 1;
    let name =
        |(k, panel): (usize, &Panel)| if unique(&panel.title) { panel.title.clone() } else { (k + 1).to_string() };
    panels.iter().enumerate().map(name).collect()
}

fn lines(panel: &Panel, name: &str, label: &dyn Fn(&str) -> String) -> Vec<Line> {
    let mut lines = match &panel.content {
        Content::Curves(curves) => curves.iter().flat_map(|curve| points(curve, label)).collect(),
        Content::Boxes(samples) => samples.iter().flat_map(|sample| values(sample, label)).collect(),
        Content::Cells(cells) => map(cells, label),
    };
    lines.extend(panel.regions.iter().flat_map(|region| edges(region, label)));
    lines.iter_mut().for_each(|line| line.push(("panel", name.to_owned())));
    lines
}

fn points(curve: &Curve, label: &dyn Fn(&str) -> String) -> Vec<Line> {
    let along = curve.along.iter().copied().map(Some).chain(std::iter::repeat(None));
    let line = |((x, y), along): ((&f64, &f64), Option<f64>)| {
        let point = [("x", number(*x)), ("y", number(*y))];
        of(label(&curve.method), &curve.note, point.into_iter().chain(along.map(|value| ("along", number(value)))))
    };
    curve.x.iter().zip(&curve.y).zip(along).map(line).collect()
}

fn edges(region: &Area, label: &dyn Fn(&str) -> String) -> Vec<Line> {
    let line = |(x, (low, high)): (&f64, (&f64, &f64))| {
        of(label(&region.method), &region.note, [("x", number(*x)), ("low", number(*low)), ("high", number(*high))])
    };
    region.x.iter().zip(region.low.iter().zip(&region.high)).map(line).collect()
}

fn values(sample: &Sample, label: &dyn Fn(&str) -> String) -> Vec<Line> {
    let line = |value: &f64| of(label(&sample.method), &sample.note, [("value", number(*value))]);
    sample.values.iter().map(line).collect()
}

fn of(method: String, note: &str, rest: impl IntoIterator<Item = (&'static str, String)>) -> Line {
    [("method", method), ("note", note.to_owned())].into_iter().chain(rest).collect()
}

fn map(cells: &Cells, label: &dyn Fn(&str) -> String) -> Vec<Line> {
    let places = cells.rows.iter().flat_map(|row| cells.columns.iter().map(move |column| (row, column)));
    let line = |((row, column), cell): ((&String, &String), &Cell)| {
        let winner = if cell.method.is_empty() { String::new() } else { label(&cell.method) };
        let (row, column) = (("row", row.clone()), ("column", column.clone()));
        let texts = [("text", cell.text.clone()), ("detail", cell.detail.clone())];
        [row, column, ("winner", winner), ("strength", number(cell.strength))].into_iter().chain(texts).collect()
    };
    places.zip(&cells.cells).map(line).collect()
}

fn number(value: f64) -> String {
    match value {
        value if value.is_nan() => String::new(),
        // Without an exponent these would be rows of zeros.
        value if value != 0.0 && value.is_finite() && !(1e-7..1e15).contains(&value.abs()) => format!("{value:e}"),
        value => value.to_string(),
    }
}

fn written(lines: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = ::csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    for line in lines {
        writer.write_record(&line).expect("writing to memory does not fail");
    }
    let bytes = writer.into_inner().expect("writing to memory does not fail");
    String::from_utf8(bytes).expect("fields are text")
}

#[cfg(test)]
mod tests {
    use super::super::story::TableRow;
    use super::*;

    fn read(file: &str) -> Vec<Vec<String>> {
        let mut reader = ::csv::ReaderBuilder::new().has_headers(false).from_reader(file.as_bytes());
        reader.records().map(|record| record.unwrap().iter().map(str::to_owned).collect()).collect()
    }

    fn panel(title: &str, content: Content) -> Panel {
        Panel { title: title.into(), content, ..Panel::default() }
    }

    #[test]
    fn curves_read_back_to_the_same_bits() {
        let y = vec![0.1 + 0.2, f64::NAN, -1.0 / 3.0, 1e300, 5e-324, -0.0, f64::NEG_INFINITY];
        let x: Vec<f64> = (0..y.len()).map(|k| k as f64 * 0.1).collect();
        let curve =
            Curve { method: "pem".into(), note: "a, \"b\"".into(), x: x.clone(), y: y.clone(), ..Curve::default() };
        let figure = Figure { panels: vec![panel("one", Content::Curves(vec![curve]))], ..Figure::default() };
        let lines = read(&figure_csv(&figure, &[DrawnMethod::pem()]));
        assert_eq!(lines[0], ["panel", "method", "note", "x", "y"]);
        assert_eq!(lines.len(), 1 + y.len());
        for (line, (x, y)) in lines[1..].iter().zip(x.iter().zip(&y)) {
            assert_eq!(line[..3], ["one", "PEM", "a, \"b\""]);
            assert_eq!(line[3].parse::<f64>().unwrap().to_bits(), x.to_bits());
            match line[4].as_str() {
                "" => assert!(y.is_nan()),
                field => assert_eq!(field.parse::<f64>().unwrap().to_bits(), y.to_bits()),
            }
        }
    }

    #[test]
    fn kinds_of_panels_share_a_file_and_equal_titles_become_numbers() {
        let cell = Cell { method: "hansen".into(), strength: 0.5, text: "+12".into(), detail: "clear".into() };
        let cells = Cells { columns: vec!["c".into()], rows: vec!["r".into()], cells: vec![cell] };
        let sample = Sample { method: "unknown".into(), note: String::new(), values: vec![2.0] };
        let panels = vec![panel("", Content::Cells(cells)), panel("", Content::Boxes(vec![sample]))];
        let file = figure_csv(&Figure { panels, ..Figure::default() }, &[DrawnMethod::hansen()]);
        let lines = read(&file);
        assert_eq!(
            lines[0],
            ["panel", "method", "note", "value", "row", "column", "winner", "strength", "text", "detail"]
        );
        assert_eq!(lines[1], ["1", "", "", "", "r", "c", "Hansen G(S)", "0.5", "+12", "clear"]);
        assert_eq!(lines[2], ["2", "unknown", "", "2", "", "", "", "", "", ""]);
    }

    #[test]
    fn areas_and_what_belongs_to_a_point_have_columns_of_their_own() {
        let curve = Curve { method: "pem".into(), x: vec![1.0], y: vec![2.0], along: vec![3.0], ..Curve::default() };
        let region =
            Area { method: "pem".into(), note: "95 %".into(), x: vec![1.0], low: vec![-1.5], high: vec![f64::NAN] };
        let content = Content::Curves(vec![curve]);
        let panels = vec![Panel { title: "one".into(), content, regions: vec![region], ..Panel::default() }];
        let lines = read(&figure_csv(&Figure { panels, ..Figure::default() }, &[DrawnMethod::pem()]));
        assert_eq!(lines[0], ["panel", "method", "note", "x", "y", "along", "low", "high"]);
        assert_eq!(lines[1], ["one", "PEM", "", "1", "2", "3", "", ""]);
        assert_eq!(lines[2], ["one", "PEM", "95 %", "1", "", "", "-1.5", ""]);
    }

    #[test]
    fn tables_have_one_header_and_plain_numbers() {
        let row = |cells: [&str; 3]| TableRow { method: String::new(), cells: cells.map(String::from).to_vec() };
        let table = Table {
            groups: vec![("record".into(), 1), ("fit, %".into(), 2)],
            header: vec![String::new(), "direct".into(), "Hansen".into()],
            rows: vec![row(["first", "\u{2212}3.5", "–"]), row(["a \u{2212} b", "1e-3", ""])],
            ..Table::default()
        };
        let lines = read(&table_csv(&table));
        assert_eq!(lines[0], ["record", "fit, %: direct", "fit, %: Hansen"]);
        assert_eq!(lines[1], ["first", "-3.5", "–"]);
        assert_eq!(lines[2], ["a \u{2212} b", "1e-3", ""]);
    }
}
