//! The uncertainty of the models of a run: regions of their frequency responses and intervals of their modes.

use super::pipeline::Identification;
use super::verdict::Method;
use crate::Result;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use youla::identify::hansen::HansenModel;
use youla::identify::subspace::{ModeBand, ResponseBand, Uncertainty};
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
    /// Of the physical structure.
    pub grey_box: Option<SystemUncertainty>,
}

/// On the frequencies in Hz, that of S and G(S) at `level`.
///
/// # Errors
/// Those of the frequency responses and eigenvalues.
pub(super) fn run_uncertainty(
    hansen: &HansenModel,
    grey_box: Option<&GreyBoxIntervals>,
    hz: &[f64],
    level: f64,
) -> Result<RunUncertainty> {
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let of = |uncertainty: &Option<Uncertainty>| -> Result<Option<SystemUncertainty>> {
        let Some(uncertainty) = uncertainty else { return Ok(None) };
        let Some(response) = uncertainty.response(&omega)? else { return Ok(None) };
        Ok(Some(SystemUncertainty { level, response, modes: uncertainty.modes()? }))
    };
    let physical = |known: &GreyBoxIntervals| -> Result<SystemUncertainty> {
        Ok(SystemUncertainty { level: known.level, response: known.response(&omega)?, modes: known.modes()? })
    };
    Ok(RunUncertainty {
        deviation: of(&hansen.deviation.uncertainty)?,
        plant: of(&hansen.uncertainty)?,
        grey_box: grey_box.map(physical).transpose()?,
    })
}

impl RunUncertainty {
    /// That of the model that a method gave.
    pub(super) fn of(&self, method: Method) -> Option<&SystemUncertainty> {
        match method {
            Method::Hansen => self.plant.as_ref(),
            Method::GreyBox => self.grey_box.as_ref(),
            _ => None,
        }
    }
}

impl SystemUncertainty {
    /// As JSON: per output and input the response, the bounds of its magnitude and the covariance of its parts.
    pub(super) fn json(&self, hz: &[f64]) -> Value {
        let first = self.response.response.at(0);
        let (p, m) = (first.nrows(), first.ncols());
        let entries: Vec<Value> = (0..p)
            .flat_map(|i| (0..m).map(move |j| (i, j)))
            .map(|(i, j)| {
                let values = self.response.response.entry(i, j);
                let places = || (0..hz.len()).map(|k| self.response.place(k, i, j));
                json!({
                    "output": i,
                    "input": j,
                    "real": values.iter().map(|v| v.re).collect::<Vec<_>>(),
                    "imaginary": values.iter().map(|v| v.im).collect::<Vec<_>>(),
                    "magnitude": places().map(|k| self.response.magnitude[k]).collect::<Vec<_>>(),
                    "covariance": places().map(|k| self.response.covariance[k]).collect::<Vec<_>>(),
                })
            })
            .collect();
        let modes: Vec<Value> = self.modes.iter().map(|m| with_deviations(json!({}), m)).collect();
        json!({"level": self.level, "hz": hz, "ellipse": self.response.ellipse, "entries": entries, "modes": modes})
    }
}

/// Adds frequency and damping with deviations and intervals to an entry on a mode.
pub(super) fn with_deviations(mut entry: Value, band: &ModeBand) -> Value {
    entry["hz"] = json!(band.mode.hz);
    entry["zeta"] = json!(band.mode.zeta);
    entry["hz_deviation"] = json!(band.hz_deviation);
    entry["zeta_deviation"] = json!(band.zeta_deviation);
    entry["hz_interval"] = json!(band.hz);
    entry["zeta_interval"] = json!(band.zeta);
    entry
}

/// What summary.json says beside the modes; null where it was not asked for.
pub(super) fn summary_entry(found: &Identification) -> Value {
    let Some(uncertainty) = &found.hansen.uncertainty else { return Value::Null };
    let options = &found.settings.hansen.uncertainty;
    let evidence = match &found.hansen.evidence {
        Some(Ok(e)) => json!({
            "against_nominal": e.against_nominal(), "statistic": e.statistic, "threshold": e.threshold,
        }),
        Some(Err(reason)) => json!({"refused": reason.to_string()}),
        None => Value::Null,
    };
    let mut entry = json!({"method": options.method, "level": options.level, "evidence": evidence});
    match uncertainty {
        Uncertainty::Delta(delta) => entry["blocks"] = json!(delta.blocks.len()),
        Uncertainty::Bootstrap(bootstrap) => {
            entry["replicates"] = json!(bootstrap.replicates.len());
            entry["unstable"] = json!(bootstrap.unstable);
            entry["failed"] = json!(bootstrap.failed);
        }
        Uncertainty::Refused { reason } => entry["refused"] = json!(reason.to_string()),
    }
    entry
}
