//! The figures of an excitation.

use super::energy::Energy;
use super::guard::Response;
use super::{ExcitationNotch, ExciteOptions, LoopToExcite, ModeAccuracy, ModelErrorEffect};
use serde::Serialize;
use youla::Mat;
use youla::signal::Channel;

/// The figures of an excitation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExcitedSummary {
    /// The shape and what it became.
    pub shape: String,
    /// How the inputs are made independent.
    pub independence: String,
    /// Seed.
    pub seed: u64,
    /// Number of samples.
    pub samples: usize,
    /// Seconds between two samples.
    pub sample_time: f64,
    /// Length, seconds.
    pub duration: f64,
    /// Lowest and highest frequency, Hz.
    pub band: [f64; 2],
    /// Each input.
    pub inputs: Vec<ExcitedInput>,
    /// How the notches were made; absent without notches.
    pub filter: Option<String>,
    /// Each of these bands.
    pub notches: Vec<NotchEnergy>,
    /// Predicted peaks of the nominal loop: inputs first, then outputs.
    pub predicted: Vec<PredictedPeak>,
    /// The same for perturbed models.
    pub model_error: ModelErrorEffect,
    /// Factor by which the amplitude was reduced to keep the limits; absent without reduction.
    pub scaled_by: Option<f64>,
    /// Standard deviation of the noise of each output from which the accuracies are computed; empty if not given.
    pub noise: Vec<f64>,
    /// Predicted accuracy of the modes of the plant; empty if no noise was given.
    pub modes: Vec<ModeAccuracy>,
    /// Required standard deviation of the damping ratios.
    pub damping_deviation: Option<f64>,
    /// Longest required length over all modes, seconds; absent if not requested or if a mode is not determined.
    pub needed: Option<f64>,
}

/// One input of an excitation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExcitedInput {
    /// The input.
    pub channel: Channel,
    /// Greatest absolute value.
    pub peak: f64,
    /// Root mean square over the whole length.
    pub rms: f64,
    /// Crest factor, peak over root mean square; absent for an input without excitation.
    pub crest: Option<f64>,
    /// Part of the energy within the band.
    pub in_band: f64,
}

/// The remaining energy in a notch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotchEnergy {
    /// Lowest and highest frequency, Hz.
    pub band: [f64; 2],
    /// Part of the energy of each input.
    pub share: Vec<f64>,
    /// Mean energy density of each input over that in the band of the excitation, dB; absent where there is none at all.
    pub decibels: Vec<Option<f64>>,
}

/// The largest magnitude of one signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedPeak {
    /// The input or output.
    pub channel: Channel,
    /// Largest magnitude that the nominal loop predicts.
    pub peak: f64,
    /// Its limit.
    pub limit: Option<f64>,
    /// Largest magnitude over the models that are wrong by [`ModelErrorEffect::theta`].
    pub with_model_error: f64,
}

/// The length that each mode needs, and the longest of them.
pub(super) fn needed(modes: &mut [ModeAccuracy], wanted: Option<f64>, duration: f64) -> Option<f64> {
    let wanted = wanted?;
    for mode in modes.iter_mut() {
        mode.needed = mode.zeta_deviation.map(|now| duration * (now / wanted).powi(2));
    }
    let all = modes.iter().map(|mode| mode.needed).collect::<Option<Vec<f64>>>()?;
    all.into_iter().reduce(f64::max)
}

pub(super) fn inputs(
    on: &LoopToExcite,
    alpha: &Mat<f64>,
    energies: &[Energy],
    options: &ExciteOptions,
) -> Vec<ExcitedInput> {
    let one = |(j, channel): (usize, &Channel)| {
        let column = alpha.col(j);
        let (peak, rms) = (column.norm_max(), column.norm_l2() / (alpha.nrows() as f64).sqrt());
        let crest = (rms > 0.0).then(|| peak / rms);
        ExcitedInput { channel: channel.clone(), peak, rms, crest, in_band: energies[j].share(options.band) }
    };
    on.inputs.iter().enumerate().map(one).collect()
}

pub(super) fn notches(energies: &[Energy], options: &ExciteOptions) -> Vec<NotchEnergy> {
    let one = |band: [f64; 2]| NotchEnergy {
        band,
        share: energies.iter().map(|e| e.share(band)).collect(),
        decibels: energies.iter().map(|e| Some(e.decibels(band, options.band)).filter(|d| d.is_finite())).collect(),
    };
    options.notch.iter().flat_map(ExcitationNotch::bands).map(one).collect()
}

pub(super) fn predicted(
    on: &LoopToExcite,
    response: &Response,
    limits: &[Option<Vec<f64>>; 2],
    wrong: &ModelErrorEffect,
) -> Vec<PredictedPeak> {
    let mut all = Vec::new();
    let groups =
        [on.inputs, on.outputs].into_iter().zip(response.peaks()).zip(limits).zip([&wrong.inputs, &wrong.outputs]);
    for (((channels, peaks), limits), wrong) in groups {
        for (j, channel) in channels.iter().enumerate() {
            let limit = limits.as_ref().map(|l| l[j]);
            let with_model_error = wrong[j].max(peaks[j]);
            all.push(PredictedPeak { channel: channel.clone(), peak: peaks[j], limit, with_model_error });
        }
    }
    all
}
