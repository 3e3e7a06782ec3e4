//! A whole run: run.toml and a log in, models with evidence out. The program and the Python package call this.

mod artefacts;
mod certificate;
mod check;
mod choices;
mod compare;
mod computed;
mod context;
mod controller_errors;
mod direct;
mod disturbance;
mod entries;
mod error;
mod excite;
mod excite_figure;
mod export;
mod factorise;
mod findings;
mod folder;
mod grey_box;
mod grey_box_loop;
mod identification;
mod init;
mod lines;
mod measured;
mod method;
mod no_model;
mod noise_models;
mod page;
mod parts;
mod pipeline;
mod plot;
mod recommend;
mod recommended;
mod records;
mod redesign;
mod redraw;
mod reduction;
mod reference;
mod residual_tests;
mod residual_view;
mod response;
mod robustness;
mod robustness_view;
mod schema;
mod scheme;
mod segments;
mod settings;
mod signals;
mod stabilisation;
mod stage;
mod streaming;
mod subspace_details;
mod summary;
mod uncertainty;
mod verdict;
mod write;

pub use artefacts::{ModelFile, Provenance, SCHEMA};
pub use certificate::{CertificateEntry, RunCertificate};
pub use check::{
    CheckedFiles, CheckedRecord, DataCheck, DataCheckEntry, check_files, check_in_memory, check_run, further,
    read_check_options,
};
pub use compare::{Comparison, Distance, compare, write_comparison};
pub use controller_errors::{
    Changed, ChangedMode, ControllerError, ControllerErrorEffect, ControllerErrorEntry, EffectEntry, ModePoint,
};
pub use entries::{BandEntry, Fits, IntervalEntry, ModeEntry, OrRefused, Refused};
pub use error::{Error, Result};
pub use excite::{ExcitationPort, RunExcitation, excite_run, write_excitation};
pub use export::{controller_for_export, loop_for_export, model_for_export};
pub use factorise::{DeclaredLoop, LoopFactors, declared_loop, factorise, factorise_run};
pub use findings::cautions;
pub use folder::write_artefacts;
pub use grey_box::{GreyBoxRun, PhysicalEntry};
pub use grey_box_loop::StructureSearch;
pub use identification::{Filtered, Identification, Refusal, SchemeRun};
pub use init::{Draft, DraftClock, path_from};
pub use lines::{LinesEntry, LinesOfRun};
pub use method::Method;
pub use no_model::NoModel;
pub use page::page;
pub use parts::{recommend_alone, redesign_of};
pub use pipeline::identify;
pub use plot::{Plot, plot, plottable, write_plots};
pub use recommended::shown_modes;
pub use records::{LoopRecord, RunRecords, SourceFile, read_records, records_in_memory};
pub use redesign::{ExactEntry, LoopEntry, RedesignEntry, SharedModeEntry, entry as redesign_entry};
pub use redraw::redraw;
pub use reduction::{ReductionEntry, RunReduction};
pub use reference::settings_reference;
pub use residual_tests::{LargestEntry, RecordResiduals, ResidualEntry, ResidualPredictor};
pub use robustness::{DiskEntry, Robustness, RobustnessEntry, ScalesEntry};
pub use schema::{settings_schema, summary_schema};
pub use segments::RecordSegment;
pub use settings::{
    AlternativeStructure, CertificateSettings, ControllerSettings, DataFile, DataSettings, DeviationSettings,
    Discretisation, DisturbanceSettings, Domain, FactorSettings, Feedback, FrequencySettings, GreyBoxSettings, Hold,
    IdealPid, NominalModel, ParallelPid, Polynomials, Prediction, RealisedController, RunSettings, TachoUnit,
    VerificationSettings, parse_table,
};
pub use signals::{DeviationSignals, deviation_signals, signal_records, write_signals};
pub use stage::{Stage, StageClock, StageTimes};
pub use streaming::{
    LongModel, LongRecords, ReadingProgress, identify_long, long_model_file, parse_subspace_options,
    read_subspace_options,
};
pub use summary::{
    MethodEntry, PortCurves, ReferenceEntry, ResponsesEntry, SUMMARY_SCHEMA, Summary, responses, summary,
};
pub use uncertainty::{EvidenceEntry, RunUncertainty, SystemUncertainty, UncertaintyEntry};
pub use verdict::{ModelVerdict, RecordVerdict, Verdict};
pub use write::{WrittenRun, write_run};
