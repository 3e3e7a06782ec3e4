//! The experiments and the reduction.

use super::study::points;
use crate::Result;
use crate::story::order::{differences, lacking_in_words};
use crate::story::words::{both, count, excitation, short};
use crate::story::{claims_experiments, figures_experiments as figures, tables_experiments as tables};
use crate::study::{Paper, StudyExperiment, StudyMethod};
use youla_report::figure::Figure;
use youla_report::story::section;
use youla_report::story::{Block, Section};

/// Table 1 and Figures 6 to 10.
pub(in crate::story) fn experiments(paper: &Paper) -> Result<Section> {
    let e = &paper.settings.experiments;
    let text = format!(
        "The nominal model is made worse in three ways, a controller is designed on it, and the digital twin runs under it: {} to \
         identify from and {} to verify with. All methods of a column have the same data, and nothing is tuned per column.",
        count(e.samples, "sample", "samples"),
        count(e.verification_samples, "sample", "samples")
    );
    let mut blocks = vec![Block::Text(text), Block::Table(tables::table_1(paper)?)];
    blocks.push(points(claims_experiments::claims(paper)));
    let list = &paper.experiments.list;
    let differ = list.iter().map(|x| differences(x, &paper.rig)).collect::<Result<Vec<_>>>()?.concat();
    if !differ.is_empty() {
        blocks.push(Block::Text("Columns in which the order of the methods is not that of the paper (differences below one point count as level):".into()));
        blocks.push(Block::List(differ));
    }
    blocks.extend(list.iter().filter_map(|x| nominal_below(paper, x)).map(Block::Text));
    blocks.extend(figures_in_order(list).into_iter().map(Block::Figure));
    for x in list.iter().filter(|x| x.case.key == "high-deviation" && !x.starts.is_empty()) {
        blocks.push(Block::Text(local_minimum(paper, x)));
        blocks.push(Block::Figure(figures::starts(x)));
    }
    Ok(section("experiments", "Experiments", "Experiments", blocks))
}

/// Figures 6 to 10 as the paper numbers them.
fn figures_in_order(list: &[StudyExperiment]) -> Vec<Figure> {
    let mut numbered: Vec<(usize, Figure)> = list.iter().map(|x| (x.case.figure, figures::verification(x))).collect();
    for x in list.iter().filter(|x| x.case.key == "small-deviation") {
        numbered.extend(x.beta.as_ref().map(|beta| (8, figures::beta(x, beta))));
        numbered.push((10, figures::zoom(x)));
    }
    numbered.sort_by_key(|(number, _)| *number);
    numbered.into_iter().map(|(_, figure)| figure).collect()
}

/// A nominal model that is far below the paper's.
fn nominal_below(paper: &Paper, x: &StudyExperiment) -> Option<String> {
    let (ours, theirs) = (figures::fit_of(x, StudyMethod::Nominal), x.case.published[0]);
    if x.case.a_factor > 0.9 || (0..2).all(|i| ours[i] > theirs[i] - 20.0) {
        return None;
    }
    let gain = x.case.b_factor / x.case.a_factor;
    Some(format!(
        "{}: the nominal model fits {} here and {} in the paper. Its static gain is {} times that of the plant, so under a slow \
         excitation alone it would fit {} %, and less where its resonances are excited; the paper's value suggests square waves \
         slower than these records have: {}.",
        x.case.title,
        both(ours),
        both(theirs),
        short(gain, 3),
        short(100.0 * (1.0 - (gain - 1.0).abs()), 3),
        excitation(&paper.settings.experiments.excitation)
    ))
}

/// Why the paper's PEM is low with a poor nominal model.
fn local_minimum(paper: &Paper, x: &StudyExperiment) -> String {
    let single = figures::fit_of(x, StudyMethod::Pem);
    let best = figures::fit_of(x, StudyMethod::PemMultiStart);
    let published = x.case.published[1];
    let mut text = format!(
        "{}: the paper's PEM reaches {}, ours {} from the nominal model and {} as the best of several starts. The noise is white at \
         the output, so PEM has the right noise model and feedback does not bias it; a fit as low as the paper's looks like a search \
         that ended in a local minimum. {}",
        x.case.title,
        both(published),
        both(single),
        both(best),
        figures::starts_in_words(x, paper.settings.experiments.start_factors.len())
    );
    if let Some(missing) = lacking_in_words(&paper.rig) {
        text.push_str(&format!(" What PEM still lacks at its best is structure: {missing}."));
    }
    text
}

/// Before and after reduction.
pub(in crate::story) fn reduction(paper: &Paper) -> Result<Section> {
    let orders: Vec<usize> = paper
        .experiments
        .list
        .iter()
        .filter_map(|x| figures::of(x, StudyMethod::Hansen)?.model.as_ref().ok().map(|g| g.order()))
        .collect();
    let order = orders.iter().max().map_or_else(|| "no model".into(), |n| format!("{n} states"));
    let text = format!(
        "The paper reports models with as much as 40 states and reduces them to 6 (29). Here S becomes G(S) in one linear fractional \
         transformation, which adds the orders of the nominal model and of S and no more: {order}. Multiplying out the factors of \
         (16) would give 24 plus twice the order of S, which is 40 for an S of order 8. The reduction is by {}.",
        paper.settings.reduction.method
    );
    let modes = "A reduced model has the order of the bearing, so its modes can be held against those of the linear part of the rig.";
    let blocks = vec![
        Block::Text(text),
        Block::Table(tables::reduction(paper)),
        Block::Text(modes.into()),
        Block::Table(tables::modes(paper)?),
    ];
    Ok(section("reduction", "Model reduction", "Reduction", blocks))
}
