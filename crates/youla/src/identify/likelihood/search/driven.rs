//! Noise at an output that enters at the inputs of the plant: torque of cogging and of a current controller, load, turbulence.
//!
//! ```text
//! spectrum of v_i = sigma^2 (1 + lambda |G_i|^2) = sigma^2 |H_i|^2,     H_i = 1 + C_i (z I - A)^-1 K_i
//! ```
//! with white noise of equal size at all inputs beside that of the sensor. It has the resonances of the plant as peaks, which an autoregression
//! of the order that it takes does not describe at a resonance of few lines; modes beside it in G would. K_i is the gain of a Kalman
//! filter, so that H_i has its zeros inside of the unit circle. An autoregression describes what is left.

use super::model::Model;
use crate::identify::likelihood::data::lanes::Lanes;
use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use crate::linalg::{RiccatiProblem, dare, eigenvalues};
use faer::{Mat, Scale, c64};
use std::f64::consts::TAU;

/// Growth of a pole over all records up to which an integrator is not told from it, as a logarithm. Noise of several outputs has a state for each,
/// of which nothing may grow beside those of the plant.
const GROWTH: f64 = 2.0;
/// Product of input and output of a block over the largest below which an output does not see what the inputs move there.
const UNSEEN: f64 = 1e-8;
/// Half width of a mode, in lines of the longest record, below which it is a line of the noise and not a peak.
const NARROW: f64 = 0.3;
/// About how many lines show the size of the noise.
const LINES: usize = 6000;
/// Steps of the logarithm of that size: the likelihood is flat to a quarter of a nat.
const STEPS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

/// The filter `1 / H_i` of an output, and what it is made of.
#[derive(Debug, Clone)]
pub(crate) struct Driven {
    /// Quadratics of numerator and denominator: `(1 + c_1 / z + c_2 / z^2) / (1 + d_1 / z + d_2 / z^2)`.
    sections: Vec<[f64; 4]>,
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
    /// The most likely size of such noise in residuals, lines x p per record; `None` where there is none.
    pub(crate) fn new(
        model: &Model,
        (spectra, moved): (&Spectra, &Moved),
        residuals: &[Vec<c64>],
        output: usize,
    ) -> Option<Self> {
        let samples = spectra.samples() as f64;
        let poles = model.poles();
        let grows = || poles.iter().any(|p| p.norm().ln() > GROWTH / samples);
        if poles.is_empty() || spectra.outputs > 1 && grows() {
            return None;
        }
        let reach = |k: usize| {
            let (block, size) = (&model.blocks[k], |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt());
            size(&block.b) * size(&block.c[output * block.states..(output + 1) * block.states])
        };
        let largest = (0..model.blocks.len()).map(reach).fold(0.0, f64::max);
        let longest = spectra.records.iter().map(|lines| lines.samples).max().unwrap_or(0) as f64;
        let narrow = |p: &c64| p.im != 0.0 && p.norm().ln().abs() * longest < NARROW * TAU;
        let left_out = |k: &usize| reach(*k) <= UNSEEN * largest || model.blocks[*k].poles().iter().any(narrow);
        let hidden: Vec<usize> = (0..model.blocks.len()).filter(left_out).collect();
        let seen = model.without(&hidden);
        let ratio = size(&lines((model, &hidden), (spectra, moved), residuals, output), samples)?;
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
        Some(Driven { sections, unstable, gain, a, c: c.subrows(output, 1).to_owned() })
    }

    /// `1 / H_i`, given `1 / z`.
    #[inline(always)]
    pub(crate) fn filter(&self, back: &Lanes) -> Lanes {
        let quadratic = |one: f64, two: f64| back.scaled(two).shifted(one).times(back).shifted(1.0);
        let (mut over, mut under) = (Lanes::ZERO.shifted(1.0), Lanes::ZERO.shifted(1.0));
        for [c1, c2, d1, d2] in &self.sections {
            over = over.times(&quadratic(*c1, *c2));
            under = under.times(&quadratic(*d1, *d2));
        }
        over.times(&under.inverse())
    }

    /// The same at one line.
    pub(crate) fn at(&self, back: c64) -> c64 {
        let quadratic = |one: f64, two: f64| (back * two + one) * back + 1.0;
        self.sections.iter().fold(c64::ONE, |f, [c1, c2, d1, d2]| f * quadratic(*c1, *c2) / quadratic(*d1, *d2))
    }
}

/// What the inputs move of the states on some of the lines: `(z I - A_b)^-1 B_b` of each block.
pub(crate) struct Moved {
    /// Per record, line by line and block by block, s x m.
    values: Vec<Vec<c64>>,
    /// Every how many lines.
    every: usize,
}

impl Moved {
    pub(crate) fn new(model: &Model, spectra: &Spectra) -> Self {
        let every = spectra.lines().div_ceil(LINES).max(1);
        let largest = model.blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let mut inverse = vec![c64::ZERO; largest * largest];
        let mut of_record = |lines: &Lines| {
            let mut out = Vec::with_capacity(lines.z.len().div_ceil(every) * model.order() * model.inputs);
            for z in lines.z.iter().step_by(every) {
                for block in &model.blocks {
                    let (s, m) = (block.states, model.inputs);
                    block.resolvent(*z, &mut inverse);
                    for (i, j) in (0..s).flat_map(|i| (0..m).map(move |j| (i, j))) {
                        let along = |sum: c64, l: usize| sum + inverse[i * s + l] * block.b[l * m + j];
                        out.push((0..s).fold(c64::ZERO, along));
                    }
                }
            }
            out
        };
        Moved { values: spectra.records.iter().map(&mut of_record).collect(), every }
    }
}

/// Of some of the lines how many of the full circle each stands for, power of the residual of these, and `|G_i|^2` of the blocks that are seen.
fn lines(
    (model, hidden): (&Model, &[usize]),
    (spectra, moved): (&Spectra, &Moved),
    residuals: &[Vec<c64>],
    output: usize,
) -> Vec<[f64; 3]> {
    let (p, m, every) = (spectra.outputs, spectra.inputs, moved.every);
    let mut out = Vec::with_capacity(LINES);
    let mut g = vec![c64::ZERO; m];
    for ((lines, v), x) in spectra.records.iter().zip(residuals).zip(&moved.values) {
        for (k, x) in (0..lines.z.len()).step_by(every).zip(x.chunks_exact(model.order() * m)) {
            g.fill(c64::ZERO);
            let mut at = 0;
            for (place, block) in model.blocks.iter().enumerate() {
                let s = block.states;
                if !hidden.contains(&place) {
                    for (j, g) in g.iter_mut().enumerate() {
                        (0..s).for_each(|i| *g += x[at + i * m + j] * block.c[output * s + i]);
                    }
                }
                at += s * m;
            }
            let gain = g.iter().map(|g| g.norm_sqr()).sum::<f64>();
            let (count, power) = (lines.share[k], lines.weight[k].powi(2) * v[k * p + output].norm_sqr());
            out.push([count * every as f64, power * every as f64, gain]);
        }
    }
    out
}

/// The most likely lambda; `None` where white noise alone has the lesser criterion of Schwarz.
fn size(lines: &[[f64; 3]], samples: f64) -> Option<f64> {
    let cost = |ratio: f64| {
        let (mut power, mut logarithms, mut count) = (0.0, 0.0, 0.0);
        for [of, energy, gain] in lines {
            let shape = 1.0 + ratio * gain;
            power += energy / shape;
            logarithms += of * shape.ln();
            count += of;
        }
        count * (power / count).ln() + logarithms
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
