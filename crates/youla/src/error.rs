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
    // ---- lti and factor ----------------------------------------------------------------------------------------
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
    // ---- reduction ---------------------------------------------------------------------------------------------
    /// More states were asked for than a minimal realisation has.
    #[error(
        "a model of order {order} was asked for, but only {minimal} states are controllable and observable to working precision; ask for at most {minimal}"
    )]
    OrderAboveMinimal {
        /// The order that was asked for.
        order: usize,
        /// The order of the minimal realisation.
        minimal: usize,
    },
    // ---- records and files -------------------------------------------------------------------------------------

    // ---- identification ----------------------------------------------------------------------------------------
}

impl Error {
    /// Whether the input is at fault or the computation is impossible on it.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::Singular { .. }
            | Error::NoConvergence { .. }
            | Error::Unstable { .. }
            | Error::NoSolution { .. }
            | Error::NoLogarithm { .. }
            | Error::Diverged { .. }
            | Error::PoleOnBoundary { .. } => ErrorKind::Numerical,
            _ => ErrorKind::BadInput,
        }
    }
}

/// Names the worst pole where there is one.
fn worst_pole(pole: Option<c64>) -> String {
    pole.map_or(String::new(), |p| format!("; the worst pole is {}", Pole(p)))
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
