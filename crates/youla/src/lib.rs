//! Closed-loop identification: finding out how a machine behaves while its controller keeps running.
//!
//! Feedback makes the input of a plant depend on its noise, which biases ordinary identification. With a doubly coprime
//! factorisation of a nominal model and of the controller that ran, the same data identify the *Youla deviation system* S,
//! which is stable, has an input that is independent of the noise, and represents the true plant G(S). This library factorises,
//! filters, identifies S, recombines it to G(S), reduces it and says what the result is worth.
//!
#![doc = include_str!("../assets/docs/flow.svg")]
//!
//! # Data flow
//!
//! Each module uses only those before it; a test holds this order. Files, settings, charts and the grey-box methods are crates of
//! their own, on top of this one.
//!
//! ```text
//! error -> linalg -> lti -> signal -> control -> factor -> identify -> reduce -> validate
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`linalg`] | ordered real Schur form, Sylvester, Lyapunov and Riccati equations, exponential and logarithm, each with its residual |
//! | [`lti`] | state space with the time domain as a type, interconnection, discretisation, response, norms, simulation |
//! | [`signal`] | labelled, clocked data; spectra; excitation signals and their persistency |
//! | [`control`] | LQR, Kalman predictor, observer-based controller (also for firmware), closed loops, margins, nu-gap |
//! | [`factor`] | the eight coprime factors, `J_G`, `J_K`, `K(Q)`, `G(S)`; (u, y) to (alpha, beta) |
//! | [`identify`] | the subspace family; the Hansen scheme and direct identification on top of it |
//! | [`reduce`] | balanced truncation, singular perturbation, weighted by the loop, normalised coprime factors; every order judged in the loop |
//! | [`validate`] | fit, variance accounted for, residual tests, certificates of the loop, prediction of fresh data |
//!
//! # The scheme in a few lines
//!
//! Feedback is positive everywhere, `u = K y`; records are samples x channels; the sample time is never guessed.
//!
//! ```
//! use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr};
//! use youla::factor::CoprimeFactors;
//! use youla::identify::{hansen::hansen, subspace::{Order, SubspaceOptions}};
//! use youla::linalg::{block, eye};
//! use youla::lti::{Discrete, simulate};
//! use youla::signal::{Excitation, SquareWaves};
//! use youla_paper::rig::{Bearing, degraded};
//! use youla::{Mat, validate::certify};
//! # use faer::Scale;
//! # use {rand::{RngExt, SeedableRng}, rand_chacha::ChaCha8Rng, rand_distr::StandardNormal};
//!
//! let time = Discrete::new(2e-4)?;
//! let machine = Bearing::default().plant()?.zoh(time)?;
//! let nominal = degraded(&Bearing::default().plant()?, 0.5, 1.0)?.zoh(time)?.balanced()?; // every entry of A halved
//! let (one, calm) = (eye(2), Scale(100.0) * eye(2)); // a gentle controller, which stabilises the machine too
//! let f = lqr(&nominal, &LqrWeights::on_outputs(&nominal, one.as_ref(), calm.as_ref())?)?.f;
//! let l = kalman(&nominal, &NoiseCovariance::at_inputs(&nominal, one.as_ref(), calm.as_ref())?)?.l;
//! let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?; // (13)-(15)
//!
//! // What the rig would log: alpha excites the loop, n is output noise.
//! let mut rng = ChaCha8Rng::seed_from_u64(1);
//! let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 };
//! let alpha = Excitation::SquareWaves(waves).generate(8000, 2, time, &mut rng)?;
//! let n = Mat::from_fn(8000, 2, |_, _| 0.3 * rng.sample::<f64, _>(StandardNormal));
//! let rig = closed_loop(&machine, &factors.j_k()?)?;
//! let log = simulate(&rig, block(&[&[alpha.as_ref(), n.as_ref()]]).as_ref(), &vec![0.0; rig.order()])?;
//!
//! let signals = factors.signals(log.subcols(0, 2), log.subcols(2, 2))?; // (28): one filter of [u; y]
//! let options = SubspaceOptions { horizon: 30, order: Order::Fixed(8), ..Default::default() };
//! let found = hansen(&factors, &[signals], &options)?; // (25), (17)
//! let verdict = certify(&found.plant, &factors.controller()?)?;
//! assert!(verdict.stable);
//! # Ok::<(), youla::Error>(())
//! ```

pub mod control;
pub mod error;
pub mod factor;
#[cfg(test)]
mod fixtures;
pub mod identify;
pub mod linalg;
pub mod lti;
pub mod reduce;
pub mod signal;
pub mod validate;

pub use error::{Error, ErrorKind, Result};
pub use faer::{Mat, MatRef, c64};
