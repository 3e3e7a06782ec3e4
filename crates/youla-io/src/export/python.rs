//! A model as a script for python-control.

use super::NamedModel;
use super::predictor::script;
use super::text::{heading_of, identifier, matrix_of, number, rows};
use youla::MatRef;
use youla::signal::Channel;

const TEMPLATE: &str = include_str!("../../assets/export/model.py");
const PREDICT: &str = include_str!("../../assets/export/predict.py");

pub(super) fn python(model: &NamedModel) -> String {
    let g = &model.system;
    let (predictor, predict) = script(model, array, PREDICT);
    TEMPLATE
        .replace("@heading@", &heading_of(model).join("\n"))
        .replace("@matrices@", &["a", "b", "c", "d"].map(|name| array(name, matrix_of(model, name))).concat())
        .replace("@ts@", &number(g.time().ts()))
        .replace("@name@", &identifier(&model.name))
        .replace("@inputs@", &names(&model.inputs))
        .replace("@outputs@", &names(&model.outputs))
        .replace("@predictor@", &predictor)
        .replace("@predict@", predict)
}

/// With its shape, which an array without entries would not have.
fn array(name: &str, m: MatRef<'_, f64>) -> String {
    format!("{name} = np.array([\n{}]).reshape({}, {})\n", rows(m, "[", "],"), m.nrows(), m.ncols())
}

/// Strings of JSON are strings of Python. python-control refuses names with a point, which is its sign between system and signal; a
/// name that is there already gets a number.
fn names(channels: &[Channel]) -> String {
    let mut known: Vec<String> = Vec::new();
    for c in channels {
        let plain = c.name.replace('.', "_");
        let taken =
            |name: &String| known.contains(name) || (*name != c.name && channels.iter().any(|c| c.name == *name));
        let numbered = (2..).map(|k| format!("{plain}_{k}"));
        let name = std::iter::once(plain.clone()).chain(numbered).find(|name| !taken(name));
        known.push(name.unwrap_or(plain));
    }
    let quoted = |name: &String| serde_json::Value::from(name.as_str()).to_string();
    known.iter().map(quoted).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_no_point_and_stay_apart() {
        let channels = ["Data.u", "Data_u", "a.b", "y"].map(|name| Channel::new(name, ""));
        assert_eq!(names(&channels), r#""Data_u_2", "Data_u", "a_b", "y""#);
    }
}
