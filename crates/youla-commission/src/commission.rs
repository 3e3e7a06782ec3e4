//! The campaign: its points in their order, what is kept of each, and the summary.

use crate::bench::Bench;
use crate::between::{Ends, between, pairs};
use crate::campaign::{Campaign, OperatingPoint};
use crate::point::{Operator, Point, PointFiles};
use crate::q_table::write_tables;
use crate::record::{
    BetweenRecord, CampaignSummary, PointRecord, PointStatus, checksum_of, io, log_text, read_json, write_json,
    write_text,
};
use crate::report::report;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;
use youla::lti::Discrete;
use youla_io::SystemMatrices;
use youla_io::export::ExportedController;
use youla_run::{StageClock, write_run};
use youla_twin::{LoopDescription, RunningLoop, Target};

/// Sample time of the twin, seconds.
const TS: f64 = 2e-4;

/// Runs a campaign, or what is left of it, and writes `out`: a folder for each point and each way between two, report.html, summary.json
/// and q_table.json. What is done is kept. The campaign ends at the first point that is not done.
///
/// # Errors
/// Bad input, as a folder of another campaign; a controller that does not answer.
pub fn commission(path: &Path, out: &Path, operator: &mut dyn Operator) -> Result<CampaignSummary> {
    let campaign = Campaign::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let loops = loops(&campaign, folder)?;
    let image = campaign.image.as_ref().map(|image| folder.join(image));
    let controller = campaign.machine.as_deref().unwrap_or_else(|| Target::place(image.as_deref()));
    claim(&campaign, &loops, controller, out)?;
    let mut points = Vec::new();
    let pairs = pairs(&campaign, &loops);
    let expected = [campaign.points.len(), pairs.len()];
    let summarise = |points: &[PointRecord], ways: &[BetweenRecord]| -> Result<CampaignSummary> {
        let summary = CampaignSummary::new(&campaign.name, controller, expected, points.to_vec(), ways.to_vec());
        write_text(&out.join("report.html"), &report(&campaign, &summary, out)?)?;
        write_json(&out.join("summary.json"), &summary)?;
        Ok(summary)
    };
    for (at, running) in campaign.points.iter().zip(&loops) {
        let place = out.join(&at.name);
        let kept: Option<PointRecord> = read_json(&place.join("point.json"))?;
        let record = match kept.filter(|kept| kept.status == PointStatus::Done) {
            Some(kept) => {
                of_this_point(&kept, &place)?;
                operator.notes(&format!("{}: done before", at.name));
                kept
            }
            None => one_point(&campaign, at, running, (&place, image.as_deref()), operator)
                .map_err(|e| e.within(at.name.clone()))?,
        };
        let done = record.status == PointStatus::Done;
        points.push(record);
        let summary = summarise(&points, &[])?;
        if !done {
            return Ok(summary);
        }
    }
    let mut ways = Vec::new();
    for [i, j] in pairs {
        let at = [&campaign.points[i], &campaign.points[j]];
        let ends = Ends { at, records: [&points[i], &points[j]], running: &loops[i] };
        ways.push(between(&campaign, &ends, (out, image.as_deref()), operator)?);
        summarise(&points, &ways)?;
        if ways.last().is_some_and(|way| way.status != PointStatus::Done) {
            break;
        }
    }
    write_tables(&campaign, &ways, out)?;
    summarise(&points, &ways)
}

/// The loops of the points, at the sample time of the machine.
fn loops(campaign: &Campaign, folder: &Path) -> Result<Vec<RunningLoop>> {
    let files = campaign.points.iter().map(|point| folder.join(&point.running));
    let Some(address) = &campaign.machine else {
        let time = Discrete::new(TS)?;
        return files.map(|file| Ok(RunningLoop::read(&file, time)?)).collect();
    };
    let rig = youla_rig::Rig::connect(address)?;
    let machine = rig.description();
    let shape = machine.shape();
    let refuse = |problem: String| Err(Error::Controller { problem });
    if (shape.inputs, shape.outputs) != (2, 2) {
        return refuse(format!("has {} inputs and {} outputs; a campaign takes 2 and 2", shape.inputs, shape.outputs));
    }
    let Some(q_states) = machine.q_order else { return refuse("states no q_order: it takes no Q".into()) };
    let time = Discrete::new(machine.sample_time)?;
    files.map(|file| Ok(RunningLoop::of_machine(&file, time, q_states)?)).collect()
}

/// What a folder belongs to.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Claim {
    campaign: Campaign,
    loops: Vec<LoopDescription>,
    controller: String,
}

/// Makes the folder, or finds that it holds a part of the same campaign.
fn claim(campaign: &Campaign, loops: &[RunningLoop], controller: &str, out: &Path) -> Result<()> {
    let loops = loops.iter().map(|running| running.description.clone()).collect();
    let claim = Claim { campaign: campaign.clone(), loops, controller: controller.into() };
    fs::create_dir_all(out).map_err(|source| io(out, source))?;
    let path = out.join("campaign.json");
    match read_json::<Claim>(&path)? {
        Some(before) if before == claim => Ok(()),
        Some(_) => Err(Error::Campaign {
            path: out.to_owned(),
            problem:
                "this folder holds another campaign, or the same one with another controller; choose another --out"
                    .into(),
        }),
        None => {
            let mut entries = fs::read_dir(out).map_err(|source| io(out, source))?;
            if entries.next().is_some() {
                let problem = "this folder is not empty and holds no campaign; choose another --out".into();
                return Err(Error::Campaign { path: out.to_owned(), problem });
            }
            write_json(&path, &claim)
        }
    }
}

/// Whether q.json is the Q that was verified at a point that is kept.
fn of_this_point(kept: &PointRecord, place: &Path) -> Result<()> {
    let path = place.join("q.json");
    if kept.q_checksum.is_some() && checksum_of(&path)? == kept.q_checksum {
        return Ok(());
    }
    let problem = "this is not the Q that was verified at this point (its checksum is not that of point.json); remove point.json to run \
                   the point again"
        .into();
    Err(Error::Campaign { path, problem })
}

fn one_point(
    campaign: &Campaign,
    at: &OperatingPoint,
    running: &RunningLoop,
    (place, image): (&Path, Option<&Path>),
    operator: &mut dyn Operator,
) -> Result<PointRecord> {
    operator.notes(&at.name);
    let (mut record, files) =
        Point::new(campaign, at, running, Bench::start(campaign, at, running, image)?).run(operator)?;
    write_point(place, running, &mut record, files)?;
    Ok(record)
}

/// The record last: a point without it is run again.
fn write_point(place: &Path, running: &RunningLoop, record: &mut PointRecord, files: PointFiles) -> Result<()> {
    fs::create_dir_all(place).map_err(|source| io(place, source))?;
    let names = ["point.json", "q.json", "log.csv", "verification.csv"];
    for name in names {
        let path = place.join(name);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(io(&path, e)),
            _ => {}
        }
    }
    let ts = running.nominal.time().ts();
    for (name, rows) in [("log.csv", &files.log), ("verification.csv", &files.verification)] {
        if !rows.is_empty() {
            write_text(&place.join(name), &log_text(rows, ts))?;
        }
    }
    let found = match files.proposal {
        Some(proposal) => {
            let q = ExportedController {
                method: "youla".into(),
                ts,
                measured: proposal.found.records.outputs.clone(),
                commanded: proposal.found.records.inputs.clone(),
                controller: SystemMatrices::new(&proposal.new.controller),
                observer: None,
                q: Some(SystemMatrices::new(&proposal.new.q.system)),
            };
            write_json(&place.join("q.json"), &q)?;
            record.q_checksum = checksum_of(&place.join("q.json"))?;
            Some(proposal.found)
        }
        None => files.found.map(|found| *found),
    };
    if let Some(found) = found {
        let mut silent = |_| ();
        write_run(&found, &place.join("identification"), true, &mut StageClock::new(&mut silent))?;
    }
    write_json(&place.join("point.json"), record)
}
