//! Medians and failures of the study.

use super::tables::{axes, fit_cells, method_row, plain, row};
use super::words::range;
use crate::study::{Decile, POOR_FIT, Paper, StudyMethod, deciles, overall};
use youla_report::story::Table;

/// The methods of the study that have rows, the nominal model first.
pub(super) fn compared(paper: &Paper) -> Vec<StudyMethod> {
    StudyMethod::ALL.into_iter().filter(|m| paper.study.iter().any(|r| r.method == *m)).collect()
}

/// The tenths of theta of each method, then all of it.
fn lines(paper: &Paper, methods: &[StudyMethod]) -> Vec<Vec<Decile>> {
    let theta = paper.settings.study.theta;
    let of = |m: &StudyMethod| {
        deciles(&paper.study, *m, theta).into_iter().chain([overall(&paper.study, *m, theta)]).collect()
    };
    let columns: Vec<Vec<Decile>> = methods.iter().map(of).collect();
    (0..11).map(|k| columns.iter().map(|c| c[k].clone()).collect()).collect()
}

fn first(k: usize, line: &[Decile]) -> [String; 2] {
    let theta = if k == 10 { "all".into() } else { range(line[0].theta) };
    [theta, line[0].count.to_string()]
}

/// Median fit per method, axis and tenth of theta.
pub(super) fn medians(paper: &Paper) -> Table {
    let methods = compared(paper);
    let lines = lines(paper, &methods);
    let rows = lines
        .iter()
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
        .map(|(k, line)| row(first(k, line).into_iter().chain(line.iter().flat_map(|d| fit_cells(d.median, 1)))));
    let caption = "Median fit on the record without noise, percent, per tenth of theta; every loop counts, one without a model \
                   as the lowest.";
    Table {
        groups: grouped(&methods, 2),
        header: ["theta", "loops"].map(str::to_owned).into_iter().chain(axes(methods.len())).collect(),
        ..plain("study-medians", "Medians of the study", caption, &[], rows.collect())
    }
}

/// What became of every loop; each line adds up to its loops.
pub(super) fn failures(paper: &Paper) -> Table {
    let methods: Vec<StudyMethod> = compared(paper).into_iter().filter(|m| *m != StudyMethod::Nominal).collect();
    let lines = lines(paper, &methods);
    let counts = |d: &Decile| [d.usable(), d.refused, d.unstable, d.poor_fit].map(|n| n.to_string());
    let rows = lines
        .iter()
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
        .map(|(k, line)| row(first(k, line).into_iter().chain(line.iter().flat_map(counts))));
    let names = ["usable", "refused", "unstable", "poor fit"];
    let caption = format!(
        "What became of every loop: a usable model, none at all (refused), an unstable one, or a stable one with a fit below \
         {POOR_FIT} % on an axis (poor fit); the four add up to the loops of the line."
    );
    Table {
        groups: grouped(&methods, 4),
        header: ["theta", "loops"].into_iter().chain(methods.iter().flat_map(|_| names)).map(str::to_owned).collect(),
        ..plain("study-failures", "Failures of the study", caption, &[], rows.collect())
    }
}

fn grouped(methods: &[StudyMethod], width: usize) -> Vec<(String, usize)> {
    std::iter::once((String::new(), 2)).chain(methods.iter().map(|m| (m.label().to_owned(), width))).collect()
}

/// Sums over the whole study, one line per method.
pub(super) fn sums(paper: &Paper) -> Table {
    let rows = compared(paper).into_iter().filter(|m| *m != StudyMethod::Nominal).map(|m| {
        let all = overall(&paper.study, m, paper.settings.study.theta);
        let sum = all.usable() + all.refused + all.unstable + all.poor_fit;
        let counts = [all.usable(), all.refused, all.unstable, all.poor_fit, sum].map(|n| n.to_string());
        method_row(m, std::iter::once(m.label().to_owned()).chain(counts).chain(fit_cells(all.median, 1)))
    });
    plain(
        "study-sums",
        "The study in sums",
        format!(
            "Usable, refused, unstable and poorly fitting models of the {} loops, their sum, and the median fits.",
            paper.settings.study.models
        ),
        &["method", "usable", "refused", "unstable", "poor fit", "sum", "median horizontal, %", "median vertical, %"],
        rows.collect(),
    )
}
