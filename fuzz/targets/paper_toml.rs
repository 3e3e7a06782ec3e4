#![no_main]
#[allow(dead_code)]
#[path = "../../crates/youla/tests/readers/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| readers::paper_toml(bytes));
