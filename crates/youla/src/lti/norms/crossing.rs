//! The frequencies at which the real or imaginary part of a scalar response takes a value.
//!
//! With `S~(s) = S(-s)`, twice the real part of S on the imaginary axis is `S + S~`, twice the imaginary part `-j (S - S~)`.
//! The zeros of such a sum F on the axis are the frequencies sought. F may vanish at infinity to any order, where the
//! response is real; its zeros are therefore computed about a point `j w0` of the axis at which F does not vanish:
//!
//! ```text
//! s = j w0 + 1/w:    F = f0 - C E (w - E)^-1 E B,    E = (A - j w0)^-1,  f0 = F(j w0),    zeros: eigenvalues w of E + E B C E / f0
//! ```
//!
//! Discrete systems are mapped to the imaginary axis first. The eigenvalues only divide the axis: every change of sign
//! between two neighbours is followed to its root, so that their rounding does not enter.

use super::curve::Curve;
use super::hamiltonian::Image;
use super::level::between;
use super::peak::frequencies_of_poles;
use crate::linalg::complex_eigenvalues;
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Mat, Result, c64};
use faer::prelude::*;

/// Size of F over that of the response below which an eigenvalue is a root without a change of sign.
const TOUCHES: f64 = 1e-10;

/// What of the response is set to zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Part {
    /// The imaginary part.
    Imaginary,
    /// The real part less this value.
    RealLess(f64),
}

impl Part {
    fn of(self, value: c64) -> f64 {
        match self {
            Part::Imaginary => value.im,
            Part::RealLess(level) => value.re - level,
        }
    }

    /// `(a, c)` of `F = a S + a* S~ + c`, twice the part.
    fn coefficients(self) -> (c64, f64) {
        match self {
            Part::Imaginary => (c64::new(0.0, -1.0), 0.0),
            Part::RealLess(level) => (c64::new(1.0, 0.0), -2.0 * level),
        }
    }
}

/// All frequencies, rad/s, rising, at which the part of the response of a scalar system vanishes. At zero and at the end
/// (infinity or Nyquist) the response is real, and they count for the imaginary part.
///
/// # Errors
/// [`Error::PoleOnBoundary`] for a pole on the stability boundary.
pub(crate) fn crossings<T: TimeDomain>(system: &StateSpace<T>, part: Part) -> Result<Vec<f64>> {
    let system = system.balanced()?;
    let curve = Curve::new(&system)?;
    let value = |frequency: f64| -> Result<c64> { Ok(curve.at(frequency)?[(0, 0)]) };
    let mut found = if part == Part::Imaginary { vec![0.0, curve.end()] } else { Vec::new() };
    let mut marks = vec![0.0, curve.end()];
    marks.extend(zeros(&system, part, value)?.into_iter().filter(|w| w.is_finite()).map(|w| w.min(curve.end())));
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    for mark in &marks {
        let at = value(*mark)?;
        if part.of(at).abs() <= TOUCHES * (1.0 + at.norm()) {
            found.push(*mark);
        }
    }
    let probes: Vec<f64> = marks.windows(2).map(|w| between(w[0], w[1])).collect();
    for pair in probes.windows(2) {
        let (low, high) = (part.of(value(pair[0])?), part.of(value(pair[1])?));
        if low * high < 0.0 {
            found.push(bisect(pair[0], pair[1], low, |w| Ok(part.of(value(w)?)))?);
        }
    }
    found.sort_by(f64::total_cmp);
    found.dedup_by(|x, y| *x == *y || (*x - *y).abs() <= 1e-12 * y.abs());
    Ok(found)
}

/// The magnitudes of the imaginary parts of the zeros of F, as frequencies of the system, in any order.
fn zeros<T: TimeDomain>(system: &StateSpace<T>, part: Part, value: impl Fn(f64) -> Result<c64>) -> Result<Vec<f64>> {
    let n = system.order();
    let mut reference = (0.0, 0.0, 0.0);
    for pole in frequencies_of_poles(system)?.into_iter().filter(|w| w.is_finite()) {
        for factor in [0.3, 0.8, 1.0, 1.3, 3.0] {
            let frequency = match system.time().sample_time() {
                Some(ts) => (factor * pole).min(3.0 / ts),
                None => factor * pole,
            };
            let at = value(frequency)?;
            let score = part.of(at).abs() / (1.0 + at.norm());
            if score > reference.0 {
                reference = (score, frequency, 2.0 * part.of(at));
            }
        }
    }
    let (score, frequency, f0) = reference;
    if n == 0 || score < TOUCHES {
        return Ok(Vec::new());
    }
    let image = Image::new(system, false)?;
    let (scale, _) = part.coefficients();
    let shift = c64::new(0.0, image.of_frequency(frequency));
    let real = |x: f64| c64::new(x, 0.0);
    let a = Mat::from_fn(2 * n, 2 * n, |i, j| {
        let entry = match (i < n, j < n) {
            (true, true) => image.a[(i, j)],
            (false, false) => -image.a[(j - n, i - n)],
            _ => 0.0,
        };
        real(entry) - if i == j { shift } else { real(0.0) }
    });
    let b = Mat::from_fn(2 * n, 1, |i, _| real(if i < n { image.b[(i, 0)] } else { image.c[(0, i - n)] }));
    let c = Mat::from_fn(
        1,
        2 * n,
        |_, j| {
            if j < n { scale * image.c[(0, j)] } else { -scale.conj() * image.b[(j - n, 0)] }
        },
    );
    let lu = a.partial_piv_lu();
    let e = lu.solve(Mat::<c64>::identity(2 * n, 2 * n));
    let (eb, ce) = (lu.solve(&b), &c * &e);
    let matrix = e + Scale(real(1.0 / f0)) * eb * ce;
    if !matrix.is_all_finite() {
        return Err(Error::PoleOnBoundary { omega: frequency });
    }
    let values = complex_eigenvalues("the crossings of a response", matrix)?;
    Ok(values.into_iter().map(|w| image.frequency((shift + real(1.0) / w).im.abs())).collect())
}

/// The root between two frequencies at which f has different signs.
fn bisect(mut low: f64, mut high: f64, at_low: f64, f: impl Fn(f64) -> Result<f64>) -> Result<f64> {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return Ok(middle);
        }
        let value = f(middle)?;
        if value == 0.0 {
            return Ok(middle);
        }
        if value * at_low > 0.0 { low = middle } else { high = middle }
    }
}
