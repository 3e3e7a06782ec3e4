//! A structure that is declared, not programmed: matrices whose entries are numbers or expressions of named parameters.
//!
//! ```text
//! entry = f(theta, q(theta)),   d entry / d theta_j = df/dtheta_j + sum_k df/dq_k dq_k/dtheta_j
//! ```
//! with the derived quantities q, which may depend on each other. The derivatives are exact: parameters, derived quantities
//! and entries are evaluated in numbers that carry their derivative in one direction (`dual.rs`; A. Griewank and A.
//! Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, chapter 3).
//!
//! Files: what is written (`declaration.rs`), the grammar (`parser.rs`) and what it makes (`expression.rs`), the checks
//! (`names.rs`, `compile.rs`), what comes with the library (`template.rs`). For people: `docs/grey-box.md`.

mod compile;
mod declaration;
mod dual;
mod expression;
mod named;
mod names;
mod parser;
mod template;
#[cfg(test)]
mod tests;

pub use declaration::{Declaration, Entry, ParameterDeclaration};
pub use named::NamedExpression;
pub use template::Template;

use crate::checks::check_time;
use crate::{Error, Result};
use crate::{Matrix, Slope, Structure};
use dual::Dual;
use expression::Expression;
use names::finite;
use serde::Serialize;
use youla::linalg::check_shape;
use youla::lti::{Continuous, Discrete, StateSpace};
use youla::{Mat, MatRef};

/// A structure with named parameters, made from a [`Declaration`] or a [`Template`].
///
/// The parameter vector holds the free parameters in the order of the declaration; fixed ones keep their initial value.
///
/// ```
/// use youla_greybox::{DeclaredStructure, Structure, Template};
/// let drive = DeclaredStructure::new(&Template::TwoInertiaDrive.declaration()?)?;
/// let values = drive.derived(&drive.start(), None)?;
/// assert_eq!(values[1].name, "antiresonance");
/// assert!((values[1].value - 100.0).abs() < 1e-9);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredStructure {
    /// Of a structure of discrete time.
    time: Option<Discrete>,
    parameters: Vec<Parameter>,
    /// Numbers of the free parameters.
    free: Vec<usize>,
    derived: Vec<Quantity>,
    /// Numbers of the derived quantities, each after those that it uses.
    order: Vec<usize>,
    /// A, B, C, D with zeros in the place of expressions.
    numbers: [Mat<f64>; 4],
    cells: Vec<Cell>,
}

/// A parameter of a declared structure, checked and complete.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Unit, a label; empty where none was given.
    pub unit: String,
    /// Initial value, or the value of a fixed parameter.
    pub initial: f64,
    /// Smallest value, minus infinity where there is none.
    pub min: f64,
    /// Largest value, infinity where there is none.
    pub max: f64,
    /// Typical size.
    pub scale: f64,
    /// Whether it keeps its initial value.
    pub fixed: bool,
}

/// Value of a derived quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DerivedValue {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation to first order, `None` without a covariance of the parameters.
    pub deviation: Option<f64>,
}

/// An expression with its text.
#[derive(Debug, Clone, PartialEq)]
struct Formula {
    text: String,
    expression: Expression,
    /// For each parameter, whether the value depends on it.
    moved_by: Vec<bool>,
}

/// A derived quantity.
#[derive(Debug, Clone, PartialEq)]
struct Quantity {
    name: String,
    formula: Formula,
}

/// An entry that is an expression.
#[derive(Debug, Clone, PartialEq)]
struct Cell {
    matrix: Matrix,
    row: usize,
    column: usize,
    formula: Formula,
}

impl Quantity {
    fn place(&self) -> String {
        Self::place_of(&self.name)
    }

    fn place_of(name: &str) -> String {
        format!("the derived quantity {name}")
    }
}

impl Cell {
    fn place(&self) -> String {
        Self::place_of(self.matrix, self.row, self.column)
    }

    fn place_of(matrix: Matrix, row: usize, column: usize) -> String {
        format!("row {}, column {} of the matrix {}", row + 1, column + 1, Self::letter(matrix))
    }

    fn letter(matrix: Matrix) -> &'static str {
        match matrix {
            Matrix::A => "a",
            Matrix::B => "b",
            Matrix::C => "c",
            Matrix::D => "d",
        }
    }
}

impl DeclaredStructure {
    /// All parameters, fixed ones too, in the order of the declaration.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Number of inputs and of outputs.
    pub fn ports(&self) -> (usize, usize) {
        let [_, b, c, _] = &self.numbers;
        (b.ncols(), c.nrows())
    }

    /// Initial values of the free parameters.
    pub fn start(&self) -> Vec<f64> {
        self.free.iter().map(|number| self.parameters[*number].initial).collect()
    }

    /// The derived quantities at a parameter vector, with standard deviations where its covariance is given (q x q):
    /// `sqrt(g' cov g)` with the gradient g.
    ///
    /// # Errors
    /// [`youla::Error::Shape`] for a vector or covariance of another size.
    pub fn derived(&self, theta: &[f64], covariance: Option<MatRef<'_, f64>>) -> Result<Vec<DerivedValue>> {
        self.check_length(theta)?;
        let q = self.free.len();
        if let Some(covariance) = covariance {
            check_shape("the covariance of the parameters", covariance, (q, q))?;
        }
        let first = self.parameters.len();
        let values = self.quantities(theta, None);
        let moved: Vec<Vec<Dual>> = (0..q).map(|j| self.quantities(theta, Some(j))).collect();
        let value = |(k, quantity): (usize, &Quantity)| {
            let gradient = Mat::from_fn(q, 1, |j, _| moved[j][first + k].slope);
            let deviation =
                |covariance: MatRef<'_, f64>| (gradient.transpose() * covariance * &gradient)[(0, 0)].sqrt();
            let (name, value) = (quantity.name.clone(), values[first + k].value);
            DerivedValue { name, value, deviation: covariance.map(deviation) }
        };
        Ok(self.derived.iter().enumerate().map(value).collect())
    }

    fn check_length(&self, theta: &[f64]) -> Result<()> {
        let vector = MatRef::from_column_major_slice(theta, theta.len(), 1);
        check_shape("the parameter vector", vector, (self.free.len(), 1)).map_err(Error::from)
    }

    /// Parameters and derived quantities with their derivative with respect to free parameter `direction`.
    fn quantities(&self, theta: &[f64], direction: Option<usize>) -> Vec<Dual> {
        let mut values: Vec<Dual> = self.parameters.iter().map(|p| Dual::constant(p.initial)).collect();
        for (k, (number, value)) in self.free.iter().zip(theta).enumerate() {
            values[*number] = Dual { value: *value, slope: if direction == Some(k) { 1.0 } else { 0.0 } };
        }
        let first = values.len();
        values.resize(first + self.derived.len(), Dual::constant(f64::NAN));
        for k in &self.order {
            values[first + k] = self.derived[*k].formula.expression.evaluate(&values);
        }
        values
    }

    /// A, B, C, D.
    fn evaluated(&self, theta: &[f64]) -> Result<[Mat<f64>; 4]> {
        let values = self.quantities(theta, None);
        let mut matrices = self.numbers.clone();
        for cell in &self.cells {
            let value = cell.formula.expression.evaluate(&values).value;
            finite(|| cell.place(), &cell.formula.text, value, None)?;
            matrices[cell.matrix as usize][(cell.row, cell.column)] = value;
        }
        Ok(matrices)
    }
}

impl Structure for DeclaredStructure {
    fn names(&self) -> Vec<String> {
        self.free.iter().map(|number| self.parameters[*number].name.clone()).collect()
    }

    fn model(&self, theta: &[f64]) -> Result<StateSpace<Continuous>> {
        self.check_length(theta)?;
        if let Some(time) = self.time {
            return Err(Error::DiscreteStructure { ts: time.ts() });
        }
        let [a, b, c, d] = self.evaluated(theta)?;
        StateSpace::new(a, b, c, d, Continuous).map_err(Error::from)
    }

    fn sample_time(&self) -> Option<Discrete> {
        self.time
    }

    fn sampled(&self, theta: &[f64], time: Discrete) -> Result<StateSpace<Discrete>> {
        if self.time.is_none() {
            return self.model(theta)?.zoh(time).map_err(Error::from);
        }
        check_time(self, time)?;
        self.check_length(theta)?;
        let [a, b, c, d] = self.evaluated(theta)?;
        StateSpace::new(a, b, c, d, time).map_err(Error::from)
    }

    fn slopes(&self, theta: &[f64], parameter: usize) -> Vec<Slope> {
        let Some(number) = self.free.get(parameter) else { return Vec::new() };
        let values = self.quantities(theta, Some(parameter));
        let moved = self.cells.iter().filter(|cell| cell.formula.moved_by[*number]);
        let slope = |cell: &Cell| {
            let value = cell.formula.expression.evaluate(&values).slope;
            Slope { matrix: cell.matrix, row: cell.row, column: cell.column, value }
        };
        moved.map(slope).collect()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().map(|number| (self.parameters[*number].min, self.parameters[*number].max)).collect()
    }

    fn scales(&self) -> Vec<f64> {
        self.free.iter().map(|number| self.parameters[*number].scale).collect()
    }
}
