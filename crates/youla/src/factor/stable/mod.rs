//! Coprime factorisations of an unstable plant alone, with as little moved as possible: only the poles beyond the wanted
//! boundary change, all others stay in the numerator as they are.
//!
//! ```text
//! right   G = N M^-1      M = [A+BF | BV; F | V]     N = [A+BF | BV; C+DF | DV]
//! left    G = Mt^-1 Nt    by transposition of the right one
//! ```
//!
//! The denominator is inner, `M~ M = I`, so that each pole goes to its mirror image; or the poles go to a prescribed degree
//! of stability by a small feedback. Recursive on the ordered real Schur form, one real pole or one pair at a time: A.
//! Varga, A Schur method for computing coprime factorizations with inner denominators and applications in model reduction,
//! Proc. American Control Conf. 1993, 2130; and Coprime factors model reduction method based on square-root balancing-free
//! techniques, Systems Analysis Modelling Simulation 11 (1993), 303.

mod assign;
mod inner;
#[cfg(test)]
mod reference;
#[cfg(test)]
pub(super) mod tests;

use crate::linalg::{eye, real_schur};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::{Mat, c64};
use std::cell::Cell;

/// What becomes of the poles that a factorisation moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Denominator {
    /// The denominator is inner (right) or co-inner (left): unstable poles are mirrored at the stability boundary.
    Inner,
    /// Poles beyond this boundary go onto it: the real part in continuous, the modulus in discrete time.
    Degree(f64),
}

/// A right or left coprime factorisation.
#[derive(Debug, Clone)]
pub struct StableFactors<T: TimeDomain> {
    /// N (or Nt), p x m, n states.
    pub numerator: StateSpace<T>,
    /// M (m x m) or Mt (p x p), in the same n states as the numerator.
    pub denominator: StateSpace<T>,
    /// The poles of the plant that were moved, in the order in which they were met.
    pub moved: Vec<c64>,
}

impl<T: TimeDomain> StableFactors<T> {
    /// The denominator without the states that it does not need: as many are left as poles were moved.
    ///
    /// # Errors
    /// Never for factors of this module.
    pub fn minimal_denominator(&self) -> Result<StateSpace<T>> {
        let (whole, count) = (&self.denominator, self.moved.len());
        let first = whole.order() - count;
        StateSpace::new(
            whole.a().submatrix(first, first, count, count).to_owned(),
            whole.b().subrows(first, count).to_owned(),
            whole.c().subcols(first, count).to_owned(),
            whole.d().to_owned(),
            whole.time(),
        )
    }
}

/// Right coprime factorisation `G = N M^-1` of a plant of n states.
///
/// `N M^-1 = G` and `M~ M = I` hold to 1e-10 on random plants (`tests::factors_give_the_plant_back`); the examples of
/// SLICOT's SB08CD, SB08DD, SB08ED and SB08FD are met to their printed digits (`reference`).
///
/// # Errors
/// [`Error::NotStabilisable`] with a pole that no input moves; [`Error::NoSolution`] where the denominator is to be inner and
/// a pole lies on the stability boundary; [`Error::OutOfRange`] for a degree that is not one of stability;
/// [`Error::NoConvergence`] of the Schur form.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace}};
/// use youla::factor::{Denominator, right_coprime};
/// let unstable = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// let factors = right_coprime(&unstable, Denominator::Inner)?;
/// assert!((factors.numerator.a()[(0, 0)] + 1.0).abs() < 1e-14);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn right_coprime<T: TimeDomain>(plant: &StateSpace<T>, denominator: Denominator) -> Result<StableFactors<T>> {
    let limit = limit(plant.time(), denominator)?;
    let mut recursion = Recursion::new(plant, |p| plant.time().instability(p) < limit)?;
    while recursion.has_poles_left() {
        recursion.step(denominator)?;
    }
    recursion.factors()
}

/// Left coprime factorisation `G = Mt^-1 Nt`: the right one of the dual plant.
///
/// # Errors
/// As [`right_coprime`], with [`Error::NotDetectable`] for a pole that no output shows.
pub fn left_coprime<T: TimeDomain>(plant: &StateSpace<T>, denominator: Denominator) -> Result<StableFactors<T>> {
    let factors = right_coprime(&plant.dual(), denominator).map_err(|e| match e {
        Error::NotStabilisable { what, pole, distance } => Error::NotDetectable { what, pole, distance },
        other => other,
    })?;
    let StableFactors { numerator, denominator, moved } = factors;
    Ok(StableFactors { numerator: numerator.dual(), denominator: denominator.dual(), moved })
}

/// The instability from which on a pole is moved.
fn limit<T: TimeDomain>(time: T, denominator: Denominator) -> Result<f64> {
    let refuse = |value, must| Err(Error::OutOfRange { what: "the degree of stability".into(), value, must });
    match (denominator, time.sample_time()) {
        (Denominator::Inner, _) => Ok(0.0),
        (Denominator::Degree(real), None) if real < 0.0 && real.is_finite() => Ok(real),
        (Denominator::Degree(real), None) => refuse(real, "a negative real part"),
        (Denominator::Degree(modulus), Some(_)) if (0.0..1.0).contains(&modulus) => Ok(modulus - 1.0),
        (Denominator::Degree(modulus), Some(_)) => refuse(modulus, "a modulus from 0 to below 1"),
    }
}

/// The plant behind the feedback found so far, `u = F x + V v`, in coordinates in which A is a real Schur form with the poles
/// that stay first.
struct Recursion<T: TimeDomain> {
    time: T,
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
    f: Mat<f64>,
    v: Mat<f64>,
    /// States whose poles stay.
    staying: usize,
    moved: Vec<c64>,
    /// Entries of B below this count as zero.
    negligible: f64,
}

/// Feedback of one diagonal block: `u = f x_k + v w`.
struct BlockFeedback {
    f: Mat<f64>,
    v: Mat<f64>,
}

impl<T: TimeDomain> Recursion<T> {
    fn new(plant: &StateSpace<T>, stays: impl Fn(c64) -> bool) -> Result<Self> {
        let ordered = real_schur("the state matrix", plant.a())?.reorder(stays)?;
        let (n, m) = (plant.order(), plant.inputs());
        let b = ordered.q.transpose() * plant.b();
        Ok(Recursion {
            time: plant.time(),
            negligible: n as f64 * f64::EPSILON * b.norm_l2(),
            b,
            c: plant.c() * &ordered.q,
            a: ordered.t,
            d: plant.d().to_owned(),
            f: Mat::zeros(m, n),
            v: eye(m),
            staying: ordered.dimension,
            moved: Vec::new(),
        })
    }

    fn has_poles_left(&self) -> bool {
        self.staying + self.moved.len() < self.a.nrows()
    }

    /// Treats the last diagonal block and moves it before the others that wait.
    fn step(&mut self, denominator: Denominator) -> Result<()> {
        let n = self.a.nrows();
        let size = if n > 1 && self.a[(n - 1, n - 2)] != 0.0 { 2 } else { 1 };
        let first = n - size;
        let block = self.a.as_ref().submatrix(first, first, size, size).to_owned();
        let input = self.b.as_ref().subrows(first, size).to_owned();
        let poles = real_schur("a diagonal block", block.as_ref())?.eigenvalues();
        if input.norm_l2() <= self.negligible {
            let distance = input.norm_l2();
            return Err(Error::NotStabilisable { what: "the coprime factorisation".into(), pole: poles[0], distance });
        }
        let BlockFeedback { f, v } = match denominator {
            Denominator::Inner => inner::feedback(self.time, &block, &input, poles[0])?,
            Denominator::Degree(degree) => assign::feedback(self.time, &block, &input, poles[0], degree)?,
        };
        self.close(first, &f, &v);
        self.moved.extend(poles);
        self.move_up(first)
    }

    /// `v = f x_k + v_k w` for the states from number `first` on.
    fn close(&mut self, first: usize, f: &Mat<f64>, v: &Mat<f64>) {
        let size = f.ncols();
        for (target, by) in [(&mut self.a, &self.b), (&mut self.c, &self.d), (&mut self.f, &self.v)] {
            let change = by * f;
            let mut columns = target.as_mut().subcols_mut(first, size);
            columns += change;
        }
        for matrix in [&mut self.b, &mut self.d, &mut self.v] {
            *matrix = &*matrix * v;
        }
    }

    /// Brings the states from number `from` on behind those that stay, in the order of the blocks otherwise.
    fn move_up(&mut self, from: usize) -> Result<()> {
        // The form of a matrix that has it but for the shape of the last block: nothing else moves.
        let form = real_schur("the state matrix", self.a.as_ref())?;
        let first_rows: Vec<usize> = first_rows(&form.t);
        let (block, staying) = (Cell::new(0), self.staying);
        let select = |_| {
            let row = first_rows[block.replace(block.get() + 1)];
            row < staying || row >= from
        };
        let ordered = form.reorder(select)?;
        self.b = ordered.q.transpose() * &self.b;
        self.c = &self.c * &ordered.q;
        self.f = &self.f * &ordered.q;
        self.a = ordered.t;
        Ok(())
    }

    fn factors(self) -> Result<StableFactors<T>> {
        let Recursion { time, a, b, c, d, f, v, moved, .. } = self;
        let numerator = StateSpace::new(a.clone(), b.clone(), c, d, time)?;
        let denominator = StateSpace::new(a, b, f, v, time)?;
        Ok(StableFactors { numerator, denominator, moved })
    }
}

/// First rows of the diagonal blocks of a quasi-triangular matrix.
fn first_rows(t: &Mat<f64>) -> Vec<usize> {
    (0..t.nrows()).filter(|&row| row == 0 || t[(row, row - 1)] == 0.0).collect()
}
