//! The way between the points: Q over speed, with evidence that the loop stays stable, and a check on the machine halfway.

use crate::bench::Bench;
use crate::campaign::{Campaign, OperatingPoint};
use crate::error::refuse;
use crate::figures::Sizes;
use crate::parameter::{LoadedQ, loaded};
use crate::point::{FIRST, Operator, Point};
use crate::q_table::{point_q, point_s};
use crate::record::{
    BetweenRecord, PointRecord, PointStatus, ScheduleEvidence, io, log_text, read_json, way_name, write_json,
    write_text,
};
use crate::{Error, Result};
use std::fs;
use std::path::Path;
use youla_loop::schedule::{BetweenPoints, between_points, q_between};
use youla_twin::{LoggedValues, RunningLoop};

/// Points next to each other in speed, with the same running loop and the same film: places in the campaign.
pub(crate) fn pairs(campaign: &Campaign, loops: &[RunningLoop]) -> Vec<[usize; 2]> {
    let points = &campaign.points;
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|i, j| points[*i].rpm.total_cmp(&points[*j].rpm));
    let alike = |i: usize, j: usize| {
        loops[i].description == loops[j].description && points[i].cross_coupling == points[j].cross_coupling
    };
    let next = |place: usize| {
        let i = order[place];
        let j = order[place + 1..].iter().copied().find(|j| alike(i, *j))?;
        (points[j].rpm > points[i].rpm).then_some([i, j])
    };
    (0..order.len()).filter_map(next).collect()
}

/// Both ends with their files.
pub(crate) struct Ends<'a> {
    pub(crate) at: [&'a OperatingPoint; 2],
    pub(crate) records: [&'a PointRecord; 2],
    pub(crate) running: &'a RunningLoop,
}

/// Evidence and check of a pair, or what is kept of them.
///
/// # Errors
/// Files; a controller that does not answer.
pub(crate) fn between(
    campaign: &Campaign,
    ends: &Ends<'_>,
    (out, image): (&Path, Option<&Path>),
    operator: &mut dyn Operator,
) -> Result<BetweenRecord> {
    let name = way_name(&ends.at[0].name, &ends.at[1].name);
    let place = out.join(&name);
    let kept: Option<BetweenRecord> = read_json(&place.join("between.json"))?;
    if let Some(kept) = kept.filter(|kept| kept.status == PointStatus::Done) {
        if !of_these_points(&kept, ends, out)? {
            let problem =
                "its evidence is not that of the Q and S of its points; remove this file to examine the way again"
                    .into();
            return Err(Error::Campaign { path: place.join("between.json"), problem });
        }
        operator.notes(&format!("{name}: done before"));
        return Ok(kept);
    }
    operator.notes(&name);
    let (record, rows) = examined(campaign, ends, (out, image), operator).map_err(|e| e.within(name))?;
    fs::create_dir_all(&place).map_err(|source| io(&place, source))?;
    write_text(&place.join("verification.csv"), &log_text(&rows, ends.running.nominal.time().ts()))?;
    write_json(&place.join("between.json"), &record)?;
    Ok(record)
}

/// Whether the evidence of a pair that is kept is that of the present Q and S of its points. Of Q and S that have none, as of a Q that is not
/// stable, it is not.
fn of_these_points(kept: &BetweenRecord, ends: &Ends<'_>, out: &Path) -> Result<bool> {
    let mut present = BetweenRecord { evidence: None, ..kept.clone() };
    if let Err(unread @ Error::File(_)) = evidence(ends, out, &mut present) {
        return Err(unread);
    }
    Ok(matches!((&kept.evidence, &present.evidence), (Some(kept), Some(present)) if kept.equals(present)))
}

fn examined(
    campaign: &Campaign,
    ends: &Ends<'_>,
    (out, image): (&Path, Option<&Path>),
    operator: &mut dyn Operator,
) -> Result<(BetweenRecord, Vec<LoggedValues>)> {
    let halfway = OperatingPoint {
        name: way_name(&ends.at[0].name, &ends.at[1].name),
        rpm: 0.5 * (ends.at[0].rpm + ends.at[1].rpm),
        ..ends.at[0].clone()
    };
    let mut record = BetweenRecord {
        from: ends.at[0].name.clone(),
        to: ends.at[1].name.clone(),
        status: PointStatus::Stopped,
        reason: None,
        evidence: None,
        rpm: halfway.rpm,
        expected: None,
        reached: None,
        q_order: None,
        switches: 0,
        unstable_switches: 0,
    };
    let mut rows = Vec::new();
    let ended = (|| {
        let q = evidence(ends, out, &mut record)?;
        let bench = Bench::start(campaign, &halfway, ends.running, image)?;
        checked(campaign, (ends, &halfway, bench, &q), operator, (&mut record, &mut rows))
    })();
    match ended {
        Ok(()) => record.status = PointStatus::Done,
        Err(Error::Refused { reason }) => record.reason = Some(reason),
        Err(e) => return Err(e),
    }
    Ok((record, rows))
}

/// The Q halfway, if the loops between the points are all stable.
fn evidence(ends: &Ends<'_>, out: &Path, record: &mut BetweenRecord) -> Result<LoadedQ> {
    let folder = |i: usize| out.join(&ends.at[i].name);
    let (s, q) = ([point_s(&folder(0))?, point_s(&folder(1))?], [point_q(&folder(0))?, point_q(&folder(1))?]);
    let (s, q) = ([&s[0], &s[1]], [&q[0], &q[1]]);
    let Some(found) = between_points(q, s)? else {
        return refuse("a loop between the points is not stable, or too near to it: add a point between them".into());
    };
    let halfway = q_between(q, 0.5, ends.running.q_states)?;
    let BetweenPoints { gain, room, change, q_room, .. } = found;
    let region = |i: usize| ends.records[i].region.unwrap_or(f64::INFINITY);
    let figures =
        ScheduleEvidence { gain, room, change, region: region(0).max(region(1)), q_room, q_error: halfway.error };
    record.evidence = Some(figures);
    record.q_order = Some(halfway.q.order());
    if !figures.holds() {
        return refuse(format!(
            "between the points S may depart from the line by {room:.3} and has a region of {:.3}, Q by {q_room:.1e} and has an error of \
             {:.1e}: add a point between them",
            figures.region, figures.q_error
        ));
    }
    loaded(&halfway.q, ends.running.q_states)
}

/// Runs the machine halfway with its Q.
fn checked(
    campaign: &Campaign,
    (ends, halfway, bench, q): (&Ends<'_>, &OperatingPoint, Bench, &LoadedQ),
    operator: &mut dyn Operator,
    (record, rows): (&mut BetweenRecord, &mut Vec<LoggedValues>),
) -> Result<()> {
    let mut point = Point::new(campaign, halfway, ends.running, bench);
    point.record.amplitude = ends.records[0].amplitude.min(ends.records[1].amplitude);
    point.record.seconds = FIRST;
    let bound = |i: usize| ends.records[i].predicted.map_or(f64::INFINITY, |predicted| predicted.bounds[0]);
    let expected = bound(0).min(bound(1));
    record.expected = Some(expected);
    point.at_rest()?;
    if !operator.confirms(&format!(
        "{}: switch to the Q halfway, at {:.0} rpm? At least the damping {expected:.3} is expected.",
        halfway.name, halfway.rpm
    )) {
        return refuse("the switch was not confirmed".into());
    }
    let ended = reached(&mut point, q, expected, (record, rows));
    if ended.is_err() {
        point.silence()?;
    }
    record.switches = point.record.switches;
    ended
}

fn reached(
    point: &mut Point<'_>,
    q: &LoadedQ,
    expected: f64,
    (record, rows): (&mut BetweenRecord, &mut Vec<LoggedValues>),
) -> Result<()> {
    let switched = point.switched(q).and_then(|log| {
        *rows = log;
        let of = |first: usize| [0, 1].map(|i| rms(rows.iter().map(|row| row[first + i])));
        let (output, input) = (of(0), of(2));
        let controller = point.running.factors.controller_of(&q.system)?;
        point.measured(q, &controller, Sizes { input: &input, output: &output }, rows)
    });
    let reached = match switched {
        Ok(reached) => reached,
        Err(e @ (Error::File(_) | Error::Controller { .. })) => return Err(e),
        Err(e) => {
            (record.status, record.unstable_switches) = (PointStatus::Fallback, 1);
            return refuse(format!("the loop could not be measured: {e}"));
        }
    };
    record.reached = Some(reached);
    if reached.damping.is_nan() || reached.damping < expected {
        record.status = PointStatus::Fallback;
        return refuse(format!("the damping {:.3} is below {expected:.3}", reached.damping));
    }
    Ok(())
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}
