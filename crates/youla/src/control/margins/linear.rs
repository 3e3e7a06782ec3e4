//! The derivative of the margins of a loop, each of its worst channel, by the plant.
//!
//! To first order a margin follows from the closed loop H, (v1, n) to (u, y), at its own critical frequency w. dH is the change of
//! the response there, S the diagonal entry of a channel (its sensitivity, `L = 1 - 1/S`), S' = dS/dw:
//!
//! ```text
//! peak       sigma_max of a part of H:     sigma_max(H + dH) - sigma_max(H): w moves, but sigma is stationary in it
//! disk       1 / |S - 1/2|, likewise
//! coprime    1 / sigma_max of H - [I 0; 0 0] in scaled channels, likewise
//! gain       Im S = 0,   k = S / (S - 1):  dw = -Im dS / Im S',   dk   = -(Re dS + Re S' dw) / (S - 1)^2
//! phase      Re S = 1/2, phi = arg L:      dw = -Re dS / Re S',   dphi = -(Im dS + Im S' dw) / |S|^2
//! delay      tau = phi / w:                                       dtau = (dphi - tau dw) / w
//! ```
//!
//! With `dS = S (S - 1) dL/L` these are `d ln k = -Re(dL/L + L'/L dw)` and `dphi = Im(dL/L + L'/L dw)`; S has no poles on the stability
//! boundary where L may have them. At frequency zero and at the end S is real for every plant, and dw is zero. Which channel
//! and which crossing is worst does not change to first order, unless two are equally bad: there a margin has no derivative.

use super::worst::{Critical, FIGURES, Kind, critical};
use super::{Margins, channel};
use crate::control::{ChannelScales, closed_loop, with_input_port};
use crate::linalg::{block, eye};
use crate::lti::{Curve, StateSpace, TimeDomain, largest_singular_direction};
use crate::{Mat, MatRef, Result, c64};

/// Margins with what their first derivative needs.
pub struct LinearMargins {
    scales: Option<ChannelScales>,
    inputs: usize,
    points: [Option<Point>; FIGURES],
    end: f64,
}

/// A margin with the response of the closed loop at its critical frequency, and the slope dS/dw of its channel.
struct Point {
    margin: Critical,
    response: Mat<c64>,
    slope: c64,
}

impl LinearMargins {
    /// The exact margins of a plant under `u = K y`, which are those of [`super::margins()`], and their derivative.
    ///
    /// # Errors
    /// As [`super::margins()`].
    pub fn new<T: TimeDomain>(
        margins: &Margins,
        plant: &StateSpace<T>,
        controller: &StateSpace<T>,
        scales: Option<&ChannelScales>,
    ) -> Result<Self> {
        let ports = with_input_port(controller)?;
        let closed = closed_loop(plant, &ports)?;
        let curve = Curve::new(&closed)?;
        let point = |margin: Critical| -> Result<Point> {
            let slope = match margin.kind {
                Kind::Gain(i) | Kind::Phase(i) | Kind::Delay(i) => slope(&closed, i, margin.frequency)?,
                Kind::Peak(_) | Kind::Disk(_) | Kind::Coprime => c64::ZERO,
            };
            Ok(Point { response: curve.at(margin.frequency)?, slope, margin })
        };
        let mut points = [const { None }; FIGURES];
        for (place, margin) in points.iter_mut().zip(critical(margins, plant, controller, scales)?) {
            *place = margin.map(point).transpose()?;
        }
        Ok(LinearMargins { scales: scales.cloned(), inputs: plant.inputs(), points, end: curve.end() })
    }

    /// Margin, and its standard deviation for an error of the plant's response. In the order of [`super::MARGIN_NAMES`]; `None` where there is
    /// no margin. `deviation` gives that of `Re sum_ij w_ij dG_ij` from the frequency in rad/s and w, p x m.
    ///
    /// ```text
    /// dH = H_n dG H_u,        H_n: columns of H from n,  H_u: rows of H to u
    /// ```
    ///
    /// # Errors
    /// Those of singular values.
    pub fn deviations(&self, deviation: impl Fn(f64, MatRef<'_, c64>) -> f64) -> Result<[Option<(f64, f64)>; FIGURES]> {
        let mut figures = [None; FIGURES];
        for (figure, point) in figures.iter_mut().zip(&self.points) {
            let Some(point) = point else { continue };
            let (left, right) = self.sides(point)?;
            let (h, m) = (&point.response, self.inputs);
            let (left, right) = (left * h.subcols(m, h.ncols() - m), h.subrows(0, m) * right);
            let slopes = left.transpose() * right.transpose();
            *figure = Some((point.margin.value, deviation(point.margin.frequency, slopes.as_ref())));
        }
        Ok(figures)
    }

    /// The row l and the column r by which a margin changes by `Re l dH r`.
    fn sides(&self, point: &Point) -> Result<(Mat<c64>, Mat<c64>)> {
        let (h, ports) = (&point.response, point.response.nrows());
        Ok(match &point.margin.kind {
            Kind::Peak(range) => {
                let part = h.submatrix(range.start, range.start, range.len(), range.len());
                let (_, u, v) = largest_singular_direction(part)?;
                let place =
                    |v: &Mat<c64>, k: usize| if range.contains(&k) { v[(k - range.start, 0)] } else { c64::ZERO };
                (Mat::from_fn(1, ports, |_, k| place(&u, k).conj()), Mat::from_fn(ports, 1, |k, _| place(&v, k)))
            }
            Kind::Coprime => {
                let (sigma, u, v) = largest_singular_direction(self.gang(h.as_ref()).as_ref())?;
                let left = |k: usize| u[(k, 0)].conj() * (-1.0 / (sigma * sigma * self.size(k)));
                (Mat::from_fn(1, ports, |_, k| left(k)), Mat::from_fn(ports, 1, |k, _| v[(k, 0)] * self.size(k)))
            }
            Kind::Gain(i) | Kind::Phase(i) | Kind::Delay(i) | Kind::Disk(i) => {
                let slope = self.slope_in_entry(point, h[(*i, *i)]);
                let at = |k: usize, value: c64| if k == *i { value } else { c64::ZERO };
                (Mat::from_fn(1, ports, |_, k| at(k, slope)), Mat::from_fn(ports, 1, |k, _| at(k, c64::ONE)))
            }
        })
    }

    /// The slope c by which a margin of one channel changes by `Re c dS`.
    fn slope_in_entry(&self, point: &Point, s: c64) -> c64 {
        let Point { margin: Critical { value, frequency, kind }, slope, .. } = point;
        let inside = *frequency > 0.0 && *frequency < self.end;
        let change = |ds: c64| match kind {
            Kind::Gain(_) => {
                let dw = if inside { -ds.im / slope.im } else { 0.0 };
                -(ds.re + slope.re * dw) / (s.re - 1.0).powi(2)
            }
            Kind::Phase(_) => {
                let (_, shift) = crossover(s, ds, *slope);
                (channel::loop_phase(s).signum() * shift).to_degrees()
            }
            // A loop gain of 1 or more up to the end of all frequencies.
            Kind::Delay(_) if !inside => 0.0,
            Kind::Delay(_) => {
                let (dw, shift) = crossover(s, ds, *slope);
                (shift - value * dw) / frequency
            }
            Kind::Disk(_) | Kind::Peak(_) | Kind::Coprime => {
                let apart = s - 0.5;
                -(apart.re * ds.re + apart.im * ds.im) / apart.norm().powi(3)
            }
        };
        c64::new(change(c64::ONE), -change(c64::new(0.0, 1.0)))
    }

    /// Size of a channel over (u, y).
    fn size(&self, k: usize) -> f64 {
        match &self.scales {
            Some(scales) if k < self.inputs => scales.inputs()[k],
            Some(scales) => scales.outputs()[k - self.inputs],
            None => 1.0,
        }
    }

    /// `[I; K] (I - G K)^-1 [I, G]` in scaled channels, its inputs and outputs in the order of H.
    fn gang(&self, h: MatRef<'_, c64>) -> Mat<c64> {
        Mat::from_fn(h.nrows(), h.ncols(), |i, j| {
            let through = if i == j && i < self.inputs { 1.0 } else { 0.0 };
            (h[(i, j)] - through) * (self.size(j) / self.size(i))
        })
    }
}

/// `(dw, dphi)` of a crossover.
fn crossover(s: c64, ds: c64, slope: c64) -> (f64, f64) {
    let dw = -ds.re / slope.re;
    (dw, -(ds.im + slope.im * dw) / (s.re * s.re + s.im * s.im))
}

/// `dS/dw = -C (s I - A)^-2 B ds/dw` of a diagonal entry; zero at infinity.
fn slope<T: TimeDomain>(closed: &StateSpace<T>, channel: usize, frequency: f64) -> Result<c64> {
    if frequency.is_infinite() {
        return Ok(c64::ZERO);
    }
    let s = closed.part(channel..channel + 1, channel..channel + 1).balanced()?;
    let (n, none) = (s.order(), Mat::<f64>::zeros(s.order(), s.order()));
    let twice = StateSpace::new(
        block(&[&[s.a(), eye(n).as_ref()], &[none.as_ref(), s.a()]]),
        block(&[&[Mat::zeros(n, 1).as_ref()], &[s.b()]]),
        block(&[&[s.c(), Mat::zeros(1, n).as_ref()]]),
        Mat::zeros(1, 1),
        s.time(),
    )?;
    let direction = match s.time().sample_time() {
        Some(ts) => c64::new(0.0, ts) * s.time().boundary(frequency),
        None => c64::new(0.0, 1.0),
    };
    Ok(-direction * Curve::new(&twice)?.at(frequency)?[(0, 0)])
}

#[cfg(test)]
mod tests {
    use super::super::margins;
    use super::super::tests::random_loop;
    use super::*;
    use crate::lti::{Continuous, Discrete};
    use faer::Scale;

    /// Places of the disk margin and of the coprime margin.
    const DISK: usize = 6;
    const COPRIME: usize = 7;

    fn exact<T: TimeDomain>(plant: &StateSpace<T>, k: &StateSpace<T>, scales: &ChannelScales) -> [f64; FIGURES] {
        critical(&margins(plant, k).unwrap(), plant, k, Some(scales))
            .unwrap()
            .map(|margin| margin.map_or(f64::NAN, |m| m.value))
    }

    /// The deviation for one error of the plant is the slope of the exact margins along that error, by central differences.
    fn check<T: TimeDomain>(time: T, seeds: &[u64]) {
        let mut compared = [0; FIGURES];
        for &seed in seeds {
            let (plant, k) = random_loop(seed, time);
            let ports = plant.inputs();
            let scales = ChannelScales::new(vec![2.0; ports], vec![0.3; ports]).unwrap();
            let moved = |step: f64| {
                let change = |x: MatRef<'_, f64>, phase: f64| {
                    let change = Mat::from_fn(x.nrows(), x.ncols(), |i, j| ((3 * i + 7 * j) as f64 + phase).sin());
                    x + Scale(step * x.norm_max()) * change
                };
                let (a, b, c) = (change(plant.a(), 0.3), change(plant.b(), 1.1), change(plant.c(), 2.2));
                StateSpace::new(a, b, c, plant.d().to_owned(), time).unwrap()
            };
            // Richardson's extrapolation takes the third derivative out.
            let better = |fine: f64, coarse: f64| fine + (fine - coarse) / 3.0;
            let slope = |h: f64| {
                let (up, down) = (exact(&moved(h), &k, &scales), exact(&moved(-h), &k, &scales));
                std::array::from_fn::<f64, FIGURES, _>(|k| (up[k] - down[k]) / (2.0 * h))
            };
            let (fine, coarse, here) = (slope(1e-4), slope(2e-4), exact(&plant, &k, &scales));
            let response = |step: f64, w: f64| Curve::new(&moved(step)).unwrap().at(w).unwrap();
            let change = |w: f64| (response(1e-5, w) - response(-1e-5, w)) * Scale(c64::new(5e4, 0.0));
            let along = |change: Mat<c64>, slopes: MatRef<'_, c64>| {
                let entries = change.col_iter().zip(slopes.col_iter()).flat_map(|(a, b)| a.iter().zip(b.iter()));
                entries.map(|(change, slope)| (change * slope).re).sum::<f64>().abs()
            };
            let deviation = |w: f64, slopes: MatRef<'_, c64>| along(change(w), slopes);
            let linear = LinearMargins::new(&margins(&plant, &k).unwrap(), &plant, &k, Some(&scales)).unwrap();
            let deviations = linear.deviations(deviation).unwrap();
            for (place, figure) in deviations.into_iter().enumerate() {
                let direct = better(fine[place], coarse[place]).abs();
                let Some((value, deviation)) = figure else {
                    assert!(here[place].is_nan(), "seed {seed}, figure {place}");
                    continue;
                };
                assert_eq!(value, here[place]);
                if direct.is_finite() {
                    compared[place] += 1;
                    let error = (deviation - direct).abs();
                    // The disk margin is that of a bound of its peak, within 1e-4; the coprime margin that of an upper bound within a
                    // few 1e-9, which is a few 1e-5 of a difference over steps of 1e-4.
                    let tolerance = match place {
                        DISK => 1e-3,
                        COPRIME => 1e-4,
                        _ => 1e-5,
                    };
                    assert!(error <= tolerance * direct, "seed {seed}, figure {place}: {deviation} against {direct}");
                }
            }
        }
        assert!(compared.iter().all(|count| *count >= 3), "{compared:?}");
    }

    /// Of five continuous and six discrete loops.
    #[test]
    fn a_deviation_is_the_slope_of_the_exact_margins_along_the_error() {
        // Continuous loop 3 is so near to instability that differences would need smaller steps.
        check(Continuous, &[0, 1, 2, 4, 5]);
        check(Discrete::new(0.01).unwrap(), &[0, 1, 2, 3, 4, 5]);
    }
}
