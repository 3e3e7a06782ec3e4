//! The whole loop of a firmware as a C99 header: the controller in observer form with guard, excitation and an exchangeable Q, line by line
//! what `youla_rt::ExcitedLoop` does.

use super::ObserverData;
use super::c::{check_ports, comment, constant, finished};
use super::text::{heading, identifier, number};
use crate::error::Result;
use crate::matrices::matrix;
use youla::lti::Discrete;
use youla::signal::Channel;

/// Types and arithmetic; what happens in a sample; requests and sources of excitation.
const PARTS: [&str; 3] = [
    include_str!("../../assets/export/loop.h"),
    include_str!("../../assets/export/loop_sample.h"),
    include_str!("../../assets/export/loop_requests.h"),
];

/// What the header of a loop is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopExport {
    /// Prefix of all names in the header.
    pub name: String,
    /// Measured outputs of the plant.
    pub measured: Vec<Channel>,
    /// Inputs of the plant.
    pub commanded: Vec<Channel>,
    /// Nominal model and gains.
    pub observer: ObserverData,
    /// Sample time, seconds.
    pub ts: f64,
    /// Where they come from, for the comment.
    pub origin: String,
}

/// Writes the header.
///
/// u, alpha, beta, status and refusals are those of `youla_rt::ExcitedLoop` bit by bit, in double and single precision, over 200 000 samples of
/// random events (`tests/files/exports/c_loop.rs`).
///
/// # Errors
/// [`youla::Error::Shape`], [`youla::Error::NotFinite`] for matrices that do not fit; [`youla::Error::OutOfRange`] without inputs or outputs.
///
/// ```
/// use youla_io::export::{LoopExport, ObserverData, c_loop};
/// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}, signal::Channel};
/// let model = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1e-3)?)?;
/// let gain = Mat::from_fn(1, 1, |_, _| -0.5);
/// let channel = |name| vec![Channel::new(name, "V")];
/// let export = LoopExport {
///     name: "loop".into(), measured: channel("y"), commanded: channel("u"),
///     observer: ObserverData::new(&model, gain.as_ref(), gain.as_ref()), ts: 1e-3, origin: String::new(),
/// };
/// assert!(c_loop(&export)?.contains("loop_switch_q"));
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn c_loop(export: &LoopExport) -> Result<String> {
    let model = export.observer.model.system(Discrete::new(export.ts)?)?;
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    check_ports(m, p)?;
    let (f, l) = (matrix("F", &export.observer.f, n)?, matrix("L", &export.observer.l, p)?);
    for (what, expected, found) in [("rows of F", m, f.nrows()), ("rows of L", n, l.nrows())] {
        if expected != found {
            return Err(youla::Error::Ports { what: format!("the number of {what}"), expected, found }.into());
        }
    }
    let name = identifier(&export.name);
    let all =
        [("a", model.a()), ("b", model.b()), ("c", model.c()), ("d", model.d()), ("f", f.as_ref()), ("l", l.as_ref())];
    let mut text = PARTS.concat();
    let mut constants = String::new();
    for (letter, matrix) in all {
        let written = constant(&name, letter, matrix);
        // A matrix without entries has no constant.
        let row = if written.is_empty() { "0".to_owned() } else { format!("{name}_{letter}[i]") };
        text = text.replace(&format!("@{letter}@"), &row);
        constants += &written;
    }
    let what =
        format!("Loop of a firmware, {n} states, sample time {} s, positive feedback u = K y.", number(export.ts));
    let ports: [(&str, &[Channel]); 2] = [("Measured y:  ", &export.measured), ("Commanded u: ", &export.commanded)];
    let lines = heading(what, ports, &export.origin);
    let text = text.replace("@heading@", &comment(&lines)).replace("@matrices@", &constants);
    Ok(finished(&text, &name, n, m, p))
}
