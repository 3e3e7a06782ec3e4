//! Closed-loop identification: finding out how a machine behaves while its controller keeps running.
//!
//! Feedback makes the input of a plant depend on its noise, which biases ordinary identification. With a doubly coprime
//! factorisation of a nominal model and of the controller that ran, the same data identify the *Youla deviation system* S,
//! which is stable, has an input that is independent of the noise, and represents the true plant G(S). This library factorises,
//! filters, identifies S, recombines it to G(S), reduces it and says what the result is worth. Its first name, [`identify()`], takes the
//! plant from u and y by maximum likelihood, without a tuning key, and derives S from it.
//!
#![doc = include_str!("../assets/docs/flow.svg")]
//!
//! # Data flow
//!
//! Each module uses only those before it; a test holds this order. Files, settings, charts and the grey-box methods are crates of
//! their own, on top of this one.
//!
//! ```text
//! error -> statistics -> linalg -> lti -> signal -> control -> factor -> identify -> reduce -> validate
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`statistics`] | quantiles and distributions |
//! | [`linalg`] | ordered real Schur form, Sylvester, Lyapunov and Riccati equations, exponential and logarithm, each with its residual |
//! | [`lti`] | state space with the time domain as a type, interconnection, discretisation, response, norms, simulation |
//! | [`signal`] | labelled, clocked data; spectra; excitation signals and their persistency |
//! | [`control`] | LQR, Kalman predictor, observer-based controller (also for firmware), closed loops, margins, nu-gap |
//! | [`factor`] | the eight coprime factors, `J_G`, `J_K`, `K(Q)`, `G(S)`; (u, y) to (alpha, beta) |
//! | [`mod@identify`] | the model that the records support, [`identify()`]; the subspace family; the Hansen scheme and direct identification on top of it |
//! | [`reduce`] | balanced truncation, singular perturbation, weighted by the loop, normalised coprime factors; every order judged in the loop |
//! | [`validate`] | fit, variance accounted for, residual tests, certificates of the loop, prediction of fresh data |
//!
//! # Eleven programs
//!
//! Feedback is positive everywhere, `u = K y`; records are samples x channels; the sample time is never guessed.
//!
//! In all of them `machine` is an oscillator of 10 Hz, of which the nominal model says 9 Hz; `f` and `l` are the gains of the
//! controller that ran, `alpha` is the excitation of the loop, `u` and `y` are the log.
//!
//! 1. From the log of a loop to a model with region, deviation system and evidence ([`identify()`])
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::{control::RunningController, signal::LoopRecord};
//! let record = LoopRecord::new(time, u, y)?.with_alpha(alpha)?;
//! let controller = RunningController::observer(&nominal, f, l)?; // of a model: RunningController::new(k), u = K y
//! let found = youla::identify(&[record], &[], &controller, Some(&nominal), &Default::default())?;
//! assert!((found.model.modes[0].mode.hz - 10.0).abs() < 0.1); // the nominal model says 9 Hz
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 2. Factorise a nominal model and its controller
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::factor::CoprimeFactors;
//! let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?; // (13)-(15)
//! let (n, m, controller) = (factors.n(), factors.m(), factors.controller()?);
//! assert_eq!((n.order(), m.order(), controller.order()), (2, 2, 2));
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 3. Bezout identity
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::factor::CoprimeFactors;
//! let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
//! let residual = factors.bezout_residual(&[1.0, 10.0, 60.0, 300.0])?; // at these rad/s, relative
//! assert!(residual < 1e-12);
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 4. From (u, y) to (alpha, beta)
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::factor::CoprimeFactors;
//! let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
//! let signals = factors.signals(u.as_ref(), y.as_ref())?; // (28): one filter of [u; y], from rest
//! assert!((signals.alpha() - &alpha).norm_max() < 1e-9); // alpha is the excitation of this loop
//! let settled = signals.after(factors.settling_samples(1e-3)?)?;
//! assert!(settled.samples() < 4000);
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 5. The modified Hansen scheme
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::identify::{Order, SubspaceOptions, hansen};
//! # let factors = youla::factor::CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
//! let signals = factors.signals(u.as_ref(), y.as_ref())?;
//! let options = SubspaceOptions { horizon: 20, order: Order::Fixed(4), ..Default::default() };
//! let found = hansen(&factors, &[signals], &options)?; // (25): S; (17): G(S)
//! let modes = found.plant.modes()?;
//! assert!(modes.iter().any(|mode| (mode.hz - 10.0).abs() < 0.1)); // the nominal model says 9 Hz
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 6. Direct identification from (u, y)
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::identify::{Experiment, Order, SubspaceMethod, SubspaceOptions, direct};
//! let method = SubspaceMethod::PbsidOpt; // consistent in closed loop
//! let options = SubspaceOptions { method, horizon: 20, order: Order::Fixed(2), ..Default::default() };
//! let found = direct(&[Experiment::new(u.as_ref(), y.as_ref())], time, &options)?;
//! assert!((found.model.modes()?[0].hz - 10.0).abs() < 0.1);
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 7. Interval of a frequency response
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::{control::RunningController, lti::frequency_response, signal::LoopRecord};
//! let record = LoopRecord::new(time, u, y)?.with_alpha(alpha)?;
//! let controller = RunningController::observer(&nominal, f, l)?;
//! let found = youla::identify(&[record], &[], &controller, Some(&nominal), &Default::default())?.model;
//! let g = frequency_response(&found.plant, &[60.0])?.at(0)[(0, 0)];
//! let deviation = found.region.at(60.0 / std::f64::consts::TAU).entries().of_magnitude(g, (0, 0));
//! assert!(0.0 < deviation && deviation < 0.1 * g.norm());
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 8. Reduction in the loop
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::reduce::{ReducedOrder, ReductionLoop, ReductionOptions, reduce_in_loop};
//! # let factors = youla::factor::CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
//! let deviation = factors.deviation_of(&machine)?; // S, here the exact one
//! let inside = ReductionLoop::new(&factors, &deviation)?; // G(S), of order n + n_S, in the loop that ran
//! let options = ReductionOptions { order: ReducedOrder::Fixed(2), ..Default::default() };
//! let reduced = reduce_in_loop(&inside, &options)?;
//! assert!((reduced.reduction.model.modes()?[0].hz - 10.0).abs() < 1e-6);
//! assert!(reduced.row().is_some_and(|row| row.stabilised)); // by the controller
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 9. Margins and nu-gap
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::control::{margins, nu_gap};
//! # let factors = youla::factor::CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
//! let controller = factors.controller()?;
//! let found = margins(&machine, &controller)?; // gain, phase, delay and disk margins, sensitivity peaks
//! let gap = nu_gap(&machine, &nominal)?;
//! assert!(found.coprime > 0.0 && 0.0 < gap.value && gap.value <= 1.0);
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 10. Riccati and Lyapunov equations
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::linalg::{RiccatiProblem, dare, discrete_lyapunov};
//! let (q, r) = (eye(2), eye(1));
//! let problem = RiccatiProblem { a: nominal.a(), b: nominal.b(), q: q.as_ref(), r: r.as_ref(), s: None };
//! let riccati = dare("the weights of the feedback", &problem)?;
//! let closed = nominal.a() - nominal.b() * &riccati.gain; // stable: K in the sign of the textbooks
//! let gramian = discrete_lyapunov(closed.as_ref(), q.as_ref())?; // A X A' - X + Q = 0
//! assert!(riccati.relative_residual < 1e-12 && gramian.residual < 1e-12);
//! # Ok::<(), youla::Error>(())
//! ```
//!
//! 11. Certificate of a loop
//!
//! ```
#![doc = include_str!("../assets/docs/loop.txt")]
//! use youla::validate::certify;
//! # let factors = youla::factor::CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
//! let certificate = certify(&machine, &factors.controller()?)?;
//! assert!(certificate.stable && certificate.poles.len() == 4);
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
pub mod statistics;
pub mod validate;

pub use error::{Error, ErrorKind, Result};
pub use faer::{Mat, MatRef, c64};
pub use identify::identify;
