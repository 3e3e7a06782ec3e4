//! The recommended model on the page: its tests, what the search chose and why, and the candidates.

use crate::result::Identification;
use youla::identify::likelihood::{
    Candidate, Evidence, INDISTINCT, LikelihoodOptions, Recommendation, TestOutcome, figure,
};
use youla::signal::Detrend;
use youla_report::data::EvidenceTable;

/// Rows of the table of candidates.
const MOST_CANDIDATES: usize = 12;

/// The tables; none without a recommended model.
pub(crate) fn tables(found: &Identification) -> Vec<EvidenceTable> {
    let Ok(model) = &found.recommended else { return Vec::new() };
    let (options, detrend) = (&found.settings.recommended, found.settings.data.detrend);
    vec![evidence(model), choices(model, options, detrend), candidates(model)]
}

fn evidence(model: &Recommendation) -> EvidenceTable {
    let row = |e: &Evidence| {
        let outcome = match e.outcome {
            TestOutcome::Passed => "passed",
            TestOutcome::Failed => "failed",
            TestOutcome::NotTested => "not tested",
        };
        let required = if e.required { "yes" } else { "no" };
        let at = e.hz.map_or(String::new(), |[low, high]| match low == high {
            true => figure(low),
            false => format!("{} to {}", figure(low), figure(high)),
        });
        let value = if e.outcome == TestOutcome::NotTested { String::new() } else { e.value() };
        let cells = [value, e.limit.to_string(), at, required.into(), outcome.into(), e.note.clone()];
        std::iter::once(e.question.clone()).chain(cells).collect()
    };
    EvidenceTable {
        title: "Evidence on the recommended model".into(),
        text: "The model is trusted where it passes every required test. A figure is at most its limit, or chance explains it; a test that \
               is not required names an imperfection, whose consequence is in the region of the model."
            .into(),
        columns: ["Test", "Figure", "Limit", "Frequency, Hz", "Required", "Outcome", "Remark"].map(String::from).to_vec(),
        rows: model.evidence.iter().map(row).collect(),
        caption: String::new(),
    }
}

/// The candidates for all samples: criteria of a part of a record compare with none of the whole.
fn compared(model: &Recommendation) -> Vec<&Candidate> {
    let samples = model.candidates.iter().map(|c| c.samples).max().unwrap_or(0);
    model.candidates.iter().filter(|c| c.samples == samples).collect()
}

fn candidates(model: &Recommendation) -> EvidenceTable {
    let mut sorted = compared(model);
    sorted.sort_by(|a, b| b.stabilised.cmp(&a.stabilised).then(a.criterion.total_cmp(&b.criterion)));
    let least = sorted.first().map_or(0.0, |c| c.criterion);
    let origin = |c: &Candidate| match c.stabilised {
        true => c.origin.clone(),
        false => format!("{}; the controller does not stabilise it", c.origin),
    };
    let row = |c: &&Candidate| {
        vec![c.order.to_string(), listed(&c.dead_time), format!("{:.1}", c.criterion - least), origin(c)]
    };
    EvidenceTable {
        title: "Candidates".into(),
        text: format!(
            "Order and dead time are those with the least criterion of the candidates that the controller stabilises; the others come last, \
             whatever their criterion. A difference up to {INDISTINCT} does not decide: of such dead times that with the least gain near the \
             Nyquist frequency is taken. Modes that only the noise shows are left to the model of the noise, whatever they gain."
        ),
        columns: ["Order", "Dead time, samples", "Criterion above the least of those stabilised", "Start"].map(String::from).to_vec(),
        rows: sorted.iter().take(MOST_CANDIDATES).map(row).collect(),
        caption: "Schwarz's criterion: -2 log likelihood + log(samples) per parameter. Listed are the candidates for all samples.".into(),
    }
}

/// What the search chose, from what, and why: one row per choice, each with the key that fixes it.
fn choices(model: &Recommendation, options: &LikelihoodOptions, detrend: Detrend) -> EvidenceTable {
    let rows = [
        order(model, options.order.is_some()),
        dead_time(model, options.dead_time.is_some()),
        feedthrough(model, options.feedthrough.is_some()),
        noise(model),
        ends(model),
        means(detrend),
    ];
    EvidenceTable {
        title: "Choices".into(),
        text: "What the records decided where no key fixed it; the criterion is Schwarz's.".into(),
        columns: ["Choice", "Chosen", "From", "Reason", "Key that fixes it"].map(String::from).to_vec(),
        rows: rows.map(|row| row.to_vec()).to_vec(),
        caption: String::new(),
    }
}
/// Choice, chosen, from, reason, key.
type Row = [String; 5];

const FIXED: &str = "fixed by the key";

fn order(model: &Recommendation, fixed: bool) -> Row {
    let reason = if fixed { FIXED.into() } else { margin(model, |c| c.order != model.order, "order") };
    let from = distinct(model.candidates.iter().map(|c| c.order));
    ["Order".into(), model.order.to_string(), from, reason, "[recommended] order".into()]
}

fn dead_time(model: &Recommendation, fixed: bool) -> Row {
    let reason = if fixed { FIXED.into() } else { margin(model, |c| c.dead_time != model.dead_time, "dead time") };
    let from = distinct(model.candidates.iter().flat_map(|c| c.dead_time.iter().copied()));
    ["Dead time, samples".into(), listed(&model.dead_time), from, reason, "[recommended] dead_time".into()]
}

fn feedthrough(model: &Recommendation, fixed: bool) -> Row {
    let direct = model.plant.d().col_iter().any(|col| col.iter().any(|d| *d != 0.0));
    let reason = match (fixed, direct) {
        (true, _) => FIXED,
        (false, true) => "the criterion falls with it, and the controller's own direct path is known",
        (false, false) => "the criterion does not fall with it, or the loop leaves it undetermined",
    };
    let chosen = if direct { "yes" } else { "no" };
    let from = "yes, no".to_owned();
    ["Direct path from u to y".into(), chosen.into(), from, reason.into(), "[recommended] feedthrough".into()]
}

fn noise(model: &Recommendation) -> Row {
    let order = model.predictor.a.nrows() - model.plant.order();
    let chosen = if order == 0 { "white".into() } else { format!("autoregressions, {order} states in all") };
    let from = "0 to 40 coefficients per output, with and without slow drift".into();
    ["Noise".into(), chosen, from, "the least criterion, anew at each step of the search".into(), "none".into()]
}

fn ends(model: &Recommendation) -> Row {
    let count = model.order + model.plant.outputs();
    let chosen = format!("{count} numbers of each record estimated");
    let reason = "both ends of a record are part of the model, so that no sample is left out as settling";
    ["Start and end of the records".into(), chosen, "none".into(), reason.into(), "none".into()]
}

fn means(kind: Detrend) -> Row {
    let chosen = match kind {
        Detrend::None => "kept",
        Detrend::Mean => "taken out",
        Detrend::Linear => "taken out with the straight line",
    };
    let reason = "the line at 0 Hz is left out of the search and the drift of each output from one end of a record to the other is \
                  estimated, so that means and straight lines decide nothing";
    ["Means".into(), chosen.into(), "kept, mean, straight line".into(), reason.into(), "[data] detrend".into()]
}

/// By how much the criterion of the best other candidate is larger, or what decided in spite of it.
fn margin(model: &Recommendation, other: impl Fn(&Candidate) -> bool, what: &str) -> String {
    let least = |of: &dyn Fn(&&Candidate) -> bool| {
        compared(model)
            .into_iter()
            .filter(|c| c.stabilised)
            .filter(of)
            .min_by(|a, b| a.criterion.total_cmp(&b.criterion))
    };
    let Some(next) = least(&|c| other(c)) else {
        return format!("the others were tried on a part of the records; on all of them no other {what} was tried");
    };
    let value = if what == "order" { next.order.to_string() } else { listed(&next.dead_time) };
    let Some(chosen) = least(&|c| !other(c)) else {
        return format!("chosen on a part of the records; on all of them the search preferred it to {value}");
    };
    let unseen = model.evidence.iter().any(|e| e.question.ends_with("(unseen modes)"));
    match next.criterion - chosen.criterion {
        gap if gap >= 0.0 => format!("the best with another {what}, {value}, has a criterion {gap:.1} larger"),
        gap if -gap <= INDISTINCT => {
            format!("{value} has a criterion {:.1} smaller, less than the {INDISTINCT} from which it decides", -gap)
        }
        gap if unseen => format!(
            "{value} has a criterion {:.1} smaller, with modes that only the noise shows: they are left to the model of the noise",
            -gap
        ),
        gap => format!("{value} has a criterion {:.1} smaller; a later step of the search decided against it", -gap),
    }
}

fn listed(values: &[usize]) -> String {
    values.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

fn distinct(values: impl Iterator<Item = usize>) -> String {
    let mut all: Vec<usize> = values.collect();
    all.sort_unstable();
    all.dedup();
    listed(&all)
}
