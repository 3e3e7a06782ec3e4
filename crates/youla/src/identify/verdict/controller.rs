//! Whether the stated controller is the one that ran, by what its difference lets the loop do.
//!
//! ```text
//! e(t) = u_K - C x - D s,     x+ = A x + B s + L e        s: what the controller sees, u_K: the inputs that it explains
//! dF   = A_L^-1 S_ex S_xx^-1 S_xs (S_sx S_xx^-1 S_xs)^-1,   A_L = I - C (z I - A + L C)^-1 L
//! ```
//! e is the residual of the controller's difference equation: what happened once (a saturated sample) stays where it happened, also
//! behind an integrator. Samples of inputs at a limit, and those whose equation contains them, are left out. The error dF of the law counts as
//! `|dF T (I - F T)^-1|` with `s = T u` in the loop: a wrong gain or delay where the loop gain is small harms nobody.

use super::limits::{AS_STATED, AT_LIMIT, LARGEST_CONTROLLER_ERROR, LARGEST_INPUTS, NEARLY_EXACT};
use super::local_error::{Channels, LocalErrors, RecordLines, hann};
use super::partition::Partition;
use crate::identify::likelihood::data::spectra::lines_of;
use crate::identify::likelihood::{Evidence, LoopKnowledge, LoopSignals};
use crate::linalg::{RiccatiProblem, TINY, dare};
use crate::lti::{Discrete, StateSpace, frequency_response};
use crate::{Mat, MatRef, Result, c64};
use faer::Scale;
use faer::linalg::solvers::Solve;
use std::f64::consts::TAU;

/// Variance of the logged inputs against that of what drives the states, in the filter that takes e: small, so that e forgets within as many
/// samples as the controller has states.
const EXACT_LOG: f64 = 1e-9;

/// Share of a row of the observability matrix that must be new.
const INDEPENDENT: f64 = 1e-10;
/// Share that is left after as many samples as there are states: rounding.
const FORGOTTEN: f64 = 1e-4;

const QUESTION: &str =
    "What the difference of the stated controller from the log does to the loop, largest over frequency (controller)";

/// The test, with what share of the inputs the law leaves and how many samples were left out.
pub(crate) fn controller(known: &LoopKnowledge<'_>, plant: &StateSpace<Discrete>) -> Result<Option<Evidence>> {
    let Some(law) = known.controller else { return Ok(None) };
    let law = &observable_part(law)?;
    let all: Vec<&LoopSignals<'_>> = known.estimation.iter().chain(&known.verification).collect();
    if all.iter().any(|r| r.excitation.is_none()) {
        return Ok(Some(Evidence::untested(QUESTION, LARGEST_CONTROLLER_ERROR, "no external excitation is known")));
    }
    // An observer sees inputs and outputs, which the excitation moves together: its error counts per input of the plant, `dF T`.
    let observer = law.inputs() > plant.outputs();
    let gain = filter_gain(law, &all);
    let (residuals, beyond) = residuals(law, &gain, &all);
    let share = rest(&residuals, &all);
    if share < NEARLY_EXACT {
        let mut note = format!("the stated controller reproduces the logged inputs to {share:.1e}");
        if beyond {
            note += " but for those after the largest ones: they were logged before a limit";
        }
        note += &left_out(&residuals, &all);
        return Ok(Some(Evidence::new(QUESTION, 0.0, LARGEST_CONTROLLER_ERROR).noted(note)));
    }
    let lines: Vec<[Vec<c64>; 3]> = all
        .iter()
        .zip(&residuals)
        .filter_map(|(r, e)| {
            let windowed = |signal: MatRef<'_, f64>| hann(&lines_of(signal, 0), signal.ncols());
            let moved = if observer { r.applied } else { r.seen };
            Some([windowed(moved), windowed(e.values.as_ref()), windowed(r.excitation?)])
        })
        .collect();
    let records: Vec<RecordLines<'_>> = lines.iter().map(|[u, v, x]| RecordLines { u, v, x }).collect();
    let q = all.iter().filter_map(|r| r.excitation).map(|x| x.ncols()).max().unwrap_or(0);
    let channels = Channels { m: if observer { plant.inputs() } else { law.inputs() }, p: law.outputs(), q };
    let total: usize = records.iter().map(|r| r.v.len() / channels.p.max(1)).sum();
    let excess = LocalErrors::new(&records, channels, &Partition::equal(total, channels), 0).excess();
    if excess.is_empty() && share < AS_STATED {
        let note = format!(
            "the law leaves {:.2} % of the inputs, and the excitation moves too little of them to say more",
            100.0 * share
        );
        return Ok(Some(Evidence::new(QUESTION, 0.0, LARGEST_CONTROLLER_ERROR).noted(note)));
    }
    if excess.is_empty() {
        return Ok(Some(Evidence::untested(
            QUESTION,
            LARGEST_CONTROLLER_ERROR,
            "the excitation does not reach everything that the controller sees",
        )));
    }
    let Ok(worst) = worst(law, &gain, plant, |share| excess.near(share, channels.m * channels.p)) else {
        let why = "the stated controller or its filter has no finite response at a frequency that is judged";
        return Ok(Some(Evidence::untested(QUESTION, LARGEST_CONTROLLER_ERROR, why)));
    };
    let note = format!(
        "over all frequencies the law leaves {:.2} % of the inputs{}",
        100.0 * share,
        left_out(&residuals, &all)
    );
    let [figure, hz, significance] = worst;
    let evidence = Evidence::new(QUESTION, figure, LARGEST_CONTROLLER_ERROR).noted(note).at([hz, hz]);
    Ok(Some(evidence.beyond_chance(significance)))
}

/// Which part of the samples is at a limit, in words; nothing where none is.
fn left_out(residuals: &[Residual], records: &[&LoopSignals<'_>]) -> String {
    let at_limit: usize = residuals.iter().map(|r| r.left_out).sum();
    let samples: usize = records.iter().map(|r| r.seen.nrows()).sum();
    let part = 100.0 * at_limit as f64 / samples.max(1) as f64;
    if at_limit > 0 { format!("; {part:.2} % of the samples are at a limit and left out") } else { String::new() }
}

/// Whether the stated controller reproduces the logged inputs closely enough to be used in the estimate.
pub(crate) fn explains(known: &LoopKnowledge<'_>) -> bool {
    let Some(law) = known.controller.and_then(|law| observable_part(law).ok()) else { return true };
    let all: Vec<&LoopSignals<'_>> = known.estimation.iter().collect();
    let (residuals, _) = residuals(&law, &filter_gain(&law, &all), &all);
    rest(&residuals, &all) < AS_STATED
}

/// The largest error in the loop, its frequency in Hz and its standard deviations beyond chance.
fn worst(
    law: &StateSpace<Discrete>,
    gain: &Mat<f64>,
    plant: &StateSpace<Discrete>,
    near: impl Fn(f64) -> (Vec<f64>, f64),
) -> Result<[f64; 3]> {
    let ts = law.time().ts();
    let shares: Vec<f64> = (0..150).map(|k| 0.001 * 480.0_f64.powf(f64::from(k) / 149.0)).collect();
    let omega: Vec<f64> = shares.iter().map(|share| TAU * share / ts).collect();
    let whitening = StateSpace::new(
        law.a() - gain * law.c(),
        gain.clone(),
        -law.c().to_owned(),
        Mat::identity(law.outputs(), law.outputs()),
        law.time(),
    )?;
    let [f, g, a] = [law, plant, &whitening].map(|s| frequency_response(s, &omega));
    let (f, g, a) = (f?, g?, a?);
    let mut worst = [0.0, 0.0, 0.0];
    for (k, share) in shares.iter().enumerate() {
        let (squares, significance) = near(*share);
        if squares.iter().all(|s| *s == 0.0) {
            worst[2] = significance.max(worst[2]);
            continue;
        }
        let (m, p) = (g.at(k).ncols(), g.at(k).nrows());
        let with_inputs = law.inputs() - p;
        let seen = Mat::from_fn(law.inputs(), m, |i, j| match i.checked_sub(with_inputs) {
            Some(i) => g.at(k)[(i, j)],
            None if i == j => c64::ONE,
            None => c64::ZERO,
        });
        let difference = Mat::<c64>::identity(m, m) - f.at(k) * &seen;
        let sensitivity = difference.partial_piv_lu().solve(Mat::<c64>::identity(m, m));
        let right = if with_inputs > 0 { sensitivity } else { &seen * sensitivity };
        let left = a.at(k).to_owned().partial_piv_lu().solve(Mat::<c64>::identity(m, m));
        // The change of one entry has one singular value.
        let of_entry = |(at, square): (usize, &f64)| {
            let (i, j) = (at / right.nrows(), at % right.nrows());
            square.max(0.0) * (left.col(i).norm_l2() * right.row(j).norm_l2()).powi(2)
        };
        let figure = squares.iter().enumerate().map(of_entry).sum::<f64>().sqrt();
        if figure > worst[0] {
            worst = [figure, share / ts, significance.max(worst[2])];
        }
    }
    Ok(worst)
}

/// What the outputs of a law show of its states.
struct Observed {
    /// Orthonormal rows that span those of `C, C A, C A^2, ...`.
    basis: Vec<Mat<f64>>,
    /// Of each output the rows `c, c A, ...` that are independent of those before them.
    chains: Vec<Vec<Mat<f64>>>,
}

impl Observed {
    fn new(law: &StateSpace<Discrete>) -> Self {
        let (n, m) = (law.order(), law.outputs());
        let mut chains: Vec<Vec<Mat<f64>>> = vec![Vec::new(); m];
        let mut basis: Vec<Mat<f64>> = Vec::new();
        let mut open: Vec<Option<Mat<f64>>> = (0..m).map(|i| Some(law.c().subrows(i, 1).to_owned())).collect();
        while basis.len() < n && open.iter().any(Option::is_some) {
            for i in 0..m {
                let Some(row) = open[i].take().filter(|_| basis.len() < n) else { continue };
                let mut rest = row.clone();
                // Twice is enough (Kahan).
                for _ in 0..2 {
                    for b in &basis {
                        let along = (&rest * b.transpose())[(0, 0)];
                        rest -= b * Scale(along);
                    }
                }
                let left = rest.norm_l2();
                if left > INDEPENDENT * row.norm_l2() {
                    basis.push(rest * Scale(1.0 / left));
                    open[i] = Some(&row * law.a());
                    chains[i].push(row);
                }
            }
        }
        Observed { basis, chains }
    }
}

/// The law without states that its outputs do not show, `(Q A Q', Q B, C Q', D)`: an integrator that a PID without an integral gain carries
/// along leaves the residual of no row a memory.
fn observable_part(law: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let basis = Observed::new(law).basis;
    if basis.len() == law.order() {
        return Ok(law.clone());
    }
    let rows = Mat::from_fn(basis.len(), law.order(), |i, j| basis[i][(0, j)]);
    let [a, b, c] = [&rows * law.a() * rows.transpose(), &rows * law.b(), law.c() * rows.transpose()];
    StateSpace::new(a, b, c, law.d().to_owned(), law.time())
}

/// L after which e forgets within as many samples as the controller has states, `(A - L C)^n = 0`: then e is the residual of the difference
/// equation. With q_i the vector of the chain of output i, `c_k A^j q_i = 0` for `j < nu_i - 1`, it is `L M = [A^nu_i q_i]`, `M = C [A^(nu_i - 1) q_i]`
/// (Ackermann's formula for one output). `None` where rounding or different lengths of the chains leave a memory.
fn deadbeat_gain(law: &StateSpace<Discrete>) -> Option<Mat<f64>> {
    let (n, m) = (law.order(), law.outputs());
    let Observed { basis, chains } = Observed::new(law);
    if basis.len() < n || chains.iter().any(Vec::is_empty) {
        return None;
    }
    let rows: Vec<&Mat<f64>> = chains.iter().flatten().collect();
    let seen = Mat::from_fn(n, n, |i, j| rows[i][(0, j)]);
    let inverse = seen.partial_piv_lu().solve(Mat::<f64>::identity(n, n));
    let mut last = 0;
    let (mut ends, mut beyond) = (Mat::<f64>::zeros(n, m), Mat::<f64>::zeros(n, m));
    for (i, chain) in chains.iter().enumerate() {
        last += chain.len();
        let mut q = inverse.subcols(last - 1, 1).to_owned();
        (1..chain.len()).for_each(|_| q = law.a() * &q);
        ends.col_mut(i).copy_from(q.col(0));
        beyond.col_mut(i).copy_from((law.a() * &q).col(0));
    }
    let through = law.c() * &ends;
    let gain = through.transpose().partial_piv_lu().solve(beyond.transpose()).transpose().to_owned();
    let forgets = law.a() - &gain * law.c();
    let memory = (1..n).fold(forgets.clone(), |power, _| &power * &forgets);
    (memory.norm_l2() < FORGOTTEN * forgets.norm_l2()).then_some(gain)
}

/// L of [`deadbeat_gain`], else of a Kalman filter; zero for a static law, and where the Riccati equation has no solution.
fn filter_gain(law: &StateSpace<Discrete>, records: &[&LoopSignals<'_>]) -> Mat<f64> {
    let (n, m) = (law.order(), law.outputs());
    let none = Mat::zeros(n, m);
    if n == 0 {
        return none;
    }
    if let Some(gain) = deadbeat_gain(law) {
        return gain;
    }
    let power = |column: &dyn Fn(&LoopSignals<'_>) -> f64| records.iter().map(|r| column(r)).sum::<f64>().max(TINY);
    let seen = Mat::from_fn(law.inputs(), law.inputs(), |i, j| {
        if i == j { power(&|r: &LoopSignals<'_>| r.seen.col(i).squared_norm_l2()) } else { 0.0 }
    });
    let noise = Mat::from_fn(m, m, |i, j| {
        if i == j { EXACT_LOG * power(&|r: &LoopSignals<'_>| r.explained.col(i).squared_norm_l2()) } else { 0.0 }
    });
    let driven = law.b() * &seen * law.b().transpose();
    let trace = (0..n).map(|i| driven[(i, i)]).sum::<f64>() / n as f64 * EXACT_LOG;
    let driven = (&driven + driven.transpose()) * Scale(0.5) + Mat::<f64>::identity(n, n) * Scale(trace);
    let dual = RiccatiProblem {
        a: law.a().transpose(),
        b: law.c().transpose(),
        q: driven.as_ref(),
        r: noise.as_ref(),
        s: None,
    };
    dare("the filter of the controller", &dual).map_or(none, |found| found.gain.transpose().to_owned())
}

/// Residual of the law, and the samples that were left out.
struct Residual {
    values: Mat<f64>,
    left_out: usize,
}

/// The residuals, and whether the largest inputs had to be left out for the law to hold: a command that is logged before a limit shows it where
/// the controller goes on with what the limit left.
fn residuals(law: &StateSpace<Discrete>, gain: &Mat<f64>, records: &[&LoopSignals<'_>]) -> (Vec<Residual>, bool) {
    let without = |limited: fn(&LoopSignals<'_>) -> Vec<bool>| -> Vec<Residual> {
        records.iter().map(|r| residual(law, gain, r, &limited(r))).collect()
    };
    let all = without(at_limit);
    if rest(&all, records) < NEARLY_EXACT {
        return (all, false);
    }
    let below = without(among_largest);
    match rest(&below, records) < NEARLY_EXACT {
        true => (below, true),
        false => (all, false),
    }
}

fn residual(law: &StateSpace<Discrete>, gain: &Mat<f64>, r: &LoopSignals<'_>, limited: &[bool]) -> Residual {
    let (rows, n, m, q) = (r.seen.nrows(), law.order(), law.outputs(), law.inputs());
    let (mut x, mut values, mut left_out) = (vec![0.0; n], Mat::<f64>::zeros(rows, m), 0);
    // The first samples show where the states started.
    let mut blind = n;
    for t in 0..rows {
        let mut e = vec![0.0; m];
        for (i, e) in e.iter_mut().enumerate() {
            let states: f64 = (0..n).map(|k| law.c()[(i, k)] * x[k]).sum();
            let direct: f64 = (0..q).map(|k| law.d()[(i, k)] * r.seen[(t, k)]).sum();
            *e = r.explained[(t, i)] - states - direct;
        }
        let next = |k: usize| {
            let states: f64 = (0..n).map(|l| law.a()[(k, l)] * x[l]).sum();
            let inputs: f64 = (0..q).map(|l| law.b()[(k, l)] * r.seen[(t, l)]).sum();
            states + inputs + (0..m).map(|i| gain[(k, i)] * e[i]).sum::<f64>()
        };
        x = (0..n).map(next).collect();
        if limited[t] {
            blind = n + 1;
        }
        if blind > 0 {
            blind -= 1;
            left_out += usize::from(limited[t]);
            continue;
        }
        (0..m).for_each(|i| values[(t, i)] = e[i]);
    }
    Residual { values, left_out }
}

/// Share of the samples of some records in which an input is at a limit.
pub(crate) fn share_at_limit(records: &[LoopSignals<'_>]) -> f64 {
    let limited: Vec<bool> = records.iter().flat_map(at_limit).collect();
    limited.iter().filter(|limited| **limited).count() as f64 / limited.len().max(1) as f64
}

/// Samples in which an input is at its largest or least value, where it is so several times in a record.
fn at_limit(r: &LoopSignals<'_>) -> Vec<bool> {
    let mut out = vec![false; r.applied.nrows()];
    for column in r.applied.col_iter() {
        let values: Vec<f64> = column.iter().copied().collect();
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let slack = 1e-6 * (largest - least);
        for (limit, sign) in [(largest, 1.0), (least, -1.0)] {
            let at = |v: &f64| sign * (limit - v) <= slack;
            let count = values.iter().filter(|v| at(v)).count();
            // An excitation of two values through a gain is at its limits half of the time; a limit that binds is rare or a plateau.
            if (AT_LIMIT.0..=values.len() / AT_LIMIT.1).contains(&count) {
                values.iter().zip(&mut out).for_each(|(v, out)| *out |= at(v));
            }
        }
    }
    out
}

/// Samples in which an input is among the [`LARGEST_INPUTS`] of a record.
fn among_largest(r: &LoopSignals<'_>) -> Vec<bool> {
    let mut out = vec![false; r.applied.nrows()];
    for column in r.applied.col_iter() {
        let mut sizes: Vec<f64> = column.iter().map(|v| v.abs()).collect();
        let place = (LARGEST_INPUTS * sizes.len() as f64) as usize;
        if let Some(most) = sizes.len().checked_sub(1) {
            let limit = *sizes.select_nth_unstable_by(most.saturating_sub(place), f64::total_cmp).1;
            column.iter().zip(&mut out).for_each(|(v, out)| *out |= v.abs() >= limit);
        }
    }
    out
}

/// Size of the residuals over that of the inputs, at most ten times these.
fn rest(residuals: &[Residual], records: &[&LoopSignals<'_>]) -> f64 {
    let left: f64 = residuals.iter().map(|r| r.values.squared_norm_l2()).sum();
    let all: f64 = records.iter().map(|r| r.explained.squared_norm_l2().max(r.applied.squared_norm_l2())).sum();
    (left / all.max(TINY)).sqrt().min(10.0)
}
