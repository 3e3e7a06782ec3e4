//! Texts to expressions: names to numbers, entries to matrices.

use super::declaration::{Declaration, Entry};
use super::expression::{CONSTANTS, FUNCTIONS};
use super::parser::{Problem, is_name, parse};
use super::{Cell, Formula, Quantity};
use crate::Matrix;
use crate::{Error, Result};
use faer::Mat;
use indexmap::IndexMap;
use youla::error::nearest_name;

/// The names that expressions may use; parameters come first.
pub(super) struct Names<'a> {
    known: Vec<&'a str>,
}

impl<'a> Names<'a> {
    pub(super) fn new(whole: &'a Declaration) -> Result<Self> {
        let known: Vec<&str> = whole.parameters.keys().chain(whole.derived.keys()).map(String::as_str).collect();
        for (k, name) in known.iter().enumerate() {
            let problem = if !is_name(name) {
                "must consist of letters, digits and _ and not begin with a digit"
            } else if FUNCTIONS.contains(name) || CONSTANTS.contains(name) {
                "is that of a function or constant of expressions"
            } else if known[..k].contains(name) {
                "is declared twice"
            } else {
                continue;
            };
            return Err(Error::BadName { name: (*name).to_owned(), problem });
        }
        Ok(Names { known })
    }

    fn formula(&self, place: impl Fn() -> String, text: &str) -> Result<Formula> {
        let number_of = |name: &str| self.known.iter().position(|known| *known == name);
        let text = text.to_owned();
        match parse(&text, &number_of) {
            Ok(expression) => Ok(Formula { text, expression, moved_by: Vec::new() }),
            Err(Problem::Syntax { column, problem }) => {
                Err(Error::Expression { place: place(), text, column, problem })
            }
            Err(Problem::Unknown { name }) => {
                let nearest = nearest_name(&name, self.known.iter().copied()).map(str::to_owned);
                let known = self.known.iter().map(|name| (*name).to_owned()).collect();
                Err(Error::UnknownName { place: place(), text, name, known, nearest })
            }
        }
    }

    pub(super) fn derived(&self, declared: &IndexMap<String, String>) -> Result<Vec<Quantity>> {
        let quantity = |(name, text): (&String, &String)| {
            let formula = self.formula(|| Quantity::place_of(name), text)?;
            Ok(Quantity { name: name.clone(), formula })
        };
        declared.iter().map(quantity).collect()
    }

    /// The numbers of the four matrices, and their entries that are expressions.
    pub(super) fn matrices(&self, whole: &Declaration) -> Result<([Mat<f64>; 4], Vec<Cell>)> {
        let (a, b, c) = (required("a", &whole.a)?, required("b", &whole.b)?, required("c", &whole.c)?);
        let (n, m, p) = (a.len(), b.first().map_or(0, Vec::len), c.len());
        for (count, what) in [(n, "rows of a"), (m, "columns of b"), (p, "rows of c")] {
            if count == 0 {
                let (what, value, must) = (format!("the number of {what}"), 0.0, "at least 1");
                return Err(Error::Method(youla::Error::OutOfRange { what, value, must }));
            }
        }
        let mut cells = Vec::new();
        let mut take = |matrix: Matrix, rows: &[Vec<Entry>], columns: usize, expected: usize| {
            self.matrix(matrix, rows, (expected, columns), &mut cells)
        };
        let numbers = [
            take(Matrix::A, a, n, n)?,
            take(Matrix::B, b, m, n)?,
            take(Matrix::C, c, n, p)?,
            match &whole.d {
                Some(d) => take(Matrix::D, d, m, p)?,
                None => Mat::zeros(p, m),
            },
        ];
        Ok((numbers, cells))
    }

    fn matrix(
        &self,
        matrix: Matrix,
        rows: &[Vec<Entry>],
        (expected, columns): (usize, usize),
        cells: &mut Vec<Cell>,
    ) -> Result<Mat<f64>> {
        let letter = Cell::letter(matrix);
        if rows.len() != expected {
            let found = (rows.len(), rows.first().map_or(0, Vec::len));
            return Err(Error::Method(youla::Error::Shape {
                what: format!("the matrix {letter}"),
                expected: (expected, columns),
                found,
            }));
        }
        if let Some(row) = rows.iter().position(|row| row.len() != columns) {
            let what = format!("row {} of the matrix {letter}", row + 1);
            return Err(Error::Method(youla::Error::Shape {
                what,
                expected: (1, columns),
                found: (1, rows[row].len()),
            }));
        }
        let mut numbers = Mat::zeros(expected, columns);
        for (row, entries) in rows.iter().enumerate() {
            for (column, entry) in entries.iter().enumerate() {
                let place = || Cell::place_of(matrix, row, column);
                match entry {
                    Entry::Number(value) => {
                        finite(place, &value.to_string(), *value, None)?;
                        numbers[(row, column)] = *value;
                    }
                    Entry::Expression(text) => {
                        let formula = self.formula(place, text)?;
                        cells.push(Cell { matrix, row, column, formula });
                    }
                }
            }
        }
        Ok(numbers)
    }
}

fn required<'a>(matrix: &'static str, rows: &'a Option<Vec<Vec<Entry>>>) -> Result<&'a [Vec<Entry>]> {
    rows.as_deref().ok_or(Error::MissingMatrix { matrix })
}

/// Refuses a value, or a derivative with respect to a parameter, that is not finite.
pub(super) fn finite(place: impl Fn() -> String, text: &str, value: f64, parameter: Option<&str>) -> Result<()> {
    if value.is_finite() {
        return Ok(());
    }
    let parameter = parameter.map(str::to_owned);
    Err(Error::EntryNotFinite { place: place(), text: text.to_owned(), value, parameter })
}
