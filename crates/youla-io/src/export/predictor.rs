//! The predictor that belongs to a model: `x+ = A x + B u + K (y - yhat)`, `yhat = C x + D u`, plant and noise together (L. Ljung,
//! System Identification, 2nd ed., Prentice Hall, 1999, (4.83)).

use super::NamedModel;
use crate::matrices::rows;
use crate::values::{Value, Variables};
use serde::{Deserialize, Serialize};
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// The six matrices by rows, as `details.predictor` of the model's JSON states them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Predictor {
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    c: Vec<Vec<f64>>,
    d: Vec<Vec<f64>>,
    k: Vec<Vec<f64>>,
    covariance: Vec<Vec<f64>>,
}

/// Prefix of the variables and names of files and scripts.
const PREFIX: &str = "predictor_";

impl Predictor {
    /// That of a model; `None` where it has none, or one without a gain.
    pub(super) fn of(model: &NamedModel) -> Option<Self> {
        let found: Predictor = serde_json::from_value(model.details.get("predictor")?.clone()).ok()?;
        let (n, m, p) = (found.a.len(), model.inputs.len(), model.outputs.len());
        let fits = |rows: &[Vec<f64>], height: usize, width: usize| {
            rows.len() == height && rows.iter().all(|row| row.len() == width)
        };
        let whole = fits(&found.a, n, n) && fits(&found.b, n, m) && fits(&found.c, p, n) && fits(&found.d, p, m);
        (whole && fits(&found.k, n, p) && fits(&found.covariance, p, p)).then_some(found)
    }

    /// Names and matrices, in the order in which they are written.
    pub(super) fn matrices(&self, model: &NamedModel) -> [(String, Mat<f64>); 6] {
        let (n, m, p) = (self.a.len(), model.inputs.len(), model.outputs.len());
        [
            ("a", &self.a, n),
            ("b", &self.b, m),
            ("c", &self.c, n),
            ("d", &self.d, m),
            ("k", &self.k, p),
            ("covariance", &self.covariance, p),
        ]
        .map(|(name, rows, width)| (format!("{PREFIX}{name}"), Mat::from_fn(rows.len(), width, |i, j| rows[i][j])))
    }

    /// `details` of a model whose file holds the six variables, else `null`.
    pub(super) fn details(file: &Variables) -> serde_json::Value {
        let matrix = |name: &str| match file.get(&format!("{PREFIX}{name}")) {
            Ok(Value::Real { .. }) => file.matrix(&format!("{PREFIX}{name}")).ok().map(|m| rows(m.as_ref())),
            _ => None,
        };
        let found = || {
            let [a, b, c, d] = ["a", "b", "c", "d"].map(matrix);
            let (k, covariance) = (matrix("k")?, matrix("covariance")?);
            Some(Predictor { a: a?, b: b?, c: c?, d: d?, k, covariance })
        };
        found().map_or(serde_json::Value::Null, |predictor| serde_json::json!({ "predictor": predictor }))
    }
}

impl NamedModel {
    /// The model with its noise, from u and the innovations e to y, and the covariance of e; `None` where its file has no predictor.
    pub fn with_noise(&self) -> Option<(StateSpace<Discrete>, Mat<f64>)> {
        let [a, b, c, d, k, covariance] = Predictor::of(self)?.matrices(self).map(|(_, matrix)| matrix);
        let inputs = block(&[&[b.as_ref(), k.as_ref()]]);
        let through = block(&[&[d.as_ref(), eye(d.nrows()).as_ref()]]);
        Some((StateSpace::new(a, inputs, c, through, self.system.time()).ok()?, covariance))
    }
}

/// The matrices of a script, one statement each, by `write`; and the template of what computes with them, both empty without predictor.
pub(super) fn script<'a>(
    model: &NamedModel,
    write: impl Fn(&str, MatRef<'_, f64>) -> String,
    template: &'a str,
) -> (String, &'a str) {
    match Predictor::of(model) {
        None => (String::new(), ""),
        Some(found) => (found.matrices(model).map(|(name, matrix)| write(&name, matrix.as_ref())).concat(), template),
    }
}
