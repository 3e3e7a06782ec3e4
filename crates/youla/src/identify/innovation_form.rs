//! S in innovation form: the Kalman gain of S from S itself, and B, D from the predictions with it.
//!
//! White output noise n reaches beta through `H = Mt + S Ut` (25), which shares A and C with S, is monic and, for a stable
//! plant, has all its zeros inside of the unit circle: then H is the innovation form of the noise,
//! ```text
//! x+ = A x + B alpha + K_s n,   beta = C x + D alpha + n,   H_i = C A^(i-1) K_s,   K_s = Gamma^+ [H_1; H_2; ...]
//! ```
//! with the Markov parameters H_i of the current S. B, D and x0 are refitted to the one-step predictions with `A - K_s C`,
//! whose errors are white where those of the simulation are not, and K_s is taken from the new S until it settles. Because
//! the zeros of H are the poles of the plant and of `A + B F`, this is refused where `A - K_s C` is not stable.

use super::subspace::{
    NoUncertainty, SubspaceData, SubspaceModel, SubspaceOptions, Uncertainty, UncertaintyMethod, UncertaintyOptions,
    check_uncertainty,
};
use crate::factor::CoprimeFactors;
use crate::linalg::{least_squares, observability};
use crate::lti::{Discrete, StateSpace, simulate};
use crate::{Error, Mat, Result};

/// How the noise of beta is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum NoiseForm {
    /// Not at all for a stable S: B and D from the simulated beta.
    #[default]
    Free,
    /// As white noise at the outputs of a stable plant, through S itself.
    Innovation(InnovationOptions),
}

/// The refits of the innovation form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnovationOptions {
    /// Largest number of refits in the innovation form, at least 1.
    pub iterations: usize,
    /// Relative change of K_s below which it has settled.
    pub tolerance: f64,
}

impl Default for InnovationOptions {
    fn default() -> Self {
        InnovationOptions { iterations: 20, tolerance: 1e-6 }
    }
}

/// Why the refits ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Convergence {
    /// K_s changed by less than the tolerance.
    Converged,
    /// The largest number of refits was reached.
    Iterations,
}

/// The innovation form of S.
#[derive(Debug, Clone)]
pub struct InnovationForm {
    /// K_s, n x p, with which B and D were found.
    pub gain: Mat<f64>,
    /// Refits made.
    pub iterations: usize,
    /// Why they ended.
    pub stop: Convergence,
    /// Last relative change of K_s.
    pub change: f64,
    /// What `Gamma K_s` misses of the Markov parameters of H, relative: A and C of S can be those of H only as far as this.
    pub misfit: f64,
    /// `|K_s - K| / |K_s|`, K the Kalman gain of the subspace method; `None` where there is none.
    pub from_kalman: Option<f64>,
}

pub(super) fn check(options: &SubspaceOptions, refits: &InnovationOptions) -> Result<()> {
    check_uncertainty(options)?;
    let refused = |what: &str, value: f64, must| Err(Error::OutOfRange { what: what.into(), value, must });
    if options.delays.iter().any(|delay| *delay > 0) {
        let (what, instead) = ("a delay with structure = \"innovation\"", "take structure = \"free\"");
        return Err(Error::Unsupported { what, instead });
    }
    if refits.iterations == 0 {
        return refused("the number of iterations in [deviation]", 0.0, "at least 1");
    }
    let sensible = refits.tolerance >= 0.0 && refits.tolerance < 1.0;
    if sensible { Ok(()) } else { refused("tolerance in [deviation]", refits.tolerance, "at least 0 and below 1") }
}

/// K_s from S, S from K_s, until K_s settles. The uncertainty is not computed, since it would be that of another fit.
pub(super) fn refit(
    factors: &CoprimeFactors<Discrete>,
    data: &SubspaceData<'_>,
    options: &SubspaceOptions,
    refits: &InnovationOptions,
) -> Result<(SubspaceModel, InnovationForm)> {
    let without = SubspaceOptions { uncertainty: UncertaintyOptions::default(), ..options.clone() };
    let mut model = data.identify(&without)?;
    let kalman = model.innovation.gain().map(|gain| gain.to_owned());
    let mut now = gain_of(factors, &model)?;
    let mut change = f64::INFINITY;
    let mut iterations = 0;
    while iterations < refits.iterations && change > refits.tolerance {
        require_stable_predictor(&model.model, &now.gain)?;
        model = data.refit(model, now.gain.as_ref(), options)?;
        let next = gain_of(factors, &model)?;
        change = (&next.gain - &now.gain).norm_l2() / next.gain.norm_l2();
        now = next;
        iterations += 1;
    }
    let stop = if change <= refits.tolerance { Convergence::Converged } else { Convergence::Iterations };
    let from_kalman = kalman.map(|kalman| (&now.gain - kalman).norm_l2() / now.gain.norm_l2());
    let asked = options.uncertainty.method != UncertaintyMethod::None;
    model.uncertainty = asked.then_some(Uncertainty::Refused { reason: NoUncertainty::OtherFit });
    let form = InnovationForm { gain: now.gain, iterations, stop, change, misfit: now.misfit, from_kalman };
    Ok((model, form))
}

struct Gain {
    gain: Mat<f64>,
    misfit: f64,
}

/// `K_s = Gamma^+ [H_1; H_2; ...]` from the responses of beta to an impulse at each output.
fn gain_of(factors: &CoprimeFactors<Discrete>, s: &SubspaceModel) -> Result<Gain> {
    let (model, p, m) = (&s.model, factors.outputs(), factors.inputs());
    let blocks = s.horizon.max(RESPONSE * model.order());
    let noise = factors.residual_filter(model)?;
    let mut markov = Mat::zeros(blocks * p, p);
    for j in 0..p {
        let impulse = Mat::from_fn(blocks + 1, m + p, |k, c| if (k, c) == (0, m + j) { 1.0 } else { 0.0 });
        let response = simulate(&noise, impulse.as_ref(), &vec![0.0; noise.order()])?;
        (0..blocks * p).for_each(|row| markov[(row, j)] = response[(1 + row / p, row % p)]);
    }
    let gamma = observability(model.a(), model.c(), blocks);
    let gain = least_squares("the observability matrix of S", gamma.as_ref(), markov.as_ref())?.x;
    let misfit = (gamma * &gain - &markov).norm_l2() / markov.norm_l2();
    Ok(Gain { gain, misfit })
}

/// Markov parameters per state.
const RESPONSE: usize = 10;

fn require_stable_predictor(s: &StateSpace<Discrete>, gain: &Mat<f64>) -> Result<()> {
    let a = s.a() - gain * s.c();
    let predictor = StateSpace::new(a, gain.clone(), s.c().to_owned(), Mat::zeros(s.outputs(), s.outputs()), s.time())?;
    predictor
        .require_stable("the predictor A - K_s C of S (its poles are those of the plant; take structure = \"free\")")
}
