//! Exports in the hands of those for whom they are made: C99 headers through `gcc -std=c99 -Wall -Wextra -Werror`, scripts and data
//! through Python (numpy, scipy, python-control; `PYTHON` names the interpreter) and Octave. These tests are ignored unless asked for,
//! and fail where the program is absent.

mod c;
mod c_loop;
mod c_loop_parts;
mod scripts;

use std::ffi::OsStr;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla_io::export::NamedModel;

/// A folder of its own below that of temporary files, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exports").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The model with channels whose names are hard to quote.
fn named(system: &StateSpace<Discrete>) -> NamedModel {
    let channels =
        |name: &str, count| (1..=count).map(|k| Channel::new(format!("{name}{k}"), "µm/s²")).collect::<Vec<_>>();
    let inputs = channels("it's a \"u\" \\ */ % ", system.inputs());
    NamedModel::new("hansen", system.clone(), (inputs, channels("y", system.outputs()))).unwrap()
}

/// What a program prints, given this on its standard input.
fn output(program: impl AsRef<OsStr>, arguments: &[&str], folder: &Path, input: &str) -> String {
    let mut command = Command::new(program.as_ref());
    command.args(arguments).current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap_or_else(|e| panic!("{}: {e}", program.as_ref().to_string_lossy()));
    let (mut stdin, input) = (child.stdin.take().unwrap(), input.to_owned());
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let found = child.wait_with_output().unwrap();
    let _ = writer.join();
    let errors = String::from_utf8_lossy(&found.stderr);
    assert!(found.status.success(), "{arguments:?}: {}\n{errors}", found.status);
    String::from_utf8_lossy(&found.stdout).into_owned()
}
