//! Points, modes, and what is known between the points.

use super::{BEFORE, REACHED};
use crate::record::{BetweenRecord, CampaignSummary, PointRecord, PointStatus};
use youla_report::story::{Table, TableRow, plain};

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".into(), |v| format!("{v:.digits$}"))
}

fn word(status: PointStatus) -> String {
    let word = match status {
        PointStatus::Done => "done",
        PointStatus::Fallback => "taken back",
        PointStatus::Stopped => "stopped",
    };
    word.into()
}

pub(super) fn points(summary: &CampaignSummary) -> Table {
    let header = [
        "point",
        "no.",
        "status",
        "record, s",
        "excitation",
        "damping before",
        "predicted",
        "reached",
        "sensitivity before",
        "predicted",
        "reached",
        "order of Q",
    ];
    let row = |(place, point): (usize, &PointRecord)| TableRow {
        method: if point.reached.is_some() { REACHED } else { BEFORE }.into(),
        cells: vec![
            point.name.clone(),
            (place + 1).to_string(),
            word(point.status),
            number(Some(point.seconds), 1),
            number(Some(point.amplitude), 3),
            number(point.before.map(|s| s.damping), 4),
            point.predicted.map_or("-".into(), |p| format!("{:.4} to {:.4}", p.bounds[0], p.bounds[1])),
            number(point.reached.map(|s| s.damping), 4),
            number(point.before.map(|s| s.sensitivity), 2),
            number(point.predicted.map(|p| p.sensitivity), 2),
            number(point.reached.map(|s| s.sensitivity), 2),
            point.q_order.map_or("-".into(), |order| order.to_string()),
        ],
    };
    let caption = "Least damping ratio of the loop and peak of its sensitivity.";
    plain("points", "Operating points", caption, &header, summary.points.iter().enumerate().map(row).collect())
}

pub(super) fn modes(summary: &CampaignSummary) -> Table {
    let range = |interval: Option<[Option<f64>; 2]>, digits: usize| match interval {
        Some([Some(low), Some(high)]) => format!("{low:.digits$} to {high:.digits$}"),
        _ => "-".into(),
    };
    let mut rows = Vec::new();
    for point in &summary.points {
        rows.extend(point.modes.iter().map(|mode| TableRow {
            method: super::figures::key(&point.name),
            cells: vec![
                point.name.clone(),
                number(mode.hz, 2),
                range(mode.hz_interval, 2),
                number(mode.zeta, 4),
                range(mode.zeta_interval, 4),
            ],
        }));
    }
    let header = ["point", "frequency, Hz", "95 % interval", "damping ratio", "95 % interval"];
    let caption = "Modes of the recommended models, the machine without its controller.";
    plain("modes", "Modes", caption, &header, rows)
}

pub(super) fn between(summary: &CampaignSummary) -> Table {
    let header = [
        "way",
        "status",
        "small gain (below 1)",
        "room for S",
        "region of S",
        "change of S",
        "error of Q",
        "room for Q",
        "damping expected",
        "reached halfway",
    ];
    let row = |way: &BetweenRecord| {
        let of = |figure: fn(&crate::record::ScheduleEvidence) -> f64| way.evidence.as_ref().map(figure);
        let small = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.1e}"));
        TableRow {
            method: super::figures::way_key(way),
            cells: vec![
                way.name(),
                word(way.status),
                number(of(|e| e.gain), 3),
                number(of(|e| e.room), 3),
                number(of(|e| e.region), 3),
                number(of(|e| e.change), 3),
                small(of(|e| e.q_error)),
                small(of(|e| e.q_room)),
                way.expected.map_or("-".into(), |least| format!("{least:.4} or more")),
                number(way.reached.map(|state| state.damping), 4),
            ],
        }
    };
    let caption =
        "Departures of S and Q as H-infinity norms. The damping is measured with the Q halfway, at the speed halfway.";
    plain("between", "Between the points", caption, &header, summary.between.iter().map(row).collect())
}
