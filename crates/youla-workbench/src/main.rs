//! One request on standard input, its answer on standard output.

use std::io::{Read, Write, stderr, stdin, stdout};

fn main() -> std::io::Result<()> {
    let mut request = String::new();
    stdin().read_to_string(&mut request)?;
    // The page reads stages of a run from standard error, a line each.
    let mut announce = |stage: &str| drop(writeln!(stderr(), "{stage}"));
    stdout().write_all(youla_workbench::answer(&request, &mut announce).as_bytes())
}
