//! Noise at the outputs that enters at the inputs of the plant: torque of cogging and of a current controller, load, turbulence.
//!
//! ```text
//! spectrum of v_i = sigma^2 (1 + lambda |G_i|^2) = sigma^2 |H_i|^2,     H_i = 1 + C_i (z I - A)^-1 K_i
//! ```
//! with white noise of equal size at all inputs beside that of the sensor. It has the resonances of the plant as peaks, which an autoregression
//! of the order that it takes does not describe at a resonance of few lines; modes beside it in G would. K_i is the gain of a Kalman
//! filter, so that H_i has its zeros inside of the unit circle. An autoregression describes what is left.
//!
//! Up to seven outputs see the same noise, so that one Kalman filter has them together ([`joint`]); of more each has its own, as here.
//!
//! Torque that changes slowly has a colour, `w = e / (z - c)`: one state for each input behind white noise. An autoregression of the whole would
//! take dozens of coefficients for it, and in a loop a wrong plant takes fewer.

pub(crate) mod entering;
mod gains;
pub(crate) mod joint;
mod kalman;
mod size;
mod sizes;

use super::autoregression::Regression;
pub(crate) use gains::{Gains, LINES, NARROW, Responses, has_line, hidden, is_line, longest};
pub(crate) use joint::Joint;
pub(crate) use kalman::{Entry, Kalman, LARGEST_POLE, places_of, states_of};
pub(crate) use sizes::Bins;

use super::model::Model;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use crate::linalg::eigenvalues;
use faer::{Mat, c64};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::ops::Range;

/// Growth of a pole over all records up to which an integrator is not told from it, as a logarithm. Noise of several outputs has a state for each,
/// of which nothing may grow beside those of the plant.
const GROWTH: f64 = 2.0;

/// The filter `1 / H_i` of an output, and what it is made of.
#[derive(Debug, Clone)]
pub(crate) struct Driven {
    /// Quadratics of the numerator and denominator: `(1 + c_1 / z + c_2 / z^2) / (1 + d_1 / z + d_2 / z^2)`.
    sections: Vec<[f64; 4]>,
    /// Its Kalman filter, over whose `unstable` the filter is smaller: it mirrors the poles outside of the unit circle.
    pub(crate) kalman: Kalman,
    /// A of the model.
    pub(crate) a: Mat<f64>,
    /// C of the model, its row of the output.
    pub(crate) c: Mat<f64>,
}

impl Driven {
    /// The most likely size of such noise in the residual of an output, on the lines of each record, with an autoregression behind it; `None` where
    /// there is none.
    pub(crate) fn new(
        model: &Model,
        (spectra, gains): (&Spectra, &Gains),
        residual: &[Vec<c64>],
        (output, behind): (usize, &Regression),
    ) -> Option<Self> {
        let samples = spectra.samples() as f64;
        let poles = model.poles();
        if poles.is_empty() || poles.iter().any(|p| p.norm().ln() > GROWTH / samples) {
            return None;
        }
        let ratio = size::ratio((spectra, gains), residual, (output, behind))?;
        // Blocks that are hidden from the output have no part in its filter.
        let hidden = &gains.hidden[output];
        let (kalman, closed) = Kalman::new(model, hidden, (output..output + 1, Entry::of_one(ratio, model.inputs)))?;
        let zeros = eigenvalues("the noise", closed.as_ref()).ok()?;
        let mirrored = |p: c64| if p.norm() > 1.0 { p / p.norm_sqr() } else { p };
        let poles = model.without(hidden).poles().into_iter().map(mirrored).collect();
        let [over, under] = [poles, zeros].map(quadratics);
        let sections = over.iter().zip(&under).map(|(o, u)| [o[0], o[1], u[0], u[1]]).collect();
        let (a, _, c) = model.matrices();
        let c = c.subrows(output, 1).to_owned();
        Some(Driven { sections, kalman, a, c })
    }

    /// Number of its parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.kalman.entry.parameters()
    }

    /// Multiplies by `1 / H_i`, poles outside of the unit circle mirrored, given `1 / z`.
    #[inline(always)]
    pub(crate) fn apply(&self, back: &Lanes, to: &mut Lanes) {
        let mut under = Lanes::ZERO;
        under.re.fill(1.0);
        for [c1, c2, d1, d2] in &self.sections {
            multiply(to, back, [*c1, *c2]);
            multiply(&mut under, back, [*d1, *d2]);
        }
        to.multiply(&under.inverse());
    }

    /// The residual of the output behind `1 / H_i`, on the lines of each record.
    pub(crate) fn rest(&self, spectra: &Spectra, residual: &[Vec<c64>]) -> Vec<Vec<c64>> {
        let of_record = |(lines, v): (&Lines, &Vec<c64>)| {
            let of = |range| Arch::new().dispatch(Rest { driven: self, lines, v, range });
            parts(lines.z.len()).map(of).collect::<Vec<Vec<c64>>>().concat()
        };
        spectra.records.iter().zip(residual).map(of_record).collect()
    }

    /// The same at one line.
    pub(crate) fn at(&self, back: c64) -> c64 {
        let quadratic = |one: f64, two: f64| (back * two + one) * back + 1.0;
        self.sections.iter().fold(c64::ONE, |f, [c1, c2, d1, d2]| f * quadratic(*c1, *c2) / quadratic(*d1, *d2))
    }
}

/// Multiplies by `1 + a / z + b / z^2`.
#[inline(always)]
fn multiply(to: &mut Lanes, back: &Lanes, [a, b]: [f64; 2]) {
    for l in 0..LANES {
        let (x, y) = (back.re[l], back.im[l]);
        let (re, im) = (1.0 + a * x + b * (x * x - y * y), (a + 2.0 * b * x) * y);
        (to.re[l], to.im[l]) = (to.re[l] * re - to.im[l] * im, to.re[l] * im + to.im[l] * re);
    }
}

/// Residuals behind `1 / H_i` on a part of the lines, with the widest instructions that the processor has.
struct Rest<'a> {
    driven: &'a Driven,
    lines: &'a Lines,
    v: &'a [c64],
    range: Range<usize>,
}

impl NullaryFnOnce for Rest<'_> {
    type Output = Vec<c64>;

    #[inline(always)]
    fn call(self) -> Vec<c64> {
        let Rest { driven, lines, v, range } = self;
        let mut out = Vec::with_capacity(range.len());
        for first in range.clone().step_by(LANES) {
            let line = |l: usize| (first + l).min(range.end - 1);
            let back = Lanes::gather(|l| lines.z[line(l)].conj());
            let mut rest = Lanes::gather(|l| v[line(l)]);
            driven.apply(&back, &mut rest);
            out.extend((0..LANES.min(range.end - first)).map(|l| c64::new(rest.re[l], rest.im[l])));
        }
        out
    }
}

/// `1 + a / z + b / z^2` of each conjugate pair, and of real roots two by two.
fn quadratics(roots: Vec<c64>) -> Vec<[f64; 2]> {
    let pairs = roots.iter().filter(|r| r.im > 0.0).map(|r| [-2.0 * r.re, r.norm_sqr()]);
    let real: Vec<f64> = roots.iter().filter(|r| r.im == 0.0).map(|r| r.re).collect();
    let product = |two: &[f64]| two.get(1).map_or([-two[0], 0.0], |b| [-two[0] - b, two[0] * b]);
    pairs.chain(real.chunks(2).map(product)).collect()
}
