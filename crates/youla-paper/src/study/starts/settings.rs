//! Everything that was chosen for the study of starts.

use super::super::settings::PaperSettings;
use super::case::StartCase;
use crate::rig::{Bearing, RigParameters};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::identify::subspace::{InitialState, Order, Stability, SubspaceMethod, SubspaceOptions};
use youla_greybox::MultiStartOptions;

/// The choices of [`super::evaluate_starts`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartsSettings {
    /// The cases.
    pub cases: Vec<StartCase>,
    /// Items of each case; absent: 500 loops of the study each, 100 of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub items: Option<usize>,
    /// Sample time, s.
    pub sample_time: f64,
    /// Ratio of the rms of noise and noise-free output in open loop.
    pub open_loop_noise: f64,
    /// The true bearing.
    pub bearing: Bearing,
    /// Several starts; `pem` is that of `paper`.
    pub multi_start: MultiStartOptions,
    /// Identification of the plant in open loop.
    pub subspace: SubspaceOptions,
    /// Seed, loops, controllers, S and the prediction-error method as in the study of the paper.
    pub paper: PaperSettings,
}

impl StartsSettings {
    /// The settings with which the program ships, for some cases.
    pub fn shipped(cases: &[StartCase], items: Option<usize>, seed: u64) -> Self {
        let mut paper = PaperSettings::shipped();
        paper.seed = seed;
        let rig = RigParameters::shipped();
        let pem = paper.pem.clone();
        StartsSettings {
            cases: cases.to_vec(),
            items,
            sample_time: rig.timing.sample_time.value,
            open_loop_noise: 0.1,
            bearing: rig.bearing.model(),
            multi_start: MultiStartOptions { starts: 32, searched: Some(4), pem, ..Default::default() },
            subspace: SubspaceOptions {
                method: SubspaceMethod::Cva,
                horizon: 20.into(),
                order: Order::Fixed(6),
                stability: Stability::Allow,
                initial_state: InitialState::Zero,
                ..Default::default()
            },
            paper,
        }
    }

    /// Items of a case.
    pub fn items(&self, case: StartCase) -> usize {
        self.items.unwrap_or(case.usual_items())
    }

    /// Fails for the first value without meaning.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] naming it.
    pub fn check(&self) -> Result<()> {
        let refused =
            |what: &str, must| Err(Error::Method(youla::Error::OutOfRange { what: what.into(), value: 0.0, must }));
        if self.items == Some(0) {
            return refused("the number of items of a case", "at least 1");
        }
        for case in &self.cases {
            let times = self.cases.iter().filter(|other| *other == case).count();
            if times > 1 {
                let what = format!("the number of times that the case {} is named", case.key());
                return Err(Error::Method(youla::Error::OutOfRange { what, value: times as f64, must: "1" }));
            }
        }
        if self.cases.is_empty() {
            return refused("the number of cases", "at least 1");
        }
        self.paper.check()
    }
}
