//! The uncertainty of a subspace estimate, from the same call: by the delta method over blocks of time or by resampling the
//! one-step residuals. Both carry over to everything that is made from the estimate, [`Uncertainty::through`].

mod band;
mod blocks;
mod bootstrap;
mod delta;
mod evidence;
mod figures;
mod influence;
mod inputs;
mod options;
mod poles;
mod response;
#[cfg(test)]
mod tests;
mod zeros;

use crate::statistics as student;
pub use band::Reach;
pub use band::{ModeBand, ResponseBand};
pub use bootstrap::Bootstrap;
pub use delta::{BlockInfluence, Delta};
pub use evidence::DeviationEvidence;
pub use figures::{Draw, Interval};
pub use options::{UncertaintyMethod, UncertaintyOptions};
pub(super) use poles::pole_deviations;
pub use response::{mode_change, response_changes};
pub use zeros::zero_changes;

use super::innovation::{Innovation, NoInnovation};
use super::output_error::Base;
use super::view::View;
use super::{SubspaceData, SubspaceOptions};
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Mat, Result};

/// What is known of the error of an estimate.
#[derive(Debug, Clone)]
pub enum Uncertainty {
    /// By the influence of each block of time.
    Delta(Delta),
    /// By models of resampled records.
    Bootstrap(Bootstrap),
    /// It was asked for but cannot be had.
    Refused {
        /// Why.
        reason: NoUncertainty,
    },
}

/// Why there is no uncertainty.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoUncertainty {
    /// Nothing is left that could vary.
    #[error("the model explains an output to working precision, so that no noise is left to judge by")]
    NoiseFree,
    /// The noise model that the bootstrap resamples is missing.
    #[error("the bootstrap needs a Kalman gain, and there is none: {0}; take method = \"delta\"")]
    NoGain(String),
    /// Simulated records of the estimate would grow without bound.
    #[error("the bootstrap simulates the estimate, and it is unstable; take method = \"delta\"")]
    Unstable,
    /// The model was not found as the method finds it.
    #[error("it holds for structure = \"free\" without a refinement, and the model was fitted anew")]
    OtherFit,
    /// A step failed.
    #[error("{0}")]
    Failed(String),
}

impl Uncertainty {
    /// The same for a system that is made from the estimate, for example `G(S)` from S; `map` must keep the coordinates of
    /// its states when its argument changes a little.
    ///
    /// # Errors
    /// Those of `map` for the estimate itself.
    pub fn through(&self, map: impl Fn(&StateSpace<Discrete>) -> Result<StateSpace<Discrete>>) -> Result<Uncertainty> {
        Ok(match self {
            Uncertainty::Delta(delta) => Uncertainty::Delta(delta.through(map)?),
            Uncertainty::Bootstrap(bootstrap) => Uncertainty::Bootstrap(bootstrap.through(map)?),
            Uncertainty::Refused { reason } => Uncertainty::Refused { reason: reason.clone() },
        })
    }

    /// The frequency response at the angular frequencies `omega`, rad/s, with its regions; `None` where there are none.
    ///
    /// # Errors
    /// As [`crate::lti::frequency_response`].
    pub fn response(&self, omega: &[f64]) -> Result<Option<ResponseBand>> {
        match self {
            Uncertainty::Delta(delta) => delta.response(omega).map(Some),
            Uncertainty::Bootstrap(bootstrap) => bootstrap.response(omega).map(Some),
            Uncertainty::Refused { .. } => Ok(None),
        }
    }

    /// The modes with their intervals, in the order of [`StateSpace::modes`]; empty where there are none.
    ///
    /// # Errors
    /// [`Error::NoConvergence`] of the eigenvalues.
    pub fn modes(&self) -> Result<Vec<ModeBand>> {
        match self {
            Uncertainty::Delta(delta) => delta.modes(),
            Uncertainty::Bootstrap(bootstrap) => bootstrap.modes(),
            Uncertainty::Refused { .. } => Ok(Vec::new()),
        }
    }

    /// Why there is none, where it was refused.
    pub fn refusal(&self) -> Option<&NoUncertainty> {
        match self {
            Uncertainty::Refused { reason } => Some(reason),
            _ => None,
        }
    }
}

/// Refuses options that cannot be had from any record.
pub(crate) fn check(options: &SubspaceOptions) -> Result<()> {
    options.uncertainty.check()?;
    let bootstrap = options.uncertainty.method == UncertaintyMethod::Bootstrap;
    if bootstrap && options.method.is_for_closed_loops() {
        return Err(Error::Unsupported {
            what: "the bootstrap with a method for closed loops",
            instead: "it keeps the inputs as they are, which feedback does not allow; take uncertainty.method = \"delta\"",
        });
    }
    Ok(())
}

/// The uncertainty that the options ask for. `innovation` is in scaled units, `model` in those of the record, without the
/// states of delays.
pub(super) fn find(
    data: &SubspaceData<'_>,
    options: &SubspaceOptions,
    base: impl FnOnce() -> Result<Base>,
    innovation: &Innovation,
    model: &StateSpace<Discrete>,
) -> Option<Uncertainty> {
    let method = options.uncertainty.method;
    let found = match (method, innovation) {
        (UncertaintyMethod::None, _) => return None,
        (_, Innovation::None { reason: NoInnovation::NoiseFree }) => Err(NoUncertainty::NoiseFree),
        (UncertaintyMethod::Delta, _) => base()
            .and_then(|base| delta(data, options, &base, model))
            .map(Uncertainty::Delta)
            .map_err(|error| NoUncertainty::Failed(error.to_string())),
        (UncertaintyMethod::Bootstrap, Innovation::None { reason: NoInnovation::NotSolvable(reason) }) => {
            Err(NoUncertainty::NoGain(reason.clone()))
        }
        (UncertaintyMethod::Bootstrap, Innovation::None { reason: NoInnovation::Refined }) => {
            Err(NoUncertainty::OtherFit)
        }
        (UncertaintyMethod::Bootstrap, Innovation::Found { gain, .. }) => base()
            .map_err(|error| NoUncertainty::Failed(error.to_string()))
            .and_then(|base| bootstrap::run(data, options, &base, gain, model))
            .map(Uncertainty::Bootstrap),
    };
    Some(found.unwrap_or_else(|reason| Uncertainty::Refused { reason }))
}

/// The influence of each block on the model.
fn delta(
    data: &SubspaceData<'_>,
    options: &SubspaceOptions,
    base: &Base,
    model: &StateSpace<Discrete>,
) -> Result<Delta> {
    let samples: Vec<usize> = data.channels.views().iter().map(View::samples).collect();
    let held = (data.factored.horizon.past(), data.factored.horizon.future());
    let blocks = blocks::cut(&samples, held.0, held.1, options.uncertainty.blocks)?;
    let pairs = influence::pair_changes(&data.channels, &data.triangle, &blocks, base, options, data.time)?;
    let inputs = inputs::input_changes(&data.channels, &blocks, &pairs, base)?;
    let delays = &data.channels.delays;
    let zeros = |rows, columns| Mat::<f64>::zeros(rows, columns);
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let unmoved = StateSpace::new(zeros(n, n), zeros(n, m), zeros(p, n), zeros(p, m), model.time())?;
    let unmoved = delays.put_before(unmoved)?;
    let influences = blocks.iter().zip(&pairs).enumerate().map(|(j, (block, change))| {
        let (driven, d) = base.unknowns.unpack(inputs.as_ref().subcols(j, 1));
        let k = base.predictor.k.as_ref();
        // A = (A - K C) + K C and B = (B - K D) + K D.
        let (a, b) = match k {
            Some(k) => (&change.a + &change.k * &base.pair.c + k * &change.c, driven + &change.k * &base.d + k * &d),
            None => (change.a.clone(), driven),
        };
        let (b, c, d) = data.channels.unscale(&b, &change.c, &d);
        // The delays' own entries are constant.
        let moved = delays.put_before(StateSpace::new(a, b, c, d, model.time())?)?;
        Ok(BlockInfluence::between(block.experiment, &unmoved, &moved))
    });
    let blocks = influences.collect::<Result<_>>()?;
    Ok(Delta { model: delays.put_before(model.clone())?, blocks, level: options.uncertainty.level })
}
