//! The simulation study and the crossover map.

use crate::story::claims::Claim;
use crate::story::words::{count, range, short};
use crate::story::{claims_study, figures_study, map as crossover, tables_study};
use crate::study::{Paper, StudyMethod, StudyRow};
use youla_report::story::section;
use youla_report::story::{Block, Section};

/// The claims as points.
pub(in crate::story) fn points(claims: Vec<Claim>) -> Block {
    Block::List(
        claims.into_iter().map(|c| format!("{}: {} Here it {}. {}", c.source, c.claim, verdict(&c), c.text)).collect(),
    )
}

fn verdict(claim: &Claim) -> &'static str {
    use crate::story::claims::ClaimOutcome::{Fails, Holds, Partly, Unknown};
    match claim.outcome {
        Holds => "comes out",
        Partly => "comes out in part",
        Fails => "does not come out",
        Unknown => "is not shown",
    }
}

/// Figures 4 and 5.
pub(in crate::story) fn study(paper: &Paper) -> Section {
    let s = &paper.settings.study;
    let loops = format!(
        "{} are drawn with theta uniform from {}: A_model = (1 - theta) A before discretisation (27), which scales the poles by \
         1 - theta and the static gain by 1 / (1 - theta). Each gets its controller, a closed-loop record of {} with \
         white output noise of {} um rms, and a verification record of {} without noise; all methods see the same \
         records.",
        count(s.models, "nominal model", "nominal models"),
        range(s.theta),
        count(s.samples, "sample", "samples"),
        short(paper.rig.sensor.noise.value, 3),
        count(s.verification_samples, "sample", "samples")
    );
    let failed = "No loop is dropped. A loop counts as failed for a method that finds no model, an unstable one, or one that \
                  has a poor fit. In the figures fits below the axis are drawn at its edge, and loops without a model there in a shape \
                  of their own; in medians and quartiles they count as the lowest.";
    let mut blocks = vec![
        Block::Text(loops),
        Block::Text(failed.into()),
        Block::Figure(figures_study::figure_4(paper)),
        Block::Figure(figures_study::figure_5(paper)),
        points(claims_study::claims(paper)),
        Block::Table(tables_study::sums(paper)),
        Block::Table(tables_study::medians(paper)),
        Block::Table(tables_study::failures(paper)),
    ];
    blocks.extend(where_pem_arrives(paper).map(Block::Text));
    section("study", "Simulation study", "Study", blocks)
}

/// How PEM compares in the loops in which it leaves a usable model.
fn where_pem_arrives(paper: &Paper) -> Option<String> {
    let usable: Vec<&StudyRow> = paper.study.iter().filter(|r| r.method == StudyMethod::Pem && !r.failed()).collect();
    let rivals = |p: &StudyRow| {
        let other = |r: &&StudyRow| {
            r.item == p.item
                && matches!(r.method, StudyMethod::Direct | StudyMethod::Hansen | StudyMethod::HansenReduced)
        };
        paper.study.iter().filter(other).map(StudyRow::worse_fit).fold(f64::NEG_INFINITY, f64::max)
    };
    let best = usable.iter().filter(|p| p.worse_fit() >= rivals(p)).count();
    (!usable.is_empty()).then(|| {
        format!(
            "PEM here is the output-error method, whose white noise is that of these records, with at most {} steps from the nominal \
             model. In the {} in which it leaves a usable model it has the highest fit of the worse axis in {best}; \
             elsewhere its search stops in a local minimum or on the way.",
            paper.settings.pem.max_iterations,
            count(usable.len(), "loop", "loops")
        )
    })
}

/// Which method under which conditions.
pub(in crate::story) fn map(paper: &Paper) -> Section {
    let grid = &paper.settings.crossover;
    let text = format!(
        "The paper asks under which conditions each method should be used. A single box plot cannot say: direct identification is \
         biased by noise that is fed back, the more so the stronger noise and feedback are, PEM needs a start near the plant, and \
         the Hansen scheme pays with more parameters. The map has {} of {} each, with the records of the study.",
        count(grid.noise.len() * grid.theta.len() * grid.command_weights.len(), "cell", "cells"),
        count(grid.repetitions, "loop", "loops")
    );
    let blocks = vec![
        Block::Text(text),
        Block::Figure(crossover::figure(paper)),
        Block::List(crossover::sentences(paper)),
        Block::Figure(crossover::figure_of_subspace(paper)),
        Block::Table(crossover::table(paper)),
    ];
    section("map", "Which method under which conditions", "Crossover map", blocks)
}
