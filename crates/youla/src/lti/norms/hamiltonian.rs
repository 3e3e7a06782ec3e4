//! The frequencies at which a singular value of `G = C (s I - A)^-1 B + D` equals a level. In continuous time, for a level
//! above the largest singular value of D, they are the imaginary eigenvalues of the Hamiltonian matrix (level 1 after scaling)
//!
//! ```text
//! H = [A + B R^-1 D'C, B R^-1 B'; -C'(I + D R^-1 D')C, -(A + B R^-1 D'C)'],    R = I - D'D
//! ```
//!
//! (S. Boyd, V. Balakrishnan and P. Kabamba, Math. Control Signals Syst. 2 (1989), 207). A discrete system becomes a continuous
//! one of the same gains by `z = (1 + s) / (1 - s)`, so that no matrix that may be singular is inverted:
//!
//! ```text
//! A_c = (A + I)^-1 (A - I),  B_c = sqrt(2) (A + I)^-1 B,  C_c = sqrt(2) C (A + I)^-1,  D_c = G(-1) = D - C (A + I)^-1 B
//! ```
//!
//! R is ill-conditioned where the gain at the reference point, infinity or z = -1, is near to the level. The other real point
//! of the boundary, zero or z = 1, is then the reference, by `s -> 1/s` or `z -> -z`.

use super::curve::Curve;
use crate::linalg::{balance, block, eigenvalues, eye, solve, solve_right};
use crate::lti::{Continuous, StateSpace, TimeDomain};
use crate::{Mat, Result};
use faer::Scale;
use std::f64::consts::{PI, SQRT_2};

/// Distance of the gain at the reference point from the level, over the level, below which the other one is tried.
const NEAR_LEVEL: f64 = 0.1;

/// Reciprocal condition number below which a reference point is not changed to.
const WELL_CONDITIONED: f64 = 1e-8;

/// Real part of an eigenvalue, over the norm of the matrix, up to which it may be imaginary.
const NEAR_AXIS: f64 = 1e-7;

/// Candidates for the frequencies at which a singular value equals a level.
pub(super) struct Crossings {
    /// The imaginary parts of all eigenvalues, rad/s, rising.
    all: Vec<f64>,
    /// Those of the eigenvalues near to the axis, rising.
    near: Vec<f64>,
}

impl Crossings {
    /// Of a system in balanced states with the given response.
    pub(super) fn at_level<T: TimeDomain>(system: &StateSpace<T>, curve: &Curve<T>, level: f64) -> Result<Self> {
        let (at_zero, at_end) = (curve.gain(0.0)?, curve.gain(curve.end())?);
        let distance = |gain: f64| (1.0 - gain / level).abs();
        let prefer_other = distance(at_end) < NEAR_LEVEL && distance(at_zero) > distance(at_end);
        let continuous = Image::new(system, prefer_other)?;
        let h = balance("the Hamiltonian matrix", continuous.hamiltonian(level)?.as_ref())?.a;
        let size = h.norm_max();
        let (mut all, mut near) = (Vec::new(), Vec::new());
        for value in eigenvalues("the Hamiltonian matrix", h.as_ref())? {
            let frequency = continuous.frequency(value.im.abs());
            all.push(frequency);
            if value.re.abs() <= NEAR_AXIS * size.max(value.norm()) {
                near.push(frequency);
            }
        }
        all.sort_by(f64::total_cmp);
        near.sort_by(f64::total_cmp);
        near.dedup();
        Ok(Crossings { all, near })
    }

    /// All candidates, rising.
    pub(super) fn all(&self) -> &[f64] {
        &self.all
    }

    /// All candidates and the middles between neighbours.
    pub(super) fn frequencies(&self) -> Vec<f64> {
        let middles = |list: &[f64]| list.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect::<Vec<_>>();
        [self.all.clone(), middles(&self.all), middles(&self.near)].concat()
    }
}

/// How frequencies of the continuous image belong to those of the system.
enum Map {
    Same,
    Reciprocal,
    Bilinear { ts: f64 },
    Reflected { ts: f64 },
}

/// A continuous system with the gains of the given one.
pub(super) struct Image {
    pub(super) a: Mat<f64>,
    pub(super) b: Mat<f64>,
    pub(super) c: Mat<f64>,
    pub(super) d: Mat<f64>,
    map: Map,
}

impl Image {
    pub(super) fn new<T: TimeDomain>(system: &StateSpace<T>, prefer_other: bool) -> Result<Self> {
        let [a, b, c, d] = [system.a(), system.b(), system.c(), system.d()].map(|m| m.to_owned());
        let n = a.nrows();
        match system.time().sample_time() {
            None if prefer_other && crate::linalg::reciprocal_condition(a.as_ref()) > WELL_CONDITIONED => {
                let minus = Scale(-1.0);
                let (inverse, from_input) = inverse_and(&a, &b)?;
                let d = d - &c * &from_input;
                Ok(Image { c: minus * &c * &inverse, a: inverse, b: from_input, d, map: Map::Reciprocal })
            }
            None => Ok(Image { a, b, c, d, map: Map::Same }),
            Some(ts) => {
                let condition = |sign: f64| crate::linalg::reciprocal_condition((&a + Scale(sign) * eye(n)).as_ref());
                let (plain, other) = (condition(1.0), condition(-1.0));
                let reflect = (prefer_other && other > WELL_CONDITIONED) || (plain < WELL_CONDITIONED && plain < other);
                if reflect {
                    let minus = Scale(-1.0);
                    bilinear(minus * &a, b, minus * &c, d, Map::Reflected { ts })
                } else {
                    bilinear(a, b, c, d, Map::Bilinear { ts })
                }
            }
        }
    }

    /// H for a level; B and C share the scaling to level 1.
    fn hamiltonian(&self, level: f64) -> Result<Mat<f64>> {
        let root = Scale(1.0 / level.sqrt());
        let (b, c, d) = (root * &self.b, root * &self.c, Scale(1.0 / level) * &self.d);
        let (n, m) = (b.nrows(), b.ncols());
        let r = eye(m) - d.transpose() * &d;
        let right = block(&[&[(d.transpose() * &c).as_ref(), b.transpose()]]);
        let solved = solve("the difference of a level and the feedthrough", r.as_ref(), right.as_ref())?;
        let (feedback, input) = (solved.subcols(0, n), solved.subcols(n, n));
        let a = &self.a + &b * feedback;
        let q = c.transpose() * &c + c.transpose() * &d * feedback;
        let minus = Scale(-1.0);
        Ok(block(&[&[a.as_ref(), (&b * input).as_ref()], &[(minus * &q).as_ref(), (minus * a.transpose()).as_ref()]]))
    }

    /// The frequency of the system, rad/s, that belongs to one of the image.
    pub(super) fn frequency(&self, image: f64) -> f64 {
        match self.map {
            Map::Same => image,
            Map::Reciprocal => 1.0 / image,
            Map::Bilinear { ts } => 2.0 * image.atan() / ts,
            Map::Reflected { ts } => (PI - 2.0 * image.atan()) / ts,
        }
    }

    /// The frequency of the image, rad/s, that belongs to one of the system.
    pub(super) fn of_frequency(&self, frequency: f64) -> f64 {
        match self.map {
            Map::Same => frequency,
            Map::Reciprocal => 1.0 / frequency,
            Map::Bilinear { ts } => (0.5 * frequency * ts).tan(),
            Map::Reflected { ts } => (0.5 * (PI - frequency * ts)).tan(),
        }
    }
}

/// The continuous image of a system without a pole at z = -1; a continuous system is its own.
pub(crate) fn continuous_image<T: TimeDomain>(system: &StateSpace<T>) -> Result<StateSpace<Continuous>> {
    let [a, b, c, d] = [system.a(), system.b(), system.c(), system.d()].map(|m| m.to_owned());
    let Image { a, b, c, d, .. } = match system.time().sample_time() {
        None => Image { a, b, c, d, map: Map::Same },
        Some(ts) => bilinear(a, b, c, d, Map::Bilinear { ts })?,
    };
    StateSpace::new(a, b, c, d, Continuous)
}

/// `A^-1` and `A^-1 B`.
fn inverse_and(a: &Mat<f64>, b: &Mat<f64>) -> Result<(Mat<f64>, Mat<f64>)> {
    let n = a.nrows();
    let both = block(&[&[eye(n).as_ref(), b.as_ref()]]);
    let solved = solve("the state matrix", a.as_ref(), both.as_ref())?;
    Ok((solved.subcols(0, n).to_owned(), solved.subcols(n, b.ncols()).to_owned()))
}

/// The continuous image of a discrete system by `z = (1 + s) / (1 - s)`.
fn bilinear(a: Mat<f64>, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>, map: Map) -> Result<Image> {
    let n = a.nrows();
    let what = "the state matrix plus the identity";
    let sum = &a + eye(n);
    let right = block(&[&[(&a - eye(n)).as_ref(), b.as_ref()]]);
    let solved = solve(what, sum.as_ref(), right.as_ref())?;
    let (image, input) = (solved.subcols(0, n), solved.subcols(n, b.ncols()));
    let output = solve_right(what, sum.as_ref(), c.as_ref())?;
    let root = Scale(SQRT_2);
    Ok(Image { a: image.to_owned(), d: d - &c * input, b: root * input, c: root * output, map })
}
