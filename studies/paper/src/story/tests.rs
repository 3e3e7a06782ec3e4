//! The page from three short real experiments and rows made by hand.

use super::*;
use crate::study::{
    Experiments, Paper, PaperSettings, PaperTiming, RowStatus, StudyMethod, StudyRow, crossover, crossover_items,
    experiments,
};
use std::collections::BTreeSet;
use std::sync::OnceLock;
use youla_report::figure::{Content, MEASURED};
use youla_report::story::{Block, Story, Table};
use youla_twin::rig::RigParameters;

const MODELS: usize = 40;

fn settings() -> PaperSettings {
    let mut settings = PaperSettings::shipped().with_models(MODELS);
    let e = &mut settings.experiments;
    (e.samples, e.verification_samples, e.settle, e.start_factors) = (1500, 1200, 100, vec![0.5, 2.0]);
    (settings.hansen.horizon, settings.pem.max_iterations) = (15, 10);
    settings
}

fn shared_experiments() -> Experiments {
    static FOUND: OnceLock<Experiments> = OnceLock::new();
    FOUND.get_or_init(|| experiments(&RigParameters::shipped(), &settings()).unwrap()).clone()
}

fn row(item: usize, theta: f64, method: StudyMethod, fit: Option<f64>) -> StudyRow {
    StudyRow {
        item,
        theta,
        noise: 0.2,
        command_weight: 10.0,
        peak_nominal: 1.5,
        peak_plant: 2.0,
        method,
        status: if fit.is_some() { RowStatus::Stable } else { RowStatus::Refused },
        fit: fit.map_or([f64::NAN; 2], |f| [f, f - 1.0]),
        steps: None,
        note: String::new(),
    }
}

/// Rows of the study from the fit of each method at theta; `None` is no model.
fn study(fit: impl Fn(StudyMethod, f64) -> Option<f64>) -> Vec<StudyRow> {
    let methods = [StudyMethod::Nominal, StudyMethod::Pem, StudyMethod::Direct, StudyMethod::Hansen];
    let one = |k: usize| (k, (k as f64 + 0.5) / MODELS as f64);
    (0..MODELS).map(one).flat_map(|(k, theta)| methods.map(|m| row(k, theta, m, fit(m, theta)))).collect()
}

/// PEM fails from theta = 0.6 on, Hansen once, direct identification is best.
fn as_found(method: StudyMethod, theta: f64) -> Option<f64> {
    match method {
        StudyMethod::Nominal => Some(100.0 - 300.0 * theta),
        StudyMethod::Pem => Some(if theta < 0.6 { 98.0 } else { -20.0 }),
        StudyMethod::Direct => Some(97.0 + theta),
        _ => (!(0.25..0.275).contains(&theta)).then_some(95.0),
    }
}

/// Hansen overtakes direct identification from a noise of 0.5 um on; with strong feedback there is no loop above theta = 0.1.
fn map_rows(settings: &PaperSettings) -> Vec<StudyRow> {
    let loops = (0..crossover_items(settings)).map(|k| crossover(settings, k));
    loops
        .flat_map(|item| {
            let none = item.command_weights[0] < 2.0 && item.theta > 0.2;
            let lead = if item.noise >= 0.5 { 8.0 } else { 0.5 };
            [(StudyMethod::Direct, 80.0), (StudyMethod::Hansen, 80.0 + lead)].map(|(method, fit)| {
                let status = if none { RowStatus::NoController } else { RowStatus::Stable };
                StudyRow { status, ..row(item.index, item.theta, method, (!none).then_some(fit)) }
            })
        })
        .collect()
}

fn paper(study: Vec<StudyRow>) -> Paper {
    let settings = settings();
    Paper {
        crossover: map_rows(&settings),
        settings,
        rig: RigParameters::shipped(),
        study,
        experiments: shared_experiments(),
        timing: PaperTiming::default(),
    }
}

fn table(tables: &[Table], key: &str) -> Table {
    tables.iter().find(|t| t.key == key).unwrap_or_else(|| panic!("no table {key}")).clone()
}

fn outcome(paper: &Paper, key: &str) -> ClaimOutcome {
    paper_claims(paper).into_iter().find(|c| c.key == key).unwrap().outcome
}

#[test]
fn every_loop_is_counted_once() {
    let tables = paper_tables(&paper(study(as_found))).unwrap();
    let failures = table(&tables, "study-failures");
    let number = |text: &String| text.parse::<usize>().unwrap();
    for line in &failures.rows {
        let loops = number(&line.cells[1]);
        for method in line.cells[2..].chunks(4) {
            assert_eq!(method.iter().map(number).sum::<usize>(), loops, "{line:?}");
        }
    }
    let loops: usize = failures.rows[..10].iter().map(|line| number(&line.cells[1])).sum();
    assert_eq!((loops, number(&failures.rows[10].cells[1])), (MODELS, MODELS));
    let sums = table(&tables, "study-sums");
    assert!(sums.rows.len() == 3 && sums.rows.iter().all(|line| line.cells[5] == MODELS.to_string()));
    assert_eq!(sums.rows[0].cells[1..5], ["24", "0", "0", "16"]);
    assert_eq!(sums.rows[2].cells[1..5], ["39", "1", "0", "0"]);
}

#[test]
fn tables_are_rectangles() {
    for table in paper_tables(&paper(study(as_found))).unwrap() {
        let width = table.header.len();
        assert!(table.rows.iter().all(|line| line.cells.len() == width), "{}", table.key);
        let grouped: usize = table.groups.iter().map(|(_, columns)| columns).sum();
        assert!(table.groups.is_empty() || grouped == width, "{}", table.key);
    }
}

#[test]
fn table_1_has_the_numbers_of_the_paper() {
    let printed = table(&paper_tables(&paper(study(as_found))).unwrap(), "table-1");
    let theirs: Vec<Vec<String>> =
        printed.rows.iter().filter(|line| line.cells[0] == "paper").map(|line| line.cells[1..].to_vec()).collect();
    let expected = [
        ["51.36", "54.13", "3.19", "3.00", "83.21", "76.12"],
        ["62.87", "75.78", "48.91", "39.47", "83.90", "84.63"],
        ["61.94", "69.19", "76.76", "83.58", "83.53", "81.18"],
        ["60.71", "69.33", "76.73", "83.53", "83.07", "79.59"],
    ];
    assert_eq!(theirs, expected);
    let ours: Vec<&str> =
        printed.rows.iter().filter(|line| line.cells[0] != "paper").map(|line| line.method.as_str()).collect();
    assert_eq!(ours, ["nominal", "pem", "pem_multi_start", "hansen", "hansen_reduced", "hansen_pem", ""]);
}

#[test]
fn figures_are_complete() {
    let figures = paper_figures(&paper(study(as_found))).unwrap();
    let keys: Vec<&str> = figures.iter().map(|f| f.key.as_str()).collect();
    let expected = [
        "excitation-spectrum",
        "controllers",
        "figure-4",
        "figure-5",
        "crossover-map",
        "crossover-map-subspace",
        "figure-6",
        "figure-7",
        "figure-8",
        "figure-9",
        "figure-10",
        "pem-starts",
    ];
    assert_eq!(keys, expected);
    let known: BTreeSet<String> = story_methods().into_iter().map(|m| m.key).chain([MEASURED.into()]).collect();
    for figure in &figures {
        assert!(figure.caption.ends_with('.'), "{}", figure.key);
        for panel in &figure.panels {
            let methods = methods_of(&panel.content);
            assert!(methods.is_subset(&known), "{}: {methods:?}", figure.key);
            let expected: &[&str] = match figure.key.as_str() {
                "figure-4" => &["hansen", "pem"],
                "figure-5" => &["direct", "hansen"],
                "figure-8" => &["hansen", "measured"],
                "figure-6" | "figure-7" | "figure-9" | "figure-10" => &["hansen", "measured", "nominal", "pem"],
                _ => continue,
            };
            assert_eq!(methods.iter().map(String::as_str).collect::<Vec<_>>(), expected, "{}", figure.key);
        }
    }
    assert_eq!(figures.iter().map(|f| f.panels.len()).collect::<Vec<_>>(), [1, 3, 2, 2, 3, 3, 2, 2, 2, 2, 2, 3]);
}

/// Keys of what a panel draws; every curve has as many values as places.
fn methods_of(content: &Content) -> BTreeSet<String> {
    match content {
        Content::Curves(curves) => {
            assert!(curves.iter().all(|c| c.x.len() == c.y.len() && !c.x.is_empty()));
            assert!(curves.iter().all(|c| c.x.windows(2).all(|pair| pair[0] <= pair[1])));
            curves.iter().map(|c| c.method.clone()).collect()
        }
        Content::Boxes(samples) => {
            assert!(samples.iter().all(|s| s.values.len() == MODELS));
            samples.iter().map(|s| s.method.clone()).collect()
        }
        Content::Cells(cells) => {
            assert_eq!(cells.cells.len(), cells.columns.len() * cells.rows.len());
            cells.cells.iter().map(|c| c.method.clone()).filter(|m| !m.is_empty()).collect()
        }
    }
}

#[test]
fn verdicts_follow_the_rows() {
    let found = paper(study(as_found));
    assert_eq!(outcome(&found, "figure-4-small"), ClaimOutcome::Holds);
    assert_eq!(outcome(&found, "figure-4-large"), ClaimOutcome::Holds);
    assert_eq!(outcome(&found, "figure-5-mean"), ClaimOutcome::Fails);
    assert_eq!(outcome(&found, "s-stable"), ClaimOutcome::Partly);
    let text = paper_claims(&found).into_iter().find(|c| c.key == "figure-4-large").unwrap().text;
    assert!(
        text.contains("From theta = 0.6 on") && text.contains("16 of 40 loops (the first at theta = 0.61)"),
        "{text}"
    );

    let robust = paper(study(|method, theta| match method {
        StudyMethod::Pem => Some(98.0),
        StudyMethod::Direct => Some(60.0 + 30.0 * theta),
        _ => Some(95.0),
    }));
    assert_eq!(outcome(&robust, "figure-4-large"), ClaimOutcome::Fails);
    assert_eq!(outcome(&robust, "figure-5-mean"), ClaimOutcome::Holds);
    assert_eq!(outcome(&robust, "figure-5-variance"), ClaimOutcome::Holds);
    assert_eq!(outcome(&robust, "s-stable"), ClaimOutcome::Holds);

    let apart = paper(study(|method, _| Some(if method == StudyMethod::Pem { 98.0 } else { 80.0 })));
    assert_eq!(outcome(&apart, "figure-4-small"), ClaimOutcome::Fails);
}

#[test]
fn a_study_without_a_method_says_so() {
    let lonely = paper(study(as_found).into_iter().filter(|r| r.method == StudyMethod::Pem).collect());
    assert_eq!(outcome(&lonely, "figure-4-large"), ClaimOutcome::Unknown);
    assert_eq!(outcome(&lonely, "figure-5-mean"), ClaimOutcome::Unknown);
    assert!(paper_story(&lonely).is_ok());
    assert!(paper_story(&paper(Vec::new())).is_ok());
}

#[test]
fn the_map_names_winners_ties_and_what_is_missing() {
    let paper = paper(study(as_found));
    let figures = paper_figures(&paper).unwrap();
    let map = figures.iter().find(|f| f.key == "crossover-map").unwrap();
    let Content::Cells(strong) = &map.panels[0].content else { panic!("no map") };
    let texts: Vec<&str> = strong.cells.iter().map(|c| c.text.as_str()).collect();
    assert_eq!(texts, ["tie", "no loop", "no loop", "+8", "no loop", "no loop", "+8", "no loop", "no loop"]);
    assert_eq!((strong.cells[3].method.as_str(), strong.cells[3].strength), ("hansen", 0.4));
    assert_eq!(strong.cells[0].detail, "Hansen G(S) 79.5, direct N4SID 79.0 %");
    let overtakes = table(&paper_tables(&paper).unwrap(), "crossover-noise");
    assert_eq!(overtakes.rows[0].cells, ["0.1", "0.5, 3", "0.5, 3", "0.5, 3"]);
    assert_eq!(overtakes.rows[1].cells, ["0.5", "no loop", "0.5, 3", "0.5, 3"]);
}

#[test]
fn the_text_is_fit_to_be_read() {
    let story = paper_story(&paper(study(as_found))).unwrap();
    for text in texts(&story) {
        assert!(!text.contains('\u{2014}') && !text.contains("NaN") && !text.contains("inf "), "{text}");
        assert!(!text.contains("  "), "{text}");
    }
    let mut anchors = BTreeSet::new();
    for section in &story.sections {
        assert!(anchors.insert(section.key.clone()));
        for block in &section.blocks {
            match block {
                Block::Figure(figure) => assert!(anchors.insert(figure.key.clone())),
                Block::Table(table) => assert!(anchors.insert(table.key.clone())),
                _ => {}
            }
        }
    }
}

fn texts(story: &Story) -> Vec<String> {
    let block = |block: &Block| match block {
        Block::Text(text) => vec![text.clone()],
        Block::List(points) => points.clone(),
        Block::Table(table) => {
            let cells = table.rows.iter().flat_map(|line| line.cells.clone());
            cells.chain([table.caption.clone()]).collect()
        }
        Block::Figure(figure) => vec![figure.caption.clone()],
        Block::Listing { .. } => Vec::new(),
    };
    story.sections.iter().flat_map(|s| &s.blocks).flat_map(block).collect()
}

#[test]
fn the_summary_says_what_the_page_says() {
    let paper = paper(study(as_found));
    let summary = paper_summary(&paper).unwrap();
    assert_eq!(summary["study"]["pem"]["all"]["poor_fit"], 16);
    assert_eq!(summary["study"]["hansen"]["deciles"].as_array().unwrap().len(), 10);
    assert_eq!(summary["experiments"]["high-deviation"]["table_1"]["pem"]["paper"][0], 48.91);
    let (claims, page) = (summary["claims"].as_array().unwrap(), paper_claims(&paper));
    assert_eq!(claims.len(), page.len());
    assert!(claims.iter().zip(&page).all(|(a, b)| a["text"] == b.text.as_str() && a["key"] == b.key));
    assert_eq!(summary["crossover"][0]["winner"], serde_json::Value::Null);
    assert_eq!(summary["crossover"][3]["winner"], "hansen");
    let other = Paper { timing: PaperTiming { threads: 7, loop_ms: 3.0, ..PaperTiming::default() }, ..paper };
    assert_eq!(paper_summary(&other).unwrap(), summary);
}
