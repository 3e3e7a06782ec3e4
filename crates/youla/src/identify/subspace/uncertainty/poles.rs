//! Deviations of the poles of all orders, for the stabilisation diagram: the change of each pole with the weight of each block
//! of time, from one raised factor per block for all orders.

use super::super::SubspaceData;
use super::super::factorisation::BlockWeights;
use super::super::projected::Projected;
use super::super::view::View;
use super::delta::covariance;
use super::influence::STEP;
use super::response::mode_change;
use super::{SubspaceOptions, blocks};
use crate::{Result, c64};
use rayon::prelude::*;

/// Standard deviations of natural frequency (Hz) and damping ratio of `poles[k]`, the poles of the model of order `orders[k]`.
pub(in super::super) fn pole_deviations(
    data: &SubspaceData<'_>,
    method: &SubspaceOptions,
    orders: &[usize],
    poles: &[Vec<c64>],
) -> Result<Vec<Vec<[f64; 2]>>> {
    let samples: Vec<usize> = data.channels.views().iter().map(View::samples).collect();
    let held = (data.factored.horizon.past(), data.factored.horizon.future());
    let blocks = blocks::cut(&samples, held.0, held.1, method.uncertainty.blocks)?;
    let experiments = data.channels.beyond_disturbances()?;
    let weights = BlockWeights::new(&data.triangle);
    let changes: Vec<Result<Vec<[f64; 2]>>> = blocks
        .par_iter()
        .map(|block| {
            let heavier = weights.raised(&experiments, block.experiment, block.columns.clone(), STEP)?;
            let projected = Projected::new(&heavier, method)?;
            let mut changes = Vec::new();
            for (order, poles) in orders.iter().zip(poles) {
                let moved = eigenvalues(&projected, *order)?;
                changes.extend(poles.iter().map(|pole| mode_change(*pole, change(*pole, &moved), data.time)));
            }
            Ok(changes)
        })
        .collect();
    let changes = changes.into_iter().collect::<Result<Vec<_>>>()?;
    let owners: Vec<usize> = blocks.iter().map(|block| block.experiment).collect();
    let deviations = |place: usize| {
        let of_pole: Vec<Vec<f64>> = changes.iter().map(|block| block[place].to_vec()).collect();
        let v = covariance(&of_pole, &owners);
        [0, 1].map(|k| v[(k, k)].max(0.0).sqrt())
    };
    let mut places = 0..;
    Ok(poles.iter().map(|poles| places.by_ref().take(poles.len()).map(deviations).collect()).collect())
}

fn eigenvalues(projected: &Projected, order: usize) -> Result<Vec<c64>> {
    crate::linalg::eigenvalues(&format!("the poles of order {order}"), projected.realise(order)?.a.as_ref())
}

/// To the pole of the moved model that is nearest, over the step.
fn change(pole: c64, moved: &[c64]) -> c64 {
    let nearest = moved.iter().min_by(|a, b| (*a - pole).norm().total_cmp(&(*b - pole).norm()));
    nearest.map_or(c64::new(0.0, 0.0), |nearest| (nearest - pole) * (1.0 / STEP))
}
