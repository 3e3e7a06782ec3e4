//! Damping by point, modes over speed, S over frequency.

use super::{BEFORE, HALFWAY, PREDICTED, REACHED};
use crate::Result;
use crate::campaign::Campaign;
use crate::q_table::point_s;
use crate::record::{BetweenRecord, CampaignSummary, PointRecord};
use std::f64::consts::TAU;
use std::path::Path;
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla_report::figure::{Area, Axis, Content, Curve, Drawn, Figure, Guide, GuideKind, Panel};
use youla_run::ModeEntry;

/// Key of a point in figures.
pub(super) fn key(point: &str) -> String {
    format!("point {point}")
}

/// Key of the way between two points.
pub(super) fn way_key(way: &BetweenRecord) -> String {
    format!("way {}", way.name())
}

fn axis(label: &str, unit: &str) -> Axis {
    Axis { label: label.into(), unit: unit.into(), ..Axis::default() }
}

fn dots(method: &str, drawn: Drawn, points: impl Iterator<Item = (f64, f64, String)>) -> Curve {
    let mut curve = Curve { method: method.into(), drawn, ..Curve::default() };
    for (x, y, text) in points {
        curve.x.push(x);
        curve.y.push(y);
        curve.details.push(text);
    }
    curve
}

/// Least damping before, predicted and reached, over the number of the point.
pub(super) fn damping(summary: &CampaignSummary) -> Figure {
    let points = || (1..).zip(&summary.points).map(|(number, point): (u32, _)| (f64::from(number), point));
    let measured = |method: &str, of: fn(&PointRecord) -> Option<f64>| {
        let all = points().filter_map(|(x, point)| of(point).map(|y| (x, y, format!("{}: {y:.4}", point.name))));
        dots(method, Drawn::Dots, all)
    };
    let place = |name: &str| points().find(|(_, point)| point.name == name).map_or(0.0, |(x, _)| x);
    let halfway = summary.between.iter().filter_map(|way| {
        let y = way.reached?.damping;
        Some((0.5 * (place(&way.from) + place(&way.to)), y, format!("halfway, {:.0} rpm: {y:.4}", way.rpm)))
    });
    let predicted = points().filter_map(|(x, point)| {
        let [low, high] = point.predicted?.bounds;
        let (x, low, high) = (vec![x - 0.12, x + 0.12], vec![low; 2], vec![high; 2]);
        Some(Area { method: PREDICTED.into(), note: "99 %".into(), x, low, high })
    });
    let count = summary.points.len() as f64;
    let curves = [
        measured(BEFORE, |p| p.before.map(|s| s.damping)),
        measured(REACHED, |p| p.reached.map(|s| s.damping)),
        dots(HALFWAY, Drawn::Marks, halfway),
    ];
    Figure {
        key: "damping".into(),
        title: "Least damping".into(),
        caption: "Least damping ratio of the loop, before and after the switch, with the bounds that were predicted."
            .into(),
        panels: vec![Panel {
            x: Axis { range: Some([0.5, count + 0.5]), ..axis("number of the operating point", "") },
            y: axis("least damping ratio", ""),
            content: Content::Curves(curves.into_iter().filter(|curve| !curve.x.is_empty()).collect()),
            regions: predicted.collect(),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

/// Modes of the machine over its speed, with the lines of once and twice the speed.
pub(super) fn campbell(campaign: &Campaign, summary: &CampaignSummary) -> Figure {
    let rpm = |name: &str| campaign.points.iter().find(|p| p.name == name).map_or(0.0, |p| p.rpm);
    let fastest = campaign.points.iter().map(|p| p.rpm).fold(0.0, f64::max).max(1.0);
    let (mut curves, mut regions) = (Vec::new(), Vec::new());
    let highest = summary.points.iter().flat_map(resonances).filter_map(|mode| mode.hz).fold(1.0, f64::max);
    for point in &summary.points {
        let x = rpm(&point.name);
        let all = resonances(point).filter_map(|mode| {
            let (hz, zeta) = (mode.hz?, mode.zeta?);
            Some((x, hz, format!("{}: {hz:.2} Hz, damping {zeta:.4}", point.name)))
        });
        curves.push(dots(&key(&point.name), Drawn::Dots, all));
        regions.extend(resonances(point).filter_map(|mode| {
            let [low, high] = mode.hz_interval?;
            let (x, low, high) = (vec![x - 0.01 * fastest, x + 0.01 * fastest], vec![low?; 2], vec![high?; 2]);
            Some(Area { method: key(&point.name), note: "95 %".into(), x, low, high })
        }));
    }
    let order = |times: f64| Guide {
        kind: GuideKind::Level,
        x: vec![0.0, 1.05 * fastest],
        y: vec![0.0, 1.05 * fastest * times / 60.0],
        label: format!("{times:.0}\u{d7} speed"),
        at: [0.8 * fastest, 0.8 * fastest * times / 60.0],
    };
    Figure {
        key: "campbell".into(),
        title: "Campbell diagram".into(),
        caption: "Identified natural frequencies over the speed; the bands are 95 % intervals.".into(),
        panels: vec![Panel {
            x: Axis { range: Some([-0.05 * fastest, 1.05 * fastest]), ..axis("speed", "rpm") },
            y: Axis { range: Some([0.0, 1.1 * highest.max(fastest / 30.0)]), ..axis("natural frequency", "Hz") },
            content: Content::Curves(curves.into_iter().filter(|curve| !curve.x.is_empty()).collect()),
            regions,
            guides: vec![order(1.0), order(2.0)],
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

/// Modes that oscillate.
fn resonances(point: &PointRecord) -> impl Iterator<Item = &ModeEntry> {
    point.modes.iter().filter(|mode| mode.zeta.is_some_and(|zeta| zeta.abs() < 0.999))
}

/// S at the points that share their factors, and its changes beside the room.
pub(super) fn deviation(summary: &CampaignSummary, out: &Path) -> Result<Figure> {
    let (mut at_points, mut changes, mut rooms) = (Vec::<Curve>::new(), Vec::new(), Vec::new());
    for way in &summary.between {
        let s = [point_s(&out.join(&way.from))?, point_s(&out.join(&way.to))?];
        for (name, s) in [&way.from, &way.to].into_iter().zip(&s) {
            if at_points.iter().all(|curve| curve.method != key(name)) {
                at_points.push(gain(key(name), s)?);
            }
        }
        changes.push(gain(way_key(way), &s[1].plus(&s[0].negated())?)?);
        rooms.extend(way.evidence.map(|evidence| Guide {
            kind: GuideKind::Level,
            x: changes.last().map_or_else(Vec::new, |curve: &Curve| curve.x.clone()),
            y: changes.last().map_or_else(Vec::new, |curve| vec![evidence.room; curve.x.len()]),
            label: format!("room, {}", way.name()),
            at: [30.0, evidence.room],
        }));
    }
    // Guides do not widen an axis.
    let widest = rooms.iter().flat_map(|room: &Guide| room.y.first()).copied().fold(0.0, f64::max);
    let largest = changes.iter().flat_map(|curve: &Curve| &curve.y).copied().fold(widest, f64::max);
    let panel = |title: &str, curves: Vec<Curve>, guides: Vec<Guide>| Panel {
        title: title.into(),
        x: Axis { log: true, ..axis("frequency", "Hz") },
        y: Axis {
            log: true,
            range: (!guides.is_empty()).then_some([1e-4 * largest, 2.0 * largest]),
            ..axis("largest gain", "")
        },
        content: Content::Curves(curves),
        guides,
        ..Panel::default()
    };
    Ok(Figure {
        key: "deviation".into(),
        title: "S over speed".into(),
        caption: "Largest gain of S, from alpha to beta, at the points and of its change between them; dashed what it may depart from the \
                  line between the points."
            .into(),
        panels: vec![panel("S at the points", at_points, Vec::new()), panel("change of S", changes, rooms)],
        ..Figure::default()
    })
}

fn gain(method: String, system: &StateSpace<Discrete>) -> Result<Curve> {
    let nyquist = 0.5 / system.time().ts();
    let hz: Vec<f64> = (0..400).map(|k| nyquist * 10_f64.powf(-2.5 + 2.5 * f64::from(k) / 400.0)).collect();
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let gains = frequency_response(system, &omega)?.gains()?;
    let y = gains.iter().map(|g| g.first().copied().unwrap_or(f64::NAN)).collect();
    Ok(Curve { method, x: hz, y, ..Curve::default() })
}
