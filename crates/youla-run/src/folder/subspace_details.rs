//! `details` of a model from the subspace method.

use crate::summary::entries::pair;
use serde::Serialize;
use youla::identify::subspace::{DataFactor, LineAmplitude, OrderReport, SubspaceModel, amplitudes};

/// Horizons, order, excitation, moved poles, disturbances.
#[derive(Serialize)]
pub(crate) struct SubspaceDetails<'a> {
    order: usize,
    horizon: usize,
    past: usize,
    order_choice: &'a OrderReport,
    columns: usize,
    singular_values: &'a [f64],
    excitation_rcond: f64,
    factor: &'a DataFactor,
    stable: bool,
    moved_poles: Vec<[[f64; 2]; 2]>,
    initial_states: &'a [Vec<f64>],
    delays: &'a [usize],
    disturbances: Vec<Vec<Vec<LineAmplitude>>>,
}

impl<'a> From<&'a SubspaceModel> for SubspaceDetails<'a> {
    fn from(s: &'a SubspaceModel) -> Self {
        SubspaceDetails {
            order: s.order.order,
            horizon: s.horizon,
            past: s.past,
            order_choice: &s.order,
            columns: s.columns,
            singular_values: &s.singular_values,
            excitation_rcond: s.excitation_rcond,
            factor: &s.factor,
            stable: s.stability.stable,
            moved_poles: s.stability.moved.iter().map(|m| [pair(m.from), pair(m.to)]).collect(),
            initial_states: &s.initial_states,
            delays: &s.delays,
            disturbances: s.disturbances.iter().map(|a| amplitudes(a.as_ref())).collect(),
        }
    }
}
