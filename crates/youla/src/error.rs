//! The one error type of the library.
//!
//! Every variant carries the evidence that a user needs to act: shapes, names, lines, poles, condition numbers.
//! An outcome that is not an error (an optimiser that reached its limit, an estimate that turned out unstable and was
//! asked for as it is) is returned as data, never here.

use faer::c64;
use std::fmt::Write;
use std::path::PathBuf;

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
    /// Something failed in a part of a larger task.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
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
    /// The data do not determine all parameters, so that there is no covariance.
    #[error("the parameters have no covariance: {}", sentences.join("; "))]
    Undetermined {
        /// One sentence for each ambiguity.
        sentences: Vec<String>,
    },
    // ---- lti and factor ----------------------------------------------------------------------------------------
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
    // ---- run and settings --------------------------------------------------------------------------------------
    /// run.toml cannot be used.
    #[error("{}{}: {problem}", path.display(), position(*at))]
    Settings {
        /// Path of run.toml.
        path: PathBuf,
        /// Where, `None` where the file as a whole is meant.
        at: Option<TextPosition>,
        /// What is wrong, and the nearest known key for a misspelt one.
        problem: String,
    },
    // ---- the study ---------------------------------------------------------------------------------------------
    /// No controller of a list stabilises both the nominal model and the true plant with the margin asked for.
    #[error(
        "none of the {tried} command weights gives a controller that stabilises both the nominal model and the true plant \
         with a peak sensitivity of at most {limit}{}; allow a larger peak, add command weights or leave out such models",
        lowest.map(|peak| format!(" (the lowest peak is {peak:.2})")).unwrap_or_default()
    )]
    NoController {
        /// Number of weights that were tried.
        tried: usize,
        /// Largest peak of the output sensitivity that counts as stabilised.
        limit: f64,
        /// Lowest peak of those that stabilise both.
        lowest: Option<f64>,
    },
    /// No controller could be designed on an identified model within the limits.
    #[error("no weight gives a new controller within the limits ({reasons}); add weights or allow more in [redesign]")]
    NoRedesign {
        /// For each weight why not.
        reasons: String,
    },
    /// A shard is not written as one number of another.
    #[error("{text:?} is not a shard; write the number of the part and the number of parts, for example 2/4")]
    BadShard {
        /// What was given.
        text: String,
    },
    /// A results file is not one.
    #[error("{} is not a results file of this version of the program; remove it or choose another folder", path.display())]
    NotResults {
        /// The file.
        path: PathBuf,
    },
    /// Another process writes to a file.
    #[error("{}: another process is writing to it", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// A results folder belongs to other settings.
    #[error("{} holds results of other settings: {difference}; choose another folder or remove it", path.display())]
    OtherSettings {
        /// The folder.
        path: PathBuf,
        /// The first difference, with both values.
        difference: String,
    },
    /// Parts of a study do not make a whole.
    #[error("{}: {problem}", path.display())]
    Parts {
        /// The part.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The output folder holds something already.
    #[error("{} exists already and is not empty; choose another output folder or remove it", path.display())]
    OutputExists {
        /// The folder.
        path: PathBuf,
    },
    /// A file is there already.
    #[error("{} exists already; choose another file, or replace it with --force", path.display())]
    FileExists {
        /// The file.
        path: PathBuf,
    },
    /// A file or folder holds no model that could be read or exported.
    #[error("{}: {problem}", path.display())]
    NotAModel {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A record is used up by the samples that are dropped at its start.
    #[error(
        "record {record} has {samples} samples, but the first {dropped} are dropped; give a longer record or lower {key}"
    )]
    TooShort {
        /// Which record.
        record: String,
        /// Its samples.
        samples: usize,
        /// Samples dropped.
        dropped: usize,
        /// The option that says so.
        key: &'static str,
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
    /// Fewer states were asked for than are kept as they are.
    #[error(
        "a model of order {order} was asked for, but {kept} poles at or beyond the stability boundary are kept as they are; ask for at least {kept} or move the boundary"
    )]
    OrderBelowKept {
        /// The order that was asked for.
        order: usize,
        /// Poles that are kept.
        kept: usize,
    },
    /// An order was to follow from a bound that the method does not have.
    #[error(
        "the weighted reduction has no error bound from which an order could follow; take order = {{ fixed = ... }} or {{ closed-loop = ... }}"
    )]
    NoErrorBound,
    /// A choice of the reduction needs the loop.
    #[error(
        "{what} needs the loop of the model with its controller, which a reduction of the model alone does not have"
    )]
    NeedsLoop {
        /// The choice.
        what: &'static str,
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
    // ---- records and files -------------------------------------------------------------------------------------
    /// The operating system refused to read or write a file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// There is no such file.
    #[error("{}: no such file", path.display())]
    MissingFile {
        /// The file.
        path: PathBuf,
    },
    /// A file holds no samples.
    #[error("{}: {problem}", path.display())]
    NoData {
        /// The file.
        path: PathBuf,
        /// What is missing, for example "the file is empty (0 bytes)".
        problem: &'static str,
    },
    /// A cell of a text file is not a finite number.
    #[error("{}, line {line}, column {column}: {text:?} is not a finite number", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Name of the column, or `#` and its number.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A number of a text file is written with another decimal sign than the one that was declared.
    #[error(
        "{}, line {line}, column {column}: {text:?} has a decimal {found}, but the decimal sign is a {declared}; declare \
         decimal = \"{found}\" if all numbers of the file are written so",
        path.display()
    )]
    DecimalSign {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Name of the column, or `#` and its number.
        column: String,
        /// What stands there.
        text: String,
        /// The decimal sign that was declared, or the point by default.
        declared: &'static str,
        /// The decimal sign that the number has.
        found: &'static str,
    },
    /// The comma is declared both as delimiter and as decimal sign.
    #[error("{}: the comma cannot be both the delimiter and the decimal sign; declare another delimiter", path.display())]
    CommaTwice {
        /// The file.
        path: PathBuf,
    },
    /// A line of a text file has more or fewer fields than the first one.
    #[error("{}, line {line}: {found} fields, but the first line has {expected}", path.display())]
    RaggedRow {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Fields on this line.
        found: usize,
        /// Fields on the first line.
        expected: usize,
    },
    /// The delimiter of a text file does not follow from its first line.
    #[error("{}, line {line}: the delimiter is not clear, the line holds {found}; state the delimiter", path.display())]
    Delimiter {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// The candidates that were found, in words.
        found: String,
    },
    /// A file is damaged, cut off or not of the format it claims.
    #[error("{}, byte {offset}: expected {expected}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Position in the file, counted from 0.
        offset: u64,
        /// What should stand there.
        expected: String,
    },
    /// A gzip file is damaged or cut off.
    #[error("{}: the gzip file is damaged or cut off after line {line}: {source}", path.display())]
    CorruptGzip {
        /// The file.
        path: PathBuf,
        /// Last line, counted from 1, that could be unpacked.
        line: usize,
        /// What the decoder says.
        source: std::io::Error,
    },
    /// A file is of a format that this library does not read.
    #[error("{}: {found}, which is not read; {remedy}", path.display())]
    FormatNotRead {
        /// The file.
        path: PathBuf,
        /// The format that was found.
        found: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// A figure is asked for a part that it does not tell apart.
    #[error("the figure {figure:?} cannot be drawn for one {choice} alone; it knows {}", Names(known))]
    ChoiceOfFigure {
        /// Its name.
        figure: &'static str,
        /// The choice.
        choice: &'static str,
        /// Those that it knows.
        known: Vec<String>,
    },
    /// Of a figure of a run nothing is left to draw.
    #[error("nothing of the figure {figure:?} is chosen; choose other outputs, inputs, records or methods")]
    NothingToDraw {
        /// Its name.
        figure: String,
    },
    /// A channel, column or variable was asked for that does not exist.
    #[error("{what} has no {name:?}{}; known: {}", nearest.as_ref().map(|n| format!(" (did you mean {n:?}?)")).unwrap_or_default(), Names(known))]
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
    #[error("{what} has more than one channel named {name:?}")]
    DuplicateChannel {
        /// The record or file.
        what: String,
        /// The name.
        name: String,
    },
    /// Two records of a run have the same name.
    #[error("two records are named {name:?}; give one of their files another `name`")]
    DuplicateRecord {
        /// The name.
        name: String,
    },
    /// A value of a record is NaN or infinite.
    #[error("{what}: channel {channel:?} is not finite in row {row} (counted from 1)")]
    NotFiniteSample {
        /// The record or file.
        what: String,
        /// The channel.
        channel: String,
        /// Row, counted from 1.
        row: usize,
    },
    /// The channels of one record have different lengths.
    #[error("{what}: channel {channel:?} has {found} samples, the channels before it have {expected}")]
    UnequalLength {
        /// The record or file.
        what: String,
        /// The channel.
        channel: String,
        /// Its samples.
        found: usize,
        /// Samples of the other channels.
        expected: usize,
    },
    /// A variable of a file is not of the kind that is needed, or cannot be written.
    #[error("{}: {name} is {found}, but must be {must}", path.display())]
    WrongVariable {
        /// The file.
        path: PathBuf,
        /// The variable as it was asked for.
        name: String,
        /// What it is.
        found: String,
        /// What it must be.
        must: &'static str,
    },
    /// The time column is not uniform.
    #[error(
        "{what}: time is not uniform: row {row} (counted from 1) comes {} s after the one before, the sample time is {} s",
        Seconds(*dt), Seconds(*ts)
    )]
    NonUniformTime {
        /// The record or file.
        what: String,
        /// First row, counted from 1, whose distance from the row before is wrong.
        row: usize,
        /// That distance in seconds.
        dt: f64,
        /// The sample time in seconds.
        ts: f64,
    },
    /// Neither a sample time nor a time column was given.
    #[error("{what}: the sample time is not known; state it in seconds or name the time column")]
    SampleTimeMissing {
        /// The record or file.
        what: String,
    },
    /// An excitation does not excite enough to identify from it.
    #[error(
        "{what} does not excite enough: its block-Hankel matrix with {block_rows} block rows has rank {rank} of {needed} (condition number {condition:.1e})"
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
        /// Ratio of the largest to the smallest singular value.
        condition: f64,
    },
    /// An excitation would drive the nominal loop beyond a limit.
    #[error(
        "the predicted magnitude of {channel} is {predicted:.4}{unit}, beyond its limit of {limit}{unit}; {} would just keep all limits",
        Amplitudes(holding)
    )]
    BeyondLimit {
        /// The input or output that passes its limit by most.
        channel: String,
        /// Largest magnitude that the nominal loop predicts.
        predicted: f64,
        /// Largest magnitude that is allowed.
        limit: f64,
        /// The unit, behind a blank; empty where there is none.
        unit: String,
        /// Amplitude of each input that would just keep all limits.
        holding: Vec<f64>,
    },
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
        /// Number of its rows, (past + horizon) x inputs.
        needed: usize,
        /// Block rows of the future.
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
        /// Block rows of the future.
        horizon: usize,
    },
    /// A stream gave other samples when it was read again.
    #[error(
        "the records have other lengths in the second pass over them than in the first; keep the files as they are"
    )]
    RecordChanged,
    /// What was asked for needs all samples at once.
    #[error("{what} needs the records in memory: read them as a whole, or leave it out")]
    NeedsMemory {
        /// What was asked for.
        what: &'static str,
    },
    /// Another scaling, factorisation, delays or automatic horizon than those of the factored data was asked for.
    #[error(
        "scaling, factorisation, delays and automatic horizon are part of the factored data; factor the records again to change them"
    )]
    Refactor,
    /// The bootstrap was asked for with a method for closed loops.
    #[error(
        "the bootstrap keeps the inputs as they are, which measurements from a closed loop do not allow; take method = \"delta\""
    )]
    BootstrapOfClosedLoop,
    // ---- grey-box structures -----------------------------------------------------------------------------------
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
    /// Derived quantities that stand on each other in a circle.
    #[error("these derived quantities need each other in a circle, or one that does: {}", Names(names))]
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
        "the parameter {name:?} has the bounds {min} and {max}, but the lower one must be below the upper one; a known parameter is fixed instead"
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
    /// A black box is asked for the steady state.
    #[error("initial_state = \"steady-state\" serves physical structures only; take \"estimated\" or \"zero\"")]
    SteadyBlackBox,
    // ---- report ------------------------------------------------------------------------------------------------
    /// The data of a report cannot be written as JSON.
    #[error("the data of the report cannot be written as JSON: {source}")]
    ReportData {
        /// The reason.
        source: serde_json::Error,
    },
    /// A file is not the data of a report.
    #[error("{}: this is not the report.json of a run: {source}", path.display())]
    NotAReport {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: serde_json::Error,
    },
    /// The page of a report cannot be written.
    #[error("the page of the report cannot be written: {source}")]
    ReportTemplate {
        /// The reason.
        source: minijinja::Error,
    },
}

impl Error {
    /// The same error, said of a part of a larger task.
    pub(crate) fn within(self, part: impl Into<String>) -> Self {
        Error::Within { part: part.into(), source: Box::new(self) }
    }

    /// Whether the input is at fault or the computation is impossible on it.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::Within { source, .. } => source.kind(),
            Error::Singular { .. }
            | Error::NoConvergence { .. }
            | Error::Unstable { .. }
            | Error::NoSolution { .. }
            | Error::AlgebraicLoop { .. }
            | Error::NoLogarithm { .. }
            | Error::Diverged { .. }
            | Error::PoleOnBoundary { .. }
            | Error::NoSteadyState { .. }
            | Error::ReportData { .. }
            | Error::ReportTemplate { .. }
            | Error::NotStabilisable { .. }
            | Error::NotDetectable { .. }
            | Error::NoRedesign { .. }
            | Error::NoReducedOrder { .. }
            | Error::Undetermined { .. } => ErrorKind::Numerical,
            _ => ErrorKind::BadInput,
        }
    }
}

/// A place in a text file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPosition {
    /// Line, counted from 1.
    pub line: usize,
    /// Column, counted from 1.
    pub column: usize,
}

impl TextPosition {
    /// The place of byte `offset` of a text; columns count characters. An offset that is no place of the text is its
    /// end.
    pub(crate) fn of(text: &str, offset: usize) -> Self {
        let before = text.get(..offset).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        TextPosition { line, column: before.rsplit('\n').next().unwrap_or_default().chars().count() + 1 }
    }
}

/// `:line:column` where they are known.
fn position(at: Option<TextPosition>) -> String {
    at.map_or(String::new(), |p| format!(":{}:{}", p.line, p.column))
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

/// Prints a time without the last digits, which hold the rounding of a difference.
struct Seconds(f64);

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", format!("{:.9e}", self.0).parse().unwrap_or(self.0))
    }
}

/// Prints the amplitudes of all inputs.
struct Amplitudes<'a>(&'a [f64]);

impl std::fmt::Display for Amplitudes<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Rounded down: what is typed must keep the limit.
        let down = |x: &f64| {
            let unit = 10f64.powf(x.abs().log10().floor() - 3.0);
            if unit > 0.0 {
                format!("{:.4e}", (x / unit).floor() * unit).parse::<f64>().unwrap_or(*x).to_string()
            } else {
                x.to_string()
            }
        };
        let all: Vec<String> = self.0.iter().map(down).collect();
        write!(f, "{} {}", if all.len() == 1 { "an amplitude of" } else { "amplitudes of" }, all.join(", "))
    }
}

/// Prints a list of names, the first forty of them, each up to eighty characters.
struct Names<'a>(&'a [String]);

impl std::fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const SHOWN: usize = 40;
        for (k, name) in self.0.iter().take(SHOWN).enumerate() {
            f.write_str(if k == 0 { "" } else { ", " })?;
            name.chars()
                .take(80)
                .map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c })
                .try_for_each(|c| f.write_char(c))?;
        }
        match self.0.len() {
            0 => f.write_str("nothing"),
            n if n > SHOWN => write!(f, " and {} more", n - SHOWN),
            _ => Ok(()),
        }
    }
}
