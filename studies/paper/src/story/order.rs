//! Where the order of the methods in a column of Table 1 is not that of the paper, and why.

use super::figures_experiments::fit_of;
use super::words::{AXES, and, percent};
use crate::Result;
use crate::study::{StudyExperiment, StudyMethod, TIE};
use youla::validate::{fit, predict_open_loop};
use youla_twin::rig::{BearingRig, Fidelity, RigParameters};

/// The rows of the paper's table.
const ROWS: [StudyMethod; 4] =
    [StudyMethod::Nominal, StudyMethod::Pem, StudyMethod::Hansen, StudyMethod::HansenReduced];

/// The pairs that are compared, by their rows.
const PAIRS: [[usize; 2]; 4] = [[0, 1], [0, 2], [1, 2], [2, 3]];

/// Who is ahead, by more than a tie.
#[derive(Clone, Copy, PartialEq)]
enum Ahead {
    First,
    Second,
    Nobody,
}

/// One sentence for each column whose order differs, with the likely reasons.
///
/// # Errors
/// Those of [`rig_fit`].
pub(super) fn differences(experiment: &StudyExperiment, rig: &RigParameters) -> Result<Vec<String>> {
    let bound = rig_fit(experiment, rig)?;
    Ok((0..2).filter_map(|axis| column(experiment, rig, axis, bound[axis])).collect())
}

fn column(experiment: &StudyExperiment, rig: &RigParameters, axis: usize, bound: f64) -> Option<String> {
    let ours = ROWS.map(|m| fit_of(experiment, m)[axis]);
    let theirs = experiment.case.published.map(|fit| fit[axis]);
    let differ: Vec<[usize; 2]> = PAIRS.into_iter().filter(|p| ahead(ours, *p) != ahead(theirs, *p)).collect();
    let differences: Vec<String> = differ
        .iter()
        .map(|p| format!("the paper has {}, here {}", described(theirs, *p), described(ours, *p)))
        .collect();
    let mut reasons: Vec<String> = Vec::new();
    for pair in &differ {
        let reason = reason(*pair, [ours, theirs].map(|fits| ahead(fits, *pair)), experiment, rig, bound);
        if !reasons.contains(&reason) {
            reasons.push(reason);
        }
    }
    let head = format!("{}, {}", experiment.case.title, AXES[axis]);
    (!differ.is_empty()).then(|| format!("{head}: {}. {}", differences.join("; "), reasons.join(" ")))
}

fn ahead(fits: [f64; 4], [a, b]: [usize; 2]) -> Ahead {
    match fits[a] - fits[b] {
        lead if lead >= TIE => Ahead::First,
        lead if lead <= -TIE => Ahead::Second,
        _ => Ahead::Nobody,
    }
}

fn described(fits: [f64; 4], [a, b]: [usize; 2]) -> String {
    let (first, second, lead) = (ROWS[a].label(), ROWS[b].label(), fits[a] - fits[b]);
    match ahead(fits, [a, b]) {
        Ahead::First => format!("{first} {} points ahead of {second}", percent(lead, 1)),
        Ahead::Second => format!("{second} {} points ahead of {first}", percent(-lead, 1)),
        Ahead::Nobody => format!("{first} and {second} level within {TIE} point"),
    }
}

/// The likely reason of one pair, whose order is first ours and then the paper's; the paper's data are not public.
fn reason(
    pair: [usize; 2],
    [ours, theirs]: [Ahead; 2],
    experiment: &StudyExperiment,
    rig: &RigParameters,
    bound: f64,
) -> String {
    let turning = matches!(experiment.case.fidelity, Fidelity::Rotating { .. });
    match (pair, ours, theirs) {
        ([1, 2], _, _) if turning => format!(
            "What turns with the shaft bounds all models here: the linear part of the rig itself reaches {} %.",
            percent(bound, 1)
        ),
        ([1, 2], Ahead::Second, _) if !lacking(rig).is_empty() => {
            "PEM keeps to a structure that lacks what the twin has besides the bearing, which S takes up.".into()
        }
        ([1, 2], _, Ahead::Second) => {
            "The paper's PEM looks like a search that ended in a local minimum, for its structure contains the plant."
                .into()
        }
        ([0, _], _, _) => "The twin is not the paper's rig, so its nominal model is off by another amount.".into(),
        ([2, 3], Ahead::Nobody, Ahead::First) => {
            "G(S) has fewer states here than in the paper, and those that reduction drops carry little.".into()
        }
        _ => "The paper's data are not public, so the reason stays open.".into(),
    }
}

/// What the structure of PEM has no parameter for.
pub(super) fn lacking(rig: &RigParameters) -> Vec<&'static str> {
    let mut missing = Vec::new();
    if rig.timing.delay.value > 0 {
        missing.push("the delay of the controller");
    }
    if rig.actuator.hysteresis.is_some() {
        missing.push("the hysteresis of the valves");
    }
    if rig.sensor.low_pass.is_some() {
        missing.push("the bandwidth of the sensors");
    }
    missing
}

/// The same as a phrase.
pub(super) fn lacking_in_words(rig: &RigParameters) -> Option<String> {
    let missing = lacking(rig);
    (!missing.is_empty()).then(|| and(&missing))
}

/// Fit per axis of the linear part of the rig itself: what noise, hysteresis and all that turns with the shaft leave.
///
/// # Errors
/// Those of the plant and of its simulation.
pub(super) fn rig_fit(experiment: &StudyExperiment, rig: &RigParameters) -> Result<[f64; 2]> {
    let plant = BearingRig::new(rig, experiment.case.fidelity, 0)?.true_plant()?;
    let (record, settle) = (&experiment.verification, experiment.settle);
    let rows = record.y.nrows().saturating_sub(settle);
    let (u, y) = (record.u_applied.subrows(settle, rows), record.y.subrows(settle, rows));
    let percent = fit(y, predict_open_loop(&plant, u, y)?.as_ref())?;
    Ok([percent[0], percent[1]])
}
