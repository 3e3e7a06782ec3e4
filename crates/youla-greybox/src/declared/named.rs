//! An expression of named quantities by itself, for example of the channels of a record.

use super::dual::Dual;
use super::expression::{CONSTANTS, Expression};
use super::parser::{Problem, parse};
use crate::{Error, Result};
use std::cell::RefCell;

/// An expression and the names in it.
///
/// ```
/// use youla_greybox::NamedExpression;
/// let friction = NamedExpression::new("friction", "tanh(speed / 0.5) - '#3'")?;
/// assert_eq!(friction.names(), ["speed", "#3"]);
/// assert_eq!(friction.value(&[0.0, 2.0]), -2.0);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct NamedExpression {
    names: Vec<String>,
    expression: Expression,
}

impl NamedExpression {
    /// Reads a text; `place` names it in errors. Every name is a quantity but those of functions and constants; a name in single
    /// quotes may hold any character.
    ///
    /// # Errors
    /// [`Error::Expression`] with the character at which the text is wrong.
    pub fn new(place: &str, text: &str) -> Result<Self> {
        let names = RefCell::new(Vec::<String>::new());
        let number_of = |name: &str| {
            if CONSTANTS.contains(&name) {
                return None;
            }
            let mut names = names.borrow_mut();
            let known = names.iter().position(|known| known == name);
            Some(known.unwrap_or_else(|| {
                names.push(name.to_owned());
                names.len() - 1
            }))
        };
        let parsed = parse(text, &number_of);
        let (place, text) = (place.to_owned(), text.to_owned());
        match parsed {
            Ok(expression) => Ok(NamedExpression { names: names.into_inner(), expression }),
            Err(Problem::Syntax { column, problem }) => Err(Error::Expression { place, text, column, problem }),
            Err(Problem::Unknown { name }) => {
                let problem = format!("{name} is not a channel");
                Err(Error::Expression { place, text, column: 1, problem })
            }
        }
    }

    /// The names in it, each once, in order of appearance.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The value where [`NamedExpression::names`] have the given values; not a number where one is missing.
    pub fn value(&self, values: &[f64]) -> f64 {
        if values.len() < self.names.len() {
            return f64::NAN;
        }
        let values: Vec<Dual> = values.iter().copied().map(Dual::constant).collect();
        self.expression.evaluate(&values).value
    }
}
