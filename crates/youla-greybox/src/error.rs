//! Everything that can go wrong with physical structures, with the evidence.

use youla::c64;
use youla::error::{Names, Pole, Seconds};

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong, with the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method refused its input or its computation.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// Something failed in a part of a larger task.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
    /// The data do not determine all parameters, so that there is no covariance.
    #[error("the parameters have no covariance: {}", sentences.join("; "))]
    Undetermined {
        /// One sentence for each ambiguity.
        sentences: Vec<String>,
    },
    /// A declaration is not one.
    #[error("the declaration cannot be read: {problem}")]
    Declaration {
        /// What is wrong, with the line.
        problem: String,
    },
    /// A structure lacks a matrix.
    #[error("the structure has no matrix {matrix}; give a, b and c, or a template")]
    MissingMatrix {
        /// The matrix.
        matrix: &'static str,
    },
    /// A text is not an expression.
    #[error("{place} is {text:?}: {problem} (character {column})")]
    Expression {
        /// Matrix, row and column, or the derived quantity.
        place: String,
        /// The text.
        text: String,
        /// The character, counted from 1.
        column: usize,
        /// What is wrong there.
        problem: String,
    },
    /// An expression uses a name that is not declared.
    #[error("{place} is {text:?}, but {name:?} is not declared{}; declared: {}", nearest.as_ref().map(|n| format!(" (did you mean {n:?}?)")).unwrap_or_default(), Names(known))]
    UnknownName {
        /// Matrix, row and column, or the derived quantity.
        place: String,
        /// The expression.
        text: String,
        /// The name.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The most similar of them, where one is similar.
        nearest: Option<String>,
    },
    /// A name that cannot be used.
    #[error("the name {name:?} {problem}")]
    BadName {
        /// The name.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Derived quantities that are defined by each other in a circle.
    #[error("circular definition among these derived quantities: {}", Names(names))]
    CircularDefinition {
        /// Their names.
        names: Vec<String>,
    },
    /// A parameter without an initial value.
    #[error("the parameter {name:?} has no initial value")]
    NoInitialValue {
        /// The parameter.
        name: String,
    },
    /// Bounds that leave no room.
    #[error(
        "the parameter {name:?} has the bounds {min} and {max}, but the lower one must be below the upper one; set fixed = true for a known parameter"
    )]
    EmptyBounds {
        /// The parameter.
        name: String,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// A parameter starts outside of its bounds.
    #[error("the parameter {name:?} starts at {value}, but must lie from {min} to {max}")]
    OutsideBounds {
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// A parameter that moves nothing.
    #[error("no entry of a, b, c and d depends on the parameter {name:?}{}", nearest.as_ref().map(|n| format!(" (did you mean {n:?}?)")).unwrap_or_default())]
    UnusedParameter {
        /// The parameter.
        name: String,
        /// The most similar parameter that moves something, where one is similar.
        nearest: Option<String>,
    },
    /// An entry or derived quantity is not finite.
    #[error("{place} is {text:?}, {} {value}, which is not finite", match parameter { Some(name) => format!("whose derivative with respect to {name:?} is"), None => "whose value is".into() })]
    EntryNotFinite {
        /// Matrix, row and column, or the derived quantity.
        place: String,
        /// The expression.
        text: String,
        /// The value or derivative.
        value: f64,
        /// The parameter of the derivative, `None` for the value itself.
        parameter: Option<String>,
    },
    /// There is nothing to start a projection from.
    #[error(
        "the structure is not linear in its parameters and no start gives a model; give a parameter vector to start from"
    )]
    NoStart,
    /// A method that needs the measured inputs was given a simulated loop.
    #[error("{method} needs the measured inputs u; remove the simulated loop from the problem")]
    MeasuredInputs {
        /// The method.
        method: &'static str,
    },
    /// A structure of discrete time has no continuous-time model.
    #[error("the structure is one of discrete time, sampled every {} s: it has no continuous-time model", Seconds(*ts))]
    DiscreteStructure {
        /// Its sample time in seconds.
        ts: f64,
    },
    /// A steady state is asked of an integrator.
    #[error("a model of the search has no steady state: its pole {} integrates; take initial_state = \"estimated\" or \"zero\"", Pole(*pole))]
    NoSteadyState {
        /// The pole at 1.
        pole: c64,
    },
}

youla::error_context! {
    sources: Method;
    numerical: Undetermined NoSteadyState;
    bad_input: Declaration MissingMatrix Expression UnknownName BadName CircularDefinition NoInitialValue EmptyBounds
        OutsideBounds UnusedParameter EntryNotFinite NoStart MeasuredInputs DiscreteStructure;
}
