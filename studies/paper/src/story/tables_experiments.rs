//! Table 1, and the models of the experiments before and after reduction.

use super::figures_experiments::{fit_of, of};
use super::modes::{oscillations, real_poles};
use super::order::rig_fit;
use super::tables::{axes, fit_cells, method_row, order, plain, row, yes};
use crate::Result;
use crate::study::{Paper, StudyMethod};
use youla_report::story::{Table, TableRow};
use youla_twin::rig::BearingRig;

/// The methods of Table 1, each with its row of the paper's table.
pub(super) const TABLE_1: [(StudyMethod, Option<usize>); 6] = [
    (StudyMethod::Nominal, Some(0)),
    (StudyMethod::Pem, Some(1)),
    (StudyMethod::PemMultiStart, None),
    (StudyMethod::Hansen, Some(2)),
    (StudyMethod::HansenReduced, Some(3)),
    (StudyMethod::HansenPem, None),
];

/// Table 1, the paper's numbers beneath ours.
pub(super) fn table_1(paper: &Paper) -> Result<Table> {
    let list = &paper.experiments.list;
    let mut rows = Vec::new();
    for (method, published) in TABLE_1 {
        let ours = list.iter().flat_map(|e| fit_cells(fit_of(e, method), 2));
        rows.push(method_row(method, std::iter::once(method.label().to_owned()).chain(ours)));
        if let Some(k) = published {
            let theirs = list.iter().flat_map(|e| fit_cells(e.case.published[k], 2));
            rows.push(method_row(method, std::iter::once("paper".to_owned()).chain(theirs)));
        }
    }
    let bounds = list.iter().map(|e| rig_fit(e, &paper.rig)).collect::<Result<Vec<_>>>()?;
    let bounds = bounds.into_iter().flat_map(|fit| fit_cells(fit, 2));
    rows.push(row(std::iter::once("linear part of the rig".to_owned()).chain(bounds)));
    let caption = "Fit (26) on the verification record, percent, ours and beneath it the paper's; the last row is the fit of the \
                   true linear plant, to which noise, hysteresis and what turns with the shaft leave the rest.";
    Ok(Table {
        groups: std::iter::once((String::new(), 1)).chain(list.iter().map(|e| (e.case.title.clone(), 2))).collect(),
        header: std::iter::once("model".to_owned()).chain(axes(list.len())).collect(),
        ..plain("table-1", "Table 1", caption, &[], rows)
    })
}

/// Orders, fits and stability before and after reduction.
pub(super) fn reduction(paper: &Paper) -> Table {
    let rows = paper.experiments.list.iter().flat_map(|e| {
        [StudyMethod::Hansen, StudyMethod::HansenReduced].into_iter().filter_map(|m| {
            let model = of(e, m)?;
            let head = [e.case.title.clone(), m.label().to_owned(), order(model)];
            let fit = fit_cells(model.fit, 2);
            Some(method_row(m, head.into_iter().chain(fit).chain([yes(model.stable), yes(model.stabilised)])))
        })
    });
    plain(
        "reduced-models",
        "Before and after reduction",
        "Order and fit, percent, of G(S) and G_red(S), whether each is stable, and whether the controller of the experiment \
         stabilises it.",
        &["experiment", "model", "order", "horizontal", "vertical", "stable", "stabilised"],
        rows.collect(),
    )
}

/// Modes of the models that have the order of the nominal one beside those of the rig.
pub(super) fn modes(paper: &Paper) -> Result<Table> {
    let mut rows: Vec<TableRow> = Vec::new();
    for e in &paper.experiments.list {
        let rig = BearingRig::new(&paper.rig, e.case.fidelity, 0)?.true_plant()?.modes()?;
        let nyquist = 0.5 / e.verification.time.ts();
        let title = || e.case.title.clone();
        rows.push(row([
            title(),
            "linear part of the rig".into(),
            oscillations(&rig, nyquist),
            real_poles(&rig, nyquist),
        ]));
        for m in [StudyMethod::Nominal, StudyMethod::Pem, StudyMethod::HansenReduced] {
            if let Some(model) = of(e, m).filter(|model| model.model.is_ok()) {
                let cells = [
                    title(),
                    m.label().to_owned(),
                    oscillations(&model.modes, nyquist),
                    real_poles(&model.modes, nyquist),
                ];
                rows.push(method_row(m, cells));
            }
        }
    }
    Ok(plain(
        "modes",
        "Modes",
        "Natural frequencies with damping ratios below 0.5, and real poles, of the models of nominal order beside the linear \
         part of the rig, below half the sample rate.",
        &["experiment", "model", "oscillating, Hz (damping)", "real poles, Hz"],
        rows,
    ))
}

/// Seconds of every identification.
pub(super) fn seconds(paper: &Paper) -> Table {
    let rows = paper.experiments.list.iter().flat_map(|e| {
        let timed = e.models.iter().filter(|m| m.seconds > 0.0);
        timed.map(|m| {
            let cells = [e.case.title.clone(), m.method.label().to_owned(), format!("{:.1}", 1e3 * m.seconds)];
            method_row(m.method, cells)
        })
    });
    plain(
        "experiment-timing",
        "Identification of the experiments",
        "Wall time of one identification; that of the reduction is without the identification of S.",
        &["experiment", "method", "ms"],
        rows.collect(),
    )
}
