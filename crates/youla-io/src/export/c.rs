//! A model as a C99 header: `y = C x + D u`, then `x+ = A x + B u`.

use super::NamedModel;
use super::precision::{DOUBLE, Round, SINGLE, SingleError, add, noise, samples_for};
use super::text::{heading_of, identifier, rows};
use crate::error::{Error, Result};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

const TEMPLATE: &str = include_str!("../../assets/export/model.h");
/// The guard and the type of numbers, with which every header begins.
const REAL: &str = include_str!("../../assets/export/real.h");

pub(super) fn c(model: &NamedModel) -> Result<String> {
    let g = &model.system;
    let (n, m, p) = (g.order(), g.inputs(), g.outputs());
    check_ports(m, p)?;
    let name = identifier(&model.name);
    let matrices =
        [("a", g.a()), ("b", g.b()), ("c", g.c()), ("d", g.d())].map(|(l, m)| constant(&name, l, m)).concat();
    let text = TEMPLATE
        .replace("@heading@", &comment(&heading_of(model)))
        .replace("@single@", &single_error(g)?.sentence())
        .replace("@matrices@", &matrices)
        .replace("@output@", &[products(&name, "c", "s->x", n), products(&name, "d", "u", m)].concat())
        .replace("@unused@", if n == 0 { "    (void)s;\n" } else { "" })
        .replace("@update@", &update(&name, n, &[("a", "s->x", n), ("b", "u", m)], "    (void)u;\n"));
    Ok(finished(&text, &name, n, m, p))
}

/// Headers have arrays of their ports, which must not be empty.
pub(super) fn check_ports(m: usize, p: usize) -> Result<()> {
    for (what, count) in [("inputs", m), ("outputs", p)] {
        if count == 0 {
            let what = format!("the number of {what} of a C header");
            return Err(Error::Method(youla::Error::OutOfRange { what, value: 0.0, must: "at least 1" }));
        }
    }
    Ok(())
}

/// Lines of a comment.
pub(super) fn comment(lines: &[String]) -> String {
    lines.iter().map(|line| format!(" * {line}\n")).collect::<String>().trim_end().to_owned()
}

/// A matrix as a constant; nothing where it has no entries.
pub(super) fn constant(name: &str, letter: &str, m: MatRef<'_, f64>) -> String {
    let (height, width) = (m.nrows(), m.ncols());
    if height * width == 0 {
        return String::new();
    }
    format!("static const {name}_real {name}_{letter}[{height}][{width}] = {{\n{}}};\n", rows(m, "{", "},"))
}

/// The loop that adds row i of a matrix times a vector; nothing where there is nothing to add.
pub(super) fn products(name: &str, letter: &str, x: &str, count: usize) -> String {
    if count == 0 {
        return String::new();
    }
    format!(
        "        for (int j = 0; j < {count}; j++) {{\n            sum += {name}_{letter}[i][j] * {x}[j];\n        }}\n"
    )
}

/// The state from the sum of products; without states, statements that mark the arguments as unused.
pub(super) fn update(name: &str, n: usize, terms: &[(&str, &str, usize)], unused: &str) -> String {
    if n == 0 {
        return format!("    (void)s;\n{unused}");
    }
    let sums: String = terms.iter().map(|(letter, x, count)| products(name, letter, x, *count)).collect();
    format!(
        "    {name}_real next[{n}];\n    for (int i = 0; i < {n}; i++) {{\n        {name}_real sum = 0;\n{sums}        \
         next[i] = sum;\n    }}\n    for (int i = 0; i < {n}; i++) {{\n        s->x[i] = next[i];\n    }}\n"
    )
}

/// Names and sizes.
pub(super) fn finished(text: &str, name: &str, n: usize, m: usize, p: usize) -> String {
    text.replace("@real@", REAL)
        .replace("@p@", name)
        .replace("@P@", &name.to_ascii_uppercase())
        .replace("@n@", &n.to_string())
        .replace("@x@", &n.max(1).to_string())
        .replace("@m@", &m.to_string())
        .replace("@q@", &p.to_string())
}

/// Of an open-loop simulation with white noise.
fn single_error(g: &StateSpace<Discrete>) -> Result<SingleError> {
    let u = noise(samples_for(g.poles()?.iter().fold(0.0, |r, p| r.max(p.norm()))), g.inputs());
    Ok(SingleError::between(run(g, u.as_ref(), DOUBLE).as_ref(), run(g, u.as_ref(), SINGLE).as_ref()))
}

fn run(g: &StateSpace<Discrete>, u: MatRef<'_, f64>, round: Round) -> Mat<f64> {
    let mut x = vec![0.0; g.order()];
    let mut out = Mat::zeros(u.nrows(), g.outputs());
    for k in 0..u.nrows() {
        let u: Vec<f64> = u.row(k).iter().map(|x| round(*x)).collect();
        let (mut y, mut next) = (vec![0.0; g.outputs()], vec![0.0; g.order()]);
        add(&mut y, g.c(), &x, round);
        add(&mut y, g.d(), &u, round);
        add(&mut next, g.a(), &x, round);
        add(&mut next, g.b(), &u, round);
        x = next;
        y.into_iter().enumerate().for_each(|(j, y)| out[(k, j)] = y);
    }
    out
}
