//! Arithmetic as people write it, by recursive descent.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = signed { ("*" | "/") signed }
//! signed  = { "+" | "-" } power
//! power   = atom [ "^" signed ]              -x^2 = -(x^2),  2^3^2 = 2^9
//! atom    = number | name | "'" any name "'" | function "(" sum ")" | "(" sum ")"
//! ```
//! The depth of nesting is limited, so that no text exhausts the stack.

use super::expression::{CONSTANTS, Expression, FUNCTIONS, Step};
use std::f64::consts::PI;

/// Deepest nesting of parentheses and exponents.
const DEEPEST: usize = 64;

/// Why a text is no expression.
#[derive(Debug, PartialEq)]
pub(super) enum Problem {
    /// The character, counted from 1, and what is wrong there.
    Syntax { column: usize, problem: String },
    /// A name that is not declared.
    Unknown { name: String },
}

/// Reads a text; `number_of` gives the number of a name.
pub(super) fn parse(text: &str, number_of: &dyn Fn(&str) -> Option<usize>) -> Result<Expression, Problem> {
    let mut parser = Parser { text: text.chars().collect(), at: 0, depth: 0, program: Vec::new(), number_of };
    parser.sum()?;
    match parser.peek() {
        None => Ok(Expression::new(parser.program)),
        Some(other) => Err(parser.problem(format!("{other:?} is in the place of an operator"))),
    }
}

/// Whether a text can be the name of a quantity: letters, digits and `_`, no digit first.
pub(super) fn is_name(text: &str) -> bool {
    text.starts_with(begins_name) && text.chars().all(continues_name)
}

fn begins_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

fn continues_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

type Parsed = Result<(), Problem>;

struct Parser<'a> {
    text: Vec<char>,
    at: usize,
    depth: usize,
    program: Vec<Step>,
    number_of: &'a dyn Fn(&str) -> Option<usize>,
}

impl Parser<'_> {
    fn sum(&mut self) -> Parsed {
        self.product()?;
        while let Some(operator) = self.accept(&['+', '-']) {
            self.product()?;
            self.program.push(if operator == '+' { Step::Add } else { Step::Subtract });
        }
        Ok(())
    }

    fn product(&mut self) -> Parsed {
        self.signed()?;
        while let Some(operator) = self.accept(&['*', '/']) {
            self.signed()?;
            self.program.push(if operator == '*' { Step::Multiply } else { Step::Divide });
        }
        Ok(())
    }

    fn signed(&mut self) -> Parsed {
        let mut negative = false;
        while let Some(sign) = self.accept(&['+', '-']) {
            negative ^= sign == '-';
        }
        self.power()?;
        if negative {
            self.program.push(Step::Negate);
        }
        Ok(())
    }

    fn power(&mut self) -> Parsed {
        self.atom()?;
        if self.accept(&['^']).is_some() {
            self.nested(Self::signed)?;
            self.program.push(Step::Power);
        }
        Ok(())
    }

    fn atom(&mut self) -> Parsed {
        match self.peek() {
            Some('(') => self.parentheses(),
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if begins_name(c) => self.name(),
            Some('\'') => self.quoted_name(),
            Some(c) => Err(self.problem(format!("{c:?} is in the place of a number, a name or ("))),
            None => Err(self.problem("it ends where a number, a name or ( is expected".into())),
        }
    }

    fn parentheses(&mut self) -> Parsed {
        self.at += 1;
        self.nested(Self::sum)?;
        match self.accept(&[')']) {
            Some(_) => Ok(()),
            None => Err(self.problem("a closing parenthesis is missing".into())),
        }
    }

    /// Digits with a point and an exponent.
    fn number(&mut self) -> Parsed {
        let start = self.at;
        self.skip(|c| c.is_ascii_digit() || c == '.');
        if matches!(self.text.get(self.at), Some('e' | 'E')) {
            let signed = matches!(self.text.get(self.at + 1), Some('+' | '-'));
            if self.text.get(self.at + 1 + usize::from(signed)).is_some_and(char::is_ascii_digit) {
                self.at += 1 + usize::from(signed);
                self.skip(|c| c.is_ascii_digit());
            }
        }
        let text: String = self.text[start..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => self.program.push(Step::Number(value)),
            _ => return Err(Problem::Syntax { column: start + 1, problem: format!("{text} is not a number") }),
        }
        Ok(())
    }

    fn name(&mut self) -> Parsed {
        let start = self.at;
        self.skip(continues_name);
        let name: String = self.text[start..self.at].iter().collect();
        let function = FUNCTIONS.into_iter().find(|function| *function == name);
        let problem = |problem: String| Err(Problem::Syntax { column: start + 1, problem });
        match (function, self.peek() == Some('(')) {
            (Some(function), true) => {
                self.parentheses()?;
                self.program.push(Step::Call(function));
            }
            (Some(function), false) => return problem(format!("the function {function} lacks its (")),
            (None, true) => {
                return problem(format!("{name} is not a function; the functions are {}", FUNCTIONS.join(", ")));
            }
            (None, false) => match (self.number_of)(&name) {
                Some(number) => self.program.push(Step::Name(number)),
                None if name == CONSTANTS[0] => self.program.push(Step::Number(PI)),
                None => return Err(Problem::Unknown { name }),
            },
        }
        Ok(())
    }

    /// A name with characters that no other may have, between single quotes.
    fn quoted_name(&mut self) -> Parsed {
        let start = self.at + 1;
        let Some(length) = self.text[start..].iter().position(|c| *c == '\'') else {
            return Err(self.problem("the closing quote of a name is missing".into()));
        };
        self.at = start + length + 1;
        let name: String = self.text[start..start + length].iter().collect();
        match (self.number_of)(&name) {
            Some(number) => self.program.push(Step::Name(number)),
            None => return Err(Problem::Unknown { name }),
        }
        Ok(())
    }

    fn nested(&mut self, inner: fn(&mut Self) -> Parsed) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.problem(format!("it is nested more than {DEEPEST} deep")));
        }
        inner(self)?;
        self.depth -= 1;
        Ok(())
    }

    /// The next character that is not white space.
    fn peek(&mut self) -> Option<char> {
        self.skip(char::is_whitespace);
        self.text.get(self.at).copied()
    }

    fn accept(&mut self, wanted: &[char]) -> Option<char> {
        let next = self.peek().filter(|c| wanted.contains(c))?;
        self.at += 1;
        Some(next)
    }

    fn skip(&mut self, wanted: impl Fn(char) -> bool) {
        while self.text.get(self.at).is_some_and(|c| wanted(*c)) {
            self.at += 1;
        }
    }

    /// Something is wrong at the place that is reached.
    fn problem(&self, problem: String) -> Problem {
        Problem::Syntax { column: self.at + 1, problem }
    }
}
