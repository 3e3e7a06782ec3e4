//! `youla rig load`: a Q from a redesign, or from the table of a campaign over speed.

use super::{ADDRESS, refused, say_status};
use crate::output::{Failure, Form};
use clap::Args;
use std::path::{Path, PathBuf};
use youla_commission::QTable;
use youla_io::SystemMatrices;
use youla_io::export::ExportedController;
use youla_rig::{Description, Request, Rig};

pub(super) const EXAMPLES: &str = "\
Examples:
  youla rig load udp://127.0.0.1:4000 runs/rotor-001/8-redesign/controller.json --switch
  youla rig load udp://127.0.0.1:4000 bearing/q_table.json --speed 1800 --switch";

/// Arguments of `youla rig load`.
#[derive(Debug, Args)]
pub(crate) struct LoadArgs {
    #[arg(help = ADDRESS)]
    address: String,
    /// `8-redesign/controller.json` of a redesign by Q, `q.json` of a point of a campaign, or its `q_table.json` with --speed.
    file: PathBuf,
    /// Speed in revolutions per minute at which Q is taken from a table.
    #[arg(long, value_name = "RPM")]
    speed: Option<f64>,
    /// Switch to it at once.
    #[arg(long)]
    switch: bool,
}

pub(super) fn load(form: Form, args: &LoadArgs) -> Result<(), Failure> {
    let path = &args.file;
    let table = args.speed.map(|_| QTable::read(path)).transpose()?;
    let exported = if table.is_none() { Some(exported(path)?) } else { None };
    let mut rig = Rig::connect(&args.address)?;
    let wrong = |why: String| refused(format!("{}: {why}", path.display()));
    let order =
        rig.description().q_order.ok_or_else(|| wrong("the machine states no q_order: it takes no Q".into()))?;
    let (q, ts) = match (table, args.speed, exported) {
        (Some(table), Some(rpm), _) => (SystemMatrices::new(&table.at(rpm, order)?), table.ts),
        (_, _, Some(ExportedController { q: Some(q), ts, .. })) => (q, ts),
        _ => return Err(wrong("it holds no Q; redesign with method = \"youla\"".into())),
    };
    let coefficients = coefficients(&q, ts, order, rig.description()).map_err(wrong)?;
    let mut answer = rig.load_q(&coefficients)?;
    if args.switch {
        answer = rig.ask(&Request::SwitchQ)?;
    }
    say_status(form, &rig, &answer)
}

fn exported(path: &Path) -> Result<ExportedController, Failure> {
    let text = youla_io::read_text(path)?;
    if serde_json::from_str::<QTable>(&text).is_ok() {
        return Err(refused(format!("{}: this is a table of Q over speed; add --speed RPM", path.display())));
    }
    serde_json::from_str(&text).map_err(|e| refused(format!("{}: {e}", path.display())))
}

/// A, B and C of Q by rows, filled up with zeros to the order of the machine's banks.
fn coefficients(q: &SystemMatrices, ts: f64, order: usize, machine: &Description) -> Result<Vec<f32>, String> {
    let (inputs, outputs) = (machine.inputs.len(), machine.outputs.len());
    let width = |rows: &[Vec<f64>], columns: usize| rows.iter().all(|row| row.len() == columns);
    let of_machine = q.c.len() == inputs && width(&q.b, outputs) && q.b.len() == q.a.len();
    if q.a.len() > order || !of_machine {
        return Err(format!(
            "Q has {} states, {} outputs; the machine takes {order} states at most, {inputs} outputs and {outputs} inputs",
            q.a.len(),
            q.c.len()
        ));
    }
    if q.d.iter().flatten().any(|d| *d != 0.0) {
        return Err("Q has a feedthrough, which needs the measurement before the command".into());
    }
    if (ts / machine.sample_time - 1.0).abs() > 1e-6 {
        return Err(format!("Q is for {} s, the machine samples each {} s", ts, machine.sample_time));
    }
    let padded = |rows: &[Vec<f64>], height: usize, columns: usize| -> Vec<f32> {
        let entry = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).map_or(0.0, |value| *value as f32);
        (0..height * columns).map(|k| entry(k / columns, k % columns)).collect()
    };
    Ok([padded(&q.a, order, order), padded(&q.b, order, outputs), padded(&q.c, inputs, order)].concat())
}
