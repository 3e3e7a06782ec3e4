//! The modified Hansen scheme: an open-loop identification of the Youla deviation system S, eq. (25).
//!
//! ```text
//! beta = S alpha + (Mt + S Ut) n,        alpha independent of the noise n
//! ```
//!
//! Because alpha does not depend on n, any open-loop method is unbiased here, with any noise model, even for an unstable
//! plant. Source: the paper, eqs (20)-(25); Hansen, Franklin and Kosut 1989.

use super::innovation_form::{self, DeviationOptions, InnovationForm, Structure};
use super::subspace::subspace_stream;
use super::subspace::{Evidence, Experiment, NoUncertainty, SubspaceData, SubspaceModel, SubspaceOptions, Uncertainty};
use crate::factor::{CoprimeFactors, YoulaSignals, YoulaStream};
use crate::lti::{Discrete, StateSpace};
use crate::signal::SampleStream;
use crate::{MatRef, Result};

/// The identified deviation system and the plant that it stands for.
#[derive(Debug, Clone)]
pub struct HansenModel {
    /// S, from alpha to beta, with all evidence of its identification.
    pub deviation: SubspaceModel,
    /// `G(S) = F_u(J_G, S)`, of order n + n_S.
    pub plant: StateSpace<Discrete>,
    /// The innovation form of S where it was asked for.
    pub innovation_form: Option<InnovationForm>,
    /// That of G(S), where it was asked for; that of S is with `deviation`.
    pub uncertainty: Option<Uncertainty>,
    /// Whether the data contradict the nominal model, where an uncertainty was asked for.
    pub evidence: Option<Result<Evidence, NoUncertainty>>,
}

/// Identifies S from the signals of one or more experiments and recombines it to the plant G(S).
///
/// The controller stabilises G(S) exactly when S is stable.
///
/// The uncertainty of S carries over to the plant by the linear part of
/// ```text
/// G(S + dS) - G(S) = (Mt + (S + dS) Ut)^-1 dS (M + U S)^-1
/// ```
///
/// # Errors
/// As [`super::subspace::subspace`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed.
pub fn hansen(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    hansen_disturbed(factors, signals, &[], options)
}

/// The same where the outputs carry disturbances of known shape, one matrix of known signals (samples x signals) for each
/// experiment, or none at all. A disturbance d of y is one of beta, `(Mt + S Ut) d`: for lines of constant frequency, or of a
/// speed that changes slowly against the loop, of the same shape and another size.
///
/// # Errors
/// As [`hansen`]; shapes of the known signals.
pub fn hansen_disturbed(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    disturbances: &[MatRef<'_, f64>],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    let data = deviation_data(factors, signals, disturbances, options)?;
    hansen_structured(factors, &data, options, &DeviationOptions::default())
}

/// The signals of one or more experiments, factored for the method of `options`: for models of several orders, or what else
/// [`SubspaceData`] serves.
///
/// # Errors
/// As [`SubspaceData::disturbed`].
pub fn deviation_data<'a>(
    factors: &CoprimeFactors<Discrete>,
    signals: &'a [YoulaSignals],
    disturbances: &[MatRef<'a, f64>],
    options: &SubspaceOptions,
) -> Result<SubspaceData<'a>> {
    let experiments: Vec<_> = signals.iter().map(|s| Experiment { u: s.alpha.as_ref(), y: s.beta.as_ref() }).collect();
    SubspaceData::disturbed(&experiments, disturbances, factors.nominal().time(), options)
}

/// Identifies S with the structure asked for from [`deviation_data`], and recombines it to G(S).
///
/// # Errors
/// As [`hansen_disturbed`]; for the innovation form [`crate::Error::Unstable`] where `A - K_s C` is not stable, as for
/// an unstable plant, and [`crate::Error::OutOfRange`] for delays, no refits or a tolerance below zero.
pub fn hansen_structured(
    factors: &CoprimeFactors<Discrete>,
    data: &SubspaceData<'_>,
    options: &SubspaceOptions,
    deviation: &DeviationOptions,
) -> Result<HansenModel> {
    let (deviation, innovation_form) = match deviation.structure {
        Structure::Free => (data.identify(options)?, None),
        Structure::Innovation => {
            innovation_form::check(options, deviation)?;
            let (model, form) = innovation_form::refit(factors, data, options, deviation)?;
            (model, Some(form))
        }
    };
    let plant = factors.plant_of(&deviation.model)?;
    let uncertainty = deviation.uncertainty.as_ref().map(|u| u.through(|s| factors.plant_of(s))).transpose()?;
    let order = deviation.order.order;
    let evidence = uncertainty.is_some().then(|| data.evidence(order, options));
    Ok(HansenModel { deviation, plant, innovation_form, uncertainty, evidence })
}

/// The same as [`hansen`] from a stream of u and y that need not fit into memory; the first `settle` samples of each experiment
/// are dropped behind the filter, for example [`CoprimeFactors::settling_samples`].
///
/// # Errors
/// As [`subspace_stream`] and [`YoulaStream`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed.
pub fn hansen_stream(
    factors: &CoprimeFactors<Discrete>,
    measured: impl SampleStream,
    settle: usize,
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    let mut signals = YoulaStream::new(factors, measured, settle)?;
    let deviation = subspace_stream(&mut signals, factors.nominal().time(), options)?;
    let plant = factors.plant_of(&deviation.model)?;
    Ok(HansenModel { deviation, plant, innovation_form: None, uncertainty: None, evidence: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::subspace::{ExperimentStream, Order};
    use crate::lti::simulate;
    use crate::{Error, Mat};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn first_order(pole: f64) -> StateSpace<Discrete> {
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        StateSpace::new(number(pole), number(1.0), number(1.0), number(0.0), Discrete::new(0.1).unwrap()).unwrap()
    }

    #[test]
    fn a_stream_of_u_and_y_gives_the_same_deviation_system() {
        let gain = Mat::from_fn(1, 1, |_, _| -0.5);
        let factors = CoprimeFactors::observer(&first_order(0.9), gain.as_ref(), gain.as_ref()).unwrap();
        let rng = &mut ChaCha8Rng::seed_from_u64(31);
        let records = [6000, 900].map(|samples| {
            let [u, noise] = [1.0, 0.1].map(|size| Mat::from_fn(samples, 1, |_, _| size * (rng.random::<f64>() - 0.5)));
            let y = simulate(&first_order(0.8), u.as_ref(), &[0.0]).unwrap() + noise;
            (u, y)
        });
        let experiments = [0, 1].map(|k| Experiment { u: records[k].0.as_ref(), y: records[k].1.as_ref() });
        let options = SubspaceOptions { horizon: 5, order: Order::Fixed(2), ..Default::default() };
        let settle = factors.settling_samples(1e-3).unwrap();
        assert!(settle > 5);
        let signals = [0, 1].map(|k| {
            let all = factors.signals(experiments[k].u, experiments[k].y).unwrap();
            let settled = |m: &Mat<f64>| m.as_ref().subrows(settle, m.nrows() - settle).to_owned();
            YoulaSignals { alpha: settled(&all.alpha), beta: settled(&all.beta) }
        });
        let whole = hansen(&factors, &signals, &options).unwrap();
        let stream = || ExperimentStream::new(&experiments).unwrap();
        let streamed = hansen_stream(&factors, stream(), settle, &options).unwrap();
        let gap = |a: &StateSpace<Discrete>, b: &StateSpace<Discrete>| {
            let parts = [(a.a(), b.a()), (a.b(), b.b()), (a.c(), b.c()), (a.d(), b.d())];
            parts.map(|(a, b)| (a - b).norm_max()).into_iter().fold(0.0, f64::max)
        };
        assert!(gap(&whole.plant, &streamed.plant) < 1e-10);
        assert!(gap(&whole.deviation.model, &streamed.deviation.model) < 1e-10);
        let short = hansen_stream(&factors, stream(), 900, &options);
        assert!(matches!(short, Err(Error::TooFewSamples { found: 900, needed: 901, .. })));
    }
}
