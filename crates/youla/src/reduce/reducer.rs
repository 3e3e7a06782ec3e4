//! A system prepared for reduction to any order: split, scaled and decomposed once.

use super::balanced::{HankelDecomposition, residualise};
use super::options::Scales;
use super::split::{Split, split};
use super::weighted::{FrequencyWeights, decompose};
use super::{ReducedOrder, Reduction, ReductionMethod, ReductionOptions};
use crate::control::normalised_right_factors;
use crate::error::OrderLimit;
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Mat, Result, c64};
use std::ops::RangeInclusive;

const NEEDS_LOOP: &str = "it needs the loop of the model with its controller; use reduce_in_loop";

pub(super) struct Reducer<T: TimeDomain> {
    method: ReductionMethod,
    pub(super) scales: Scales,
    /// What is kept as it is, without feedthrough.
    kept: StateSpace<T>,
    kept_poles: Vec<c64>,
    /// What is approximated.
    part: StateSpace<T>,
    /// Of the part, of its normalised factors, or of the part with weights.
    decomposition: HankelDecomposition<T>,
    /// States of the decomposed system that are not negligible.
    minimal: usize,
}

/// The part at one order.
pub(super) struct Approximation<T: TimeDomain> {
    pub(super) part: StateSpace<T>,
    /// Reduced factors, where the method is one of factors.
    factors: Option<StateSpace<T>>,
    unstable_pole: Option<c64>,
}

impl<T: TimeDomain> Reducer<T> {
    pub(super) fn new(
        system: &StateSpace<T>,
        weights: Option<&FrequencyWeights<T>>,
        options: &ReductionOptions,
    ) -> Result<Self> {
        options.check(system)?;
        let scales = Scales::new(options, system)?;
        let scaled = scales.apply(system).balanced()?;
        let weights = weights
            .map(|w| {
                let (output, input) = (scales.at_outputs(&w.output), scales.at_inputs(&w.input));
                Ok::<_, Error>(FrequencyWeights { output: output.balanced()?, input: input.balanced()? })
            })
            .transpose()?;
        Self::in_coordinates(scaled, weights.as_ref(), options, scales)
    }

    /// The same in the state coordinates in which the system is given: the bases of the reduced model are orthonormal in
    /// them, and a state that is badly scaled would cost digits.
    pub(super) fn in_coordinates(
        scaled: StateSpace<T>,
        weights: Option<&FrequencyWeights<T>>,
        options: &ReductionOptions,
        scales: Scales,
    ) -> Result<Self> {
        let time = scaled.time();
        let nothing = StateSpace::gain(Mat::zeros(scaled.outputs(), scaled.inputs()), time)?;
        let (kept, part) = match options.stability_boundary {
            Some(boundary) => {
                let Split { beyond, within, .. } = split(&scaled, boundary)?;
                (beyond, within)
            }
            None => (nothing, scaled),
        };
        let decomposition = match (options.method, weights) {
            (ReductionMethod::NormalisedCoprime, _) => {
                HankelDecomposition::new(normalised_right_factors(&part)?.balanced()?)?
            }
            (ReductionMethod::Weighted, None) => {
                return Err(Error::Unsupported { what: "method = \"weighted\"", instead: NEEDS_LOOP });
            }
            (ReductionMethod::Weighted, Some(weights)) => {
                part.require_stable(UNSTABLE)?;
                decompose(part.clone(), weights)?
            }
            (ReductionMethod::BalancedTruncation | ReductionMethod::SingularPerturbation, _) => {
                part.require_stable(UNSTABLE)?;
                HankelDecomposition::new(part.clone())?
            }
        };
        let minimal = minimal_order(&decomposition.hankel, options.minimality);
        let kept_poles = kept.poles()?;
        Ok(Reducer { method: options.method, scales, kept, kept_poles, part, decomposition, minimal })
    }

    /// The orders that are possible.
    pub(super) fn orders(&self) -> RangeInclusive<usize> {
        self.kept.order()..=self.minimal_order()
    }

    pub(super) fn minimal_order(&self) -> usize {
        self.kept.order() + self.minimal
    }

    pub(super) fn method(&self) -> ReductionMethod {
        self.method
    }

    pub(super) fn hankel(&self) -> &[f64] {
        &self.decomposition.hankel
    }

    pub(super) fn kept_poles(&self) -> &[c64] {
        &self.kept_poles
    }

    /// The order of a choice that needs no loop.
    pub(super) fn choose(&self, choice: ReducedOrder) -> Result<usize> {
        let (kept, minimal) = (self.kept.order(), self.minimal_order());
        match choice {
            ReducedOrder::Minimal => Ok(minimal),
            ReducedOrder::Fixed(order) if order > minimal => {
                Err(Error::Order { order, limit: OrderLimit::Minimal(minimal) })
            }
            ReducedOrder::Fixed(order) if order < kept => Err(Error::Order { order, limit: OrderLimit::Kept(kept) }),
            ReducedOrder::Fixed(order) => Ok(order),
            ReducedOrder::Bound(bound) => {
                Ok((kept..minimal).find(|order| self.tail(*order) <= bound).unwrap_or(minimal))
            }
            ReducedOrder::ClosedLoop(_) => {
                Err(Error::Unsupported { what: "order = { closed-loop = ... }", instead: NEEDS_LOOP })
            }
        }
    }

    /// Twice the sum of the Hankel singular values that an order leaves out.
    fn tail(&self, order: usize) -> f64 {
        2.0 * self.decomposition.hankel[order - self.kept.order()..].iter().sum::<f64>()
    }

    /// A-priori bound at an order; weights have none.
    pub(super) fn bound(&self, order: usize) -> Option<f64> {
        (self.method != ReductionMethod::Weighted).then(|| self.tail(order) + 0.0)
    }

    /// Reduces the part to an order that is possible.
    pub(super) fn approximate(&self, order: usize) -> Result<Approximation<T>> {
        let states = order - self.kept.order();
        let (reduced, factors) = match self.method {
            ReductionMethod::BalancedTruncation | ReductionMethod::Weighted => {
                (self.decomposition.project(&[states])?, None)
            }
            ReductionMethod::SingularPerturbation => {
                (residualise(&self.decomposition.project(&[states, self.minimal - states])?, states)?, None)
            }
            ReductionMethod::NormalisedCoprime => {
                let factors = self.decomposition.project(&[states])?;
                (factors.divide_by_first_outputs(self.part.inputs())?, Some(factors))
            }
        };
        let unstable = |pole: &c64| reduced.time().instability(*pole) >= 0.0;
        let unstable_pole = match self.method {
            ReductionMethod::Weighted => reduced.worst_pole()?.filter(unstable),
            _ => None,
        };
        if self.method != ReductionMethod::Weighted {
            let must_be_stable = factors.as_ref().unwrap_or(&reduced);
            must_be_stable.require_stable("the reduced model (the order may split equal Hankel singular values)")?;
        }
        Ok(Approximation { part: reduced, factors, unstable_pole })
    }

    /// The part less its approximation, scaled.
    pub(super) fn error(&self, approximation: &Approximation<T>) -> Result<StateSpace<T>> {
        self.part.plus(&approximation.part.negated())
    }

    /// What is kept and the approximation together, in the units of the given system.
    pub(super) fn model(&self, approximation: &Approximation<T>) -> Result<StateSpace<T>> {
        let joined =
            if self.kept.order() == 0 { approximation.part.clone() } else { self.kept.plus(&approximation.part)? };
        Ok(self.scales.undo(&joined))
    }

    pub(super) fn reduction(&self, order: usize) -> Result<Reduction<T>> {
        let approximation = self.approximate(order)?;
        let factor_error =
            approximation.factors.as_ref().map(|f| self.decomposition.system.plus(&f.negated())).transpose()?;
        Ok(Reduction {
            model: self.model(&approximation)?,
            hankel: self.decomposition.hankel.clone(),
            error_bound: self.bound(order),
            minimal_order: self.minimal_order(),
            kept: self.kept_poles.clone(),
            unstable_pole: approximation.unstable_pole,
            method: self.method,
            error: self.error(&approximation)?,
            factor_error,
        })
    }
}

/// What a method that needs a stable system says of one that is not.
const UNSTABLE: &str = "the system to be reduced (stability_boundary keeps unstable poles as they are, and method = \
                        \"normalised-coprime\" reduces unstable models)";

fn minimal_order(hankel: &[f64], fraction: f64) -> usize {
    let largest = hankel.first().copied().unwrap_or(0.0);
    hankel.iter().take_while(|s| **s > fraction * largest).count()
}
