//! What is declared: the tables of a file, as they are written.

use super::template::Template;
use crate::{Error, Result};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::error::misspelt;

/// Matrices of `x' = A x + B u, y = C x + D u`, or of `x(k+1) = A x(k) + B u(k)` where a sample time is given, with entries that are numbers or expressions of named parameters.
///
/// With a template, what is given here replaces what the template says: single keys of parameters, derived quantities,
/// whole matrices. Without one, `a`, `b`, `c` and an initial value of every parameter are needed. See
/// `docs/grey-box.md`.
///
/// ```
/// use youla_greybox::{DeclaredStructure, Declaration, Structure};
/// let text = r#"
///     a = [["-rate"]]
///     b = [["gain * rate"]]
///     c = [[1]]
///     [parameters.rate]
///     initial = 30.0
///     unit = "1/s"
///     min = 0.0
///     [parameters.gain]
///     initial = 2.0
///     [derived]
///     time_constant = "1 / rate"
/// "#;
/// let structure = DeclaredStructure::new(&Declaration::parse(text)?)?;
/// assert_eq!(structure.names(), ["rate", "gain"]);
/// assert_eq!(structure.model(&structure.start())?.b()[(0, 0)], 60.0);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Declaration {
    /// A declaration that comes with the library, which this one amends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub template: Option<Template>,
    /// Sample time in seconds of a structure of discrete time; absent for one of continuous time behind a zero-order hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_time: Option<f64>,
    /// State matrix, n x n, row by row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a: Option<Vec<Vec<Entry>>>,
    /// Input matrix, n x m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b: Option<Vec<Vec<Entry>>>,
    /// Output matrix, p x n.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub c: Option<Vec<Vec<Entry>>>,
    /// Feedthrough, p x m; zero when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub d: Option<Vec<Vec<Entry>>>,
    /// The parameters by name; their order is that of the parameter vector.
    #[schemars(with = "BTreeMap<String, ParameterDeclaration>")]
    pub parameters: IndexMap<String, ParameterDeclaration>,
    /// Composite quantities by name, as expressions of parameters and of each other, for use in entries and for their
    /// values in the result.
    #[schemars(with = "BTreeMap<String, String>")]
    pub derived: IndexMap<String, String>,
}

/// An entry of a matrix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "expected a number or a text with an expression")]
pub enum Entry {
    /// A fixed number.
    Number(f64),
    /// An expression of named quantities: `+ - * / ^`, parentheses, `sqrt exp ln sin cos tan atan tanh abs sign` and `pi`.
    Expression(String),
}

/// A parameter.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ParameterDeclaration {
    /// Where the search starts, or the value of a fixed parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<f64>,
    /// Its unit, a label.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Smallest value; none when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value; none when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Typical size, positive; the magnitude of the initial value when absent, 1 where that is zero. The search measures a
    /// parameter by its effect on the outputs, and by its typical size only as long as it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Whether the value is known and stays; free when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fixed: Option<bool>,
}

impl Declaration {
    /// Reads a declaration as TOML text that holds nothing else.
    ///
    /// # Errors
    /// [`Error::Declaration`] with the line and what is wrong.
    pub fn parse(text: &str) -> Result<Self> {
        toml::from_str(text).map_err(|e: toml::de::Error| {
            let hint = misspelt(e.message()).and_then(|(_, nearest)| nearest);
            let hint = hint.map(|nearest| format!("did you mean `{nearest}`?")).unwrap_or_default();
            Error::Declaration { problem: format!("{e}{hint}") }
        })
    }

    /// The declaration without a template: that of the template, as amended by this one.
    ///
    /// # Errors
    /// None for the templates of the library.
    pub(crate) fn whole(&self) -> Result<Declaration> {
        let Some(template) = self.template else { return Ok(self.clone()) };
        let Declaration { sample_time, a, b, c, d, mut parameters, mut derived, .. } = template.declaration()?;
        let amended = self.clone();
        for (name, amendment) in amended.parameters {
            match parameters.get_mut(&name) {
                Some(parameter) => *parameter = parameter.clone().amended(amendment),
                None => {
                    parameters.insert(name, amendment);
                }
            }
        }
        // An amended quantity keeps its place.
        derived.extend(amended.derived);
        let (a, b, c, d) = (amended.a.or(a), amended.b.or(b), amended.c.or(c), amended.d.or(d));
        let sample_time = amended.sample_time.or(sample_time);
        Ok(Declaration { template: None, sample_time, a, b, c, d, parameters, derived })
    }
}

impl Template {
    /// The declaration.
    ///
    /// # Errors
    /// None; the tests read all of them.
    pub fn declaration(self) -> Result<Declaration> {
        Declaration::parse(self.text())
    }
}

impl ParameterDeclaration {
    fn amended(self, by: ParameterDeclaration) -> Self {
        ParameterDeclaration {
            initial: by.initial.or(self.initial),
            unit: by.unit.or(self.unit),
            min: by.min.or(self.min),
            max: by.max.or(self.max),
            scale: by.scale.or(self.scale),
            fixed: by.fixed.or(self.fixed),
        }
    }
}
