//! The paper as a computation: its study, its experiments, and the question that it asks, which method under which
//! conditions.
//!
//! | file | holds |
//! |---|---|
//! | `settings` | everything that was chosen, one file |
//! | `controller` | the controller of one nominal model, with its margin |
//! | `item` | one nominal model: controller, loop, identification by every method, verification |
//! | `monte_carlo`, `crossover` | the items of Figs 4 and 5 and of the crossover map |
//! | `row` | one line of a results file, with its own check |
//! | `campaign` | many items on all cores, streamed to a file in order, resumable |
//! | `experiment`, `experiments` | Table 1 and Figs 6 to 10 on the digital twin |
//! | `paper` | everything that was found |
//! | `statistics` | quantiles, deciles, failures, winners |

mod campaign;
mod controller;
mod crossover;
mod excitation_report;
mod experiment;
mod experiments;
mod item;
mod method;
mod monte_carlo;
mod paper;
mod row;
mod settings;
mod statistics;

pub use campaign::{CampaignOutcome, Shard, StudyCampaign, read_results};
pub use controller::{Design, design, design_with};
pub use crossover::{count as crossover_items, crossover};
pub use excitation_report::{
    ExcitationReport, ExcitationReportOptions, ExcitedChannel, PowerBand, describe_excitation,
};
pub use experiment::{Case, ExperimentModel, Start, StudyExperiment};
pub use experiments::{Experiments, OpenLoopFit, experiments};
pub use item::{Evaluated, Item, evaluate};
pub use method::StudyMethod;
pub use monte_carlo::monte_carlo;
pub use paper::{Paper, PaperTiming};
pub use row::{RowStatus, StudyRow};
pub use settings::{CrossoverSettings, ExperimentSettings, PaperSettings, StudyController, StudySettings};
pub use statistics::{Decile, POOR_FIT, TIE, Winner, deciles, median, overall, quantile, winner};
