//! A whole run: run.toml and a log in, models with evidence out. The program and the Python package call this.
//!
//! ```text
//! settings -> records -> stages -> result -> {summary, page, folder}        beside: check, excite, init; on finished runs: finished, compare
//! ```

mod check;
mod compare;
mod error;
mod excite;
mod finished;
mod folder;
mod init;
mod method;
mod page;
mod records;
mod result;
mod schema;
mod settings;
mod stages;
mod summary;

pub use check::{
    CheckedFiles, CheckedRecord, DataCheck, DataCheckEntry, agreement, check_files, check_in_memory, check_run,
    further, parse_settings, read_check_options, read_settings,
};
pub use compare::{Comparison, Distance, compare, write_comparison};
pub use error::no_model::NoModel;
pub use error::{Error, Result};
pub use excite::{ExcitationPort, RunExcitation, excite_run, write_excitation};
pub use finished::export::{
    caution_for_export, controller_for_export, loop_for_export, model_for_export, pid_for_export,
};
pub use finished::plot::{Plot, plot, plottable, write_plots};
pub use finished::redraw::redraw;
pub use folder::artefacts::{Provenance, RunModelFile, SCHEMA};
pub use folder::write::{WrittenRun, write_into, write_run};
pub use init::{Draft, DraftClock, path_from};
pub use method::Method;
pub use page::fit::low_fit;
pub use page::notes::cautions;
pub use page::page;
pub use page::verdict::undecided;
pub use records::segments::RecordSegment;
pub use records::{RunRecords, SourceFile, read_records, records_in_memory, response_in_memory};
pub use result::{Filtered, Identification, Refusal};
pub use schema::{settings_schema, summary_schema};
pub use settings::{
    AlternativeStructure, Cascade, CascadeGains, ControllerSettings, DataFile, DataSettings, Discretisation,
    DisturbanceSettings, Domain, FactorSettings, Feedback, FrequencySettings, GreyBoxSettings, Hold, IdealPid,
    LoopGain, NominalModel, ParallelPid, Polynomials, PredictionKind, RunSettings, TachoUnit, VerificationSettings,
    parse_table, tables_with,
};
pub use stages::certificate::RunCertificate;
pub use stages::clock::{Stage, StageClock, StageTimes};
pub use stages::factors::{DeclaredLoop, LoopFactors, declared_loop, factorise_run};
pub use stages::grey_box::GreyBoxRun;
pub use stages::grey_box::criterion::StructureSearch;
pub use stages::nonparametric::LinesOfRun;
pub use stages::parts::{pid_kept, recommend_alone, redesign_kept, redesign_of};
pub use stages::pipeline::identify;
pub use stages::reduction::RunReduction;
pub use stages::signals::{DeviationSignals, signal_records, write_signals};
pub use stages::uncertainty::SystemUncertainty;
pub use stages::validate::residuals::{RecordResiduals, ResidualPredictor};
pub use stages::validate::robustness::LoopRobustness;
pub use stages::validate::{ModelValidation, RecordValidation, Validation};
pub use summary::certificate::CertificateEntry;
pub use summary::entries::{BandEntry, Fits, IntervalEntry, ModeEntry, OrRefused, RealPoleEntry, Refused};
pub use summary::model::{LargestEntry, ModelEntry, ResidualEntry};
pub use summary::physical::PhysicalEntry;
pub use summary::pid::{FigureEntry, PidEntry, ProofEntry, StepEntry};
pub use summary::recommended::shown_modes;
pub use summary::redesign::{ExactEntry, LoopEntry, RedesignEntry, SharedModeEntry};
pub use summary::reduction::ReductionEntry;
pub use summary::robustness::ScalesEntry;
pub use summary::{Summary, summary};
