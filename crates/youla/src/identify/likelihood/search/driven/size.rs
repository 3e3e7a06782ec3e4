//! The most likely size of noise at the inputs, of one output.

use super::gains::{Gains, LINES};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::autoregression::Regression;
use faer::c64;

/// Steps of the logarithm of that size: the likelihood is flat to a quarter of a nat.
const STEPS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];
/// A product from which the next factor might lead out of the range of numbers.
const LARGE: f64 = 1e100;

/// Size lambda of such noise in the residual of an output, with an autoregression behind it; `None` where white noise alone has the lesser criterion
/// of Schwarz.
pub(super) fn ratio(
    (spectra, gains): (&Spectra, &Gains),
    residual: &[Vec<c64>],
    (output, behind): (usize, &Regression),
) -> Option<f64> {
    size(&lines((spectra, gains), residual, (output, behind)), spectra.samples() as f64).1
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

/// The most likely lambda, and its cost; `None` where white noise alone has the lesser criterion of Schwarz.
pub(super) fn size(lines: &[[f64; 3]], samples: f64) -> (f64, Option<f64>) {
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
    (best.0, best.1.is_finite().then(|| best.1.exp()))
}
