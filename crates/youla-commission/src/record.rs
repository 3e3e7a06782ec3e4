//! What a campaign leaves: one record for each point, kept for an interrupted campaign, and summary.json.

use crate::figures::LoopState;
use crate::rehearse::DampingPrediction;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use youla_rt::Checksum;
use youla_run::ModeEntry;
use youla_twin::LoggedValues;

/// How a point ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointStatus {
    /// The new Q runs, and the verification is as predicted or better.
    Done,
    /// The new Q ran, but the guard or the verification was against it; Q is zero again.
    Fallback,
    /// Nothing was switched; alpha and Q are zero.
    Stopped,
}

/// A point of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// Its name.
    pub name: String,
    /// How it ended.
    pub status: PointStatus,
    /// Why it was stopped or taken back.
    pub reason: Option<String>,
    /// Amplitude of the excitation.
    pub amplitude: f64,
    /// Length of the record from which the model comes, seconds.
    pub seconds: f64,
    /// The loop with the controller that ran, measured.
    pub before: Option<LoopState>,
    /// Modes of the recommended model, with their 95 % intervals.
    #[serde(default)]
    pub modes: Vec<ModeEntry>,
    /// Largest departure of S within its region, over frequency.
    #[serde(default)]
    pub region: Option<f64>,
    /// What was predicted of the verification.
    pub predicted: Option<DampingPrediction>,
    /// The loop with the new Q, measured.
    pub reached: Option<LoopState>,
    /// States of the new Q.
    pub q_order: Option<usize>,
    /// CRC-32 of q.json as it was verified.
    #[serde(default)]
    pub q_checksum: Option<u32>,
    /// Models within the region of S that the new controller stabilises, all of them.
    pub certified_models: Option<usize>,
    /// Switches of Q.
    pub switches: usize,
    /// Switches after which the guard ended the excitation or the loop was not measured as stable.
    pub unstable_switches: usize,
}

/// Two neighbouring speeds with the same running loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BetweenRecord {
    /// The point of the lower speed.
    pub from: String,
    /// The point of the higher speed.
    pub to: String,
    /// How it ended.
    pub status: PointStatus,
    /// Why it was stopped or taken back.
    pub reason: Option<String>,
    /// Evidence that all loops between the points are stable.
    pub evidence: Option<ScheduleEvidence>,
    /// Speed of the check, halfway, revolutions per minute.
    pub rpm: f64,
    /// Least damping that is expected there: the lower bound of either point.
    pub expected: Option<f64>,
    /// The loop with the Q halfway, measured.
    pub reached: Option<LoopState>,
    /// States of the Q halfway.
    pub q_order: Option<usize>,
    /// Switches of Q.
    pub switches: usize,
    /// Switches after which the guard ended the excitation or the loop was not measured as stable.
    pub unstable_switches: usize,
}

impl BetweenRecord {
    /// Both points by their names; also its folder.
    pub(crate) fn name(&self) -> String {
        way_name(&self.from, &self.to)
    }
}

pub(crate) fn way_name(from: &str, to: &str) -> String {
    format!("{from} to {to}")
}

/// Figures of the evidence, see [`youla_loop::schedule`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduleEvidence {
    /// Largest small-gain figure, below 1.
    pub gain: f64,
    /// How far S may depart from the line between the points, H-infinity norm.
    pub room: f64,
    /// How far S moves from point to point.
    pub change: f64,
    /// How far S may depart within its region at a point.
    pub region: f64,
    /// How far Q may depart from the mean of both instead.
    pub q_room: f64,
    /// Error of the Q halfway by its reduction, an upper bound.
    pub q_error: f64,
}

impl ScheduleEvidence {
    /// Whether the figures are the same but for rounding.
    pub(crate) fn equals(&self, other: &Self) -> bool {
        let figures = |e: &Self| [e.gain, e.room, e.change, e.region, e.q_room, e.q_error];
        figures(self).iter().zip(figures(other)).all(|(a, b)| (a - b).abs() <= 1e-6 * a.abs().max(b.abs()).max(1e-9))
    }

    /// Whether S has room for its region and Q for its error.
    pub(crate) fn holds(&self) -> bool {
        self.gain < 1.0 && self.region < self.room && self.q_error < self.q_room
    }
}

/// Least damping at a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DampingFigures {
    /// Measured with the controller that ran.
    pub before: Option<f64>,
    /// Bounds of the prediction.
    pub predicted: Option<[f64; 2]>,
    /// Measured with the new Q.
    pub reached: Option<f64>,
}

/// The contents of summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CampaignSummary {
    /// Name of the machine.
    pub name: String,
    /// Of the first point.
    pub damping: DampingFigures,
    /// Over all points.
    pub unstable_switches: usize,
    /// Where the loop of the firmware ran: `qemu cortex-m4` or `host`.
    pub controller: String,
    /// Whether every point, and the way between the points, is done.
    pub done: bool,
    /// All points that were begun.
    pub points: Vec<PointRecord>,
    /// Between neighbouring speeds with the same running loop.
    pub between: Vec<BetweenRecord>,
}

impl CampaignSummary {
    /// `expected`: points and pairs of the campaign.
    pub(crate) fn new(
        name: &str,
        controller: &str,
        expected: [usize; 2],
        points: Vec<PointRecord>,
        between: Vec<BetweenRecord>,
    ) -> Self {
        let done = |all: &mut dyn Iterator<Item = PointStatus>| all.filter(|s| *s == PointStatus::Done).count();
        let ended =
            [done(&mut points.iter().map(|p| p.status)), done(&mut between.iter().map(|between| between.status))];
        let first = points.first();
        CampaignSummary {
            name: name.into(),
            damping: DampingFigures {
                before: first.and_then(|p| p.before).map(|state| state.damping),
                predicted: first.and_then(|p| p.predicted).map(|predicted| predicted.bounds),
                reached: first.and_then(|p| p.reached).map(|state| state.damping),
            },
            unstable_switches: points.iter().map(|p| p.unstable_switches).sum::<usize>()
                + between.iter().map(|b| b.unstable_switches).sum::<usize>(),
            controller: controller.into(),
            done: ended == expected,
            points,
            between,
        }
    }
}

/// Reads JSON; `None` where the file does not exist.
///
/// # Errors
/// [`youla_io::Error::Io`]; [`Error::Campaign`] for a file that does not hold it.
pub(crate) fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    let text = match youla_io::read_text(path) {
        Err(youla_io::Error::MissingFile { .. }) => return Ok(None),
        other => other?,
    };
    serde_json::from_str(&text).map(Some).map_err(|e| Error::Campaign {
        path: path.to_owned(),
        problem: format!("{e}; choose another --out, or remove this file to repeat its part"),
    })
}

/// CRC-32 of a file; `None` where it does not exist.
///
/// # Errors
/// [`youla_io::Error::Io`].
pub(crate) fn checksum_of(path: &Path) -> Result<Option<u32>> {
    match fs::read(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        other => {
            let mut checksum = Checksum::new();
            checksum.append(&other.map_err(|source| io(path, source))?);
            Ok(Some(checksum.value()))
        }
    }
}

/// Writes a file whole: beside its place first.
///
/// # Errors
/// [`youla_io::Error::Io`].
pub(crate) fn write_text(path: &Path, text: &str) -> Result<()> {
    let partial = path.with_extension("partial");
    fs::write(&partial, text).and_then(|()| fs::rename(&partial, path)).map_err(|source| io(path, source))
}

/// As [`write_text`], JSON for people.
///
/// # Errors
/// [`youla_io::Error::Io`].
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|e| io(path, e.into()))?;
    write_text(path, &(text + "\n"))
}

pub(crate) fn io(path: &Path, source: std::io::Error) -> Error {
    Error::File(youla_io::Error::Io { path: path.to_owned(), source })
}

/// Rows as CSV.
pub(crate) fn log_text(rows: &[LoggedValues], ts: f64) -> String {
    let mut text = String::from("t,y_h,y_v,u_h,u_v,alpha_1,alpha_2,beta_1,beta_2\n");
    for (k, row) in rows.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{:?}", k as f64 * ts);
        for value in row {
            let _ = write!(text, ",{:?}", *value as f32);
        }
        text.push('\n');
    }
    text
}
