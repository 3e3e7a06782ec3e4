//! Tests of the data before identification.
//!
//! One file per test; each is a public function from samples to a typed result, with its equation and source. [`check_record`] runs
//! all tests on one record and returns [`Finding`]s: test, severity, location, numbers, advice. Nothing is repaired. The
//! thresholds and their reasons are documented in [`CheckOptions`].
//!
//! | file | test |
//! |---|---|
//! | `timing` | steps of the time column: irregular, missing, repeated, of another unit |
//! | `clipping` | saturation at a limit |
//! | `flatline` | a constant stretch of a channel; a channel that a slower sensor or task holds |
//! | `quantisation` | resolution of a channel relative to its innovation |
//! | `drift` | a trend not explained by the input |
//! | `outliers` | wrong samples, bursts, jumps of an offset |
//! | `patterns` | what wrong samples look like in an innovation |
//! | `sequence` | rows lost or logged twice |
//! | `delay` | dead time, channels shifted against each other |
//! | `excitation` | rank, crest factor and band of the excitation |
//! | `noise` | signal-to-noise ratio |
//! | `lines` | narrow lines of unbalance or mains |
//! | `feedback` | whether the input depends on the output |
//! | `controller` | whether the declared controller reproduces the logged input |
//! | `record` | [`check_record`]: all tests on one record |
//! | `outside` | the tests of excitation, noise, trends and lines |
//! | `regression` | the regressions of all tests, from one triangular factor |
//! | `robust` | the same without the rows of wrong samples |

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
mod patterns;
mod quantisation;
mod record;
mod regression;
mod robust;
mod sequence;
mod timing;

pub use clipping::{Clipping, Limit, clipping};
pub use controller::{Change, ControllerCheck, ControllerRecord, Declared, GainPart, Parts, Reading, controller};
pub use delay::{Delay, delay};
pub use drift::{Drift, drift};
pub use excitation::{ExcitationCheck, excitation};
pub use feedback::{FeedbackCheck, feedback};
pub use finding::{Finding, Severity, Test, by_severity};
pub use flatline::{Standstill, held, stuck};
pub use noise::{Noise, noise};
pub use options::CheckOptions;
pub use outliers::{Outliers, outliers, output_outliers};
pub use quantisation::{Quantisation, quantisation};
pub use record::{ChannelNames, LoggedRecord, check_record};
pub use timing::{Gap, TimingCheck, timing};
