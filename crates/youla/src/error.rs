//! The one error type of the library.
//!
//! Every variant carries the evidence that a user needs to act: shapes, names, lines, poles, condition numbers.
//! An outcome that is not an error (an optimiser that reached its limit, an estimate that turned out unstable and was
//! asked for as it is) is returned as data, never here.

use faer::c64;

/// Result of every fallible function of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Who can mend it: the person who gave the input, or nobody without changing the problem.
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
    // ---- shapes and values -------------------------------------------------------------------------------------
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
    #[error("{what} is {value}, but must be {must}")]
    OutOfRange {
        /// Which quantity.
        what: String,
        /// The value given.
        value: f64,
        /// The range in words, for example "a positive number of seconds".
        must: &'static str,
    },
    /// Two systems or records with different sample times were to be joined.
    #[error("{what}: sample times differ ({left} s and {right} s)")]
    SampleTimeMismatch {
        /// The operation.
        what: String,
        /// First sample time, seconds.
        left: f64,
        /// Second sample time, seconds.
        right: f64,
    },

    // ---- numerical conditions ----------------------------------------------------------------------------------
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
    #[error("{what} has no solution: {condition} (relative residual {residual:.1e})")]
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
    /// A matrix that must be positive definite is not, or not clear of rounding.
    #[error("{what} is not positive definite: its smallest eigenvalue, scaled to unit diagonal, is {eigenvalue:.1e}")]
    NotPositiveDefinite {
        /// Which matrix.
        what: String,
        /// Smallest eigenvalue after scaling to unit diagonal.
        eigenvalue: f64,
    },
    /// A weight or covariance is indefinite.
    #[error(
        "{what} is not positive semidefinite: its smallest eigenvalue, scaled to unit diagonal, is {eigenvalue:.1e}"
    )]
    NotPositiveSemidefinite {
        /// Which matrix.
        what: String,
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
    // ---- lti and factor ----------------------------------------------------------------------------------------

    // ---- records and files -------------------------------------------------------------------------------------

    // ---- identification ----------------------------------------------------------------------------------------
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
    /// The inputs do not excite the system enough for the horizon.
    #[error(
        "the inputs are not exciting enough for a horizon of {horizon} block rows: their Hankel matrix has rank {rank}, \
         but {needed} is needed; use a richer excitation or a shorter horizon"
    )]
    NotExciting {
        /// Numerical rank of the block-Hankel matrix of the inputs.
        rank: usize,
        /// Number of its rows, 2 x horizon x inputs.
        needed: usize,
        /// Block rows of the past and of the future.
        horizon: usize,
    },
    /// A channel never changes, so that nothing can be learnt from it.
    #[error("{what} is constant ({value}) in every experiment")]
    ConstantChannel {
        /// Which channel.
        what: String,
        /// The value in the first experiment.
        value: f64,
    },
    /// The order does not fit into the horizon.
    #[error(
        "the order {order} exceeds {largest}, the largest for a horizon of {horizon} block rows: (horizon - 1) x outputs"
    )]
    OrderBeyondHorizon {
        /// Order asked for.
        order: usize,
        /// Largest order possible.
        largest: usize,
        /// Block rows of the past and of the future.
        horizon: usize,
    },
}

impl Error {
    /// Whether the input is at fault or the computation is impossible on it.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::Singular { .. }
            | Error::NoConvergence { .. }
            | Error::Unstable { .. }
            | Error::NoSolution { .. }
            | Error::NotStabilisable { .. }
            | Error::NotDetectable { .. }
            | Error::NoLogarithm { .. } => ErrorKind::Numerical,
            _ => ErrorKind::BadInput,
        }
    }
}

/// Prints a pole as `-1.2 + 3.4i` with its magnitude.
pub(crate) struct Pole(pub(crate) c64);

impl std::fmt::Display for Pole {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let c64 { re, im } = self.0;
        let magnitude = re.hypot(im);
        if im == 0.0 {
            write!(f, "{re:.6}")
        } else {
            let sign = if im < 0.0 { '-' } else { '+' };
            write!(f, "{re:.6} {sign} {:.6}i (magnitude {magnitude:.6})", im.abs())
        }
    }
}
