//! How often the check of the data is wrong: findings on clean logs, and planted defects that are not found.
//!
//! `cargo run --release -p youla-loop --example check_rates [clean logs] [logs of each defect] [first seed] [list]`; the table is in
//! docs/check.md.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod defects;
mod logs;
mod machines;
mod recipes;

use logs::{Log, Recipe, SHAPES, log};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use recipes::{clean, other, with_defect};
use std::error::Error;
use std::ops::Range;
use youla_loop::check::{Finding, Severity, Test};

/// Whether a finding holds for a clean log of a recipe.
fn holds(finding: &Finding, recipe: &Recipe, log: &Log) -> bool {
    match (finding.test, finding.severity) {
        (_, Severity::Note) if finding.test == Test::Delay && finding.what.contains("dead time") => {
            finding.numbers.get("lag").is_some_and(|lag| *lag == log.dead_time as f64 + 1.0)
        }
        (_, Severity::Note) => true,
        // Without a controller in the settings the log of a loop is to be told from an open one.
        (Test::Feedback, Severity::Caution) => !recipe.declared,
        // The lines of an excitation that is not logged are lines that nothing explains.
        (Test::Lines, Severity::Caution) => !recipe.known,
        _ => false,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: usize| arguments.get(k).and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (of_clean, of_defects, first, list) = (number(0, 500), number(1, 20), number(2, 0), arguments.len() > 3);
    let clean_seeds = first..first + of_clean;
    clean_logs("", clean_seeds.clone(), clean, list)?;
    clean_logs("other ", clean_seeds, other, list)?;
    println!("\n| planted | found and named |\n|---|---|");
    let (mut all, mut named) = (0, 0);
    for (place, defect) in defects::ALL.iter().enumerate() {
        let one = |k: usize| -> Result<bool, String> {
            let recipe = with_defect(defect.name, first + 100 * place + k);
            let mut made = log(&recipe).map_err(|e| e.to_string())?;
            (defect.plant)(&mut made, &mut ChaCha8Rng::seed_from_u64((first + k) as u64));
            let found = made.check().map_err(|e| e.to_string())?;
            let named = defect.is_named_by(&found);
            if list && !named {
                let said: Vec<String> =
                    found.iter().map(|f| format!("    {} {}", f.severity.word(), f.sentence())).collect();
                println!(
                    "{} {k} {} {}\n{}",
                    defect.name,
                    machines::name(recipe.kind),
                    SHAPES[recipe.shape],
                    said.join("\n")
                );
            }
            Ok(named)
        };
        let found: Vec<bool> = (0..of_defects).into_par_iter().map(one).collect::<Result<_, _>>()?;
        let count = found.iter().filter(|named| **named).count();
        (all, named) = (all + of_defects, named + count);
        println!("| {} | {count} of {of_defects} |", defect.name);
    }
    let refused = (0..of_defects).filter(|k| {
        let made = log(&with_defect("NaN", first + *k));
        made.is_ok_and(|mut made| {
            defects::not_a_number(&mut made, &mut ChaCha8Rng::seed_from_u64((first + *k) as u64));
            defects::refused(&made)
        })
    });
    let refused = refused.count();
    println!("| not a number (refused by the reader) | {refused} of {of_defects} |");
    let share = 100.0 * (named + refused) as f64 / (all + of_defects) as f64;
    println!("| all | {} of {}, {share:.1} % |", named + refused, all + of_defects);
    Ok(())
}

fn clean_logs(which: &str, seeds: Range<usize>, made: fn(usize) -> Recipe, list: bool) -> Result<(), Box<dyn Error>> {
    let one = |seed: usize| -> Result<[usize; 3], String> {
        let recipe = made(seed);
        let made = log(&recipe).map_err(|e| e.to_string())?;
        let found = made.check().map_err(|e| e.to_string())?;
        let wrong: Vec<&Finding> = found.iter().filter(|f| !holds(f, &recipe, &made)).collect();
        if list {
            for f in &wrong {
                let (kind, shape) = (machines::name(recipe.kind), SHAPES[recipe.shape % SHAPES.len()]);
                let about = format!(
                    "{kind}, {shape}, noise {}, reference {}, declared {}, known {}, hold {}, bits {:?}, dead time {}",
                    recipe.noise,
                    recipe.at_reference,
                    recipe.declared,
                    recipe.known,
                    recipe.hold,
                    recipe.bits,
                    made.dead_time
                );
                println!("{seed} ({about}): {} {:?} {}", f.severity.word(), f.test, f.sentence());
            }
        }
        let has = |severity| usize::from(wrong.iter().any(|f| f.severity == severity));
        Ok([has(Severity::Defect), has(Severity::Caution), has(Severity::Note)])
    };
    let count = seeds.len();
    let all: Vec<[usize; 3]> = seeds.into_par_iter().map(one).collect::<Result<_, _>>()?;
    let sum = |k: usize| all.iter().map(|a| a[k]).sum::<usize>();
    println!("\n| {count} {which}clean logs | logs |\n|---|---|");
    println!(
        "| with a false defect | {} |\n| with a false caution | {} |\n| with a wrong dead time | {} |",
        sum(0),
        sum(1),
        sum(2)
    );
    Ok(())
}
