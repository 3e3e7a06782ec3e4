//! Everything that can go wrong with the running loop, with the evidence.

use youla::ErrorKind;

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
    /// No controller could be designed on an identified model within the limits.
    #[error("no weight gives a new controller within the limits ({reasons}); add weights or allow more in [redesign]")]
    NoRedesign {
        /// For each weight why not.
        reasons: String,
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
}

impl Error {
    /// The same error, said of a part of a larger task.
    pub fn within(self, part: impl Into<String>) -> Self {
        Error::Within { part: part.into(), source: Box::new(self) }
    }

    /// Whether the input is at fault or the computation is impossible on it.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::Method(source) => source.kind(),
            Error::Within { source, .. } => source.kind(),
            Error::NoRedesign { .. } => ErrorKind::Numerical,
            Error::BeyondLimit { .. } => ErrorKind::BadInput,
        }
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
