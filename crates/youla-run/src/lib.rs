//! A whole run: run.toml and a log in, models with evidence out. The program and the Python package call this.

mod artefacts;
mod certificate;
mod check;
mod compare;
mod controller_errors;
mod disturbance;
mod error;
mod excite;
mod excite_figure;
mod explain;
mod export;
mod factorise;
mod findings;
mod init;

mod grey_box;
mod grey_box_loop;
mod models;
mod noise_models;
mod page;
mod pipeline;
mod plot;
mod records;
mod redesign;
mod redraw;
mod reduction;
mod reference;
mod residual_tests;
mod response;
mod robustness;
mod schema;
mod segments;
mod settings;
mod signals;
mod stabilisation;
mod streaming;
mod summary;
mod uncertainty;
mod verdict;
mod write;

pub use artefacts::{ModelFile, Provenance, SCHEMA, write_artefacts};
pub use certificate::{CertificateSettings, RunCertificate};
pub use check::{CheckedFiles, CheckedRecord, DataCheck, check_files, check_run, further, read_check_options};
pub use compare::{Comparison, Distance, compare, write_comparison};
pub use controller_errors::{Changed, ControllerError, ControllerErrorEffect};
pub use disturbance::{DisturbanceSettings, TachoUnit};
pub use error::{Error, Result};
pub use excite::{ExcitationPort, RunExcitation, excite_run, write_excitation};
pub use export::{controller_for_export, model_for_export};
pub use factorise::{Factorisation, factorise, factorise_run};
pub use findings::cautions;
pub use grey_box::{AlternativeStructure, GreyBoxRun, GreyBoxSettings};
pub use init::{Draft, DraftClock, path_from};
pub use models::{Controller, ControllerSettings, Domain, Feedback, NominalModel, Polynomials};
pub use page::page;
pub use pipeline::{Identification, Refusal, Stage, StageClock, StageTimes, identify};
pub use plot::{Plot, plot, plottable, write_plots};
pub use records::{LoopRecord, RunRecords, SourceFile, read_records};
pub use redraw::redraw;
pub use reduction::RunReduction;
pub use reference::settings_reference;
pub use residual_tests::{Foresight, RecordResiduals};
pub use robustness::Robustness;
pub use schema::settings_schema;
pub use segments::RecordSegment;
pub use settings::{
    Construction, DataFile, DataSettings, DeviationSettings, FactorSettings, FrequencySettings, Prediction,
    RunSettings, StabilisationSettings, VerificationSettings,
};
pub use signals::{DeviationSignals, deviation_signals, signal_records, write_signals};
pub use stabilisation::Diagrams;
pub use streaming::{
    LongModel, LongRecords, ReadingProgress, identify_long, long_model_file, parse_subspace_options,
    read_subspace_options,
};
pub use summary::summary;
pub use uncertainty::{RunUncertainty, SystemUncertainty};
pub use verdict::{Method, ModelVerdict, RecordVerdict, Verdict};
pub use write::{WrittenRun, write_run};
