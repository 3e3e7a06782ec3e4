//! The claims on the simulation study: Figures 4 and 5.

use super::claims::{Claim, ClaimOutcome, SIMILAR};
use super::map;
use super::words::{AXES, and, both, count, percent, range, short};
use crate::study::{Decile, Paper, RowStatus, StudyMethod, StudyRow, TIE, deciles, overall, quantile};

/// All of them.
pub(super) fn claims(paper: &Paper) -> Vec<Claim> {
    vec![small_deviations(paper), large_deviations(paper), medians(paper), spread(paper), stability(paper)]
}

fn unknown(claim: Claim) -> Claim {
    Claim { outcome: ClaimOutcome::Unknown, text: "The study has no rows of these methods.".into(), ..claim }
}

/// Tenths of theta with loops: PEM and Hansen.
fn tenths(paper: &Paper) -> Vec<(Decile, Decile)> {
    let of = |m: StudyMethod| deciles(&paper.study, m, paper.settings.study.theta);
    of(StudyMethod::Pem).into_iter().zip(of(StudyMethod::Hansen)).filter(|(p, h)| p.count > 0 && h.count > 0).collect()
}

fn small_deviations(paper: &Paper) -> Claim {
    let claim = Claim {
        key: "figure-4-small",
        source: "Fig. 4",
        claim: "For small deviations PEM and the Hansen scheme give similar fits.",
        outcome: ClaimOutcome::Fails,
        text: String::new(),
    };
    let [low, high] = paper.settings.study.theta;
    let small = low + 0.2 * (high - low);
    let tenths = tenths(paper);
    let near: Vec<&(Decile, Decile)> = tenths.iter().filter(|(p, _)| p.theta[1] <= small + 1e-9).collect();
    let Some(apart) = near.iter().map(|(p, h)| (p.worse - h.worse).abs()).reduce(f64::max) else {
        return unknown(claim);
    };
    let fits = |of: &dyn Fn(&(Decile, Decile)) -> f64| {
        and(&near.iter().map(|t| format!("{} %", percent(of(t), 1))).collect::<Vec<_>>())
    };
    let (pem, hansen) = (fits(&|t| t.0.worse), fits(&|t| t.1.worse));
    let text = format!(
        "Up to theta = {} the medians of the worse axis per tenth are {pem} for PEM and {hansen} for Hansen, at most {} points \
         apart (similar means up to {SIMILAR}).",
        short(small, 3),
        percent(apart, 1)
    );
    Claim { outcome: ClaimOutcome::of(&[apart <= SIMILAR]), text, ..claim }
}

fn large_deviations(paper: &Paper) -> Claim {
    let claim = Claim {
        key: "figure-4-large",
        source: "Fig. 4",
        claim: "As theta grows, PEM gives the lower fit.",
        outcome: ClaimOutcome::Fails,
        text: String::new(),
    };
    let tenths = tenths(paper);
    let Some(last) = tenths.last() else { return unknown(claim) };
    let behind = tenths.iter().rev().take_while(|(p, h)| h.worse - p.worse >= TIE).last();
    let end = format!(
        "for theta {} the medians of the worse axis are {} % for PEM and {} % for Hansen",
        range(last.0.theta),
        percent(last.0.worse, 1),
        percent(last.1.worse, 1)
    );
    let head = match behind {
        Some((from, _)) => format!("From theta = {} on PEM is behind in every tenth; {end}", short(from.theta[0], 3)),
        None => format!("PEM does not fall behind; {end}"),
    };
    let text = format!("{head}. {}, {}.", failures(paper, StudyMethod::Pem), failures(paper, StudyMethod::Hansen));
    Claim { outcome: ClaimOutcome::of(&[behind.is_some()]), text, ..claim }
}

/// `PEM leaves no usable model in 12 of 40 loops, the first at theta = 0.52`.
fn failures(paper: &Paper, method: StudyMethod) -> String {
    let all = overall(&paper.study, method, paper.settings.study.theta);
    let failed = paper.study.iter().filter(|r| r.method == method && r.failed());
    let first = failed.map(|r| r.theta).min_by(f64::total_cmp);
    let from = first.map_or_else(String::new, |theta| format!(" (the first at theta = {})", short(theta, 2)));
    format!(
        "{} leaves no usable model in {} of {}{from}",
        method.label(),
        all.failed(),
        count(all.count, "loop", "loops")
    )
}

fn rows(paper: &Paper, method: StudyMethod) -> Vec<&StudyRow> {
    paper.study.iter().filter(|r| r.method == method).collect()
}

fn medians(paper: &Paper) -> Claim {
    let claim = Claim {
        key: "figure-5-mean",
        source: "Fig. 5",
        claim: "The mean of the fit is higher when S is identified than when the plant is identified directly.",
        outcome: ClaimOutcome::Fails,
        text: String::new(),
    };
    if rows(paper, StudyMethod::Direct).is_empty() || rows(paper, StudyMethod::Hansen).is_empty() {
        return unknown(claim);
    }
    let of = |m: StudyMethod| overall(&paper.study, m, paper.settings.study.theta).median;
    let (direct, hansen) = (of(StudyMethod::Direct), of(StudyMethod::Hansen));
    let higher = [0, 1].map(|i| hansen[i] - direct[i] >= TIE);
    let text = format!(
        "At a noise of {} um rms the medians (horizontal and vertical) are {} for Hansen and {} for direct \
         identification. {}",
        short(paper.rig.sensor.noise.value, 3),
        both(hansen),
        both(direct),
        noise_level(paper)
    );
    Claim { outcome: ClaimOutcome::of(&higher), text, ..claim }
}

/// Where the map has Hansen before direct identification.
fn noise_level(paper: &Paper) -> String {
    let cells = map::cells(paper);
    let leads: Vec<(f64, f64)> =
        cells.iter().filter_map(|c| Some((c.at[1], c.lead(StudyMethod::Hansen, StudyMethod::Direct)?))).collect();
    let ahead = leads.iter().filter(|(_, lead)| *lead >= TIE);
    match ahead.clone().map(|(noise, _)| *noise).min_by(f64::total_cmp) {
        Some(noise) => format!(
            "In the crossover map Hansen leads it in {} of {}, the lowest noise among them is {} um.",
            ahead.count(),
            count(leads.len(), "cell", "cells"),
            short(noise, 3)
        ),
        None => format!("In the crossover map Hansen leads it in none of {}.", count(leads.len(), "cell", "cells")),
    }
}

fn spread(paper: &Paper) -> Claim {
    let claim = Claim {
        key: "figure-5-variance",
        source: "Fig. 5",
        claim: "The fit varies more when the plant is identified directly.",
        outcome: ClaimOutcome::Fails,
        text: String::new(),
    };
    if rows(paper, StudyMethod::Direct).is_empty() || rows(paper, StudyMethod::Hansen).is_empty() {
        return unknown(claim);
    }
    let quartiles = |m: StudyMethod, i: usize| {
        let fits: Vec<f64> = rows(paper, m).iter().map(|r| r.fit[i]).collect();
        quantile(&fits, 0.75) - quantile(&fits, 0.25)
    };
    let points = |v: f64| if v.is_finite() { percent(v, 1) } else { "unbounded".into() };
    let axis = |i: usize| {
        let (direct, hansen) = (quartiles(StudyMethod::Direct, i), quartiles(StudyMethod::Hansen, i));
        (direct > hansen, format!("{} {} against {}", AXES[i], points(direct), points(hansen)))
    };
    let found = [axis(0), axis(1)];
    let text = format!(
        "The quartiles lie apart by, in points, direct identification against Hansen: {}; {}.",
        found[0].1, found[1].1
    );
    Claim { outcome: ClaimOutcome::of(&[found[0].0, found[1].0]), text, ..claim }
}

/// Share of the loops below which an exception leaves a claim true in part.
const FEW: f64 = 0.05;

fn stability(paper: &Paper) -> Claim {
    let claim = Claim {
        key: "s-stable",
        source: "Introduction",
        claim: "The identified Youla deviation system is always stable.",
        outcome: ClaimOutcome::Fails,
        text: String::new(),
    };
    let all = rows(paper, StudyMethod::Hansen);
    if all.is_empty() {
        return unknown(claim);
    }
    let none = all.iter().filter(|r| r.status == RowStatus::Refused).count();
    let unstable = all.iter().filter(|r| r.status == RowStatus::Unstable).count();
    let reflected = all.iter().filter(|r| r.note.contains("reflected")).count();
    let text = format!(
        "The true S is stable in every loop. Its estimate came out unstable in {reflected} of {}, where its poles were reflected at \
         the unit circle and B and D found again; no model came from {none}, and {unstable} of the identified plants {} unstable.",
        count(all.len(), "loop", "loops"),
        if unstable == 1 { "is" } else { "are" }
    );
    let outcome = match (none + reflected, all.len()) {
        (0, _) => ClaimOutcome::Holds,
        (some, loops) if (some as f64) < FEW * loops as f64 => ClaimOutcome::Partly,
        _ => ClaimOutcome::Fails,
    };
    Claim { outcome, text, ..claim }
}
