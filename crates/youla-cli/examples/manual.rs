//! Man page and completions of the program: `manual man`, `manual bash`, `manual zsh`, `manual fish`, `manual powershell`, `manual elvish`.
#![allow(missing_docs, clippy::print_stdout)]

use clap_complete::Shell;
use clap_mangen::Man;
use std::error::Error;
use std::io::Write;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted = std::env::args().nth(1).unwrap_or_else(|| "man".into());
    let mut out = std::io::stdout().lock();
    let mut program = youla_cli::command();
    if wanted != "man" {
        clap_complete::generate(wanted.parse::<Shell>()?, &mut program, "youla", &mut out);
        return Ok(());
    }
    Man::new(program.clone()).render(&mut out)?;
    // A section for each verb.
    for verb in program.get_subcommands() {
        let page = Man::new(verb.clone());
        writeln!(out, ".SH \"YOULA {}\"", verb.get_name().to_uppercase())?;
        page.render_description_section(&mut out)?;
        page.render_options_section(&mut out)?;
    }
    Ok(())
}
