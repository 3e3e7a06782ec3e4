//! The pages of the book on accuracy and speed, measured: `cargo bench -p youla-cli --bench pages` writes `docs/book/accuracy.md` and
//! `docs/book/speed.md`. Everything is seeded; what differs between machines is time, and the last digits of residuals.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod accuracy;
mod equations;
mod page;
mod speed;

#[path = "../timing/mod.rs"]
mod timing;

#[path = "../../../../tests/common/mod.rs"]
mod common;

use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let wanted = |name: &str| asked.is_empty() || asked.iter().any(|a| a == name);
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book");
    if wanted("accuracy") {
        std::fs::write(book.join("accuracy.md"), accuracy::page()?)?;
    }
    if wanted("speed") {
        std::fs::write(book.join("speed.md"), speed::page()?)?;
    }
    Ok(())
}
