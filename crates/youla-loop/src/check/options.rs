//! Thresholds of all tests, with the reason for each.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What counts as a finding: `[check]` of run.toml.
///
/// Statistical tests use `significance` standard deviations. Residuals of measured records are neither exactly white nor exactly
/// normal; the threshold is therefore high, and an effect must also exceed a share of the variance.
///
/// Origin of the defaults: chosen so that 500 simulated clean records have no defect, and that the defects planted in simulated and measured
/// records are found (`docs/check.md`); a key that has a source of its own names it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CheckOptions {
    /// Limits of channels that are known, by name: lowest and highest value. A sample at or beyond one is clipped.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub limits: BTreeMap<String, [f64; 2]>,
    /// Samples at the extreme value of a channel from which it counts as a limit. Values of a channel without steps do
    /// not repeat by chance.
    pub clipped_samples: usize,
    /// By what factor the extreme value must be more frequent than each of the five values next to it. The density of a
    /// signal that is not clipped falls towards its extremes.
    pub clipped_pile_up: f64,
    /// Channels with at most this many values are treated as switched; they are not tested for clipping, constant stretches
    /// and resolution.
    pub switched_levels: usize,
    /// How much longer than every other constant stretch of the channel one must be. A stretch must also be longer than
    /// chance allows (probability 1e-4 in a record, with the share of repeated samples of the channel); friction makes
    /// stretches, but many of them.
    pub stuck_ratio: f64,
    /// Share of the variance of the innovation that the steps of a channel make (`q^2 / 12`), from which they are a caution.
    pub quantisation_share: f64,
    /// Root mean square of a signal, in its steps, below which the steps are a defect.
    pub coarse_steps: f64,
    /// Past samples in the regressions; fewer for many channels or short records.
    pub lags: usize,
    /// Standard deviations from which an effect in a regression is taken as real; 6 is a probability of 2e-9.
    pub significance: f64,
    /// Share of a variance that an effect in a regression must explain besides being real.
    pub share: f64,
    /// Drift over the record, peak to peak, in standard deviations of the channel, that is a caution. Four times as much
    /// is a defect.
    pub drift: f64,
    /// Deviations of the test for a single wrong sample; 8 is a probability of 1e-15 for normal noise, and the tails of
    /// measured residuals are compared with their own quantiles as well.
    pub outlier: f64,
    /// Share of the energy of the innovation that single wrong samples make, from which they are a caution; 2.5 times as
    /// much is a defect.
    pub outlier_share: f64,
    /// Probability of a line in a channel that has none.
    pub line_false_alarm: f64,
    /// Order of persistency that the excitation needs; past and future horizon of the identification when absent, else 40.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation_order: Option<usize>,
    /// Condition number of the Hankel matrix of the excitation above which a note is reported: the weakest direction has this
    /// much less amplitude than the strongest.
    pub excitation_condition: f64,
    /// Crest factor above which a note is reported. White normal noise has about 5.
    pub crest: f64,
    /// Part of the logged input that the controller does not explain, from which it is a caution.
    pub controller_caution: f64,
    /// The same for a defect.
    pub controller_defect: f64,
}

impl Default for CheckOptions {
    fn default() -> Self {
        CheckOptions {
            limits: BTreeMap::new(),
            clipped_samples: 4,
            clipped_pile_up: 4.0,
            switched_levels: 8,
            stuck_ratio: 3.0,
            quantisation_share: 0.25,
            coarse_steps: 3.0,
            lags: 20,
            significance: 6.0,
            share: 0.02,
            drift: 1.2,
            outlier: 8.0,
            outlier_share: 0.2,
            line_false_alarm: 1e-3,
            excitation_order: None,
            excitation_condition: 1e4,
            crest: 12.0,
            controller_caution: 0.01,
            controller_defect: 0.1,
        }
    }
}

impl CheckOptions {
    /// Refuses numbers outside of their range.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`].
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("clipped_pile_up", self.clipped_pile_up),
            ("stuck_ratio", self.stuck_ratio),
            ("quantisation_share", self.quantisation_share),
            ("coarse_steps", self.coarse_steps),
            ("significance", self.significance),
            ("share", self.share),
            ("drift", self.drift),
            ("outlier", self.outlier),
            ("outlier_share", self.outlier_share),
            ("excitation_condition", self.excitation_condition),
            ("crest", self.crest),
            ("controller_caution", self.controller_caution),
            ("controller_defect", self.controller_defect),
            ("lags", self.lags as f64),
        ];
        let refused = |key: &str, value, must| {
            Err(Error::Method(youla::Error::OutOfRange { what: format!("[check] {key}"), value, must }))
        };
        if let Some((key, value)) = positive.into_iter().find(|(_, value)| value.is_nan() || *value <= 0.0) {
            return refused(key, value, "positive");
        }
        if !(self.line_false_alarm > 0.0 && self.line_false_alarm < 1.0) {
            return refused("line_false_alarm", self.line_false_alarm, "between 0 and 1");
        }
        match self.limits.iter().find(|(_, [low, high])| low.is_nan() || high.is_nan() || low >= high) {
            Some((channel, [_, high])) => {
                refused(&format!("limits of {channel}: the second"), *high, "larger than the first")
            }
            None => Ok(()),
        }
    }
}
