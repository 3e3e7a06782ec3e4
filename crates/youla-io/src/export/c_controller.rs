//! The controller `J_K(Q)` of (21), (22) as a C99 header with the ports alpha and beta, from the left factors:
//!
//! ```text
//! left = [I -Q; 0 I] [Vt -Ut; -Nt Mt]                           (u, y) -> (alpha, beta)
//! x+ = A x + Bu u + By y,   alpha = Ca x + Du u + Dy y         solved for the command: u = Du^-1 (alpha - Ca x - Dy y)
//! beta = C x + Eu u + Ey y
//! ```
//!
//! The left factors are stable, whatever the controller: their state is driven by u as the actuators applied it, so that
//! saturation neither winds them up nor spoils beta, which remains `Mt y - Nt u` (28).

use super::c::{check_ports, comment, constant, finished, products, update};
use super::precision::{DOUBLE, Round, SAMPLES, SINGLE, SingleError, add, noise};
use super::text::{self, identifier, number};
use crate::error::{Error, Result};
use faer::Scale;
use faer::linalg::solvers::Solve;
use youla::control::closed_loop;
use youla::factor::shear;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, Partitioned, StateSpace, simulate};
use youla::signal::Channel;
use youla::{Mat, MatRef};

const TEMPLATE: &str = include_str!("../../assets/export/controller.h");

/// What the header of a controller is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerExport {
    /// Prefix of all names in the header.
    pub name: String,
    /// Measured outputs of the plant, p of them.
    pub measured: Vec<Channel>,
    /// Inputs of the plant, m of them.
    pub commanded: Vec<Channel>,
    /// The nominal model, for the test sequence.
    pub nominal: StateSpace<Discrete>,
    /// `[Vt -Ut; -Nt Mt]`, from (u, y) to (alpha, beta).
    pub left: StateSpace<Discrete>,
    /// Q from beta to alpha; none is the controller that ran.
    pub q: Option<StateSpace<Discrete>>,
    /// Where the factors come from, for the comment.
    pub origin: String,
}

/// A header of a controller and what it promises.
#[derive(Debug, Clone, PartialEq)]
pub struct CController {
    /// The header.
    pub header: String,
    /// `J_K(Q)`, (y, alpha) to (u, beta), which the header computes.
    pub j_k: Partitioned<Discrete>,
    /// What single precision costs, along the simulated loop with the nominal model that alpha excites.
    pub single: SingleError,
}

/// Writes the header: positive feedback, `u = K(Q) y` with alpha added at the port of Fig. 3.
///
/// Agrees with the library's simulation of `J_K(Q)` to 1e-12 in double precision (`tests/files/exports/c.rs`).
///
/// # Errors
/// [`youla::Error::Ports`] and [`youla::Error::SampleTimeMismatch`] where nominal model, factors and Q do not fit; [`youla::Error::Unstable`] for an
/// unstable Q, whose K(Q) would not stabilise the nominal model; [`youla::Error::Singular`] where Vt has no invertible feedthrough;
/// [`youla::Error::AlgebraicLoop`] where a loop with the nominal model is not well posed.
///
/// ```
/// use youla_io::export::{ControllerExport, c_controller};
/// use youla::{Mat, factor::CoprimeFactors, linalg::eye, lti::{Discrete, StateSpace}, signal::Channel};
/// let nominal = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1e-3)?)?;
/// let gain = Mat::from_fn(1, 1, |_, _| -0.5);
/// let left = CoprimeFactors::observer(&nominal, gain.as_ref(), gain.as_ref())?.left().system().clone();
/// let channel = |name| vec![Channel::new(name, "V")];
/// let (measured, commanded) = (channel("y"), channel("u"));
/// let export = ControllerExport { name: "controller".into(), measured, commanded, nominal, left, q: None, origin: String::new() };
/// assert!(c_controller(&export)?.header.contains("controller_command"));
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn c_controller(export: &ControllerExport) -> Result<CController> {
    let (m, p) = (export.nominal.inputs(), export.nominal.outputs());
    check_ports(m, p)?;
    check(export, m, p)?;
    let left = shifted(export)?;
    let j_k = Partitioned::new(left.clone(), m, m)?.exchange_first()?.with_inputs_swapped()?;
    let law = Law::new(&left, m);
    let single = law.single_error(&export.nominal, &j_k)?;
    Ok(CController { header: header(export, &law, &single), j_k, single })
}

fn check(export: &ControllerExport, m: usize, p: usize) -> Result<()> {
    let ports = |what: &str, expected, found| match expected == found {
        true => Ok(()),
        false => Err(Error::Method(youla::Error::Ports { what: what.into(), expected, found })),
    };
    ports("the number of inputs of the left factors", m + p, export.left.inputs())?;
    ports("the number of outputs of the left factors", m + p, export.left.outputs())?;
    ports("the number of commanded channels", m, export.commanded.len())?;
    ports("the number of measured channels", p, export.measured.len())?;
    if let Some(q) = &export.q {
        ports("the number of inputs of Q, from beta", p, q.inputs())?;
        ports("the number of outputs of Q, to alpha", m, q.outputs())?;
        q.require_stable("Q")?;
    }
    Ok(())
}

/// `[I -Q; 0 I] left`.
fn shifted(export: &ControllerExport) -> Result<StateSpace<Discrete>> {
    match &export.q {
        None => Ok(export.left.clone()),
        Some(q) => Ok(export.left.then(&shear(&q.negated())?)?),
    }
}

/// The matrices of the generated code.
struct Law {
    /// `u = kx x + ky y + ka alpha`.
    kx: Mat<f64>,
    ky: Mat<f64>,
    ka: Mat<f64>,
    /// `x+ = a x + bu u + by y`.
    a: Mat<f64>,
    bu: Mat<f64>,
    by: Mat<f64>,
    /// `beta = c x + eu u + ey y`.
    c: Mat<f64>,
    eu: Mat<f64>,
    ey: Mat<f64>,
    time: Discrete,
}

impl Law {
    /// The feedthrough of Vt is known to be invertible.
    fn new(left: &StateSpace<Discrete>, m: usize) -> Self {
        let (all, p) = (left.inputs(), left.inputs() - m);
        let d = left.d();
        let solver = d.submatrix(0, 0, m, m).partial_piv_lu();
        let solve = |rhs: MatRef<'_, f64>| solver.solve(rhs);
        Law {
            kx: Scale(-1.0) * solve(left.c().subrows(0, m)),
            ky: Scale(-1.0) * solve(d.submatrix(0, m, m, p)),
            ka: solve(eye(m).as_ref()),
            a: left.a().to_owned(),
            bu: left.b().subcols(0, m).to_owned(),
            by: left.b().subcols(m, all - m).to_owned(),
            c: left.c().subrows(m, p).to_owned(),
            eu: d.submatrix(m, 0, p, m).to_owned(),
            ey: d.submatrix(m, m, p, p).to_owned(),
            time: left.time(),
        }
    }

    /// Whether the command needs the measurement of the same sample.
    fn passes_through(&self) -> bool {
        self.ky.norm_max() > 0.0
    }

    /// Along the loop with the nominal model, excited at alpha and by output noise of a tenth of y, without which beta would be
    /// zero: both precisions get y, alpha and the applied u of the library's simulation.
    fn single_error(&self, nominal: &StateSpace<Discrete>, j_k: &Partitioned<Discrete>) -> Result<SingleError> {
        let (m, p) = (nominal.inputs(), nominal.outputs());
        let system = closed_loop(nominal, j_k)?;
        let mut driving = noise(SAMPLES, m + p);
        let respond = |driving: &Mat<f64>| simulate(&system, driving.as_ref(), &vec![0.0; system.order()]);
        let calm = respond(&block(&[&[driving.subcols(0, m), Mat::zeros(SAMPLES, p).as_ref()]]))?;
        for j in 0..p {
            let rms = calm.col(m + j).norm_l2() / (SAMPLES as f64).sqrt();
            driving.col_mut(m + j).iter_mut().for_each(|n| *n *= 0.1 * rms);
        }
        let log = respond(&driving)?;
        let run = |round| self.run([log.subcols(0, m), log.subcols(m, p), driving.subcols(0, m)], round);
        Ok(SingleError::between(run(DOUBLE).as_ref(), run(SINGLE).as_ref()))
    }

    /// Commands and beta for given records of u as applied, y and alpha.
    fn run(&self, [u, y, alpha]: [MatRef<'_, f64>; 3], round: Round) -> Mat<f64> {
        let (m, p, n) = (u.ncols(), y.ncols(), self.a.nrows());
        let mut x = vec![0.0; n];
        let mut out = Mat::zeros(u.nrows(), m + p);
        for k in 0..u.nrows() {
            let row = |of: MatRef<'_, f64>| of.row(k).iter().map(|v| round(*v)).collect::<Vec<_>>();
            let (u, y, alpha) = (row(u), row(y), row(alpha));
            let sum = |terms: [(&Mat<f64>, &[f64]); 3], rows: usize| {
                let mut sum = vec![0.0; rows];
                terms.iter().for_each(|(matrix, v)| add(&mut sum, matrix.as_ref(), v, round));
                sum
            };
            let command = sum([(&self.kx, &x), (&self.ky, &y), (&self.ka, &alpha)], m);
            let beta = sum([(&self.c, &x), (&self.eu, &u), (&self.ey, &y)], p);
            x = sum([(&self.a, &x), (&self.bu, &u), (&self.by, &y)], n);
            command.iter().chain(&beta).enumerate().for_each(|(j, value)| out[(k, j)] = *value);
        }
        out
    }
}

fn header(export: &ControllerExport, law: &Law, single: &SingleError) -> String {
    let (n, m, p) = (law.a.nrows(), law.bu.ncols(), law.by.ncols());
    let name = identifier(&export.name);
    let matrices = [
        ("kx", &law.kx),
        ("ky", &law.ky),
        ("ka", &law.ka),
        ("a", &law.a),
        ("bu", &law.bu),
        ("by", &law.by),
        ("c", &law.c),
        ("eu", &law.eu),
        ("ey", &law.ey),
    ];
    let direct = law.passes_through();
    let constants = matrices.iter().filter(|(letter, _)| direct || *letter != "ky");
    let constants: String = constants.map(|(letter, matrix)| constant(&name, letter, matrix.as_ref())).collect();
    let term = |letter: &str, x: &str, count: usize| products(&name, letter, x, count);
    let command =
        [term("kx", "s->x", n), if direct { term("ky", "y", p) } else { String::new() }, term("ka", "alpha", m)];
    let beta = [term("c", "s->x", n), term("eu", "u", m), term("ey", "y", p)];
    let unused = |needed: bool, argument: &str| if needed { String::new() } else { format!("    (void){argument};\n") };
    let text = TEMPLATE
        .replace("@heading@", &comment(&heading(export, law)))
        .replace("@single@", &single.sentence())
        .replace(
            "@timing@",
            if direct { "needs y of the same sample" } else { "does not wait for y of the same sample" },
        )
        .replace("@matrices@", &constants)
        .replace("@unused@", &[unused(n > 0, "s"), unused(direct, "y")].concat())
        .replace("@unused_state@", &unused(n > 0, "s"))
        .replace("@command@", &command.concat())
        .replace("@beta@", &beta.concat())
        .replace("@update@", &update(&name, n, &[("a", "s->x", n), ("bu", "u", m), ("by", "y", p)], ""));
    finished(&text, &name, n, m, p)
}

fn heading(export: &ControllerExport, law: &Law) -> Vec<String> {
    let what = match &export.q {
        Some(q) => format!("Controller J_K(Q) with a Q of {} states", q.order()),
        None => "Controller J_K".to_owned(),
    };
    let (n, ts) = (law.a.nrows(), number(law.time.ts()));
    let what = format!("{what}, {n} states, sample time {ts} s, positive feedback u = K y.");
    text::heading(what, [("Measured y:  ", &export.measured), ("Commanded u: ", &export.commanded)], &export.origin)
}
