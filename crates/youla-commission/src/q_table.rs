//! q_table.json: Q over the speed, for `youla rig load --speed`.

use crate::campaign::Campaign;
use crate::error::refuse;
use crate::record::{BetweenRecord, PointStatus, ScheduleEvidence, read_json, write_json};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use youla::lti::{Discrete, StateSpace};
use youla_io::SystemMatrices;
use youla_io::export::{ExportedController, read_model};
use youla_loop::schedule::{QBetween, q_between};

/// Q over the speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct QTable {
    /// Sample time, seconds.
    pub ts: f64,
    /// Ascending in speed.
    pub points: Vec<QAtSpeed>,
    /// Evidence on each way from a point to the next.
    pub between: Vec<ScheduleEvidence>,
}

/// Q at a speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct QAtSpeed {
    /// Name of the operating point.
    pub name: String,
    /// Revolutions per minute.
    pub rpm: f64,
    /// From beta to alpha.
    pub q: SystemMatrices,
}

impl QTable {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Campaign`] for a file that is no such table; [`youla_io::Error::Io`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = youla_io::read_text(path)?;
        Self::parse(&text, path)
    }

    /// The same of a text; `path` is named in errors.
    ///
    /// # Errors
    /// [`Error::Campaign`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let wrong = |problem: &str| Error::Campaign { path: path.to_owned(), problem: problem.into() };
        let table: QTable = serde_json::from_str(text)
            .map_err(|e| wrong(&format!("{e}; give the q_table.json of a campaign over speed")))?;
        let rising = table.points.windows(2).all(|pair| pair[0].rpm < pair[1].rpm);
        if table.points.len() < 2 || table.between.len() + 1 != table.points.len() || !rising {
            return Err(wrong("a table of Q needs two points or more of rising speed, and the evidence between them"));
        }
        Ok(table)
    }

    /// Q at a speed, with at most `most` states, linear between the two points around it.
    ///
    /// # Errors
    /// [`Error::Refused`] for a speed beyond the table, and for a Q whose reduction takes more than the evidence leaves;
    /// [`Error::Method`] for matrices that do not fit.
    pub fn at(&self, rpm: f64, most: usize) -> Result<StateSpace<Discrete>> {
        let place = self.points.windows(2).position(|pair| (pair[0].rpm..=pair[1].rpm).contains(&rpm));
        let Some(place) = place else {
            let ends = [self.points.first(), self.points.last()].map(|point| point.map_or(f64::NAN, |p| p.rpm));
            return refuse(format!("the table holds {} to {} rpm, not {rpm} rpm", ends[0], ends[1]));
        };
        let time = Discrete::new(self.ts)?;
        let (low, high) = (&self.points[place], &self.points[place + 1]);
        let (q_low, q_high) = (low.q.system(time)?, high.q.system(time)?);
        let weight = (rpm - low.rpm) / (high.rpm - low.rpm);
        let QBetween { q, error } = q_between([&q_low, &q_high], weight, most)?;
        let room = self.between[place].q_room;
        if error >= room {
            return refuse(format!(
                "Q at {rpm} rpm is reduced to {most} states at most, which is an error of up to {error:.1e} where the evidence between {} and {} \
                 leaves {room:.1e}",
                low.name, high.name
            ));
        }
        Ok(q)
    }
}

/// Q of a point that is done.
///
/// # Errors
/// Files; [`Error::Campaign`] where there is none.
pub(crate) fn point_q(folder: &Path) -> Result<StateSpace<Discrete>> {
    let path = folder.join("q.json");
    let missing =
        || Error::Campaign { path: path.clone(), problem: "there is no Q of this point; run it again".into() };
    let exported: ExportedController = read_json(&path)?.ok_or_else(missing)?;
    let q = exported.q.as_ref().ok_or_else(missing)?;
    Ok(q.system(Discrete::new(exported.ts)?)?)
}

/// S of a point that is done.
///
/// # Errors
/// Files.
pub(crate) fn point_s(folder: &Path) -> Result<StateSpace<Discrete>> {
    Ok(read_model(folder.join("identification/4-identify/deviation.json"))?.system)
}

/// Writes one table for each chain of pairs that are done: `q_table.json`, further ones with a number.
///
/// # Errors
/// Files.
pub(crate) fn write_tables(campaign: &Campaign, between: &[BetweenRecord], out: &Path) -> Result<()> {
    let mut chains: Vec<QTable> = Vec::new();
    for way in between.iter().filter(|way| way.status == PointStatus::Done) {
        let Some(evidence) = way.evidence else { continue };
        let at = |name: &str| -> Result<QAtSpeed> {
            let rpm = campaign.points.iter().find(|point| point.name == name).map_or(f64::NAN, |point| point.rpm);
            let q = SystemMatrices::new(&point_q(&out.join(name))?);
            Ok(QAtSpeed { name: name.into(), rpm, q })
        };
        let (from, to, ts) = (at(&way.from)?, at(&way.to)?, point_q(&out.join(&way.from))?.time().ts());
        match chains.iter_mut().find(|chain| chain.points.last().is_some_and(|last| last.name == from.name)) {
            Some(chain) => {
                chain.points.push(to);
                chain.between.push(evidence);
            }
            None => chains.push(QTable { ts, points: vec![from, to], between: vec![evidence] }),
        }
    }
    for (number, chain) in chains.iter().enumerate() {
        let name = if number == 0 { "q_table.json".into() } else { format!("q_table_{}.json", number + 1) };
        write_json(&out.join(name), chain)?;
    }
    Ok(())
}
