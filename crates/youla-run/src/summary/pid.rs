//! A new PID in `8-redesign/pid.json` and summary.json.

use super::entries::finite;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla_loop::redesign::structured::{
    Band, FigureBand, LEVEL, PidController, PidOptions, PidRedesign, PlannedStep, ReferenceWeights,
};

/// A new PID, or one for each loop, with its proof.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PidEntry {
    /// The new gains, negative feedback, parallel form; of several loops that of input k, which acts on output k.
    pub controllers: Vec<PidController>,
    /// Those of the running controller; `null` where a loop has no such PID.
    pub running: Option<Vec<PidController>>,
    /// Parts and limits that were asked for.
    pub asked: PidOptions,
    /// How much better slow loads are rejected than by the running controller, in each loop.
    pub rejections: Vec<Option<f64>>,
    /// The proof on models that the search has not seen.
    pub proof: ProofEntry,
    /// Figures with their limits and bands.
    pub figures: Vec<FigureEntry>,
    /// How the reference enters each loop, as it does in the running controller; `null` where that is no PID with weights, and the step of the
    /// reference is not predicted.
    pub reference_weights: Option<Vec<ReferenceWeights>>,
    /// The way to the new controller; `half` is left out where it is unstable at one of the models.
    pub steps: Vec<StepEntry>,
    /// Why it should not be taken; empty where it keeps what it promises.
    pub reservations: Vec<String>,
}

/// What the new controller does at fresh models of the region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProofEntry {
    /// Whether none is unstable and the limits hold for the share `level` of models at least, with the probability `level`.
    pub holds: bool,
    /// Level of this statement and of all bands.
    pub level: f64,
    /// Models that were tested.
    pub models: usize,
    /// Models that the running controller does not stabilise, which were left out.
    pub impossible: usize,
    /// Models whose new loop is unstable.
    pub unstable: usize,
    /// Models whose new loop misses a limit.
    pub missed: usize,
    /// Models at which the running controller misses a limit.
    pub running_missed: usize,
    /// How many miss each limit.
    pub misses: BTreeMap<String, usize>,
    /// Largest probability of a model of either kind, at `level`.
    pub at_most: f64,
}

/// A figure of a loop with lower end, median and upper end of its band.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FigureEntry {
    /// The loop, counted from 1 in the order of the channels.
    #[serde(rename = "loop")]
    pub place: usize,
    /// Key of its limit, or `bandwidth`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// The limit.
    pub limit: Option<f64>,
    /// With the running controller.
    pub running: [Option<f64>; 3],
    /// With the new one.
    pub new: [Option<f64>; 3],
}

/// A step of the way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepEntry {
    /// `running`, `half` or `new`.
    pub name: String,
    /// Its gains, where each loop has a PID.
    pub controllers: Option<Vec<PidController>>,
    /// Models at which it is unstable.
    pub unstable: usize,
    /// Peak of the sensitivity; of several loops, here and below, that of the worst.
    pub peak_sensitivity: [Option<f64>; 3],
    /// Phase margin, degrees.
    pub phase_margin: [Option<f64>; 3],
    /// Frequency up to which the sensitivity is below -3 dB, Hz.
    pub bandwidth: [Option<f64>; 3],
    /// Overshoot of each loop after a step of its reference, upper end of the band, as a share of the step.
    pub overshoots: Vec<Option<f64>>,
    /// Time constant of a filter of each reference, `w += ts / (ts + T) (r - w)`, behind which the overshoot is 10 % at most, seconds; zero where it is
    /// so without one.
    pub reference_filters: Vec<f64>,
}

impl From<&PidRedesign> for PidEntry {
    fn from(new: &PidRedesign) -> Self {
        let proof = &new.proof;
        PidEntry {
            controllers: new.controllers.clone(),
            running: new.running_gains.clone(),
            asked: new.options.clone(),
            rejections: new.rejections.iter().copied().map(finite).collect(),
            proof: ProofEntry {
                holds: proof.holds(),
                level: LEVEL,
                models: proof.models,
                impossible: proof.impossible,
                unstable: proof.unstable,
                missed: proof.missed,
                running_missed: proof.running_missed,
                misses: proof.misses.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect(),
                at_most: proof.at_most,
            },
            figures: proof.figures.iter().map(FigureEntry::from).collect(),
            reference_weights: new.reference_weights.clone(),
            steps: new.steps.iter().map(StepEntry::from).collect(),
            reservations: new.reservations(),
        }
    }
}

impl From<&FigureBand> for FigureEntry {
    fn from(of: &FigureBand) -> Self {
        let (place, name, unit) = (of.channel + 1, of.name.into(), of.unit.into());
        FigureEntry { place, name, unit, limit: of.limit, running: of.running.map(finite), new: of.new.map(finite) }
    }
}

impl From<&PlannedStep> for StepEntry {
    fn from(step: &PlannedStep) -> Self {
        let all = |band: Band| band.map(finite);
        StepEntry {
            name: step.name.into(),
            controllers: step.controllers.clone(),
            unstable: step.unstable,
            peak_sensitivity: all(step.peak_sensitivity),
            phase_margin: all(step.phase_margin),
            bandwidth: all(step.bandwidth),
            overshoots: step.overshoots.iter().copied().map(finite).collect(),
            reference_filters: step.reference_filters.clone(),
        }
    }
}
