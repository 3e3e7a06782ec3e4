//! No reader panics on, or lets itself be talked into memory by, what a user may hand in: the seeds of the fuzz targets
//! (`fuzz/`), seeded mutations of them, and bombs that announce far more than they hold.
//! `YOULA_MUTATIONS=1000000 cargo test -p youla-tests readers` tries more of them for each reader.

mod bombs;
mod memory;
mod mutations;
mod seeds;
#[allow(dead_code)]
mod targets;

use mutations::Mutations;
use std::panic::catch_unwind;
use std::process::Command;
use targets::READERS;

/// Most bytes that an input of at most 4 kB may make the process grow by. Deflate packs up to 1032 bytes into one, 4 MB in
/// all, and a table of 4 million empty cells takes 24 bytes of each.
const MOST: usize = 512 << 20;

const MUTATION: &str = "a mutation";

/// Memory is counted per process, so the readers run in a process of their own.
#[test]
fn seeds_mutations_and_bombs_neither_panic_nor_exhaust_memory() {
    const ALONE: &str = "YOULA_READERS_ALONE";
    if std::env::var_os(ALONE).is_some() {
        return read_all();
    }
    let test = "readers::seeds_mutations_and_bombs_neither_panic_nor_exhaust_memory";
    let program = std::env::current_exe().unwrap();
    let outcome = Command::new(program).args(["--exact", test]).env(ALONE, "1").output().unwrap();
    assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stdout));
}

fn read_all() {
    let count = std::env::var("YOULA_MUTATIONS").map_or(10_000, |text| text.parse().expect("a number"));
    let chosen = std::env::var("YOULA_READER").ok();
    std::panic::set_hook(Box::new(|_| ()));
    let mut failures = Vec::new();
    for (number, (name, read)) in READERS.into_iter().enumerate() {
        if chosen.as_deref().is_some_and(|chosen| chosen != name) {
            continue;
        }
        let seeds = seeds::of(name);
        assert!(!seeds.is_empty(), "{name} has seeds");
        let mut attempt = |what: &str, input: &[u8]| {
            let before = if what == MUTATION { None } else { memory::peak() };
            let panics = catch_unwind(|| read(input)).is_err();
            let grown = before.and_then(|before| Some(memory::peak()? - before)).unwrap_or(0);
            if panics || grown > MOST {
                failures.push(format!("{name}, {what}, panic: {panics}, grown by {grown}: {:?}", text(input)));
            }
        };
        seeds.iter().for_each(|seed| attempt("a seed", seed));
        bombs::of(name).iter().for_each(|(what, bomb)| attempt(what, bomb));
        let before = memory::peak();
        let mut mutations = Mutations::new(&seeds, number as u64);
        (0..count).for_each(|_| attempt(MUTATION, mutations.next()));
        if let (Some(before), Some(after)) = (before, memory::peak()) {
            assert!(after - before <= MOST, "mutations for {name} made the process grow by {} bytes", after - before);
        }
    }
    let _ = std::panic::take_hook();
    assert!(
        failures.is_empty(),
        "{} failures, such as\n{}",
        failures.len(),
        failures[..failures.len().min(10)].join("\n")
    );
}

fn text(input: &[u8]) -> String {
    String::from_utf8_lossy(&input[..input.len().min(2000)]).into_owned()
}
