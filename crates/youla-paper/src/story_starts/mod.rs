//! The study of starts as a page: what [`crate::study::start_counts`] says, as one figure and tables.
//!
//! | file | holds |
//! |---|---|
//! | `figure` | the share that converged, per case and search |
//! | `tables` | counts, failures of the searches without a start |

mod figure;
mod tables;

use crate::study::{CONVERGED_WITHIN, Search, StartCase, StartRow, StartsSettings, start_counts, start_failures};
use youla_report::data::{Method, Role};
use youla_report::story::{Block, Story, section};

/// What the study of starts found.
#[derive(Debug, Clone)]
pub struct Starts {
    /// What was chosen.
    pub settings: StartsSettings,
    /// The cases with their rows.
    pub cases: Vec<(StartCase, Vec<StartRow>)>,
}

/// The searches in the order in which they are listed and drawn.
pub fn starts_methods() -> Vec<Method> {
    let role = |search| match search {
        Search::Truth => Role::Nominal,
        Search::Pem => Role::Pem,
        Search::PemMultiStart => Role::PemMultiStart,
        Search::HansenPem => Role::HansenPem,
        Search::SubspacePem => Role::Other,
    };
    Search::ALL.into_iter().map(|search| Method::new(search.key(), search.label(), role(search))).collect()
}

/// The page.
///
/// ```
/// use youla_paper::story_starts::{Starts, starts_story};
/// use youla_paper::study::{StartCase, StartsSettings};
/// let settings = StartsSettings::shipped(&[StartCase::Periodic], None, 1);
/// let story = starts_story(&Starts { settings, cases: vec![(StartCase::Periodic, Vec::new())] });
/// assert_eq!(story.sections.len(), 3);
/// ```
pub fn starts_story(starts: &Starts) -> Story {
    let counts: Vec<_> = starts.cases.iter().flat_map(|(case, rows)| start_counts(*case, rows)).collect();
    let failures: Vec<_> = starts.cases.iter().flat_map(|(case, rows)| start_failures(*case, rows)).collect();
    Story {
        title: "Convergence from different starts".into(),
        summary: format!(
            "The prediction-error method from different starts, on records of the gas bearing, with seed {}. A search has converged \
             where its fit on a record without noise is at most {CONVERGED_WITHIN} percentage points below that of the search from the true \
             parameters, on each axis.",
            starts.settings.paper.seed
        ),
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        methods: starts_methods(),
        sections: vec![
            section(
                "converged",
                "Converged searches",
                "Converged searches",
                vec![Block::Figure(figure::converged(&counts)), Block::Table(tables::counts(&counts))],
            ),
            section(
                "failures",
                "Failures of the searches without a start",
                "Failures of the searches without a start",
                vec![match failures.is_empty() {
                    true => Block::Text("All items converged.".into()),
                    false => Block::Table(tables::failures(&failures)),
                }],
            ),
            section(
                "settings",
                "Settings",
                "Settings",
                vec![
                    Block::List(
                        starts.cases.iter().map(|(case, _)| format!("{}: {}.", case.key(), case.describe())).collect(),
                    ),
                    Block::List(searches(&starts.settings)),
                ],
            ),
        ],
    }
}

fn searches(settings: &StartsSettings) -> Vec<String> {
    let several = &settings.multi_start;
    let searched = several.searched.unwrap_or(several.starts);
    vec![
        format!("{}: at most {} steps from the start.", Search::Pem.label(), settings.paper.pem.max_iterations),
        format!(
            "{}: the start and {} points within a factor of {} around it, a search from the best {searched}.",
            Search::PemMultiStart.label(),
            several.starts.saturating_sub(1),
            several.factor
        ),
        format!("{}: from the projection of G(S), without the nominal parameters.", Search::HansenPem.label()),
        format!("{}: from the projection of a subspace model of u and y.", Search::SubspacePem.label()),
    ]
}
