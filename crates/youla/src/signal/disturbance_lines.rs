//! Removal of the lines of a disturbance from the inputs and outputs of a loop: unbalance, gears, mains.

use super::lines::{SpectralLine, Spectrum, spectral_lines};
use crate::lti::Discrete;
use crate::{Mat, MatRef};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// Rounds of search: the strongest lines hide weaker ones nearby, and a line that wanders leaves lines beside it.
const ROUNDS: usize = 6;
/// Bins within which power that is left belongs to a line that was taken out.
const SAME_LINE: usize = 10;
/// Modulations of a line that is found again, doubled each time, and the most: `+- 4` bins, so that resonances stay.
const FIRST_MODULATIONS: usize = 4;
const MOST_MODULATIONS: usize = 8;
/// Harmonics of the lowest line that are looked for where they do not fall off as a line does.
const HARMONICS: usize = 6;
/// Steps of the golden section for the frequency of a line within a bin on each side: 1e-6 of a bin.
const STEPS: usize = 30;
/// What is left of an output below this share of it is rounding.
const ROUNDING: f64 = 1e-9;
/// Lines of the transform over which the response to the excitation is a polynomial, for each of its channels.
const LOCAL: usize = 40;

/// A line to be taken out, with its slow changes: `cos(pi j t / N)` times cosine and sine, `j = 0..=modulations`.
struct Wandering {
    line: SpectralLine,
    modulations: usize,
}

/// Takes the lines of the outputs that no known signal has out of inputs and outputs: cosine and sine at each frequency, with slow
/// changes where a line wanders, by least squares.
///
/// A disturbance at one frequency reaches the inputs through the feedback; what is left of inputs and outputs without it obeys the
/// same equation of the plant. Lines are looked for in what the known signals do not explain of the outputs, by local polynomials in
/// frequency. Returns the lines that were taken out.
pub fn take_out_lines(
    (u, y): (&mut Mat<f64>, &mut Mat<f64>),
    known: MatRef<'_, f64>,
    time: Discrete,
    false_alarm: f64,
) -> Vec<SpectralLine> {
    let columns: Vec<Vec<f64>> = known.col_iter().map(|column| column.iter().copied().collect()).collect();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let bin = 1.0 / (y.nrows().max(1) as f64 * time.ts());
    let (first_u, first_y) = (u.clone(), y.clone());
    let mut taken: Vec<Wandering> = Vec::new();
    for _ in 0..ROUNDS {
        let (mut found, mut wandering): (Vec<SpectralLine>, Vec<usize>) = (Vec::new(), Vec::new());
        for (values, column) in unexplained(y.as_ref(), known).into_iter().zip(first_y.col_iter()) {
            let left = values.iter().map(|v| v * v).sum::<f64>().sqrt();
            let Some(spectrum) = Spectrum::new(&values).filter(|_| left > ROUNDING * column.norm_l2()) else {
                continue;
            };
            let threshold = spectrum.threshold(false_alarm);
            let stays = |w: &Wandering| {
                let at = (w.line.hz / bin) as usize;
                (at.saturating_sub(SAME_LINE)..=at + SAME_LINE).any(|k| spectrum.ratio(k) > threshold)
            };
            wandering.extend((0..taken.len()).filter(|k| stays(&taken[*k])));
            let lowest = taken.iter().map(|w| w.line.hz).fold(f64::INFINITY, f64::min);
            let harmonics = (2..=HARMONICS).filter_map(|m| spectrum.at(lowest * m as f64 / bin, threshold, m));
            let harmonics = harmonics.map(|line| SpectralLine { hz: line.hz * bin, ..line });
            for line in spectral_lines(&values, &columns, time, false_alarm).into_iter().chain(harmonics) {
                let near = |hz: f64, bins: usize| (hz - line.hz).abs() < bins as f64 * bin;
                match found.iter_mut().find(|f| near(f.hz, 2)) {
                    _ if taken.iter().any(|w| near(w.line.hz, SAME_LINE)) => {}
                    Some(same) if same.ratio >= line.ratio => {}
                    Some(same) => *same = refined(&values, line, time),
                    None => found.push(refined(&values, line, time)),
                }
            }
        }
        wandering.sort_unstable();
        wandering.dedup();
        wandering.retain(|k| taken[*k].modulations < MOST_MODULATIONS);
        if found.is_empty() && wandering.is_empty() {
            break;
        }
        wandering.iter().for_each(|k| taken[*k].modulations = (2 * taken[*k].modulations).max(FIRST_MODULATIONS));
        taken.extend(found.into_iter().map(|line| Wandering { line, modulations: 0 }));
        let shapes = shapes(&taken, y.nrows(), time);
        (*u, *y) = (without(first_u.as_ref(), &shapes), without(first_y.as_ref(), &shapes));
    }
    taken.into_iter().map(|w| w.line).collect()
}

/// What the known signals leave of each output: in every group of lines `Y_k = sum_a (c0 + c1 s + c2 s^2) X_ka + V_k`, s the place in the group.
fn unexplained(y: MatRef<'_, f64>, known: MatRef<'_, f64>) -> Vec<Vec<f64>> {
    let n = y.nrows();
    let mut planner = FftPlanner::new();
    let mut transformed = |signal: MatRef<'_, f64>| -> Vec<Vec<Complex<f64>>> {
        let of = |column: faer::ColRef<'_, f64>| {
            let mut work: Vec<Complex<f64>> = column.iter().map(|v| Complex::new(*v, 0.0)).collect();
            planner.plan_fft_forward(n).process(&mut work);
            work
        };
        signal.col_iter().map(of).collect()
    };
    let (x, mut y) = (transformed(known), transformed(y));
    let (half, size) = (n / 2, LOCAL * x.len().max(1));
    for first in (1..=half).step_by(size) {
        let count = size.min(half + 1 - first);
        let place = |k: usize| 2.0 * k as f64 / count as f64 - 1.0;
        let regressors = Mat::from_fn(count, 3 * x.len(), |k, c| x[c / 3][first + k] * place(k).powi((c % 3) as i32));
        if count <= regressors.ncols() {
            continue;
        }
        let q = regressors.qr().compute_thin_Q();
        for column in &mut y {
            let values = Mat::from_fn(count, 1, |k, _| column[first + k]);
            let left = &values - &q * (q.adjoint() * &values);
            (0..count).for_each(|k| column[first + k] = left[(k, 0)]);
        }
    }
    let back = |mut work: Vec<Complex<f64>>| {
        work[0] = Complex::new(0.0, 0.0);
        (1..n.div_ceil(2)).for_each(|k| work[n - k] = work[k].conj());
        planner.plan_fft_inverse(n).process(&mut work);
        work.into_iter().map(|v| v.re / n as f64).collect()
    };
    y.into_iter().map(back).collect()
}

/// The frequency at which the windowed transform is largest.
fn refined(values: &[f64], line: SpectralLine, time: Discrete) -> SpectralLine {
    let n = values.len() as f64;
    let power = |hz: f64| {
        let turn = TAU * (hz * time.ts());
        let window = |k: f64| 0.5 - 0.5 * (TAU * k / n).cos();
        let at = |(k, v): (usize, &f64)| Complex::from_polar(v * window(k as f64), -turn * k as f64);
        values.iter().enumerate().map(at).sum::<Complex<f64>>().norm_sqr()
    };
    let bin = 1.0 / (n * time.ts());
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (line.hz - bin, line.hz + bin);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut of_a, mut of_b) = (power(a), power(b));
    for _ in 0..STEPS {
        if of_a > of_b {
            (high, b, of_b) = (b, a, of_a);
            a = high - golden * (high - low);
            of_a = power(a);
        } else {
            (low, a, of_a) = (a, b, of_b);
            b = low + golden * (high - low);
            of_b = power(b);
        }
    }
    SpectralLine { hz: 0.5 * (low + high), ..line }
}

/// Orthonormal columns that span the lines with their changes.
fn shapes(lines: &[Wandering], samples: usize, time: Discrete) -> Mat<f64> {
    let columns: Vec<(f64, usize)> =
        lines.iter().flat_map(|w| (0..=w.modulations).map(|j| (w.line.hz * time.ts(), j))).collect();
    let all = Mat::from_fn(samples, 2 * columns.len(), |k, c| {
        let (turns, j) = columns[c / 2];
        let (sin, cos) = (TAU * (turns * k as f64).fract()).sin_cos();
        let slow = (std::f64::consts::PI * j as f64 * k as f64 / samples as f64).cos();
        slow * if c % 2 == 0 { cos } else { sin }
    });
    all.qr().compute_thin_Q()
}

fn without(signal: MatRef<'_, f64>, shapes: &Mat<f64>) -> Mat<f64> {
    signal - shapes * (shapes.transpose() * signal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// A line between bins in a white signal of the same size leaves less than the noise of a bin.
    #[test]
    fn a_line_is_taken_out_of_inputs_and_outputs() {
        let time = Discrete::new(1e-3).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut noise = || rng.sample::<f64, _>(StandardNormal);
        let line = |k: usize| (TAU * 50.0137 * k as f64 * 1e-3).sin();
        let clean = [Mat::from_fn(8000, 1, |_, _| noise()), Mat::from_fn(8000, 1, |_, _| noise())];
        let mut u = Mat::from_fn(8000, 1, |k, _| clean[0][(k, 0)] - 0.3 * line(k));
        let mut y = Mat::from_fn(8000, 1, |k, _| clean[1][(k, 0)] + line(k));
        let taken = take_out_lines((&mut u, &mut y), Mat::zeros(8000, 0).as_ref(), time, 1e-3);
        assert!(taken.len() == 1 && (taken[0].hz - 50.0137).abs() < 1e-3, "{taken:?}");
        for (signal, clean) in [(u, &clean[0]), (y, &clean[1])] {
            let left = (&signal - clean).norm_l2() / clean.norm_l2();
            assert!(left < 3.0 * (2.0_f64 / 8000.0).sqrt(), "{left}");
        }
    }
}
