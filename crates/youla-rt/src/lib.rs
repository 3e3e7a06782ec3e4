//! The observer-based controller with the ports alpha and beta, `J_K: (y, alpha) -> (u, beta)` of (21), (22) and Fig. 3,
//! sample by sample, for firmware, the simulated rig and the host alike.
//!
//! No standard library, no allocation, no `unsafe`, no dependency, no panic: all sizes are part of the types, and there is
//! no index, division or conversion that could fail while the controller runs. Optimised code for `thumbv7em-none-eabihf`
//! refers to no panic at all; without optimisation it holds the debug assertions of `core`. One step takes
//! `n^2 + 2 n (m + p) + m p` products. The matrices are a [`Controller`], which never changes; what moves is a [`State`],
//! which the caller keeps. `f64` on the host, `f32` or `f64` on the target ([`Real`]).
//! `youla::control::real_time_controller` makes a controller from a design.
//!
//! # Equations
//!
//! With positive feedback, A + B F and A + L C stable, and xh the prediction of the state of the nominal model:
//!
//! ```text
//! u    = F xh + alpha                    command: before y is known
//! beta = y - C xh - D u                  observe: with the u that the actuators really applied
//! xh+  = A xh + B u - L beta
//! ```
//!
//! The command does not wait for the measurement of the same sample, so the two phases fit on either side of the
//! converters. The observer takes u as an input. It may therefore differ from the command, by saturation, quantisation or
//! a safety stop: `beta = Mt y - Nt u` (28) remains true, the observer does not wind up, and identification sees no error.
//!
//! [`ExcitedLoop`] is the whole loop of a firmware around it, `command -> limit -> apply -> observe`: excitation with ramps
//! ([`ExcitationSource`]), a guard that ends it ([`Limits`], [`Cause`]), and a parameter Q that is exchanged while the loop runs
//! ([`QCoefficients`]).
//!
//! # Example
//!
//! ```
//! use youla_rt::{Controller, Matrices, State};
//!
//! // x+ = 1.1 x + u, y = x: unstable, with A + B F = 0.5 and A + L C = 0.4.
//! let controller = Controller::new(Matrices {
//!     a: [[1.1_f32]], b: [[1.0]], c: [[1.0]], d: [[0.0]],
//!     f: [[-0.6]], l: [[-0.7]],
//! })?;
//! let mut state = State::at_rest();
//! let mut x = 0.1;
//! for _ in 0..100 {
//!     let [command] = controller.command(&state, &[0.0]);
//!     let applied = command.clamp(-0.05, 0.05); // what the actuator can do
//!     let _beta = controller.observe(&mut state, &[x], &[applied]);
//!     x = 1.1 * x + applied;
//! }
//! assert!(x.abs() < 1e-6);
//! # Ok::<(), youla_rt::NotFinite>(())
//! ```

#![no_std]
#![forbid(unsafe_code)]

mod checksum;
mod controller;
mod excitation;
mod excited_loop;
mod filter;
mod guard;
mod matrices;
mod parameter;
mod ramp;
mod real;
mod status;

pub use checksum::Checksum;
pub use controller::{Controller, Output, State};
pub use excitation::{ExcitationSource, MultisineSource, PrbsSource, TableSource, Tone};
pub use excited_loop::{ExcitedLoop, LoopRefusal, Row};
pub use filter::Filter;
pub use guard::{Cause, Limits, Trip};
pub use matrices::{Matrices, NotFinite};
pub use parameter::{QCoefficients, QRefusal};
pub use ramp::OUT_WITHIN;
pub use real::Real;
pub use status::{Phase, Status};
