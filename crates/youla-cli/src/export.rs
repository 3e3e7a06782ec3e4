//! `youla export`: a model or the controller of a run, for another tool.

use crate::output::{Failure, Form};
use crate::run_folder::place;
use clap::Args;
use std::path::PathBuf;
use youla_io::export::{ModelFormat, PidForm, c_controller, c_loop, export_model, export_pid, write_export};
use youla_io::require_free;
use youla_run::{caution_for_export, controller_for_export, loop_for_export, model_for_export, pid_for_export};

pub(crate) const EXAMPLES: &str = "\
Examples:
  youla export runs/demo-levitated-mass-001 --to python     recommended.py, which makes a control.ss of python-control
  youla export runs/demo-levitated-mass-001 --to npz --model hansen_reduced --out model.npz
  youla export model.json --to matlab --out g.m
  youla export runs/demo-levitated-mass-001 --to c-controller --out controller.h
  youla export runs/rotor-001 --to c-loop --out loop.h
  youla export runs/demo-levitated-mass-001 --to c-controller --q runs/demo-levitated-mass-001/8-redesign/controller.json";

/// What is exported as what.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// A run folder, or a model as JSON, MATLAB or NumPy file.
    #[arg(value_name = "RUN|MODEL")]
    source: PathBuf,
    /// mat, json, npz, python, matlab, c (C99 header of the model), c-controller (C99 header of the controller of a run with the
    /// ports alpha and beta) or c-loop (C99 header of the whole loop of a firmware: guard, excitation, exchangeable Q); of a new PID st (IEC
    /// 61131-3 structured text), c-pid (C99 header), gains (parallel, ideal, series, MATLAB, Simulink), betaflight, px4, ardupilot or odrive.
    #[arg(long, value_name = "FORMAT", value_parser = format)]
    to: Format,
    /// Model of the run: recommended by default, or hansen, hansen_reduced, direct, grey_box, deviation, nominal, controller, new_controller,
    /// left, right.
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// With c-controller: Q from beta to alpha, as a model or as the controller.json of a redesign; without it the controller that ran.
    #[arg(long, value_name = "FILE", conflicts_with = "model")]
    q: Option<PathBuf>,
    /// Of the new PIDs of several loops the one to write, counted from 1.
    #[arg(long = "loop", value_name = "N")]
    of_loop: Option<usize>,
    /// File to write; the name of the model by default, in the working directory.
    #[arg(long, value_name = "FILE", value_parser = place())]
    out: Option<PathBuf>,
    /// Replace the file if there is one.
    #[arg(long)]
    force: bool,
}

/// A kind of export.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Format {
    Model(ModelFormat),
    Controller,
    Loop,
    Pid(PidForm),
}

const CONTROLLER: &str = "c-controller";
const LOOP: &str = "c-loop";

fn format(name: &str) -> Result<Format, String> {
    match name {
        CONTROLLER => return Ok(Format::Controller),
        LOOP => return Ok(Format::Loop),
        _ => {}
    }
    if let Some(form) = PidForm::ALL.into_iter().find(|form| form.key() == name) {
        return Ok(Format::Pid(form));
    }
    let models = ModelFormat::ALL.iter().map(|format| format.key());
    let known: Vec<&str> = models.chain([CONTROLLER, LOOP]).chain(PidForm::ALL.map(PidForm::key)).collect();
    let found = ModelFormat::ALL.into_iter().find(|format| format.key() == name);
    found.map(Format::Model).ok_or_else(|| format!("there is no such format; known are {}", known.join(", ")))
}

/// Writes the file and says which.
pub(crate) fn export(form: Form, args: &ExportArgs) -> Result<(), Failure> {
    let misplaced = match args.to {
        Format::Model(_) | Format::Loop | Format::Pid(_) if args.q.is_some() => {
            Some("--q serves --to c-controller only")
        }
        Format::Model(_) | Format::Loop | Format::Controller if args.of_loop.is_some() => {
            Some("--loop serves the exports of a new PID only")
        }
        Format::Controller if args.model.is_some() => Some("--model does not serve --to c-controller; give a Q by --q"),
        Format::Loop if args.model.is_some() => Some("--model does not serve --to c-loop"),
        Format::Pid(_) if args.model.is_some() => Some("--model does not serve the exports of a new PID"),
        _ => None,
    };
    if let Some(problem) = misplaced {
        return Err(youla_io::Error::NotAModel { path: args.source.clone(), problem: problem.into() }.into());
    }
    let (bytes, default, mut about) = match args.to {
        Format::Model(format) => {
            let model = model_for_export(&args.source, args.model.as_deref())?;
            let about = serde_json::json!({
                "model": model.name, "order": model.system.order(), "inputs": model.inputs, "outputs": model.outputs,
            });
            (export_model(&model, format)?, file_name(&model.name, format.extension()), about)
        }
        Format::Controller => {
            let controller = controller_for_export(&args.source, args.q.as_deref())?;
            let made = c_controller(&controller)?;
            let about = serde_json::json!({
                "model": controller.name, "order": made.j_k.system().order(), "single_precision_error": made.single.relative,
                "inputs": controller.measured, "outputs": controller.commanded,
            });
            (made.header.into_bytes(), file_name(&controller.name, "h"), about)
        }
        Format::Loop => {
            let export = loop_for_export(&args.source)?;
            let about = serde_json::json!({
                "model": export.name, "order": export.observer.model.a.len(), "inputs": export.measured, "outputs": export.commanded,
            });
            (c_loop(&export)?.into_bytes(), file_name(&export.name, "h"), about)
        }
        Format::Pid(form) => {
            let pid = pid_for_export(&args.source, args.of_loop)?;
            let about = serde_json::json!({
                "model": pid.name, "order": 2 + 2 * pid.notches.len(), "inputs": [&pid.measured], "outputs": [&pid.commanded],
            });
            (export_pid(&pid, form)?.into_bytes(), file_name(&pid.name, form.extension()), about)
        }
    };
    let path = args.out.clone().unwrap_or(default);
    require_free(&path, args.force, &[&args.source, args.q.as_ref().unwrap_or(&args.source)])?;
    write_export(&path, &bytes, args.force)?;
    let file = path.display().to_string();
    about["file"] = file.as_str().into();
    let caution = caution_for_export(&args.source, matches!(args.to, Format::Pid(_)));
    if caution.is_empty() {
        return form.print(|| about, || file);
    }
    about["caution"] = caution.as_str().into();
    form.print(|| about, || format!("{file}\ncaution: {caution}"))
}

/// The name of a model may come from a file: only letters, digits, `-` and `_` of it.
fn file_name(model: &str, extension: &str) -> PathBuf {
    let safe = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    format!("{}.{extension}", model.chars().map(safe).collect::<String>()).into()
}
