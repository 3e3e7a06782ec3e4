//! `details` of a model from the subspace method.

use crate::summary::entries::pair;
use serde::Serialize;
use youla::identify::hansen::HansenModel;
use youla::identify::innovation_form::{Convergence, InnovationForm};
use youla::identify::subspace::{DataFactor, HorizonReport, LineAmplitude, OrderReport, SubspaceModel, amplitudes};

/// Horizons, order, excitation, moved poles, disturbances.
#[derive(Serialize)]
pub(crate) struct SubspaceDetails<'a> {
    order: usize,
    horizon: usize,
    past: usize,
    automatic_horizon: Option<&'a HorizonReport>,
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
            automatic_horizon: s.automatic_horizon.as_ref(),
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

/// The same of S, with its innovation form.
#[derive(Serialize)]
pub(crate) struct DeviationDetails<'a> {
    #[serde(flatten)]
    subspace: SubspaceDetails<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    innovation_form: Option<InnovationFormEntry>,
}

impl<'a> DeviationDetails<'a> {
    /// Of S.
    pub(crate) fn new(hansen: &'a HansenModel) -> Self {
        let innovation_form = hansen.innovation_form.as_ref().map(InnovationFormEntry::from);
        DeviationDetails { subspace: SubspaceDetails::from(&hansen.deviation), innovation_form }
    }
}

#[derive(Serialize)]
struct InnovationFormEntry {
    gain: Vec<Vec<f64>>,
    iterations: usize,
    stop: Convergence,
    change: f64,
    misfit: f64,
    from_kalman: Option<f64>,
}

impl From<&InnovationForm> for InnovationFormEntry {
    fn from(form: &InnovationForm) -> Self {
        InnovationFormEntry {
            gain: form.gain.row_iter().map(|row| row.iter().copied().collect()).collect(),
            iterations: form.iterations,
            stop: form.stop,
            change: form.change,
            misfit: form.misfit,
            from_kalman: form.from_kalman,
        }
    }
}
