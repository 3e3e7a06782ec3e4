//! report.html: the campaign as one page.

mod figures;
mod tables;

use crate::Result;
use crate::campaign::Campaign;
use crate::record::{CampaignSummary, PointRecord, PointStatus};
use crate::rehearse::LEVEL;
use std::path::Path;
use youla_report::data::{DrawnMethod, MethodRole};
use youla_report::story::{Block, Section, Story, section};
use youla_report::story_html;

/// Keys of what figures and tables show.
const BEFORE: &str = "before";
const PREDICTED: &str = "predicted";
const REACHED: &str = "reached";
const HALFWAY: &str = "halfway";

/// The page; figures of S come from the folders of the points in `out`.
///
/// # Errors
/// Files of the points; those of the page.
pub(crate) fn report(campaign: &Campaign, summary: &CampaignSummary, out: &Path) -> Result<String> {
    let mut sections = vec![points(summary)];
    if summary.points.iter().any(|point| !point.modes.is_empty()) {
        let blocks = vec![Block::Figure(figures::campbell(campaign, summary)), Block::Table(tables::modes(summary))];
        sections.push(section("modes", "Identified modes over speed", "Modes", blocks));
    }
    if !summary.between.is_empty() {
        sections.push(between(summary, out)?);
    }
    let ended = |status: PointStatus| summary.points.iter().filter(|p| p.status == status).count();
    Ok(story_html(&Story {
        title: format!("Commissioning of {}", summary.name),
        summary: format!(
            "{} of {} operating points done, {} unstable switches. The controller ran on: {}.",
            ended(PointStatus::Done),
            campaign.points.len(),
            summary.unstable_switches,
            summary.controller
        ),
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        methods: methods(summary),
        sections,
    })?)
}

fn methods(summary: &CampaignSummary) -> Vec<DrawnMethod> {
    let fixed = [
        (BEFORE, "before", MethodRole::Nominal),
        (PREDICTED, "predicted", MethodRole::Hansen),
        (REACHED, "reached", MethodRole::Recommended),
        (HALFWAY, "halfway between points, reached", MethodRole::Direct),
    ];
    let fixed = fixed.into_iter().map(|(key, label, role)| DrawnMethod::new(key, label, role));
    let of_points =
        summary.points.iter().map(|p| DrawnMethod::new(figures::key(&p.name), p.name.clone(), MethodRole::Other));
    let of_ways =
        summary.between.iter().map(|way| DrawnMethod::new(figures::way_key(way), way.name(), MethodRole::Other));
    fixed.chain(of_points).chain(of_ways).collect()
}

fn points(summary: &CampaignSummary) -> Section {
    let mut blocks = vec![
        Block::Figure(figures::damping(summary)),
        Block::Table(tables::points(summary)),
        Block::Text(format!(
            "Damping and sensitivity before and reached are measured: the loop from a disturbance at the plant input to the outputs is \
             identified from the excitation. The prediction holds the measurement with a probability of {:.0} %.",
            100.0 * LEVEL
        )),
    ];
    let of_points = summary.points.iter().filter_map(|p| Some((&p.name, p.reason.as_ref()?)));
    let of_ways = summary.between.iter().filter_map(|b| Some((b.name(), b.reason.as_ref()?)));
    let reasons: Vec<String> = of_points
        .map(|(name, reason)| format!("{name}: {reason}."))
        .chain(of_ways.map(|(name, reason)| format!("{name}: {reason}.")))
        .collect();
    if !reasons.is_empty() {
        blocks.insert(0, Block::List(reasons));
    }
    let recorded = |p: &&PointRecord| p.seconds > 0.0;
    let reports = summary.points.iter().filter(recorded);
    let reports = reports.map(|p| format!("{}: {}/identification/report.html", p.name, p.name)).collect();
    blocks.extend([Block::Text("Reports of the identifications, beside this page:".into()), Block::List(reports)]);
    section("points", "Damping and sensitivity", "Points", blocks)
}

fn between(summary: &CampaignSummary, out: &Path) -> Result<Section> {
    let blocks = vec![
        Block::Text(
            "Between two points Q is the mean of both, weighed by the speed. The loop is stable for each mean of both Q with each mean of \
             both S, by the small-gain theorem; what is left is the room for a departure of the unknown S from the line between the points. \
             The speed must change slowly beside the loop."
                .into(),
        ),
        Block::Figure(figures::deviation(summary, out)?),
        Block::Table(tables::between(summary)),
    ];
    Ok(section("between", "Q over speed", "Q over speed", blocks))
}
