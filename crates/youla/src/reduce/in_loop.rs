//! Reduction of G(S) in the loop with its controller: weights, closed-loop error, and the check that K stabilises the result.
//!
//! ```text
//! weights                  W_o = Mt + S Ut,   W_i = M + U S         stable and of order n + n_S
//! closed loop              alpha -> y:  N + V S                      affine in S
//! of a reduced model       the same with S_r = F_u(J_K, G_r), stable exactly when K stabilises G_r
//! ```

use super::reducer::Reducer;
use super::sweep::{ReductionSweep, SweepRow, sweep_of};
use super::{FrequencyWeights, ReducedOrder, Reduction, ReductionMethod, ReductionOptions};
use crate::control::{closed_loop, with_input_port};
use crate::factor::CoprimeFactors;
use crate::lti::{Partitioned, StateSpace, TimeDomain};
use crate::{Error, Result, c64};

/// A plant G(S) in the loop with the controller of its factors.
#[derive(Debug, Clone)]
pub struct ReductionLoop<T: TimeDomain> {
    plant: StateSpace<T>,
    weights: FrequencyWeights<T>,
    /// From alpha to y.
    response: StateSpace<T>,
    /// `J_K`.
    ports: Partitioned<T>,
    /// K with a port at the input of the plant.
    controller: Partitioned<T>,
}

/// Whether the controller stabilises a model.
pub(super) struct LoopCheck {
    pub(super) stabilised: bool,
    pub(super) worst_pole: Option<c64>,
}

impl<T: TimeDomain> ReductionLoop<T> {
    /// The loop of the factors with the deviation system S (m inputs, p outputs).
    ///
    /// # Errors
    /// Ports, sample times, [`Error::AlgebraicLoop`].
    pub fn new(factors: &CoprimeFactors<T>, deviation: &StateSpace<T>) -> Result<Self> {
        let (m, p) = (factors.inputs(), factors.outputs());
        let right = factors.right_factors_of(deviation)?;
        Ok(ReductionLoop {
            plant: factors.plant_of(deviation)?,
            weights: FrequencyWeights {
                output: factors.residual_filter(deviation)?.part(0..p, m..m + p),
                input: right.part(0..m, 0..m),
            },
            response: right.part(m..m + p, 0..m),
            ports: factors.j_k()?,
            controller: with_input_port(&factors.controller()?)?,
        })
    }

    /// The loop of the factors with a plant itself.
    ///
    /// ```text
    /// T = loop of the plant with J_K:    W_o = T from n to beta,   W_i = T from alpha to u,   N + V S = T from alpha to y
    /// ```
    ///
    /// # Errors
    /// Ports, sample times, [`Error::AlgebraicLoop`].
    pub fn of_plant(factors: &CoprimeFactors<T>, plant: &StateSpace<T>) -> Result<Self> {
        let (m, p) = (factors.inputs(), factors.outputs());
        let ports = factors.j_k()?;
        let whole = closed_loop(plant, &ports)?;
        Ok(ReductionLoop {
            plant: plant.clone(),
            weights: FrequencyWeights { output: whole.part(m + p..m + 2 * p, m..m + p), input: whole.part(0..m, 0..m) },
            response: whole.part(m..m + p, 0..m),
            ports,
            controller: with_input_port(&factors.controller()?)?,
        })
    }

    /// G(S).
    pub fn plant(&self) -> &StateSpace<T> {
        &self.plant
    }

    /// The closed loop from alpha to y, `N + V S`.
    pub fn response(&self) -> &StateSpace<T> {
        &self.response
    }

    /// The closed loop from alpha to y with another model in the place of G(S).
    ///
    /// # Errors
    /// Ports, sample times, [`Error::AlgebraicLoop`].
    pub fn response_of(&self, model: &StateSpace<T>) -> Result<StateSpace<T>> {
        let (m, p) = (model.inputs(), model.outputs());
        Ok(closed_loop(model, &self.ports)?.part(m..m + p, 0..m))
    }

    pub(super) fn check(&self, model: &StateSpace<T>) -> Result<LoopCheck> {
        let worst_pole = closed_loop(model, &self.controller)?.worst_pole()?;
        let stabilised = worst_pole.is_none_or(|pole| model.time().instability(pole) < 0.0);
        Ok(LoopCheck { stabilised, worst_pole })
    }

    pub(super) fn reducer(&self, options: &ReductionOptions) -> Result<Reducer<T>> {
        let weights = (options.method == ReductionMethod::Weighted).then_some(&self.weights);
        Reducer::new(&self.plant, weights, options)
    }
}

/// A reduction with the verdict of the loop.
#[derive(Debug, Clone)]
pub struct LoopReduction<T: TimeDomain> {
    /// The reduced model.
    pub reduction: Reduction<T>,
    /// Whether the controller stabilises it.
    pub stabilised: bool,
    /// Its worst closed-loop pole; `None` without states.
    pub worst_pole: Option<c64>,
    /// What every order costs.
    pub sweep: ReductionSweep,
}

impl<T: TimeDomain> LoopReduction<T> {
    /// Order of the reduced model.
    pub fn order(&self) -> usize {
        self.reduction.model.order()
    }

    /// The row of the reduced model in the sweep; `None` for one without states.
    pub fn row(&self) -> Option<&SweepRow> {
        self.sweep.row(self.order())
    }

    /// Where the controller does not stabilise the reduced model: the smallest order above that it does stabilise, or, where
    /// there is none, the smallest of all.
    pub fn proposed_order(&self) -> Option<usize> {
        let above = || self.sweep.stabilised_from(self.order() + 1).or_else(|| self.sweep.smallest_stabilised());
        if self.stabilised { None } else { above() }
    }

    /// The outcome in one or two sentences.
    pub fn sentence(&self) -> String {
        let order = self.order();
        let weights = match self.reduction.unstable_pole {
            Some(pole) => {
                format!(" The weights made the reduced part unstable, with the pole {}.", crate::error::Pole(pole))
            }
            None => String::new(),
        };
        if self.stabilised {
            let error = self.row().and_then(|row| row.closed_loop);
            let error = error.map_or(String::new(), |e| {
                format!("; the closed loop from alpha to y is {:.2} % off at its worst frequency", 100.0 * e)
            });
            return format!("The controller stabilises the reduced model of order {order}{error}.{weights}");
        }
        let pole = self.worst_pole.map_or(String::new(), |p| format!(" (closed-loop pole {})", crate::error::Pole(p)));
        let proposal = match self.proposed_order() {
            Some(better) if better > order => {
                format!("The smallest larger order that it stabilises is {better}.")
            }
            Some(other) => format!("It stabilises no larger order; the smallest that it stabilises is {other}."),
            None => "It stabilises no order.".into(),
        };
        format!("The controller does not stabilise the reduced model of order {order}{pole}. {proposal}{weights}")
    }
}

/// Reduces G(S), measures all orders in open and closed loop, and checks that the controller stabilises the result.
///
/// The order is the one that was asked for even where the controller does not stabilise it: then the result says so and
/// proposes one, see [`LoopReduction::proposed_order`].
///
/// # Errors
/// As [`super::reduce`]; [`Error::NoReducedOrder`] where no order has the closed-loop error that was asked for.
pub fn reduce_in_loop<T: TimeDomain>(model: &ReductionLoop<T>, options: &ReductionOptions) -> Result<LoopReduction<T>> {
    let reducer = model.reducer(options)?;
    // An order that is not possible is refused before the work.
    let known = match options.order {
        ReducedOrder::ClosedLoop(_) => None,
        other => Some(reducer.choose(other)?),
    };
    let sweep = sweep_of(model, &reducer)?;
    let order = match (known, options.order) {
        (Some(order), _) => order,
        (None, ReducedOrder::ClosedLoop(limit)) => sweep
            .smallest_within(limit)
            .ok_or_else(|| Error::NoReducedOrder { limit, lowest: sweep.lowest_closed_loop_error() })?,
        (None, other) => reducer.choose(other)?,
    };
    let reduction = reducer.reduction(order)?;
    let LoopCheck { stabilised, worst_pole } = model.check(&reduction.model)?;
    Ok(LoopReduction { reduction, stabilised, worst_pole, sweep })
}
