//! Completions and man page, both from the description of the command line.

use crate::output::{Failure, say};
use clap::Command;
use std::path::Path;

/// Prints the completions of a shell.
pub(crate) fn completions(shell: clap_complete::Shell, mut program: Command) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut program, "youla", &mut text);
    say(String::from_utf8_lossy(&text).trim_end())
}

/// Prints the man page of the program, with a section for each verb, in roff.
pub(crate) fn man_page(program: &Command) -> Result<(), Failure> {
    let mut text = Vec::new();
    let rendered = clap_mangen::Man::new(program.clone()).render(&mut text);
    rendered.map_err(|source| Failure::io(Path::new("the man page"), source))?;
    for verb in program.get_subcommands() {
        let page = clap_mangen::Man::new(verb.clone());
        let title = format!(".SH \"YOULA {}\"\n", verb.get_name().to_uppercase());
        text.extend(title.into_bytes());
        let sections = page.render_description_section(&mut text).and_then(|()| page.render_options_section(&mut text));
        sections.map_err(|source| Failure::io(Path::new("the man page"), source))?;
    }
    say(String::from_utf8_lossy(&text).trim_end())
}
