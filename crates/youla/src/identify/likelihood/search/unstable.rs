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
//! which is x far outside and nearly constant inside. The mean and the ramp of a record are free as well, and the motions of several slow poles resemble
//! each other. All of these together have the volume of the functions `f_k(t)`, `t` from 0 to 1, of the nodes `0, 0, x_1, ..., x_n`,
//! ```text
//! 1/2 log det int f f' dt,      f = (1 0 ... 0) exp(t J),      J with the nodes on its diagonal and ones above
//! ```
//! that is of their exponentials over the Vandermonde determinant of the nodes: the derivative of a motion by its pole brings in the others as
//! `(p_i^t - p_j^t) / (p_i - p_j)`. The slope is half of N for one pole at 1, and nothing along a direction that moves no motion, such as that of two poles
//! that part. The residual there has the opposite mean slope: with w the slope of the residual v in log p,
//! which is minus the sum over the past of v in any loop that holds the output, and Q the projection on the free motions,
//! `E[w' (I - Q) v]` is minus the slope of the same term.
//!
//! The search has the first form, [`outside`]: over a whole record the second moves an estimate by a part of its deviation. Parts of records
//! that are compared at one model have the second, [`growth`]: the mean slopes of parts of other lengths differ.

use super::chart::Chart;
use super::model::Model;
use super::with_slope;
use crate::identify::likelihood::data::spectra::Spectra;
use faer::{Mat, Scale, c64};

/// Exponent `N log p` of a real pole from which the term counts: such a pole is slower than a third of the record, so that the loop is faster than
/// it. In a slower loop, and at a mode that the loop leaves alone, the residual of a stable pole has no slope.
const HELD: f64 = -3.0;
/// Angle over the record, rad, up to which a pole moves as a real one does.
const SLOW: f64 = 1.0;
/// Exponent above which a motion lies at the end of the record, apart from the slow ones.
const AT_THE_END: f64 = 40.0;
/// Times of a record at which motions are taken: a growth of 20 counts to 1 %.
const TIMES: usize = 64;
/// Terms of the exponential of `J / TIMES`, whose norm is below 2: the last is below 1e-17.
const TERMS: usize = 30;
/// Weight of the slope, in deviations of the parameters, up to which it counts: it is that of the poles in a loop that holds the output, to a few percent.
/// The error of one in ten is a deviation then. The residues of slow poles that nearly cancel have a slope too.
const LARGEST_WEIGHT: f64 = 10.0;
/// Exponents below which the function of one pole is a power series.
const SMALL: f64 = 0.1;

/// `N log |det A_u|`, half the term of -2 log likelihood.
pub(crate) fn outside(spectra: &Spectra, poles: &[c64]) -> f64 {
    spectra.samples() as f64 * poles.iter().map(|p| p.norm().ln().max(0.0)).sum::<f64>()
}

/// The same of poles near the circle too, summed over poles and records.
pub(crate) fn growth(spectra: &Spectra, poles: &[c64]) -> f64 {
    if !spectra.held {
        return 0.0;
    }
    let of_record = |samples: usize| {
        let exponents = poles.iter().map(|p| c64::new(p.norm().ln(), p.arg()) * samples as f64);
        let (slow, fast): (Vec<c64>, Vec<c64>) = exponents.partition(|x| x.im.abs() < SLOW && x.re < AT_THE_END);
        let slow: Vec<c64> = slow.into_iter().filter(|x| x.re > HELD).collect();
        volume(&slow) + fast.iter().map(|x| alone(x.re.max(0.0))).sum::<f64>()
    };
    spectra.records.iter().map(|lines| of_record(lines.samples)).sum()
}

/// Logarithm of the volume of the motions of slow poles beside the mean and the ramp of a record.
fn volume(slow: &[c64]) -> f64 {
    if slow.is_empty() {
        return 0.0;
    }
    let count = slow.len() + 2;
    let mut j = Mat::from_fn(count, count, |i, k| if k == i + 1 { 1.0 } else { 0.0 });
    let mut at = 2;
    for x in slow.iter().filter(|x| x.im >= 0.0) {
        j[(at, at)] = x.re;
        if x.im > 0.0 {
            (j[(at + 1, at + 1)], j[(at + 1, at)]) = (x.re, -x.im * x.im);
        }
        at += if x.im > 0.0 { 2 } else { 1 };
    }
    let (step, half) = (exponential(&j * Scale(1.0 / TIMES as f64)), exponential(j * Scale(0.5 / TIMES as f64)));
    let mut motions = Mat::zeros(TIMES, count);
    motions.row_mut(0).copy_from(half.row(0));
    for t in 1..TIMES {
        let next = motions.row(t - 1) * &step;
        motions.row_mut(t).copy_from(next);
    }
    let factor = motions.qr();
    (0..count).map(|k| factor.thin_R()[(k, k)].abs().ln()).sum()
}

/// The exponential of a small matrix, by its series.
fn exponential(a: Mat<f64>) -> Mat<f64> {
    let one = Mat::<f64>::identity(a.nrows(), a.nrows());
    (1..=TERMS).rev().fold(one.clone(), |sum, k| &one + &a * sum * Scale(1.0 / k as f64))
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

/// Slope of either in the parameters, by differences.
pub(crate) fn slope(of: fn(&Spectra, &[c64]) -> f64, spectra: &Spectra, model: &Model, chart: &Chart) -> Vec<f64> {
    let mut out = vec![0.0; chart.parameters()];
    let longest = spectra.records.iter().map(|lines| lines.samples).max().unwrap_or(1) as f64;
    let step = 1e-6_f64.min(0.01 / longest);
    let poles: Vec<Vec<c64>> = model.blocks.iter().map(|block| block.poles()).collect();
    let mut at = 0;
    for (place, block) in model.blocks.iter().enumerate() {
        if of(spectra, &poles[place]) != 0.0 {
            let others = || poles.iter().enumerate().filter(|(k, _)| *k != place).flat_map(|(_, of)| of).copied();
            for q in 0..chart.parameters_of(place) {
                let shifted = |sign: f64| {
                    let mut moved = block.clone();
                    moved.a.iter_mut().enumerate().for_each(|(i, a)| *a += sign * step * chart.direction(place, i, q));
                    of(spectra, &moved.poles().into_iter().chain(others()).collect::<Vec<c64>>())
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
    let before = factor.col(factor.ncols() - 1).to_owned();
    let mut factor = with_slope(factor, &slope(growth, spectra, model, chart));
    let last = factor.ncols() - 1;
    // R'^-1 times the slope: along it nothing is known where the slope weighs more than it is known to.
    let along = factor.col(last) - before;
    let weight = along.squared_norm_l2();
    if weight > LARGEST_WEIGHT * LARGEST_WEIGHT {
        let share = (along.transpose() * factor.col(last)) / weight;
        along.iter().enumerate().for_each(|(i, w)| factor[(i, last)] -= share * w);
    }
    factor
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

    /// The sum over the past of a motion, `(L v)(t) = sum of p^(t-1-s) v(s)` over s < t, and Q the projection on all free motions: the slope of the growth
    /// is `tr(Q L)`, of one pole and of three that are close to each other. The sum of slopes of single poles is off by half of N.
    #[test]
    fn the_slope_of_the_growth_is_that_of_the_free_motions() {
        let samples = 400;
        let record = Mat::zeros(samples, 1);
        let unit = Sizes { u: vec![1.0], y: vec![1.0] };
        let spectra = Spectra::new(&[Experiment::new(record.as_ref(), record.as_ref())], &unit, &[0], 0);
        for poles in [vec![1.001], vec![0.996], vec![0.995, 0.999, 1.0002], vec![0.9985, 0.9995]] {
            let free = Mat::from_fn(samples, poles.len() + 2, |t, k| match k {
                0 => 1.0,
                1 => t as f64 / samples as f64,
                k => f64::powi(poles[k - 2], t as i32),
            });
            let basis = free.qr().compute_thin_Q();
            for (i, pole) in poles.iter().enumerate() {
                let past = |k: usize| {
                    let mut sums = vec![0.0; samples];
                    (1..samples).for_each(|t| sums[t] = pole * sums[t - 1] + basis[(t - 1, k)]);
                    sums
                };
                let trace = |k: usize| past(k).iter().enumerate().map(|(t, sum)| sum * basis[(t, k)]).sum::<f64>();
                let exact: f64 = (0..basis.ncols()).map(trace).sum();
                let of = |h: f64| {
                    let moved = poles.iter().enumerate().map(|(k, p)| c64::new(if k == i { p + h } else { *p }, 0.0));
                    growth(&spectra, &moved.collect::<Vec<_>>())
                };
                let found = (of(1e-6) - of(-1e-6)) / 2e-6;
                assert!((found - exact).abs() < 0.02 * samples as f64, "{poles:?} {i}: {found} {exact}");
            }
        }
    }

    /// The function of one pole is the same to rounding on both sides of the end of its series, and its slope at zero is one half.
    #[test]
    fn the_function_of_one_pole_is_smooth() {
        for x in [-SMALL, SMALL] {
            let step = 1e-9 * x;
            assert!((alone(x - step) - alone(x + step)).abs() < 3.0 * step.abs());
        }
        assert!((alone(1e-4) - alone(-1e-4) - 1e-4).abs() < 1e-12);
    }
}
