//! Everything that can go wrong with the paper, with the evidence.

use std::path::PathBuf;

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong, with the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method refused its input or its computation.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] youla_io::Error),
    /// A physical structure could not be used or estimated.
    #[error(transparent)]
    GreyBox(#[from] youla_greybox::Error),
    /// The simulated rig was impossible.
    #[error(transparent)]
    Twin(#[from] youla_twin::Error),
    /// A report could not be drawn.
    #[error(transparent)]
    Report(#[from] youla_report::Error),
    /// Something failed in a part of a larger task.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
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
}

youla::error_context! {
    sources: Method File GreyBox Report Twin;
    numerical:;
    bad_input: NoController BadShard NotResults InUse OtherSettings Parts;
}
