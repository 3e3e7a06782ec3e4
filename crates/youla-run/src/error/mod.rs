//! Everything that can go wrong with a run, with the evidence.

pub(crate) mod no_model;

use crate::error::no_model::NoModel;
use std::path::PathBuf;
use youla::error::Names;

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
    /// The check of the data, the excitation or the redesign was impossible.
    #[error(transparent)]
    Loop(#[from] youla_loop::Error),
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
    /// A figure is asked for a part that it does not distinguish.
    #[error("the figure {figure:?} cannot be drawn for one {choice} alone; its choices are: {}", Names(known))]
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
    /// No method gives a model.
    #[error("{0}")]
    NoModel(NoModel),
    /// The controller does not stabilise the model that is factorised with it.
    #[error("the controller does not stabilise the {model} model: the closed loop has the pole {pole}; {cause}")]
    NotStabilised {
        /// `nominal` or `recommended`.
        model: &'static str,
        /// The worst closed-loop pole with its magnitude.
        pole: String,
        /// The most likely cause, and the key that mends it.
        cause: String,
    },
    /// Two records of a run have the same name.
    #[error("two records are named {name:?}; give one of their files another `name`")]
    DuplicateRecord {
        /// The name.
        name: String,
    },
    /// A file of a run folder has another layout than this version writes.
    #[error("{}: this is not a file of a run of this version of youla ({source}); run `youla identify` again", path.display())]
    NotASummary {
        /// The file.
        path: PathBuf,
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
}

youla::error_context! {
    sources: Method File GreyBox Loop Report NoModel;
    numerical:;
    bad_input: NotStabilised ChoiceOfFigure NothingToDraw DuplicateRecord NotASummary NotAReport;
}

impl Error {
    /// The error of the method below all parts, where it is one.
    pub(crate) fn root(&self) -> Option<&youla::Error> {
        match self {
            Error::Method(source) => Some(source.root()),
            Error::Within { source, .. } => source.root(),
            _ => None,
        }
    }

    /// Whether the records and the nominal model, although well formed, do not suffice for a method that another may replace.
    pub(crate) fn is_of_the_records(&self) -> bool {
        match self {
            Error::Method(source) => source.is_of_the_records(),
            Error::Within { source, .. } => source.is_of_the_records(),
            Error::NotStabilised { .. } => true,
            _ => false,
        }
    }
}
