//! A controller as data for firmware with `youla-rt`.

use crate::matrices::{Rows, SystemMatrices, rows};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use youla::MatRef;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;

/// Model and gains of a controller in observer form: `youla_rt::Matrices`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObserverData {
    /// `a`, `b`, `c`, `d` of the model, from u to y.
    #[serde(flatten)]
    pub model: SystemMatrices,
    /// F, m x n, positive feedback.
    pub f: Rows,
    /// L, n x p: `x+ = A x + B u - L beta`.
    pub l: Rows,
}

/// A new controller as it runs on a target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExportedController {
    /// What was designed anew: `lqg` or `youla`.
    pub method: String,
    /// Sample time, seconds.
    pub ts: f64,
    /// Measured outputs of the plant, the inputs of the controller.
    pub measured: Vec<Channel>,
    /// Inputs of the plant.
    pub commanded: Vec<Channel>,
    /// `u = K y` (positive feedback) as one system.
    pub controller: SystemMatrices,
    /// The observer form with the ports alpha and beta, for `lqg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<ObserverData>,
    /// Q from beta to alpha, around the controller that ran, for `youla`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q: Option<SystemMatrices>,
}

impl ExportedController {
    /// As Rust source for a firmware that depends on `youla-rt`: constants of the exact values.
    pub fn rust(&self) -> String {
        let names = |channels: &[Channel]| {
            channels.iter().map(|c| format!("{} [{}]", c.name, c.unit)).collect::<Vec<_>>().join(", ")
        };
        let mut text = format!(
            "//! Controller from {} to {}, sample time {:?} s, positive feedback u = K y.\n\nuse youla_rt::Matrices;\n\n",
            names(&self.measured).replace(['\n', '\r'], " "),
            names(&self.commanded).replace(['\n', '\r'], " "),
            self.ts
        );
        if let Some(o) = &self.observer {
            let g = &o.model;
            let (n, m, p) = (g.a.len(), self.commanded.len(), self.measured.len());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "/// Model and gains; `Controller::new(OBSERVER)`.");
            let _ = writeln!(text, "pub const OBSERVER: Matrices<f64, {n}, {m}, {p}> = Matrices {{");
            for (name, rows) in [("a", &g.a), ("b", &g.b), ("c", &g.c), ("d", &g.d), ("f", &o.f), ("l", &o.l)] {
                let _ = writeln!(text, "    {name}: {},", literal(rows, "    "));
            }
            text.push_str("};\n");
        } else {
            text = text.replace("use youla_rt::Matrices;\n\n", "");
        }
        for (name, filter) in [("CONTROLLER", Some(&self.controller)), ("Q", self.q.as_ref())] {
            let Some(filter) = filter else { continue };
            let (n, m) = (filter.a.len(), filter.inputs());
            for (letter, rows, width) in
                [("A", &filter.a, n), ("B", &filter.b, m), ("C", &filter.c, n), ("D", &filter.d, m)]
            {
                let height = rows.len();
                let _ = writeln!(text, "\n/// {letter} of `{name}`, for `youla_rt::Filter::new`.");
                let _ =
                    writeln!(text, "pub const {name}_{letter}: [[f64; {width}]; {height}] = {};", literal(rows, ""));
            }
        }
        text
    }
}

impl ObserverData {
    /// The matrices of a model and the gains F and L of an observer-based controller.
    pub fn new(model: &StateSpace<Discrete>, f: MatRef<'_, f64>, l: MatRef<'_, f64>) -> Self {
        ObserverData { model: SystemMatrices::new(model), f: rows(f), l: rows(l) }
    }
}

/// Rust's literal of a matrix; `{:?}` of a number reads back to the same bits.
fn literal(rows: &Rows, indent: &str) -> String {
    let row = |r: &Vec<f64>| r.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ");
    let lines: Vec<String> = rows.iter().map(|r| format!("{indent}    [{}],\n", row(r))).collect();
    if lines.is_empty() { "[]".into() } else { format!("[\n{}{indent}]", lines.concat()) }
}
