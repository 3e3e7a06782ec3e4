//! campaign.toml: the machine, its limits, the goal, and the operating points.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use youla_io::toml_file;

/// A campaign as its file states it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// Name of the machine; titles use it.
    pub name: String,
    /// Seed of the noise of the twin.
    #[serde(default = "one")]
    pub seed: u64,
    /// Image of the firmware for QEMU, relative to the file; the controller runs on the host where it or QEMU is absent.
    #[serde(default)]
    pub image: Option<PathBuf>,
    /// Address of a machine that speaks youla-link, as `youla rig` takes it; absent for the twin in this process.
    #[serde(default)]
    pub machine: Option<String>,
    /// What no experiment may exceed.
    pub limits: CampaignLimits,
    /// What is wanted.
    #[serde(default)]
    pub goal: Goal,
    /// The operating points, in their order.
    pub points: Vec<OperatingPoint>,
}

/// Limits of the guard and of the experiments.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignLimits {
    /// Largest magnitude of an output.
    pub output: f64,
    /// Largest magnitude of an input.
    pub input: f64,
    /// Largest magnitude of a residual beta.
    pub residual: f64,
    /// Largest amplitude of the excitation.
    pub excitation: f64,
    /// Longest recording, seconds.
    pub duration: f64,
}

/// What is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Goal {
    /// Least factor by which the predicted damping exceeds the present one.
    pub damping: f64,
    /// Largest relative standard deviation of the predicted damping; the recording goes on until it is reached.
    pub deviation: f64,
}

impl Default for Goal {
    fn default() -> Self {
        Goal { damping: 1.0, deviation: 0.1 }
    }
}

/// An operating point of the twin of the gas bearing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OperatingPoint {
    /// Its name, also of its folder.
    pub name: String,
    /// File with `[nominal]` and `[controller]` of the loop that runs, relative to the campaign.
    pub running: PathBuf,
    /// Speed in revolutions per minute.
    pub rpm: f64,
    /// Cross-coupling of the gas film as a share of the stiffness.
    #[serde(default)]
    pub cross_coupling: f64,
}

fn one() -> u64 {
    1
}

impl Campaign {
    /// Reads a file.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with line and key; [`Error::Campaign`] for a value out of its range.
    pub fn read(path: &Path) -> Result<Self> {
        let text = youla_io::read_text(path)?;
        Self::parse(&text, path)
    }

    /// The same of a text; `path` is named in errors.
    ///
    /// # Errors
    /// As [`Campaign::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let campaign: Campaign = toml_file::parse(text, path)?;
        match campaign.problem() {
            None => Ok(campaign),
            Some(problem) => Err(Error::Campaign { path: path.to_owned(), problem }),
        }
    }

    fn problem(&self) -> Option<String> {
        let limits = &self.limits;
        let positive = [
            ("[limits] output", limits.output),
            ("[limits] input", limits.input),
            ("[limits] residual", limits.residual),
            ("[limits] excitation", limits.excitation),
            ("[limits] duration", limits.duration),
            ("[goal] damping", self.goal.damping),
            ("[goal] deviation", self.goal.deviation),
        ];
        let bad = positive.iter().find(|(_, value)| !(*value > 0.0 && value.is_finite()));
        if let Some((key, value)) = bad {
            return Some(format!("{key} is {value}, but must be a number above 0"));
        }
        let of_twin = self.image.is_some() || self.points.iter().any(|point| point.cross_coupling != 0.0);
        if self.machine.is_some() && of_twin {
            return Some(
                "`image` and `cross_coupling` belong to the twin; leave them out where `machine` is given".into(),
            );
        }
        if self.points.is_empty() {
            return Some("there is no operating point; add [[points]]".into());
        }
        let names: std::collections::BTreeSet<&str> = self.points.iter().map(|point| point.name.as_str()).collect();
        if names.len() < self.points.len() {
            return Some("two [[points]] have the same name; give each its own".into());
        }
        let plain = |name: &str| !name.is_empty() && !name.starts_with('.') && !name.contains(['/', '\\']);
        let odd = names.into_iter().find(|name| !plain(name))?;
        Some(format!("[[points]] name = {odd:?} cannot be the name of a folder"))
    }
}
