//! What every order of a reduction costs, in open and in closed loop.

use super::reducer::Reducer;
use super::{ReductionLoop, ReductionMethod, ReductionOptions};
use crate::lti::{PeakOptions, StateSpace, TimeDomain, linf_norm};
use crate::{Error, Result, c64};
use rayon::prelude::*;

/// Relative accuracy of the measured errors.
const TOLERANCE: f64 = 1e-5;

/// One order.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRow {
    /// States of the reduced model.
    pub order: usize,
    /// A-priori bound, see [`super::Reduction::error_bound`].
    pub error_bound: Option<f64>,
    /// Largest singular value of `G - G_r` over frequency, in the scaled units; `None` where it is infinite.
    pub open_loop: Option<f64>,
    /// The same over that of G; `None` where one of them is infinite.
    pub open_loop_relative: Option<f64>,
    /// Largest singular value over frequency of the error of the closed loop from alpha to y, over that of the closed loop itself;
    /// `None` where the controller does not stabilise the reduced model.
    pub closed_loop: Option<f64>,
    /// Whether the controller stabilises the reduced model.
    pub stabilised: bool,
    /// Its worst closed-loop pole; `None` without states.
    pub worst_pole: Option<c64>,
    /// Why there is no model of this order.
    pub failure: Option<String>,
}

/// All orders of a reduction.
#[derive(Debug, Clone, PartialEq)]
pub struct ReductionSweep {
    /// The method.
    pub method: ReductionMethod,
    /// One row per order, from the states that are kept apart (at least 1) to the minimal order.
    pub rows: Vec<SweepRow>,
    /// Hankel singular values, see [`super::Reduction::hankel`].
    pub hankel: Vec<f64>,
    /// Poles that are kept as they are.
    pub kept: Vec<c64>,
    /// Order of the minimal model.
    pub minimal_order: usize,
    /// Largest singular value of G over frequency, in the scaled units; `None` where it is infinite.
    pub plant_norm: Option<f64>,
    /// That of the closed loop from alpha to y; `None` where the controller does not stabilise G.
    pub response_norm: Option<f64>,
}

impl ReductionSweep {
    /// The row of an order.
    pub fn row(&self, order: usize) -> Option<&SweepRow> {
        self.rows.iter().find(|row| row.order == order)
    }

    /// The smallest order that the controller stabilises.
    pub(crate) fn smallest_stabilised(&self) -> Option<usize> {
        self.stabilised_from(0)
    }

    /// The smallest order that the controller stabilises, from `order` on.
    pub(crate) fn stabilised_from(&self, order: usize) -> Option<usize> {
        self.rows.iter().find(|row| row.order >= order && row.stabilised).map(|row| row.order)
    }

    /// The smallest order that the controller stabilises with a relative closed-loop error of at most `limit`.
    pub(crate) fn smallest_within(&self, limit: f64) -> Option<usize> {
        let within = |row: &&SweepRow| row.stabilised && row.closed_loop.is_some_and(|error| error <= limit);
        self.rows.iter().find(within).map(|row| row.order)
    }

    /// The lowest closed-loop error of all orders that the controller stabilises.
    pub(crate) fn lowest_closed_loop_error(&self) -> Option<f64> {
        self.rows.iter().filter_map(|row| row.closed_loop).min_by(f64::total_cmp)
    }
}

/// Reduces G(S) to every possible order and measures each in open and closed loop. Orders in parallel; the result does not
/// depend on the number of threads.
///
/// An order that fails has its reason in its row and does not end the sweep.
///
/// # Errors
/// Those of [`super::reduce`] that hold for every order.
pub fn sweep<T: TimeDomain>(model: &ReductionLoop<T>, options: &ReductionOptions) -> Result<ReductionSweep> {
    sweep_of(model, &model.reducer(options)?)
}

pub(super) fn sweep_of<T: TimeDomain>(model: &ReductionLoop<T>, reducer: &Reducer<T>) -> Result<ReductionSweep> {
    let plant_norm = finite_norm(&reducer.scales.apply(model.plant()))?;
    let response = reducer.scales.apply(model.response());
    let response_norm = if response.is_stable()? { finite_norm(&response)? } else { None };
    let norms = Norms { plant: plant_norm, response: response_norm };
    let orders: Vec<usize> = reducer.orders().filter(|order| *order > 0).collect();
    let rows = orders.into_par_iter().map(|order| row(model, reducer, order, &response, &norms)).collect();
    Ok(ReductionSweep {
        method: reducer.method(),
        rows,
        hankel: reducer.hankel().to_vec(),
        kept: reducer.kept_poles().to_vec(),
        minimal_order: reducer.minimal_order(),
        plant_norm,
        response_norm,
    })
}

struct Norms {
    plant: Option<f64>,
    response: Option<f64>,
}

fn row<T: TimeDomain>(
    model: &ReductionLoop<T>,
    reducer: &Reducer<T>,
    order: usize,
    response: &StateSpace<T>,
    norms: &Norms,
) -> SweepRow {
    let empty = SweepRow {
        order,
        error_bound: reducer.bound(order),
        open_loop: None,
        open_loop_relative: None,
        closed_loop: None,
        stabilised: false,
        worst_pole: None,
        failure: None,
    };
    measured(model, reducer, empty.clone(), response, norms)
        .unwrap_or_else(|error| SweepRow { failure: Some(error.to_string()), ..empty })
}

fn measured<T: TimeDomain>(
    model: &ReductionLoop<T>,
    reducer: &Reducer<T>,
    mut row: SweepRow,
    response: &StateSpace<T>,
    norms: &Norms,
) -> Result<SweepRow> {
    let approximation = reducer.approximate(row.order)?;
    let reduced = reducer.model(&approximation)?;
    row.open_loop = finite_norm(&reducer.error(&approximation)?)?;
    row.open_loop_relative = ratio(row.open_loop, norms.plant);
    let check = model.check(&reduced)?;
    (row.stabilised, row.worst_pole) = (check.stabilised, check.worst_pole);
    if row.stabilised && norms.response.is_some() {
        let reached = reducer.scales.apply(&model.response_of(&reduced)?);
        row.closed_loop = ratio(finite_norm(&response.plus(&reached.negated())?)?, norms.response);
    }
    Ok(row)
}

fn ratio(error: Option<f64>, size: Option<f64>) -> Option<f64> {
    error.zip(size).map(|(error, size)| if error == 0.0 { 0.0 } else { error / size })
}

/// Largest gain over frequency; `None` where a pole lies on the stability boundary.
fn finite_norm<T: TimeDomain>(system: &StateSpace<T>) -> Result<Option<f64>> {
    match linf_norm(system, &PeakOptions { tolerance: TOLERANCE }) {
        Ok(peak) => Ok(Some(peak.value)),
        Err(Error::PoleOnBoundary { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}
