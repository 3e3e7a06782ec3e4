//! A run as the program makes it: run.toml and a CSV log in, a folder with report and models out.
//!
//! `cargo run -p youla-cli --example 02_report`

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod machine;

use std::fmt::Write;
use std::fs;
use std::path::Path;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla_io::export::{ModelFormat, NamedModel, export_model};
use youla_run::{RunSettings, Stage, StageClock, identify, read_records, write_run};

const RUN: &str = r#"
name = "bearing"
[data]
sample_time = 2e-4
inputs = [{ name = "u_h", unit = "V" }, { name = "u_v", unit = "V" }]
outputs = [{ name = "y_h", unit = "um" }, { name = "y_v", unit = "um" }]
alpha = [{ name = "alpha_h", unit = "V" }, { name = "alpha_v", unit = "V" }]
estimation = [{ file = "log.csv", take = 20000 }]
verification = [{ file = "log.csv", skip = 20000, name = "rest" }]
[nominal.model_file]
file = "nominal.json"
[controller.model_file]
feedback = "positive"
file = "controller.json"
[hansen]
horizon = 30
order = 12
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::temp_dir().join("youla-example-02");
    fs::create_dir_all(&folder)?;
    prepare(&folder)?;

    let settings = RunSettings::parse(RUN, &folder.join("run.toml"))?;
    let records = read_records(&settings.data, &folder)?;
    let mut announce = |stage: Stage| println!("{} ...", stage.name());
    let mut clock = StageClock::new(&mut announce);
    let found = identify(settings, records, &folder, &mut clock)?;
    let written = write_run(&found, &folder.join("run"), true, &mut clock)?;
    println!("open {}", written.folder.join("report.html").display());
    Ok(())
}

/// A log, a nominal model and a controller as a user has them.
fn prepare(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let machine = machine::bearing()?;
    let log = machine.log(30_000, 0.3, 1)?;
    let mut text = String::from("u_h,u_v,y_h,y_v,alpha_h,alpha_v\n");
    for k in 0..log.u.nrows() {
        let row: Vec<String> =
            [&log.u, &log.y, &log.alpha].iter().flat_map(|m| [m[(k, 0)], m[(k, 1)]]).map(|v| v.to_string()).collect();
        writeln!(text, "{}", row.join(","))?;
    }
    fs::write(folder.join("log.csv"), text)?;
    let (u, y) = (channels("u", "V"), channels("y", "um"));
    save(folder, "nominal", machine.nominal.clone(), u.clone(), y.clone())?;
    save(folder, "controller", machine.factors.controller()?, y, u)
}

fn channels(letter: &str, unit: &str) -> Vec<Channel> {
    ["h", "v"].map(|axis| Channel::new(format!("{letter}_{axis}"), unit)).into()
}

type Saved = Result<(), Box<dyn std::error::Error>>;

fn save(folder: &Path, name: &str, g: StateSpace<Discrete>, u: Vec<Channel>, y: Vec<Channel>) -> Saved {
    let model = NamedModel::new(name, g, (u, y))?;
    Ok(fs::write(folder.join(format!("{name}.json")), export_model(&model, ModelFormat::Json)?)?)
}
