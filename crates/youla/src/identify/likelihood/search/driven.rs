//! Noise at an output that enters at the inputs of the plant: torque of cogging and of a current controller, load, turbulence.
//!
//! ```text
//! spectrum of v_i = sigma^2 (1 + lambda |G_i|^2) = sigma^2 |H_i|^2,     H_i = 1 + C_i (z I - A)^-1 K_i
//! ```
//! with white noise of equal size at all inputs beside that of the sensor. It has the resonances of the plant as peaks, which an autoregression
//! of the order that it takes does not describe at a resonance of few lines; modes beside it in G would. K_i is the gain of a Kalman
//! filter, so that H_i has its zeros inside of the unit circle. An autoregression describes what is left.

use super::autoregression::Regression;
use super::block::Block;
use super::model::Model;
use super::state_lanes::resolvent;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use crate::linalg::{RiccatiProblem, dare, eigenvalues};
use faer::{Mat, Scale, c64};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// Growth of a pole over all records up to which an integrator is not told from it, as a logarithm. Noise of several outputs has a state for each,
/// of which nothing may grow beside those of the plant.
const GROWTH: f64 = 2.0;
/// Product of input and output of a block over the largest below which an output does not see what the inputs move there.
const UNSEEN: f64 = 1e-8;
/// Half width of a mode, in lines of the longest record, below which it is a line of the noise and not a peak: what a disturbance leaves has 0.005
/// to 0.1.
pub(crate) const NARROW: f64 = 0.3;
/// About how many lines show the size of the noise.
const LINES: usize = 6000;
/// Steps of the logarithm of that size: the likelihood is flat to a quarter of a nat.
const STEPS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

/// A product from which the next factor might lead out of the range of numbers.
const LARGE: f64 = 1e100;

/// The filter `1 / H_i` of an output, and what it is made of.
#[derive(Debug, Clone)]
pub(crate) struct Driven {
    /// Quadratics of numerator and denominator: `(1 + c_1 / z + c_2 / z^2) / (1 + d_1 / z + d_2 / z^2)`.
    sections: Vec<[f64; 4]>,
    /// lambda.
    pub(crate) ratio: f64,
    /// Product of the magnitudes of the poles outside of the unit circle, which the filter mirrors: `1 / H_i` over its size.
    pub(crate) unstable: f64,
    /// K_i, one for each state of the model.
    pub(crate) gain: Vec<f64>,
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
        let grows = || poles.iter().any(|p| p.norm().ln() > GROWTH / samples);
        if poles.is_empty() || spectra.outputs > 1 && grows() {
            return None;
        }
        let hidden = &gains.hidden[output];
        let seen = model.without(hidden);
        let ratio = size(&lines((spectra, gains), residual, (output, behind)), samples)?;
        let (a, b, c) = seen.matrices();
        let c = c.subrows(output, 1).to_owned();
        let q = &b * b.transpose() * Scale(ratio);
        let one = Mat::<f64>::identity(1, 1);
        let dual = RiccatiProblem { a: a.transpose(), b: c.transpose(), q: q.as_ref(), r: one.as_ref(), s: None };
        let k = dare("the noise", &dual).ok()?.gain.transpose().to_owned();
        let zeros = eigenvalues("the noise", (&a - &k * &c).as_ref()).ok()?;
        let mirrored = |p: c64| if p.norm() > 1.0 { p / p.norm_sqr() } else { p };
        let unstable = seen.poles().iter().map(|p| p.norm().max(1.0)).product();
        let [over, under] = [seen.poles().into_iter().map(mirrored).collect(), zeros].map(quadratics);
        let sections = over.iter().zip(&under).map(|(o, u)| [o[0], o[1], u[0], u[1]]).collect();
        let (mut gain, mut at) = (Vec::with_capacity(model.order()), 0);
        for (place, block) in model.blocks.iter().enumerate() {
            let used = if hidden.contains(&place) { 0 } else { block.states };
            gain.extend((0..block.states).map(|i| if used > 0 { k[(at + i, 0)] } else { 0.0 }));
            at += used;
        }
        let (a, _, c) = model.matrices();
        Some(Driven { sections, ratio, unstable, gain, a, c: c.subrows(output, 1).to_owned() })
    }

    /// Multiplies by `1 / H_i`, given `1 / z`.
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

/// `|G_i|^2` of the blocks that an output sees, on some of the lines.
pub(crate) struct Gains {
    /// Per record lines x p.
    pub(crate) values: Vec<Vec<f64>>,
    /// Every how many lines.
    pub(crate) every: usize,
    /// Blocks that are left out, for each output.
    pub(crate) hidden: Vec<Vec<usize>>,
}

impl Gains {
    pub(crate) fn new(model: &Model, spectra: &Spectra) -> Self {
        let longest = longest(spectra);
        let hidden: Vec<Vec<usize>> = (0..model.outputs).map(|output| hidden(model, longest, output)).collect();
        let every = spectra.lines().div_ceil(LINES).max(1);
        let triangular = |block: &Block| block.triangular(&[]).map_or_else(|| block.clone(), |(block, _)| block);
        let blocks: Vec<Block> = model.blocks.iter().map(triangular).collect();
        let inputs = model.inputs;
        let of = |lines: &Lines| {
            let z: Vec<c64> = lines.z.iter().step_by(every).copied().collect();
            Arch::new().dispatch(GainsOf { blocks: &blocks, inputs, hidden: &hidden, z: &z })
        };
        Gains { values: spectra.records.iter().map(of).collect(), every, hidden }
    }
}

/// Blocks that an output does not see, and modes that are lines of the noise.
fn hidden(model: &Model, longest: f64, output: usize) -> Vec<usize> {
    let reach = |block: &Block| {
        let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        size(&block.b) * size(&block.c[output * block.states..(output + 1) * block.states])
    };
    let largest = model.blocks.iter().map(reach).fold(0.0, f64::max);
    let left_out = |block: &Block| reach(block) <= UNSEEN * largest || is_line(block, longest);
    (0..model.blocks.len()).filter(|k| left_out(&model.blocks[*k])).collect()
}

/// Whether a mode is a line of the noise, by the samples of the longest record.
pub(crate) fn is_line(block: &Block, longest: f64) -> bool {
    block.poles().iter().any(|p| p.im != 0.0 && p.norm().ln().abs() * longest < NARROW * TAU)
}

/// Whether a mode is a line of the noise.
pub(crate) fn has_line(model: &Model, spectra: &Spectra) -> bool {
    let longest = longest(spectra);
    model.blocks.iter().any(|block| is_line(block, longest))
}

/// Samples of the longest record.
pub(crate) fn longest(spectra: &Spectra) -> f64 {
    spectra.records.iter().map(|lines| lines.samples).max().unwrap_or(0) as f64
}

/// The gains on the lines of a record, with the widest instructions that the processor has.
struct GainsOf<'a> {
    blocks: &'a [Block],
    inputs: usize,
    hidden: &'a [Vec<usize>],
    z: &'a [c64],
}

impl NullaryFnOnce for GainsOf<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn call(self) -> Vec<f64> {
        let GainsOf { blocks, inputs: m, hidden, z } = self;
        let largest = blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let (mut inverse, mut x) = (vec![Lanes::ZERO; largest * largest], vec![Lanes::ZERO; largest]);
        let mut g = vec![Lanes::ZERO; hidden.len() * m];
        let mut out = Vec::with_capacity(z.len() * hidden.len());
        for z in z.chunks(LANES) {
            let at = Lanes::gather(|l| z[l.min(z.len() - 1)]);
            g.fill(Lanes::ZERO);
            for (place, block) in blocks.iter().enumerate() {
                let s = block.states;
                resolvent(block, &at, &mut inverse);
                for j in 0..m {
                    x[..s].fill(Lanes::ZERO);
                    for (i, l) in (0..s).flat_map(|i| (0..s).map(move |l| (i, l))) {
                        x[i].add_scaled(&inverse[i * s + l], block.b[l * m + j]);
                    }
                    for (o, hidden) in hidden.iter().enumerate() {
                        if !hidden.contains(&place) {
                            (0..s).for_each(|i| g[o * m + j].add_scaled(&x[i], block.c[o * s + i]));
                        }
                    }
                }
            }
            let square = |g: &Lanes, l: usize| g.re[l] * g.re[l] + g.im[l] * g.im[l];
            for l in 0..z.len() {
                out.extend(g.chunks(m).map(|g| g.iter().map(|g| square(g, l)).sum::<f64>()));
            }
        }
        out
    }
}

/// Of some of the lines how many of the full circle each stands for, power of the residual of these behind an autoregression, and `|G_i|^2`.
fn lines(
    (spectra, gains): (&Spectra, &Gains),
    residual: &[Vec<c64>],
    (output, behind): (usize, &Regression),
) -> Vec<[f64; 3]> {
    let (p, every) = (spectra.outputs, gains.every);
    let mut out = Vec::with_capacity(LINES);
    for ((lines, v), gains) in spectra.records.iter().zip(residual).zip(&gains.values) {
        for (k, gains) in (0..lines.z.len()).step_by(every).zip(gains.chunks_exact(p)) {
            let (count, power) = (lines.share[k], lines.weight[k].powi(2) * v[k].norm_sqr());
            let power = power * behind.at(lines.z[k].conj()).norm_sqr();
            out.push([count * every as f64, power * every as f64, gains[output]]);
        }
    }
    out
}

/// The most likely lambda; `None` where white noise alone has the lesser criterion of Schwarz.
fn size(lines: &[[f64; 3]], samples: f64) -> Option<f64> {
    let cost = |ratio: f64| {
        let (mut power, mut logarithms, mut count) = (0.0, 0.0, 0.0);
        // The logarithm of a product of several shapes is taken at once, where as many lines of the circle stand behind each.
        let (mut product, mut alike) = (1.0f64, 0.0);
        for [of, energy, gain] in lines {
            let shape = 1.0 + ratio * gain;
            power += energy / shape;
            if *of != alike || product > LARGE {
                logarithms += alike * product.ln();
                (product, alike) = (1.0, *of);
            }
            product *= shape;
            count += of;
        }
        count * (power / count).ln() + logarithms + alike * product.ln()
    };
    let gains = || lines.iter().map(|l| l[2]).filter(|g| *g > 0.0);
    let (least, most) = (gains().fold(f64::INFINITY, f64::min).ln(), gains().fold(0.0, f64::max).ln());
    let mut best = (cost(0.0) - samples.ln(), f64::NEG_INFINITY);
    let mut from = -most;
    while from.is_finite() && from <= -least {
        let value = cost(from.exp());
        if value < best.0 {
            best = (value, from);
        }
        from += 2.0 * STEPS[0];
    }
    for step in STEPS {
        for near in [best.1 - step, best.1 + step] {
            let value = cost(near.exp());
            if value < best.0 {
                best = (value, near);
            }
        }
    }
    best.1.is_finite().then(|| best.1.exp())
}

/// `1 + a / z + b / z^2` of each conjugate pair, and of real roots two by two.
fn quadratics(roots: Vec<c64>) -> Vec<[f64; 2]> {
    let pairs = roots.iter().filter(|r| r.im > 0.0).map(|r| [-2.0 * r.re, r.norm_sqr()]);
    let real: Vec<f64> = roots.iter().filter(|r| r.im == 0.0).map(|r| r.re).collect();
    let product = |two: &[f64]| two.get(1).map_or([-two[0], 0.0], |b| [-two[0] - b, two[0] * b]);
    pairs.chain(real.chunks(2).map(product)).collect()
}
