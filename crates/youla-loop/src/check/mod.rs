//! What is wrong with the data before anything is identified from them.
//!
//! One file per test; each is a public function from samples to a typed result, with its equation and source. [`check_record`] runs
//! all of them on one record and says what they found as [`Finding`]s: which test, how serious, where, how bad, what to do.
//! Nothing is repaired. What the thresholds are and why stands in [`CheckOptions`].
//!
//! | file | test |
//! |---|---|
//! | `timing` | steps of the time column: irregular, missing, repeated, of another unit |
//! | `clipping` | values held at a limit |
//! | `stuck` | a channel that stands still |
//! | `quantisation` | steps of a channel against its innovation |
//! | `drift` | a trend that the input does not explain |
//! | `outliers` | single wrong samples |
//! | `delay` | dead time, channels shifted against each other |
//! | `excitation` | rank, crest factor and band of the excitation |
//! | `noise` | signal-to-noise ratio |
//! | `lines` | narrow lines of unbalance or mains |
//! | `feedback` | whether the input depends on the output |
//! | `controller` | whether the declared controller gives the logged input |
//! | `record` | [`check_record`]: all of them on one record |
//! | `outside` | those of them that depend on what moves the record from outside |
//! | `regression` | what several tests share: all regressions of a record from one triangular factor |

mod clipping;
mod controller;
mod delay;
mod drift;
mod excitation;
mod feedback;
mod finding;
mod flatline;
mod lines;
mod noise;
mod options;
mod outliers;
mod outside;
mod quantisation;
mod record;
mod regression;
mod timing;

pub use clipping::{Clipping, Limit, clipping};
pub use controller::{Change, ControllerCheck, ControllerRecord, controller};
pub use delay::{Delay, delay};
pub use drift::{Drift, drift};
pub use excitation::{Excitation, excitation};
pub use feedback::{Feedback, feedback};
pub use finding::{Finding, Severity, Test, by_severity};
pub use flatline::{Standstill, stuck};
pub use lines::{Line, lines};
pub use noise::{Noise, noise};
pub use options::CheckOptions;
pub use outliers::{Outliers, outliers};
pub use quantisation::{Quantisation, quantisation};
pub use record::{ChannelNames, LoggedRecord, check_record};
pub use timing::{Gap, Timing, timing};
