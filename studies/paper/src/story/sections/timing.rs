//! How long it took.

use crate::story::tables::{method_row, plain, row};
use crate::story::tables_experiments::seconds;
use crate::story::words::{count, short};
use crate::study::{Paper, StudyMethod};
use youla_report::story::section;
use youla_report::story::{Block, Section};

/// The stages, and one loop and method on average.
pub(in crate::story) fn timing(paper: &Paper, key: &str) -> Section {
    let t = &paper.timing;
    let text = format!(
        "Times of this call on {}; what an earlier call had found is not in them. {}",
        count(t.threads, "thread", "threads"),
        comparison(paper)
    );
    let stages = plain(
        "stages",
        "Stages",
        "Wall time of each stage of this call.",
        &["stage", "s"],
        t.stages.iter().map(|(name, seconds)| row([name.clone(), format!("{seconds:.2}")])).collect(),
    );
    let design = row(["controller and records".to_owned(), format!("{:.1}", t.loop_ms)]);
    let methods = t.method_ms.iter().map(|(m, ms)| method_row(*m, [m.label().to_owned(), format!("{ms:.1}")]));
    let loops = plain(
        "loop-timing",
        "One loop of study and map",
        format!(
            "Mean processor time per part, over {} of this call. What a method shares with one above it counts there.",
            count(t.loops, "loop", "loops")
        ),
        &["part", "ms"],
        std::iter::once(design).chain(methods).collect(),
    );
    section(
        key,
        "Timing",
        "Timing",
        vec![Block::Text(text), Block::Table(stages), Block::Table(loops), Block::Table(seconds(paper))],
    )
}

/// What the paper says of the time of PEM, and what it takes here.
fn comparison(paper: &Paper) -> String {
    let says = "The paper says that PEM takes considerably longer than the identification of S";
    let ms = |m: StudyMethod| paper.timing.method_ms.iter().find(|(method, _)| *method == m).map(|(_, ms)| *ms);
    let seconds = |m: StudyMethod| {
        let models = paper.experiments.list.iter().flat_map(|e| &e.models);
        models.filter(|found| found.method == m).map(|found| found.seconds).sum::<f64>()
    };
    let experiments = format!(
        "in the three experiments PEM takes {} s together and the Hansen scheme {} s",
        short(seconds(StudyMethod::Pem), 2),
        short(seconds(StudyMethod::Hansen), 2)
    );
    match (ms(StudyMethod::Pem), ms(StudyMethod::Hansen)) {
        (Some(pem), Some(hansen)) if hansen > 0.0 && paper.timing.loops > 0 => {
            let verdict = match pem / hansen {
                ratio if ratio >= 2.0 => "this comes out",
                ratio if ratio > 1.0 => "it takes longer, though not considerably",
                _ => "this does not come out",
            };
            format!(
                "{says}: {verdict}, a loop of the study takes {} ms by PEM and {} ms by the Hansen scheme, and {experiments}.",
                short(pem, 3),
                short(hansen, 3)
            )
        }
        _ => format!("{says}; {experiments}."),
    }
}
