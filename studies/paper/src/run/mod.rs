//! `youla paper`: the whole paper in one results folder, resumable, in parts if need be.

pub(super) mod configuration;
mod merge;
pub(super) mod results;

pub use configuration::Configuration;
pub use merge::merge;

use crate::story::{Claim, paper_claims};
use crate::study::{
    CampaignOutcome, Evaluated, Item, Paper, PaperSettings, PaperTiming, RowStatus, StudyCampaign, StudyMethod,
    StudyRow, crossover, crossover_items, evaluate, experiments, monte_carlo,
};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::Instant;
use youla::lti::Discrete;

/// A stage of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PaperStage {
    /// The loops of Figs 4 and 5.
    Study,
    /// The loops of the crossover map.
    Crossover,
    /// Nominal model and Table 1.
    Experiments,
    /// Figures, tables and the page.
    Report,
}

impl PaperStage {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            PaperStage::Study => "study",
            PaperStage::Crossover => "crossover map",
            PaperStage::Experiments => "experiments",
            PaperStage::Report => "report",
        }
    }
}

/// Events of a run.
#[derive(Debug, Clone, Copy)]
pub enum PaperProgress<'a> {
    /// A stage begins; the number of its loops, of which some may be done already.
    Begins(PaperStage, usize),
    /// Loops of the stage that are done.
    Done(usize),
    /// A file of an earlier call was continued: loops found, and damaged or incomplete rows that are computed again.
    Continued {
        /// The file.
        path: &'a Path,
        /// Loops that were complete.
        loops: usize,
        /// Rows that are computed again.
        redone: usize,
    },
}

/// A finished results folder.
#[derive(Debug, Clone)]
pub struct WrittenPaper {
    /// Where it is.
    pub folder: PathBuf,
    /// Everything, unless only a part was asked for.
    pub paper: Option<Paper>,
    /// Whether the claims of the paper come out.
    pub claims: Vec<Claim>,
}

/// Computes the paper into `target`: the loops of study and map as far as they are not there yet, then the experiments,
/// then figures, tables, summary and page from the results. A part of the paper is only its share of the loops.
///
/// Results do not depend on threads, interruptions and parts; `timing.json` and the timing on the page do.
///
/// # Errors
/// [`Error::OtherSettings`] naming the difference where the folder belongs to another configuration, [`youla_io::Error::OutputExists`]
/// where it holds something else; those of the stages, with what has been computed kept.
pub fn paper(
    configuration: &Configuration,
    target: &Path,
    notify: &(dyn Fn(PaperProgress<'_>) + Sync),
) -> Result<WrittenPaper> {
    configuration.check()?;
    configuration.claim(target)?;
    let mut clock = Clock::default();
    let study = clock.stage(PaperStage::Study, || study_loops(configuration, target, notify))?;
    let map = clock.stage(PaperStage::Crossover, || map_loops(configuration, target, notify))?;
    if !configuration.shard.is_whole() {
        return Ok(WrittenPaper { folder: target.to_owned(), paper: None, claims: Vec::new() });
    }
    notify(PaperProgress::Begins(PaperStage::Experiments, 0));
    let Configuration { settings, rig, .. } = configuration;
    let found = clock.stage(PaperStage::Experiments, || experiments(rig, settings))?;
    notify(PaperProgress::Begins(PaperStage::Report, 0));
    let timing = clock.timing(settings, &[&study, &map]);
    let (settings, rig) = (settings.clone(), rig.clone());
    let mut paper = Paper { settings, rig, study: study.rows, crossover: map.rows, experiments: found, timing };
    let start = Instant::now();
    results::write_figures(&paper, target)?;
    paper.timing.stages.push((PaperStage::Report.name().into(), start.elapsed().as_secs_f64()));
    results::write_page(&paper, target)?;
    Ok(WrittenPaper { folder: target.to_owned(), claims: paper_claims(&paper), paper: Some(paper) })
}

fn study_loops(
    configuration: &Configuration,
    target: &Path,
    notify: &(dyn Fn(PaperProgress<'_>) + Sync),
) -> Result<CampaignOutcome> {
    let Configuration { settings, rig, .. } = configuration;
    let noise = rig.sensor.noise.value;
    let evaluate = |index: usize| {
        let item = monte_carlo(settings, noise, index);
        let theta = item.theta;
        evaluate_item(&item, configuration).map_err(|e| e.within(format!("model {} (theta {theta:.3})", index + 1)))
    };
    run_campaign(PaperStage::Study, configuration, target, settings.study.models, evaluate, notify)
}

fn map_loops(
    configuration: &Configuration,
    target: &Path,
    notify: &(dyn Fn(PaperProgress<'_>) + Sync),
) -> Result<CampaignOutcome> {
    let settings = &configuration.settings;
    let evaluate = |index: usize| {
        let item = crossover(settings, index);
        match evaluate_item(&item, configuration) {
            Err(Error::NoController { .. }) => Ok(without_controller(&item, settings)),
            other => other,
        }
    };
    run_campaign(PaperStage::Crossover, configuration, target, crossover_items(settings), evaluate, notify)
}

fn evaluate_item(item: &Item, configuration: &Configuration) -> Result<Evaluated> {
    let Configuration { settings, rig, .. } = configuration;
    let time = Discrete::new(rig.timing.sample_time.value)?;
    evaluate(item, &rig.bearing.model(), time, settings)
}

/// The rows of a cell of the map in which no controller keeps the margin.
fn without_controller(item: &Item, settings: &PaperSettings) -> Evaluated {
    let row = |method: StudyMethod| StudyRow {
        item: item.index,
        theta: item.theta,
        noise: item.noise,
        command_weight: item.command_weights[0],
        peak_nominal: f64::NAN,
        peak_plant: f64::NAN,
        method,
        status: RowStatus::NoController,
        fit: [f64::NAN; 2],
        steps: None,
        note: String::new(),
    };
    Evaluated { rows: settings.compared().map(row).collect(), durations: Vec::new() }
}

fn run_campaign(
    stage: PaperStage,
    configuration: &Configuration,
    target: &Path,
    total: usize,
    evaluate: impl Fn(usize) -> Result<Evaluated> + Sync,
    notify: &(dyn Fn(PaperProgress<'_>) + Sync),
) -> Result<CampaignOutcome> {
    let file = match stage {
        PaperStage::Study => results::STUDY,
        _ => results::CROSSOVER,
    };
    let campaign = StudyCampaign {
        path: target.join(file),
        items: configuration.shard.items(total),
        rows_per_item: configuration.settings.compared().count(),
    };
    notify(PaperProgress::Begins(stage, campaign.items.len()));
    let continued = |loops: usize, redone: usize| {
        if loops + redone > 0 {
            notify(PaperProgress::Continued { path: &campaign.path, loops, redone });
        }
    };
    campaign.run(evaluate, &continued, &|done| notify(PaperProgress::Done(done)))
}

/// Wall time per stage.
#[derive(Default)]
struct Clock(Vec<(String, f64)>);

impl Clock {
    fn stage<T>(&mut self, stage: PaperStage, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.0.push((stage.name().into(), start.elapsed().as_secs_f64()));
        result
    }

    fn timing(&self, settings: &PaperSettings, outcomes: &[&CampaignOutcome]) -> PaperTiming {
        let loops: usize = outcomes.iter().map(|o| o.computed).sum();
        let mean = |part: usize| {
            let seconds: f64 = outcomes.iter().filter_map(|o| o.durations.get(part)).map(|d| d.as_secs_f64()).sum();
            if loops == 0 { 0.0 } else { 1e3 * seconds / loops as f64 }
        };
        PaperTiming {
            threads: rayon::current_num_threads(),
            stages: self.0.clone(),
            loops,
            loop_ms: mean(0),
            method_ms: settings.compared().enumerate().map(|(k, method)| (method, mean(k + 1))).collect(),
        }
    }
}
