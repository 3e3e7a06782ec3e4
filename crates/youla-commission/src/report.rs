//! report.md: the table of a campaign.

use crate::record::{CampaignSummary, PointRecord, PointStatus};
use crate::rehearse::LEVEL;

/// The report as Markdown.
pub(crate) fn report(summary: &CampaignSummary) -> String {
    let mut text = format!("# Commissioning of {}\n\n", summary.name);
    text += &format!(
        "Controller: {}. {} of {} points done, {} unstable switches.\n\n",
        summary.controller,
        summary.points.iter().filter(|p| p.status == PointStatus::Done).count(),
        summary.points.len(),
        summary.unstable_switches
    );
    text += "| point | status | record, s | excitation | least damping before | predicted | reached | peak sensitivity before | predicted | reached | order of Q |\n";
    text += "|---|---|---|---|---|---|---|---|---|---|---|\n";
    summary.points.iter().for_each(|point| text += &row(point));
    text += &format!(
        "\nDamping and sensitivity before and reached are measured: the loop from a disturbance at the plant input to the outputs is \
         identified from the excitation. The prediction holds the measurement with a probability of {:.0} %.\n",
        100.0 * LEVEL
    );
    for PointRecord { name, seconds, .. } in &summary.points {
        if *seconds > 0.0 {
            text += &format!("\n[Identification at {name}](<{name}/identification/report.html>)\n");
        }
    }
    for point in &summary.points {
        if let Some(reason) = &point.reason {
            text += &format!("\n{}: {reason}.\n", point.name);
        }
    }
    text
}

fn row(point: &PointRecord) -> String {
    let number = |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
    let status = match point.status {
        PointStatus::Done => "done",
        PointStatus::Fallback => "fallback",
        PointStatus::Stopped => "stopped",
    };
    let bounds = point.predicted.map_or("-".into(), |p| format!("{:.4} to {:.4}", p.bounds[0], p.bounds[1]));
    let order = point.q_order.map_or("-".into(), |order| order.to_string());
    let cells = [
        point.name.clone(),
        status.into(),
        number(Some(point.seconds), 1),
        number(Some(point.amplitude), 3),
        number(point.before.map(|s| s.damping), 4),
        bounds,
        number(point.reached.map(|s| s.damping), 4),
        number(point.before.map(|s| s.sensitivity), 2),
        number(point.predicted.map(|p| p.sensitivity), 2),
        number(point.reached.map(|s| s.sensitivity), 2),
        order,
    ];
    format!("| {} |\n", cells.join(" | "))
}
