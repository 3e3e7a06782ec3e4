//! One binary for all readers, which is built and linked once: the variable `YOULA_READER` names the reader.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/files/readers/targets.rs"]
mod readers;

use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;

static READ: OnceLock<fn(&[u8])> = OnceLock::new();

fuzz_target!(|bytes: &[u8]| READ.get_or_init(chosen)(bytes));

fn chosen() -> fn(&[u8]) {
    let name = std::env::var("YOULA_READER").unwrap_or_default();
    let reader = readers::READERS.into_iter().find(|(known, _)| *known == name);
    reader.unwrap_or_else(|| panic!("YOULA_READER is \"{name}\", which names no reader")).1
}
