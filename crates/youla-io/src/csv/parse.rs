//! From lines to cells, and from the chosen cells to numbers.

use super::lines::Lines;
use super::options::{CsvOptions, DecimalSign, Delimiter, HeaderLine};
use crate::choose::ChannelRef;
use crate::error::{Error, Result};
use crate::time::require_seconds;
use std::borrow::Cow;
use std::collections::HashSet;
use toml::value::Offset;

/// Most columns of a table. Rows are samples; a compressed file of some kilobytes may contain millions of cells on one line.
const MOST_COLUMNS: usize = 1 << 16;

/// Most numbers of the chosen columns, 400 MB: a compressed file of some megabytes may hold far more.
const MOST_NUMBERS: usize = 50_000_000;

/// The dialect of a text file and its columns.
pub(super) struct Fields {
    delimiter: Option<u8>,
    decimal: DecimalSign,
    names: Vec<String>,
}

impl Fields {
    /// Reads the first line that is not a comment; keeps it for the data if it contains numbers.
    pub(super) fn detect(lines: &mut Lines, options: &CsvOptions) -> Result<Fields> {
        let decimal = options.decimal;
        lines.skip(&options.skip_lines);
        if decimal == DecimalSign::Comma && options.delimiter == Delimiter::Comma {
            let problem =
                "the comma cannot be both the delimiter and the decimal sign; declare another delimiter".into();
            return Err(Error::Delimiter { path: lines.path().to_owned(), problem });
        }
        if !lines.advance()? {
            return Err(no_rows(lines));
        }
        if lines.current().contains(&0) {
            let (found, remedy) = ("a binary file (zero bytes in its first line)", "save it as text in UTF-8");
            return Err(Error::FormatNotRead { path: lines.path().to_owned(), found, remedy });
        }
        let delimiter = match options.delimiter {
            Delimiter::Detect => detect_delimiter(lines, decimal)?,
            Delimiter::Comma => Some(b','),
            Delimiter::Semicolon => Some(b';'),
            Delimiter::Tab => Some(b'\t'),
            Delimiter::Whitespace => None,
        };
        let cells = header_cells(lines, delimiter);
        if cells.len() > MOST_COLUMNS {
            let (found, remedy) =
                ("a table of more than 65536 columns", "write samples as rows and channels as columns");
            return Err(Error::FormatNotRead { path: lines.path().to_owned(), found, remedy });
        }
        let named = match options.header {
            HeaderLine::Present => true,
            HeaderLine::Absent => false,
            HeaderLine::Detect => !cells.iter().any(|cell| is_number(cell.as_bytes())),
        };
        if !named {
            lines.hold();
            return Ok(Fields { delimiter, decimal, names: (1..=cells.len()).map(|j| format!("#{j}")).collect() });
        }
        let mut names = HashSet::new();
        match cells.iter().find(|cell| !names.insert(*cell)) {
            Some(name) => Err(Error::Method(youla::Error::DuplicateChannel {
                what: lines.path().display().to_string(),
                name: name.clone(),
            })),
            None => Ok(Fields { delimiter, decimal, names: cells }),
        }
    }

    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// The number in a column of a line.
    pub(super) fn number(&self, line: &[u8], column: usize) -> Option<f64> {
        number(self.cells(line).get(column)?, self.decimal)
    }

    /// The cells of a line.
    fn cells<'b>(&self, line: &'b [u8]) -> Vec<&'b [u8]> {
        match self.delimiter {
            Some(delimiter) => line.split(|&b| b == delimiter).collect(),
            None => line.split(|b| b.is_ascii_whitespace()).filter(|cell| !cell.is_empty()).collect(),
        }
    }

    /// Refuses a time column in another unit than the second, by its name or by a line before the numbers that has a cell for each
    /// column.
    pub(super) fn require_seconds(&self, lines: &mut Lines, column: &ChannelRef) -> Result<()> {
        let what = lines.path().display().to_string();
        let index = column.index(&what, &self.names)?;
        let name = &self.names[index];
        require_seconds(&what, name, name)?;
        if lines.advance()? {
            lines.hold();
        }
        for line in lines.passed() {
            let cells = self.cells(line);
            if cells.len() == self.names.len() {
                require_seconds(&what, name, decoded(cells[index]).trim())?;
            }
        }
        Ok(())
    }

    /// Reads all remaining lines; of a column that has a cell that is no number, the error of the first one. With `blanks`, an empty cell or
    /// `nan` is read as NaN.
    pub(super) fn read_each(&self, lines: &mut Lines, blanks: bool) -> Result<Vec<Result<Vec<f64>>>> {
        let expected = self.names.len();
        let mut columns: Vec<Result<Vec<f64>>> = self.names.iter().map(|_| Ok(Vec::new())).collect();
        let mut rows = 0;
        while lines.advance()? {
            let cells = self.cells(lines.current());
            if cells.len() != expected {
                return Err(self.bad_count(lines, cells.len()));
            }
            for (k, (column, cell)) in columns.iter_mut().zip(cells).enumerate() {
                let Ok(values) = column else { continue };
                match number(cell, self.decimal) {
                    Some(value) => values.push(value),
                    None if blanks && is_blank(cell) => values.push(f64::NAN),
                    None => *column = Err(self.bad_cell(lines, k, cell)),
                }
            }
            rows += 1;
            require_room(lines, rows * columns.iter().filter(|c| c.is_ok()).count())?;
        }
        if rows == 0 { Err(no_rows(lines)) } else { Ok(columns) }
    }

    /// Too many or too few cells; where quotes hold the delimiter, as a separator of thousands, the cell with them.
    fn bad_count(&self, lines: &Lines, found: usize) -> Error {
        let (path, line, expected) = (lines.path().to_owned(), lines.number(), self.names.len());
        let cells = header_cells(lines, self.delimiter);
        let delimiter = self.delimiter.map(char::from).filter(|_| cells.len() == expected);
        let quoted = delimiter.and_then(|delimiter| cells.iter().position(|cell| cell.contains(delimiter)));
        match quoted {
            Some(column) => self.bad_cell(lines, column, cells[column].as_bytes()),
            None => Error::FieldCount { path, line, found, expected },
        }
    }

    fn bad_cell(&self, lines: &Lines, column: usize, cell: &[u8]) -> Error {
        let text = decoded(cell).trim().chars().take(40).collect();
        let other = self.decimal.other();
        let decimal = number(cell, other).map(|_| other.key());
        let (path, column) = (lines.path().to_owned(), self.names[column].clone());
        Error::Cell { path, line: lines.number(), column, text, decimal }
    }
}

fn require_room(lines: &Lines, numbers: usize) -> Result<()> {
    if numbers <= MOST_NUMBERS {
        return Ok(());
    }
    let (found, remedy) = ("a table of more than 50 million numbers", "choose fewer rows or columns");
    Err(Error::FormatNotRead { path: lines.path().to_owned(), found, remedy })
}

/// The columns to read as numbers.
pub(super) struct Selection {
    /// How many.
    columns: usize,
    /// The positions in `columns` that each column of the file goes to.
    targets: Vec<Vec<usize>>,
}

impl Selection {
    pub(super) fn new(fields: &Fields, columns: &[usize]) -> Self {
        let mut targets = vec![Vec::new(); fields.names.len()];
        for (position, &column) in columns.iter().enumerate() {
            targets[column].push(position);
        }
        Selection { columns: columns.len(), targets }
    }

    /// Reads all remaining lines; one vector for each chosen column.
    pub(super) fn read(&self, fields: &Fields, lines: &mut Lines) -> Result<Vec<Vec<f64>>> {
        let mut out = vec![Vec::new(); self.columns];
        let mut rows = 0;
        while self.next(fields, lines, |position, value| out[position].push(value))? {
            rows += 1;
            require_room(lines, rows * self.columns)?;
        }
        if out.iter().all(Vec::is_empty) { Err(no_rows(lines)) } else { Ok(out) }
    }

    /// Reads one line, each number with its position among the chosen columns; false at the end.
    pub(super) fn next(&self, fields: &Fields, lines: &mut Lines, put: impl FnMut(usize, f64)) -> Result<bool> {
        if !lines.advance()? {
            return Ok(false);
        }
        let found = match fields.delimiter {
            Some(delimiter) => self.row(fields, lines, lines.current().split(|&b| b == delimiter), put)?,
            None => {
                let cells = lines.current().split(|b| b.is_ascii_whitespace()).filter(|cell| !cell.is_empty());
                self.row(fields, lines, cells, put)?
            }
        };
        if found != self.targets.len() {
            return Err(fields.bad_count(lines, found));
        }
        Ok(true)
    }

    /// Reads the cells of one line and returns their number.
    fn row<'b>(
        &self,
        fields: &Fields,
        lines: &Lines,
        cells: impl Iterator<Item = &'b [u8]> + Clone,
        mut put: impl FnMut(usize, f64),
    ) -> Result<usize> {
        let mut found = 0;
        for cell in cells.clone() {
            for &position in self.targets.get(found).into_iter().flatten() {
                match number(cell, fields.decimal) {
                    Some(value) => put(position, value),
                    None => return Err(self.bad_cell(fields, lines, cells.count(), found, cell)),
                }
            }
            found += 1;
        }
        Ok(found)
    }

    /// A line with a field too many or too few is reported as that, not as the cell that moved.
    fn bad_cell(&self, fields: &Fields, lines: &Lines, found: usize, column: usize, cell: &[u8]) -> Error {
        if found == self.targets.len() { fields.bad_cell(lines, column, cell) } else { fields.bad_count(lines, found) }
    }
}

/// The only one of comma, semicolon and tab on the line; `None` means blanks. A decimal comma is no delimiter.
///
/// A line of numbers with tabs and blanks is read as blank separated where the count of cells is the same, because a
/// tab may be at the end of the line.
fn detect_delimiter(lines: &Lines, decimal: DecimalSign) -> Result<Option<u8>> {
    const CANDIDATES: [(u8, &str); 3] = [(b',', "a comma"), (b';', "a semicolon"), (b'\t', "a tab")];
    let line = lines.current().trim_ascii();
    let candidates = &CANDIDATES[usize::from(decimal == DecimalSign::Comma)..];
    let found: Vec<_> = candidates.iter().filter(|(delimiter, _)| line.contains(delimiter)).collect();
    match found[..] {
        [] => Ok(None),
        [(b'\t', _)] => {
            let blank_separated = line.split(|b| b.is_ascii_whitespace()).filter(|cell| !cell.is_empty()).count();
            let tab_separated = line.split(|&b| b == b'\t').count();
            Ok((tab_separated != blank_separated).then_some(b'\t'))
        }
        [(delimiter, _)] => Ok(Some(*delimiter)),
        _ => {
            let names: Vec<_> = found.iter().map(|(_, name)| *name).collect();
            let (line, names) = (lines.number(), names.join(" and "));
            let problem = format!("line {line} contains {names}; declare it by --delimiter (delimiter in [data] csv)");
            Err(Error::Delimiter { path: lines.path().to_owned(), problem })
        }
    }
}

/// The cells of the first line; names may be quoted.
fn header_cells(lines: &Lines, delimiter: Option<u8>) -> Vec<String> {
    let text = |cell: &[u8]| decoded(cell).trim().to_owned();
    let Some(delimiter) = delimiter else {
        return lines.current().split(|b| b.is_ascii_whitespace()).filter(|c| !c.is_empty()).map(text).collect();
    };
    let mut reader = ::csv::ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .trim(::csv::Trim::All)
        .from_reader(lines.current());
    let mut record = ::csv::ByteRecord::new();
    match reader.read_byte_record(&mut record) {
        Ok(true) => record.iter().map(text).collect(),
        _ => Vec::new(),
    }
}

/// Text as UTF-8 or, where it is none, as Latin-1, which gives each byte a character.
fn decoded(cell: &[u8]) -> Cow<'_, str> {
    std::str::from_utf8(cell).map_or_else(|_| cell.iter().map(|byte| char::from(*byte)).collect(), Cow::Borrowed)
}

/// A cell in which a logger says that a channel has no sample.
fn is_blank(cell: &[u8]) -> bool {
    unquoted(cell).is_some_and(|text| text.trim().is_empty() || text.trim().eq_ignore_ascii_case("nan"))
}

/// A finite number, perhaps in quotes and with blanks around it; of a date with a time the seconds since 1970.
fn number(cell: &[u8], decimal: DecimalSign) -> Option<f64> {
    let text = unquoted(cell)?;
    let value: Option<f64> = match decimal {
        DecimalSign::Point => text.parse().ok(),
        DecimalSign::Comma if text.contains('.') => None,
        DecimalSign::Comma => text.replacen(',', ".", 1).parse().ok(),
    };
    // Few cells are no numbers, so that numbers are not searched for the signs of a date.
    value.or_else(|| instant(text)).filter(|x| x.is_finite())
}

/// Seconds since 1970 of a date with a time such as `2026-03-01T10:00:00.25Z` or `01.03.2026 10:00:00,25`; without an offset as if it were UTC.
fn instant(text: &str) -> Option<f64> {
    let day_first = day_first(text);
    let text = day_first.as_deref().unwrap_or(text);
    let toml::value::Datetime { date: Some(date), time: Some(time), offset } = text.parse().ok()? else { return None };
    let ahead = if let Some(Offset::Custom { minutes }) = offset { i64::from(minutes) } else { 0 };
    // Years from March on: a leap day is the last of its year.
    let (year, month) = (i64::from(date.year), i64::from(date.month));
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + i64::from(date.day) - 719_469;
    let minutes = (24 * days + i64::from(time.hour)) * 60 + i64::from(time.minute) - ahead;
    let seconds = 60 * minutes + i64::from(time.second.unwrap_or(0));
    Some(seconds as f64 + f64::from(time.nanosecond.unwrap_or(0)) / 1e9)
}

/// A date with dots, whose day comes first wherever it is written, with the year first; with slashes either may be the day.
fn day_first(text: &str) -> Option<String> {
    let (date, time) = text.split_once([' ', 'T'])?;
    let mut parts = date.split('.').map(|part| part.parse::<u16>().ok());
    let (Some(Some(day)), Some(Some(month)), Some(Some(year)), None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return None;
    };
    Some(format!("{year:04}-{month:02}-{day:02}T{}", time.replacen(',', ".", 1)))
}

/// Whether a cell of the first line is no name: a number of any kind, with either decimal sign.
fn is_number(cell: &[u8]) -> bool {
    let number = |text: &str| text.parse::<f64>().is_ok() || instant(text).is_some();
    unquoted(cell).is_some_and(|text| number(text) || text.replacen(',', ".", 1).parse::<f64>().is_ok())
}

fn unquoted(cell: &[u8]) -> Option<&str> {
    let cell = cell.trim_ascii();
    let cell = cell.strip_prefix(b"\"").and_then(|c| c.strip_suffix(b"\"")).unwrap_or(cell);
    std::str::from_utf8(cell).ok().map(str::trim)
}

pub(super) fn no_rows(lines: &Lines) -> Error {
    Error::NoData { path: lines.path().to_owned(), problem: "there is no line with data" }
}
