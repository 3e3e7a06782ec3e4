//! The one error type of the library.
//!
//! Every variant carries the evidence that a user needs to act: shapes, names, lines, poles, condition numbers.
//! An outcome that is not an error (an optimiser that reached its limit, an estimate that turned out unstable and was
//! asked for as it is) is returned as data, never here.

mod context;
mod display;
mod limits;
mod names;

pub use display::{FullNumber, Names, Pole, Seconds, short};
pub use limits::OrderLimit;
pub use names::{misspelt, nearest_name};

use display::{in_brackets, worst_pole};
use faer::c64;

/// Result of every fallible function of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Whether another input helps, or only another problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// The input is not acceptable as given; the program exits with code 2.
    BadInput,
    /// The input is well formed but the computation is not possible on it; the program exits with code 3.
    Numerical,
}

/// Everything that can go wrong, with the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Something failed in a part of a larger task.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
    /// A matrix has the wrong size.
    #[error("{what} is {} x {}, but must be {} x {}", found.0, found.1, expected.0, expected.1)]
    Shape {
        /// Which matrix, in the words of the user.
        what: String,
        /// Rows and columns that are needed.
        expected: (usize, usize),
        /// Rows and columns that were given.
        found: (usize, usize),
    },
    /// A number is NaN or infinite.
    #[error("{what} holds a value that is not finite in row {row}, column {column} (counted from 1)")]
    NotFinite {
        /// Which matrix or record.
        what: String,
        /// Row, counted from 1.
        row: usize,
        /// Column, counted from 1.
        column: usize,
    },
    /// A quantity lies outside of the range in which it has a meaning.
    #[error("{what} is {}, but must be {must}", FullNumber(*value))]
    OutOfRange {
        /// Which quantity.
        what: String,
        /// The value given.
        value: f64,
        /// The range in words, for example "a positive number of seconds".
        must: &'static str,
    },
    /// Two systems or records with different sample times were to be joined.
    #[error("{what}: sample times differ ({} s and {} s)", Seconds(*left), Seconds(*right))]
    SampleTimeMismatch {
        /// The operation.
        what: String,
        /// First sample time, seconds.
        left: f64,
        /// Second sample time, seconds.
        right: f64,
    },
    /// A matrix that must be inverted is singular to working precision.
    #[error("{what} is singular to working precision (reciprocal condition number {rcond:.1e})")]
    Singular {
        /// Which matrix.
        what: String,
        /// Reciprocal condition number, or 0 when exactly singular.
        rcond: f64,
    },
    /// An iteration did not converge.
    #[error("{what} did not converge after {iterations} iterations")]
    NoConvergence {
        /// Which computation.
        what: String,
        /// Number of iterations that were made.
        iterations: usize,
    },
    /// A system that must be stable is not.
    #[error("{what} must be stable, but has the pole {}", Pole(*pole))]
    Unstable {
        /// Which system.
        what: String,
        /// Its worst pole (in z for discrete, in rad/s for continuous systems).
        pole: c64,
    },
    /// A matrix equation has no solution of the kind that was asked for.
    #[error("{what} has no solution: {condition}{}", in_brackets(*residual))]
    NoSolution {
        /// Which equation.
        what: String,
        /// The condition that fails, in words.
        condition: String,
        /// Relative residual that was reached, NaN where none was computed.
        residual: f64,
    },
    /// The principal matrix logarithm does not exist.
    #[error("no continuous-time system has this zero-order-hold discretisation: the pole {} lies on the closed negative real axis", Pole(*pole))]
    NoLogarithm {
        /// The eigenvalue without a principal logarithm.
        pole: c64,
    },
    /// A matrix that must be symmetric is not.
    #[error(
        "{what} is not symmetric: row {row}, column {column} holds {upper}, but row {column}, column {row} holds {lower}"
    )]
    NotSymmetric {
        /// Which matrix.
        what: String,
        /// Row of the entry above the diagonal, counted from 1.
        row: usize,
        /// Column of the entry above the diagonal, counted from 1.
        column: usize,
        /// The entry above the diagonal.
        upper: f64,
        /// Its mirror image below the diagonal.
        lower: f64,
    },
    /// A weight or covariance has an eigenvalue below zero, or too near to zero.
    #[error("{what} is not {must}: its smallest eigenvalue, scaled to unit diagonal, is {eigenvalue:.1e}")]
    NotPositive {
        /// Which matrix.
        what: String,
        /// `positive definite` or `positive semidefinite`.
        must: &'static str,
        /// Smallest eigenvalue after scaling to unit diagonal.
        eigenvalue: f64,
    },
    /// A mode that is not stable is out of reach of the inputs.
    #[error("{what} has no solution: no input moves the mode {} (distance {distance:.1e})", Pole(*pole))]
    NotStabilisable {
        /// Which design.
        what: String,
        /// The mode (in z for discrete, in rad/s for continuous systems).
        pole: c64,
        /// Smallest singular value of `[A - p I, B]` in balanced coordinates.
        distance: f64,
    },
    /// A mode on the stability boundary (for an observer: a mode that is not stable) does not show.
    #[error("{what} has no solution: nothing that is weighted or measured shows the mode {} (distance {distance:.1e})", Pole(*pole))]
    NotDetectable {
        /// Which design.
        what: String,
        /// The mode (in z for discrete, in rad/s for continuous systems).
        pole: c64,
        /// Smallest singular value of `[A - p I; C]` in balanced coordinates.
        distance: f64,
    },
    /// Numbers of ports do not fit together.
    #[error("{what} is {found}, but must be {expected}")]
    Ports {
        /// Which number.
        what: String,
        /// What is needed.
        expected: usize,
        /// What was given.
        found: usize,
    },
    /// A transfer function or difference equation cannot be realised.
    #[error("the transfer function cannot be used: {problem}")]
    Polynomial {
        /// What is wrong with the coefficients.
        problem: &'static str,
    },
    /// A loop of direct feedthroughs has no solution.
    #[error("the loop is not well posed: its algebraic loop is singular (reciprocal condition number {rcond:.1e})")]
    AlgebraicLoop {
        /// Reciprocal condition number.
        rcond: f64,
    },
    /// The controller does not stabilise the model that it was combined with.
    #[error("the controller does not stabilise {model}: the closed loop has the pole {}; check the sign convention (feedback = \"negative\" or \"positive\"), the coefficients, the sample time, the units of the channels and the nominal model", Pole(*pole))]
    NotStabilising {
        /// Which model, in the words of the user.
        model: String,
        /// The worst closed-loop pole.
        pole: c64,
    },
    /// A simulation left the range of the numbers.
    #[error("{what} is no longer finite from sample {sample} on (counted from 1){}", worst_pole(*pole))]
    Diverged {
        /// Which simulation.
        what: String,
        /// First sample that is not finite, counted from 1.
        sample: usize,
        /// The worst pole of the system, `None` without states.
        pole: Option<c64>,
    },
    /// A frequency response is infinite.
    #[error("the frequency response is infinite at {omega} rad/s: a pole lies there; leave this frequency out")]
    PoleOnBoundary {
        /// The frequency, rad/s.
        omega: f64,
    },
    /// A model cannot have the order that was asked for.
    #[error("a model of order {order} was asked for, but {limit}")]
    Order {
        /// The order that was asked for.
        order: usize,
        /// What limits it.
        limit: OrderLimit,
    },
    /// A choice that the method does not offer, or not together with the other choices.
    #[error("{what} is not possible: {instead}")]
    Unsupported {
        /// The choice, with its key.
        what: &'static str,
        /// Why, and what to choose in its place.
        instead: &'static str,
    },
    /// No order of a reduction is good enough in the loop.
    #[error(
        "no order has a relative closed-loop error of at most {limit} under a controller that stabilises it{}; allow a larger error or reduce by another method",
        lowest.map(|error| format!(" (the lowest is {error:.2e})")).unwrap_or_default()
    )]
    NoReducedOrder {
        /// The error that was asked for.
        limit: f64,
        /// The lowest of all orders that the controller stabilises.
        lowest: Option<f64>,
    },
    /// No search for a model by likelihood ended with finite numbers.
    #[error(
        "no candidate model survives: no search on the {samples} samples ends with a finite likelihood; \
         record longer, excite more, or state order and dead time"
    )]
    NoCandidate {
        /// Samples of all records.
        samples: usize,
    },
    /// A channel, column or variable was asked for that does not exist.
    #[error("{what} has no {:?}{}; known: {}", short(name), nearest.as_ref().map(|n| format!(" (did you mean {:?}?)", short(n))).unwrap_or_default(), Names(known))]
    UnknownChannel {
        /// The record or file.
        what: String,
        /// The name that was asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The most similar of them, where one is similar.
        nearest: Option<String>,
    },
    /// Two channels of one record have the same name.
    #[error("{what} has more than one channel named {:?}", short(name))]
    DuplicateChannel {
        /// The record or file.
        what: String,
        /// The name.
        name: String,
    },
    /// A value of a record is NaN or infinite.
    #[error(
        "{what}: channel {:?} is not finite in row {row} (counted from 1); leave the row out of the file and use the rows before and after it as two records",
        short(channel)
    )]
    NotFiniteSample {
        /// The record or file.
        what: String,
        /// The channel.
        channel: String,
        /// Row, counted from 1.
        row: usize,
    },
    /// A signal does not excite enough to identify from it.
    #[error(
        "{what} does not excite enough: its block-Hankel matrix with {block_rows} block rows has rank {rank} of {needed}; \
         use a richer excitation or a shorter horizon"
    )]
    InsufficientExcitation {
        /// The signal.
        what: String,
        /// Number of block rows s.
        block_rows: usize,
        /// Numerical rank.
        rank: usize,
        /// Rank that is needed: s times the number of channels.
        needed: usize,
    },
    /// A record is too short for the model that was asked for.
    #[error("{what}: {found} samples are too few, at least {needed} are needed")]
    TooFewSamples {
        /// Which record, and for what.
        what: String,
        /// Number of samples given.
        found: usize,
        /// Number of samples needed.
        needed: usize,
    },
    /// An excitation does not repeat itself.
    #[error(
        "{what} is not periodic: no shift of up to {longest} samples repeats it and excites a line below the Nyquist frequency; \
         record at least two whole periods of a whole number of samples, or estimate the response by Welch's method"
    )]
    NotPeriodic {
        /// The signal.
        what: String,
        /// The longest period of which the record holds two.
        longest: usize,
    },
    /// Experiments have different periods.
    #[error(
        "the excitation of experiment {experiment} has a period of {found} samples, but that of experiment 1 has {first}; \
         use one period in all experiments, or one estimate for each"
    )]
    UnequalPeriods {
        /// The experiment, counted from 1.
        experiment: usize,
        /// Its period in samples.
        found: usize,
        /// The period of experiment 1.
        first: usize,
    },
    /// Periodic experiments do not excite every input independently of the others.
    #[error(
        "the excitations of input {} {how} around {hz:.6} Hz in all experiments together; record one experiment for each input, or \
         orthogonal realisations with all inputs",
        inputs.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
    )]
    NotExcited {
        /// The inputs, counted from 1.
        inputs: Vec<usize>,
        /// What is missing.
        how: &'static str,
        /// The first frequency, Hz.
        hz: f64,
    },
    /// A channel never changes, so that nothing can be learnt from it.
    #[error("{what} is constant ({value}) in every experiment")]
    ConstantChannel {
        /// Which channel.
        what: String,
        /// The value in the first experiment.
        value: f64,
    },
}

crate::error_context! {
    sources:;
    numerical: Singular NoConvergence Unstable NoSolution NoLogarithm NotStabilisable NotDetectable AlgebraicLoop
        Diverged PoleOnBoundary NoReducedOrder NoCandidate;
    bad_input: Shape NotFinite OutOfRange SampleTimeMismatch NotSymmetric NotPositive Ports Polynomial NotStabilising
        Order Unsupported UnknownChannel DuplicateChannel NotFiniteSample InsufficientExcitation TooFewSamples
        NotPeriodic UnequalPeriods NotExcited ConstantChannel;
}

impl Error {
    /// The error without the parts in which it occurred.
    pub fn root(&self) -> &Error {
        match self {
            Error::Within { source, .. } => source.root(),
            other => other,
        }
    }

    /// Whether the records and the nominal model, although well formed, do not suffice for one method: a record that is too short
    /// or excites too little, a controller that does not stabilise the nominal model.
    pub fn is_of_the_records(&self) -> bool {
        match self {
            Error::Within { source, .. } => source.is_of_the_records(),
            _ => matches!(
                self,
                Error::TooFewSamples { .. }
                    | Error::InsufficientExcitation { .. }
                    | Error::ConstantChannel { .. }
                    | Error::NotExcited { .. }
                    | Error::NotStabilising { .. }
            ),
        }
    }
}
