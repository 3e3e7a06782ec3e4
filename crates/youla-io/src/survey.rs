//! The columns of a file before any is chosen: their range, and which of them can be a time column.

use crate::csv::{CsvOptions, read_each};
use crate::error::{Error, Result};
use crate::matfile::read_mat;
use crate::npz::read_npz;
use crate::source::{Format, Source, resolve};
use crate::time::{TimeSource, uniform_step};
use crate::values::{Value, Variables};
use std::path::Path;

/// Most columns of a matrix in a file that are listed one by one.
const MOST_COLUMNS: usize = 64;

/// A column of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyedColumn {
    /// How it is chosen: a name, `#3`, or a path such as `Data.signals.u`.
    pub from: String,
    /// Its content, or the reason why it cannot be a channel.
    pub content: std::result::Result<ColumnContent, String>,
}

/// The numbers of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnContent {
    /// How many there are.
    pub rows: usize,
    /// Smallest.
    pub low: f64,
    /// Largest.
    pub high: f64,
    /// Mean step where each number exceeds the one before by the same amount, to 1e-3 of it: what a clock does.
    pub step: Option<f64>,
    /// Whether most numbers exceed the one before.
    pub rises: bool,
}

/// Lists the columns of a file; `csv` says how a text file is to be read.
///
/// # Errors
/// As [`crate::read`], except for columns with cells that are not finite numbers: [`SurveyedColumn::content`] states those;
/// [`Error::NoData`] for text without any column of numbers.
///
/// ```
/// let file = std::env::temp_dir().join("youla-survey-example.csv");
/// std::fs::write(&file, "t,u\n0.0,1\n0.5,-1\n1.0,2\n")?;
/// let columns = youla_io::survey(&file, &Default::default())?;
/// assert_eq!(columns[0].content.as_ref().unwrap().step, Some(0.5));
/// assert_eq!(columns[1].content.as_ref().unwrap().high, 2.0);
/// # std::fs::remove_file(&file)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn survey(path: impl AsRef<Path>, csv: &CsvOptions) -> Result<Vec<SurveyedColumn>> {
    let path = path.as_ref();
    let source = Source {
        path: path.to_owned(),
        format: Format::Detect,
        time: TimeSource::default(),
        channels: Vec::new(),
        csv: csv.clone(),
    };
    match resolve(&source)? {
        Format::Mat => Ok(of_variables(&read_mat(path)?)),
        Format::Npz => Ok(of_variables(&read_npz(path)?)),
        Format::Csv | Format::Detect => of_text(path, csv),
    }
}

fn of_text(path: &Path, csv: &CsvOptions) -> Result<Vec<SurveyedColumn>> {
    let of = |(name, values): (String, Result<Vec<f64>>)| match values {
        Ok(values) => column(name, &values),
        Err(error) => SurveyedColumn { from: name, content: Err(error.to_string()) },
    };
    let columns: Vec<SurveyedColumn> = read_each(path, csv)?.into_iter().map(of).collect();
    // Another kind of file: its text is nobody's business.
    match columns.iter().any(|c| c.content.is_ok()) {
        true => Ok(columns),
        false => Err(Error::NoData {
            path: path.to_owned(),
            problem: "no column of it holds numbers; for decimal commas add --decimal comma (csv = { decimal = \"comma\" } in [data]), for a line of units --skip-lines with its number (csv = { skip_lines = [2] }); else it is not a log",
        }),
    }
}

/// Vectors, and matrices column by column; single numbers and text are no channels.
fn of_variables(variables: &Variables) -> Vec<SurveyedColumn> {
    let mut found = Vec::new();
    for path in variables.leaves() {
        let Ok(Value::Real { dims, data }) = variables.get(&path) else { continue };
        match dims[..] {
            [rows, columns] if rows.min(columns) == 1 && rows.max(columns) > 1 => found.push(column(path, data)),
            [rows, columns] if rows > 1 && columns <= MOST_COLUMNS => {
                found.extend(data.chunks(rows).enumerate().map(|(j, x)| column(format!("{path}(:,{})", j + 1), x)));
            }
            _ => {}
        }
    }
    found
}

fn column(from: String, values: &[f64]) -> SurveyedColumn {
    if let Some(row) = values.iter().position(|x| !x.is_finite()) {
        return SurveyedColumn { from, content: Err(format!("row {} is not a finite number", row + 1)) };
    }
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    let rises = 2 * values.windows(2).filter(|two| two[1] > two[0]).count() + 1 >= values.len();
    SurveyedColumn {
        from,
        content: Ok(ColumnContent { rows: values.len(), low, high, step: uniform_step(values), rises }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;
    use crate::{Packing, Variable, write_mat};

    #[test]
    fn columns_of_text_are_listed_even_beside_one_that_is_not_numbers() {
        let file = scratch("csv");
        std::fs::write(file.path(), "t,mode,y\n0.1,on,3\n0.2,off,-4\n0.3,on,5\n").unwrap();
        let columns = survey(file.path(), &CsvOptions::default()).unwrap();
        let names: Vec<&str> = columns.iter().map(|c| c.from.as_str()).collect();
        assert_eq!(names, ["t", "mode", "y"]);
        let clock = columns[0].content.as_ref().unwrap();
        assert!((clock.step.unwrap() - 0.1).abs() < 1e-15);
        assert!(columns[1].content.as_ref().unwrap_err().contains("line 2"), "{:?}", columns[1]);
        assert_eq!(columns[2].content, Ok(ColumnContent { rows: 3, low: -4.0, high: 5.0, step: None, rises: true }));
    }

    #[test]
    fn a_text_without_numbers_is_not_shown() {
        let file = scratch("csv");
        std::fs::write(file.path(), "root:secret\ndaemon:secret\n").unwrap();
        let refused = survey(file.path(), &CsvOptions::default()).unwrap_err().to_string();
        assert!(refused.contains("not a log") && !refused.contains("secret"), "{refused}");
    }

    #[test]
    fn matrices_are_listed_column_by_column_and_settings_are_not() {
        let file = scratch("mat");
        let variables = [
            Variable { name: "fs".into(), value: Value::scalar(2000.0) },
            Variable { name: "x".into(), value: Value::Real { dims: vec![2, 2], data: vec![1.0, 2.0, 3.0, f64::NAN] } },
        ];
        write_mat(file.path(), &variables, Packing::Zlib).unwrap();
        let columns = survey(file.path(), &CsvOptions::default()).unwrap();
        assert_eq!(columns.iter().map(|c| c.from.as_str()).collect::<Vec<_>>(), ["x(:,1)", "x(:,2)"]);
        assert_eq!(columns[0].content.as_ref().unwrap().step, Some(1.0));
        assert_eq!(columns[1].content, Err("row 2 is not a finite number".into()));
    }

    /// A German log with a line of units: what mends it is said.
    #[test]
    fn decimal_commas_and_a_line_of_units_are_named() {
        let file = scratch("csv");
        let refused = |text: &str, csv: &CsvOptions| {
            std::fs::write(file.path(), text).unwrap();
            survey(file.path(), csv).map(|_| ()).map_err(|e| e.to_string())
        };
        let message = refused("t;u\n0,1;3,5\n0,2;4,5\n", &CsvOptions::default()).unwrap_err();
        assert!(message.contains("--decimal comma") && message.contains("--skip-lines"), "{message}");
        let comma = CsvOptions { decimal: crate::DecimalSign::Comma, ..CsvOptions::default() };
        assert!(refused("t;u\ns;V\n0,1;3,5\n0,2;4,5\n", &comma).is_err());
        assert_eq!(refused("t;u\n# s;V\n0,1;3,5\n0,2;4,5\n", &comma), Ok(()));
        let without = CsvOptions { skip_lines: vec![1, 3], ..comma };
        assert_eq!(refused("made by a logger\nt;u\ns;V\n0,1;3,5\n0,2;4,5\n", &without), Ok(()));
    }
}
