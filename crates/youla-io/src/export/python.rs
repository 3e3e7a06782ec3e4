//! A model as a script for python-control.

use super::NamedModel;
use super::text::{heading, identifier, matrix_of, number, rows};
use youla::MatRef;
use youla::signal::Channel;

const TEMPLATE: &str = include_str!("../../assets/export/model.py");

pub(super) fn python(model: &NamedModel) -> String {
    let g = &model.system;
    TEMPLATE
        .replace("@heading@", &heading(model).join("\n"))
        .replace("@matrices@", &["a", "b", "c", "d"].map(|name| array(name, matrix_of(model, name))).concat())
        .replace("@ts@", &number(g.time().ts()))
        .replace("@name@", &identifier(&model.name))
        .replace("@inputs@", &names(&model.inputs))
        .replace("@outputs@", &names(&model.outputs))
}

/// With its shape, which an array without entries would not have.
fn array(name: &str, m: MatRef<'_, f64>) -> String {
    format!("{name} = np.array([\n{}]).reshape({}, {})\n", rows(m, "[", "],"), m.nrows(), m.ncols())
}

/// Strings of JSON are strings of Python.
fn names(channels: &[Channel]) -> String {
    let quoted = |c: &Channel| serde_json::Value::from(c.name.as_str()).to_string();
    channels.iter().map(quoted).collect::<Vec<_>>().join(", ")
}
