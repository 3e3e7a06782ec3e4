//! `youla commission`: the circle of commissioning on the twin of the gas bearing.

use crate::output::{Failure, Form, ask_line};
use crate::run_folder::place;
use clap::Args;
use std::path::PathBuf;
use youla_commission::{CampaignSummary, Operator, PointStatus, commission};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla commission examples/commission/campaign.toml --yes --out bearing";

/// Arguments of `youla commission`.
#[derive(Debug, Args)]
pub(crate) struct CommissionArgs {
    /// The campaign: machine, limits, goal, operating points.
    campaign: PathBuf,
    /// Folder of the results; an unfinished campaign there is resumed.
    #[arg(long, value_parser = place())]
    out: PathBuf,
    /// Switch without asking a person; with --json nobody is asked, and nothing is switched without it.
    #[arg(long)]
    yes: bool,
}

/// The person at the terminal.
struct Terminal {
    form: Form,
    yes: bool,
}

impl Operator for Terminal {
    fn confirms(&mut self, text: &str) -> bool {
        if self.yes {
            self.notes(text);
            return true;
        }
        if self.form.json {
            return false;
        }
        let mut answer = String::new();
        // Without a terminal nobody confirms.
        ask_line(&format!("{text} [y/N]")).is_ok()
            && std::io::stdin().read_line(&mut answer).is_ok()
            && matches!(answer.trim(), "y" | "Y" | "yes")
    }

    fn notes(&mut self, text: &str) {
        if !self.form.json {
            // Without an output the campaign goes on.
            let _ = self.form.print(|| serde_json::Value::Null, || text.to_owned());
        }
    }
}

/// Whether every point is done.
pub(crate) fn run(form: Form, args: &CommissionArgs) -> Result<bool, Failure> {
    let mut terminal = Terminal { form, yes: args.yes };
    let summary = commission(&args.campaign, &args.out, &mut terminal)?;
    form.print(|| serde_json::json!(summary), || sentences(&summary, args))?;
    Ok(summary.done)
}

fn sentences(summary: &CampaignSummary, args: &CommissionArgs) -> String {
    let mut text = format!("Controller: {}.", summary.controller);
    for point in &summary.points {
        text += &match (point.status, point.before, point.predicted, point.reached) {
            (PointStatus::Done, Some(before), Some(predicted), Some(reached)) => format!(
                "\n{}: least damping {:.3} before, {:.3} to {:.3} predicted, {:.3} reached.",
                point.name, before.damping, predicted.bounds[0], predicted.bounds[1], reached.damping
            ),
            (status, ..) => {
                let what = if status == PointStatus::Fallback { "Q was taken back" } else { "stopped" };
                format!("\n{}: {what}: {}.", point.name, point.reason.as_deref().unwrap_or("no reason is known"))
            }
        };
    }
    format!("{text}\nReport: {}", args.out.join("report.html").display())
}
