//! The page.

use super::claims::paper_claims;
use super::sections::{experiments, rig, settings, study, timing};
use super::tables::{plain, row};
use super::words::{count, short};
use crate::Result;
use crate::study::{Paper, StudyMethod};
use youla_report::data;
use youla_report::figure::Figure;
use youla_report::story::{Block, Section, Story, Table, section};

/// The section whose tables differ from run to run.
const TIMING: &str = "timing";

/// The methods of the page in the order in which they are listed and drawn.
pub fn story_methods() -> Vec<data::DrawnMethod> {
    StudyMethod::ALL.into_iter().map(drawn).collect()
}

fn drawn(method: StudyMethod) -> data::DrawnMethod {
    match method {
        StudyMethod::Nominal => data::DrawnMethod::nominal(),
        StudyMethod::Pem => data::DrawnMethod::pem(),
        StudyMethod::PemMultiStart => data::DrawnMethod::pem_multi_start(),
        StudyMethod::Direct => data::DrawnMethod::direct(),
        StudyMethod::Hansen => data::DrawnMethod::hansen(),
        StudyMethod::HansenReduced => data::DrawnMethod::hansen_reduced(),
        StudyMethod::HansenPem => data::DrawnMethod::hansen_pem(),
        StudyMethod::Auto => data::DrawnMethod::new(method.key(), method.label(), data::MethodRole::Recommended),
    }
}

/// The whole page, figures and tables in place.
///
/// # Errors
/// Those of the modes of the nominal model and of the rig, and of the harmonics of a record that is too short.
pub fn paper_story(paper: &Paper) -> Result<Story> {
    let settings = &paper.settings;
    Ok(Story {
        title: "Closed-loop identification of a gas bearing, reproduced".into(),
        summary: format!(
            "The study of {}, the three experiments and every figure and table of the paper, computed on a digital twin of the \
             rig from the paper's description alone, with seed {}. Published numbers are given beside ours.",
            count(settings.study.models, "nominal model", "nominal models"),
            settings.seed
        ),
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        methods: story_methods(),
        sections: vec![
            brief(paper),
            rig::rig(paper),
            rig::controller(paper),
            rig::nominal(paper)?,
            study::study(paper),
            study::map(paper),
            experiments::experiments(paper)?,
            experiments::reduction(paper)?,
            timing::timing(paper, TIMING),
            settings::settings(paper),
        ],
    })
}

/// The figures of the page in its order.
///
/// # Errors
/// Those of [`paper_story`].
pub fn paper_figures(paper: &Paper) -> Result<Vec<Figure>> {
    let blocks = paper_story(paper)?.sections.into_iter().flat_map(|s| s.blocks);
    Ok(blocks.filter_map(|b| if let Block::Figure(figure) = b { Some(figure) } else { None }).collect())
}

/// The tables of the page in its order, without those that hold times: the same paper gives the same tables.
///
/// # Errors
/// Those of [`paper_story`].
pub fn paper_tables(paper: &Paper) -> Result<Vec<Table>> {
    let sections = paper_story(paper)?.sections.into_iter().filter(|s| s.key != TIMING);
    let blocks = sections.flat_map(|s| s.blocks);
    Ok(blocks.filter_map(|b| if let Block::Table(table) = b { Some(table) } else { None }).collect())
}

/// What the paper claims and whether it comes out.
fn brief(paper: &Paper) -> Section {
    let rows = paper_claims(paper)
        .into_iter()
        .map(|c| row([c.source.to_owned(), c.claim.to_owned(), c.outcome.words().to_owned()]));
    let table = plain(
        "claims",
        "Claims of the paper",
        "Each claim of the paper and whether it is reproduced; the numbers are in the sections below.",
        &["source", "claim", "here"],
        rows.collect(),
    );
    let text = format!(
        "The paper compares three ways to identify a gas bearing while its controller runs: prediction error with a physical \
         structure (PEM), subspace identification of the plant itself (direct), and subspace identification of the Youla \
         deviation system S (modified Hansen scheme). Its data are not public, so a digital twin replaces the rig. Every \
         verdict below is computed from the results of this run, with sensor noise of {} um rms; models are compared by the \
         fit (26), in percent, of the output that they simulate from the input alone.",
        short(paper.rig.sensor.noise.value, 3)
    );
    section("brief", "In brief", "In brief", vec![Block::Text(text), Block::Table(table)])
}
