//! The derivative of the margins of a loop, each of its worst channel, by the plant.
//!
//! To first order a margin follows from the closed loop H, (v1, n) to (u, y), at its own critical frequency w. dH is the change of
//! the response there, S the diagonal entry of a channel (its sensitivity, `L = 1 - 1/S`), S' = dS/dw:
//!
//! ```text
//! peak       sigma_max of a part of H:     sigma_max(H + dH) - sigma_max(H): w moves, but sigma is stationary in it
//! coprime    1 / sigma_max of H - [I 0; 0 0] in scaled channels, likewise
//! gain       Im S = 0,   k = S / (S - 1):  dw = -Im dS / Im S',   dk   = -(Re dS + Re S' dw) / (S - 1)^2
//! phase      Re S = 1/2, phi = arg L:      dw = -Re dS / Re S',   dphi = -(Im dS + Im S' dw) / |S|^2
//! delay      tau = phi / w:                                       dtau = (dphi - tau dw) / w
//! ```
//!
//! With `dS = S (S - 1) dL/L` these are `d ln k = -Re(dL/L + L'/L dw)` and `dphi = Im(dL/L + L'/L dw)`; S has no poles on the stability
//! boundary where L may have them. At frequency zero and at the end S is real for every plant, and dw is zero. Which channel
//! and which crossing is worst does not change to first order, unless two are equally bad: there a margin has no derivative.

use super::channel;
use super::worst::{Critical, FIGURES, Kind, WorstMargins, critical};
use crate::control::{ChannelScales, closed_loop, with_input_port};
use crate::linalg::{block, eye};
use crate::lti::{Curve, Partitioned, StateSpace, TimeDomain, largest_singular_value};
use crate::{Error, Mat, MatRef, Result, c64};

/// Margins with what their first derivative needs.
pub struct LinearMargins<T: TimeDomain> {
    controller: Partitioned<T>,
    scales: Option<ChannelScales>,
    points: [Option<Point>; FIGURES],
    end: f64,
}

/// A margin with the response of the closed loop at its critical frequency, and the slope dS/dw of its channel.
struct Point {
    margin: Critical,
    response: Mat<c64>,
    slope: c64,
}

impl<T: TimeDomain> LinearMargins<T> {
    /// The exact margins of a plant under `u = K y`, and their derivative.
    ///
    /// # Errors
    /// As [`super::margins()`].
    pub fn new(plant: &StateSpace<T>, controller: &StateSpace<T>, scales: Option<&ChannelScales>) -> Result<Self> {
        let ports = with_input_port(controller)?;
        let closed = closed_loop(plant, &ports)?;
        let curve = Curve::new(&closed)?;
        let point = |margin: Critical| -> Result<Point> {
            let slope = match margin.kind {
                Kind::Gain(i) | Kind::Phase(i) | Kind::Delay(i) => slope(&closed, i, margin.frequency)?,
                Kind::Peak(_) | Kind::Coprime => c64::ZERO,
            };
            Ok(Point { response: curve.at(margin.frequency)?, slope, margin })
        };
        let mut points = [const { None }; FIGURES];
        for (place, margin) in points.iter_mut().zip(critical(plant, controller, scales)?) {
            *place = margin.map(point).transpose()?;
        }
        Ok(LinearMargins { controller: ports, scales: scales.cloned(), points, end: curve.end() })
    }

    /// The margins of a plant near by, to first order in the change of its loop; those of the plant itself exactly.
    ///
    /// # Errors
    /// Ports, sample times, [`Error::AlgebraicLoop`] and those of the response.
    pub fn at(&self, plant: &StateSpace<T>) -> Result<WorstMargins> {
        let curve = Curve::new(&closed_loop(plant, &self.controller)?)?;
        let mut figures = [None; FIGURES];
        for (figure, point) in figures.iter_mut().zip(&self.points) {
            if let Some(point) = point {
                let moved = curve.at(point.margin.frequency)?;
                *figure = Some(point.margin.value + self.change(point, moved.as_ref(), plant.inputs())?);
            }
        }
        Ok(WorstMargins::of_figures(figures))
    }

    fn change(&self, point: &Point, moved: MatRef<'_, c64>, inputs: usize) -> Result<f64> {
        let Point { margin: Critical { value, frequency, kind }, response, slope } = point;
        let inside = *frequency > 0.0 && *frequency < self.end;
        let of = |i: usize| (response[(i, i)], moved[(i, i)] - response[(i, i)]);
        Ok(match kind {
            Kind::Peak(ports) => {
                let part = |h: MatRef<'_, c64>| {
                    largest_singular_value(h.submatrix(ports.start, ports.start, ports.len(), ports.len()))
                };
                part(moved)? - part(response.as_ref())?
            }
            Kind::Coprime => {
                let margin = |h| Ok::<f64, Error>(1.0 / largest_singular_value(self.gang(h, inputs).as_ref())?);
                margin(moved)? - margin(response.as_ref())?
            }
            Kind::Gain(i) => {
                let (s, ds) = of(*i);
                let dw = if inside { -ds.im / slope.im } else { 0.0 };
                -(ds.re + slope.re * dw) / (s.re - 1.0).powi(2)
            }
            Kind::Phase(i) => {
                let (s, ds) = of(*i);
                let (_, shift) = crossover(s, ds, *slope);
                (channel::loop_phase(s).signum() * shift).to_degrees()
            }
            // A loop gain of 1 or more up to the end of all frequencies.
            Kind::Delay(_) if !inside => 0.0,
            Kind::Delay(i) => {
                let (s, ds) = of(*i);
                let (dw, shift) = crossover(s, ds, *slope);
                (shift - value * dw) / frequency
            }
        })
    }

    /// `[I; K] (I - G K)^-1 [I, G]` in scaled channels, its inputs and outputs in the order of H.
    fn gang(&self, h: MatRef<'_, c64>, inputs: usize) -> Mat<c64> {
        let size = |k: usize| match &self.scales {
            Some(scales) if k < inputs => scales.inputs()[k],
            Some(scales) => scales.outputs()[k - inputs],
            None => 1.0,
        };
        Mat::from_fn(h.nrows(), h.ncols(), |i, j| {
            let through = if i == j && i < inputs { 1.0 } else { 0.0 };
            (h[(i, j)] - through) * (size(j) / size(i))
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
    use super::super::tests::random_loop;
    use super::*;
    use crate::lti::{Continuous, Discrete};
    use faer::Scale;

    fn figures(m: WorstMargins) -> [f64; FIGURES] {
        let all = [
            m.output_sensitivity,
            m.all_outputs_sensitivity,
            m.lowest_gain,
            m.highest_gain,
            m.phase_degrees,
            m.delay,
            m.coprime,
        ];
        all.map(|figure| figure.unwrap_or(f64::NAN))
    }

    /// The derivative in one direction against central differences of the exact margins.
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
            let exact = |step: f64| figures(WorstMargins::of(&moved(step), &k, Some(&scales)).unwrap());
            let linear = LinearMargins::new(&plant, &k, Some(&scales)).unwrap();
            let by_points = |step: f64| figures(linear.at(&moved(step)).unwrap());
            let here = by_points(0.0);
            for (place, value) in exact(0.0).into_iter().enumerate() {
                assert!(value.is_nan() && here[place].is_nan() || value == here[place], "{seed} {place}");
            }
            let slope = |of: &dyn Fn(f64) -> [f64; FIGURES], h: f64| {
                let (up, down) = (of(h), of(-h));
                std::array::from_fn::<f64, FIGURES, _>(|k| (up[k] - down[k]) / (2.0 * h))
            };
            let (fine, coarse) = (slope(&exact, 1e-4), slope(&exact, 2e-4));
            let (by_points, coarse_points) = (slope(&by_points, 1e-4), slope(&by_points, 2e-4));
            for place in 0..FIGURES {
                // Richardson's extrapolation takes the third derivative out.
                let better = |fine: f64, coarse: f64| fine + (fine - coarse) / 3.0;
                let direct = better(fine[place], coarse[place]);
                let linear = better(by_points[place], coarse_points[place]);
                if direct.is_finite() {
                    compared[place] += 1;
                    let error = (linear - direct).abs();
                    assert!(error <= 1e-6 * direct.abs(), "seed {seed}, figure {place}: {linear} against {direct}");
                } else {
                    assert!(linear.is_nan(), "seed {seed}, figure {place}");
                }
            }
        }
        assert!(compared.iter().all(|count| *count >= 3), "{compared:?}");
    }

    /// To 1e-6, most of them to 1e-8: of five continuous and six discrete loops.
    #[test]
    fn the_derivative_is_that_of_the_exact_margins() {
        // Continuous loop 3 is so near to instability that differences would need smaller steps.
        check(Continuous, &[0, 1, 2, 4, 5]);
        check(Discrete::new(0.01).unwrap(), &[0, 1, 2, 3, 4, 5]);
    }
}
