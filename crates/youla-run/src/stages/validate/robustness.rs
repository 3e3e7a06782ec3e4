//! What the loop of each model with the controller that ran tolerates, and how far the models are from each other in the
//! nu-gap.
//!
//! Margins are in the units of the record; they do not depend on them. The normalised coprime margin and the nu-gap do: both are
//! taken in channels that are divided by their root mean square over the estimation records, about the mean of each record.

use crate::Result;
use crate::records::RunRecords;
use crate::stages::factors::DeclaredLoop;
use youla::MatRef;
use youla::control::{ChannelScales, Margins, NuGap, coprime_margin, margins, nu_gap};
use youla::lti::{Discrete, StateSpace};
use youla::signal::LoopRecord;

/// The robustness of one model. A reason is where a figure cannot be had.
#[derive(Debug, Clone)]
pub struct LoopRobustness {
    /// Margins with the controller that ran.
    pub margins: Result<Margins, String>,
    /// b(G, K) in scaled channels; 0 where the loop is unstable.
    pub coprime: Result<f64, String>,
    /// The nu-gap to the nominal model, in scaled channels.
    pub gap_to_nominal: Result<NuGap, String>,
    /// The nu-gap to the recommended model, in scaled channels.
    pub gap_to_recommended: Result<NuGap, String>,
}

/// The sizes by which channels are scaled, or why there are none (a channel that never moves).
///
/// # Errors
/// [`youla::Error::OutOfRange`] for a channel that is constant in all estimation records.
pub(crate) fn channel_scales(records: &RunRecords) -> Result<ChannelScales> {
    if records.measured.is_some() {
        let (u, y) = records.sizes();
        return Ok(ChannelScales::new(u, y)?);
    }
    let records = &records.estimation;
    Ok(ChannelScales::new(rms(records, LoopRecord::u), rms(records, LoopRecord::y))?)
}

/// Root mean square of each channel about the mean of its record.
fn rms(records: &[LoopRecord], signal: impl Fn(&LoopRecord) -> MatRef<'_, f64>) -> Vec<f64> {
    let channels = records.first().map_or(0, |r| signal(r).ncols());
    let mut energy = vec![0.0; channels];
    let mut samples = 0;
    for record in records {
        let values = signal(record);
        samples += values.nrows();
        for (j, energy) in energy.iter_mut().enumerate() {
            let mean = values.col(j).iter().sum::<f64>() / values.nrows() as f64;
            *energy += values.col(j).iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        }
    }
    energy.into_iter().map(|e| (e / samples as f64).sqrt()).collect()
}

/// The robustness of one model of a run; `recommended` is the recommended one.
pub(crate) fn robustness(
    declared: &DeclaredLoop,
    scales: &Result<ChannelScales, String>,
    recommended: Option<&StateSpace<Discrete>>,
    model: &StateSpace<Discrete>,
) -> LoopRobustness {
    let controller = declared.controller();
    let scaled = |plant: &StateSpace<Discrete>| -> Result<StateSpace<Discrete>, String> {
        scales.as_ref().map_err(Clone::clone)?.plant(plant).map_err(|e| e.to_string())
    };
    let gap_to = |other: &StateSpace<Discrete>| -> Result<NuGap, String> {
        nu_gap(&scaled(other)?, &scaled(model)?).map_err(|e| e.to_string())
    };
    let coprime = || -> Result<f64, String> {
        let controller = scales.as_ref().map_err(Clone::clone)?.controller(controller).map_err(|e| e.to_string())?;
        coprime_margin(&scaled(model)?, &controller).map_err(|e| e.to_string())
    };
    LoopRobustness {
        margins: margins(model, controller).map_err(|e| match e {
            youla::Error::NotStabilising { pole, .. } => {
                format!("the loop is unstable, with the pole {}", youla::error::Pole(pole))
            }
            other => other.to_string(),
        }),
        coprime: coprime(),
        gap_to_nominal: declared.nominal.as_ref().map_or_else(|| Err("no nominal model is given".to_owned()), gap_to),
        gap_to_recommended: recommended.map_or_else(|| Err("no model is recommended".to_owned()), gap_to),
    }
}
