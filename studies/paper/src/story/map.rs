//! The crossover map: which method wins under which conditions.

use super::figures::axis;
use super::words::{NONE, and, count, percent, range, sentence, short};
use crate::study::{POOR_FIT, Paper, StudyMethod, StudyRow, TIE, Winner, crossover, winner};
use youla_report::figure::{Cell, Cells, Content, Figure, Layout, Panel};
use youla_report::story::{Table, TableRow};

/// Lead at which the colour is full, percentage points.
const FULL: f64 = 20.0;

/// One cell of the map.
pub(super) struct MapCell {
    /// Places in the lists of the settings: weight of the command, noise, theta.
    place: [usize; 3],
    /// Weight of the command, noise and theta.
    pub(super) at: [f64; 3],
    /// `None` without a loop.
    pub(super) winner: Option<Winner>,
}

impl MapCell {
    /// The method that leads by more than a tie.
    pub(super) fn won_by(&self) -> Option<StudyMethod> {
        self.winner.as_ref().filter(|w| w.margin >= TIE).map(|w| w.ranking[0].0)
    }

    /// Lead of one method over another in the median fit of the worse axis, percentage points.
    pub(super) fn lead(&self, of: StudyMethod, over: StudyMethod) -> Option<f64> {
        let ranking = &self.winner.as_ref()?.ranking;
        let fit = |m: StudyMethod| ranking.iter().find(|(method, _)| *method == m).map(|(_, fit)| *fit);
        Some(fit(of)? - fit(over)?)
    }
}

/// The cells in the order of the items: by weight, noise and theta.
pub(super) fn cells(paper: &Paper) -> Vec<MapCell> {
    cells_among(paper, |_| true)
}

/// The cells with some of the methods only.
fn cells_among(paper: &Paper, competes: impl Fn(StudyMethod) -> bool) -> Vec<MapCell> {
    let grid = &paper.settings.crossover;
    let rows_of = |[w, n, t]: [usize; 3]| {
        let item = ((w * grid.noise.len() + n) * grid.theta.len() + t) * grid.repetitions;
        let inside = |r: &&StudyRow| (item..item + grid.repetitions).contains(&r.item) && competes(r.method);
        (crossover(&paper.settings, item), paper.crossover.iter().filter(inside).collect::<Vec<_>>())
    };
    let mut cells = Vec::new();
    for w in 0..grid.command_weights.len() {
        for n in 0..grid.noise.len() {
            for t in 0..grid.theta.len() {
                let (item, rows) = rows_of([w, n, t]);
                let at = [item.command_weights[0], item.noise, item.theta];
                cells.push(MapCell { place: [w, n, t], at, winner: winner(&rows) });
            }
        }
    }
    cells
}

/// What a weight means: `strong feedback, weight 1`.
pub(super) fn feedback(paper: &Paper, weight: usize) -> String {
    let weights = &paper.settings.crossover.command_weights;
    let rank = weights.iter().filter(|w| **w < weights[weight]).count();
    let word = match (weights.len(), rank) {
        (2 | 3, 0) => "strong feedback, ",
        (3, 1) => "medium feedback, ",
        (2, 1) | (3, 2) => "weak feedback, ",
        _ => "",
    };
    format!("{word}weight {}", short(weights[weight], 4))
}

/// All methods.
pub(super) fn figure(paper: &Paper) -> Figure {
    let caption = format!(
        "Method with the highest median fit of the worse axis over noise and theta, one panel per weight of the command, with its \
         lead over the second in percentage points; below {TIE} point it is a tie, and where no controller keeps the margin there \
         is no loop."
    );
    drawn(paper, &cells(paper), "crossover-map", "Crossover map", caption)
}

/// Hansen against direct identification, as in Fig. 5: neither knows the structure of the plant.
pub(super) fn figure_of_subspace(paper: &Paper) -> Figure {
    let cells = cells_among(paper, |m| matches!(m, StudyMethod::Direct | StudyMethod::Hansen));
    let caption = "The same between the two methods that know nothing of the structure of the plant.".into();
    drawn(paper, &cells, "crossover-map-subspace", "Crossover map, Hansen against direct identification", caption)
}

/// One panel per weight of the command.
fn drawn(paper: &Paper, cells: &[MapCell], key: &str, title: &str, caption: String) -> Figure {
    let grid = &paper.settings.crossover;
    let labels = |values: &[f64]| values.iter().map(|v| short(*v, 4)).collect::<Vec<_>>();
    let panel = |weight: usize| Panel {
        title: feedback(paper, weight),
        x: axis("theta", ""),
        y: axis("noise", "um"),
        content: Content::Cells(Cells {
            columns: labels(&grid.theta),
            rows: labels(&grid.noise),
            cells: cells.iter().filter(|c| c.place[0] == weight).map(cell).collect(),
        }),
        ..Panel::default()
    };
    Figure {
        key: key.into(),
        title: title.into(),
        caption,
        layout: Layout::Beside,
        panels: (0..grid.command_weights.len()).map(panel).collect(),
        ..Figure::default()
    }
}

fn cell(cell: &MapCell) -> Cell {
    let Some(winner) = &cell.winner else {
        return Cell { text: "no loop".into(), detail: "No controller keeps the margin.".into(), ..Cell::default() };
    };
    let named = |(m, fit): &(StudyMethod, f64)| format!("{} {}", m.label(), percent(*fit, 1));
    let detail = format!("{} %", winner.ranking.iter().map(named).collect::<Vec<_>>().join(", "));
    match cell.won_by() {
        None => Cell { text: "tie".into(), detail, ..Cell::default() },
        Some(method) => Cell {
            method: method.key().into(),
            strength: (winner.margin / FULL).min(1.0),
            text: if winner.margin > 99.0 { "> +99".into() } else { format!("+{:.0}", winner.margin) },
            detail,
        },
    }
}

/// Where which method wins: a sentence per weight, one on all, and one on usefulness.
pub(super) fn sentences(paper: &Paper) -> Vec<String> {
    let cells = cells(paper);
    let all: Vec<&MapCell> = cells.iter().collect();
    let of = |w: usize| all.iter().copied().filter(|c| c.place[0] == w).collect::<Vec<_>>();
    let weights = 0..paper.settings.crossover.command_weights.len();
    let mut sentences: Vec<String> = weights.map(|w| sentence_of(&feedback(paper, w), &of(w))).collect();
    sentences.push(sentence_of("in all", &all));
    let best = |c: &&MapCell| c.winner.as_ref().is_some_and(|w| w.ranking[0].1 < POOR_FIT);
    let lost: Vec<&MapCell> = cells.iter().filter(best).collect();
    if !lost.is_empty() {
        let (cells, noise) = (count(lost.len(), "cell", "cells"), span(&lost, 1));
        sentences.push(format!("In {cells}, at a noise of {noise} um, even the best median stays below {POOR_FIT} %."));
    }
    sentences
}

fn sentence_of(feedback: &str, cells: &[&MapCell]) -> String {
    let with_loop: Vec<&&MapCell> = cells.iter().filter(|c| c.winner.is_some()).collect();
    let head = format!("{}: ", sentence(feedback));
    if with_loop.is_empty() {
        return format!("{head}no controller keeps the margin in any cell.");
    }
    let wins = |m: StudyMethod| cells.iter().copied().filter(|c| c.won_by() == Some(m)).collect::<Vec<_>>();
    let won = StudyMethod::ALL.into_iter().filter(|m| !wins(*m).is_empty()).map(|m| {
        let cells = wins(m);
        let (noise, theta) = (span(&cells, 1), span(&cells, 2));
        format!("{} wins {} (noise {noise} um, theta {theta})", m.label(), count(cells.len(), "cell", "cells"))
    });
    let ties = with_loop.iter().filter(|c| c.won_by().is_none()).count();
    let mut parts: Vec<String> = won.collect();
    if ties > 0 {
        parts.push(count(ties, "cell is a tie", "cells are ties"));
    }
    format!("{head}{} of {} have a loop; {}.", with_loop.len(), count(cells.len(), "cell", "cells"), and(&parts))
}

/// From the least to the greatest value of a coordinate.
fn span(cells: &[&MapCell], coordinate: usize) -> String {
    let values = cells.iter().map(|c| c.at[coordinate]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low == high { short(low, 4) } else { range([low, high]) }
}

/// Noise levels at which Hansen leads direct identification, per theta and weight.
pub(super) fn table(paper: &Paper) -> Table {
    let (grid, cells) = (&paper.settings.crossover, cells(paper));
    let weights = 0..grid.command_weights.len();
    let row = |t: usize| {
        let entry = |w: usize| {
            let column: Vec<&MapCell> = cells.iter().filter(|c| c.place[0] == w && c.place[2] == t).collect();
            ahead(&column)
        };
        let cells = std::iter::once(short(grid.theta[t], 4)).chain(weights.clone().map(entry)).collect();
        TableRow { method: String::new(), cells }
    };
    Table {
        key: "crossover-noise".into(),
        title: "Where the Hansen scheme overtakes direct identification".into(),
        caption: format!(
            "Noise levels of the map, um rms, at which the median fit of the worse axis of the Hansen scheme is higher than that of \
             direct N4SID by {TIE} point or more, whoever wins the cell."
        ),
        groups: Vec::new(),
        header: std::iter::once("theta".into()).chain(weights.clone().map(|w| feedback(paper, w))).collect(),
        rows: (0..grid.theta.len()).map(row).collect(),
    }
}

/// Of the cells of one column.
fn ahead(column: &[&MapCell]) -> String {
    let leads: Vec<(f64, f64)> =
        column.iter().filter_map(|c| Some((c.at[1], c.lead(StudyMethod::Hansen, StudyMethod::Direct)?))).collect();
    let noise: Vec<String> = leads.iter().filter(|(_, lead)| *lead >= TIE).map(|(noise, _)| short(*noise, 4)).collect();
    match (leads.is_empty(), noise.is_empty()) {
        (true, _) => "no loop".into(),
        (_, true) => NONE.into(),
        _ => noise.join(", "),
    }
}
