//! Algebraic Riccati equations with cross term, continuous and discrete, and their stabilising solution X:
//!
//! ```text
//! A'X + X A     - (X B + S) R^-1 (B'X + S')              + Q = 0      K = R^-1 (B'X + S')
//! A'X A   - X   - (A'X B + S) (R + B'X B)^-1 (B'X A + S') + Q = 0      K = (R + B'X B)^-1 (B'X A + S')
//! ```
//!
//! One path serves both; `n` is the number of states:
//!
//! ```text
//! normal form: R = I, states balanced                                                  normal_form.rs
//! does a mode that needs feedback lie almost out of reach of the input?                weakly_controllable.rs
//! |  yes: change the states, solve there; accept if the relative residual < 1e-12
//! |       rounding of A - B K there > 10 times the closed loop: discard
//! |                            > 0.3 times: transform X back and refine it here
//! |                            else: transform the gain back and keep its poles
//! |  no, or not accepted: solve in normal form; the lower residual is returned
//! solve
//! |  n >= 32: doubling, refined; accept if the relative residual < 1e-12               doubling.rs, newton.rs
//! |  else, or not accepted: stable subspace of a Hamiltonian matrix, refined           hamiltonian.rs, newton.rs
//! |  residual > 1e-8 or a closed-loop pole that is not stable: error
//! a closed-loop pole near the boundary, or an error: test the modes of A, name the one in the way     modes.rs
//! ```
//!
//! The discrete pencil is mapped to a Hamiltonian matrix by a Cayley transformation, the stable invariant subspace comes from an
//! ordered real Schur form (A. J. Laub, IEEE Trans. Autom. Control 24 (1979), 913), and Newton steps (D. L. Kleinman, IEEE Trans.
//! Autom. Control 13 (1968), 114; G. A. Hewer, 16 (1971), 382) refine X on the original data while they lower the residual. A
//! singular A in discrete time needs no special care: nothing inverts it.

mod doubling;
mod hamiltonian;
mod modes;
mod newton;
mod normal_form;
mod weakly_controllable;

use super::{check_finite, check_shape};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};
use normal_form::{NormalForm, check_symmetric};
use weakly_controllable::WithinReach;

/// Relative residual beyond which a computed solution is refused: the accuracy that the factors promise for their Bezout
/// identity, which `tests/all/random_loops` holds.
const ACCEPTED_RESIDUAL: f64 = 1e-8;

/// Order from which on doubling is tried first: its products and LU factors of order n are then faster than a Schur form of
/// order 2 n.
const LARGE: usize = 32;

/// Relative residual after refinement up to which no other way is tried: what the subspace reaches on random problems of 2 to
/// 40 states (`tests::random_problems`).
const GOOD_RESIDUAL: f64 = 1e-12;

/// Bound on the rounding of the closed loop, relative to its largest pole, up to which the gain is taken from other coordinates.
/// This bound and the next overestimate rounding by orders of magnitude, since norms do not know of cancellation.
const LARGEST_ROUNDING: f64 = 0.3;

/// Bound beyond which nothing is taken from other coordinates.
const WEAKLY_CONTROLLABLE: f64 = 10.0;

/// Data of a Riccati equation: n states, m inputs.
#[derive(Debug, Clone, Copy)]
pub struct RiccatiProblem<'a> {
    /// State matrix A, n x n.
    pub a: MatRef<'a, f64>,
    /// Input matrix B, n x m.
    pub b: MatRef<'a, f64>,
    /// Weight of the states, n x n, symmetric.
    pub q: MatRef<'a, f64>,
    /// Weight of the inputs, m x m, symmetric and positive definite.
    pub r: MatRef<'a, f64>,
    /// Cross term S of the weight `[Q S; S' R]`, n x m; none means zero.
    pub s: Option<MatRef<'a, f64>>,
}

impl RiccatiProblem<'_> {
    /// Shapes, finite entries, symmetric weights.
    pub(crate) fn check(&self, what: &str) -> Result<()> {
        let RiccatiProblem { a, b, q, r, s } = *self;
        let (n, m) = (a.nrows(), b.ncols());
        let cross = s.map(|s| ("the cross weight S", s, (n, m)));
        let named = [
            ("the state matrix A", a, (n, n)),
            ("the input matrix B", b, (n, m)),
            ("the state weight Q", q, (n, n)),
            ("the input weight R", r, (m, m)),
        ];
        for (name, matrix, expected) in named.into_iter().chain(cross) {
            let name = format!("{name} of {what}");
            check_shape(&name, matrix, expected)?;
            check_finite(&name, matrix)?;
        }
        check_symmetric(&format!("the state weight Q of {what}"), q)?;
        check_symmetric(&format!("the input weight R of {what}"), r)
    }
}

/// Stabilising solution of a Riccati equation.
#[derive(Debug, Clone)]
pub struct RiccatiSolution {
    /// Symmetric solution X, n x n. Its rounding is relative to its largest entry: where a mode that needs feedback is almost out
    /// of reach, take the gain, not `B'X`.
    pub x: Mat<f64>,
    /// Gain K, m x n, in the sign of the textbooks: `A - B K` is stable.
    pub gain: Mat<f64>,
    /// Eigenvalues of `A - B K`, strictly inside of the stability boundary.
    pub closed_loop_poles: Vec<c64>,
    /// Norm of the left-hand side, written with the closed loop, over the sum of the norms of its terms, in coordinates in
    /// which R = I, the states are balanced and no mode that needs feedback is almost out of reach: there no large entry can hide
    /// an error in a small one.
    pub relative_residual: f64,
    /// Newton steps that lowered the residual.
    pub newton_steps: usize,
}

/// Stabilising solution of the continuous-time Riccati equation.
///
/// Relative residual below 1e-12 on random problems of 2 to 40 states (`tests::random_problems`) and below 1e-10 where the
/// units of the states differ by six decades (`tests::scaling_over_six_decades`).
///
/// # Errors
/// [`Error::Shape`], [`Error::NotFinite`], [`Error::NotSymmetric`] and [`Error::NotPositive`] name the matrix;
/// [`Error::NotStabilisable`] and [`Error::NotDetectable`] name the mode for which no stabilising solution exists;
/// [`Error::NoSolution`] where the computed solution does not hold.
///
/// ```
/// use youla::{Mat, linalg::{RiccatiProblem, care, eye}};
/// // x^+ = x + u with unit weights: x = 1 + sqrt 2.
/// let one = eye(1);
/// let problem = RiccatiProblem { a: one.as_ref(), b: one.as_ref(), q: one.as_ref(), r: one.as_ref(), s: None };
/// let solution = care("the regulator", &problem)?;
/// assert!((solution.x[(0, 0)] - (1.0 + 2f64.sqrt())).abs() < 1e-14);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn care(what: &str, problem: &RiccatiProblem<'_>) -> Result<RiccatiSolution> {
    solve(what, Equation::Continuous, problem)
}

/// Stabilising solution of the discrete-time Riccati equation; A may be singular.
///
/// R must be positive definite by itself (not only `R + B'X B`). Accuracy as for [`care`].
///
/// # Errors
/// As for [`care`].
///
/// ```
/// use youla::{Mat, linalg::{RiccatiProblem, dare, eye}};
/// // x^+ = x + u with unit weights: x is the golden ratio.
/// let one = eye(1);
/// let problem = RiccatiProblem { a: one.as_ref(), b: one.as_ref(), q: one.as_ref(), r: one.as_ref(), s: None };
/// let solution = dare("the regulator", &problem)?;
/// assert!((solution.x[(0, 0)] - 0.5 * (1.0 + 5f64.sqrt())).abs() < 1e-14);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn dare(what: &str, problem: &RiccatiProblem<'_>) -> Result<RiccatiSolution> {
    solve(what, Equation::Discrete, problem)
}

/// Which of the two equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Equation {
    Continuous,
    Discrete,
}

impl Equation {
    /// Distance beyond the stability boundary, negative where stable.
    fn instability(self, pole: c64) -> f64 {
        match self {
            Equation::Continuous => pole.re,
            Equation::Discrete => pole.norm() - 1.0,
        }
    }

    /// The nearest point of the stability boundary.
    fn on_boundary(self, pole: c64) -> c64 {
        match self {
            Equation::Continuous => c64::new(0.0, pole.im),
            Equation::Discrete if pole.norm() == 0.0 => c64::new(1.0, 0.0),
            Equation::Discrete => pole / pole.norm(),
        }
    }
}

fn solve(what: &str, equation: Equation, problem: &RiccatiProblem<'_>) -> Result<RiccatiSolution> {
    let normal = NormalForm::new(what, equation, problem)?;
    let attempt = stabilising_solution(what, &normal);
    // Rounding may push a mode that no feedback moves, or a double eigenvalue on the boundary, to either side: where the
    // closed loop comes near the boundary, the modes of the plant decide whether a solution exists at all.
    let doubtful = attempt.as_ref().map_or(true, |solution| solution.is_near_boundary(&normal));
    if doubtful && let Some(refusal) = modes::obstacle(what, &normal)? {
        return Err(refusal);
    }
    let Stabilised { x, gain, closed_loop_poles, relative_residual, newton_steps } = attempt?;
    let (x, gain) = (normal.original_solution(&x), normal.original_gain(&gain));
    Ok(RiccatiSolution { x, gain, closed_loop_poles, relative_residual, newton_steps })
}

/// A solution in normal form.
struct Stabilised {
    x: Mat<f64>,
    gain: Mat<f64>,
    closed_loop_poles: Vec<c64>,
    relative_residual: f64,
    newton_steps: usize,
}

impl Stabilised {
    fn is_near_boundary(&self, normal: &NormalForm) -> bool {
        let tolerance = 1e-7 * normal.size();
        self.closed_loop_poles.iter().any(|p| normal.equation.instability(*p) > -tolerance)
    }
}

/// In coordinates in which all modes that need feedback are within reach, where some are not; else, or where these do not lead
/// to a residual of rounding, in those of `normal`.
fn stabilising_solution(what: &str, normal: &NormalForm) -> Result<Stabilised> {
    let within = within_reach(what, normal);
    match within {
        Ok(Some(found)) if found.relative_residual < GOOD_RESIDUAL => Ok(found),
        Ok(Some(found)) => match solution(what, normal) {
            Ok(direct) if direct.relative_residual < found.relative_residual => Ok(direct),
            _ => Ok(found),
        },
        _ => solution(what, normal),
    }
}

/// Doubling for large n where its refined outcome holds, else the invariant subspace.
fn solution(what: &str, normal: &NormalForm) -> Result<Stabilised> {
    if normal.a.nrows() >= LARGE
        && let Some(start) = doubling::stabilising_solution(normal)
        && let Ok(doubled) = finished(what, normal, start)
        && doubled.relative_residual < GOOD_RESIDUAL
    {
        return Ok(doubled);
    }
    finished(what, normal, hamiltonian::stabilising_solution(what, normal)?)
}

/// The solution by way of [`WithinReach`]; none where rounding hides the closed loop from whoever computes it in the coordinates
/// of `normal`. Its gain is taken there too where rounding leaves the closed loop as it is: X in other coordinates may be too
/// large in one direction to hold the others.
fn within_reach(what: &str, normal: &NormalForm) -> Result<Option<Stabilised>> {
    let Some(problem) = WithinReach::new(what, normal)? else { return Ok(None) };
    let found = solution(what, &problem.normal)?;
    let (x, gain) = (problem.solution(&found.x), problem.gain(&found.gain, normal));
    let largest = found.closed_loop_poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let rounding = problem.rounding(&gain, normal) / largest;
    if rounding > WEAKLY_CONTROLLABLE || rounding.is_nan() {
        return Ok(None);
    }
    if rounding > LARGEST_ROUNDING {
        return finished(what, normal, x).map(Some);
    }
    let closed_loop = &normal.a - &normal.b * &gain;
    let closed_loop_poles = stable_poles(what, normal.equation, &closed_loop, found.relative_residual)?;
    Ok(Some(Stabilised { x, gain, closed_loop_poles, ..found }))
}

/// Refinement, and the proof that the outcome solves and stabilises.
fn finished(what: &str, normal: &NormalForm, start: Mat<f64>) -> Result<Stabilised> {
    let newton::Refined { x, relative_residual, steps } = newton::refine(what, normal, start)?;
    let gain = newton::gain(normal, &x)?;
    let closed_loop = &normal.a - &normal.b * &gain;
    let closed_loop_poles = stable_poles(what, normal.equation, &closed_loop, relative_residual)?;
    if relative_residual > ACCEPTED_RESIDUAL || relative_residual.is_nan() {
        let condition = "the equation is too ill-conditioned for its solution to be computed".to_owned();
        return Err(Error::NoSolution { what: equation_name(what), condition, residual: relative_residual });
    }
    Ok(Stabilised { x, gain, closed_loop_poles, relative_residual, newton_steps: steps })
}

/// Eigenvalues of the closed loop, or the refusal that names one that is not stable.
fn stable_poles(what: &str, equation: Equation, closed_loop: &Mat<f64>, residual: f64) -> Result<Vec<c64>> {
    let poles = super::eigenvalues(&format!("the closed loop of {what}"), closed_loop.as_ref())?;
    let worst = poles.iter().copied().max_by(|p, q| equation.instability(*p).total_cmp(&equation.instability(*q)));
    match worst {
        // A pole that is not a number counts as unstable.
        Some(p) if equation.instability(p).is_nan() || equation.instability(p) >= 0.0 => {
            let condition = format!("the closed loop keeps the pole {}", crate::error::Pole(p));
            Err(Error::NoSolution { what: equation_name(what), condition, residual })
        }
        _ => Ok(poles),
    }
}

/// How errors name the equation of `what`.
fn equation_name(what: &str) -> String {
    format!("the Riccati equation of {what}")
}

#[cfg(test)]
mod tests;
