//! What poles near and outside the unit circle add to the likelihood of residuals on lines.
//!
//! `Y - G U` exists on the unit circle for poles outside too. The predictor differs from it by an all-pass with their mirror images, whose
//! gain `|det A_u|` appears in the likelihood: `N log |p|` for each pole p of a record of N samples that is long beside the growth.
//!
//! A pole near the circle, as that of an integrator, is between the two. The ends of a record take its free motion `p^t` for whatever
//! fits best, so that the likelihood of what is left (H. D. Patterson, R. Thompson, Recovery of inter-block information when block sizes are
//! unequal, Biometrika 58 (1971), 545) has half the logarithm of the squared length of this motion, with `x = N log |p|`
//! ```text
//! 1/2 log ((e^2x - 1) / 2x)  =  x/2 + 1/2 log (sinh x / x)
//! ```
//! which is x far outside and nearly constant inside. The mean and the ramp of a record are free as well. Beside them the motion of a real
//! pole near 1 has the length of what Legendre's polynomials of degree 0 and 1 leave of it, with modified spherical Bessel functions `i_j`,
//! ```text
//! x/2 + 1/2 log (720 (sinh x / x - i_0(x/2)^2 - 3 i_1(x/2)^2) / x^4)
//! ```
//! The slope of either is half of N at `|p| = 1`. The residual there has the opposite mean slope: with w the slope of the residual v in log p,
//! which is minus the sum over the past of v in any loop that holds the output, and Q the projection on the free motions,
//! `E[w' (I - Q) v]` is minus the slope of the same term.
//!
//! The search has the first form, [`outside`]: over a whole record the second moves an estimate by a part of its deviation. Parts of records
//! that are compared at one model have the second, [`growth`]: the mean slopes of parts of other lengths differ.

use super::chart::Chart;
use super::model::Model;
use super::with_slope;
use crate::identify::likelihood::data::spectra::Spectra;
use faer::{Mat, c64};

/// Exponent `N log p` of a real pole from which the term counts: such a pole is slower than a third of the record, so that the loop is faster than
/// it. In a slower loop, and at a mode that the loop leaves alone, the residual of a stable pole has no slope.
const HELD: f64 = -3.0;
/// Angle over the record, rad, up to which a pole moves as a real one does.
const SLOW: f64 = 1.0;
/// Step of the second differences: the terms bend over 1 to 4.
const CURVED: f64 = 0.25;
/// Exponents below which the functions are power series.
const SMALL: f64 = 0.1;
const SMALL_BESIDE_RAMP: f64 = 4.0;
/// Terms of the longer series: the last is below 1e-16 of the first.
const TERMS: i32 = 16;

/// `N log |det A_u|`, half the term of -2 log likelihood.
pub(crate) fn outside(spectra: &Spectra, poles: &[c64]) -> f64 {
    spectra.samples() as f64 * poles.iter().map(|p| p.norm().ln().max(0.0)).sum::<f64>()
}

/// The same of poles near the circle too, summed over poles and records.
pub(crate) fn growth(spectra: &Spectra, poles: &[c64]) -> f64 {
    let of = |p: &c64, samples: usize| {
        let (x, angle) = (samples as f64 * p.norm().ln(), samples as f64 * p.arg());
        let slow = angle.abs() < SLOW;
        let (term, from): (fn(f64) -> f64, f64) = if slow { (beside_ramp, HELD) } else { (alone, 0.0) };
        if !spectra.held || x <= from {
            return 0.0;
        }
        let bend = if slow { 0.5 * curvature(term, x) * angle * angle } else { 0.0 };
        term(x) - term(from) - bend
    };
    let of_record = |samples: usize| poles.iter().map(|p| of(p, samples)).sum::<f64>();
    spectra.records.iter().map(|lines| of_record(lines.samples)).sum()
}

/// Second derivative of a term: two real poles that meet go on as a pair, and the sum of their terms as `2 f(x) - f''(x) angle^2`.
fn curvature(term: fn(f64) -> f64, x: f64) -> f64 {
    (term(x + CURVED) - 2.0 * term(x) + term(x - CURVED)) / (CURVED * CURVED)
}

/// `x/2 + 1/2 log (sinh x / x)`.
fn alone(x: f64) -> f64 {
    let a = x.abs();
    let even = if a < SMALL {
        (1.0 + a * a / 6.0 * (1.0 + a * a / 20.0)).ln()
    } else {
        a + (-(-2.0 * a).exp_m1() / (2.0 * a)).ln()
    };
    0.5 * (x + even)
}

/// `x/2 + 1/2 log (720 (sinh x / x - i_0(x/2)^2 - 3 i_1(x/2)^2) / x^4)`. Near zero, where the closed form loses digits that its slope needs,
/// the argument of the logarithm is the series `720 sum of (q - 1) (q - 4) (q - 6) x^(q - 8) / q!` over even q from 8 on.
fn beside_ramp(x: f64) -> f64 {
    let a = x.abs();
    let even = if a < SMALL_BESIDE_RAMP {
        let (mut sum, mut power) = (0.0, 720.0 / 40320.0);
        for q in (8..8 + 2 * TERMS).step_by(2).map(f64::from) {
            sum += (q - 1.0) * (q - 4.0) * (q - 6.0) * power;
            power *= a * a / ((q + 1.0) * (q + 2.0));
        }
        sum.ln()
    } else {
        // Each part times e^-a.
        let (e, z) = ((-a).exp(), 0.5 * a);
        let mean = (1.0 - e) / a;
        let ramp = 0.5 * (z * (1.0 + e) - (1.0 - e)) / (z * z);
        a + (720.0 * (0.5 * (1.0 - e * e) / a - mean * mean - 3.0 * ramp * ramp) / a.powi(4)).ln()
    };
    0.5 * (x + even)
}

/// Slope of either in the parameters, by differences.
pub(crate) fn slope(of: fn(&Spectra, &[c64]) -> f64, spectra: &Spectra, model: &Model, chart: &Chart) -> Vec<f64> {
    let mut out = vec![0.0; chart.parameters()];
    let longest = spectra.records.iter().map(|lines| lines.samples).max().unwrap_or(1) as f64;
    let step = 1e-6_f64.min(0.01 / longest);
    let mut at = 0;
    for (place, block) in model.blocks.iter().enumerate() {
        if of(spectra, &block.poles()) > 0.0 {
            for q in 0..chart.parameters_of(place) {
                let shifted = |sign: f64| {
                    let mut moved = block.clone();
                    moved.a.iter_mut().enumerate().for_each(|(i, a)| *a += sign * step * chart.direction(place, i, q));
                    of(spectra, &moved.poles())
                };
                out[at + q] = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
            }
        }
        at += chart.parameters_of(place);
    }
    out
}

/// `[R r]` of a point whose residual goes with the slope of the growth: parts of the records with other excitations would seem to disagree
/// without it.
pub(crate) fn with_slope_of_growth(factor: Mat<f64>, spectra: &Spectra, model: &Model, chart: &Chart) -> Mat<f64> {
    with_slope(factor, &slope(growth, spectra, model, chart))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::data::spectra::Sizes;
    use crate::identify::likelihood::search::linearise::linearise;
    use crate::identify::likelihood::search::noise::Noise;
    use crate::identify::likelihood::search::with_best_ends;
    use crate::identify::subspace::Experiment;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SAMPLES: usize = 1000;
    const RECORDS: usize = 400;

    /// Records of `x(t+1) = p x + u`, `u = -0.3 y` without excitation: mean slopes of half of the sum of squares and of the growth.
    fn mean_slopes(pole: f64) -> [f64; 2] {
        let rng = &mut ChaCha8Rng::seed_from_u64(11);
        let (mut u, mut y) = (Mat::zeros(RECORDS * SAMPLES, 1), Mat::zeros(RECORDS * SAMPLES, 1));
        let mut x = 0.0;
        for t in 0..u.nrows() {
            y[(t, 0)] = x + rng.sample::<f64, _>(StandardNormal);
            u[(t, 0)] = -0.3 * y[(t, 0)];
            x = pole * x + u[(t, 0)];
        }
        let record = |k: usize| Experiment::new(u.subrows(SAMPLES * k, SAMPLES), y.subrows(SAMPLES * k, SAMPLES));
        let records: Vec<Experiment<'_>> = (0..RECORDS).map(record).collect();
        let unit = Sizes { u: vec![1.0], y: vec![1.0] };
        let spectra = Spectra::new(&records, &unit, &[0], 0);
        let (one, white) = (Mat::<f64>::identity(1, 1), Noise::white(1));
        let model = Model::of((&one * pole).as_ref(), one.as_ref(), one.as_ref(), vec![0.0]).unwrap();
        let point = with_best_ends(&spectra, model, &white);
        // A alone moves.
        let mut chart = Chart::fixed(&point.model);
        chart.directions[0] = Mat::from_fn(3, 1, |i, _| if i == 0 { 1.0 } else { 0.0 });
        let factor = linearise(&spectra, &point, &chart, &white).factor;
        let squares = factor[(0, 0)] * factor[(0, 1)];
        [squares, slope(growth, &spectra, &point.model, &chart)[0]].map(|v| v / (RECORDS * SAMPLES) as f64)
    }

    /// The two slopes are equal within 0.025 of the number of samples from the integrator to 20 growths outside. Without the term the residual of an
    /// integrator draws its pole by half of that number.
    #[test]
    fn the_growth_makes_residuals_of_marginal_and_unstable_plants_unbiased() {
        for pole in [0.998, 0.999, 1.0 - 1e-8, 1.0 + 1e-8, 1.001, 1.004, 1.01, 1.02] {
            let [squares, growth] = mean_slopes(pole);
            assert!((squares - growth).abs() < 0.025, "{pole}: {squares} {growth}");
        }
    }

    /// Two poles near 1 in one block, from a real pair through a double pole to a complex one: the slope of the growth in an entry of A that
    /// makes them meet is smooth. It was 1e9 where they met.
    #[test]
    fn poles_that_meet_have_a_smooth_growth() {
        let record = Mat::zeros(SAMPLES, 1);
        let unit = Sizes { u: vec![1.0], y: vec![1.0] };
        let spectra = Spectra::new(&[Experiment::new(record.as_ref(), record.as_ref())], &unit, &[0], 0);
        let ones = Mat::from_fn(2, 1, |_, _| 1.0);
        let slope_at = |squared: f64| {
            // Poles 0.9995 +- sqrt(squared).
            let a = Mat::from_fn(2, 2, |i, j| [[0.9995, 1e-3], [1e3 * squared, 0.9995]][i][j]);
            let model = Model::of(a.as_ref(), ones.as_ref(), ones.transpose(), vec![0.0]).unwrap();
            assert_eq!(model.blocks.len(), 1);
            let of = |a: f64| {
                let mean = 0.9995;
                let root = c64::new(a, 0.0).sqrt();
                growth(&spectra, &[mean + root, mean - root])
            };
            let (h, chart) = (1e-12, Chart::by_outputs(&model, false));
            let largest = slope(growth, &spectra, &model, &chart).iter().fold(0.0_f64, |most, s| most.max(s.abs()));
            ((of(squared + h) - of(squared - h)) / (2.0 * h), largest)
        };
        let slopes: Vec<(f64, f64)> = [-4e-8, -1e-8, -1e-10, 0.0, 1e-10, 1e-8, 4e-8].map(slope_at).to_vec();
        for pair in slopes.windows(2) {
            assert!((pair[0].0 / pair[1].0 - 1.0).abs() < 0.05, "{slopes:?}");
        }
        assert!(slopes.iter().all(|(_, largest)| *largest < 1e4), "{slopes:?}");
    }

    /// Both functions are the same to rounding on both sides of the end of their series, and their slope at zero is one half.
    #[test]
    fn functions_are_smooth() {
        for (term, small) in [(alone as fn(f64) -> f64, SMALL), (beside_ramp, SMALL_BESIDE_RAMP)] {
            for x in [-small, small] {
                let step = 1e-9 * x;
                assert!((term(x - step) - term(x + step)).abs() < 3.0 * step.abs());
            }
            assert!((term(1e-4) - term(-1e-4) - 1e-4).abs() < 1e-12);
        }
    }
}
