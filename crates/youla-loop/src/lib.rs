//! Tools for a running loop: check of the recorded data, design of the excitation, redesign of the controller and its table over an operating point.
//!
//! | module | content |
//! |---|---|
//! | [`check`] | tests of a record before identification; each finding states severity, location, figures and remedy |
//! | [`excite`] | an excitation sequence for the port alpha or the plant input, with predicted peaks and mode accuracies |
//! | [`redesign`] | a new controller on an identified model, with predicted damping and robustness |
//! | [`schedule`] | Q between two operating points, with evidence that the loop stays stable |
//!
//! Matrices are samples x channels; feedback is positive, `u = K y`. Nothing is repaired and nothing is read from files.
//!
//! ```
//! use youla::{Mat, lti::Discrete, signal::Channel};
//! use youla_loop::check::{ChannelNames, CheckOptions, LoggedRecord, Severity, check_record};
//! let hash = |k: usize| ((k * k * 31 + 7 * k) % 8191) as f64 / 8191.0 - 0.5;
//! let u = Mat::from_fn(2000, 1, |k, _| hash(k));
//! let y = Mat::from_fn(2000, 1, |k, _| if k == 0 { 0.0 } else { (2.0 * hash(k - 1)).min(0.8) });
//! let record = LoggedRecord {
//!     name: "log", time: Discrete::new(1e-3)?, first_row: 1, u: u.as_ref(), y: y.as_ref(),
//!     input_excitation: None, reference: None, alpha: None,
//! };
//! let names = ChannelNames { inputs: vec![Channel::new("u", "V")], outputs: vec![Channel::new("y", "um")], ..Default::default() };
//! let findings = check_record(&record, &names, None, &CheckOptions::default())?;
//! assert!(findings.iter().any(|f| f.severity == Severity::Defect && f.what.contains("clipped at its highest value")));
//! # Ok::<(), youla_loop::Error>(())
//! ```

pub mod check;
mod error;
pub mod excite;
pub mod redesign;
pub mod schedule;

pub use error::{Error, Result};
