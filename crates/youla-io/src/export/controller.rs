//! A controller as data for firmware: what `youla-rt` takes.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use youla::MatRef;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;

/// A matrix by rows.
pub type Rows = Vec<Vec<f64>>;

/// Matrices of one linear system `x+ = A x + B v, w = C x + D v`: `youla_rt::Filter`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilterData {
    /// A, n x n.
    pub a: Rows,
    /// B.
    pub b: Rows,
    /// C.
    pub c: Rows,
    /// D.
    pub d: Rows,
}

/// Model and gains of a controller in observer form: `youla_rt::Matrices`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserverData {
    /// A of the model, n x n.
    pub a: Rows,
    /// B, n x m.
    pub b: Rows,
    /// C, p x n.
    pub c: Rows,
    /// D, p x m.
    pub d: Rows,
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
    pub controller: FilterData,
    /// The observer form with the ports alpha and beta, for `lqg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<ObserverData>,
    /// Q from beta to alpha, around the controller that ran, for `youla`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q: Option<FilterData>,
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
            let (n, m, p) = (o.a.len(), self.commanded.len(), self.measured.len());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "/// Model and gains; `Controller::new(OBSERVER)`.");
            let _ = writeln!(text, "pub const OBSERVER: Matrices<f64, {n}, {m}, {p}> = Matrices {{");
            for (name, rows) in [("a", &o.a), ("b", &o.b), ("c", &o.c), ("d", &o.d), ("f", &o.f), ("l", &o.l)] {
                let _ = writeln!(text, "    {name}: {},", literal(rows, "    "));
            }
            text.push_str("};\n");
        } else {
            text = text.replace("use youla_rt::Matrices;\n\n", "");
        }
        for (name, filter) in [("CONTROLLER", Some(&self.controller)), ("Q", self.q.as_ref())] {
            let Some(filter) = filter else { continue };
            for (letter, rows) in [("A", &filter.a), ("B", &filter.b), ("C", &filter.c), ("D", &filter.d)] {
                let (height, width) = (rows.len(), filter.width(letter));
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
        let (a, b, c, d) = (rows(model.a()), rows(model.b()), rows(model.c()), rows(model.d()));
        ObserverData { a, b, c, d, f: rows(f), l: rows(l) }
    }
}

impl FilterData {
    /// The matrices of a system by rows.
    pub fn new(system: &StateSpace<Discrete>) -> Self {
        FilterData { a: rows(system.a()), b: rows(system.b()), c: rows(system.c()), d: rows(system.d()) }
    }

    /// Columns of one of the matrices, also where it has no rows.
    fn width(&self, letter: &str) -> usize {
        let inputs = || self.d.first().map_or(0, Vec::len);
        match letter {
            "A" | "C" => self.a.len(),
            _ => inputs(),
        }
    }

    /// The system again.
    ///
    /// # Errors
    /// [`youla::Error::Shape`] and [`youla::Error::NotFinite`] for data that were changed by hand.
    pub fn system(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let matrix = |what: &str, rows: &Rows, columns: usize| -> Result<youla::Mat<f64>> {
            match rows.iter().position(|r| r.len() != columns) {
                Some(bad) => Err(Error::Method(youla::Error::Shape {
                    what: format!("row {} of {what}", bad + 1),
                    expected: (1, columns),
                    found: (1, rows[bad].len()),
                })),
                None => Ok(youla::Mat::from_fn(rows.len(), columns, |i, j| rows[i][j])),
            }
        };
        let (n, inputs) = (self.a.len(), self.width("D"));
        Ok(StateSpace::new(
            matrix("A", &self.a, n)?,
            matrix("B", &self.b, inputs)?,
            matrix("C", &self.c, n)?,
            matrix("D", &self.d, inputs)?,
            time,
        )?)
    }
}

fn rows(m: MatRef<'_, f64>) -> Rows {
    (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect()
}

/// Rust's literal of a matrix; `{:?}` of a number reads back to the same bits.
fn literal(rows: &Rows, indent: &str) -> String {
    let row = |r: &Vec<f64>| r.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ");
    let lines: Vec<String> = rows.iter().map(|r| format!("{indent}    [{}],\n", row(r))).collect();
    if lines.is_empty() { "[]".into() } else { format!("[\n{}{indent}]", lines.concat()) }
}
