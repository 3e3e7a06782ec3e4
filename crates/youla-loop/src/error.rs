//! The errors of check, excitation and redesign.

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of check, excitation or redesign, with its evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method rejected its input, or a computation failed.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// A part of a larger task failed.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
    /// No controller could be designed on an identified model within the limits.
    #[error(
        "no weight gives a new controller within the limits ({reasons}); add input_weights or relax the limits in [redesign]"
    )]
    NoRedesign {
        /// The reason for each weight.
        reasons: String,
    },
    /// No PID meets the limits at every drawn model.
    #[error(
        "no PID meets the limits at every model of the region: {reason}; relax the limit in [redesign.pid], or allow other terms or more notches"
    )]
    NoPid {
        /// What stops the nearest.
        reason: String,
    },
    /// The predicted response to an excitation exceeds a limit.
    #[error(
        "the predicted magnitude of {channel} is {predicted:.4}{unit}, above its limit of {limit}{unit}; the largest permitted {}",
        Amplitudes(permitted)
    )]
    BeyondLimit {
        /// The input or output that exceeds its limit by the largest factor.
        channel: String,
        /// Largest magnitude that the nominal loop predicts.
        predicted: f64,
        /// Its limit.
        limit: f64,
        /// The unit, behind a blank; empty where there is none.
        unit: String,
        /// Largest amplitude of each input that keeps all limits.
        permitted: Vec<f64>,
    },
}

youla::error_context! {
    sources: Method;
    numerical: NoRedesign NoPid;
    bad_input: BeyondLimit;
}

/// Prints the amplitudes of all inputs.
struct Amplitudes<'a>(&'a [f64]);

impl std::fmt::Display for Amplitudes<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Rounded down, so that the printed amplitude keeps the limit.
        let down = |x: &f64| {
            let unit = 10f64.powf(x.abs().log10().floor() - 3.0);
            if unit > 0.0 {
                format!("{:.4e}", (x / unit).floor() * unit).parse::<f64>().unwrap_or(*x).to_string()
            } else {
                x.to_string()
            }
        };
        let all: Vec<String> = self.0.iter().map(down).collect();
        write!(f, "{} {}", if all.len() == 1 { "amplitude is" } else { "amplitudes are" }, all.join(", "))
    }
}
