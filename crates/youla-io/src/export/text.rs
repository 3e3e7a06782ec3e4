//! What scripts and headers have in common: numbers, matrices, names, comments.

use super::NamedModel;
use youla::MatRef;
use youla::signal::Channel;

/// Program and version.
pub(super) const PROGRAM: &str = concat!("youla ", env!("CARGO_PKG_VERSION"));

/// A number that reads back to the same bits in C, Python and MATLAB.
pub(super) fn number(x: f64) -> String {
    format!("{x:?}")
}

/// One of the four matrices by its letter.
pub(super) fn matrix_of<'a>(model: &'a NamedModel, letter: &str) -> MatRef<'a, f64> {
    match letter {
        "a" => model.system.a(),
        "b" => model.system.b(),
        "c" => model.system.c(),
        _ => model.system.d(),
    }
}

/// The rows of a matrix, one a line: `    ` `open` numbers `close`.
pub(super) fn rows(matrix: MatRef<'_, f64>, open: &str, close: &str) -> String {
    let row = |i: usize| {
        let numbers: Vec<String> = matrix.row(i).iter().map(|x| number(*x)).collect();
        format!("    {open}{}{close}\n", numbers.join(", "))
    };
    (0..matrix.nrows()).map(row).collect()
}

/// Text for a comment of any of the languages: what could end the comment, or mean something in it, becomes `_`.
pub(super) fn plain(text: &str) -> String {
    let safe = |c: char| c.is_alphanumeric() || " .,;:()[]<>=+-_#&|~^/".contains(c);
    text.chars().map(|c| if safe(c) { c } else { '_' }).collect()
}

/// A name for C, Python and MATLAB: letters, digits and underscores, a letter first.
pub(super) fn identifier(text: &str) -> String {
    let word: String = text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if word.starts_with(|c: char| c.is_ascii_alphabetic()) { word } else { format!("model_{word}") }
}

/// Names and units, separated by commas, for a comment.
pub(super) fn labels(channels: &[Channel]) -> String {
    plain(&channels.iter().map(Channel::label).collect::<Vec<_>>().join(", "))
}

/// Lines of a heading: what it is, its ports, who wrote it and from what.
pub(super) fn heading(what: String, ports: [(&str, &[Channel]); 2], origin: &str) -> Vec<String> {
    let ports = ports.map(|(name, channels)| format!("{name}{}", labels(channels)));
    let from = (!origin.is_empty()).then(|| format!("From {}.", plain(origin)));
    [what].into_iter().chain(ports).chain([format!("Written by {PROGRAM}.")]).chain(from).collect()
}

/// That of a model.
pub(super) fn heading_of(model: &NamedModel) -> Vec<String> {
    let g = &model.system;
    let what = format!("Model {}, {} states, sample time {} s.", plain(&model.name), g.order(), number(g.time().ts()));
    heading(what, [("Inputs:  ", &model.inputs), ("Outputs: ", &model.outputs)], &model.origin)
}
