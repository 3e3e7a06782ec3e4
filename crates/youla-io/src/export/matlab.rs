//! A model as a script for MATLAB (Control System Toolbox) and Octave (package control).

use super::NamedModel;
use super::predictor::script;
use super::text::{heading_of, matrix_of, number, rows};
use youla::MatRef;
use youla::signal::Channel;

const TEMPLATE: &str = include_str!("../../assets/export/model.m");
const PREDICT: &str = include_str!("../../assets/export/predict.m");

pub(super) fn matlab(model: &NamedModel) -> String {
    let comment: Vec<String> = heading_of(model).iter().map(|line| format!("% {line}")).collect();
    let (predictor, predict) = script(model, matrix, PREDICT);
    TEMPLATE
        .replace("@heading@", &comment.join("\n"))
        .replace("@matrices@", &["a", "b", "c", "d"].map(|name| matrix(name, matrix_of(model, name))).concat())
        .replace("@ts@", &number(model.system.time().ts()))
        .replace("@inputs@", &names(&model.inputs))
        .replace("@outputs@", &names(&model.outputs))
        .replace("@predictor@", &predictor)
        .replace("@predict@", predict)
}

fn matrix(name: &str, m: MatRef<'_, f64>) -> String {
    match (m.nrows(), m.ncols()) {
        (rows, columns) if rows * columns == 0 => format!("{name} = zeros({rows}, {columns});\n"),
        _ => format!("{name} = [\n{}];\n", rows(m, "", "")),
    }
}

/// Quoted for MATLAB; control characters would end the line.
fn names(channels: &[Channel]) -> String {
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let quoted = |c: &Channel| format!("'{}'", c.name.chars().map(clean).collect::<String>().replace('\'', "''"));
    channels.iter().map(quoted).collect::<Vec<_>>().join(", ")
}
