//! Everything that can go wrong with reports, with the evidence.

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
    /// The data of a report cannot be written as JSON.
    #[error("the data of the report cannot be written as JSON: {source}")]
    ReportData {
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

youla::error_context! {
    sources: Method;
    numerical: ReportData ReportTemplate;
    bad_input:;
}
