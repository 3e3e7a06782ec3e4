//! One model of a run: the description that summary.json, `7-validate/verdict.json`, the page and the comparison of runs read.

use super::entries::{Fits, ModeEntry, RealPoleEntry, apart, finite, finite_all, pairs};
use super::physical::PhysicalEntry;
use super::robustness::robustness;
use crate::Result;
use crate::method::Method;
use crate::result::Identification;
use crate::stages::validate::residuals::{RecordResiduals, ResidualPredictor, step_keys};
use crate::stages::validate::{ModelValidation, RecordValidation};
use crate::summary::recommended::shown;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::lti::Mode;
use youla::validate::LargestCorrelation;
use youla_report::data::Robustness;

/// A model, given or identified.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelEntry {
    /// Number of states, of the recommended model without those of the dead time.
    pub order: usize,
    /// Whether the controller that ran stabilises this model.
    pub stabilised_by_controller: bool,
    /// Fit (26) in percent, per verification record and output.
    pub fit: Fits,
    /// Variance accounted for in percent, per verification record and output.
    pub vaf: Fits,
    /// Why a verification record has no prediction.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub diverged: BTreeMap<String, String>,
    /// Oscillating modes that the response shows.
    pub modes: Vec<ModeEntry>,
    /// Real poles that the response shows.
    pub real_poles: Vec<RealPoleEntry>,
    /// Modes and real poles left out because zeros of the model cancel them.
    pub modes_cancelled: usize,
    /// Modes left out because they lie at or above the Nyquist frequency.
    pub modes_above_nyquist: usize,
    /// Poles in z, `[re, im]`.
    pub poles: Vec<[f64; 2]>,
    /// Finite invariant zeros in z, where there are as many inputs as outputs.
    pub zeros: Vec<[f64; 2]>,
    /// Poles in z of the loop with the controller that ran.
    pub closed_loop_poles: Vec<[f64; 2]>,
    /// Margins and distances.
    pub robustness: Robustness,
    /// Tests of the residual, per verification record.
    pub residuals: BTreeMap<String, ResidualEntry>,
    /// The physical structure; `grey_box` only.
    #[serde(flatten)]
    pub physical: Option<PhysicalEntry>,
}

impl ModelEntry {
    /// Of a model of a run.
    ///
    /// # Errors
    /// Those of zeros and of derived quantities of a physical structure.
    pub(crate) fn new(run: &Identification, v: &ModelValidation) -> Result<Self> {
        let square = v.model.inputs() == v.model.outputs();
        let structure = run.structure().filter(|_| v.method == Method::GreyBox);
        let by_record = |of: &dyn Fn(&RecordValidation) -> Vec<f64>| -> Fits {
            v.records.iter().map(|r| (r.record.clone(), finite_all(&of(r)))).collect()
        };
        let diverged = |r: &RecordValidation| Some((r.record.clone(), r.predicted.as_ref().err()?.clone()));
        let residuals = v.records.iter().filter_map(|r| Some((r.record.clone(), r.residuals.as_ref()?.into())));
        let (modes, real_poles) = modes(run, v);
        let recommended = run.recommended.as_ref().ok().filter(|_| v.method == Method::Likelihood);
        Ok(ModelEntry {
            order: recommended.map_or_else(|| v.model.order(), |found| found.order),
            stabilised_by_controller: v.certificate.stable,
            fit: by_record(&|r| r.fit.clone()),
            vaf: by_record(&|r| r.vaf.clone()),
            diverged: v.records.iter().filter_map(diverged).collect(),
            modes,
            real_poles,
            modes_cancelled: v.visible.as_ref().map_or(0, |shown| shown.cancelled),
            modes_above_nyquist: v.visible.as_ref().map_or(0, |shown| shown.above_nyquist),
            poles: pairs(&v.poles),
            zeros: if square { pairs(&v.model.zeros()?) } else { Vec::new() },
            closed_loop_poles: pairs(&v.certificate.poles),
            robustness: robustness(&v.robustness),
            residuals: residuals.collect(),
            physical: structure.map(PhysicalEntry::new).transpose()?,
        })
    }

    /// Mean fit over all verification records and outputs; NaN where a prediction diverged, `None` without records.
    pub(crate) fn mean_fit(&self) -> Option<f64> {
        let all: Vec<f64> = self.fit.values().flatten().map(|fit| fit.unwrap_or(f64::NAN)).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }

    /// The pole of the loop that is farthest out.
    pub(crate) fn worst_closed_loop_pole(&self) -> Option<[f64; 2]> {
        let radius = |p: &[f64; 2]| p[0].hypot(p[1]);
        self.closed_loop_poles.iter().copied().max_by(|a, b| radius(a).total_cmp(&radius(b)))
    }
}

/// The modes and real poles that the response shows, with deviations where they are known. A pole at z = 0 is a sample of delay, and no mode.
fn modes(run: &Identification, v: &ModelValidation) -> (Vec<ModeEntry>, Vec<RealPoleEntry>) {
    if let (Method::Likelihood, Ok(found)) = (v.method, &run.recommended) {
        return shown(found);
    }
    let known = run.uncertainty(v.method).map_or(&[][..], |known| &known.modes);
    let entry = |(k, mode): (usize, &Mode)| {
        let residue = pairs(v.visible_residue(mode.pole)?);
        let entry = known.get(k).map_or_else(|| ModeEntry::from(mode), ModeEntry::from);
        Some((mode.pole, ModeEntry { residue, ..entry }))
    };
    apart(v.modes.iter().enumerate().filter(|(_, m)| m.hz.is_finite()).filter_map(entry))
}

/// The residual of a model on a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResidualEntry {
    /// Whether the residual does not depend on past excitation; `null` where none from outside is known.
    pub independent: Option<bool>,
    /// Names of the signals with which it was correlated.
    pub excitations: Vec<String>,
    /// The causal correlation that is largest in its standard deviations.
    pub largest: Option<LargestEntry>,
    /// Fits in percent over the second half of the record, per output: some samples ahead, and of the simulation.
    pub k_step_fits: BTreeMap<String, Vec<Option<f64>>>,
    /// What predicts the residual in them.
    pub predictor: ResidualPredictor,
}

/// Where a residual depends most on past excitation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LargestEntry {
    /// Output, counted from 0.
    pub output: usize,
    /// Excitation, counted from 0.
    pub input: usize,
    /// Samples by which the excitation is earlier.
    pub lag: usize,
    /// The correlation, -1 to 1.
    pub correlation: Option<f64>,
    /// In standard deviations.
    pub deviations: Option<f64>,
}

impl From<&RecordResiduals> for ResidualEntry {
    fn from(r: &RecordResiduals) -> Self {
        let at = |l: &LargestCorrelation| {
            let here = r.correlations.cross.iter().find(|c| (c.output, c.input) == (l.output, l.input));
            here.map(|c| c.values[c.values.len() / 2 + l.lag])
        };
        let largest = |l: LargestCorrelation| LargestEntry {
            output: l.output,
            input: l.input,
            lag: l.lag,
            correlation: at(&l).and_then(finite),
            deviations: finite(l.deviations),
        };
        ResidualEntry {
            independent: r.independent(),
            excitations: r.excitations.clone(),
            largest: r.correlations.largest.map(largest),
            k_step_fits: step_keys().into_iter().zip(r.k_step_fits.iter().map(|f| finite_all(f))).collect(),
            predictor: r.predictor,
        }
    }
}
