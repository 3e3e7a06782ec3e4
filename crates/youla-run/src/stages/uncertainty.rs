//! The uncertainty of the models of a run: regions of their frequency responses and intervals of their modes.

use crate::Result;
use crate::stages::responses::ports;
use crate::summary::entries::{ModeEntry, OrRefused, finite};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use youla::identify::hansen::HansenModel;
use youla::identify::subspace::{ModeBand, ResponseBand, Uncertainty, UncertaintyMethod, UncertaintyOptions};
use youla_greybox::GreyBoxIntervals;

/// The uncertainty of one system.
#[derive(Debug, Clone)]
pub struct SystemUncertainty {
    /// Confidence level.
    pub level: f64,
    /// Frequency response with its regions.
    pub response: ResponseBand,
    /// Modes with their intervals, in the order of the modes of the system.
    pub modes: Vec<ModeBand>,
}

/// The uncertainty that a run found, each where it was asked for and can be had.
#[derive(Debug, Clone, Default)]
pub struct RunUncertainty {
    /// Of S.
    pub deviation: Option<SystemUncertainty>,
    /// Of G(S).
    pub plant: Option<SystemUncertainty>,
}

/// On the frequencies in Hz, that of S and G(S) at `level`.
///
/// # Errors
/// Those of the frequency responses and eigenvalues.
pub(crate) fn run_uncertainty(hansen: &HansenModel, hz: &[f64], level: f64) -> Result<RunUncertainty> {
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let of = |uncertainty: &Option<Uncertainty>| -> Result<Option<SystemUncertainty>> {
        let Some(uncertainty) = uncertainty else { return Ok(None) };
        let Some(response) = uncertainty.response(&omega)? else { return Ok(None) };
        Ok(Some(SystemUncertainty { level, response, modes: uncertainty.modes()? }))
    };
    Ok(RunUncertainty { deviation: of(&hansen.deviation.uncertainty)?, plant: of(&hansen.uncertainty)? })
}

/// That of the physical structure.
///
/// # Errors
/// Those of the frequency response and eigenvalues.
pub(crate) fn structure_uncertainty(known: &GreyBoxIntervals, hz: &[f64]) -> Result<SystemUncertainty> {
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    Ok(SystemUncertainty { level: known.level, response: known.response(&omega)?, modes: known.modes()? })
}

impl SystemUncertainty {
    /// As `uncertainty.json` holds it: per output and input the response, the bounds of its magnitude and the covariance of its
    /// parts.
    pub(crate) fn file<'a>(&self, hz: &'a [f64]) -> UncertaintyFile<'a> {
        let first = self.response.response.at(0);
        let entry = |(output, input): (usize, usize)| {
            let values = self.response.response.entry(output, input);
            let places = || (0..hz.len()).map(|k| self.response.place(k, output, input));
            ResponseEntry {
                output,
                input,
                real: values.iter().map(|v| v.re).collect(),
                imaginary: values.iter().map(|v| v.im).collect(),
                magnitude: places().map(|k| self.response.magnitude[k]).collect(),
                covariance: places().map(|k| self.response.covariance[k]).collect(),
            }
        };
        UncertaintyFile {
            level: self.level,
            hz,
            ellipse: self.response.ellipse,
            entries: ports(first.nrows(), first.ncols()).map(entry).collect(),
            modes: self.modes.iter().map(ModeEntry::from).collect(),
        }
    }
}

/// `uncertainty.json`.
#[derive(Serialize)]
pub(crate) struct UncertaintyFile<'a> {
    level: f64,
    hz: &'a [f64],
    ellipse: f64,
    entries: Vec<ResponseEntry>,
    modes: Vec<ModeEntry>,
}

#[derive(Serialize)]
struct ResponseEntry {
    output: usize,
    input: usize,
    real: Vec<f64>,
    imaginary: Vec<f64>,
    magnitude: Vec<[f64; 2]>,
    covariance: Vec<[f64; 3]>,
}

/// What summary.json says of the uncertainty beside the modes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct UncertaintyEntry {
    /// How the uncertainty was found.
    pub method: UncertaintyMethod,
    /// Confidence level.
    pub level: f64,
    /// The test of S = 0, or the reason why there is none.
    pub evidence: Option<OrRefused<EvidenceEntry>>,
    /// Blocks of the data, of the delta method.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocks: Option<usize>,
    /// Replicates of a bootstrap.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replicates: Option<usize>,
    /// Resampled records that gave an unstable S.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unstable: Option<usize>,
    /// Resampled records that gave no S.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<usize>,
    /// Why there is no uncertainty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// Whether S is more than noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct EvidenceEntry {
    /// Whether the data contradict the nominal model.
    pub against_nominal: bool,
    /// The statistic.
    pub statistic: Option<f64>,
    /// Its threshold.
    pub threshold: Option<f64>,
}

impl UncertaintyEntry {
    /// `None` where it was not asked for.
    pub(crate) fn new(hansen: &HansenModel, options: &UncertaintyOptions) -> Option<Self> {
        let uncertainty = hansen.uncertainty.as_ref()?;
        let evidence = hansen.evidence.as_ref().map(|evidence| {
            OrRefused::new(evidence.as_ref().map(|e| EvidenceEntry {
                against_nominal: e.against_nominal(),
                statistic: finite(e.statistic),
                threshold: finite(e.threshold),
            }))
        });
        let (method, level) = (options.method, options.level);
        let none = UncertaintyEntry {
            method,
            level,
            evidence,
            blocks: None,
            replicates: None,
            unstable: None,
            failed: None,
            refused: None,
        };
        Some(match uncertainty {
            Uncertainty::Delta(delta) => UncertaintyEntry { blocks: Some(delta.blocks.len()), ..none },
            Uncertainty::Bootstrap(bootstrap) => UncertaintyEntry {
                replicates: Some(bootstrap.replicates.len()),
                unstable: Some(bootstrap.unstable),
                failed: Some(bootstrap.failed),
                ..none
            },
            Uncertainty::Refused { reason } => UncertaintyEntry { refused: Some(reason.to_string()), ..none },
        })
    }
}
