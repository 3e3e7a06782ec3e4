//! Values by their path, written as in MATLAB: `Data.signals.u`, `runs(2).y`, `names{3}`, `x(:,2)`; `#3` is the third variable.

use super::{Value, Variables};
use crate::error::{Error, Result};
use youla::signal::unknown;

/// Rows and columns of an array without numbers, which may state any.
const MOST_EMPTY: usize = 1 << 20;

impl Variables {
    /// The value at a path of variable, fields and indices (counted from 1).
    ///
    /// # Errors
    /// [`youla::Error::UnknownChannel`] with the paths of all values that are there.
    pub fn get(&self, path: &str) -> Result<&Value> {
        self.find(path).ok_or_else(|| self.unknown(path))
    }

    /// The real vector at a path, or one column of a matrix by `x(:,2)`.
    ///
    /// # Errors
    /// [`youla::Error::UnknownChannel`] for a path that does not exist, [`Error::WrongVariable`] for a value that is not one
    /// column of real numbers.
    pub fn column(&self, path: &str) -> Result<Vec<f64>> {
        let (stem, number) = split_column(path);
        let value = self.get(stem)?;
        let wrong = |must| Error::WrongVariable {
            path: self.path.clone(),
            name: path.to_owned(),
            found: value.description(),
            must,
        };
        let Value::Real { dims, data } = value else { return Err(wrong("a vector of real numbers")) };
        let (rows, columns) = match dims[..] {
            [1, n] if number.is_none() => (n, 1),
            [rows, columns] => (rows, columns),
            _ => return Err(wrong("a vector of real numbers")),
        };
        match number {
            None if columns == 1 => Ok(data.clone()),
            None => Err(wrong("a vector; choose a column, for example by adding (:,1)")),
            Some(j) if (1..=columns).contains(&j) => Ok(data[(j - 1) * rows..j * rows].to_vec()),
            Some(_) => Err(wrong("a matrix that has this column")),
        }
    }

    /// The real matrix at a path.
    ///
    /// # Errors
    /// [`youla::Error::UnknownChannel`] or [`Error::WrongVariable`].
    pub fn matrix(&self, path: &str) -> Result<faer::Mat<f64>> {
        match self.get(path)? {
            Value::Real { dims, data }
                if dims.len() == 2 && (!data.is_empty() || dims.iter().all(|size| *size <= MOST_EMPTY)) =>
            {
                Ok(faer::MatRef::from_column_major_slice(data, dims[0], dims[1]).to_owned())
            }
            value => Err(Error::WrongVariable {
                path: self.path.clone(),
                name: path.to_owned(),
                found: value.description(),
                must: "a matrix of real numbers",
            }),
        }
    }

    /// The real number at a path.
    ///
    /// # Errors
    /// [`youla::Error::UnknownChannel`] or [`Error::WrongVariable`].
    pub fn scalar(&self, path: &str) -> Result<f64> {
        match self.column(path)?[..] {
            [value] => Ok(value),
            ref values => Err(Error::WrongVariable {
                path: self.path.clone(),
                name: path.to_owned(),
                found: format!("{} numbers", values.len()),
                must: "one number",
            }),
        }
    }

    /// Paths of all values that are not structs or cells themselves, at most 200.
    pub fn leaves(&self) -> Vec<String> {
        let mut out = Vec::new();
        self.variables.iter().for_each(|variable| leaves(variable.name.clone(), &variable.value, &mut out));
        out
    }

    pub(super) fn unknown(&self, path: &str) -> Error {
        unknown(&self.path.display().to_string(), path, self.leaves()).into()
    }

    /// A variable by its whole name or its number before a path into one: columns of a table may be named `speed [1/min] (x.1)`.
    fn find(&self, path: &str) -> Option<&Value> {
        let number = || path.strip_prefix('#')?.parse::<usize>().ok()?.checked_sub(1);
        let whole = self.variables.iter().find(|variable| variable.name == path);
        if let Some(variable) = whole.or_else(|| self.variables.get(number()?)) {
            return Some(&variable.value);
        }
        let (name, mut rest) = take_name(path);
        let mut value = &self.variables.iter().find(|variable| variable.name == name)?.value;
        while !rest.is_empty() {
            (value, rest) = step(value, rest)?;
        }
        Some(value)
    }
}

/// Goes one field, one element or one element and its field down.
fn step<'a, 'p>(value: &'a Value, rest: &'p str) -> Option<(&'a Value, &'p str)> {
    match value {
        Value::Cell { items, .. } => {
            let (index, rest) = take_index(rest, '{', '}')?;
            Some((items.get(index)?, rest))
        }
        Value::Struct { fields, items, .. } => {
            let (index, rest) = match take_index(rest, '(', ')') {
                Some(found) => found,
                None if items.len() == fields.len() => (0, rest),
                None => return None,
            };
            let (name, rest) = take_name(rest.strip_prefix('.')?);
            let field = fields.iter().position(|f| f == name)?;
            Some((items.get(index.checked_mul(fields.len())?.checked_add(field)?)?, rest))
        }
        _ => None,
    }
}

/// A name up to the next `.`, `(` or `{`.
fn take_name(text: &str) -> (&str, &str) {
    text.split_at(text.find(['.', '(', '{']).unwrap_or(text.len()))
}

/// An index in brackets, returned counted from 0.
fn take_index(text: &str, open: char, close: char) -> Option<(usize, &str)> {
    let (digits, rest) = text.strip_prefix(open)?.split_once(close)?;
    Some((digits.trim().parse::<usize>().ok()?.checked_sub(1)?, rest))
}

/// Takes `(:,j)` off the end of a path.
fn split_column(path: &str) -> (&str, Option<usize>) {
    let column = || {
        let (stem, index) = path.strip_suffix(')')?.rsplit_once('(')?;
        let number = index.trim().strip_prefix(':')?.trim().strip_prefix(',')?.trim().parse().ok()?;
        Some((stem, Some(number)))
    };
    column().unwrap_or((path, None))
}

fn leaves(path: String, value: &Value, out: &mut Vec<String>) {
    const MOST: usize = 200;
    if out.len() >= MOST {
        return;
    }
    match value {
        Value::Struct { fields, items, .. } => {
            for (k, item) in items.iter().enumerate().take(MOST) {
                let index =
                    if items.len() > fields.len() { format!("({})", k / fields.len() + 1) } else { String::new() };
                leaves(format!("{path}{index}.{}", fields[k % fields.len()]), item, out);
            }
        }
        Value::Cell { items, .. } => {
            for (k, item) in items.iter().enumerate().take(MOST) {
                leaves(format!("{path}{{{}}}", k + 1), item, out);
            }
        }
        _ => out.push(path),
    }
}
