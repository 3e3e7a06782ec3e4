//! Closed loops with known truth, made from families and seeds, and what the recommended model makes of them with nothing given but the
//! loop. The first table of docs/accuracy.md that needs nothing but this repository.
//!
//! ```text
//! cargo run --release -p youla-cli --example families -- [loops of each family] [first seed] [family]
//! ```
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

#[path = "families/mod.rs"]
mod families;

use faer::linalg::solvers::DenseSolveCore;
use families::{FAMILIES, Family, Log, Loop};
use rayon::prelude::*;
use youla::identify::likelihood::{LikelihoodOptions, Recommendation};
use youla::lti::frequency_response;
use youla::statistics::quantile;
use youla::{Mat, Result, c64};

/// A model is good with a relative error up to this, the median over frequency,
const ERROR: f64 = 0.05;
/// or with an error in the loop up to this, `max over w of sigma_max(dG K (I - G K)^-1)`,
const LOOP_ERROR: f64 = 0.1;
/// or with errors up to this many times what the noise of the records leaves, root mean square.
const NOISE_RATIO: f64 = 3.0;

struct Score {
    trusted: bool,
    /// Whether `min over w of sigma_min(I - G K)` of the truth is at least half of that of the model.
    half_of_margin: bool,
    error: f64,
    in_loop: f64,
    /// Root mean square of the error over the deviation that the noise leaves, and over the total one.
    ratios: [f64; 2],
    reasons: Vec<String>,
}

impl Score {
    fn good(&self) -> bool {
        self.error <= ERROR || self.in_loop <= LOOP_ERROR || self.ratios[0] <= NOISE_RATIO
    }
}

fn score(system: &Loop, found: &Recommendation) -> Result<Score> {
    let omega: Vec<f64> = found.region.hz.iter().map(|f| std::f64::consts::TAU * f).collect();
    let of = |s| frequency_response(s, &omega);
    let (truth, model, k) = (of(&system.plant)?, of(&found.plant)?, of(system.controller.system())?);
    let (mut errors, mut in_loop, mut sums, mut count) = (Vec::new(), 0.0f64, [0.0; 2], 0.0);
    let mut margins = [f64::INFINITY; 2];
    for w in 0..omega.len() {
        let (g, k) = (truth.at(w), k.at(w));
        let dg = model.at(w) - g;
        errors.push(dg.norm_l2() / g.norm_l2());
        let one = Mat::<c64>::identity(g.nrows(), g.nrows());
        let [closed, of_model] = [g, model.at(w)].map(|g| &one - g * k);
        for (margin, at) in margins.iter_mut().zip([&closed, &of_model]) {
            *margin = at.singular_values().unwrap().into_iter().fold(*margin, f64::min);
        }
        let complementary = &dg * k * closed.partial_piv_lu().inverse();
        let largest = complementary.singular_values().unwrap();
        in_loop = largest.into_iter().fold(in_loop, f64::max);
        for (i, j) in (0..g.nrows()).flat_map(|i| (0..g.ncols()).map(move |j| (i, j))) {
            let error = dg[(i, j)].norm_sqr();
            sums[0] += error / found.region.parts.noise[w][(i, j)].powi(2);
            sums[1] += error / found.region.absolute[w][(i, j)].powi(2);
            count += 1.0;
        }
    }
    let ratios = sums.map(|sum| (sum / count).sqrt());
    let half_of_margin = margins[0] >= 0.5 * margins[1];
    let (trusted, reasons) = (found.trusted(), found.reasons());
    Ok(Score { trusted, half_of_margin, error: median(errors), in_loop, ratios, reasons })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    if values.is_empty() { f64::NAN } else { quantile(&values, 0.5) }
}

/// A model, or the reason of a refusal.
fn solved(family: &Family, seed: u64) -> Result<std::result::Result<Score, String>> {
    let system = family.system(seed)?;
    let log: Log = system.log(seed)?;
    let [records, fresh] = log.records(system.plant.time())?;
    match youla::identify(&records, &fresh, &system.stated, None, &LikelihoodOptions::default()) {
        Ok(found) => Ok(Ok(score(&system, &found.model)?)),
        Err(refused) => Ok(Err(refused.to_string())),
    }
}

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| given.get(k).map_or(default, |v| v.parse().expect("a number"));
    let (loops, first) = (number(0, 10), number(1, 1));
    println!(
        "| family | good, trusted | good, not trusted | wrong, trusted | wrong, not trusted | refused | error, median | over noise | z | less than half of the margin |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    for family in FAMILIES.iter().filter(|f| given.get(2).is_none_or(|name| f.name == name)) {
        let all: Vec<_> =
            (first..first + loops).into_par_iter().map(|seed| solved(family, seed)).collect::<Result<Vec<_>>>()?;
        let known: Vec<&Score> = all.iter().filter_map(|s| s.as_ref().ok()).collect();
        let count = |good: bool, trusted: bool| {
            known.iter().filter(|s| (s.good() && family.honest) == good && s.trusted == trusted).count()
        };
        let of = |pick: fn(&Score) -> f64| median(known.iter().map(|s| pick(s)).collect());
        println!(
            "| {} | {} | {} | {} | {} | {} | {:.4} | {:.2} | {:.2} | {} |",
            family.name,
            count(true, true),
            count(true, false),
            count(false, true),
            count(false, false),
            all.len() - known.len(),
            of(|s| s.error),
            of(|s| s.ratios[0]),
            of(|s| s.ratios[1]),
            known.iter().filter(|s| s.trusted && !s.half_of_margin).count(),
        );
        all.iter().zip(first..).for_each(|(s, seed)| match s {
            Err(reason) => eprintln!("{} {seed}: {reason}", family.name),
            Ok(s) if s.trusted != (s.good() && family.honest) => {
                let [noise, _] = s.ratios;
                eprintln!(
                    "{} {seed}: error {:.3}, in the loop {:.3}, over noise {noise:.2}: {:?}",
                    family.name, s.error, s.in_loop, s.reasons
                );
            }
            Ok(_) => {}
        });
    }
    Ok(())
}
